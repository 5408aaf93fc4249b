# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""B-splines against the recursion of Cox and de Boor; surfaces of revolution, which rational ones are exactly."""

from __future__ import annotations

import numpy as np
import pytest

from tests.bspline_float64 import curve_point, surface_point
from warp_rt.splines.curve import bezier_points, count_steps, homogeneous, points_at, polyline
from warp_rt.splines.patch import Patch, Places
from warp_rt.splines.pieces import bernstein, find_pieces
from warp_rt.splines.tessellation import find_lines, tessellate
from warp_rt.usd.volumes import encloses_volume

W = np.sqrt(0.5)
CIRCLE = [(1, 0, 1), (1, 1, W), (0, 1, 1), (-1, 1, W), (-1, 0, 1), (-1, -1, W), (0, -1, 1), (1, -1, W), (1, 0, 1)]
CIRCLE_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
HALF_KNOTS = [0, 0, 0, 1, 1, 2, 2, 2]


def one_spline(knots, count, degree, span=None):
    knots = np.array(knots, float)
    span = (knots[degree], knots[count]) if span is None else span
    return find_pieces(knots, np.zeros(1, np.int64), np.array([count]), degree, np.array([span], float))


def revolved(profile, profile_knots) -> Patch:
    """Return the surface that a profile of (radius, height, weight) sweeps about z; u turns."""
    points = [(r * x, r * y, z) for r, z, _ in profile for x, y, _ in CIRCLE]
    weights = [w * turn for _, _, w in profile for _, _, turn in CIRCLE]
    u, v = (
        one_spline(CIRCLE_KNOTS, 9, 2),
        one_spline(profile_knots, len(profile), len(profile_knots) - len(profile) - 1),
    )
    return Patch(np.array(points, float), np.array(weights, float), u, v, 9)


SPHERE = revolved([(0, -1, 1), (1, -1, W), (1, 0, 1), (1, 1, W), (0, 1, 1)], HALF_KNOTS)
TORUS = revolved([(3 + x, y, w) for x, y, w in CIRCLE], CIRCLE_KNOTS)
CYLINDER = revolved([(1, -2, 1), (1, 5, 1)], [0, 0, 1, 1])
CONE = revolved([(1, 0, 1), (0, 2, 1)], [0, 0, 1, 1])


def random_places(patch: Patch, count: int = 500) -> Places:
    rng = np.random.default_rng(11)
    return Places(
        rng.integers(0, len(patch.u), count), rng.integers(0, len(patch.v), count), rng.random(count), rng.random(count)
    )


# --- curves


@pytest.mark.parametrize(
    ("degree", "knots", "span"),
    [
        (1, [0, 0, 1, 2.5, 3, 3], None),
        (2, [0, 0, 0, 1, 1, 2, 2, 2], None),
        (3, [-3, -2, -1, 0, 1, 2, 3, 4, 5, 6], None),
        (3, [0, 0, 0, 0, 0.3, 0.3, 1.7, 2, 2, 2, 2], (0.1, 1.9)),
        (3, [0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2], (0.5, 2)),
        (4, [0, 0, 0.1, 0.2, 1, 1.5, 1.5, 2, 3, 4, 4], None),
        (5, [0] * 6 + [1, 1, 4] + [9] * 6, None),
    ],
)
def test_pieces_are_the_spline(degree: int, knots: list[float], span: tuple[float, float] | None) -> None:
    count = len(knots) - degree - 1
    rng = np.random.default_rng(degree)
    points, weights = rng.normal(size=(count, 3)), rng.uniform(0.5, 2, count)
    pieces = one_spline(knots, count, degree, span)
    low, high = span or (knots[degree], knots[count])
    assert (pieces.start[0], pieces.end[-1]) == (low, high)
    np.testing.assert_array_equal(pieces.start[1:], pieces.end[:-1])
    np.testing.assert_allclose(pieces.bezier_weights.sum(axis=2), 1, atol=1e-14)
    bezier = bezier_points(pieces, homogeneous(points, weights), np.zeros(1, np.int64))
    for piece in range(len(pieces)):
        for at in (0.0, 0.25, 0.7, 1.0):
            u = (1 - at) * pieces.start[piece] + at * pieces.end[piece]
            expected = curve_point(points, weights, degree, knots, u)
            np.testing.assert_allclose(points_at(bezier, np.array([piece]), np.array([at]))[0], expected, atol=1e-12)


def test_several_splines_at_once() -> None:
    """Each has its knots and its range; those of no length between knots have a number, but no piece."""
    a, b = [0, 0, 0, 1, 1, 2, 2, 2], [0, 1, 2, 3, 4, 5, 6]
    pieces = find_pieces(
        np.array(a + b, float), np.array([0, 8]), np.array([5, 4]), 2, np.array([(0, 2), (2.5, 4)], float)
    )
    np.testing.assert_array_equal(pieces.spline, [0, 0, 1, 1])
    np.testing.assert_array_equal(pieces.number, [0, 2, 0, 1])
    np.testing.assert_array_equal(pieces.first, [0, 2, 0, 1])
    np.testing.assert_array_equal(pieces.start, [0, 1, 2.5, 3])


def test_bernstein_derivatives_by_differences() -> None:
    at, step = np.array([0.2, 0.5, 0.9]), 1e-5
    for degree in (1, 2, 3, 5):
        np.testing.assert_allclose(bernstein(degree, at).sum(axis=1), 1)
        first = (bernstein(degree, at + step) - bernstein(degree, at - step)) / (2 * step)
        np.testing.assert_allclose(bernstein(degree, at, 1), first, atol=1e-8)
        second = (bernstein(degree, at + step, 1) - bernstein(degree, at - step, 1)) / (2 * step)
        np.testing.assert_allclose(bernstein(degree, at, 2), second, atol=1e-8)


def test_chords_stay_within_the_tolerance() -> None:
    circle = np.array(CIRCLE)
    pieces = one_spline(CIRCLE_KNOTS, 9, 2)
    bezier = bezier_points(pieces, homogeneous(circle[:, :2], circle[:, 2]), np.zeros(1, np.int64))
    for tolerance in (1e-1, 1e-2, 1e-4):
        line = polyline(bezier, count_steps(bezier, tolerance))
        np.testing.assert_allclose(np.linalg.norm(line, axis=1), 1, atol=1e-14)
        sagitta = 1 - np.linalg.norm((line[1:] + line[:-1]) / 2, axis=1)
        assert tolerance / 8 < sagitta.max() <= tolerance


# --- surfaces


def test_a_surface_is_the_sum_of_its_basis_functions() -> None:
    rng = np.random.default_rng(3)
    knots = ([0, 0, 0, 1, 2, 2, 2], [-1, 0, 0.5, 0.7, 1, 3, 4, 5.5, 6])
    points, weights = rng.normal(size=(5, 4, 3)), rng.uniform(0.5, 2, (5, 4))
    u, v = one_spline(knots[0], 4, 2), one_spline(knots[1], 5, 3)
    patch = Patch(points.reshape(-1, 3), weights.reshape(-1), u, v, 4)
    at = random_places(patch, 40)
    for row, point in enumerate(patch.points(at)):
        u_at = u.start[at.u_piece[row]] + at.u[row] * (u.end - u.start)[at.u_piece[row]]
        v_at = v.start[at.v_piece[row]] + at.v[row] * (v.end - v.start)[at.v_piece[row]]
        np.testing.assert_allclose(point, surface_point(points, weights, (2, 3), knots, u_at, v_at), atol=1e-12)
    np.testing.assert_allclose(patch.values(points.reshape(-1, 3), at), patch.points(at), atol=1e-12)
    step = 1e-4
    for name, du, dv in (("u", 1, 0), ("v", 0, 1)):
        moved = [
            patch.points(Places(at.u_piece, at.v_piece, at.u + sign * step * du, at.v + sign * step * dv))
            for sign in (1, -1)
        ]
        np.testing.assert_allclose(patch.derivatives(at)[name], (moved[0] - moved[1]) / (2 * step), atol=1e-5)


def test_surfaces_of_revolution_are_exact() -> None:
    for patch in (SPHERE, TORUS, CYLINDER):
        at = random_places(patch)
        points, normals = patch.points(at), patch.normals(at)
        axial = np.linalg.norm(points[:, :2], axis=1)
        outwards = points / [1, 1, np.inf] / axial[:, None]
        if patch is SPHERE:
            expected = points
            np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1, atol=1e-14)
        elif patch is TORUS:
            expected = points - 3 * outwards
            np.testing.assert_allclose(np.linalg.norm(expected, axis=1), 1, atol=1e-13)
        else:
            expected = outwards
            np.testing.assert_allclose(axial, 1, atol=1e-14)
        np.testing.assert_allclose(normals, expected, atol=1e-12)


def test_normals_at_poles_are_the_limits_from_inside() -> None:
    """All around the pole of a sphere there is one normal; at the tip of a cone each generator has its own."""
    piece, turn = np.repeat(np.arange(4), 5), np.tile(np.linspace(0, 1, 5), 4)
    for end, row in ((0.0, 0), (1.0, 1)):
        at = Places(piece, np.full(20, row), turn, np.full(20, end))
        np.testing.assert_allclose(SPHERE.normals(at), np.tile([0, 0, 2 * end - 1], (20, 1)), atol=1e-12)
    tip = Places(piece, np.zeros(20, int), turn, np.ones(20))
    below = Places(piece, np.zeros(20, int), turn, np.full(20, 0.5))
    np.testing.assert_allclose(CONE.normals(tip), CONE.normals(below), atol=1e-12)
    slope = np.array([2, 1]) / np.sqrt(5)  # a cone of radius 1 and height 2
    np.testing.assert_allclose(CONE.normals(tip)[:, 2], slope[1], atol=1e-12)


def test_a_corner_of_no_derivatives_has_a_normal() -> None:
    """Four control points of a bicubic patch in one place: all first and mixed derivatives vanish there."""
    x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4))
    points = np.stack([x, y, 0 * x], axis=-1)
    points[:2, :2] = 0
    pieces = one_spline([0] * 4 + [1] * 4, 4, 3)
    patch = Patch(points.reshape(-1, 3), np.ones(16), pieces, pieces, 4)
    zero = np.zeros(1, int)
    np.testing.assert_allclose(patch.normals(Places(zero, zero, np.zeros(1), np.zeros(1))), [[0, 0, 1]], atol=1e-9)


# --- triangles


@pytest.mark.parametrize("share", [1e-2, 1e-3])
def test_triangles_stay_within_the_tolerance(share: float) -> None:
    for patch in (SPHERE, TORUS, CYLINDER):
        tolerance = share * patch.size
        cut = tessellate(patch, find_lines(patch, tolerance))
        corner = cut.points[cut.triangles]
        for weights in ((1 / 3, 1 / 3, 1 / 3), (0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5)):
            point = np.einsum("c,mcx->mx", np.array(weights), corner)
            axial = np.linalg.norm(point[:, :2], axis=1)
            off = {
                id(SPHERE): np.linalg.norm(point, axis=1) - 1,
                id(TORUS): np.hypot(axial - 3, point[:, 2]) - 1,
                id(CYLINDER): axial - 1,
            }[id(patch)]
            assert np.abs(off).max() <= tolerance
    # A plane takes no more triangles than it has to.
    flat = revolved([(1, 0, 1), (2, 0, 1)], [0, 0, 1, 1])
    assert find_lines(flat, 1.0).v.tolist() == [0, 1]


def test_closed_surfaces_are_watertight_and_face_outwards() -> None:
    for patch, volume in ((SPHERE, 4 / 3 * np.pi), (TORUS, 2 * np.pi**2 * 3)):
        cut = tessellate(patch, find_lines(patch, 1e-4 * patch.size))
        assert encloses_volume(cut.points.astype(np.float32), cut.triangles)
        a, b, c = np.moveaxis(cut.points[cut.triangles], 1, 0)
        assert np.einsum("ni,ni", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=1e-3)
        normals = patch.normals(cut.places)[cut.corners]
        flat = np.cross(b - a, c - a)
        assert (np.einsum("nci,ni->nc", normals, flat) > 0).all()
    assert not encloses_volume(*_of(tessellate(CYLINDER, find_lines(CYLINDER, 1e-2))))


def _of(cut):
    return cut.points.astype(np.float32), cut.triangles
