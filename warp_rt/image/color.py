# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From linear radiance to display pixels: exposure, the sRGB curve, straight alpha."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warp_rt.image.tone import check_display

# IEC 61966-2-1:1999, section 5.2, as amended: the line below and the power curve above meet at these two points.
_LINEAR_KNEE = 0.0031308
_ENCODED_KNEE = 0.04045


def srgb_from_linear(linear: ArrayLike) -> np.ndarray:
    """Return sRGB-encoded values: the piecewise curve, not a plain power of 2.2.

    Args:
        linear: Rec. 709 linear light, any shape; 1 is white. Negative values follow the curve's linear segment.

    Reference: IEC 61966-2-1:1999, section 5.2.
    """
    values = np.asarray(linear, np.float64)
    power = 1.055 * np.maximum(values, _LINEAR_KNEE) ** (1.0 / 2.4) - 0.055
    return np.where(values <= _LINEAR_KNEE, 12.92 * values, power)


def linear_from_srgb(encoded: ArrayLike) -> np.ndarray:
    """Return linear light: the inverse of :func:`srgb_from_linear`.

    Args:
        encoded: sRGB values, any shape, 1 is white.

    Reference: IEC 61966-2-1:1999, section 5.2.
    """
    values = np.asarray(encoded, np.float64)
    power = ((np.maximum(values, _ENCODED_KNEE) + 0.055) / 1.055) ** 2.4
    return np.where(values <= _ENCODED_KNEE, values / 12.92, power)


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
