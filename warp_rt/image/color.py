# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From linear radiance to display pixels: exposure, the sRGB curve, straight alpha."""

from __future__ import annotations

import numpy as np

from warp_rt.image.tone import check_display
from warp_rt.srgb import srgb_from_linear


def unpremultiply(color: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Return straight colour: premultiplied colour over its alpha; where alpha is 0, colour as it is.

    Args:
        color: Premultiplied, shape [height, width, 3].
        alpha: Coverage, shape [height, width].
    """
    return color / np.where(alpha > 0.0, alpha, 1.0)[..., None]


def display(linear: np.ndarray, *, exposure: float = 0.0, tonemap: str = "srgb") -> np.ndarray:
    """Return 8-bit display values, uint8, of the shape given.

    Values are exposed, curved, clamped to [0, 1] and rounded; not-a-number becomes black.

    Args:
        linear: Linear Rec. 709, any shape.
        exposure: Stops; each doubles the light.
        tonemap: One of ``tone.TONE_MAPS``.

    Raises:
        OptionError: The exposure or the tone map cannot be used.
    """
    check_display(exposure, tonemap)
    # fmax and fmin, unlike clip, let the number win over not-a-number.
    exposed = np.fmin(np.fmax(linear * 2.0**exposure, 0.0), 1.0)
    encoded = srgb_from_linear(exposed) if tonemap == "srgb" else exposed
    return np.round(255.0 * encoded).astype(np.uint8)
