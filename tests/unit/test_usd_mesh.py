# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Meshes of a few lines of usda: topology, normals, primvars and subsets by the rules of UsdGeomMesh."""

import numpy as np
import pytest
from pxr import Usd

from warp_rt.report import Report
from warp_rt.scene import Mesh
from warp_rt.usd.authored import AuthoredReader
from warp_rt.usd.load import load_stage
from warp_rt.usd.mesh import read_meshes
from warp_rt.usd.sources import MeshSource, Source
from warp_rt.usd.volumes import encloses_volume

# Two unit squares side by side in the plane z = 0, seen from +z.
SQUARES = """
    point3f[] points = [(0,0,0), (1,0,0), (2,0,0), (0,1,0), (1,1,0), (2,1,0)]
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    uniform token subdivisionScheme = "none"
"""
# Pyramid of four triangles on a square; closed, outward.
PYRAMID = """
    point3f[] points = [(-1,-1,0), (1,-1,0), (1,1,0), (-1,1,0), (0,0,1)]
    int[] faceVertexCounts = [4, 3, 3, 3, 3]
    int[] faceVertexIndices = [0,3,2,1, 0,1,4, 1,2,4, 2,3,4, 3,0,4]
"""
CUBE = """
    point3f[] points = [(-1,-1,-1), (1,-1,-1), (1,1,-1), (-1,1,-1), (-1,-1,1), (1,-1,1), (1,1,1), (-1,1,1)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,3,2,1, 4,5,6,7, 0,1,5,4, 2,3,7,6, 1,2,6,5, 0,4,7,3]
"""


def read(body: str, time: float = 0.0) -> tuple[MeshSource | None, list[str]]:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Mesh "M"\n{{\n{body}\n}}\n')
    report = Report()
    prim = stage.GetPrimAtPath("/M")
    source = Source(prim, AuthoredReader().read(prim, has_clips=False), None, Usd.TimeCode(time), None, 0)
    mesh = read_meshes([source], report)[0]
    return mesh, [record.code for record in report]


def mesh_of(body: str, time: float = 0.0) -> Mesh:
    source, codes = read(body, time)
    assert source is not None
    assert codes == []
    return source.mesh


def normals_of(mesh: Mesh) -> np.ndarray:
    corners = mesh.points[mesh.triangles].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def at_corners(mesh: Mesh, name: str) -> np.ndarray:
    """The primvar's value at every triangle corner, shape [m, 3, c]."""
    primvar = mesh.primvars[name]
    rows = np.zeros_like(mesh.triangles) if primvar.indices is None else primvar.indices
    return primvar.values[rows]


# --- topology


def test_polygon_mesh_without_normals_is_flat_and_faces_its_front() -> None:
    mesh = mesh_of(SQUARES)
    assert mesh.normals is None
    assert len(mesh.triangles) == 4
    assert mesh.face_ids.tolist() == [0, 0, 1, 1]
    np.testing.assert_array_equal(normals_of(mesh), np.tile([0, 0, 1], (4, 1)))
    assert not mesh.is_closed


def test_left_handed_orientation_turns_triangles_and_keeps_corners() -> None:
    body = SQUARES + 'uniform token orientation = "leftHanded"\n'
    body += 'float[] primvars:x = [0,1,1,0, 1,2,2,1] (interpolation = "faceVarying")'
    mesh = mesh_of(body)
    np.testing.assert_array_equal(normals_of(mesh), np.tile([0, 0, -1], (4, 1)))
    np.testing.assert_array_equal(at_corners(mesh, "x")[..., 0], mesh.points[mesh.triangles][..., 0])


def test_holes_are_left_out_and_face_ids_still_count_all_faces() -> None:
    mesh = mesh_of(SQUARES + "int[] holeIndices = [0]")
    assert mesh.face_ids.tolist() == [1, 1]
    assert mesh.points[mesh.triangles][..., 0].min() == 1


@pytest.mark.parametrize(
    ("counts", "indices", "code", "kept"),
    [
        ([4, 2, 4], [0, 1, 4, 3, 0, 1, 1, 2, 5, 4], "W101", {0, 2}),
        ([4, 4], [0, 1, 4, 3, 1, 2, 6, 4], "W102", {0}),
        ([4, 4], [0, 1, 4, -1, 1, 2, 5, 4], "W102", {1}),
        ([4, 4, 4], [0, 1, 4, 3, 1, 2, 5, 4], "W104", {0, 1}),
        ([4], [0, 1, 4, 3, 1, 2, 5, 4], "W104", {0}),
        ([4, 2147483647], [0, 1, 4, 3, 1, 2, 5, 4], "W104", {0}),
        ([-3, 4, 4], [0, 1, 4, 3, 1, 2, 5, 4], "W101", {1, 2}),
    ],
)
def test_faces_that_cannot_be_drawn_are_dropped_with_a_code(counts, indices, code, kept) -> None:
    source, codes = read(
        f"""
        point3f[] points = [(0,0,0), (1,0,0), (2,0,0), (0,1,0), (1,1,0), (2,1,0)]
        int[] faceVertexCounts = {counts}
        int[] faceVertexIndices = {indices}
        uniform token subdivisionScheme = "none"
        """
    )
    assert code in codes
    faces = source.mesh.face_ids
    assert set(range(len(source.mesh.triangles)) if faces is None else faces) == kept


def test_points_that_are_not_finite_take_their_faces_with_them() -> None:
    source, codes = read(SQUARES.replace("(2,1,0)", "(nan, 1e400, -inf)"))
    assert codes == ["W103"]
    assert source.mesh.face_ids.tolist() == [0, 0]
    assert np.isfinite(source.mesh.points).all()


@pytest.mark.parametrize("body", ["", "point3f[] points = []", "int points = 4\nint[] faceVertexCounts = [3]"])
def test_nothing_to_draw_gives_no_mesh_and_a_note(body: str) -> None:
    source, codes = read(body)
    assert source is None
    assert "N910" in codes


def test_closed_is_told_by_position_not_by_index() -> None:
    assert mesh_of(CUBE).is_closed
    cube = mesh_of(CUBE)
    # Every triangle with vertices of its own: as a mesh cut open along all edges.
    points = cube.points[cube.triangles].reshape(-1, 3)
    assert encloses_volume(points, np.arange(36).reshape(-1, 3))
    assert not encloses_volume(points, np.arange(33).reshape(-1, 3))
    turned = np.arange(36).reshape(-1, 3)
    turned[5] = turned[5][::-1]
    assert not encloses_volume(points, turned)
    assert not encloses_volume(points, turned[:0])


# --- normals


def test_a_subdivided_cage_has_smooth_normals_and_ignores_authored_ones() -> None:
    source, codes = read(CUBE + 'normal3f[] normals = [(1,0,0)] (interpolation = "constant")')
    assert (source is not None, codes) == (True, ["N915"])
    mesh = source.mesh
    # By symmetry the normal at a corner of a cube points along its diagonal.
    np.testing.assert_allclose(mesh.normals.values[mesh.triangles], mesh.points[mesh.triangles] / np.sqrt(3), atol=1e-6)
    np.testing.assert_array_equal(mesh.normals.indices, mesh.triangles)


def test_smooth_normals_point_outward_for_left_handed_cages_too() -> None:
    body = CUBE.replace(
        "[0,3,2,1, 4,5,6,7, 0,1,5,4, 2,3,7,6, 1,2,6,5, 0,4,7,3]",
        "[1,2,3,0, 7,6,5,4, 4,5,1,0, 6,7,3,2, 5,6,2,1, 3,7,4,0]",
    )
    mesh = mesh_of(body + 'uniform token orientation = "leftHanded"')
    np.testing.assert_allclose(mesh.normals.values, mesh.points / np.sqrt(3), atol=1e-6)
    assert (np.einsum("ij,ij->i", normals_of(mesh), mesh.points[mesh.triangles].mean(axis=1)) > 0).all()


def test_smooth_normals_weigh_faces_at_corners() -> None:
    mesh = mesh_of(PYRAMID)
    np.testing.assert_allclose(mesh.normals.values[4], [0, 0, 1], atol=1e-6)
    # Corner (1,1,0): base 4 (0,0,-1), sides 2 (1,0,1) and 2 (0,1,1) by hand: (2,2,0).
    np.testing.assert_allclose(mesh.normals.values[2], [0.5**0.5, 0.5**0.5, 0], atol=1e-6)


def test_a_bilinear_cage_is_its_own_surface_and_stays_flat() -> None:
    assert mesh_of(CUBE + 'uniform token subdivisionScheme = "bilinear"').normals is None


def test_empty_normals_are_none() -> None:
    assert mesh_of(SQUARES + "normal3f[] normals = []\n").normals is None


def test_primvar_normals_precede_the_attribute() -> None:
    body = SQUARES + "normal3f[] normals = [(1,0,0), (1,0,0), (1,0,0), (1,0,0), (1,0,0), (1,0,0)]\n"
    mesh = mesh_of(body)
    assert (mesh.normals.values == [1, 0, 0]).all()
    mesh = mesh_of(
        body
        + 'normal3f[] primvars:normals = [(0,1,0)] (interpolation = "uniform")\nint[] primvars:normals:indices = [0, 0]'
    )
    assert (mesh.normals.values[mesh.normals.indices] == [0, 1, 0]).all()
    assert "normals" not in mesh.primvars


def test_face_varying_normals_follow_their_corners() -> None:
    values = ", ".join(f"({k},0,1)" for k in range(1, 9))
    mesh = mesh_of(SQUARES + f'normal3f[] normals = [{values}] (interpolation = "faceVarying")')
    # Corner k of the mesh is vertex [0,1,4,3,1,2,5,4][k] and has the normal (k + 1, 0, 1).
    corner = mesh.normals.values[mesh.normals.indices][..., 0].astype(int) - 1
    np.testing.assert_array_equal(np.array([0, 1, 4, 3, 1, 2, 5, 4])[corner], mesh.triangles)


@pytest.mark.parametrize("bad", ["(0,0,0)", "(nan,0,0)"])
def test_a_normal_without_direction_is_replaced_by_the_faces_own(bad: str) -> None:
    source, _ = read(SQUARES + f'normal3f[] normals = [(1,0,0), {bad}] (interpolation = "uniform")')
    normals = source.mesh.normals
    at = normals.values[normals.indices]
    np.testing.assert_array_equal(at[:2], np.broadcast_to([1, 0, 0], (2, 3, 3)))
    np.testing.assert_array_equal(at[2:], np.broadcast_to([0, 0, 1], (2, 3, 3)))


# --- primvars


def expected_by_interpolation(mesh: Mesh) -> dict[str, np.ndarray]:
    corner_vertex = mesh.triangles
    face = np.repeat(mesh.face_ids[:, None], 3, axis=1)
    return {"constant": np.full_like(face, 7), "uniform": face, "vertex": corner_vertex, "varying": corner_vertex}


@pytest.mark.parametrize("is_indexed", [False, True])
@pytest.mark.parametrize(("interpolation", "count"), [("constant", 1), ("uniform", 2), ("vertex", 6), ("varying", 6)])
def test_every_interpolation_indexed_or_not(interpolation: str, count: int, is_indexed: bool) -> None:
    values = [7] if interpolation == "constant" else list(range(count))
    body = f'float[] primvars:id = {values} (interpolation = "{interpolation}")'
    if is_indexed:
        body = f'float[] primvars:id = {values[::-1]} (interpolation = "{interpolation}")\n'
        body += f"int[] primvars:id:indices = {list(range(count))[::-1]}"
    mesh = mesh_of(SQUARES + body)
    expected = expected_by_interpolation(mesh)[interpolation]
    np.testing.assert_array_equal(at_corners(mesh, "id")[..., 0], expected)


def test_indexed_face_varying_uv_follows_corners_through_triangulation_and_holes() -> None:
    body = SQUARES + "int[] holeIndices = [0]\n"
    body += 'texCoord2f[] primvars:st = [(1,0), (2,0), (2,1), (1,1)] (interpolation = "faceVarying")\n'
    body += "int[] primvars:st:indices = [0,0,0,0, 0,1,2,3]"
    mesh = mesh_of(body)
    np.testing.assert_array_equal(at_corners(mesh, "st"), mesh.points[mesh.triangles][..., :2])


@pytest.mark.parametrize(
    "type_name", ["half", "float", "double", "float2", "half3", "double4", "color3f", "vector3d", "Vec2f", "Vec3d"]
)
def test_every_float_type_arrives_as_float32_rows(type_name: str) -> None:
    """Vec2f and the like are the names that files before 2014 have for types."""
    width = int(next((c for c in type_name if c.isdigit()), "1"))
    value = "2" if width == 1 else f"({', '.join(['2'] * width)})"
    mesh = mesh_of(SQUARES + f'{type_name}[] primvars:v = [{value}] (interpolation = "constant")')
    assert mesh.primvars["v"].values.dtype == np.float32
    assert mesh.primvars["v"].values.tolist() == [[2.0] * width]


def test_a_scalar_constant_counts_as_an_array_of_one() -> None:
    mesh = mesh_of(SQUARES + "color3f primvars:displayColor = (0.5, 0, 1)")
    assert mesh.primvars["displayColor"].values.tolist() == [[0.5, 0.0, 1.0]]


@pytest.mark.parametrize(
    ("body", "code"),
    [
        ('float[] primvars:v = [1, 2, 3] (interpolation = "vertex")', "W106"),
        ('float[] primvars:v = [1, 2] (interpolation = "somewhere")', "W106"),
        ('float[] primvars:v = [] (interpolation = "vertex")', "W106"),
        ("color3f[] primvars:displayColor = []", "W106"),
        ('float[] primvars:v = [1, 2] (interpolation = "uniform")\nint[] primvars:v:indices = [0, 2]', "W107"),
        ('float[] primvars:v = [1, 2] (interpolation = "uniform")\nint[] primvars:v:indices = [0, -1]', "W107"),
        ('float[] primvars:v = [1, 2] (interpolation = "uniform")\nint[] primvars:v:indices = [0]', "W106"),
        ('string[] primvars:displayColor = ["red"]', "W108"),
        ('float2[] primvars:displayColor = [(1, 2)] (interpolation = "constant")', "W108"),
    ],
)
def test_primvars_that_do_not_fit_are_dropped_with_a_code(body: str, code: str) -> None:
    source, codes = read(SQUARES + body)
    assert codes == [code]
    assert source.mesh.primvars == {}


def test_what_a_primvar_holds_is_told_not_what_the_schema_declares() -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\ndef Mesh "m" {{ {SQUARES}string primvars:displayOpacity = "x"\n}}'
    )
    (found,) = [record.message for record in load_stage(stage).diagnostics if record.code == "W108"]
    assert found == "primvars:displayOpacity left out: it holds a str, which does not fit"


@pytest.mark.parametrize(
    "body",
    ["float[] primvars:v = None", "float[] primvars:v", "matrix4d[] primvars:m = []"],
)
def test_blocked_unauthored_and_undrawable_primvars_are_absent(body: str) -> None:
    assert mesh_of(SQUARES + body).primvars == {}


@pytest.mark.parametrize("value", ["", "float[] primvars:v = [3]"])
def test_connected_primvars_are_told_and_have_their_own_values(value: str) -> None:
    source, codes = read(SQUARES + f"float[] primvars:v.connect = </other.primvars:v>\n{value}")
    assert codes == ["W112"]
    assert [primvar.values.tolist() for primvar in source.mesh.primvars.values()] == ([[[3.0]]] if value else [])


def test_primvar_values_that_are_not_finite_become_zero() -> None:
    source, codes = read(SQUARES + 'float2[] primvars:st = [(1, 2), (nan, 1)] (interpolation = "uniform")')
    assert codes == ["W109"]
    assert source.mesh.primvars["st"].values.tolist() == [[1, 2], [0, 0]]


def test_values_are_read_at_the_time_asked_for() -> None:
    body = SQUARES + 'float[] primvars:v = [9] (interpolation = "constant")\n'
    body += "float[] primvars:v.timeSamples = { 0: [1], 10: [3] }"
    assert mesh_of(body, 5).primvars["v"].values.tolist() == [[2.0]]
    assert mesh_of(body, -7).primvars["v"].values.tolist() == [[1.0]]


# --- subsets


def subset(name: str, indices: list[int], extra: str = "") -> str:
    return f"""
    def GeomSubset "{name}"
    {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = {indices}
        {extra}
    }}
    """


def test_subsets_become_slots_and_leftover_faces_stay_with_the_mesh() -> None:
    source, codes = read(SQUARES + subset("b", [1]))
    assert codes == []
    assert source.subsets == ("b",)
    assert source.mesh.material_slots.tolist() == [0, 0, 1, 1]


def test_the_first_of_overlapping_subsets_wins_with_a_warning() -> None:
    source, codes = read(SQUARES + subset("first", [1]) + subset("second", [0, 1, 1]))
    assert codes == ["W110"]
    assert source.subsets == ("first", "second")
    assert source.mesh.material_slots.tolist() == [2, 2, 1, 1]


def test_subsets_of_other_families_do_not_count_and_wrong_faces_are_reported() -> None:
    source, codes = read(SQUARES + subset("a", [0]).replace("materialBind", "selection"))
    assert (source.subsets, source.mesh.material_slots, codes) == ((), None, [])
    source, codes = read(SQUARES + subset("a", [0, 2, -1]))
    assert codes == ["W111"]
    assert source.mesh.material_slots.tolist() == [1, 1, 0, 0]


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("", 'token orientation = "clockwise"', "W114"),
        ('subdivisionScheme = "none"', 'subdivisionScheme = "smooth"', "W114"),
        ("", 'string holeIndices = "x"', "W104"),
    ],
)
def test_values_that_the_schema_does_not_have_are_named(old: str, new: str, code: str) -> None:
    source, codes = read(SQUARES.replace(old, new) if old else f"{SQUARES}\n{new}")
    assert codes == [code]
    assert len(source.mesh.triangles) == 4
    np.testing.assert_allclose(normals_of(source.mesh)[:, :2], 0)
    assert (normals_of(source.mesh)[:, 2] > 0).all()


def test_indices_of_a_subset_that_are_no_integers_are_named() -> None:
    subset = (
        'def GeomSubset "a" {\nuniform token elementType = "face"\nuniform token familyName = "materialBind"\n'
        'string indices = "0"\n}'
    )
    assert read(f"{SQUARES}\n{subset}")[1] == ["W111"]


@pytest.mark.parametrize("purpose", ["", ":full", ":preview"])
def test_a_subset_with_a_material_but_of_no_family_is_named(purpose: str) -> None:
    subset = (
        'def GeomSubset "a" {\nuniform token elementType = "face"\nint[] indices = [0]\nFAMILY\n'
        f"rel material:binding{purpose} = </M>\n}}"
    )
    assert read(f"{SQUARES}\n{subset}".replace("FAMILY", ""))[1] == ["W111"]
    assert read(f"{SQUARES}\n{subset}".replace("FAMILY", 'uniform token familyName = "materialBind"'))[1] == []
    physics = subset.replace(f"binding{purpose} ", "binding:physics ").replace("FAMILY", "")
    assert read(f"{SQUARES}\n{physics}")[1] == []


@pytest.mark.parametrize("above", ["Xform", "Cube", "Points", ""])
def test_subsets_of_what_has_none_are_named_where_they_have_a_material(above: str) -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f"""#usda 1.0
        def {above} "a" {{
            def GeomSubset "bound" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ rel material:binding = </M>
            }}
            def GeomSubset "plain" {{}}
            def GeomSubset "moved" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
                rel material:binding:physics = </M>
            }}
        }}
        def Material "M" {{}}
        """
    )
    told = {record.prim: record.code for record in load_stage(stage).diagnostics}
    assert told["/a/bound"] == "W111"
    assert told.keys().isdisjoint({"/a/plain", "/a/moved"})


@pytest.mark.parametrize("interpolation", ["varying", "vertex", "faceVarying", "uniform"])
def test_display_opacity_may_vary(interpolation: str) -> None:
    count = {"varying": 6, "vertex": 6, "faceVarying": 8, "uniform": 2}[interpolation]
    values = [k / 8 for k in range(count)]
    mesh = mesh_of(f'{SQUARES}\nfloat[] primvars:displayOpacity = {values} (interpolation = "{interpolation}")')
    opacity = mesh.primvars["displayOpacity"]
    element = {"uniform": np.repeat(mesh.face_ids[:, None], 3, axis=1), "faceVarying": None}.get(
        interpolation, mesh.triangles
    )
    if element is not None:
        np.testing.assert_allclose(opacity.values[opacity.indices, 0], np.array(values)[element])
    else:
        assert set(np.unique(opacity.values[opacity.indices])) == set(np.float32(values))
