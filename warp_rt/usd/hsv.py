# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Hue, saturation and value: all three from 0 to 1, red having the hue 0.

Reference: Smith (1978), Color Gamut Transform Pairs, SIGGRAPH 78.
"""

from __future__ import annotations

import numpy as np


def hsv_from_rgb(rgb: np.ndarray) -> np.ndarray:
    """Return hue, saturation and value of colours, shape [n, 3]; the hue of greys is 0."""
    value, least = rgb.max(axis=1), rgb.min(axis=1)
    chroma = value - least
    scale = np.where(chroma > 0, chroma, 1.0)
    red, green, blue = rgb.T
    hue = np.select(
        [red == value, green == value],
        [(green - blue) / scale, 2.0 + (blue - red) / scale],
        4.0 + (red - green) / scale,
    )
    hue = np.where(chroma > 0, hue / 6.0, 0.0) % 1.0
    saturation = np.where(value > 0, chroma / np.where(value > 0, value, 1.0), 0.0)
    return np.stack([hue, saturation, value], axis=1)


def rgb_from_hsv(hsv: np.ndarray) -> np.ndarray:
    """Return the colours of hues, saturations and values, shape [n, 3]; hues go round."""
    hue, saturation, value = hsv.T
    turns = np.stack([hue + 1.0, hue + 2.0 / 3.0, hue + 1.0 / 3.0], axis=1) % 1.0
    share = np.clip(np.abs(turns * 6.0 - 3.0) - 1.0, 0.0, 1.0)
    return np.asarray(value[:, None] * (1.0 - saturation[:, None] * (1.0 - share)))


def adjusted_hsv(rgb: np.ndarray, amount: np.ndarray) -> np.ndarray:
    """Return colours with the hue turned, and saturation and value multiplied, by ``amount``; all of shape [n, 3]."""
    hsv = hsv_from_rgb(rgb)
    return rgb_from_hsv(np.stack([hsv[:, 0] + amount[:, 0], hsv[:, 1] * amount[:, 1], hsv[:, 2] * amount[:, 2]], 1))
