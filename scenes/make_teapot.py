# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The Utah teapot as a polygon mesh, evaluated from its 32 bicubic Bezier patches.

The patches (290 control points, Z up) are Martin Newell's of 1975, with the bottom that Frank Crow added in 1987, in
the usual squashed proportions; ``teapot_patches.json`` holds the numbers.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

PATCHES = Path(__file__).with_name("teapot_patches.json")


def load_patches() -> np.ndarray:
    """Return the control points of each patch: float64, shape [32, 4, 4, 3], Z up."""
    data = json.loads(PATCHES.read_text(encoding="utf-8"))
    rows = np.array(data["patches"], int).reshape(-1, 4, 4)
    return np.array(data["vertices"], float).reshape(-1, 3)[rows]


def bernstein(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the four cubic Bernstein polynomials at ``t`` and their derivatives: two arrays of shape [n, 4]."""
    s = 1.0 - t
    values = [s**3, 3 * s**2 * t, 3 * s * t**2, t**3]
    slopes = [-3 * s**2, 3 * s**2 - 6 * s * t, 6 * s * t - 3 * t**2, 3 * t**2]
    return np.stack(values, axis=-1), np.stack(slopes, axis=-1)


def tessellate(segments: int) -> tuple[np.ndarray, list[list[int]], np.ndarray]:
    """Return points, polygons and unit normals of the teapot with ``segments`` steps along each side of a patch.

    Points and normals are float32, shape [n, 3]; points where patches meet smoothly are shared. Polygons list point
    indices counter-clockwise seen from outside: quadrilaterals, and triangles where a patch comes to a point on the
    axis, 64 segments^2 - 8 segments triangles in all once the quadrilaterals are split.
    """
    t = np.linspace(0.0, 1.0, segments + 1)
    values, slopes = bernstein(t)
    points, normals, grids = [], [], []
    for number, control in enumerate(load_patches()):
        point = np.einsum("ui,vj,ijc->uvc", values, values, control)
        along_u = np.einsum("ui,vj,ijc->uvc", slopes, values, control)
        along_v = np.einsum("ui,vj,ijc->uvc", values, slopes, control)
        normal = np.cross(along_v, along_u)
        # At the tip of the lid and the middle of the bottom a whole side of the patch is one point on the axis and a
        # tangent vanishes; being a surface of revolution, the teapot is perpendicular to the axis there.
        length = np.linalg.norm(normal, axis=-1)
        pole = length < 1e-9
        normal[pole] = (0.0, 0.0, np.sign(point[..., 2].mean() - 1.0))
        length[pole] = 1.0
        points.append(point.reshape(-1, 3))
        normals.append((normal / length[..., None]).reshape(-1, 3))
        grids.append(np.arange((segments + 1) ** 2).reshape(segments + 1, -1) + number * (segments + 1) ** 2)
    vertices = np.concatenate(points).astype(np.float32)
    directions = np.concatenate(normals).astype(np.float32)

    key = np.concatenate([np.round(vertices, 5), np.round(directions, 3)], axis=1) + 0.0  # + 0 turns -0 into 0
    _, first, merged = np.unique(key, axis=0, return_index=True, return_inverse=True)
    corners = np.concatenate(
        [np.stack([g[:-1, :-1], g[:-1, 1:], g[1:, 1:], g[1:, :-1]], axis=-1).reshape(-1, 4) for g in grids]
    )
    polygons = []
    for quad in merged.reshape(-1)[corners].tolist():
        polygon = [point for i, point in enumerate(quad) if point != quad[i - 1]]
        if len(polygon) >= 3:
            polygons.append(polygon)
    return vertices[first], polygons, directions[first]
