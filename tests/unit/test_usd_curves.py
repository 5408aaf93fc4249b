# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Points and BasisCurves: which spheres and tubes they are, by the rules of their schemas."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd, UsdGeom

import warp_rt
from warp_rt.scene import Scene, ShapeKind

from ..curve_stages import bezier, codes, load_prim, shapes_of

LINE = "(0,0,0), (1,0,0), (2,1,0), (3,1,0), (4,0,0), (5,0,0), (6,1,0)"
P = np.array([(0, 0, 0), (1, 0, 0), (2, 1, 0), (3, 1, 0), (4, 0, 0), (5, 0, 0), (6, 1, 0)], float)


def curves(body: str, counts: str = "7", width: str = 'float[] widths = [0.5] (interpolation = "constant")') -> Scene:
    return load_prim(
        "BasisCurves", f"point3f[] points = [{LINE}]\nint[] curveVertexCounts = [{counts}]\n{width}\n{body}"
    )


def test_points_are_spheres_of_their_widths() -> None:
    scene = load_prim(
        "Points",
        f"""point3f[] points = [{LINE}]
        float[] widths = [1, 2, 3, 4, 5, 6, 7]
        color3f[] primvars:displayColor = [(0,0,0), (1,0,0), (2,0,0), (3,0,0), (4,0,0), (5,0,0), (6,0,0)] (
            interpolation = "vertex")""",
    )
    shapes = shapes_of(scene)
    assert shapes.kind == ShapeKind.SPHERE
    np.testing.assert_array_equal(shapes.points[:, 0], P)
    np.testing.assert_array_equal(shapes.radii[:, 0], np.arange(1, 8) / 2)
    color = shapes.primvars["displayColor"]
    np.testing.assert_array_equal(color.values[color.indices[:, 0], 0], np.arange(7))
    accel = warp_rt.build_accel(scene)
    hits = warp_rt.closest_hit(accel, [[6.0, 1.0, 10.0]], [[0.0, 0.0, -1.0]])
    assert hits.t[0] == pytest.approx(10 - 3.5, abs=1e-5)


def test_a_uniform_value_is_one_for_all_points() -> None:
    values = """color3f[] primvars:displayColor = [(1, 2, 3)] (interpolation = "uniform")
        float[] primvars:w = [7, 9] (interpolation = "uniform")
        int[] primvars:w:indices = [1]
        float[] widths = [3] (interpolation = "uniform")"""
    scene = load_prim("Points", f"point3f[] points = [{LINE}]\n{values}")
    assert not codes(scene)
    shapes = shapes_of(scene)
    assert (shapes.radii == 1.5).all()
    for name, expected in (("displayColor", (1, 2, 3)), ("w", (9,))):
        value = shapes.primvars[name]
        np.testing.assert_array_equal(value.values[value.indices[:, 0]], [expected] * len(P))


def test_widths_may_be_missing_or_one_for_all() -> None:
    assert shapes_of(load_prim("Points", f"point3f[] points = [{LINE}]\nfloat[] widths = [3]")).radii[4] == 1.5
    scene = load_prim("Points", f"point3f[] points = [{LINE}]")
    assert codes(scene) == {"N913"}
    (note,) = scene.diagnostics  # UsdGeomCurves has no fallback; Hydra takes 1
    assert note.message == "no widths: 1 unit thick in their own space; widths would be their diameters"
    assert (shapes_of(scene).radii == 0.5).all()


@pytest.mark.parametrize(("wrap", "segments"), [("nonperiodic", 6), ("periodic", 7), ("pinned", 6)])
def test_linear_curves(wrap: str, segments: int) -> None:
    shapes = shapes_of(curves(f'uniform token type = "linear"\nuniform token wrap = "{wrap}"'))
    assert shapes.kind == ShapeKind.LINEAR_TUBE
    expected = np.stack([P, np.roll(P, -1, axis=0)], axis=1)[:segments]
    np.testing.assert_array_equal(shapes.points, expected)
    assert (shapes.radii == 0.25).all()


def test_bezier_curves_take_every_third_point() -> None:
    shapes = shapes_of(curves(""))
    assert shapes.kind == ShapeKind.CUBIC_TUBE
    np.testing.assert_allclose(shapes.points, [P[0:4], P[3:7]])
    points = f"point3f[] points = [{LINE.rpartition(', (')[0]}]\nint[] curveVertexCounts = [6]\n"
    periodic = shapes_of(load_prim("BasisCurves", points + 'uniform token wrap = "periodic"\nfloat[] widths = [1]'))
    np.testing.assert_allclose(periodic.points, [P[[0, 1, 2, 3]], P[[3, 4, 5, 0]]])


@pytest.mark.parametrize(("wrap", "segments"), [("nonperiodic", 4), ("periodic", 7), ("pinned", 6)])
def test_b_splines_and_catmull_rom(wrap: str, segments: int) -> None:
    """At their joints: a uniform cubic B-spline is (p0 + 4 p1 + p2) / 6 there, Catmull and Rom's passes through p1."""
    first = 0 if wrap == "pinned" else 1  # point at the first joint
    joints = (first + np.arange(segments)) % 7
    for basis in ("bspline", "catmullRom"):
        shapes = shapes_of(curves(f'uniform token basis = "{basis}"\nuniform token wrap = "{wrap}"'))
        assert len(shapes.points) == segments
        before, after = P[(joints - 1) % 7], P[(joints + 1) % 7]
        if wrap == "pinned":
            before[0] = 2 * P[0] - P[1]
        expected = (before + 4 * P[joints] + after) / 6 if basis == "bspline" else P[joints]
        np.testing.assert_allclose(shapes.points[:, 0], expected, atol=1e-6)
        np.testing.assert_allclose(shapes.points[1:, 0], shapes.points[:-1, 3], atol=1e-6)
        # Smooth at the joints: the same tangent from both sides.
        before, after = shapes.points[:-1, 3] - shapes.points[:-1, 2], shapes.points[1:, 1] - shapes.points[1:, 0]
        np.testing.assert_allclose(before, after, atol=1e-6)
        if wrap == "pinned":
            np.testing.assert_allclose(shapes.points[[0, -1], [0, 3]], P[[0, 6]], atol=1e-6)


def test_a_b_spline_is_what_its_basis_says_within_a_segment() -> None:
    shapes = shapes_of(curves('uniform token basis = "bspline"'))
    for u in (0.25, 0.5, 0.8):
        w = [(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]
        np.testing.assert_allclose(bezier(shapes.points[2], u), np.tensordot(w, P[2:6], 1) / 6, atol=1e-6)


def test_widths_and_colours_by_interpolation() -> None:
    body = """
        uniform token basis = "bspline"
        float[] primvars:each = [0, 1, 2, 3, 4, 5, 6] (interpolation = "vertex")
        float[] primvars:joint = [0, 1, 2, 3, 4] (interpolation = "varying")
        float[] primvars:whole = [7] (interpolation = "uniform")
    """
    varying = 'float[] widths = [0, 2, 4, 6, 8] (interpolation = "varying")'
    shapes = shapes_of(curves(body, width=varying))
    np.testing.assert_allclose(shapes.radii, np.arange(4)[:, None] + np.linspace(0, 1, 4), atol=1e-6)
    at = {name: value.values[value.indices][..., 0] for name, value in shapes.primvars.items()}
    # Numbers that rise evenly over the points do so along a B-spline.
    np.testing.assert_allclose(at["each"], np.arange(1, 5)[:, None] + np.linspace(0, 1, 4), atol=1e-6)
    np.testing.assert_array_equal(at["joint"], [[0, 1], [1, 2], [2, 3], [3, 4]])
    np.testing.assert_array_equal(at["whole"], [[7]] * 4)
    vertex = 'float[] widths = [0, 2, 4, 6, 8, 10, 12] (interpolation = "vertex")'
    np.testing.assert_allclose(shapes_of(curves(body, width=vertex)).radii, at["each"], atol=1e-6)


def test_several_curves_keep_apart() -> None:
    shapes = shapes_of(curves('uniform token type = "linear"', "3, 4"))
    np.testing.assert_array_equal(shapes.face_ids, [0, 0, 1, 1, 1])
    np.testing.assert_array_equal(shapes.points[2, 0], P[3])


def test_what_does_not_fit_is_told() -> None:
    assert codes(curves("", "3, 4")) == {"W117"}
    assert len(shapes_of(curves("", "3, 4")).points) == 1
    assert codes(curves("", "6")) == {"W117"}
    assert codes(load_prim("BasisCurves", "")) == {"N910"}
    lost = load_prim("Points", "point3f[] points = [(0,0,0), (nan,0,0)]\nfloat[] widths = [1]")
    assert codes(lost) == {"W117"}
    assert len(shapes_of(lost).points) == 1
    negative = load_prim("Points", "point3f[] points = [(0,0,0), (5,0,0)]\nfloat[] widths = [1, -1]")
    assert codes(negative) == {"W117"}
    assert len(shapes_of(negative).points) == 1
    wide = load_prim("Points", "point3f[] points = [(0,0,0), (5,0,0)]\nfloat[] widths = [1, 1e30]")
    assert codes(wide) == {"W117"}
    assert len(shapes_of(wide).points) == 1
    for normals in ("double normals = 1", "asset normals = @x@", "bool normals = true"):
        assert codes(curves(normals)) == {"W108"}


@pytest.mark.parametrize(
    ("kind", "counts", "varying"),
    [
        ("linear", [0, 7], 7),
        ("linear", [1, 6], 7),
        ("bezier", [5, 4], 4),
        ("bspline", [2, 5], 3),
        ("catmullRom", [3, 4], 3),
    ],
)
def test_values_keep_their_curves_beside_those_that_are_left_out(kind: str, counts: list[int], varying: int) -> None:
    """Varying values are as many as UsdGeomBasisCurves computes."""
    body = 'uniform token type = "linear"' if kind == "linear" else f'uniform token basis = "{kind}"'
    places = ", ".join(f"({index}, {index % 2}, 0)" for index in range(sum(counts)))
    text = f"""{body}\nint[] curveVertexCounts = {counts}\npoint3f[] points = [{places}]
        float[] widths = {list(range(1, varying + 1))} (interpolation = "varying")"""
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef BasisCurves "c" {{ {text}\n}}')
    schema = UsdGeom.BasisCurves.Get(stage, "/c")
    assert schema.ComputeVaryingDataSize(Usd.TimeCode.Default()) == varying
    shapes = shapes_of(load_prim("BasisCurves", text))
    assert 2 * shapes.radii[-1, -1] == varying
    assert 2 * shapes.radii[0, 0] == varying - len(shapes.radii)


@pytest.mark.parametrize("wrap", ["nonperiodic", "periodic"])
def test_curves_at_one_place_are_told_beside_others(wrap: str) -> None:
    places = "(0,0,0), (1,0,0), (1,1,0), (5,5,5), (5,5,5), (5,5,5)"
    scene = load_prim(
        "BasisCurves",
        f"""uniform token type = "linear"
        uniform token wrap = "{wrap}"
        point3f[] points = [{places}]
        int[] curveVertexCounts = [3, 3]
        float[] widths = [0.5]""",
    )
    assert set(shapes_of(scene).face_ids) == {0}
    (told,) = [record for record in scene.diagnostics if record.prim == "/c"]
    assert (told.code, told.message) == ("W117", "1 curve left out: all points at one place")


def test_splines_that_run_below_0_between_widths_are_no_fault() -> None:
    """Catmull-Rom through 1, 0.01, 0.01, 1 undershoots; there is no width to speak of, and none is authored below 0."""
    scene = load_prim(
        "BasisCurves",
        """uniform token basis = "catmullRom"
        point3f[] points = [(0,0,0), (1,0,0), (2,0,0), (3,0,0)]
        int[] curveVertexCounts = [4]
        float[] widths = [1, 0.01, 0.01, 1] (interpolation = "vertex")""",
    )
    assert codes(scene) == set()
    assert shapes_of(scene).radii.min() == 0


def test_a_tube_covers_its_projection() -> None:
    """A straight curve across the view, 0.5 wide: the picture shows a stadium of that area."""
    body = 'point3f[] points = [(-1,0,0), (1,0,0)]\nint[] curveVertexCounts = [2]\nuniform token type = "linear"\n'
    scene = load_prim("BasisCurves", body + 'float[] widths = [0.5] (interpolation = "constant")')
    accel = warp_rt.build_accel(scene)
    x, y = np.meshgrid(np.linspace(-2, 2, 801), np.linspace(-1, 1, 401))
    origins = np.stack([x, y, np.full_like(x, 5)], axis=-1).reshape(-1, 3)
    blocked = warp_rt.any_hit(accel, origins, np.broadcast_to([0.0, 0.0, -1.0], origins.shape))
    area = blocked.mean() * 8
    assert area == pytest.approx(2 * 0.5 + np.pi * 0.25**2, rel=5e-3)
