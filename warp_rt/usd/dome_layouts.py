# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Images of environments in other layouts than latitude and longitude, and what these are in that one.

UsdLux names the layouts and leaves their directions open. Here they are Debevec's and HDRShop's, in the light's own
axes: the image's centre is +Z, its right side +X, its top +Y; a cross has -Y below +Z, and -Z below that, head down. A
mirrored ball is thus one that a camera photographs which looks along -Z, as USD's do.

Reference: Debevec (1998), Rendering Synthetic Objects into Real Scenes, SIGGRAPH 98, and his Light Probe Image Gallery,
for the angular map; UsdLux DomeLight for latitude and longitude; for uneven scales hdEmbree, USD's reference of lights,
which looks a direction up by its image under the inverse of the light's transform, made a unit vector again.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from warp_rt.srgb import linear_from_srgb

LATLONG = "latlong"
LAYOUTS = (LATLONG, "mirroredBall", "angular", "cubeMapVerticalCross")
_MAX_HEIGHT = 1024  # of the result: as fine as a ball or a cross of 2048 texels is where it is coarsest
_MOST_SQUEEZED = 8  # the most by which a scale is taken to squeeze texels: beyond, they are skipped
Stretch = tuple[tuple[float, float, float], ...]
"""The symmetric matrix of an uneven scale, row by row."""


def guess_layout(width: int, height: int) -> str:
    """Return what ``automatic`` means: nothing but a cross is 3 by 4; the rest is latlong."""
    return "cubeMapVerticalCross" if 4 * width == 3 * height else LATLONG


def has_proportions(layout: str, width: int, height: int) -> bool:
    """Return whether an image has the sides that its layout asks for."""
    if layout == "cubeMapVerticalCross":
        return 4 * width == 3 * height
    return layout == LATLONG or width == height


def rotation_and_stretch(matrix: np.ndarray) -> tuple[np.ndarray, Stretch | None]:
    """Return the rotation, mirrored or not, that follows a stretch, and the stretch; the matrix and None if it is even.

    Args:
        matrix: float64, shape [3, 3], invertible, acting on column vectors.

    Reference: Higham (1986), Computing the Polar Decomposition - with Applications, SIAM J. Sci. Stat. Comput. 7(4).
    """
    left, sizes, right = np.linalg.svd(matrix)
    if sizes[0] <= (1 + 1e-6) * sizes[2]:
        return matrix, None
    rows = ((right.T * (sizes / sizes[0])) @ right).tolist()
    return left @ right, tuple((x, y, z) for x, y, z in rows)


def to_latlong(pixels: np.ndarray, layout: str, *, is_srgb: bool, stretch: Stretch | None = None) -> np.ndarray:
    """Return an environment by latitude and longitude, linear.

    Args:
        pixels: uint8 or float32, shape [height, width, 4], bottom row first.
        layout: One of ``LAYOUTS``.
        is_srgb: Whether the texels are sRGB encoded.
        stretch: Of the space that the environment is in, None for none.

    Returns:
        float32, shape [rows, 2 rows, 4], row 0 at local -Y, centre at +Z, columns towards -X.
    """
    linear = pixels.astype(np.float32) / (255.0 if pixels.dtype == np.uint8 else 1.0)
    if is_srgb:
        linear[..., :3] = linear_from_srgb(linear[..., :3])
    height = max(len(pixels) // (2 if layout == "cubeMapVerticalCross" else 1), 2)
    rows, samples = min(_MAX_HEIGHT, height), 1
    inverse: np.ndarray = np.eye(3)
    if stretch is not None:
        inverse = np.linalg.inv(stretch)
        # Texels are squeezed by up to the ratio of two scales: finer rows, then several samples a texel, keep them.
        fine = min(math.ceil(np.linalg.cond(inverse)), _MOST_SQUEEZED)
        rows = min(max(_MAX_HEIGHT, height), 2 * fine * height)
        samples = math.ceil(fine * height / rows)
    if layout == LATLONG:
        # Filtering goes around.
        linear = np.concatenate([linear[:, -1:], linear, linear[:, :1]], axis=1)
    columns = 2 * rows * samples
    longitude = (0.5 - (np.arange(columns) + 0.5) / columns) * 2 * np.pi
    result = np.empty((rows, 2 * rows, 4), np.float32)
    latitudes = ((np.arange(rows * samples) + 0.5) / (rows * samples) - 0.5) * np.pi
    for row, of_row in enumerate(latitudes.reshape(rows, samples)):
        total = np.zeros((2 * rows, 4), np.float32)
        for latitude in of_row:
            level = np.cos(latitude)
            x, z = level * np.sin(longitude), level * np.cos(longitude)
            direction = np.stack([x, np.full_like(x, np.sin(latitude)), z])
            if stretch is not None:
                direction = inverse @ direction
                direction /= np.linalg.norm(direction, axis=0)
            texels = _bilinear(linear, *_PLACES[layout](direction, linear.shape[1]))
            total += texels.reshape(2 * rows, samples, 4).sum(axis=1)
        result[row] = total / samples**2
    return result


Place = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Coordinates x and y, from 0 to 1 across and up the image, shape [n], and the part of it that filtering stays in:
left, bottom, right, top, shape [4, n]."""


def _whole(x: np.ndarray, y: np.ndarray) -> Place:
    return x, y, np.array([[0.0], [0.0], [1.0], [1.0]])


def _latlong(direction: np.ndarray, width: int) -> Place:
    """Between one column more on either side."""
    x, y, z = direction
    across = (0.5 - np.arctan2(x, z) / (2 * np.pi)) * (width - 2) + 1
    return _whole(across / width, 0.5 + np.arcsin(np.clip(y, -1, 1)) / np.pi)


def _mirrored_ball(direction: np.ndarray, _width: int) -> Place:
    """A reflection by twice the angle: at the sine of half the angle to +Z."""
    x, y, z = direction
    return _ball(x, y, np.sqrt(np.maximum(1 - z, 0) / 2))


def _angular(direction: np.ndarray, _width: int) -> Place:
    x, y, z = direction
    return _ball(x, y, np.arctan2(np.hypot(x, y), z) / np.pi)


def _ball(x: np.ndarray, y: np.ndarray, radius: np.ndarray) -> Place:
    scale = radius / np.maximum(np.hypot(x, y), 1e-12)
    return _whole(0.5 + 0.5 * x * scale, 0.5 + 0.5 * y * scale)


def _vertical_cross(direction: np.ndarray, _width: int) -> Place:
    """The faces, each with its column and row in the cross and its coordinates to the right and up: a, b over c."""
    x, y, z = direction
    size = np.abs(direction)
    is_x = (size[0] >= size[1]) & (size[0] >= size[2])
    is_y = ~is_x & (size[1] >= size[2])
    faces = [
        (is_x & (x < 0), 0, 2, z, y, -x),
        (is_x & (x >= 0), 2, 2, -z, y, x),
        (is_y & (y >= 0), 1, 3, x, -z, y),
        (is_y & (y < 0), 1, 1, x, z, -y),
        (~is_x & ~is_y & (z >= 0), 1, 2, x, y, z),
        (~is_x & ~is_y & (z < 0), 1, 0, x, -y, -z),
    ]
    across, up = np.empty_like(x), np.empty_like(x)
    part = np.empty((4, len(x)))
    for chosen, column, row, a, b, c in faces:
        across[chosen] = (column + 0.5 + 0.5 * a[chosen] / c[chosen]) / 3
        up[chosen] = (row + 0.5 + 0.5 * b[chosen] / c[chosen]) / 4
        part[:, chosen] = np.array([column / 3, row / 4, (column + 1) / 3, (row + 1) / 4])[:, None]
    return across, up, part


_PLACES: dict[str, Callable[[np.ndarray, int], Place]] = {
    LATLONG: _latlong,
    "mirroredBall": _mirrored_ball,
    "angular": _angular,
    "cubeMapVerticalCross": _vertical_cross,
}


def _bilinear(pixels: np.ndarray, x: np.ndarray, y: np.ndarray, part: np.ndarray) -> np.ndarray:
    height, width = pixels.shape[:2]
    left, bottom, right, top = part * np.array([[width], [height], [width], [height]])
    column = np.clip(x * width, left + 0.5, np.maximum(right - 0.5, left + 0.5)) - 0.5
    row = np.clip(y * height, bottom + 0.5, np.maximum(top - 0.5, bottom + 0.5)) - 0.5
    j, i = column.astype(int), row.astype(int)
    k, m = np.minimum(j + 1, width - 1), np.minimum(i + 1, height - 1)
    h, v = (column - j)[:, None], (row - i)[:, None]
    low = pixels[i, j] * (1 - h) + pixels[i, k] * h
    high = pixels[m, j] * (1 - h) + pixels[m, k] * h
    result: np.ndarray = low * (1 - v) + high * v
    return result
