# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""OpenEXR's images of luminance and chroma, the latter at half the resolution as a rule, to colours.

Reference: OpenEXR, Technical Introduction, Luminance/Chroma Images.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pxr import Gf

LUMINANCE_CHROMA = ("Y", "RY", "BY")
_REC709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)


def from_chroma(
    luminance: np.ndarray, red: np.ndarray, blue: np.ndarray, chromaticities: Sequence[float] | None
) -> list[np.ndarray]:
    """Return red, green and blue of luminance Y, (R - Y) / Y and (B - Y) / Y.

    Args:
        luminance: Shape [height, width].
        red: Likewise, or of every so many texels each way, the first among them.
        blue: Likewise.
        chromaticities: x and y of red, green, blue and white; None: those of Rec. 709.

    Raises:
        ValueError: The resolutions do not fit.
    """
    x, y = (chromaticities or _REC709)[::2], (chromaticities or _REC709)[1::2]
    primaries = [Gf.Vec2f(*pair) for pair in zip(x, y, strict=True)]
    share = np.array(Gf.ColorSpace("", *primaries, 1.0, 0.0).GetRGBToXYZ())[1]
    red, blue = ((_spread(plane, luminance.shape) + 1) * luminance for plane in (red, blue))
    return [red, (luminance - share[0] * red - share[2] * blue) / share[1], blue]


def _spread(plane: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return a plane at full resolution: linear between its texels."""
    for axis, size in enumerate(shape):
        count = plane.shape[axis]
        if size % count:
            raise ValueError(f"{count} texels of chroma for {size}")
        place = np.arange(size) * (count / size)
        first = place.astype(int)
        part = np.expand_dims(place - first, 1 - axis)
        plane = plane.take(first, axis) * (1 - part) + plane.take(np.minimum(first + 1, count - 1), axis) * part
    return plane
