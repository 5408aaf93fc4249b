# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a dome light sends to diffuse surfaces: its image, blurred by the cosine."""

from __future__ import annotations

import numpy as np

from warp_rt.srgb import linear_from_srgb


def irradiance_map(pixels: np.ndarray, *, is_srgb: bool, size: tuple[int, int]) -> np.ndarray:
    """Return the irradiance of surfaces of every orientation in a latitude-longitude environment.

    Args:
        pixels: uint8 or float32, shape [height, width, 4], row 0 at local -Y.
        is_srgb: Whether the texels are sRGB encoded.
        size: Rows and columns of the result; the environment is averaged to twice that before it is summed.

    Returns:
        float64, shape [rows, columns, 3]: the sum over directions of radiance, cosine and solid angle for a normal
        through each texel's centre, row 0 at local -Y.
    """
    rows, columns = size
    radiance, weight = _shrink(_linear(pixels, is_srgb), 2 * rows, 2 * columns)
    from_directions = _directions(*radiance.shape[:2]).reshape(-1, 3)
    normals = _directions(rows, columns).reshape(-1, 3)
    cosine = np.maximum(normals @ from_directions.T, 0.0) * weight.reshape(-1)
    # Each normal's discrete cosine sum is brought to its exact value pi: a constant environment stays exact.
    cosine *= np.pi / cosine.sum(axis=1, keepdims=True)
    return (cosine @ radiance.reshape(-1, 3)).reshape(rows, columns, 3)


def _linear(pixels: np.ndarray, is_srgb: bool) -> np.ndarray:
    color = pixels[..., :3].astype(np.float64)
    if pixels.dtype == np.uint8:
        color /= 255.0
    return linear_from_srgb(color) if is_srgb else color


def _directions(rows: int, columns: int) -> np.ndarray:
    """Return the unit local direction through each texel's centre (UsdLux latlong), shape [rows, columns, 3]."""
    latitude = ((np.arange(rows) + 0.5) / rows - 0.5) * np.pi
    longitude = (0.5 - (np.arange(columns) + 0.5) / columns) * 2 * np.pi
    cos_latitude = np.cos(latitude)[:, None]
    x, z = cos_latitude * np.sin(longitude), cos_latitude * np.cos(longitude)
    return np.stack([x, np.broadcast_to(np.sin(latitude)[:, None], x.shape), z], axis=-1)


def _shrink(color: np.ndarray, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the environment averaged by solid angle over at most rows x columns cells, and each cell's solid angle."""
    height, width = color.shape[:2]
    row_of = np.minimum(np.arange(height) * min(rows, height) // height, rows - 1)
    column_of = np.minimum(np.arange(width) * min(columns, width) // width, columns - 1)
    edges = np.linspace(-np.pi / 2, np.pi / 2, height + 1)
    row_weight = np.sin(edges[1:]) - np.sin(edges[:-1])
    starts = np.flatnonzero(np.diff(row_of, prepend=-1))
    column_starts = np.flatnonzero(np.diff(column_of, prepend=-1))
    summed = np.add.reduceat(color * row_weight[:, None, None], starts, axis=0)
    summed = np.add.reduceat(summed, column_starts, axis=1)
    cell_rows = np.add.reduceat(row_weight, starts)
    cell_columns = np.add.reduceat(np.ones(width), column_starts)
    area = cell_rows[:, None] * cell_columns
    return summed / area[..., None], area * (2 * np.pi / width)
