# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sums of costs stop at the greatest number that their type holds."""

import pytest

from warp_rt.kernels.aov import add_capped
from warp_rt.warp_setup import init_warp

init_warp()
GREATEST = 2**31 - 1


@pytest.mark.parametrize(
    ("a", "b"),
    [(0, 0), (3, 4), (GREATEST - 5, 5), (GREATEST - 5, 6), (GREATEST, 0), (GREATEST, GREATEST), (0, GREATEST)],
)
def test_sum_is_capped(a, b):
    assert add_capped(a, b) == min(a + b, GREATEST)
