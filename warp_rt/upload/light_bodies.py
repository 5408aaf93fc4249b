# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which triangles of a mesh light others of it can be before: none of a convex body's own, seen from outside."""

from __future__ import annotations

import numpy as np

from warp_rt.kernels.mesh_visibility import INSIDE, OUTSIDE

BOTH_SIDES = int(OUTSIDE) | int(INSIDE)
_FLAT = 1e-6  # of the extent: what is no higher above a plane lies in it, for points of files are float32
_MOST_PAIRS = 1 << 26  # of triangles and corners that are compared: a third of a second
_MOST_TRIANGLES = 1 << 17  # whose connection is found out: a third of a second, too
_AT_ONCE = 1 << 10


def connected_parts(corners: np.ndarray) -> np.ndarray:
    """Return a number for each triangle that those have in common which hang together by corners: int64, shape [n].

    Of very many triangles it is not found out: all have 0.

    Args:
        corners: Of the triangles, shape [n, 3, 3], equal where they coincide.
    """
    if len(corners) > _MOST_TRIANGLES:
        return np.zeros(len(corners), np.int64)
    points, triangles = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    label = np.arange(len(points))
    while True:
        lowest = label[triangles].min(axis=1)
        lower = label.copy()
        np.minimum.at(lower, triangles.reshape(-1), np.repeat(lowest, 3))
        lower = lower[lower]
        if (lower == label).all():
            return lowest
        label = lower


def free_sides_of(corners: np.ndarray) -> np.ndarray:
    """Return ``kernels.light_structs.LightTriangle.free_sides`` of each triangle: int32, shape [n].

    Those are the sides of its plane that no corner of the others is on. Of very many triangles it is not found out:
    then others can be before any of them.

    Args:
        corners: Of the triangles, wound as seen from outside: float64, shape [n, 3, 3].
    """
    points = np.unique(corners.reshape(-1, 3), axis=0)
    sides = np.zeros(len(corners), np.int32)
    if len(points) * len(corners) > _MOST_PAIRS:
        return sides
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    offsets = (normals * (corners[:, 0] - points[0])).sum(axis=1)
    points = points - points[0]
    slack = _FLAT * np.linalg.norm(points, axis=1).max()
    for start in range(0, len(corners), _AT_ONCE):
        rows = slice(start, start + _AT_ONCE)
        heights = normals[rows] @ points.T - offsets[rows, None]
        sides[rows] |= np.where((heights <= slack).all(axis=1), OUTSIDE, 0).astype(np.int32)
        sides[rows] |= np.where((heights >= -slack).all(axis=1), INSIDE, 0).astype(np.int32)
    return sides


def convex_bodies(corners: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """Return ``kernels.light_structs.LightTriangle.body`` of each triangle, the number of its part: int32, shape [n].

    Args:
        corners: As for :func:`free_sides_of`.
        parts: As :func:`connected_parts` returns them, those of a part in a row.
    """
    starts = np.flatnonzero(np.diff(parts, prepend=-1))
    bodies = np.full(len(corners), -1, np.int32)
    for start, end in zip(starts, [*starts[1:], len(corners)], strict=True):
        if (free_sides_of(corners[start:end]) & int(OUTSIDE)).all():
            bodies[start:end] = parts[start]
    return bodies
