# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What is made of the images of lights: the irradiance of diffuse surfaces, and where samples of a dome go."""

from __future__ import annotations

import numpy as np

from warp_rt.srgb import linear_from_srgb

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear Rec. 709 (ITU-R BT.709)


def irradiance_map(pixels: np.ndarray, *, is_srgb: bool, size: tuple[int, int]) -> np.ndarray:
    """Return the irradiance of surfaces of every orientation in a latitude-longitude environment.

    Args:
        pixels: uint8 or float32, shape [height, width, 4], row 0 at local -Y.
        is_srgb: Whether the texels are sRGB encoded.
        size: Rows and columns of the result; the environment is averaged to cells half as wide before it is summed.

    Returns:
        float64, shape [rows, columns, 3]: the sum over directions of radiance, cosine and solid angle for the normals
        in the middle of each column of longitudes; row 0 is those of local -Y, the last one those of +Y.
    """
    rows, columns = size
    radiance, weight = _shrink(_linear(pixels, is_srgb), 2 * (rows - 1), 2 * columns)
    from_directions = _directions(_middles(radiance.shape[0]), radiance.shape[1]).reshape(-1, 3)
    normals = _directions(np.linspace(-0.5, 0.5, rows) * np.pi, columns).reshape(-1, 3)
    cosine = np.maximum(normals @ from_directions.T, 0.0) * weight.reshape(-1)
    # Each normal's discrete cosine sum is brought to its exact value pi: a constant environment stays exact.
    cosine *= np.pi / cosine.sum(axis=1, keepdims=True)
    return (cosine @ radiance.reshape(-1, 3)).reshape(rows, columns, 3)


def bright_cells(pixels: np.ndarray, *, is_srgb: bool, size: tuple[int, int]) -> tuple[np.ndarray, int, int]:
    """Return how bright the cells of a latitude-longitude environment are, as cumulative sums to sample it by.

    Args:
        pixels: uint8 or float32, shape [height, width, 4], row 0 at local -Y.
        is_srgb: Whether the texels are sRGB encoded.
        size: The most rows and columns that there may be.

    Returns:
        float32 sums, rows first, then the columns of each row, every list ending with 1; rows; columns. A cell counts
        by its mean luminance, interpolated as it is shown, and the solid angle that it covers; a black image is as
        bright everywhere.
    """
    radiance, solid_angle = _shrink(_linear(pixels, is_srgb), *size)
    rows, columns = radiance.shape[:2]
    luminance = np.maximum(radiance @ _LUMINANCE, 0.0)
    luminance = np.where(np.isfinite(luminance), luminance, 0.0)
    weight = _bilinear_means(luminance) * solid_angle
    if not weight.any():
        weight = solid_angle
    of_rows = weight.sum(axis=1)
    # A black row is never sampled, but needs sums that end with 1.
    weight[of_rows == 0] = 1.0
    sums = [np.cumsum(of_rows), *np.cumsum(weight, axis=1)]
    return np.concatenate([one / one[-1] for one in sums]).astype(np.float32), rows, columns


def _bilinear_means(cells: np.ndarray) -> np.ndarray:
    """Return the means over cells of what is interpolated between their centres: a bright cell shines beyond itself."""
    beside = np.roll(cells, 1, axis=1) + np.roll(cells, -1, axis=1)
    cells = 0.75 * cells + 0.125 * beside
    above, below = np.vstack([cells[1:], cells[-1:]]), np.vstack([cells[:1], cells[:-1]])
    return 0.75 * cells + 0.125 * (above + below)


def mean_color(pixels: np.ndarray, *, is_srgb: bool) -> np.ndarray:
    """Return the mean of an image's linear colours: float64, shape [3].

    Args:
        pixels: uint8 or float32, shape [height, width, 4].
        is_srgb: Whether the texels are sRGB encoded.
    """
    return np.mean([_linear(row, is_srgb).mean(axis=0) for row in pixels], axis=0)


def _linear(pixels: np.ndarray, is_srgb: bool) -> np.ndarray:
    color = pixels[..., :3].astype(np.float64)
    if pixels.dtype == np.uint8:
        color /= 255.0
    return linear_from_srgb(color) if is_srgb else color


def _middles(rows: int) -> np.ndarray:
    """Return the latitudes of rows of texels, shape [rows]."""
    return ((np.arange(rows) + 0.5) / rows - 0.5) * np.pi


def _directions(latitude: np.ndarray, columns: int) -> np.ndarray:
    """Return unit local directions (UsdLux latlong) at some latitudes, amid each column: shape [n, columns, 3]."""
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
