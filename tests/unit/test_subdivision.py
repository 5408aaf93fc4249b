# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Subdivision against B-splines, published masks, and itself: a limit does not depend on the level it is seen from."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from warp_rt.scene.equal_rows import first_equal_rows
from warp_rt.subdivision.face_varying import RULES
from warp_rt.subdivision.refine import Step
from warp_rt.subdivision.surface import Rules, Surface
from warp_rt.subdivision.topology import INFINITE, Edges, Topology

from ..meshes import octasphere

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
CUBE_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
CUBE_TOP = [(1, 3), (3, 7), (7, 5), (5, 1)]


def topology(faces: list, vertex_count: int, creases: dict | None = None, corners: dict | None = None) -> Topology:
    sharpness = np.zeros(vertex_count)
    for vertex, value in (corners or {}).items():
        sharpness[vertex] = value
    return Topology(
        vertex_count=vertex_count,
        counts=np.array([len(face) for face in faces]),
        corners=np.concatenate([np.array(face, np.int64) for face in faces]),
        creases=np.array(list(creases or {}), np.int64).reshape(-1, 2),
        crease_sharpness=np.array(list((creases or {}).values()), float),
        vertex_sharpness=sharpness,
    )


def grid(size: int) -> list[list[int]]:
    """Return the quadrilaterals of size x size vertices, number i * size + j at (i, j)."""
    steps = [(0, 0), (1, 0), (1, 1), (0, 1)]
    return [[(i + a) * size + j + b for a, b in steps] for i in range(size - 1) for j in range(size - 1)]


def fan(count: int, height: float = 0.7) -> tuple[list, np.ndarray]:
    """Return a bipyramid over a polygon: two vertices of that valence, the others of valence 4."""
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.cos(2 * angle)], axis=1)
    points = np.vstack([ring, [[0.05, 0.1, height]], [[0, 0, -height]]])
    faces = [[i, (i + 1) % count, count] for i in range(count)]
    return faces + [[(i + 1) % count, i, count + 1] for i in range(count)], points


def b_spline(controls: np.ndarray, t: float, derivative: bool = False) -> np.ndarray:
    """Return a uniform cubic B-spline at t, knots at whole numbers; control i has its influence around t = i."""
    weights = []
    for i in range(len(controls)):
        x = abs(t - i)
        if derivative:
            slope = -2 * x + 1.5 * x * x if x < 1 else -((2 - x) ** 2) / 2 if x < 2 else 0.0
            weights.append(slope * np.sign(t - i))
        else:
            weights.append(2 / 3 - x * x + x**3 / 2 if x < 1 else (2 - x) ** 3 / 6 if x < 2 else 0.0)
    return np.tensordot(weights, controls, axes=1)


# --- Catmull-Clark


def test_regular_surfaces_are_bicubic_b_splines() -> None:
    """Points and normals, at every vertex of three refinements that lies within the inner cage."""
    size, level = 7, 3
    cage = np.random.default_rng(1).normal(size=(size, size, 3)) + np.mgrid[0:size, 0:size, 0:1].reshape(
        3, -1
    ).T.reshape(size, size, 3)
    surface = Surface(topology(grid(size), size * size), Rules(), level)
    points, normals, rows = surface.limit(cage.reshape(-1, 3))
    # Where a refined vertex is in the plane of parameters is what linear interpolation makes of the numbers (i, j).
    place = surface.linear(np.argwhere(np.ones((size, size))).astype(float))
    corner_normal = {v: normals[row] for v, row in zip(surface.topology.corners, rows, strict=True)}
    tested = 0
    for vertex, (u, v) in enumerate(place):
        if not (2 <= u <= size - 3 and 2 <= v <= size - 3):
            continue
        expected = b_spline(b_spline(cage, u), v)
        normal = np.cross(
            b_spline(b_spline(cage, u, derivative=True), v), b_spline(b_spline(cage, u), v, derivative=True)
        )
        np.testing.assert_allclose(points[vertex], expected, atol=1e-12)
        np.testing.assert_allclose(corner_normal[vertex], normal / np.linalg.norm(normal), atol=1e-10)
        tested += 1
    assert tested == 17 * 17


def test_boundaries_are_cubic_b_splines_between_their_corners() -> None:
    size, level = 6, 3
    cage = np.random.default_rng(2).normal(size=(size, size, 3))
    surface = Surface(topology(grid(size), size * size), Rules(), level)
    points, _, _ = surface.limit(cage.reshape(-1, 3))
    place = surface.linear(np.argwhere(np.ones((size, size))).astype(float))
    for vertex, (u, v) in enumerate(place):
        if v == 0 and 2 <= u <= size - 3:
            np.testing.assert_allclose(points[vertex], b_spline(cage[:, 0], u), atol=1e-12)
    for row in (0, size - 1, size * (size - 1), size * size - 1):  # edgeAndCorner: corners stay
        np.testing.assert_allclose(points[row], cage.reshape(-1, 3)[row], atol=1e-12)
    smooth = Surface(topology(grid(size), size * size), Rules(boundary="edgeOnly"), level)
    assert np.abs(smooth.limit(cage.reshape(-1, 3))[0][0] - cage[0, 0]).max() > 0.05


def test_the_cubes_limit() -> None:
    """Halstead, Kass and DeRose (1993): (n^2 v + 4 sum e + sum f) / (n (n + 5)) after one step, half the cube here."""
    points, normals, rows = Surface(topology(CUBE_FACES, 8), Rules(), 1).limit(CUBE)
    np.testing.assert_allclose(points[:8], CUBE / 2, atol=1e-15)
    assert len(np.unique(rows)) == len(points)  # smooth everywhere
    first = np.unique(rows, return_index=True)[1]
    vertices = Surface(topology(CUBE_FACES, 8), Rules(), 1).topology.corners[first]
    at_corner = vertices < 8
    np.testing.assert_allclose(normals[at_corner], CUBE[vertices[at_corner]] / np.sqrt(3), atol=1e-12)


@pytest.mark.parametrize("valence", [3, 4, 5, 7])
def test_vertex_mask(valence: int) -> None:
    """Catmull and Clark (1978): Q / n + 2 R / n + S (n - 3) / n, Q of face points, R of edge midpoints."""
    faces, points = fan(valence)
    step = Step(topology(faces, len(points)))
    apex, ring = points[valence], points[:valence]
    face_points = (ring + np.roll(ring, -1, axis=0) + apex) / 3
    expected = face_points.mean(axis=0) / valence + 2 * ((ring + apex) / 2).mean(axis=0) / valence
    expected += apex * (valence - 3) / valence
    np.testing.assert_allclose(step.smooth(points)[valence], expected, atol=1e-14)


def test_smooth_triangles_weigh_face_points_by_0_47() -> None:
    faces, points = fan(6)
    step = Step(topology(faces, len(points)), smooth_triangles=True)
    edge = np.flatnonzero((step.parent.edges == [0, 6]).all(axis=1))[0]
    face_points = [points[[0, 1, 6]].mean(axis=0), points[[5, 0, 6]].mean(axis=0)]
    expected = 0.470 * np.sum(face_points, axis=0) + (1 - 2 * 0.470) * points[[0, 6]].mean(axis=0)
    np.testing.assert_allclose(step.smooth(points)[len(points) + edge], expected, atol=1e-14)


# --- Loop


def test_loop_masks() -> None:
    """Loop (1987): edges 3/8, 3/8, 1/8, 1/8; a vertex of valence 6 5/8 and 1/16, of valence 3 7/16 and 3/16."""
    for valence, own in ((6, 5 / 8), (3, 7 / 16)):
        faces, points = fan(valence)
        step = Step(topology(faces, len(points)), is_loop=True)
        refined = step.smooth(points)
        apex, ring = points[valence], points[:valence]
        np.testing.assert_allclose(refined[valence], own * apex + (1 - own) * ring.mean(axis=0), atol=1e-14)
        edge = np.flatnonzero((step.parent.edges == [0, valence]).all(axis=1))[0]
        expected = 3 / 8 * (points[0] + apex) + 1 / 8 * (points[1] + points[valence - 1])
        np.testing.assert_allclose(refined[len(points) + edge], expected, atol=1e-14)


def test_loop_limit_of_a_regular_vertex() -> None:
    """Half the vertex and a twelfth of each neighbour."""
    faces, points = fan(6)
    step = Step(topology(faces, len(points)), is_loop=True)
    limits, _, _ = Surface(topology(faces, len(points)), Rules(is_loop=True), 1).limit(points)
    refined, edges = step.smooth(points), step.parent.edges
    ring = len(points) + np.flatnonzero((edges == 6).any(axis=1))
    np.testing.assert_allclose(limits[6], refined[6] / 2 + refined[ring].sum(axis=0) / 12, atol=1e-14)


# --- limits, seen from any level

HARD = INFINITE
EDGE_LINE = dict.fromkeys([(4, 5), (5, 6), (6, 7)], HARD)
PENTAGON = [[0, 1, 2, 3, 4], [0, 5, 1], [1, 5, 2], [2, 5, 3], [3, 5, 4], [4, 5, 0]]
CAGES = {
    "cube": (CUBE_FACES, CUBE, {}, {}),
    "cube with a creased face": (CUBE_FACES, CUBE, dict.fromkeys(CUBE_TOP, HARD), {}),
    "cube with a corner": (CUBE_FACES, CUBE, {}, {6: HARD}),
    "three creases at a vertex": (CUBE_FACES, CUBE, {(0, 1): HARD, (0, 2): HARD, (0, 4): HARD}, {}),
    "open grid": (grid(4), np.random.default_rng(3).normal(size=(16, 3)), {}, {}),
    "creased grid": (grid(4), np.random.default_rng(4).normal(size=(16, 3)), EDGE_LINE, {}),
    "pentagon": (PENTAGON, fan(5)[1][[0, 4, 3, 2, 1, 5]], {}, {}),
    "valence 7": (*fan(7), {}, {}),
    "semi-sharp cube": (CUBE_FACES, CUBE, dict.fromkeys(CUBE_TOP, 2.5), {0: 1.3, 7: 3.0}),
    "semi-sharp dart": (CUBE_FACES, CUBE, {(0, 1): HARD, (0, 2): 0.4, (0, 4): 3.7}, {}),
    "semi-sharp rim": (grid(4), np.random.default_rng(5).normal(size=(16, 3)), {(5, 6): 1.5, (1, 5): 4.0}, {2: 2.2}),
}


@pytest.mark.parametrize("is_loop", [False, True])
@pytest.mark.parametrize("name", CAGES)
def test_limits_do_not_depend_on_the_level(name: str, is_loop: bool) -> None:
    faces, points, creases, corners = CAGES[name]
    if is_loop:
        faces = [[face[0], face[i], face[i + 1]] for face in faces for i in range(1, len(face) - 1)]
    cage = topology(faces, len(points), creases, corners)
    seen = []
    for level in (1, 2, 4):
        surface = Surface(cage, Rules(is_loop=is_loop), level)
        limits, normals, rows = surface.limit(points)
        by_corner = {}
        for vertex, row in zip(surface.topology.corners, rows, strict=True):
            by_corner.setdefault(vertex, set()).add(row)
        single = {vertex: normals[min(found)] for vertex, found in by_corner.items() if len(found) == 1}
        seen.append((limits, single, {vertex: len(found) for vertex, found in by_corner.items()}))
    first, first_normals, first_counts = seen[0]
    for limits, normals, counts in seen[1:]:
        np.testing.assert_allclose(limits[: len(first)], first, atol=1e-12)
        assert {vertex: counts[vertex] for vertex in first_counts} == first_counts
        for vertex in first_normals:
            kind = cage.vertex_face_count[vertex] if vertex < len(points) else 0
            if not (name in ("open grid", "semi-sharp rim") and kind == 1):  # a corner's is that of its nearest facet
                np.testing.assert_allclose(normals[vertex], first_normals[vertex], atol=1e-10)


@pytest.mark.parametrize("is_loop", [False, True])
def test_normals_are_those_of_tiny_facets(is_loop: bool) -> None:
    faces, points = fan(5)
    surface = Surface(topology(faces, len(points)), Rules(is_loop=is_loop), 6)
    limits, normals, rows = surface.limit(points)
    corners = surface.topology.corners.reshape(-1, 3 if is_loop else 4)
    facet = np.cross(limits[corners[:, 1]] - limits[corners[:, 0]], limits[corners[:, -1]] - limits[corners[:, 0]])
    facet /= np.linalg.norm(facet, axis=1, keepdims=True)
    assert (facet * normals[rows.reshape(corners.shape)[:, 0]]).sum(axis=1).min() > 0.999


@pytest.mark.parametrize("is_loop", [False, True])
def test_faces_at_a_corner_have_normals_of_their_own(is_loop: bool) -> None:
    """A vertex pinned where all around it is smooth is the tip of a cone, whose facets go their own way."""
    faces, points = fan(6)
    surface = Surface(topology(faces, len(points), corners={6: HARD}), Rules(is_loop=is_loop), 3)
    limits, normals, rows = surface.limit(points)
    at_tip = np.flatnonzero(surface.topology.corners == 6)
    spoke, last = (
        limits[surface.topology.corners[way[at_tip]]]
        for way in (surface.topology.following, surface.topology.preceding)
    )
    facet = np.cross(spoke - limits[6], last - limits[6])
    facet /= np.linalg.norm(facet, axis=1, keepdims=True)
    assert len(at_tip) == 6
    assert (facet * normals[rows[at_tip]]).sum(axis=1).min() > 0.99
    assert (normals[rows[at_tip]] @ normals[rows[at_tip]].T).min() < 0.5


# --- sharpness


@pytest.mark.parametrize("sharpness", [0.0, 0.25, 1.0, 1.5, 3.0])
def test_sharpness_blends_edge_rules_and_wears_off(sharpness: float) -> None:
    """DeRose, Kass and Truong (1998): sharp while 1 or more is left, smooth at 0, blended between."""
    cage = topology(CUBE_FACES, 8, dict.fromkeys(CUBE_TOP, sharpness))
    points, left = CUBE, sharpness
    for _ in range(4):
        step = Step(cage)
        edges = Edges(cage.edges, cage.edge, np.zeros(len(cage.edges)))
        smooth = Step(replace(cage, known_edges=edges)).smooth(points)
        refined = step.smooth(points)
        sharp = np.flatnonzero(cage.edge_sharpness > 0)
        blend = min(left, 1.0)
        middle = points[cage.edges[sharp]].mean(axis=1)
        row = cage.vertex_count + sharp
        np.testing.assert_allclose(refined[row], blend * middle + (1 - blend) * smooth[row], atol=1e-14)
        assert bool(len(sharp)) == (left > 0)
        cage, points, left = step.child, refined, max(left - 1, 0)
    assert (cage.edge_sharpness > 0).any() == (left > 0)


def test_infinite_sharpness_stays() -> None:
    surface = Surface(topology(CUBE_FACES, 8, dict.fromkeys(CUBE_TOP, INFINITE)), Rules(), 4)
    limits, _, rows = surface.limit(CUBE)
    on_crease = np.abs(limits[:, 2] - 1) < 1e-12
    assert on_crease.sum() > 4 * 16
    sectors = {}
    for vertex, row in zip(surface.topology.corners, rows, strict=True):
        sectors.setdefault(vertex, set()).add(row)
    assert {
        len(sectors[v]) for v in np.flatnonzero(surface.topology.sum_at_ends(surface.topology.edge_sharpness) > 0)
    } == {2}


def test_a_vertex_between_rules() -> None:
    """A corner of sharpness 0.5 is halfway between its smooth mask and itself."""
    cage = topology(CUBE_FACES, 8, corners={0: 0.5})
    smooth = Step(topology(CUBE_FACES, 8)).smooth(CUBE)[0]
    np.testing.assert_allclose(Step(cage).smooth(CUBE)[0], 0.5 * smooth + 0.5 * CUBE[0], atol=1e-14)


# --- what is not manifold


def test_odd_meshes_stay_finite_and_keep_what_is_pinned() -> None:
    fin = [*CUBE_FACES, [0, 1, 8]]  # three faces at an edge
    points = np.vstack([CUBE, [[-3, -3, 0]]])
    limits, normals, _ = Surface(topology(fin, 9), Rules(), 2).limit(points)
    assert np.isfinite(limits).all()
    assert np.isfinite(normals).all()
    bow = [[0, 1, 2, 3], [0, 4, 5, 6]]  # two faces that share a vertex alone
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 0, 0], [-1, -1, 0], [0, -1, 0]], float)
    limits, _, _ = Surface(topology(bow, 7), Rules(), 3).limit(square)
    np.testing.assert_allclose(limits[0], 0, atol=1e-12)
    turned = [[0, 1, 4, 3], [4, 1, 2, 5][::-1]]  # neighbours that disagree on the direction of their edge
    flat = np.array([[i, j, 0] for j in range(2) for i in range(3)], float)
    limits, _, _ = Surface(topology(turned, 6), Rules(), 2).limit(flat)
    np.testing.assert_allclose(limits[1], (1, 0, 0), atol=1e-12)


@pytest.mark.parametrize("is_loop", [False, True])
def test_vertices_where_two_cones_touch_are_corners(is_loop: bool) -> None:
    """Around the apex of both lie two rings: OpenSubdiv sharpens what is no manifold."""
    faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2], [0, 5, 4], [0, 6, 5], [0, 4, 6], [4, 5, 6]]
    points = np.array([(0, 0, 0), (1, 1, 1), (1, -1, 1), (1, 0, -1), (-1, 1, 3), (-1, -1, 3), (-1, 0, 1)], float)
    limits, _, _ = Surface(topology(faces, 7), Rules(is_loop=is_loop), 2).limit(points)
    np.testing.assert_allclose(limits[0], 0, atol=1e-12)


def test_a_rim_that_touches_a_cone_is_a_corner_there() -> None:
    faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2], [0, 4, 5, 6], [0, 6, 7, 8]]
    points = np.random.default_rng(3).normal(size=(9, 3))
    limits, _, _ = Surface(topology(faces, 9), Rules(), 2).limit(points)
    np.testing.assert_allclose(limits[0], points[0], atol=1e-12)


def test_vertices_between_faces_of_different_sides_are_corners() -> None:
    faces = grid(3)
    faces[3] = faces[3][::-1]
    points = np.random.default_rng(4).normal(size=(9, 3))
    limits, _, _ = Surface(topology(faces, 9), Rules(), 2).limit(points)
    np.testing.assert_allclose(limits[4], points[4], atol=1e-12)


def test_fins_meet_in_a_smooth_crease() -> None:
    """Three strips share two edges in a row: their curve is a cubic B-spline, and its ends are corners."""
    points, faces = [(0.0, y * y / 2, 0.0) for y in range(3)], []
    for turn in 2 * np.pi * np.arange(3) / 3:
        first = len(points)
        points += [(np.cos(turn), y, np.sin(turn)) for y in range(3)]
        faces += [[y, y + 1, first + y + 1, first + y] for y in range(2)]
    limits, _, _ = Surface(topology(faces, len(points)), Rules(), 1).limit(np.array(points))
    np.testing.assert_allclose(limits[:3, 1], [0, (0 + 4 * 0.5 + 2) / 6, 2], atol=1e-12)


@pytest.mark.parametrize(
    ("rim", "faces"),
    [
        ([], set()),
        ([0, 1, 2, 5, 8, 7, 6, 3, 0], {0, 1, 2, 3}),
        ([0, 1, 2, 5, 8, 7, 6, 3], {1, 3}),  # the edge from 3 to 0 is open: no face at its ends
    ],
)
def test_boundary_rule_none_leaves_out_faces_at_rims_that_are_not_creased(rim: list[int], faces: set[int]) -> None:
    cage = topology(grid(3), 9, dict.fromkeys(itertools.pairwise(rim), INFINITE))
    order = [0, 2, 1, 3]  # of the grid's faces, whose vertex i * 3 + j is at (i, j)
    shown = Surface(cage, Rules(boundary="none"), 1).has_surface[order]
    assert set(np.flatnonzero(shown)) == {order[face] for face in faces}


def test_boundary_rule_none_leaves_the_rim_out() -> None:
    surface = Surface(topology(grid(5), 25), Rules(boundary="none"), 1)
    assert surface.has_surface.sum() == 4
    assert Surface(topology(grid(5), 25), Rules(), 1).has_surface.all()


# --- face-varying values


@pytest.mark.parametrize("rule", RULES)
def test_values_without_seams_follow_the_vertices(rule: str) -> None:
    """But for the rule that is linear everywhere."""
    values = np.random.default_rng(6).normal(size=(8, 2))
    cage = topology(CUBE_FACES, 8, dict.fromkeys(CUBE_TOP, 1.5))
    surface = Surface(cage, Rules(face_varying=rule), 2)
    found, rows = surface.face_varying(values, cage.corners)
    expected = surface.linear(values) if rule == "all" else surface.values(values)
    np.testing.assert_allclose(found[rows], expected[surface.topology.corners], atol=1e-12)


@pytest.mark.parametrize("rule", RULES)
def test_seams_by_rule(rule: str) -> None:
    """Two islands of 2 x 4 squares on a flat grid of 4 x 4: where seam vertices go, by their kind."""
    cage = topology(grid(5), 25)
    u = cage.corners // 5 + np.where(np.arange(len(cage.corners)) // 4 >= 8, 10.0, 0.0)
    values = np.stack([u, (cage.corners % 5 - 2.0) ** 2], axis=1)
    surface = Surface(cage, Rules(face_varying=rule), 1)
    found, rows = surface.face_varying(values, first_equal_rows(values))
    corner = np.flatnonzero((cage.corners == 2 * 5 + 2) & (u < 5))[0]  # in the middle of the seam, first island
    # The first refined face at a corner begins at the corner's own vertex.
    moved = found[rows[4 * corner]]
    linear = rule in ("boundaries", "all")
    # Along the seam: (v - 2)^2 is 1, 0, 1 around it, so the limit of the crease mask is 1/3.
    np.testing.assert_allclose(moved, (2, 0 if linear else 1 / 3), atol=1e-12)


def test_corners_of_islands_are_pinned_unless_the_rule_is_none() -> None:
    """One square cut out of its surroundings has four corners of one face each."""
    cage = topology(grid(4), 16)
    values = np.stack([cage.corners // 4, cage.corners % 4], axis=1).astype(float)
    middle = np.flatnonzero(cage.face == 4)
    values[middle] = [(20, 20), (21, 20), (21, 21), (20, 21)]
    for rule in RULES:
        found, rows = Surface(cage, Rules(face_varying=rule), 1).face_varying(values, first_equal_rows(values))
        stays = np.abs(found[rows[4 * middle[0]]] - (20, 20)).max() < 1e-12
        assert stays == (rule != "none"), rule


@pytest.mark.parametrize("rule", RULES)
def test_values_at_the_corner_of_a_lone_face(rule: str) -> None:
    """Sharp, though ``edgeOnly`` rounds the surface off there, unless no rule asks for corners."""
    cage = topology([[0, 1, 2, 3]], 4)
    values = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    found, rows = Surface(cage, Rules(boundary="edgeOnly", face_varying=rule), 1).face_varying(
        values, first_equal_rows(values)
    )
    np.testing.assert_allclose(found[rows[0]], 1 / 6 if rule == "none" else 0.0, atol=1e-12)


@pytest.mark.parametrize("rule", RULES)
def test_values_along_a_rim(rule: str) -> None:
    """``boundaries`` means the surface's as well as those of islands."""
    cage = topology([[0, 1, 4, 3], [1, 2, 5, 4]], 6)
    values = np.where(np.arange(6) % 3 == 2, 3.0, 0)[:, None]
    found, rows = Surface(cage, Rules(face_varying=rule), 1).face_varying(values, cage.corners)
    np.testing.assert_allclose(found[rows[4]], 0 if rule in ("boundaries", "all") else 1 / 2, atol=1e-12)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize(("sharpness", "moved"), [(0.5, (4 * 0.875 + 2 * 0.5) / 6), (INFINITE, 1.0), (0.0, 2 / 3)])
def test_values_on_a_seam_are_as_sharp_as_their_vertex(rule: str, sharpness: float, moved: float) -> None:
    """1 - (v - 2)^2 is 0, 1, 0 along it. Sharpness 0.5 halves the first step, to 7/8 beside 1/2; then it is smooth."""
    cage = topology(grid(5), 25, corners={12: sharpness})
    u = cage.corners // 5 + np.where(np.arange(len(cage.corners)) // 4 >= 8, 10.0, 0.0)
    values = np.stack([u, 1 - (cage.corners % 5 - 2.0) ** 2], axis=1)
    found, rows = Surface(cage, Rules(face_varying=rule), 1).face_varying(values, first_equal_rows(values))
    corner = np.flatnonzero((cage.corners == 12) & (u < 5))[0]
    np.testing.assert_allclose(found[rows[4 * corner]], (2, 1 if rule in ("boundaries", "all") else moved), atol=1e-12)


@pytest.mark.parametrize("rule", RULES)
def test_a_crease_within_one_island_sharpens_both_where_rules_depend(rule: str) -> None:
    """An infinite crease runs into the seam from the first island: by plus rules the second's value is sharp, too."""
    cage = topology(grid(5), 25, {(7, 12): INFINITE})
    u = cage.corners // 5 + np.where(np.arange(len(cage.corners)) // 4 >= 8, 10.0, 0.0)
    values = np.stack([u, (cage.corners % 5 - 2.0) ** 2], axis=1)
    found, rows = Surface(cage, Rules(face_varying=rule), 1).face_varying(values, first_equal_rows(values))
    for side, is_sharp in ((u < 5, True), (u > 5, rule not in ("none", "cornersOnly"))):
        corner = np.flatnonzero((cage.corners == 12) & side)[0]
        np.testing.assert_allclose(found[rows[4 * corner], 1], 0 if is_sharp else 1 / 3, atol=1e-12)


def test_rows_say_where_seams_are_not_values() -> None:
    """Two islands whose values are the same along their seam, as by indices of their own."""
    cage = topology(grid(5), 25)
    values = np.tile(((np.arange(25) % 5 - 2.0) ** 2 + (np.arange(25) // 5 == 3))[:, None], (2, 1))
    rows_of_islands = cage.corners + np.where(np.arange(len(cage.corners)) // 4 >= 8, 25, 0)
    at = np.flatnonzero(cage.corners == 12)[0]
    for rows_of_corners, expected in ((rows_of_islands, 1 / 3), (cage.corners, 1 / 3 + 1 / 6)):
        found, rows = Surface(cage, Rules(), 1).face_varying(values, rows_of_corners)
        np.testing.assert_allclose(found[rows[4 * at]], expected, atol=1e-12)


def test_affine_values_are_reproduced() -> None:
    """Whatever the rules, weights sum to one and a regular flat cage stays what it is."""
    points, triangles = octasphere(1)
    surface = Surface(topology([*triangles], len(points)), Rules(is_loop=True), 2)
    np.testing.assert_allclose(surface.smooth(np.full((len(points), 1), 3.5)), 3.5, atol=1e-12)
    flat = np.argwhere(np.ones((6, 6))).astype(float)
    surface = Surface(topology(grid(6), 36), Rules(), 2)
    np.testing.assert_allclose(surface.smooth(flat), surface.linear(flat), atol=1e-12)


@pytest.mark.parametrize("is_loop", [False, True])
def test_refined_edges_are_those_that_sorting_finds(is_loop: bool) -> None:
    faces = [[0, 1, 2], [0, 2, 3], [2, 1, 4]] if is_loop else [[0, 1, 2, 3], [2, 1, 4], [3, 2, 4, 5, 6]]
    refined = Step(Step(topology(faces, 7, {(1, 2): 2.5})).child if not is_loop else topology(faces, 7), is_loop).child
    found = replace(refined, known_edges=None)
    known = {tuple(sorted(ends)): row for row, ends in enumerate(refined.edges.tolist())}
    assert len(known) == len(refined.edges) == len(found.edges)
    order = [known[ends] for ends in map(tuple, found.edges.tolist())]
    np.testing.assert_array_equal(np.array(order)[found.edge], refined.edge)
    np.testing.assert_array_equal(found.edge_sharpness, refined.edge_sharpness[order])
    np.testing.assert_array_equal(found.is_seam, refined.is_seam[order])
    ends = np.stack([refined.corners, refined.corners[refined.following]], axis=1)
    joined = refined.twin >= 0
    np.testing.assert_array_equal(ends[joined], ends[refined.twin[joined]][:, ::-1])
    assert (joined == ~refined.is_seam[refined.edge]).all()


def test_faces_that_use_a_vertex_twice_in_a_row_do_no_harm() -> None:
    points = np.random.default_rng(2).normal(size=(5, 3))
    limits, normals, _ = Surface(topology([[0, 0, 1, 2], [2, 1, 3, 4]], 5), Rules(), 2).limit(points)
    assert np.isfinite(limits).all()
    assert np.isfinite(normals).all()
