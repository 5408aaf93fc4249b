# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What is made of the images of lights: the irradiance of diffuse surfaces, and where samples of a dome go."""

from __future__ import annotations

import numpy as np

from warp_rt.srgb import linear_from_srgb

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear Rec. 709 (ITU-R BT.709)


def irradiance_map(pixels: np.ndarray, *, is_srgb: bool, size: tuple[int, int]) -> np.ndarray:
    """Return the irradiance of surfaces of every orientation in a latitude-longitude environment.

    The environment is summed up in cells half as wide as those of the result. A cell that is above a surface's horizon
    counts exactly, wherever in it the light comes from: what it adds is the product of the normal and the cell's vector
    irradiance, the integral of radiance times direction.

    Args:
        pixels: uint8 or float32, shape [height, width, 4], row 0 at local -Y.
        is_srgb: Whether the texels are sRGB encoded.
        size: Rows and columns of the result.

    Returns:
        float64, shape [rows, columns, 3]: the sum over directions of radiance, cosine and solid angle for the normals
        in the middle of each column of longitudes; row 0 is those of local -Y, the last one those of +Y.
    """
    rows, columns = size
    fluxes, even = _vector_irradiance(pixels, is_srgb, 2 * (rows - 1), 2 * columns)
    normals = _directions(np.linspace(-0.5, 0.5, rows) * np.pi, columns).reshape(-1, 3)
    facing = normals @ even
    is_above = facing > 0.0
    total = np.stack([np.where(is_above, normals @ fluxes[:, :, k], 0.0).sum(axis=1) for k in range(3)], axis=1)
    # Of cells that the horizon cuts through all or nothing counts; an even environment stays exact.
    total *= np.pi / facing.sum(axis=1, where=is_above, keepdims=True)
    return total.reshape(rows, columns, 3)


def _vector_irradiance(pixels: np.ndarray, is_srgb: bool, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the integrals of radiance times direction over the cells of a latitude-longitude environment.

    Args:
        pixels: As for :func:`irradiance_map`.
        is_srgb: Likewise.
        rows: Of cells.
        columns: Likewise.

    Returns:
        Those of the environment, shape [3, cells, 3], the channel last, and of one of radiance 1, shape [3, cells].
    """
    if pixels.shape[0] < rows or pixels.shape[1] < columns:
        pixels, is_srgb = _refined(_linear(pixels, is_srgb), rows, columns), False
    height, width = pixels.shape[:2]
    latitude = (np.arange(height + 1) / height - 0.5) * np.pi
    longitude = (0.5 - np.arange(width + 1) / width) * 2 * np.pi
    level = np.diff(latitude / 2 + np.sin(2 * latitude) / 4)
    # Integrals of x, y and z over a texel, each of them a product of one over latitudes and one over longitudes.
    of_rows = level, np.diff(np.sin(latitude) ** 2 / 2), level
    of_columns = np.diff(np.cos(longitude)), np.full(width, 2 * np.pi / width), -np.diff(np.sin(longitude))
    starts = np.arange(columns) * width // columns
    fluxes, even = np.empty((3, rows, columns, 3)), np.empty((3, rows, columns))
    for row, block in enumerate(np.array_split(np.arange(height), rows)):
        color = _linear(pixels[block[0] : block[-1] + 1], is_srgb)
        for axis, (of_row, of_column) in enumerate(zip(of_rows, of_columns, strict=True)):
            of_texels = np.tensordot(of_row[block], color, axes=1) * of_column[:, None]
            fluxes[axis, row] = np.add.reduceat(of_texels, starts, axis=0)
            even[axis, row] = np.add.reduceat(of_column, starts) * of_row[block].sum()
    return fluxes.reshape(3, -1, 3), even.reshape(3, -1)


def _refined(color: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Return an environment, interpolated as it is shown, with at least so many rows and columns of texels."""
    height, width = color.shape[:2]
    factor = -(-max(rows * width, columns * height) // (height * width))
    row, column = ((np.arange(count * factor) + 0.5) / factor - 0.5 for count in (height, width))
    i, j = np.floor(row).astype(int), np.floor(column).astype(int)
    v, u = (row - i)[:, None, None], (column - j)[:, None]
    low, high = color[np.clip(i, 0, height - 1)], color[np.clip(i + 1, 0, height - 1)]
    between = low * (1 - v) + high * v
    refined: np.ndarray = between[:, j % width] * (1 - u) + between[:, (j + 1) % width] * u
    return refined


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
