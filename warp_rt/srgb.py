# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The sRGB transfer curve, both ways."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

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
