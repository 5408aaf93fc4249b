# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays against shapes in float64 by other means than the kernels': every root of every part, and dense sampling.

Each function takes origins and directions, shape [n, 3], and returns the distances, shape [n, k], at which the rays'
lines cross the surface, in units of the direction's length, NaN for none; in no order, those behind included.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from warp_rt.scene import ShapeKind, Shapes


def roots(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return the real roots of a t^2 + b t + c, shape [n, 2]."""
    with np.errstate(all="ignore"):
        q = -0.5 * (b + np.where(b < 0, -1, 1) * np.sqrt(b * b - 4 * a * c))
        return np.stack([q / a, c / q], axis=1)


def cross_sphere(o: np.ndarray, d: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    # From the point of the line next to the centre, where nothing cancels.
    m = o - center
    near = -(m * d).sum(1) / (d * d).sum(1)
    m = m + near[:, None] * d
    with np.errstate(invalid="ignore"):
        half = np.sqrt((radius**2 - (m * m).sum(1)) / (d * d).sum(1))
    return np.stack([near - half, near + half], axis=1)


def cross_frustum(
    o: np.ndarray, d: np.ndarray, ends: np.ndarray, radii: np.ndarray, caps: tuple[bool, bool] = (True, True)
) -> np.ndarray:
    along = ends[1] - ends[0]
    height = np.linalg.norm(along)
    axis = along / height
    near = -((o - ends.mean(axis=0)) * d).sum(1) / (d * d).sum(1)
    m = o + near[:, None] * d - ends[0]
    dz, mz = d @ axis, m @ axis
    dp, mp = d - dz[:, None] * axis, m - mz[:, None] * axis
    slope = (radii[1] - radii[0]) / height
    r = radii[0] + slope * mz
    side = roots((dp * dp).sum(1) - (slope * dz) ** 2, 2 * ((dp * mp).sum(1) - slope * dz * r), (mp * mp).sum(1) - r**2)
    z = mz[:, None] + side * dz[:, None]
    found = [np.where((z >= 0) & (z <= height), side, np.nan)]
    for k, level in enumerate((0.0, height)):
        with np.errstate(all="ignore"):
            t = ((level - mz) / dz)[:, None]
            across = np.linalg.norm(mp + t * dp, axis=1)[:, None]
        found.append(np.where((across <= radii[k]) & caps[k], t, np.nan))
    return np.concatenate(found, axis=1) + near[:, None]


def bezier(controls: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return points of a Bezier curve of any degree, shape [*u.shape, c], by de Casteljau's algorithm."""
    points = [np.broadcast_to(c, (*u.shape, len(c))) for c in controls]
    while len(points) > 1:
        points = [a + (b - a) * u[..., None] for a, b in pairwise(points)]
    return points[0]


def cross_swept_ball(
    o: np.ndarray, d: np.ndarray, ends: np.ndarray, radii: np.ndarray, *, ahead: bool = False, samples: int = 257
) -> np.ndarray:
    """Return where lines enter and leave what a ball sweeps along a Bezier curve: shape [n, 2].

    The entrance is the least of those of all balls on the way: of ``samples``, then of 33 between the neighbours of the
    best, three times over.

    Args:
        o: Origins.
        d: Directions.
        ends: Control points, shape [k, 3].
        radii: shape [k].
        ahead: Whether what lies behind the origin does not count, which must not be inside then.
        samples: Fine enough that one of them is met by any line that meets the tube.
    """
    speed = np.linalg.norm(d, axis=1)
    unit = d / speed[:, None]
    near = ((ends.mean(axis=0) - o) * unit).sum(1)
    base = o + near[:, None] * unit
    controls = np.concatenate([ends, radii[:, None]], axis=1)
    found = []
    for sign in (-1.0, 1.0):

        def reach(u: np.ndarray, sign: float = sign) -> np.ndarray:
            ball = bezier(controls, u)
            m = ball[..., :3] - base[:, None]
            z = (m * unit[:, None]).sum(-1)
            with np.errstate(invalid="ignore"):
                at = z + sign * np.sqrt(ball[..., 3] ** 2 - (m * m).sum(-1) + z * z)
                is_met = np.isfinite(at) & ~(ahead & (at + near[:, None] < 0))
            return np.where(is_met, -sign * at, np.inf)

        value = _least(reach, len(o), samples)
        found.append(np.where(np.isfinite(value), (near - sign * value) / speed, np.nan))
    return np.stack(found, axis=1)


def distance_to_swept_ball(p: np.ndarray, ends: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return how far points are outside what a ball sweeps along a Bezier curve, shape [n]; negative: inside."""
    controls = np.concatenate([ends, radii[:, None]], axis=1)

    def outside(u: np.ndarray) -> np.ndarray:
        ball = bezier(controls, u)
        return np.linalg.norm(p[:, None] - ball[..., :3], axis=-1) - ball[..., 3]

    return _least(outside, len(p), 257)


def _least(function: Callable[[np.ndarray], np.ndarray], count: int, samples: int) -> np.ndarray:
    """Return the least value of each of ``count`` functions of u in [0, 1]."""
    grid = np.broadcast_to(np.linspace(0, 1, samples), (count, samples))
    for _ in range(4):
        best = function(grid).argmin(axis=1) if count else np.zeros(0, int)
        low, high = (
            np.take_along_axis(grid, np.clip(best + k, 0, grid.shape[1] - 1)[:, None], axis=1) for k in (-1, 1)
        )
        grid = low + (high - low) * np.linspace(0, 1, 33)
    return function(grid).min(axis=1, initial=np.inf)


def crossings(shapes: Shapes, row: int, o: np.ndarray, d: np.ndarray, growth: float = 1.0) -> np.ndarray:
    """Return where lines cross one shape, its radii multiplied by ``growth``; a tube's entrance only."""
    points, radii = shapes.points[row].astype(float), shapes.radii[row].astype(float) * growth
    if shapes.kind == ShapeKind.SPHERE:
        return cross_sphere(o, d, points[0], radii[0])
    if shapes.kind == ShapeKind.FRUSTUM:
        return cross_frustum(o, d, points, radii, shapes.caps)
    # Sampling is slow: only of lines that meet a sphere about it.
    center = points.mean(axis=0)
    reach = (np.linalg.norm(points - center, axis=1) + radii).max()
    is_near = np.isfinite(cross_sphere(o, d, center, reach)[:, 0])
    both = np.full((len(o), 2), np.nan)
    both[is_near] = cross_swept_ball(o[is_near], d[is_near], points, radii)
    return both if shapes.kind == ShapeKind.ROUND_CONE else both[:, :1]


def first_hits(shapes: Shapes, o: np.ndarray, d: np.ndarray, growth: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the closest hit of each ray: t (inf: none) and the row of its shape (-1)."""
    best, row = np.full(len(o), np.inf), np.full(len(o), -1)
    for k in range(len(shapes.points)):
        t = crossings(shapes, k, o, d, growth)
        t = np.where(t >= 0, t, np.inf).min(axis=1)
        closer = t < best
        best, row = np.where(closer, t, best), np.where(closer, k, row)
    return best, row
