# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Polygons with known areas, cut into triangles."""

import numpy as np
import pytest

from warp_rt.triangulate import triangulate

TILT = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [0.3, -1.0, 2.0], [2.0, 0.1, 1.0]]))[0]

SQUARE = [(0, 0), (2, 0), (2, 2), (0, 2)]
DART = [(0, 0), (2, 0), (0.4, 0.4), (0, 2)]  # reflex at its third corner
COMB = [(0, 0), (5, 0), (5, 3), (4, 3), (4, 1), (3, 1), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]
# A square with a square hole, the two joined by an edge that is walked both ways: 16 - 4.
KEYHOLE = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
# Corners in the middle of straight sides, on a concave outline.
T_JUNCTIONS = [(0, 0), (1, 0), (2, 0), (2, 1), (3, 1), (4, 1), (4, 0), (6, 0), (6, 3), (4, 3), (3, 3), (2, 3), (0, 3)]
POLYGONS = {
    "square": (SQUARE, 4.0),
    "dart": (DART, 0.8),
    "comb": (COMB, 11.0),
    "keyhole": (KEYHOLE, 12.0),
    "T junctions": (T_JUNCTIONS, 16.0),
    "pentagon": ([(0, 0), (2, 0), (3, 1), (1, 3), (0, 2)], 6.0),
}


def lift(outline: list[tuple[float, float]]) -> np.ndarray:
    flat = np.array([(x, y, 0.0) for x, y in outline])
    return flat @ TILT.T + [3.0, -2.0, 5.0]


def cut(points: np.ndarray) -> np.ndarray:
    count = len(points)
    corners, faces = triangulate(points, np.array([0]), np.array([count]), np.arange(count))
    assert (faces == 0).all()
    return corners


def area_vectors(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize("name", POLYGONS)
@pytest.mark.parametrize("is_turned", [False, True])
def test_area_and_winding_of_every_starting_corner(name: str, is_turned: bool) -> None:
    outline, area = POLYGONS[name]
    if is_turned:
        outline = outline[::-1]
    normal = TILT[:, 2] * (-1 if is_turned else 1) * np.linalg.det(TILT)
    for first in range(len(outline)):
        points = lift(outline[first:] + outline[:first])
        vectors = area_vectors(points, cut(points))
        # The areas add up without cancelling only if no triangle is turned over and none overlap.
        assert np.linalg.norm(vectors, axis=1).sum() == pytest.approx(area, rel=1e-6)
        np.testing.assert_allclose(vectors.sum(axis=0), area * normal, atol=1e-9)


@pytest.mark.parametrize("name", POLYGONS)
def test_every_edge_of_the_polygon_is_an_edge_of_one_triangle(name: str) -> None:
    points = lift(POLYGONS[name][0])
    count = len(points)
    triangles = cut(points)
    assert len(triangles) == count - 2
    edges = [(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)]
    open_edges = sorted(edge for edge in edges if edge[::-1] not in edges)
    assert open_edges == [(k, (k + 1) % count) for k in range(count - 1)] + [(count - 1, 0)]


def test_faces_of_all_sizes_keep_their_order_and_corners() -> None:
    points = np.array([lift(SQUARE), lift(DART)]).reshape(-1, 3)
    indices = np.array([0, 1, 2, 4, 5, 6, 7, 0, 1, 2, 3, 0, 2, 3])
    corners, faces = triangulate(points, np.array([0, 3, 7, 11]), np.array([3, 4, 4, 3]), indices)
    assert faces.tolist() == [0, 1, 1, 2, 2, 3]
    assert corners[0].tolist() == [0, 1, 2]
    assert set(corners[1:3].reshape(-1)) == {3, 4, 5, 6}
    assert corners[5].tolist() == [11, 12, 13]


def test_faces_without_area_and_no_faces() -> None:
    line = np.array([(float(x), 0.0, 0.0) for x in range(6)])
    assert len(cut(line)) == 4
    corners, faces = triangulate(line, np.zeros(0, int), np.zeros(0, int), np.zeros(0, int))
    assert corners.shape == (0, 3)
    assert faces.shape == (0,)


def test_bow_tie_is_cut_into_triangles_of_its_own_corners() -> None:
    points = np.array([(0.0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)])
    triangles = cut(points)
    assert len(triangles) == 2
    assert triangles.min() >= 0
    assert triangles.max() <= 3
