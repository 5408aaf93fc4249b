# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A film that memory cannot hold is a limit that was hit, told with the size it takes."""

import pytest
import warp as wp

from warp_rt.errors import LimitError
from warp_rt.rendering.film_buffers import make_film_buffers
from warp_rt.warp_setup import init_warp

SIDE = 65536


def _without_memory(*args: object, **kwargs: object) -> None:
    raise RuntimeError("Failed to allocate 68719476736 bytes on device 'cpu'")


@pytest.mark.parametrize("allocate", ["zeros", "full"])
def test_failed_allocation_tells_how_much_is_needed(allocate: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Colour and alpha take 16 bytes a pixel, depth 4, a normal 12; 2^32 pixels."""
    init_warp()
    monkeypatch.setattr(wp, "zeros", lambda **_: wp.empty(shape=(1, 1), dtype=wp.vec4, device="cpu"))
    monkeypatch.setattr(wp, allocate, _without_memory)
    with pytest.raises(LimitError, match=r"^film: 65536 x 65536 pixels need 128\.0 GiB, more than cpu can give$"):
        make_film_buffers(("color", "depth", "normal"), (0, 0, SIDE, SIDE), "cpu")
