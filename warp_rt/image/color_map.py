# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""One number as a colour."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

_START = 0.5  # hue at the dark end: 1 is red, 2 green, 3 blue
_ROTATIONS = -1.5  # through the hues, from dark to bright
_SATURATION = 1.0
# Two directions across the grey axis, in both of which the brightness stays as it is.
_ACROSS = np.array([[-0.14861, 1.78277], [-0.29227, -0.90649], [1.97294, 0.0]])


def cubehelix(values: ArrayLike) -> np.ndarray:
    """Return display colours whose brightness grows evenly from black to white: uint8, shape [..., 3].

    So a picture in these colours stays right in print and for eyes that tell hues apart badly.

    Args:
        values: 0 to 1; what lies outside is taken for the nearer end.

    Reference: Green (2011), A colour scheme for the display of astronomical intensity images, Bulletin of the
    Astronomical Society of India 39, section 2; start, rotations and hue by default.
    """
    level = np.clip(np.asarray(values, np.float64), 0.0, 1.0)
    angle = 2.0 * np.pi * (_START / 3.0 + _ROTATIONS * level)
    reach = 0.5 * _SATURATION * level * (1.0 - level)
    colors = level[..., None] + reach[..., None] * (np.stack([np.cos(angle), np.sin(angle)], axis=-1) @ _ACROSS.T)
    return np.round(255.0 * np.clip(colors, 0.0, 1.0)).astype(np.uint8)
