# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Image pyramids: an image at half its width and height, at a quarter, and so on down to one texel.

Reference: Williams (1983), Pyramidal Parametrics, SIGGRAPH 83.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from warp_rt.srgb import linear_from_srgb, srgb_from_linear

_BLOCK = 1 << 22  # texels of the base that are decoded at a time
_STEPS = 1 << 16  # of linear light that sRGB codes are looked up from: 20 a code where codes lie closest
_SRGB_CODES = np.rint(srgb_from_linear(np.linspace(0.0, 1.0, _STEPS + 1)) * 255).astype(np.uint8)
_LINEAR_VALUES = {
    False: (np.arange(256) / 255.0).astype(np.float32),
    True: linear_from_srgb(np.arange(256) / 255.0).astype(np.float32),
}


def coarser_levels(pixels: np.ndarray, *, is_srgb: bool) -> Iterator[np.ndarray]:
    """Yield the levels of an image's pyramid below the image itself, the last being a single texel.

    A side of n texels has (n + 1) // 2 on the next level. Every texel is the mean, in linear light, of exactly the part
    of the image that it covers: where a side is odd, texels that straddle two share themselves out. So means stay what
    they are at every level, whatever the size, and no border shifts.

    Args:
        pixels: uint8 or float32, shape [height, width, 4].
        is_srgb: Whether red, green and blue are sRGB encoded. Levels are encoded as the image is.
    """
    if pixels.shape[:2] == (1, 1):
        return
    level = _first_level(pixels, is_srgb)
    while True:
        yield _encode(level, pixels.dtype, is_srgb)
        if level.shape[:2] == (1, 1):
            return
        level = halve(halve(level, 0), 1)


def _first_level(pixels: np.ndarray, is_srgb: bool) -> np.ndarray:
    """Return the first coarser level in linear light, float32; the image is decoded some rows at a time."""
    height, width = pixels.shape[:2]
    rows, columns = (height + 1) // 2, (width + 1) // 2
    level = np.empty((rows, columns, 4), np.float32)
    step = max(_BLOCK // (2 * width), 1)
    for first in range(0, rows, step):
        last = min(first + step, rows)
        low, high = first * height // rows, -(-last * height // rows)
        block = decode(pixels[low:high], is_srgb)
        level[first:last] = halve(_rows_of(block, first, last, height, low), 1)
    return level


def halve(level: np.ndarray, axis: int) -> np.ndarray:
    """Return a linear level, shape [height, width, 4], at half its height (axis 0) or width (1), rounded up."""
    if axis == 0:
        return _rows_of(level, 0, (len(level) + 1) // 2, len(level), 0)
    return np.swapaxes(halve(np.swapaxes(level, 0, 1), 0), 0, 1)


def _rows_of(texels: np.ndarray, first: int, last: int, count: int, low: int) -> np.ndarray:
    """Return rows ``first`` to ``last`` of the next level, halved along axis 0.

    Args:
        texels: Rows of this level, the first being row ``low``.
        first: First row that is wanted.
        last: One past the last.
        count: Rows of the whole level.
        low: See above.
    """
    half = (count + 1) // 2
    if count == 2 * half:
        pairs = texels[2 * first - low : 2 * last - low]
        return (pairs[0::2] + pairs[1::2]) * np.float32(0.5)
    # Row j covers [j, j + 1) count / half: parts of up to three rows. In units of 1 / half all is whole numbers.
    j = np.arange(first, last)
    start, end = j * count, (j + 1) * count
    row = start // half
    total = np.zeros((len(j), *texels.shape[1:]), np.float32)
    for k in range(3):
        covered = np.minimum(end, (row + k + 1) * half) - np.maximum(start, (row + k) * half)
        weight = (np.maximum(covered, 0) / count).astype(np.float32).reshape(-1, *([1] * (texels.ndim - 1)))
        total += texels[np.minimum(row + k - low, len(texels) - 1)] * weight
    return total


def decode(texels: np.ndarray, is_srgb: bool) -> np.ndarray:
    """Return texels, shape [height, width, 4], in linear light, float32."""
    if texels.dtype == np.uint8:
        linear = _LINEAR_VALUES[is_srgb][texels]
        if is_srgb:
            linear[..., 3] = _LINEAR_VALUES[False][texels[..., 3]]
        return linear
    if not is_srgb:
        return texels
    return np.concatenate([linear_from_srgb(texels[..., :3]).astype(np.float32), texels[..., 3:]], axis=-1)


def _encode(level: np.ndarray, dtype: np.dtype, is_srgb: bool) -> np.ndarray:
    if dtype == np.uint8:
        codes = np.rint(level * 255).astype(np.uint8)
        if is_srgb:
            codes[..., :3] = _SRGB_CODES[np.rint(level[..., :3] * _STEPS).astype(np.int32)]
        return codes
    if not is_srgb:
        return level
    return np.concatenate([srgb_from_linear(level[..., :3]).astype(np.float32), level[..., 3:]], axis=-1)
