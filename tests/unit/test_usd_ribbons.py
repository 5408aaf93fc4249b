# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Curves with normals are ribbons: how wide they are, which way they face, how their segments meet."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd

import warp_rt
from warp_rt.scene import Mesh, Scene
from warp_rt.usd.load import load_stage
from warp_rt.usd.ribbons import TOLERANCE


def load(body: str, kind: str = "BasisCurves", level: int = 0) -> Scene:
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef {kind} "c" {{ {body}\n}}')
    return load_stage(stage, level=level)


def mesh_of(scene: Scene) -> Mesh:
    (mesh,) = scene.meshes
    assert isinstance(mesh, Mesh)
    return mesh


def codes(scene: Scene) -> set[str]:
    return {record.code for record in scene.diagnostics if record.prim == "/c"}


def area(mesh: Mesh) -> float:
    a, b, c = np.moveaxis(mesh.points[mesh.triangles].astype(float), 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


STRAIGHT = """uniform token type = "linear"\nint[] curveVertexCounts = [3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (4, 0, 0)]\n"""


def test_a_straight_ribbon_is_as_wide_as_its_widths_and_faces_along_its_normals() -> None:
    scene = load(STRAIGHT + 'float[] widths = [0.5]\nnormal3f[] normals = [(0, 0, 1)] (interpolation = "constant")')
    mesh = mesh_of(scene)
    assert codes(scene) == set()
    assert area(mesh) == pytest.approx(2)
    np.testing.assert_array_equal(mesh.points[:, 2], 0)
    np.testing.assert_allclose([mesh.points[:, 1].min(), mesh.points[:, 1].max()], [-0.25, 0.25])
    a, b, c = np.moveaxis(mesh.points[mesh.triangles].astype(float), 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals.values, np.tile([0, 0, 1], (len(mesh.normals.values), 1)), atol=1e-6)
    assert not mesh.is_closed


def test_normals_are_made_perpendicular_to_the_curve() -> None:
    mesh = mesh_of(
        load(STRAIGHT + 'float[] widths = [1]\nnormal3f[] normals = [(5, 0, 1)] (interpolation = "constant")')
    )
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals.values, np.tile([0, 0, 1], (len(mesh.normals.values), 1)), atol=1e-6)
    along = load(STRAIGHT + 'float[] widths = [1]\nnormal3f[] normals = [(1, 0, 0)] (interpolation = "constant")')
    assert area(mesh_of(along)) == pytest.approx(4)


def test_a_ring_of_a_periodic_b_spline() -> None:
    """Flat in its plane: the area between the two offset curves, by quadrature of the spline itself."""
    count = 8
    angle = 2 * np.pi * np.arange(count) / count
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    body = f"""uniform token basis = "bspline"\nuniform token wrap = "periodic"\nint[] curveVertexCounts = [{count}]
        point3f[] points = {[tuple(map(float, p)) for p in ring]}\nfloat[] widths = [0.4]
        normal3f[] normals = [(0, 0, 1)] (interpolation = "constant")"""
    u = (np.arange(400) + 0.5) / 400
    weights = np.stack([(1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]) / 6
    slopes = np.gradient(weights, u, axis=1)
    length = count * np.linalg.norm(slopes.T @ ring[:4], axis=1).mean()
    for level in (0, 2):
        scene = load(body, level=level)
        mesh = mesh_of(scene)
        assert codes(scene) == set()
        assert area(mesh) == pytest.approx(0.4 * length, rel=4e-3 / 4**level)
        size = np.linalg.norm(np.ptp(weights.T @ ring[:4], axis=0)) * 4
        middle = mesh.points[mesh.triangles].astype(float).mean(axis=1)
        radius = np.linalg.norm(middle, axis=1)
        axis = np.linalg.norm(weights.T @ ring[:4], axis=1)
        assert radius.max() <= axis.max() + 0.2 + 1e-6
        assert radius.min() >= axis.min() - 0.2 - TOLERANCE * size
    edges = np.sort(
        np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]]), 1
    )
    _, place = np.unique(mesh.points, axis=0, return_inverse=True)
    unique, uses = np.unique(np.sort(place.reshape(-1)[edges], axis=1), axis=0, return_counts=True)
    single = np.unique(mesh.points, axis=0)[unique[uses == 1]].astype(float)
    along = single[:, 1] - single[:, 0]
    outwards = single.mean(axis=1)
    # What only one triangle has is an edge of the ring, not a cut across it.
    assert (np.abs(np.einsum("ni,ni->n", along, outwards)) < 0.3 * np.linalg.norm(along, axis=1)).all()


def test_corners_are_mitered() -> None:
    """Two straight legs at a right angle, one wide: the picture shows an L of the area 2 * 2 * 1."""
    body = """uniform token type = "linear"\nint[] curveVertexCounts = [3]
        point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0)]\nfloat[] widths = [1]
        normal3f[] normals = [(0, 0, 1)] (interpolation = "constant")"""
    scene = load(body)
    assert area(mesh_of(scene)) == pytest.approx(4, rel=1e-6)
    accel = warp_rt.build_accel(scene)
    inside = np.array([(2.4, -0.4), (1.0, 0.45), (1.6, 1.5), (2.45, 1.9)])
    outside = np.array([(2.6, -0.4), (1.0, 0.55), (1.4, 1.5), (2.0, 2.1), (-0.1, 0.0)])
    for points, expected in ((inside, True), (outside, False)):
        origins = np.concatenate([points, np.full((len(points), 1), 5.0)], axis=1)
        for down in (-1.0, 1.0):  # from both sides
            origins[:, 2] = -5 * down
            hits = warp_rt.any_hit(accel, origins, np.tile([0.0, 0.0, down], (len(points), 1)))
            assert (hits == expected).all()


def test_a_twisted_ribbon_turns_with_its_normals() -> None:
    """A helicoid: half a turn about the x axis in four straight segments of varying normals."""
    angle = np.linspace(0, np.pi, 5)
    normals = [(0.0, float(-np.sin(a)), float(np.cos(a))) for a in angle]
    body = f"""uniform token type = "linear"\nint[] curveVertexCounts = [5]
        point3f[] points = {[(float(x), 0.0, 0.0) for x in range(5)]}\nfloat[] widths = [1]
        normal3f[] normals = {normals} (interpolation = "varying")"""
    mesh = mesh_of(load(body, level=3))
    point = mesh.points.astype(float)
    np.testing.assert_allclose(np.linalg.norm(point[:, 1:], axis=1), 0.5, atol=1e-6)
    # Normals are interpolated linearly from point to point, and so is the tangent of their angle from the middle one.
    turn = np.arctan2(point[:, 2], point[:, 1]) % np.pi
    share = point[:, 0] % 1
    low = np.floor(point[:, 0]) * np.pi / 4
    expected = low + np.pi / 8 + np.arctan((2 * share - 1) * np.tan(np.pi / 8))
    np.testing.assert_allclose(np.sin(turn - expected), 0, atol=1e-5)


def test_a_moebius_strip_meets_itself() -> None:
    """Its normals turn by half on the way around: one edge, twice around, and no gap."""
    angle = 2 * np.pi * np.arange(13) / 12
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    ring[-1] = ring[0]
    normals = np.cos(angle / 2)[:, None] * ring + np.sin(angle / 2)[:, None] * [0, 0, 1]
    points, turned = ([tuple(map(float, row)) for row in array] for array in (ring, normals))
    body = f"""uniform token basis = "catmullRom"\nuniform token wrap = "pinned"\nint[] curveVertexCounts = [13]
        point3f[] points = {points}\nfloat[] widths = [0.4]\nnormal3f[] normals = {turned} (interpolation = "vertex")"""
    mesh = mesh_of(load(body))
    _, place = np.unique(mesh.points, axis=0, return_inverse=True)
    corners = place.reshape(-1)[mesh.triangles]
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    unique, uses = np.unique(edges, axis=0, return_counts=True)
    following: dict[int, list[int]] = {}
    for a, b in unique[uses == 1].tolist():
        following.setdefault(a, []).append(b)
        following.setdefault(b, []).append(a)
    assert {len(ends) for ends in following.values()} == {2}
    start = here = next(iter(following))
    before, length = -1, 0
    while length == 0 or here != start:
        before, here = here, next(other for other in following[here] if other != before)
        length += 1
    assert length == len(following)


def test_primvars_and_widths_along_ribbons() -> None:
    body = """uniform token basis = "bspline"\nint[] curveVertexCounts = [5, 4]
        point3f[] points = [(0,0,0), (1,0,0), (2,0,0), (3,0,0), (4,0,0), (0,9,0), (1,9,0), (2,9,0), (3,9,0)]
        float[] widths = [1, 2, 3, 4, 5, 1, 2, 3, 4] (interpolation = "vertex")
        normal3f[] normals = [(0, 0, 1), (0, 0, -1)] (interpolation = "uniform")
        float[] primvars:vertex = [0, 1, 2, 3, 4, 0, 1, 2, 3] (interpolation = "vertex")
        float[] primvars:varying = [1, 2, 3, 1, 2] (interpolation = "varying")
        float[] primvars:curve = [7, 8] (interpolation = "uniform")
        float[] primvars:all = [9]"""
    scene = load(body)
    mesh = mesh_of(scene)
    assert codes(scene) == set()
    corners = mesh.points[mesh.triangles]
    for name in ("vertex", "varying"):
        primvar = mesh.primvars[name]
        np.testing.assert_allclose(primvar.values[primvar.indices][..., 0], corners[..., 0], atol=1e-6)
    is_second = (corners[:, :, 1] > 5).all(axis=1)
    curve = mesh.primvars["curve"]
    np.testing.assert_array_equal(curve.values[curve.indices][:, 0, 0], 7 + is_second)
    np.testing.assert_array_equal(mesh.face_ids, is_second)
    assert mesh.primvars["all"].indices is None
    half = np.abs(corners[..., 1] - np.where(is_second, 9, 0)[:, None])
    np.testing.assert_allclose(half, (corners[..., 0] + 1) / 2, atol=1e-5)
    assert mesh.normals is not None
    sign = np.where(is_second, -1, 1)
    np.testing.assert_allclose(mesh.normals.values[mesh.normals.indices][:, 0, 2], sign, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "own"),
    [
        ("NurbsCurves", "int[] order = [3]\ndouble[] knots = [0, 0, 0, 1, 2, 2, 2]"),
        ("HermiteCurves", "vector3f[] tangents = [(1, 1, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0)]"),
    ],
)
def test_other_curves_are_ribbons_too(kind: str, own: str) -> None:
    body = f"""point3f[] points = [(0, 0, 0), (1, 1, 0), (3, 0, 0), (4, 0, 0)]\nint[] curveVertexCounts = [4]
        {own}
        float[] widths = [0.1]\nnormal3f[] normals = [(0, 0, 1)] (interpolation = "constant")"""
    scene = load(body, kind)
    assert codes(scene) == set()
    assert (mesh_of(scene).points[:, 2] == 0).all()


def test_normals_that_do_not_fit_leave_tubes() -> None:
    scene = load(STRAIGHT + "float[] widths = [1]\nnormal3f[] normals = [(0, 0, 1), (0, 1, 0)]")
    assert codes(scene) == {"W106"}
    assert not isinstance(scene.meshes[0], Mesh)
