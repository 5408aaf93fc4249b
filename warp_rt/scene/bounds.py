# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Boxes of geometry in its own space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warp_rt.scene.geometry import Mesh, ShapeKind, Shapes

_SMALL = 1024  # triangles of a mesh up to which many are measured at once, and how many


def primitive_count(geometry: Mesh | Shapes) -> int:
    """Return the number of triangles of a mesh, or of shapes."""
    return len(geometry.triangles if isinstance(geometry, Mesh) else geometry.points)


def local_bounds(geometry: Mesh | Shapes) -> np.ndarray:
    """Return the box of a mesh's triangles, or of shapes: float64, shape [2, 3]; NaN where there are none."""
    if not primitive_count(geometry):
        return np.full((2, 3), np.nan)
    if isinstance(geometry, Shapes):
        low, high = shape_boxes(geometry)
        return np.array([low.min(axis=0), high.max(axis=0)])
    is_used = np.zeros(len(geometry.points), bool)
    is_used[geometry.triangles.reshape(-1)] = True
    return point_bounds(geometry.points if is_used.all() else geometry.points[is_used])


def local_boxes(geometry: Sequence[Mesh | Shapes]) -> np.ndarray:
    """Return the box of each mesh's triangles, or of shapes: float64, shape [n, 2, 3]; NaN where there are none."""
    boxes = np.full((len(geometry), 2, 3), np.nan)
    small: list[int] = []
    for row, one in enumerate(geometry):
        if isinstance(one, Mesh) and 0 < len(one.triangles) < _SMALL and len(one.points) < _SMALL:
            small.append(row)
        else:
            boxes[row] = local_bounds(one)
    for first in range(0, len(small), _SMALL):
        rows = small[first : first + _SMALL]
        meshes = [one for one in (geometry[row] for row in rows) if isinstance(one, Mesh)]
        points = np.ascontiguousarray(np.concatenate([mesh.points for mesh in meshes]).T)  # fast along long rows
        counts = np.array([len(mesh.points) for mesh in meshes])
        starts = np.cumsum(counts) - counts
        sides = np.repeat(starts, [len(mesh.triangles) for mesh in meshes])
        is_used = np.zeros(points.shape[1], bool)
        is_used[np.concatenate([mesh.triangles for mesh in meshes]) + sides[:, None]] = True
        for side, (reduce, nothing) in enumerate(((np.minimum, np.inf), (np.maximum, -np.inf))):
            held = points if is_used.all() else np.where(is_used, points, np.float32(nothing))
            boxes[rows, side] = reduce.reduceat(held, starts, axis=1).T
    return boxes


def point_bounds(points: np.ndarray) -> np.ndarray:
    """Return the box of points, float64, shape [2, 3].

    Args:
        points: shape [n, 3], n >= 1.
    """
    # Rows of 32 points at once: twenty times as fast as reducing rows of three.
    whole = len(points) // 32 * 32
    rows = np.ascontiguousarray(points[:whole]).reshape(-1, 96)
    rest = points[whole:]
    reduced = [np.concatenate([f(rows, axis=0).reshape(32, 3), rest]) if whole else rest for f in (np.min, np.max)]
    return np.array([reduced[0].min(axis=0), reduced[1].max(axis=0)], float)


def shape_boxes(shapes: Shapes) -> tuple[np.ndarray, np.ndarray]:
    """Return boxes around shapes, their lower and upper corners: float64, shape [n, 3] each.

    They are tight but for cubic tubes, whose box is that of the balls about their control points.
    """
    points, radii = shapes.points.astype(float), shapes.radii.astype(float)[:, :, None]
    if shapes.kind == ShapeKind.FRUSTUM:
        # A disk reaches as far along an axis as its radius by the sine of its normal's angle to that.
        along = points[:, 1] - points[:, 0]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        cosine = np.divide(along, length, out=np.zeros_like(along), where=length > 0)
        radii = radii * np.sqrt(np.maximum(1 - cosine**2, 0))[:, None]
    return (points - radii).min(axis=1), (points + radii).max(axis=1)
