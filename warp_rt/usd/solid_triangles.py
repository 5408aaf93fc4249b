# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Triangles that enclose spheres, frusta and capsules, for those that shine: rays meet the curved shapes themselves.

They lie outside of the shape or on it, so that a shadow ray that ends at one is not stopped by the shape. By
how much that makes the light too large, :func:`enclosing_triangles` tells.
"""

from __future__ import annotations

import math

import numpy as np

from warp_rt.scene import ShapeKind, Shapes

SOLIDS = (ShapeKind.SPHERE, ShapeKind.FRUSTUM, ShapeKind.ROUND_CONE)
MOST = 1 << 14
"""Shapes that can shine together."""
_SHAPED = 32, 64  # steps of half a turn of the profile, and about the axis
_FINE = 16, 32
_COARSE = 6, 12
_FEW = 64  # shapes that are finely cut
_EXACT = 128, 256  # for the area


def enclosing_triangles(shapes: Shapes, local_from_shapes: np.ndarray, *, is_shaped: bool) -> tuple[np.ndarray, float]:
    """Return the triangles about some solids, and by what the solids' area is less than theirs.

    Args:
        shapes: Of one of ``SOLIDS``.
        local_from_shapes: Where they are wanted, float64, shape [4, 4].
        is_shaped: Whether they shine unevenly by direction: the triangles of few are then a quarter as far out.

    Returns:
        float32, shape [n, 3, 3], wound as seen from outside; and the ratio of the solids' area to theirs.
    """
    steps, turns = (_SHAPED if is_shaped else _FINE) if len(shapes.points) <= _FEW else _COARSE
    triangles = np.concatenate([_solid(shapes, row, steps, turns) for row in range(len(shapes.points))])
    if shapes.is_inside_out:
        triangles = triangles[:, [0, 2, 1]]
    # One of many is enough: they are alike but for their size, which may be none.
    largest = int(shapes.radii.max(axis=1).argmax())
    same = [_solid(shapes, largest, *cut) for cut in ((steps, turns), _EXACT)]
    area, exact = (_area(placed_triangles(part, local_from_shapes)) for part in same)
    return placed_triangles(triangles, local_from_shapes).astype(np.float32), exact / area if area > 0 else 1.0


def placed_triangles(triangles: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return triangles, shape [n, 3, 3], under an affine transform, which mirrors none: their outside stays outside."""
    placed = triangles @ matrix[:3, :3].T + matrix[:3, 3]
    return np.asarray(placed[:, [0, 2, 1]] if np.linalg.det(matrix[:3, :3]) < 0 else placed)


def _area(triangles: np.ndarray) -> float:
    sides = triangles[:, 1:] - triangles[:, :1]
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2)


def _solid(shapes: Shapes, row: int, steps: int, turns: int) -> np.ndarray:
    """Return the triangles about one solid: its profile, turned about the line through its points."""
    points, radii = shapes.points[row].astype(float), shapes.radii[row].astype(float)
    length = float(np.linalg.norm(points[-1] - points[0]))
    axis = (points[-1] - points[0]) / length if length > 0 else np.array([0.0, 0.0, 1.0])
    if shapes.kind == ShapeKind.FRUSTUM:
        profile = [(radii[0], 0.0), (radii[1], length)]
        profile = [(0.0, 0.0)] * shapes.caps[0] + profile + [(0.0, length)] * shapes.caps[1]
    else:
        profile = _hull_of_balls(float(radii[0]), float(radii[-1]), length, steps)
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    frame = np.stack([across, np.cross(axis, across), axis])
    return _revolved(np.array(profile), turns) @ frame + points[0]


def _hull_of_balls(bottom: float, top: float, length: float, steps: int) -> list[tuple[float, float]]:
    """Return the profile about two balls, the first at height 0: radii and heights, from the lower pole up."""
    # Where the side touches both: its normal rises by this angle.
    rise = math.asin(min(max((bottom - top) / length, -1.0), 1.0)) if length > 0 else math.pi / 2
    lower = _arc(bottom, 0.0, -math.pi / 2, rise, steps)
    return lower + (_arc(top, length, rise, math.pi / 2, steps) if rise < math.pi / 2 else [])


def _arc(radius: float, height: float, start: float, end: float, steps: int) -> list[tuple[float, float]]:
    """Return corners of a polygon whose sides touch an arc from outside: a full half turn has ``steps`` of them."""
    count = max(round(steps * (end - start) / math.pi), 1)
    out = radius / math.cos((end - start) / (2 * count))
    angles = np.linspace(start, end, count + 1)
    return [(out * max(math.cos(angle), 0.0), height + out * math.sin(angle)) for angle in angles]


def _revolved(profile: np.ndarray, turns: int) -> np.ndarray:
    """Return the triangles that a profile, its radii and heights from below, makes about z: shape [n, 3, 3]."""
    angles = 2 * np.pi * np.arange(turns + 1) / turns
    radii = profile[:, 0] / math.cos(math.pi / turns)
    rings = np.stack(
        [
            radii[:, None] * np.cos(angles),
            radii[:, None] * np.sin(angles),
            np.repeat(profile[:, 1:], turns + 1, axis=1),
        ],
        axis=2,
    )
    a, b, c, d = rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]
    triangles = np.concatenate([np.stack(corners, axis=2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))])
    # At a pole one of two has no area.
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return np.asarray(triangles[areas > 1e-12 * areas.max(initial=0.0)])
