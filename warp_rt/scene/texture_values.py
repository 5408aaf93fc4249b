# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Textures evaluated on the host, in float64: what the kernels' ``eval_texture`` gives where no footprint is filtered.

Displacement needs it before there are rays; tests compare the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from warp_rt.scene import Image, MagFilter, Texture, Wrap
from warp_rt.srgb import linear_from_srgb

_Taps = list[tuple[np.ndarray, np.ndarray]]
_SEAM = 1e-5  # tiles, or parts of a coordinate beyond the first: kernels/constants.py has the same


def texture_values(texture: Texture, images: Sequence[Image], coordinates: np.ndarray) -> np.ndarray:
    """Return decode(texel) * scale + bias, as is between texels; the unscaled fallback without an image.

    Args:
        texture: Which.
        images: Rows that ``Texture.image`` counts.
        coordinates: Texture coordinates before the texture's transform, shape [n, 2]. What is not finite after it
            counts as 0; on tiles it is on none.

    Returns:
        float64, shape [n, 4].

    Reference: UsdPreviewSurface Specification, UsdUVTexture.
    """
    if texture.image < 0:
        return np.tile(np.asarray(texture.fallback, np.float64), (len(coordinates), 1))
    transform = texture.uv_transform.astype(np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        uv = coordinates.astype(np.float64) @ transform[:, :2].T + transform[:, 2]
    found = _image_values if texture.tiles is None else _tile_values
    return found(texture, images, uv) * texture.scale + texture.bias


def decoded_texels(pixels: np.ndarray, *, is_srgb: bool) -> np.ndarray:
    """Return texels as linear values, float64, shape [..., 4]; alpha is never decoded."""
    if pixels.dtype == np.uint8:
        codes = np.arange(256) / 255
        texels = codes[pixels]
        if is_srgb:
            texels[..., :3] = linear_from_srgb(codes)[pixels[..., :3]]
        return texels
    texels = pixels.astype(np.float64)
    if is_srgb:
        texels[..., :3] = linear_from_srgb(texels[..., :3])
    return texels


def grid_values(pixels: np.ndarray, s: np.ndarray, t: np.ndarray, texture: Texture) -> np.ndarray:
    """Return an image at all places of a grid, as ``texture_values`` does at single ones.

    Args:
        pixels: Decoded texels, shape [height, width, 4].
        s: Places across, in the image, shape [n].
        t: Places upwards, shape [m].
        texture: How it is read beyond its edges and between texels.

    Returns:
        Of the type of ``pixels``, shape [m, n, 4].
    """
    height, width = pixels.shape[:2]
    lines = _between(pixels, 0, _texels(t, height, texture.wrap_t, texture.mag_filter))
    return _between(lines, 1, _texels(s, width, texture.wrap_s, texture.mag_filter))


def _between(texels: np.ndarray, axis: int, taps: _Taps) -> np.ndarray:
    """Return what is between rows, or columns, of texels; those of index -1 are black."""
    total: np.ndarray | float = 0.0
    for index, weight in taps:
        kept = np.where(index >= 0, weight, 0).astype(texels.dtype)
        total = total + texels.take(index, axis) * np.expand_dims(kept, (1, 2) if axis == 0 else (0, 2))
    return np.asarray(total, texels.dtype)


def _image_values(texture: Texture, images: Sequence[Image], uv: np.ndarray) -> np.ndarray:
    """Return decoded values, float64, shape [n, 4]."""
    uv = np.where(np.isfinite(uv), uv, 0.0)
    pixels = images[texture.image].pixels
    columns, rows = (
        _texels(uv[:, axis], pixels.shape[1 - axis], wrap, texture.mag_filter)
        for axis, wrap in enumerate((texture.wrap_s, texture.wrap_t))
    )
    total = np.zeros((len(uv), 4))
    for y, height in rows:
        for x, width in columns:
            total += _fetch(pixels, x, y, texture) * (width * height)[:, None]
    return total


def _tile_values(texture: Texture, images: Sequence[Image], uv: np.ndarray) -> np.ndarray:
    """Return decoded values of UDIM tiles, float64, shape [n, 4]: nothing where there is none.

    Where there is none, on the edge of one to within rounding, it is that one, for seams end there.
    """
    tiles = texture.tiles
    found = np.zeros((len(uv), 4))
    is_done = np.zeros(len(uv), bool)
    if tiles is None:
        return found
    grid = [(image, row, column) for row, images_ in enumerate(tiles.images) for column, image in enumerate(images_)]
    in_grid = uv - (tiles.left, tiles.bottom)
    edge = _SEAM * np.maximum(np.abs(in_grid), 1.0)
    for is_exact in (True, False):
        for image, row, column in grid:
            if image < 0:
                continue
            place = in_grid - (column, row)
            if is_exact:
                is_here = ((place >= 0) & (place < 1)).all(axis=1)
            else:
                is_here = (np.abs(place - 0.5) <= 0.5 + edge).all(axis=1)
            chosen = np.flatnonzero(is_here & ~is_done)
            one = replace(texture, image=image, tiles=None, wrap_s=Wrap.CLAMP, wrap_t=Wrap.CLAMP)
            found[chosen] = _image_values(one, images, place[chosen])
            is_done[chosen] = True
    return found


def _texels(s: np.ndarray, size: int, wrap: Wrap, mag_filter: MagFilter) -> _Taps:
    """Return the texels that count at coordinates along an axis, -1 for black, and their weights."""
    period = {Wrap.REPEAT: 1.0, Wrap.MIRROR: 2.0}.get(wrap)
    s = np.clip(s, -2.0, 3.0) if period is None else s - period * np.floor(s / period)
    x = s * size - 0.5
    first = np.floor(x + 0.5 if mag_filter == MagFilter.NEAREST else x).astype(np.int64)
    t = x - first
    weights = [1.0 - t, t]
    if mag_filter == MagFilter.NEAREST:
        weights = [np.ones_like(t)]
    elif mag_filter == MagFilter.CUBIC:  # a uniform B-spline's
        first -= 1
        weights = [(1 - t) ** 3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * (1 - t) ** 2 + 3 * (1 - t) ** 3, t**3]
        weights = [weight / 6 for weight in weights]
    return [(_wrapped(first + k, size, wrap), weight) for k, weight in enumerate(weights)]


def _wrapped(index: np.ndarray, size: int, wrap: Wrap) -> np.ndarray:
    if wrap == Wrap.CLAMP:
        return np.clip(index, 0, size - 1)
    if wrap == Wrap.REPEAT:
        return index % size
    if wrap == Wrap.MIRROR:
        k = index % (2 * size)
        return np.where(k < size, k, 2 * size - 1 - k)
    return np.where((index >= 0) & (index < size), index, -1)


def _fetch(pixels: np.ndarray, x: np.ndarray, y: np.ndarray, texture: Texture) -> np.ndarray:
    """Return decoded texels at columns and rows, float64, shape [n, 4]; those of index -1 are black."""
    texel = decoded_texels(pixels[y, x], is_srgb=texture.is_srgb)
    texel[(x < 0) | (y < 0)] = 0.0
    return texel
