# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""NurbsPatch: which surface its attributes mean, what its primvars belong to, what trim curves leave of it."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd

import warp_rt
from tests.bspline_float64 import surface_point
from warp_rt.scene import Mesh, Scene
from warp_rt.usd.load import load_stage
from warp_rt.usd.nurbs_patch import TOLERANCE

# Four by three control points over the square [0, 3] x [0, 2]: degree 2 along u in two segments, 1 along v in two.
FLAT = "point3f[] points = [" + ", ".join(f"({x}, {y}, 0)" for y in range(3) for x in range(4)) + "]"
U = "int uVertexCount = 4\nint uOrder = 3\ndouble[] uKnots = [0, 0, 0, 1, 4, 4, 4]\n"
V = "int vVertexCount = 3\nint vOrder = 2\ndouble[] vKnots = [0, 0, 1, 2, 2]\n"

W = float(np.sqrt(0.5))
CIRCLE = [(1, 0, 1), (1, 1, W), (0, 1, 1), (-1, 1, W), (-1, 0, 1), (-1, -1, W), (0, -1, 1), (1, -1, W), (1, 0, 1)]
ARC = [(0, -1, 1), (1, -1, W), (1, 0, 1), (1, 1, W), (0, 1, 1)]


def sphere_body(radius: float = 2.0) -> str:
    points = [(radius * r * x, radius * r * y, radius * z) for r, z, _ in ARC for x, y, _ in CIRCLE]
    weights = [w * turn for _, _, w in ARC for _, _, turn in CIRCLE]
    return f"""point3f[] points = {points}
        double[] pointWeights = {weights}
        int uVertexCount = 9\nint uOrder = 3\ndouble[] uKnots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
        int vVertexCount = 5\nint vOrder = 3\ndouble[] vKnots = [0, 0, 0, 1, 1, 2, 2, 2]
        uniform token uForm = "closed"\n"""


def load(body: str, level: int = 0) -> Scene:
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef NurbsPatch "p" {{\n{body}\n}}')
    return load_stage(stage, level=level)


def mesh_of(scene: Scene) -> Mesh:
    (mesh,) = scene.meshes
    return mesh


def codes(scene: Scene) -> list[str]:
    return [record.code for record in scene.diagnostics if record.prim.startswith("/p")]


def at_corners(mesh: Mesh, name: str) -> np.ndarray:
    primvar = mesh.primvars[name]
    assert primvar.indices is not None
    return primvar.values[primvar.indices]


def area(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.points[mesh.triangles].astype(float), 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_u_runs_fastest_and_normals_point_along_u_cross_v() -> None:
    mesh = mesh_of(load(FLAT + "\n" + U + V))
    assert area(mesh) == pytest.approx(6)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals.values, np.tile([0, 0, 1], (len(mesh.normals.values), 1)), atol=1e-6)
    a, b, c = np.moveaxis(mesh.points[mesh.triangles].astype(float), 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    turned = mesh_of(load(f'{FLAT}\n{U}{V}uniform token orientation = "leftHanded"'))
    a, b, c = np.moveaxis(turned.points[turned.triangles].astype(float), 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] < 0).all()
    assert turned.normals is not None
    assert (turned.normals.values[:, 2] < 0).all()


def test_texture_coordinates_are_the_parameters() -> None:
    """By de Boor's recursion: the point at each corner is the surface's at its st."""
    mesh = mesh_of(load(FLAT + "\n" + U + V + "double2 uRange = (0.5, 3.5)"))
    grid = np.stack([*np.meshgrid(np.arange(4.0), np.arange(3.0)), np.zeros((3, 4))], axis=-1)
    knots = ([0, 0, 0, 1, 4, 4, 4], [0, 0, 1, 2, 2])
    st = at_corners(mesh, "st").reshape(-1, 2)
    assert st.min() == 0
    assert st.max() == 1
    for (s, t), point in list(zip(st, mesh.points[mesh.triangles].reshape(-1, 3), strict=True))[::5]:
        expected = surface_point(grid, np.ones((3, 4)), (2, 1), knots, 0.5 + 3 * s, 2 * t)
        np.testing.assert_allclose(point, expected, atol=1e-5)
    own = load(FLAT + "\n" + U + V + 'texCoord2f[] primvars:st = [(7, 8)] (interpolation = "constant")')
    np.testing.assert_array_equal(mesh_of(own).primvars["st"].values, [[7, 8]])


def test_a_rational_sphere() -> None:
    scene = load(sphere_body())
    mesh = mesh_of(scene)
    assert codes(scene) == []
    np.testing.assert_allclose(np.linalg.norm(mesh.points.astype(float), axis=1), 2, atol=1e-6)
    assert mesh.is_closed
    assert mesh.normals is not None
    corners = mesh.points[mesh.triangles].reshape(-1, 3)
    np.testing.assert_allclose(mesh.normals.values[mesh.normals.indices].reshape(-1, 3), corners / 2, atol=1e-6)
    accel = warp_rt.build_accel(scene)
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(1000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    t = warp_rt.closest_hit(accel, 0 * directions, directions).t
    size = 4 * np.sqrt(3)
    assert (t <= 2 + 1e-5).all()
    assert t.min() >= 2 - TOLERANCE * size


def test_levels_divide_the_distance_by_four() -> None:
    gaps = []
    for level in range(3):
        mesh = mesh_of(load(sphere_body(), level))
        middles = mesh.points[mesh.triangles].astype(float).mean(axis=1)
        gaps.append(2 - np.linalg.norm(middles, axis=1).min())
        assert gaps[-1] <= TOLERANCE * 4 * np.sqrt(3) / 4**level
    np.testing.assert_allclose(np.divide(gaps[:-1], gaps[1:]), 4, rtol=0.15)


def test_primvars_of_every_interpolation() -> None:
    """Two segments along u, between the knots 0, 1 and 4, and two along v."""
    x, y = (", ".join(map(str, values)) for values in ([0, 1, 2, 3] * 3, [i // 4 for i in range(12)]))
    scene = load(
        f"""{FLAT}\n{U}{V}
        float[] primvars:x = [{x}] (interpolation = "vertex")
        float[] primvars:y = [{y}] (interpolation = "vertex")
        float[] primvars:u = [0, 1, 4, 0, 1, 4, 0, 1, 4] (interpolation = "varying")
        float[] primvars:v = [0, 0, 0, 1, 1, 1, 2, 2, 2] (interpolation = "faceVarying")
        float[] primvars:segment = [0, 1, 2, 3] (interpolation = "uniform")
        float[] primvars:indexed = [8, 9] (interpolation = "uniform")
        int[] primvars:indexed:indices = [0, 1, 1, 0]
        color3f[] primvars:displayColor = [(1, 0, 0)]
        """
    )
    mesh = mesh_of(scene)
    assert codes(scene) == []
    corners = mesh.points[mesh.triangles]
    np.testing.assert_allclose(at_corners(mesh, "x")[..., 0], corners[..., 0], atol=1e-6)
    np.testing.assert_allclose(at_corners(mesh, "y")[..., 0], corners[..., 1], atol=1e-6)
    np.testing.assert_allclose(at_corners(mesh, "u")[..., 0], 4 * at_corners(mesh, "st")[..., 0], atol=1e-6)
    np.testing.assert_allclose(at_corners(mesh, "v")[..., 0], 2 * at_corners(mesh, "st")[..., 1], atol=1e-6)
    middle = at_corners(mesh, "st").mean(axis=1) * [4, 2]
    expected = (middle[:, 0] > 1) + 2 * (middle[:, 1] > 1)
    np.testing.assert_array_equal(at_corners(mesh, "segment")[:, 0, 0], expected)
    np.testing.assert_array_equal(at_corners(mesh, "indexed")[:, 0, 0], np.array([8, 9, 9, 8])[expected])
    np.testing.assert_array_equal(mesh.face_ids, expected)


def test_authored_normals_count() -> None:
    normals = "normal3f[] normals = [" + ", ".join(["(0, 1, 0)"] * 12) + "]"
    mesh = mesh_of(load(f"{FLAT}\n{U}{V}{normals}"))
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals.values, np.tile([0, 1, 0], (len(mesh.normals.values), 1)), atol=1e-6)


def test_creases_of_the_surface_have_two_normals() -> None:
    """A roof of degree 1: each side has the normal of its own plane."""
    body = """point3f[] points = [(0, 0, 0), (1, 0, 1), (2, 0, 0), (0, 3, 0), (1, 3, 1), (2, 3, 0)]
        int uVertexCount = 3\nint uOrder = 2\ndouble[] uKnots = [0, 0, 1, 2, 2]
        int vVertexCount = 2\nint vOrder = 2\ndouble[] vKnots = [0, 0, 1, 1]"""
    mesh = mesh_of(load(body))
    assert len(mesh.triangles) == 4
    assert len(mesh.points) == 6
    assert mesh.normals is not None
    corner_normals = mesh.normals.values[mesh.normals.indices]
    left = mesh.points[mesh.triangles].mean(axis=1)[:, 0] < 1
    for side, sign in ((left, -1), (~left, 1)):
        expected = np.broadcast_to(np.array([sign, 0, 1]) / np.sqrt(2), (2, 3, 3))
        np.testing.assert_allclose(corner_normals[side], expected, atol=1e-6)


def test_a_periodic_patch_closes_without_a_gap() -> None:
    """A tube whose last three control points are the first again, at uniform knots, as Maya writes it."""
    ring = [(np.cos(a), np.sin(a)) for a in 2 * np.pi * np.arange(6) / 6]
    ring += ring[:3]
    points = [(x, y, z) for z in (0.0, 2.0) for x, y in ring]
    body = f"""point3f[] points = {[tuple(map(float, p)) for p in points]}
        int uVertexCount = 9\nint uOrder = 4\ndouble[] uKnots = {[float(k) for k in range(-3, 10)]}
        double2 uRange = (0, 6)
        uniform token uForm = "periodic"
        int vVertexCount = 2\nint vOrder = 2\ndouble[] vKnots = [0, 0, 1, 1]"""
    scene = load(body)
    mesh = mesh_of(scene)
    assert codes(scene) == []
    edges = np.sort(
        np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]]), 1
    )
    _, place = np.unique(mesh.points, axis=0, return_inverse=True)
    unique, count = np.unique(np.sort(place.reshape(-1)[edges], axis=1), axis=0, return_counts=True)
    ends = np.unique(mesh.points, axis=0)[unique[count == 1]][..., 2]
    assert ((ends == 0).all(axis=1) | (ends == 2).all(axis=1)).all()  # open at the two ends only
    assert at_corners(mesh, "st")[..., 0].max() == 1


# --- trim curves


def circle_trim(u: float, v: float, radius: float, turn: int) -> str:
    points = [(w * (u + radius * x), w * (v + turn * radius * y), w) for x, y, w in CIRCLE]
    return f"""int[] trimCurve:counts = [1]\nint[] trimCurve:orders = [3]\nint[] trimCurve:vertexCounts = [9]
        double[] trimCurve:knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]\ndouble2[] trimCurve:ranges = [(0, 4)]
        double3[] trimCurve:points = {points}"""


SQUARE = """point3f[] points = [(0, 0, 0), (4, 0, 0), (0, 4, 0), (4, 4, 0)]
    int uVertexCount = 2\nint uOrder = 2\ndouble[] uKnots = [0, 0, 4, 4]
    int vVertexCount = 2\nint vOrder = 2\ndouble[] vKnots = [0, 0, 4, 4]\n"""


@pytest.mark.parametrize(("turn", "expected"), [(1, np.pi), (-1, 16 - np.pi)])
def test_trim_curves_keep_what_is_on_their_left(turn: int, expected: float) -> None:
    scene = load(SQUARE + circle_trim(2, 2, 1, turn), level=2)
    assert codes(scene) == []
    assert area(mesh_of(scene)) == pytest.approx(expected, rel=1e-3)
    accel = warp_rt.build_accel(scene)
    radii = np.array([0.5, 0.99, 1.01, 1.5])
    origins = np.stack([2 + radii, np.full(4, 2.0), np.full(4, 5.0)], axis=1)
    hits = warp_rt.any_hit(accel, origins, np.tile([0.0, 0.0, -1.0], (4, 1)))
    np.testing.assert_array_equal(hits, (radii < 1) == (turn == 1))


def test_a_loop_of_several_curves() -> None:
    """The left half of the square, its border of one broken line and one straight."""
    body = (
        SQUARE
        + """int[] trimCurve:counts = [2]\nint[] trimCurve:orders = [2, 2]\nint[] trimCurve:vertexCounts = [4, 2]
        double[] trimCurve:knots = [0, 0, 1, 2, 3, 3, 0, 0, 1, 1]\ndouble2[] trimCurve:ranges = [(0, 3), (0, 1)]
        double3[] trimCurve:points = [(0, 4, 1), (0, 0, 1), (2, 0, 1), (2, 4, 1), (2, 4, 1), (0, 4, 1)]"""
    )
    scene = load(body)
    assert codes(scene) == []
    assert area(mesh_of(scene)) == pytest.approx(8)
    gap = load(body.replace("(2, 4, 1), (0, 4, 1)]", "(2, 3, 1), (0, 4, 1)]"))
    assert codes(gap) == ["W142"]


def test_a_trimmed_sphere_is_joined_along_its_seam() -> None:
    """A cap is cut from a sphere along a parallel: all its edges but those of the cut are shared, by position."""
    body = (
        sphere_body()
        + """int[] trimCurve:counts = [1]\nint[] trimCurve:orders = [2]
        int[] trimCurve:vertexCounts = [5]\ndouble[] trimCurve:knots = [0, 0, 1, 2, 3, 4, 4]
        double2[] trimCurve:ranges = [(0, 4)]
        double3[] trimCurve:points = [(0, 0, 1), (4, 0, 1), (4, 1.3, 1), (0, 1.3, 1), (0, 0, 1)]"""
    )
    scene = load(body)
    assert codes(scene) == []
    mesh = mesh_of(scene)
    _, place = np.unique(mesh.points, axis=0, return_inverse=True)
    corners = place.reshape(-1)[mesh.triangles]
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    assert count.max() == 2
    height = np.unique(mesh.points, axis=0)[unique[count == 1]][..., 2]
    assert np.ptp(height) < 1e-6


def test_trim_curves_that_do_not_fit_are_told() -> None:
    good = SQUARE + circle_trim(2, 2, 1, 1)
    for change in (("orders = [3]", "orders = [4]"), ("counts = [1]", "counts = [2]"), ("1, 1, 2, 2", "1, 3, 2, 2")):
        scene = load(good.replace(*change))
        assert codes(scene) == ["W142"]
        assert area(mesh_of(scene)) == pytest.approx(16)
    crossing = """int[] trimCurve:counts = [1]\nint[] trimCurve:orders = [2]\nint[] trimCurve:vertexCounts = [5]
        double[] trimCurve:knots = [0, 0, 1, 2, 3, 4, 4]\ndouble2[] trimCurve:ranges = [(0, 4)]
        double3[] trimCurve:points = [(0, 0, 1), (1, 1, 1), (1, 0, 1), (0, 2, 1), (0, 0, 1)]"""
    assert codes(load(SQUARE + crossing)) == ["W142"]


# --- what does not fit


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (("uVertexCount = 4", "uVertexCount = 5"), "W141"),
        (("uOrder = 3", "uOrder = 1"), "W141"),
        (("uOrder = 3", "uOrder = 9"), "W141"),
        (("vKnots = [0, 0, 1, 2, 2]", "vKnots = [0, 0, 2, 1, 2]"), "W141"),
        (("vKnots = [0, 0, 1, 2, 2]", "vKnots = [0, 0, nan, 2, 2]"), "W141"),
        (("double[] vKnots", "token[] vKnots"), "W141"),
        (("(1, 0, 0)", "(1, inf, 0)"), "W103"),
        ((FLAT, FLAT.replace("(1, 0, 0), ", "")), "W141"),
        ((FLAT, ""), "N910"),
    ],
)
def test_a_patch_that_makes_no_surface_is_left_out(change: tuple[str, str], code: str) -> None:
    body = (FLAT + "\n" + U + V).replace(*change)
    if "token" in body:
        body = body.replace("[0, 0, 1, 2, 2]", '["a"]')
    scene = load(body)
    assert codes(scene) == [code]
    assert scene.meshes == ()


def test_what_can_be_repaired_is_repaired() -> None:
    wide = load(f"{FLAT}\n{U}{V}double2 uRange = (-1, 4)")
    assert codes(wide) == ["W141"]
    assert area(mesh_of(wide)) == pytest.approx(6)
    weights = load(f"{FLAT}\n{U}{V}double[] pointWeights = [1, 2]")
    assert codes(weights) == ["W141"]
    assert area(mesh_of(weights)) == pytest.approx(6)
    apart = load(f"{FLAT}\n{U}{V}double[] pointWeights = [1e-300{', 1' * (FLAT.count('(') - 1)}]")
    assert codes(apart) == ["W141"]
    assert area(mesh_of(apart)) == pytest.approx(6)
    form = load(f'{FLAT}\n{U}{V}uniform token uForm = "round"')
    assert codes(form) == ["W114"]


@pytest.mark.parametrize("order", [32, 33])
def test_orders_above_the_bound_are_told(order: int) -> None:
    points = [(x, y, 0) for y in range(2) for x in range(order)]
    knots = [0] * order + [1] * order
    patch = load(
        f"point3f[] points = {points}\nint uVertexCount = {order}\nint uOrder = {order}\ndouble[] uKnots = {knots}\n"
        "int vVertexCount = 2\nint vOrder = 2\ndouble[] vKnots = [0, 0, 1, 1]"
    )
    assert codes(patch) == (["W141"] if order > 32 else [])
    assert (patch.meshes == ()) == (order > 32)
    loop = [(2 + float(np.cos(t)), 2 + float(np.sin(t)), 1.0) for t in np.linspace(0, 2 * np.pi, order)]
    trim = load(
        f"{SQUARE}int[] trimCurve:counts = [1]\nint[] trimCurve:orders = [{order}]\n"
        f"int[] trimCurve:vertexCounts = [{order}]\ndouble[] trimCurve:knots = {knots}\n"
        f"double2[] trimCurve:ranges = [(0, 1)]\ndouble3[] trimCurve:points = {loop}"
    )
    assert codes(trim) == (["W142"] if order > 32 else [])
    assert (area(mesh_of(trim)) > 15.9) == (order > 32)


@pytest.mark.parametrize("weight", [1e-3, 1e-6])
def test_weights_far_apart_are_cut_where_the_surface_bends(weight: float) -> None:
    """A corner of little weight, which all but a millionth of the domain hardly knows; float64 points of the surface.

    Equal steps in the parameters would be a million along each axis.
    """
    weights = np.array([weight] + [1.0] * 11)
    net = np.array([(x, y, (x * 5 + y * 3) % 4 / 4) for y in range(3) for x in range(4)], float)
    points = [tuple(point) for point in net.tolist()]
    scene = load(f"point3f[] points = {points}\ndouble[] pointWeights = {weights.tolist()}\n{U}{V}")
    assert len(mesh_of(scene).triangles) < 500_000
    assert codes(scene) == []
    knots = [0, 0, 0, 1, 4, 4, 4], [0, 0, 1, 2, 2]
    shares = np.concatenate([np.geomspace(1e-10, 0.2, 8), np.linspace(0.21, 0.99, 7)])
    surface = np.array(
        [
            surface_point(net.reshape(3, 4, 3), weights.reshape(3, 4), (2, 1), knots, 4 * u, 2 * v)
            for u in shares
            for v in shares
        ]
    )
    down = np.tile(np.array([0.0, 0.0, -1.0], np.float32), (len(surface), 1))
    hits = warp_rt.closest_hit(warp_rt.build_accel(scene), (surface * (1, 1, 0) + (0, 0, 5)).astype(np.float32), down)
    # Heights differ by no more than twice the distance, for the slopes are below 1 along x and along y.
    tolerance = 2 * TOLERANCE * float(np.linalg.norm(np.ptp(net, axis=0)))
    np.testing.assert_allclose(5 - np.asarray(hits.t), surface[:, 2], atol=tolerance)


def test_a_bend_aslant_of_both_axes_is_cut_coarsely_and_told() -> None:
    """No stage is refused for it: at a weight of a million the surface bends along a hyperbola of its domain."""
    weights = [1e6] + [1.0] * 11
    scene = load(f"{FLAT}\ndouble[] pointWeights = {weights}\n{U}{V}")
    assert codes(scene) == ["W141"]
    mesh = mesh_of(scene)
    assert len(mesh.triangles) < 2_500_000
    np.testing.assert_allclose(area(mesh), 3 * 2, rtol=1e-5)  # which the hull of the flat net bounds
