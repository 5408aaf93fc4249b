# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Subdivision surfaces as UsdGeomMesh says them: attributes to rules, and values to refined triangles."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd

import warp_rt
from warp_rt.errors import LimitError, OptionError
from warp_rt.report import Report
from warp_rt.scene import Mesh, Scene
from warp_rt.usd.authored import AuthoredReader
from warp_rt.usd.mesh import read_meshes
from warp_rt.usd.sources import Source

CUBE = """
    point3f[] points = [(-1,-1,-1), (-1,-1,1), (-1,1,-1), (-1,1,1), (1,-1,-1), (1,-1,1), (1,1,-1), (1,1,1)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,4,5,1, 2,3,7,6, 0,2,6,4, 1,5,7,3]
"""
QUAD_POINTS = "point3f[] points = [(0,0,0), (1,0,0), (0,1,0), (1,1,0)]\n"
TOP = "int[] creaseIndices = [1, 5, 7, 3, 1]\nint[] creaseLengths = [5]\n"


def load(body: str, complexity: str = "high", kind: str = CUBE) -> Scene:
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Mesh "m" {{ {kind}\n{body}\n}}')
    return warp_rt.load_scene(stage, complexity=complexity)


def mesh_of(body: str, complexity: str = "high", kind: str = CUBE) -> Mesh:
    return load(body, complexity, kind).meshes[0]


def codes(scene: Scene) -> set[str]:
    return {record.code for record in scene.diagnostics if record.code[0] == "W"}


def normals_at(mesh: Mesh) -> np.ndarray:
    return mesh.normals.values[mesh.normals.indices]


@pytest.mark.parametrize(("complexity", "triangles"), [("low", 12), ("medium", 48), ("high", 192), ("veryhigh", 768)])
def test_complexity_is_the_number_of_refinements(complexity: str, triangles: int) -> None:
    mesh = mesh_of("", complexity)
    assert len(mesh.triangles) == triangles
    assert mesh.is_closed
    np.testing.assert_allclose(np.abs(mesh.points[:8]), 1.0 if complexity == "low" else 0.5, atol=1e-6)


@pytest.mark.parametrize("orientation", ["rightHanded", "leftHanded"])
def test_normals_and_winding_point_to_the_same_side(orientation: str) -> None:
    mesh = mesh_of(f'uniform token orientation = "{orientation}"')
    corners = mesh.points[mesh.triangles]
    facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward = (facet * corners.mean(axis=1)).sum(axis=1) > 0
    assert outward.tolist() == [orientation == "rightHanded"] * len(facet)
    assert (np.einsum("fk,fck->fc", facet, normals_at(mesh)) > 0).all()


@pytest.mark.parametrize("sharpness", ["[10]", "[10, 10, 10, 10]"])
def test_creases_have_one_sharpness_each_or_one_an_edge(sharpness: str) -> None:
    mesh = mesh_of(TOP + f"float[] creaseSharpnesses = {sharpness}")
    on_top = np.abs(mesh.points[:, 2] - 1) < 1e-6
    assert on_top.sum() == 25  # the creased face stays flat, and its 4 x 4 squares lie in it
    np.testing.assert_allclose(np.linalg.norm(normals_at(mesh), axis=-1), 1, atol=1e-5)
    top_faces = on_top[mesh.triangles].all(axis=1)
    np.testing.assert_allclose(normals_at(mesh)[top_faces] - (0, 0, 1), 0, atol=1e-5)


def test_corners_are_pinned() -> None:
    mesh = mesh_of("int[] cornerIndices = [7]\nfloat[] cornerSharpnesses = [10]")
    np.testing.assert_allclose(mesh.points[7], (1, 1, 1), atol=1e-6)


@pytest.mark.parametrize(
    "body",
    [
        TOP + "float[] creaseSharpnesses = [1, 2]",
        TOP.replace("[5]", "[4]") + "float[] creaseSharpnesses = [10]",
        TOP.replace("5, 7", "5, 70") + "float[] creaseSharpnesses = [10]",
        "int[] cornerIndices = [1, 2]\nfloat[] cornerSharpnesses = [10]",
        "float[] creaseSharpnesses = [10]",
        "float[] cornerSharpnesses = [10]",
        TOP.replace("1, 5, 7, 3, 1", "1, 7, 1, 7, 1") + "float[] creaseSharpnesses = [10]",  # a diagonal
    ],
)
def test_creases_and_corners_that_do_not_fit_are_told(body: str) -> None:
    scene = load(body)
    assert codes(scene) == {"W115"}
    np.testing.assert_array_equal(scene.meshes[0].points, mesh_of("").points)


def test_holes_are_left_out_of_the_surface_but_not_of_the_rules() -> None:
    mesh = mesh_of("int[] holeIndices = [5]")
    whole = mesh_of("")
    assert len(mesh.triangles) == len(whole.triangles) * 5 // 6
    np.testing.assert_array_equal(mesh.points, whole.points)
    assert not mesh.is_closed
    assert set(mesh.face_ids) == {0, 1, 2, 3, 4}


def test_primvars_are_interpolated_by_their_kind() -> None:
    mesh = mesh_of(
        """
        color3f[] primvars:face = [(0,0,0), (1,0,0), (2,0,0), (3,0,0), (4,0,0), (5,0,0)] (interpolation = "uniform")
        float[] primvars:line = [-1, -1, -1, -1, 1, 1, 1, 1] (interpolation = "varying")
        float[] primvars:curve = [-1, -1, -1, -1, 1, 1, 1, 1] (interpolation = "vertex")
        float[] primvars:corner = [-1, 1] (interpolation = "faceVarying")
        int[] primvars:corner:indices = [0,0,0,0, 1,1,1,1, 0,1,1,0, 0,0,1,1, 0,0,1,1, 0,1,1,0]
        """
    )
    at = {name: mesh.primvars[name].values[mesh.primvars[name].indices][..., 0] for name in mesh.primvars}
    np.testing.assert_array_equal(at["face"][:, 0], mesh.face_ids)
    assert set(np.unique(at["line"])) == {-1, -0.5, 0, 0.5, 1}
    assert at["curve"].max() < 1  # it moves as the points do
    np.testing.assert_allclose(at["corner"], at["curve"], atol=1e-6)  # the same values, and no seam among them


@pytest.mark.parametrize("sharpness", [0, 1.5, 10])
def test_vertex_values_are_those_of_the_limit_as_points_are(sharpness: float) -> None:
    points = CUBE.split("[]")[1].split("=")[1].split("int")[0].strip()
    copies = f"""
        point3f[] primvars:rest = {points} (interpolation = "vertex")
        point3f[] primvars:corner = {points} (interpolation = "faceVarying")
        int[] primvars:corner:indices = [0,1,3,2, 4,6,7,5, 0,4,5,1, 2,3,7,6, 0,2,6,4, 1,5,7,3]
    """
    mesh = mesh_of(TOP + f"float[] creaseSharpnesses = [{sharpness}]" + copies, "medium")
    for name in ("rest", "corner"):
        found = mesh.primvars[name].values[mesh.primvars[name].indices]
        np.testing.assert_allclose(found, mesh.points[mesh.triangles], atol=1e-6)


def test_indices_say_where_face_varying_values_have_seams() -> None:
    """Two squares with values of their own, equal along their common edge: by USD, a seam between islands of one face.

    So each is bilinear, for it has four corners; without indices, equal values are one, and are smooth.
    """
    squares = """
        point3f[] points = [(0,0,0), (1,0,0), (2,0,0), (0,1,0), (1,1,0), (2,1,0)]
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0,1,4,3, 1,2,5,4]
    """
    apart = """
        float[] primvars:v = [0, 0, 0, 0, 0, 8, 8, 0] (interpolation = "faceVarying")
    """
    for indices, at_edge in (("", 8 / 6), ("int[] primvars:v:indices = [0,1,2,3,4,5,6,7]", 0)):
        mesh = mesh_of(apart + indices, "medium", squares)
        v = mesh.primvars["v"].values[mesh.primvars["v"].indices][..., 0]
        on_edge = np.abs(mesh.points[mesh.triangles][..., 0] - 1) < 1e-6
        np.testing.assert_allclose(v[on_edge], at_edge, atol=1e-6)


def test_material_subsets_follow_their_faces() -> None:
    mesh = mesh_of(
        """
        def GeomSubset "part" { uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [2, 4]
            }
        """
    )
    np.testing.assert_array_equal(mesh.material_slots > 0, np.isin(mesh.face_ids, [2, 4]))


def test_loop_takes_triangles_only() -> None:
    scene = load('uniform token subdivisionScheme = "loop"')
    assert codes(scene) == {"W116"}
    assert len(scene.meshes[0].triangles) == 12
    triangles = """
        point3f[] points = [(1,0,0), (-1,0,0), (0,1,0), (0,-1,0), (0,0,1), (0,0,-1)]
        int[] faceVertexCounts = [3, 3, 3, 3, 3, 3, 3, 3]
        int[] faceVertexIndices = [0,2,4, 2,1,4, 1,3,4, 3,0,4, 2,0,5, 1,2,5, 3,1,5, 0,3,5]
    """
    mesh = mesh_of('uniform token subdivisionScheme = "loop"', kind=triangles)
    assert len(mesh.triangles) == 8 * 16
    radius = np.linalg.norm(mesh.points, axis=1)
    assert radius.max() / radius.min() < 1.3
    np.testing.assert_allclose(normals_at(mesh)[0, 0], mesh.points[0] / radius[0], atol=1e-5)


def test_polygons_are_not_refined() -> None:
    assert len(mesh_of('uniform token subdivisionScheme = "none"', "veryhigh").triangles) == 12


SADDLE = """
    uniform token subdivisionScheme = "bilinear"
    point3f[] points = [(0,0,0), (1,0,0), (1,1,1), (0,1,0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    texCoord2f[] primvars:st = [(0,0), (1,0), (1,1), (0,1)] (interpolation = "faceVarying")
    float[] primvars:v = [0, 1, 2, 1] (interpolation = "vertex")
"""


@pytest.mark.parametrize(("complexity", "triangles"), [("low", 2), ("medium", 8), ("veryhigh", 128)])
def test_bilinear_surfaces_approach_the_bilinear_patch(complexity: str, triangles: int) -> None:
    """Over the unit square with one corner raised, z = x y; values are bilinear too, and normals the facets' own."""
    mesh = mesh_of("", complexity, SADDLE)
    assert len(mesh.triangles) == triangles
    assert mesh.normals is None
    x, y, z = mesh.points.T.astype(float)
    np.testing.assert_allclose(z, x * y, atol=1e-7)
    st, v = mesh.primvars["st"], mesh.primvars["v"]
    np.testing.assert_allclose(st.values[st.indices], mesh.points[mesh.triangles][..., :2], atol=1e-7)
    np.testing.assert_allclose(v.values[v.indices][..., 0], (x + y)[mesh.triangles], atol=1e-6)


def test_bilinear_surfaces_keep_boundary_faces_and_creases_mean_nothing() -> None:
    mesh = mesh_of('uniform token interpolateBoundary = "none"\n', "medium", SADDLE)
    assert len(mesh.triangles) == 8
    box = mesh_of('uniform token subdivisionScheme = "bilinear"\n' + TOP, "high")
    assert np.abs(box.points).max(axis=1).min() == 1
    assert box.is_closed


def test_surfaces_of_too_many_faces_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warp_rt.usd.subdivision.MAX_FACES", 95)
    with pytest.raises(LimitError, match="/m: refined 2 times it has 96 faces"):
        load("")


def test_an_unknown_complexity_is_refused() -> None:
    with pytest.raises(OptionError, match="complexity"):
        load("", complexity="extreme")


def test_level_0_is_the_cage() -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Mesh "m" {{ {CUBE}\n}}')
    prim = stage.GetPrimAtPath("/m")
    source = Source(prim, AuthoredReader().read(prim, has_clips=False), None, Usd.TimeCode.Default(), None, 0)
    read = read_meshes([source], Report())[0]
    assert read is not None
    assert len(read.mesh.triangles) == 12


def test_a_boundary_rule_that_leaves_no_face_is_told() -> None:
    """A single quadrilateral has no face inside its boundary."""
    quad = QUAD_POINTS + "int[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 3, 2]\n"
    scene = load('uniform token interpolateBoundary = "none"', kind=quad)
    assert (scene.meshes, [record.code for record in scene.diagnostics]) == ((), ["N910", "N905"])


LEVELS = f"""
    def Xform "w" {{
        token warp_rt:complexity = "high"
        def Mesh "inherits" {{ {CUBE}
        }}
        def Mesh "coarse" {{ {CUBE}
            token warp_rt:complexity = "low"
        }}
    }}
    def Mesh "free" {{ {CUBE}
    }}
"""


@pytest.mark.parametrize(("complexity", "free"), [("low", 12), ("medium", 48)])
def test_prims_may_ask_for_their_own_complexity(complexity: str, free: int) -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{LEVELS}")
    scene = warp_rt.load_scene(stage, complexity=complexity)
    found = {scene.prims[p]: len(scene.meshes[m].triangles) for p, m in _rows(scene)}
    assert found == {"/w/inherits": 192, "/w/coarse": 12, "/free": free}


def _rows(scene: Scene) -> zip:
    return zip(scene.instances.prim.tolist(), scene.instances.mesh.tolist(), strict=True)


def test_instances_of_one_prototype_may_differ_in_complexity() -> None:
    copies = "".join(
        f'def "{name}" (instanceable = true\ninherits = </asset>) {{\n{says}\n}}\n'
        for name, says in (("a", ""), ("b", 'token warp_rt:complexity = "medium"'))
    )
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\nclass Xform "asset" {{\ndef Mesh "m" {{ {CUBE}\n}}\n}}\n{copies}'
    )
    scene = warp_rt.load_scene(stage)
    assert sorted(len(scene.meshes[m].triangles) for _, m in _rows(scene)) == [12, 48]


def test_prototypes_have_the_complexity_of_the_namespace_above_them() -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f"""#usda 1.0
        def PointInstancer "i" {{
            token warp_rt:complexity = "medium"
            int[] protoIndices = [0, 0]
            point3f[] positions = [(0,0,0), (9,0,0)]
            rel prototypes = </i/m>
            def Mesh "m" {{ {CUBE}
            }}
        }}
        """
    )
    scene = warp_rt.load_scene(stage)
    assert [len(found.triangles) for found in scene.meshes] == [48]


def test_a_complexity_that_is_none_is_told() -> None:
    scene = load('token warp_rt:complexity = "extreme"', "medium")
    assert codes(scene) == {"W114"}
    assert len(scene.meshes[0].triangles) == 48
