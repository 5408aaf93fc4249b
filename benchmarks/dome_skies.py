# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""One smooth sky painted in each layout of a dome's image, texel by texel, by the formulas of the layouts' sources.

The light's own axes: an image's centre is +Z, its right side +X, its top +Y; a cross has -Y below that, then -Z.

Reference: Debevec (1998), Rendering Synthetic Objects into Real Scenes, SIGGRAPH 98, and his Light Probe Image Gallery.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

SIZE = 256
"""Texels along a ball's side; half as many along a face's."""


def smooth_sky(direction: np.ndarray) -> np.ndarray:
    """Return a brightness from 0 to 1 of unit directions, shape [..., 3], that differs along every axis."""
    x, y, z = np.moveaxis(direction, -1, 0)
    brightness: np.ndarray = 0.45 - 0.1 * x + 0.2 * y + 0.1 * z + 0.15 * x * z + 0.1 * x * y
    return brightness


def _centers(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of texels' centres, from -1 to 1, top row first: shape [size, size] each."""
    middles = (np.arange(size) + 0.5) / size * 2 - 1
    x, down = np.meshgrid(middles, middles)
    return x, -down


def _mirrored_ball() -> np.ndarray:
    """Reflect the view of a camera that looks along -Z in the unit ball: R = d - 2 (d.n) n."""
    x, y = _centers(SIZE)
    n = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    view = np.array([0.0, 0.0, -1.0])
    reflected: np.ndarray = view - 2 * (n @ view)[..., None] * n
    return smooth_sky(reflected)


def _angular() -> np.ndarray:
    """Turn +Z by pi times the distance from the centre."""
    x, y = _centers(SIZE)
    radius = np.hypot(x, y)
    angle = np.pi * np.minimum(radius, 1)
    scale = np.sin(angle) / np.maximum(radius, 1e-9)
    return smooth_sky(np.stack([x * scale, y * scale, np.cos(angle)], axis=-1))


def _vertical_cross() -> np.ndarray:
    """Fold up six faces, by the row from the top and the column that each is in."""
    size = SIZE // 2
    x, y = _centers(size)
    one = np.ones_like(x)
    faces = {
        (0, 1): (x, one, -y),
        (1, 0): (-one, y, x),
        (1, 1): (x, y, one),
        (1, 2): (one, y, -x),
        (2, 1): (x, -one, y),
        (3, 1): (x, -y, -one),
    }
    image = np.zeros((4 * size, 3 * size))
    for (row, column), axes in faces.items():
        d = np.stack(axes, axis=-1)
        d /= np.linalg.norm(d, axis=-1, keepdims=True)
        image[row * size : (row + 1) * size, column * size : (column + 1) * size] = smooth_sky(d)
    return image


SKIES: dict[str, Callable[[], np.ndarray]] = {
    "mirroredBall": _mirrored_ball,
    "angular": _angular,
    "cubeMapVerticalCross": _vertical_cross,
}
"""By the token of UsdLux's ``texture:format``: brightness, rows from the top."""
