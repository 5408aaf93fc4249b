# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""NurbsCurves against the recursion of Cox and de Boor."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import warp_rt
from tests.bspline_float64 import curve_point
from warp_rt.scene import Scene, ShapeKind
from warp_rt.usd.nurbs_curves import FIT_TOLERANCE

from ..curve_stages import bezier, codes, load_prim, shapes_of

POINTS = [(0.0, 0.0, 0.0), (1.0, 2.0, 0.0), (2.0, -1.0, 1.0), (3.0, 0.5, 0.0), (4.0, 1.0, 2.0), (6.0, 0.0, 0.0)]
WIDTHS = 'float[] widths = [0.5] (interpolation = "constant")\n'


def load(body: str, points: list[tuple[float, ...]] = POINTS) -> Scene:
    return load_prim("NurbsCurves", f"point3f[] points = {points}\n{body}")


def one(order: int, knots: list[float], body: str = "", width: str = WIDTHS) -> Scene:
    return load(f"int[] curveVertexCounts = [6]\nint[] order = [{order}]\ndouble[] knots = {knots}\n{width}{body}")


@pytest.mark.parametrize(
    ("order", "knots"),
    [
        (2, [0, 0, 1, 1.5, 2, 4, 4, 4]),
        (3, [0, 0, 0, 1, 3, 3.5, 4, 4, 4]),
        (3, [0, 0, 0, 1, 1, 3, 4, 4, 4]),
        (4, [0, 0, 0, 0, 1, 3, 4, 4, 4, 4]),
        (4, [-3, -2, -1, 0, 1, 2.5, 4, 5, 6, 7]),
    ],
)
def test_polynomials_up_to_cubics_are_exact(order: int, knots: list[float]) -> None:
    scene = one(order, knots)
    shapes = shapes_of(scene)
    assert codes(scene) == set()
    assert shapes.kind == (ShapeKind.LINEAR_TUBE if order == 2 else ShapeKind.CUBIC_TUBE)
    domain = [knot for knot in np.unique(knots) if knots[order - 1] <= knot <= knots[6]]
    assert len(shapes.points) == len(domain) - 1
    for row, (start, end) in enumerate(pairwise(domain)):
        for share in (0.0, 0.3, 0.5, 1.0):
            controls = shapes.points[row].astype(float)
            found = (1 - share) * controls[0] + share * controls[1] if order == 2 else bezier(controls, share)
            expected = curve_point(np.array(POINTS), np.ones(6), order - 1, knots, start + share * (end - start))
            np.testing.assert_allclose(found, expected, atol=2e-6)


def test_rational_curves_are_fitted_to_the_tolerance() -> None:
    """A circle of four rational arcs, exact in its points: no point of the tube's axis is off by more."""
    w = float(np.sqrt(0.5))
    ring = [(1, 0, 1), (1, 1, w), (0, 1, 1), (-1, 1, w), (-1, 0, 1), (-1, -1, w), (0, -1, 1), (1, -1, w), (1, 0, 1)]
    body = f"""int[] curveVertexCounts = [9]\nint[] order = [3]\n{WIDTHS}
        double[] knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]\ndouble[] pointWeights = {[p[2] for p in ring]}"""
    scene = load(body, [(float(x), float(y), 0.0) for x, y, _ in ring])
    assert codes(scene) == set()
    shapes = shapes_of(scene)
    assert 4 <= len(shapes.points) <= 64
    for u in np.linspace(0, 1, 9):
        radii = [np.linalg.norm(bezier(controls.astype(float), u)) for controls in shapes.points]
        np.testing.assert_allclose(radii, 1, atol=FIT_TOLERANCE * np.sqrt(2) + 1e-7)
    np.testing.assert_allclose(shapes.points[1:, 0], shapes.points[:-1, 3], atol=1e-7)
    accel = warp_rt.build_accel(scene)
    angle = np.linspace(0, 2 * np.pi, 200)
    origins = np.stack([np.cos(angle), np.sin(angle), np.full(200, 5.0)], axis=1)
    hits = warp_rt.closest_hit(accel, origins, np.tile([0.0, 0.0, -1.0], (200, 1)))
    np.testing.assert_allclose(hits.t, 4.75, atol=1e-5)


def test_curves_of_higher_degree_are_fitted() -> None:
    knots = [0] * 6 + [1] * 6
    shapes = shapes_of(one(6, knots))
    count = len(shapes.points)
    assert count > 1
    size = np.linalg.norm(np.ptp(POINTS, axis=0))
    line = np.array([curve_point(np.array(POINTS), np.ones(6), 5, knots, u) for u in np.linspace(0, 1, 4001)])
    along = np.diff(line, axis=0)
    for controls in shapes.points[:: max(1, count // 8)].astype(float):
        for u in (0.0, 0.2, 0.5, 0.8):
            to = bezier(controls, u) - line[:-1]
            share = np.clip(np.einsum("ni,ni->n", to, along) / np.square(along).sum(axis=1), 0, 1)
            off = np.linalg.norm(to - share[:, None] * along, axis=1).min()
            assert off <= FIT_TOLERANCE * size + 2e-6  # chords of the line, and float32


def test_ranges_cut_curves() -> None:
    knots = [0, 0, 0, 0, 1, 3, 4, 4, 4, 4]
    shapes = shapes_of(one(4, knots, "double2[] ranges = [(0.5, 2)]"))
    assert len(shapes.points) == 2
    for row, place, u in ((0, 0, 0.5), (0, 3, 1.0), (1, 3, 2.0)):
        expected = curve_point(np.array(POINTS), np.ones(6), 3, knots, u)
        np.testing.assert_allclose(shapes.points[row, place], expected, atol=1e-6)
    wide = one(4, knots, "double2[] ranges = [(-1, 4)]")
    assert codes(wide) == {"W117"}
    np.testing.assert_array_equal(shapes_of(wide).points, shapes_of(one(4, knots)).points)


def test_widths_and_primvars_follow_the_curve() -> None:
    """Vertex values are blended as the points are; varying ones belong to the knots, whole intervals apart."""
    x = [point[0] for point in POINTS]
    body = f"""float[] primvars:x = {x} (interpolation = "vertex")
        float[] primvars:knot = [0, 1, 3, 4] (interpolation = "varying")
        float[] primvars:own = [7] (interpolation = "uniform")
        double2[] ranges = [(0.5, 4)]"""
    widths = f'float[] widths = {[value / 10 for value in x]} (interpolation = "vertex")\n'
    scene = one(4, [0, 0, 0, 0, 1, 3, 4, 4, 4, 4], body, widths)
    shapes = shapes_of(scene)
    assert codes(scene) == set()
    at = {name: value.values[value.indices][..., 0] for name, value in shapes.primvars.items()}
    np.testing.assert_allclose(at["x"], shapes.points[..., 0], atol=1e-6)
    np.testing.assert_allclose(shapes.radii, shapes.points[..., 0] / 20, atol=1e-6)
    np.testing.assert_allclose(at["knot"], [(0.5, 1), (1, 3), (3, 4)], atol=1e-6)
    np.testing.assert_array_equal(at["own"], [[7]] * 3)


def test_curves_of_several_degrees_keep_their_order() -> None:
    points = POINTS[:3] + POINTS[:4] + POINTS[:2]
    body = f"""int[] curveVertexCounts = [3, 4, 2]\nint[] order = [3, 4, 2]\n{WIDTHS}
        double[] knots = [0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 1, 1]
        float[] primvars:i = [5, 6, 7] (interpolation = "uniform")"""
    scene = load(body, points)
    shapes = shapes_of(scene)
    assert codes(scene) == set()
    np.testing.assert_array_equal(shapes.face_ids, [0, 1, 2])
    np.testing.assert_allclose(shapes.points[1], POINTS[:4])
    np.testing.assert_allclose(shapes.points[2], np.linspace(POINTS[0], POINTS[1], 4), atol=1e-6)
    np.testing.assert_allclose(bezier(shapes.points[0].astype(float), 0.5), np.array([1, 0.75, 0.25]), atol=1e-6)
    primvar = shapes.primvars["i"]
    np.testing.assert_array_equal(primvar.values[primvar.indices][:, 0, 0], [5, 6, 7])


def test_what_does_not_fit_is_told() -> None:
    lines = load("int[] curveVertexCounts = [6]\ndouble[] knots = [0, 0, 1, 1]\n" + WIDTHS)
    assert codes(lines) == {"W117"}
    assert shapes_of(lines).kind == ShapeKind.LINEAR_TUBE
    np.testing.assert_array_equal(shapes_of(lines).points[:, 0], POINTS[:-1])
    good = [0, 0, 0, 0, 1, 3, 4, 4, 4, 4]
    falling = one(4, [0, 0, 0, 0, 3, 1, 4, 4, 4, 4])
    assert codes(falling) == {"W117"}
    assert falling.meshes == ()
    assert codes(one(4, good, "double[] pointWeights = [1, 2, 3]")) == {"W117"}
    assert codes(one(4, good, "double2[] ranges = [(0, 1), (0, 1)]")) == {"W117"}
    assert codes(one(0, [0] * 6)) == {"W117"}


@pytest.mark.parametrize("order", [32, 33])
def test_orders_above_the_bound_are_left_out_and_told(order: int) -> None:
    """A single Bezier piece begins and ends at its end points."""
    points = [(float(k), float(k % 2), 0.0) for k in range(order)]
    knots = [0] * order + [1] * order
    scene = load(
        f"int[] curveVertexCounts = [{order}]\nint[] order = [{order}]\ndouble[] knots = {knots}\n{WIDTHS}", points
    )
    if order > 32:
        assert [record.message for record in scene.diagnostics if record.code == "W117"] == [
            "1 curve left out: an order above 32"
        ]
        assert scene.meshes == ()
    else:
        assert codes(scene) == set()
        ends = shapes_of(scene).points[[0, -1], [0, 3]]
        np.testing.assert_allclose(ends, [points[0], points[-1]], atol=1e-5)
