# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Hue, saturation and value: all three from 0 to 1, red having the hue 0.

Reference: Smith (1978), Color Gamut Transform Pairs, SIGGRAPH 78.
"""

from __future__ import annotations

import numpy as np

from warp_rt.usd.signals import Signal, add, apply, choose, join, multiply, steps_of

_ZERO, _ONE = (Signal.constant([value]) for value in (0.0, 1.0))


def hsv_from_rgb(rgb: np.ndarray) -> np.ndarray:
    """Return hue, saturation and value of colours, shape [n, 3]; greys, and what is not bright, have the hue 0."""
    value, least = rgb.max(axis=1), rgb.min(axis=1)
    chroma = value - least
    scale = np.where(chroma > 0, chroma, 1.0)
    red, green, blue = rgb.T
    hue = np.select(
        [red == value, green == value],
        [(green - blue) / scale, 2.0 + (blue - red) / scale],
        4.0 + (red - green) / scale,
    )
    hue = np.where((chroma > 0) & (value > 0), hue / 6.0, 0.0) % 1.0
    saturation = np.where(value > 0, chroma / np.where(value > 0, value, 1.0), 0.0)
    return np.stack([hue, saturation, value], axis=1)


@steps_of(hsv_from_rgb)
def _hsv_from_rgb_steps(rgb: Signal) -> Signal:
    red, green, blue = (rgb.pick([k]) for k in range(3))
    value = apply(np.maximum, apply(np.maximum, red, green), blue)
    chroma = add(value, apply(np.minimum, apply(np.minimum, red, green), blue), -1.0)
    is_colored = apply(np.greater, chroma, _ZERO)
    share = apply(np.reciprocal, choose(is_colored, chroma, _ONE))

    def part(first: Signal, second: Signal, turn: float) -> Signal:
        return add(multiply(add(first, second, -1.0), share), Signal.constant([turn]))

    below = choose(apply(np.equal, green, value), part(blue, red, 2.0), part(red, green, 4.0))
    hue = choose(apply(np.equal, red, value), part(green, blue, 0.0), below)
    is_bright = apply(np.greater, value, _ZERO)
    is_of_a_hue = multiply(is_colored, is_bright)
    hue = apply(np.mod, choose(is_of_a_hue, hue.map(np.array([[1.0 / 6.0]])), _ZERO), _ONE)
    saturation = choose(is_bright, multiply(chroma, apply(np.reciprocal, choose(is_bright, value, _ONE))), _ZERO)
    return join([hue, saturation, value])


def rgb_from_hsv(hsv: np.ndarray) -> np.ndarray:
    """Return the colours of hues, saturations and values, shape [n, 3]; hues go round, and no saturation is below 0."""
    hue, saturation, value = hsv[:, 0], np.maximum(hsv[:, 1], 0.0), hsv[:, 2]
    turns = np.stack([hue + 1.0, hue + 2.0 / 3.0, hue + 1.0 / 3.0], axis=1) % 1.0
    share = np.clip(np.abs(turns * 6.0 - 3.0) - 1.0, 0.0, 1.0)
    return np.asarray(value[:, None] * (1.0 - saturation[:, None] * (1.0 - share)))


@steps_of(rgb_from_hsv)
def _rgb_from_hsv_steps(hsv: Signal) -> Signal:
    hue, value = hsv.pick([0]), hsv.pick([2])
    saturation = apply(np.maximum, hsv.pick([1]), _ZERO)
    turns = apply(np.mod, hue.map(np.ones((3, 1)), np.array((1.0, 2.0 / 3.0, 1.0 / 3.0))), _ONE)
    share = add(apply(np.abs, turns.map(6.0 * np.eye(3), -3.0)), _ONE, -1.0)
    rest = add(_ONE, apply(np.clip, share, _ZERO, _ONE), -1.0)
    return multiply(value, add(_ONE, multiply(saturation, rest), -1.0))


def adjusted_hsv(rgb: np.ndarray, amount: np.ndarray) -> np.ndarray:
    """Return colours with the hue turned, and saturation and value multiplied, by ``amount``; all of shape [n, 3]."""
    hsv = hsv_from_rgb(rgb)
    return rgb_from_hsv(np.stack([hsv[:, 0] + amount[:, 0], hsv[:, 1] * amount[:, 1], hsv[:, 2] * amount[:, 2]], 1))


@steps_of(adjusted_hsv)
def _adjusted_hsv_steps(rgb: Signal, amount: Signal) -> Signal:
    hsv = _hsv_from_rgb_steps(rgb)
    scaled = multiply(hsv.pick([1, 2]), amount.pick([1, 2]))
    return _rgb_from_hsv_steps(join([add(hsv.pick([0]), amount.pick([0])), scaled]))
