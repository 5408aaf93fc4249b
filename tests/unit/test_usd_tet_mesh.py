# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""TetMesh: its surface, which side of it is out, and what its primvars and subsets belong to."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, Vt

import warp_rt
from warp_rt.scene import Mesh, Scene

# Two tetrahedra of positive volume on either side of the triangle (0, 1, 2).
POINTS = "point3f[] points = [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (0, 0, -2)]"
TETS = "int4[] tetVertexIndices = [(0, 1, 2, 3), (0, 2, 1, 4)]"
FACES = "int3[] surfaceFaceVertexIndices = [(0, 1, 3), (0, 2, 4), (0, 3, 2), (0, 4, 1), (1, 2, 3), (2, 1, 4)]"
TET_OF_FACE = [0, 1, 0, 1, 0, 1]


def load(body: str, children: str = "") -> Scene:
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef TetMesh "t" {{\n{body}\n{children}\n}}')
    return warp_rt.load_scene(stage)


def mesh_of(scene: Scene) -> Mesh:
    (mesh,) = scene.meshes
    return mesh


def codes(scene: Scene) -> list[str]:
    return [record.code for record in scene.diagnostics if record.prim.startswith("/t")]


def volume(mesh: Mesh) -> float:
    """Return the volume that a closed surface encloses, positive where it faces out: the divergence theorem."""
    a, b, c = np.moveaxis(mesh.points[mesh.triangles].astype(float), 1, 0)
    return float(np.einsum("ni,ni", a, np.cross(b, c)) / 6)


def block(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a cube of size^3 unit cells, each cut into the six tetrahedra of positive volume about its diagonal."""
    side = np.arange(size + 1)
    points = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(size + 1, size + 1, size + 1)
    tets = []
    for corner in itertools.product(range(size), repeat=3):
        for axes in itertools.permutations(range(3)):
            path = np.cumsum([corner, *np.eye(3, dtype=int)[list(axes)]], axis=0)
            tet = [number[tuple(place)] for place in path]
            is_even = np.linalg.det(np.eye(3)[list(axes)]) > 0
            tets.append(tet if is_even else [tet[0], tet[2], tet[1], tet[3]])
    return points, np.array(tets)


def define(points: np.ndarray, tets: np.ndarray) -> tuple[Usd.Stage, UsdGeom.TetMesh]:
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.TetMesh.Define(stage, "/t")
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32)))
    prim.CreateTetVertexIndicesAttr(Vt.Vec4iArray.FromNumpy(np.ascontiguousarray(tets, np.int32)))
    return stage, prim


def test_the_surface_is_what_no_two_tetrahedra_share() -> None:
    """As USD's own function finds it; it encloses what the tetrahedra fill."""
    points, tets = block(3)
    shuffled = np.random.default_rng(4).permutation(tets)
    stage, prim = define(points, shuffled)
    scene = warp_rt.load_scene(stage)
    mesh = mesh_of(scene)
    np.testing.assert_array_equal(mesh.triangles, np.array(UsdGeom.TetMesh.ComputeSurfaceFaces(prim)))
    assert len(mesh.triangles) == 6 * 9 * 2
    assert mesh.is_closed
    assert volume(mesh) == pytest.approx(27)
    accel = warp_rt.build_accel(scene)
    hits = warp_rt.closest_hit(accel, [[1.3, 1.4, 9.0]], [[0.0, 0.0, -1.0]])
    assert hits.t[0] == pytest.approx(6)


def test_authored_surface_faces_are_drawn_as_they_are() -> None:
    mesh = mesh_of(load(POINTS + "\n" + FACES))
    np.testing.assert_array_equal(mesh.triangles[0], [0, 1, 3])
    assert len(mesh.triangles) == 6
    assert mesh.normals is None
    assert volume(mesh) == pytest.approx(2 * 8 / 6)
    part = mesh_of(load(f"{POINTS}\n{TETS}\nint3[] surfaceFaceVertexIndices = [(0, 1, 3)]"))
    assert len(part.triangles) == 1


@pytest.mark.parametrize("faces", ["", FACES])
def test_left_handed_meshes_are_turned(faces: str) -> None:
    """Mirrored, with the orientation that says so: outwards is still outwards."""
    mirrored = POINTS.replace("(2, 0, 0)", "(-2, 0, 0)")
    mesh = mesh_of(load(f'{mirrored}\n{TETS}\n{faces}\nuniform token orientation = "leftHanded"'))
    assert mesh.is_closed
    assert volume(mesh) == pytest.approx(2 * 8 / 6)


def at_faces(mesh: Mesh, name: str) -> np.ndarray:
    primvar = mesh.primvars[name]
    assert primvar.indices is not None
    return primvar.values[primvar.indices][..., 0]


def test_primvars_by_point_tetrahedron_face_and_corner() -> None:
    corners = ", ".join(map(str, range(18)))
    scene = load(
        f"""{POINTS}\n{TETS}\n{FACES}
        float[] primvars:vertex = [0, 1, 2, 3, 4] (interpolation = "vertex")
        float[] primvars:tet = [10, 11] (interpolation = "uniform")
        float[] primvars:few = [10, 11] (interpolation = "uniform")
        int[] primvars:few:indices = [1, 0]
        float[] primvars:face = [20, 21, 22, 23, 24, 25] (interpolation = "uniform")
        float[] primvars:corner = [{corners}] (interpolation = "faceVarying")
        normal3f[] normals = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0), (1, 0, 0)]
        """
    )
    mesh = mesh_of(scene)
    assert codes(scene) == []
    np.testing.assert_array_equal(at_faces(mesh, "vertex"), mesh.triangles)
    np.testing.assert_array_equal(at_faces(mesh, "tet")[:, 0], 10 + np.array(TET_OF_FACE))
    np.testing.assert_array_equal(at_faces(mesh, "few")[:, 0], 11 - np.array(TET_OF_FACE))
    np.testing.assert_array_equal(at_faces(mesh, "face")[:, 0], 20 + np.arange(6))
    np.testing.assert_array_equal(at_faces(mesh, "corner"), np.arange(18).reshape(6, 3))
    assert mesh.normals is not None
    np.testing.assert_array_equal(mesh.normals.indices, mesh.triangles)


def test_uniform_values_are_the_tetrahedra_s_where_both_would_fit() -> None:
    """Four tetrahedra about an inner point have four outer faces."""
    points = [(0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 4), (1, 1, 1)]
    tets = [(0, 1, 2, 4), (0, 2, 3, 4), (0, 3, 1, 4), (1, 3, 2, 4)]
    stage, prim = define(np.array(points), np.array(tets)[:, [0, 2, 1, 3]])
    primvar = UsdGeom.PrimvarsAPI(prim).CreatePrimvar("tet", Sdf.ValueTypeNames.FloatArray, UsdGeom.Tokens.uniform)
    primvar.Set([0, 1, 2, 3])
    mesh = mesh_of(warp_rt.load_scene(stage))
    assert len(mesh.triangles) == 4
    for triangle, tet in zip(mesh.triangles, at_faces(mesh, "tet")[:, 0].astype(int), strict=True):
        assert set(triangle) <= set(tets[tet])


def test_subsets_of_tetrahedra_and_of_faces() -> None:
    def subset(name: str, kind: str, indices: list[int]) -> str:
        return f"""def GeomSubset "{name}" {{ uniform token elementType = "{kind}"
            uniform token familyName = "materialBind"
            int[] indices = {indices}\n}}"""

    scene = load(f"{POINTS}\n{TETS}\n{FACES}", subset("face", "face", [0]) + "\n" + subset("tet", "tetrahedron", [1]))
    assert codes(scene) == []
    np.testing.assert_array_equal(mesh_of(scene).material_slots, [1, 2, 0, 2, 0, 2])
    both = subset("a", "tetrahedron", [0, 9]) + "\n" + subset("b", "face", [0])
    scene = load(f"{POINTS}\n{TETS}\n{FACES}", both)
    assert codes(scene) == ["W111", "W110"]
    np.testing.assert_array_equal(mesh_of(scene).material_slots, [1, 0, 1, 0, 1, 0])


def test_what_does_not_fit_is_told() -> None:
    assert codes(load("")) == ["N910"]
    assert codes(load(POINTS)) == ["N910"]
    twice = load(POINTS + "\nint4[] tetVertexIndices = [(0, 1, 2, 3), (1, 0, 2, 3)]")
    assert "TetMesh without a surface: no face is one tetrahedron's alone" in [d.message for d in twice.diagnostics]
    lost = load(POINTS + "\nint4[] tetVertexIndices = [(0, 1, 2, 3), (0, 2, 1, 9)]")
    assert codes(lost) == ["W102"]
    assert len(mesh_of(lost).triangles) == 4
    assert codes(load(POINTS + "\n" + TETS.replace("int4[]", "float4[]"))) == ["W104", "N910"]
    bad_face = load(f"{POINTS}\n{TETS}\nint3[] surfaceFaceVertexIndices = [(0, 1, 3), (0, 2, -4)]")
    assert codes(bad_face) == ["W102"]
    assert len(mesh_of(bad_face).triangles) == 1
    assert codes(load(POINTS.replace("(0, 0, -2)", "(0, 0, nan)") + "\n" + TETS)) == ["W103"]
    assert codes(load(f'{POINTS}\n{TETS}\nfloat[] primvars:a = [1, 2, 3] (interpolation = "uniform")')) == ["W106"]


def test_both_ends_of_an_animation_of_the_topology() -> None:
    """A mesh that falls in two between its samples: topology is held, never interpolated."""
    body = """
        point3f[] points.timeSamples = {
            0: [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (0, 0, -2)],
            10: [(0, 0, 3), (2, 0, 3), (0, 2, 3), (0, 0, 5), (0, 0, -3), (2, 0, -3), (0, 2, -3), (0, 0, -5)],
        }
        int4[] tetVertexIndices.timeSamples = { 0: [(0, 1, 2, 3), (0, 2, 1, 4)], 10: [(0, 1, 2, 3), (4, 6, 5, 7)], }
    """
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef TetMesh "t" {{\n{body}\n}}')
    for time, faces in ((0.0, 6), (5.0, 6), (10.0, 8)):
        mesh = mesh_of(warp_rt.load_scene(stage, time=time))
        assert len(mesh.triangles) == faces
        assert volume(mesh) == pytest.approx(2 * 8 / 6)
