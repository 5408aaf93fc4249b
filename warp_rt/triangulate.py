# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Polygons to triangles, whatever their number of vertices, tilt and shape."""

from __future__ import annotations

import mapbox_earcut
import numpy as np

# At a time: what is computed on the way stays in the cache, and takes little memory however large the mesh.
_BLOCK_CORNERS = 1 << 15

# A fan's triangle may be turned over by this part of its face's area before the face counts as concave: the noise of
# float32 points that are meant to lie on one line. The error in area has the same bound.
_TURNED_AREA = 1e-7


def triangulate(
    points: np.ndarray, starts: np.ndarray, counts: np.ndarray, indices: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles that polygons are cut into, and the polygon of each.

    A polygon that a fan about its first corner covers without turning a triangle over, as every convex one is, is
    cut so; another quadrilateral is cut along its other diagonal; the rest have their ears clipped. Each polygon of
    n corners that does not cross itself gives n - 2 triangles that use all of its corners and edges, some of them of
    no area where corners lie on one line: so polygons that share edges stay joined.

    Args:
        points: Finite vertex positions, shape [n, 3].
        starts: Position of each polygon's first corner in ``indices``, shape [f].
        counts: Corners of each polygon, 3 or more, shape [f].
        indices: Vertex of each corner, all of them valid rows of ``points``, shape [c].

    Returns:
        Corners of each triangle, positions in ``indices`` in the polygon's own winding, int64, shape [m, 3];
        polygon of each triangle, ascending, int64, shape [m].
    """
    if (counts == 3).all():
        return starts[:, None] + _fan(3), np.arange(len(starts))
    corners: list[np.ndarray] = [np.zeros((0, 3), np.int64)]
    faces: list[np.ndarray] = [np.zeros(0, np.int64)]
    kinds = np.unique(counts)
    for count in kinds:
        of_count = np.flatnonzero(counts == count) if len(kinds) > 1 else np.arange(len(counts))
        step = max(1, _BLOCK_CORNERS // int(count))
        for begin in range(0, len(of_count), step):
            block = of_count[begin : begin + step]
            cut = _cut_block(points, starts[block], int(count), indices)
            corners.append(cut[0])
            faces.append(block[cut[1]])
    order = np.argsort(np.concatenate(faces), kind="stable")
    return np.concatenate(corners)[order], np.concatenate(faces)[order]


def _cut_block(
    points: np.ndarray, starts: np.ndarray, count: int, indices: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Cut polygons that have the same number of corners; as ``triangulate``, faces counted within the block."""
    local = _fan(count)
    if count == 3:
        return starts[:, None] + local, np.arange(len(starts))
    # Each coordinate of all polygons' first corners, second corners and so on: NumPy is fast along long rows.
    corner_points = points.T[:, indices[starts + np.arange(count)[:, None]]].astype(np.float64)
    x, y, z = corner_points[:, 1:] - corner_points[:, :1]
    double_areas = np.stack(
        [
            y[:-1] * z[1:] - z[:-1] * y[1:],
            z[:-1] * x[1:] - x[:-1] * z[1:],
            x[:-1] * y[1:] - y[:-1] * x[1:],
        ]
    )
    normals = double_areas.sum(axis=1)
    along = (double_areas * normals[:, None]).sum(axis=0)
    is_fan = along.min(axis=0) >= -_TURNED_AREA * (normals**2).sum(axis=0)
    if is_fan.all():
        return (starts[:, None, None] + local).reshape(-1, 3), np.repeat(np.arange(len(starts)), count - 2)
    fans, others = np.flatnonzero(is_fan), np.flatnonzero(~is_fan)
    corners = [(starts[fans, None, None] + local).reshape(-1, 3)]
    faces = [np.repeat(fans, count - 2)]
    if count == 4:
        corners.append((starts[others, None, None] + (local + 1) % 4).reshape(-1, 3))
        faces.append(np.repeat(others, 2))
    else:
        for face in others:
            outline = corner_points[:, :, face].T
            clipped = _clip_ears(outline - outline[0], normals[:, face])
            corners.append(starts[face] + clipped)
            faces.append(np.full(len(clipped), face))
    return np.concatenate(corners), np.concatenate(faces)


def _fan(count: int) -> np.ndarray:
    """Return the triangles of a fan about corner 0, shape [count - 2, 3]."""
    second = np.arange(1, count - 1)
    return np.stack([np.zeros_like(second), second, second + 1], axis=1)


def _clip_ears(points: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the triangles of one concave polygon, wound as the polygon is.

    Args:
        points: Corners in order, float64, shape [n, 3].
        normal: Area vector of the polygon, shape [3].
    """
    # Leaving out the axis that the normal is longest along is affine: what is an ear stays one, without rounding.
    axis = int(np.argmax(np.abs(normal)))
    plane = np.ascontiguousarray(points[:, [(axis + 1) % 3, (axis + 2) % 3]])
    if normal[axis] < 0:
        plane = np.ascontiguousarray(plane[:, ::-1])
    count = len(points)
    triangles = mapbox_earcut.triangulate_float64(plane, np.array([count], np.uint32)).reshape(-1, 3).astype(np.int64)
    if not len(triangles):
        return _fan(count)
    first, second = plane[triangles[:, 1]] - plane[triangles[:, 0]], plane[triangles[:, 2]] - plane[triangles[:, 0]]
    turned = first[:, 0] * second[:, 1] < first[:, 1] * second[:, 0]
    triangles[turned] = triangles[turned][:, [0, 2, 1]]
    return _with_dropped_corners(triangles, count)


def _with_dropped_corners(triangles: np.ndarray, count: int) -> np.ndarray:
    """Return the triangles and, for each corner that ear clipping left out, one of no area that joins it.

    The clipping drops corners that lie on a line with their neighbours. The neighbouring polygon still has an edge
    that ends there, so without the corner the mesh would come apart.
    """
    is_kept = np.zeros(count, bool)
    is_kept[triangles.reshape(-1)] = True
    kept = np.flatnonzero(is_kept)
    if len(kept) == count or len(triangles) != len(kept) - 2:
        return triangles
    added = [
        (corner, middle % count, (middle + 1) % count)
        for corner, following in zip(kept, np.append(kept[1:], kept[0] + count), strict=True)
        for middle in range(corner + 1, following)
    ]
    return np.concatenate([triangles, np.array(added, np.int64)])
