# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What mirror rays leave of a lobe."""

import pytest

from warp_rt.kernels.response import mirror_share
from warp_rt.warp_setup import init_warp

init_warp()


def test_mirror_share_fades_between_its_bounds() -> None:
    assert [mirror_share(r) for r in (0.0, 0.1, 0.4, 1.0)] == [1.0, 1.0, 0.0, 0.0]
    assert mirror_share(0.25) == pytest.approx(0.5)
