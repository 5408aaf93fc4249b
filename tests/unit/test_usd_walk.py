# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the walk draws, where, and what prims hand down: stages of a few lines against the rules of UsdGeom."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PilImage
from pxr import Usd, UsdGeom, UsdSemantics

from warp_rt.errors import LimitError
from warp_rt.image.ids import encode_ids
from warp_rt.report import Report
from warp_rt.scene import Scene
from warp_rt.scene.placement import place_scene
from warp_rt.usd.gprims import GprimReader
from warp_rt.usd.load import load_stage
from warp_rt.usd.materials import MaterialReader
from warp_rt.usd.walk import Limits, StageWalk

from ..stages import stage_of

TRIANGLE = """
    point3f[] points = [(0,0,0), (1,0,0), (0,1,0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token subdivisionScheme = "none"
"""


def load(body: str, **options) -> Scene:
    return load_stage(stage_of(body), **options)


def drawn(scene: Scene) -> set[str]:
    return {scene.prims[row] for row in scene.instances.prim}


def codes(scene: Scene) -> dict[str, str]:
    return {record.prim: record.code for record in scene.diagnostics}


def placement(scene: Scene, path: str) -> np.ndarray:
    return scene.instances.world_from_local[scene.instances.prim == scene.prims.index(path)][0]


# --- visibility and purpose


def test_invisible_prunes_and_cannot_be_undone_below() -> None:
    scene = load(
        f"""
        def Xform "hidden" {{
            token visibility = "invisible"
            def Mesh "a" {{ {TRIANGLE} token visibility = "inherited"
            }}
        }}
        def Mesh "shown" {{ {TRIANGLE} }}
        """
    )
    assert drawn(scene) == {"/shown"}


PURPOSES = "\n".join(
    f'def Xform "{purpose}" {{ token purpose = "{purpose}"\n'
    f'def Mesh "m" {{ {TRIANGLE} }}\ndef Mesh "again" {{ {TRIANGLE} token purpose = "default"\n }}\n}}'
    for purpose in ("default", "render", "proxy", "guide")
)


@pytest.mark.parametrize(
    ("purposes", "expected"),
    [
        (None, {"default", "proxy"}),
        (("render",), {"default", "render"}),
        (("guide", "proxy"), {"default", "guide", "proxy"}),
    ],
)
def test_purpose_inherits_unless_authored_below(purposes, expected) -> None:
    scene = load(PURPOSES, purposes=purposes)
    again = {f"/{purpose}/again" for purpose in ("default", "render", "proxy", "guide")}
    assert drawn(scene) == {f"/{purpose}/m" for purpose in expected} | again


def test_purposes_of_render_settings_count_where_authored() -> None:
    settings = '\ndef RenderSettings "rs" { uniform token[] includedPurposes = ["default", "guide"]\n }'
    scene = load(PURPOSES + settings, settings_path="/rs")
    assert {path.split("/")[1] for path in drawn(scene) if path.endswith("/m")} == {"default", "guide"}


@pytest.mark.parametrize("purposes", [("render",), ("proxy", "guide"), ("default",)])
def test_of_render_settings_that_leave_default_out_it_is_not_drawn(purposes) -> None:
    """Only prims of one of the purposes are, of PointInstancers too (UsdRenderSettings, includedPurposes)."""
    asked = ", ".join(f'"{purpose}"' for purpose in purposes)
    settings = f'\ndef RenderSettings "rs" {{ uniform token[] includedPurposes = [{asked}]\n }}'
    instancer = (
        '\ndef PointInstancer "pi" { rel prototypes = [</pi/a>, </pi/b>]\nint[] protoIndices = [0, 1]\n'
        f'point3f[] positions = [(0, 0, 0), (1, 0, 0)]\ndef Mesh "a" {{ {TRIANGLE} }}\n'
        f'def Mesh "b" {{ {TRIANGLE} token purpose = "render"\n }}\n}}'
    )
    scene = load(PURPOSES + instancer + settings, settings_path="/rs")
    again = {f"/{purpose}/again" for purpose in ("default", "render", "proxy", "guide")}
    copies = {"/pi/a": "default", "/pi/b": "render"}
    expected = {f"/{purpose}/m" for purpose in purposes} | (again if "default" in purposes else set())
    assert drawn(scene) == expected | {path for path, purpose in copies.items() if purpose in purposes}


def test_inactive_undefined_and_abstract_prims_are_not_drawn() -> None:
    scene = load(
        f"""
        def Mesh "off" (active = false) {{ {TRIANGLE} }}
        over Mesh "over" {{ {TRIANGLE} }}
        class Mesh "class" {{ {TRIANGLE} }}
        def "untyped" {{ def Mesh "m" {{ {TRIANGLE} }}
        }}
        """
    )
    assert drawn(scene) == {"/untyped/m"}


# --- transforms


def test_transforms_compose_as_usd_composes_them() -> None:
    body = f"""
        def Xform "a" {{
            double3 xformOp:translate = (1, 2, 3)
            float3 xformOp:rotateXYZ = (30, 40, 50)
            float3 xformOp:scale = (1, -2, 3)
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]
            def Xform "b" {{
                matrix4d xformOp:transform = ((1,0.5,0,0), (0,1,0,0), (0.25,0,1,0), (4,5,6,1))
                uniform token[] xformOpOrder = ["xformOp:transform"]
                def Mesh "m" {{ {TRIANGLE} }}
                def Mesh "reset" {{ {TRIANGLE}
                    double3 xformOp:translate = (7, 8, 9)
                    uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
                }}
            }}
        }}
    """
    stage = stage_of(body)
    scene = load_stage(stage)
    cache = UsdGeom.XformCache(0)
    for path in ("/a/b/m", "/a/b/reset"):
        expected = np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(path))).T
        np.testing.assert_allclose(placement(scene, path), expected, atol=1e-12)
    np.testing.assert_array_equal(placement(scene, "/a/b/reset")[:3, 3], [7, 8, 9])
    assert np.linalg.det(placement(scene, "/a/b/m")[:3, :3]) == pytest.approx(-6)


@pytest.mark.parametrize("scale", ["(1, 0, 1)", "(1, nan, 1)", "(1e400, 1, 1)"])
def test_a_transform_without_inverse_is_left_out_with_a_code(scale: str) -> None:
    scene = load(
        f"""
        def Xform "a" {{
            float3 xformOp:rotateXYZ = (10, 20, 30)
            float3 xformOp:scale = {scale}
            uniform token[] xformOpOrder = ["xformOp:rotateXYZ", "xformOp:scale"]
            def Mesh "m" {{ {TRIANGLE} }}
        }}
        def Mesh "good" {{ {TRIANGLE} }}
        """
    )
    assert drawn(scene) == {"/good"}
    assert codes(scene) == {"/a": "W105"}


def test_an_op_that_is_missing_or_a_place_out_of_range_costs_only_its_prim() -> None:
    scene = load(
        f"""
        def Mesh "bad" {{ {TRIANGLE}
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
        def Mesh "far" {{ {TRIANGLE}
            double3 xformOp:translate = (1e30, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
        def Mesh "good" {{ {TRIANGLE} }}
        """
    )
    assert "/good" in drawn(scene)
    assert "/far" not in drawn(scene)
    assert codes(scene)["/far"] == "W105"


@pytest.mark.parametrize(
    ("size", "scale", "is_told"),
    [(1, 1e-13, True), (1e-7, 1e-7, True), (1e-7, 1e-4, False), (1, 1e-11, False), (0, 1e-20, False)],
)
def test_what_is_smaller_than_float32_has_room_for_is_left_out(size: float, scale: float, is_told: bool) -> None:
    scene = load(
        f"""def Mesh "m" {{
            point3f[] points = [(0,0,0), ({size},0,0), (0,{size},0)]
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            double3 xformOp:scale = ({scale}, {scale}, {scale})
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }}"""
    )
    assert drawn(scene) == (set() if is_told else {"/m"})
    assert codes(scene).get("/m") == ("W105" if is_told else None)


def test_a_mesh_too_large_to_be_placed_does_not_refuse_the_others() -> None:
    scene = load(
        f"""
        def Xform "wide" (
            kind = "component"
            prepend apiSchemas = ["GeomModelAPI"]
        ) {{
            uniform token model:drawMode = "bounds"
            float3[] extentsHint = [(-1e30, -1, -1), (1e30, 1, 1)]
        }}
        def Mesh "good" {{ {TRIANGLE} }}
        """
    )
    assert codes(scene) == {"/wide": "W105"}
    assert drawn(scene) == {"/good"}
    assert place_scene(scene).mesh_origins.shape == (1, 3)


def test_transforms_are_read_at_the_time_asked_for() -> None:
    body = f"""
        def Mesh "m" {{ {TRIANGLE}
            double3 xformOp:translate = (9, 0, 0)
            double3 xformOp:translate.timeSamples = {{ 1: (1, 0, 0), 3: (3, 0, 0) }}
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }}
    """
    for options, x in (({}, 1), ({"time": 2.0}, 2), ({"time": 99.0}, 3), ({"default_time": True}, 9)):
        assert placement(load(body, **options), "/m")[0, 3] == x


# --- primvars and shapes


def test_only_constant_primvars_are_inherited_and_own_ones_win() -> None:
    scene = load(
        f"""
        def Xform "a" {{
            color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "constant")
            float[] primvars:other = [1, 2, 3] (interpolation = "vertex")
            def Mesh "plain" {{ {TRIANGLE} }}
            def Mesh "own" {{ {TRIANGLE}
                color3f[] primvars:displayColor = [(0, 1, 0)] (interpolation = "uniform")
            }}
            def Sphere "sphere" {{ }}
            def Sphere "blue" {{
                color3f[] primvars:displayColor = [(0, 0, 1)]
            }}
        }}
        def Mesh "outside" {{ {TRIANGLE} }}
        """
    )
    assert set(scene.instances.primvars) == {"displayColor"}
    row = {scene.prims[prim]: k for k, prim in enumerate(scene.instances.prim)}
    color = scene.instances.primvars["displayColor"]
    assert color[row["/a/plain"]].tolist() == [1, 0, 0]
    assert color[row["/a/sphere"]].tolist() == [1, 0, 0]
    assert color[row["/a/blue"]].tolist() == [0, 0, 1]
    assert np.isnan(color[[row["/a/own"], row["/outside"]]]).all()
    own = scene.meshes[scene.instances.mesh[row["/a/own"]]]
    assert own.primvars["displayColor"].values.tolist() == [[0, 1, 0]]


def test_a_primvar_that_is_not_constant_blocks_the_only_inherited_one() -> None:
    """As UsdGeomPrimvarsAPI.FindPrimvarWithInheritance has it."""
    body = f"""
        def Xform "a" {{
            color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "constant")
            def Xform "b" {{
                color3f[] primvars:displayColor = [(0, 0, 1)] (interpolation = "vertex")
                def Mesh "m" {{ {TRIANGLE} }}
            }}
            def Xform "c" {{
                float[] primvars:other = [1, 2, 3] (interpolation = "vertex")
                def Mesh "m" {{ {TRIANGLE} }}
            }}
        }}"""
    stage = stage_of(body)
    scene = load_stage(stage)
    color = scene.instances.primvars["displayColor"]
    assert len(scene.instances.prim) == 2
    for row, prim in enumerate(scene.instances.prim):
        own = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath(scene.prims[prim]))
        inherited = own.FindPrimvarWithInheritance("displayColor")
        expected = inherited.Get()[0] if inherited else [np.nan] * 3
        np.testing.assert_array_equal(color[row], expected)


@pytest.mark.parametrize(
    ("value", "indices", "expected", "code"),
    [
        ("(1, 0, 0), (0, 1, 0)", "[1]", (0, 1, 0), None),
        ("(1, 0, 0)", "[0]", (1, 0, 0), None),
        ("(1, 0, 0), (0, 1, 0)", "[1, 0]", (0, 1, 0), "W106"),
        ("(1, 0, 0), (0, 1, 0)", "", (1, 0, 0), "W106"),
        ("(1, 0, 0), (0, 1, 0)", "[]", None, "W106"),
        ("(1, 0, 0), (0, 1, 0)", "[2]", None, "W107"),
    ],
)
def test_constants_are_looked_up_by_their_index(value: str, indices: str, expected: tuple, code: str | None) -> None:
    primvar = f'color3f[] primvars:displayColor = [{value}] (interpolation = "constant")\n'
    primvar += f"int[] primvars:displayColor:indices = {indices}\n" if indices else ""
    scene = load(f'def Xform "a" {{ {primvar}\ndef Mesh "m" {{ {TRIANGLE} }}\n}}\ndef Sphere "s" {{ {primvar}\n}}')
    values = scene.instances.primvars.get("displayColor", np.full((2, 3), np.nan))
    for row in range(2):
        np.testing.assert_array_equal(values[row], (np.nan,) * 3 if expected is None else expected)
    told = {(record.code, record.prim) for record in scene.diagnostics if record.is_warning}
    assert told == ({(code, "/a"), (code, "/s")} if code else set())


def test_a_thousand_spheres_are_one_mesh() -> None:
    spheres = "\n".join(f'def Sphere "s{k}" {{ double radius = {k + 1}\n }}' for k in range(1000))
    scene = load(spheres)
    assert len(scene.meshes) == 1
    assert len(scene.instances) == 1000
    np.testing.assert_allclose(scene.bounds(), [[-1000] * 3, [1000] * 3], rtol=1e-6)


# --- materials, lights, cameras, labels


def test_subsets_bind_their_own_material_and_the_rest_the_meshs() -> None:
    scene = load(
        """
        def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {
            point3f[] points = [(0,0,0), (1,0,0), (0,1,0)]
            int[] faceVertexCounts = [3, 3]
            int[] faceVertexIndices = [0, 1, 2, 0, 2, 1]
            rel material:binding = </A>
            def GeomSubset "half" (prepend apiSchemas = ["MaterialBindingAPI"]) {
                uniform token elementType = "face"
                uniform token familyName = "materialBind"
                int[] indices = [1]
                rel material:binding = </B>
            }
        }
        """
        + "".join(
            f"""
            def Material "{name}" {{
                token outputs:surface.connect = </{name}/s.outputs:surface>
                def Shader "s" {{
                    uniform token info:id = "UsdPreviewSurface"
                    token outputs:surface
                }}
            }}
            """
            for name in "AB"
        )
    )
    mesh, instances = scene.meshes[0], scene.instances
    rows = instances.material_table[instances.material_offset[0] + mesh.material_slots]
    assert [scene.materials[row].path for row in rows] == ["/A", "/B"]


def test_lights_and_cameras_are_placed_and_pruned_like_geometry() -> None:
    scene = load(
        """
        def Xform "a" {
            double3 xformOp:translate = (1, 2, 3)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def SphereLight "light" {}
            def Camera "camera" {}
            def DistantLight "off" { token visibility = "invisible"
            }
        }
        def DomeLight "dome" { token purpose = "guide"
        }
        """
    )
    assert [light.path for light in scene.lights] == ["/a/light"]
    assert scene.lights[0].world_from_light[:3, 3].tolist() == [1, 2, 3]
    assert [dome.path for dome in scene.domes] == ["/dome"]
    assert [camera.path for camera in scene.cameras] == ["/a/camera"]
    assert scene.cameras[0].world_from_camera[:3, 3].tolist() == [1, 2, 3]


def test_semantic_labels_are_kept_by_prim() -> None:
    scene = load(
        """
        def Sphere "s" (prepend apiSchemas = ["SemanticsLabelsAPI:category"]) {
            token[] semantics:labels:category = ["ball", "toy"]
        }
        """
    )
    assert scene.labels == {"/s": {"category": ("ball", "toy")}}


def test_ids_inherit_labels_as_usd_has_it() -> None:
    stage = stage_of(
        """
        def Xform "a" (prepend apiSchemas = ["SemanticsLabelsAPI:class", "SemanticsLabelsAPI:room"]) {
            token[] semantics:labels:class = ["toy", "thing"]
            token[] semantics:labels:room = ["nursery"]
            def Sphere "ball" (prepend apiSchemas = ["SemanticsLabelsAPI:class"]) {
                token[] semantics:labels:class = ["ball", "toy"]
            }
            def Sphere "other" {}
        }
        def Sphere "ab" {}
        """
    )
    scene = load_stage(stage)
    ids = json.loads(encode_ids({"primId": scene.prims}, scene.labels))["primId"]
    for taxonomy in ("class", "room"):
        query = UsdSemantics.LabelsQuery(taxonomy, Usd.TimeCode.Default())
        for entry in ids.values():
            expected = query.ComputeUniqueInheritedLabels(stage.GetPrimAtPath(entry["path"]))
            assert set(entry.get("labels", {}).get(taxonomy, [])) == set(expected)


# --- what is not drawn yet


@pytest.mark.parametrize("kind", ["Volume", "ParticleField3DGaussianSplat"])
def test_unsupported_geometry_is_named_once_where_it_would_be_drawn(kind: str) -> None:
    scene = load(f'def {kind} "g" {{ }}\ndef {kind} "guide" {{ token purpose = "guide"\n }}')
    assert [(record.code, record.prim) for record in scene.diagnostics] == [("W130", "/g"), ("N905", "tmp.usda")]


def test_joints_without_a_skeleton_leave_the_rest_pose_and_are_named() -> None:
    scene = load(
        f"""
        def SkelRoot "root" {{
            def Skeleton "skeleton" {{ }}
            def Mesh "m" {{ {TRIANGLE}
                int[] primvars:skel:jointIndices = [0, 0, 0] (interpolation = "vertex")
            }}
            def Mesh "stiff" {{ {TRIANGLE} }}
        }}
        """
    )
    assert drawn(scene) == {"/root/m", "/root/stiff"}
    assert codes(scene) == {"/root/m": "W131"}


def test_unknown_types_count_as_what_the_stage_falls_back_to() -> None:
    """What ``fallbackPrimTypes`` names first of what USD knows: UsdPrim::IsA answers by it, too."""
    root = Usd.Stage.CreateInMemory()
    root.GetRootLayer().ImportFromString(
        """#usda 1.0
        (
            fallbackPrimTypes = {
                token[] MyBall = ["BetterBall", "Sphere"]
                token[] MyEye = ["Camera"]
                token[] MyLamp = ["SphereLight"]
                token[] MyMany = ["PointInstancer"]
                token[] MyMesh = ["Mesh"]
            }
        )
        def MyBall "ball" {
            double radius = 2
        }
        def MyEye "eye" {}
        def Scope "hidden" {
            token visibility = "invisible"
            def MyEye "eye" {}
        }
        def MyLamp "lamp" {}
        def MyMesh "mesh" {TRIANGLE}
        def MyMany "many" {
            rel prototypes = </many/ball>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(9, 0, 0), (19, 0, 0)]
            def MyBall "ball" {}
        }
        """.replace("TRIANGLE", TRIANGLE)
    )
    scene = load_stage(root)
    assert drawn(scene) == {"/ball", "/mesh", "/many/ball"}
    assert {camera.path for camera in scene.cameras} == {"/eye", "/hidden/eye"}
    assert [light.path for light in scene.lights] == ["/lamp"]
    assert codes(scene) == {}


def test_unknown_types_are_named() -> None:
    scene = load('def FancyProcedural "p" {\ndef Sphere "s" {}\n}')
    assert drawn(scene) == {"/p/s"}
    assert codes(scene) == {"/p": "N911"}


@pytest.mark.parametrize(
    ("last", "is_told"), [((0, 0, 0, 2), False), ((0, 0, 0, -0.5), False), ((0.5, 0, 0, 1), True), ((0, 0, 0, 0), True)]
)
def test_a_matrix_that_projects_is_told_and_one_that_divides_all_alike_is_affine(last: tuple, is_told: bool) -> None:
    rows = [(1, 2, 0), (0, 3, 0), (0, 0, 4), (5, 6, 7)]
    matrix = ", ".join(str((*row, end)) for row, end in zip(rows, last, strict=True))
    scene = load(
        f'def Mesh "m" {{ {TRIANGLE}\nmatrix4d xformOp:transform = ({matrix})\n'
        'uniform token[] xformOpOrder = ["xformOp:transform"]\n}'
    )
    divisor = 1.0 if is_told else last[3]
    expected = np.vstack([np.array(rows, float).T / divisor, (0, 0, 0, 1)])
    np.testing.assert_allclose(placement(scene, "/m"), expected)
    assert codes(scene) == ({"/m": "W105"} if is_told else {})


# --- limits


def test_a_stage_nested_too_deep_or_too_large_is_refused() -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.DefinePrim("/" + "/".join(f"p{k}" for k in range(300)), "Xform")
    with pytest.raises(LimitError, match=rf"^{stage.GetRootLayer().identifier}: /p0.*nested more than 256"):
        load_stage(stage)
    stage = stage_of("\n".join(f'def Sphere "s{k}" {{ }}' for k in range(20)))
    for limits in (Limits(prims=19), Limits(instances=19)):
        report = Report()
        gprims = GprimReader(Usd.TimeCode(0), MaterialReader(stage, Usd.TimeCode(0), report), report, level=0)
        with pytest.raises(LimitError):
            StageWalk(stage, Usd.TimeCode(0), frozenset({"default"}), gprims, None, report, limits).walk()


# --- values that mean nothing, and what materials miss


def test_a_visibility_and_a_purpose_that_the_schema_does_not_have_are_named_and_the_prim_is_drawn() -> None:
    scene = load('def Sphere "a" {\ntoken visibility = "hidden"\n}\ndef Sphere "b" {\ntoken purpose = "final"\n}')
    assert drawn(scene) == {"/a", "/b"}
    assert codes(scene) == {"/a": "W114", "/b": "W114"}


def test_a_stage_of_which_nothing_is_drawn_is_noted() -> None:
    """Inactive, invisible and of a purpose that is not asked for: three ways to an empty picture."""
    assert codes(load('def Sphere "a" (active = false) {\n}')) == {"tmp.usda": "N905"}
    assert codes(load('def Sphere "a" {\ntoken visibility = "invisible"\n}')) == {"tmp.usda": "N905"}
    assert codes(load('def Sphere "a" {\ntoken purpose = "guide"\n}')) == {"tmp.usda": "N905"}
    assert codes(load('def Sphere "a" {\ntoken purpose = "guide"\n}', purposes=("guide",))) == {}


@pytest.mark.parametrize(
    ("body", "is_told"),
    [
        ('uniform token[] xformOpOrder = ["xformOp:rotateZ"]', True),
        ('string xformOpOrder = "xformOp:translate"', True),
        ('uniform token[] xformOpOrder = ["!resetXformStack!", "!invert!xformOp:translate:pivot"]', True),
        (
            "float3 xformOp:translate:pivot = (1, 2, 3)\n"
            'uniform token[] xformOpOrder = ["!resetXformStack!", "!invert!xformOp:translate:pivot"]',
            False,
        ),
    ],
)
def test_operations_of_a_transform_that_are_not_there_are_named(body: str, is_told: bool) -> None:
    scene = load(f'def Sphere "s" {{\n{body}\n}}')
    assert drawn(scene) == {"/s"}
    assert codes(scene) == ({"/s": "W105"} if is_told else {})


@pytest.mark.parametrize(
    ("kind", "body", "is_told"),
    [
        ("", 'token visibility = "invisible"', True),
        ("", 'uniform token purpose = "guide"', True),
        ("", 'double3 xformOp:translate = (1, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]', True),
        ("", 'token guideVisibility = "visible"', True),
        ("Material", 'token visibility = "invisible"', True),
        ("Scope", 'double3 xformOp:translate = (1, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]', True),
        ("", "int[] faceVertexCounts = [3]\npoint3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]", True),
        ("", "point3f[] points = []", False),
        ("Scope", "point3f[] points = [(0, 0, 0)]", False),
        ("", 'token visibility = "inherited"\nuniform token purpose = "default"', False),
        ("Scope", "uniform token[] xformOpOrder = []", False),
    ],
)
def test_what_a_prim_has_no_attribute_for_is_without_effect_and_noted(kind: str, body: str, is_told: bool) -> None:
    stage = stage_of(f'def {kind} "g" {{\n{body}\ndef Mesh "m" {{ {TRIANGLE} }}\n}}')
    mesh = UsdGeom.Imageable(stage.GetPrimAtPath("/g/m"))
    assert (mesh.ComputeVisibility(), mesh.ComputePurpose()) == ("inherited", "default")
    scene = load_stage(stage)
    np.testing.assert_array_equal(placement(scene, "/g/m"), np.array(mesh.ComputeLocalToWorldTransform(0)).T)
    assert codes(scene) == ({"/g": "N924"} if is_told else {})


def test_operations_that_are_not_in_the_order_do_not_count_and_are_noted() -> None:
    ops = "double3 xformOp:translate = (1, 0, 0)\ndouble3 xformOp:translate:pivot = (0, 2, 0)\n"
    order = 'uniform token[] xformOpOrder = ["!invert!xformOp:translate:pivot"]'
    scene = load(f'def Mesh "a" {{ {TRIANGLE} {ops} }}\ndef Mesh "b" {{ {TRIANGLE} {ops}{order}\n}}')
    assert [placement(scene, path)[:3, 3].tolist() for path in ("/a", "/b")] == [[0, 0, 0], [0, -2, 0]]
    assert {record.prim: (record.code, record.message.count("xformOp:")) for record in scene.diagnostics} == {
        "/a": ("N921", 2),
        "/b": ("N921", 1),
    }


def test_operations_that_would_move_nothing_are_not_noted() -> None:
    ops = (
        "double3 xformOp:translate = (0, 0, 0)\nfloat3 xformOp:scale = (1, 1, 1)\nquatf xformOp:orient = (1, 0, 0, 0)\n"
    )
    scene = load(f'def Mesh "a" {{ {TRIANGLE} {ops} }}\ndef Mesh "b" {{ {TRIANGLE} {ops}float xformOp:rotateX = 9\n}}')
    assert [(record.prim, record.message.count("xformOp:")) for record in scene.diagnostics] == [("/b", 1)]


@pytest.mark.parametrize(
    ("schema", "code"), [("LODRootAPI", ""), ("VisibilityAPI", ""), ("ColorSpaceAPI", ""), ("ModelAPI", "")]
)
def test_applied_schemas_that_would_change_the_picture_are_named(schema: str, code: str) -> None:
    scene = load(f'def Xform "x" (prepend apiSchemas = ["{schema}"]) {{\ndef Sphere "s" {{\n}}\n}}')
    assert codes(scene) == ({"/x": code} if code else {})


API = 'prepend apiSchemas = ["MaterialBindingAPI"]'
READS = """
def Material "M" {
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness.connect = </M/R.outputs:result>
        token outputs:surface
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_KIND"
        string inputs:varname = "wear"
        float outputs:result
    }
}
"""


@pytest.mark.parametrize("interpolation", ["constant", "uniform", "vertex"])
def test_integers_are_read_as_numbers(interpolation: str) -> None:
    values = {"constant": [4], "uniform": [4], "vertex": [4, 5, 6]}[interpolation]
    mesh = (
        f'{TRIANGLE}\nrel material:binding = </M>\nint[] primvars:wear = {values} (interpolation = "{interpolation}")'
    )
    scene = load(READS.replace("KIND", "int") + f'def Mesh "m" ({API}) {{\n{mesh}\n}}')
    assert codes(scene) == {}
    np.testing.assert_array_equal(scene.meshes[0].primvars["wear"].values[:, 0], values)


@pytest.mark.parametrize(
    "primvar",
    [
        'matrix4d[] primvars:wear = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))] (interpolation = "constant")',
        'string[] primvars:wear = ["much"] (interpolation = "constant")',
        'quatf primvars:wear = (1, 0, 0, 0) (interpolation = "constant")',
        'float[] primvars:wear = [1, 2] (interpolation = "constant"\nelementSize = 2)',
    ],
)
def test_a_primvar_that_cannot_be_read_is_named_where_a_material_reads_it(primvar: str) -> None:
    for kind, body in (("Mesh", TRIANGLE), ("Sphere", "")):
        bound = f'def {kind} "m" ({API}) {{\n{body}\nrel material:binding = </M>\n{primvar}\n}}'
        assert codes(load(READS.replace("KIND", "float") + bound)) == {"/m": "W108"}
        assert codes(load(READS.replace("KIND", "float") + bound.replace("</M>", "</N>").replace("wear", "tear"))) == {
            "/m": "W310"
        }


@pytest.mark.parametrize(
    ("indices", "size", "code"),
    [("[0, 1, 2]", 3, "W106"), ("[0, 0, 0]", 3, "W108"), ("[0, 1, 3]", 3, "W108"), ("[0, 1, 1]", 2, "W106")],
)
def test_indices_tell_values_from_elements_of_several(indices: str, size: int, code: str) -> None:
    mesh = (
        f"{TRIANGLE}\nrel material:binding = </M>\n"
        f'float[] primvars:wear = [4, 5, 6] (interpolation = "vertex"\nelementSize = {size})\n'
        f"int[] primvars:wear:indices = {indices}"
    )
    scene = load(READS.replace("KIND", "float") + f'def Mesh "m" ({API}) {{\n{mesh}\n}}')
    assert codes(scene) == {"/m": code}
    if code == "W106":
        wear = scene.meshes[0].primvars["wear"]
        expected = np.array([4, 5, 6])[np.array(eval(indices))]
        np.testing.assert_array_equal(wear.values[wear.indices][0, :, 0], expected)


def _textured(readers: str, prims: str, folder: Path) -> Scene:
    image = folder / "image.png"
    PilImage.new("RGB", (2, 2)).save(image)
    return load(
        f"""
def Material "M" {{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>
        token outputs:surface
    }}
    def Shader "T" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{image.as_posix()}@
        float2 inputs:st.connect = </M/R.outputs:result>
        float3 outputs:rgb
    }}
    def Shader "R" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        {readers}
        float2 outputs:result
    }}
}}
{prims}
"""
    )


def test_a_texture_whose_coordinates_a_prim_lacks_is_noted_once_a_material(tmp_path: Path) -> None:
    varname = 'string inputs:varname = "map1"'
    bound = "rel material:binding = </M>"
    st = '[(0,0), (1,0), (0,1)] (interpolation = "vertex")'
    has = f'def Mesh "has" ({API}) {{\n{TRIANGLE}\n{bound}\ntexCoord2f[] primvars:map1 = {st}\n}}\n'
    lacks = f'def Mesh "lacks" ({API}) {{\n{TRIANGLE}\n{bound}\ntexCoord2f[] primvars:st = {st}\n}}\n'
    also = f'def Sphere "also" ({API}) {{\n{bound}\n}}\n'
    other = 'def Sphere "other" {\n}\n'
    given = (
        f'def PointInstancer "i" {{\nint[] protoIndices = [0]\npoint3f[] positions = [(0,0,0)]\n'
        f'rel prototypes = </i/p>\nfloat2[] primvars:map1 = [(0,1)] (interpolation = "vertex")\n'
        f'def Sphere "p" ({API}) {{\n{bound}\n}}\n}}\n'
    )
    inherited = (
        f'def Xform "x" {{\nfloat2[] primvars:map1 = [(0,1)] (interpolation = "constant")\n'
        f'def Sphere "s" ({API}) {{\n{bound}\n}}\n}}\n'
    )
    assert codes(_textured(varname, has + other + given + inherited, tmp_path)) == {}
    (record,) = _textured(varname, has + lacks + also + other, tmp_path).diagnostics
    assert (record.code, record.prim) == ("N912", "/M")
    assert record.message.startswith("/lacks and 1 more prim lack the primvar map1")


def test_a_primvar_of_too_few_components_is_noted_once_a_material(tmp_path: Path) -> None:
    varname = 'string inputs:varname = "map1"'
    prims = "".join(
        f'def Mesh "{name}" ({API}) {{\n{TRIANGLE}\nrel material:binding = </M>\n{values}\n}}\n'
        for name, values in (
            ("flat", 'float[] primvars:map1 = [0, 1, 0] (interpolation = "vertex")'),
            ("also", "float[] primvars:map1 = [0.5]"),
            ("whole", 'texCoord2f[] primvars:map1 = [(0,0), (1,0), (0,1)] (interpolation = "vertex")'),
        )
    )
    (record,) = _textured(varname, prims, tmp_path).diagnostics
    assert (record.code, record.prim) == ("N927", "/M")
    assert "2 components of map1, of which /flat and 1 more prim have fewer" in record.message


@pytest.mark.parametrize("value", ["", "float[] primvars:v = [3]"])
def test_connected_constants_above_geometry_are_told(value: str) -> None:
    body = f'def Xform "x" {{\nfloat[] primvars:v.connect = </y.primvars:v>\n{value}\ndef Sphere "s" {{}}\n}}\n'
    assert codes(load(body))["/x.primvars:v"] == "W112"


def test_one_may_look_through_a_camera_that_is_not_seen() -> None:
    body = """
        def Xform "rig" { token visibility = "invisible"
            double3 xformOp:translate = (1, 2, 3)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def Sphere "bulb" {}
            def SphereLight "lamp" {}
            def Camera "c" { double3 xformOp:translate = (0, 0, 4)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }
        }
    """
    scene = load(body)
    assert (len(scene.instances), len(scene.lights)) == (0, 0)
    assert [camera.path for camera in scene.cameras] == ["/rig/c"]
    np.testing.assert_array_equal(scene.cameras[0].world_from_camera[:3, 3], (1, 2, 7))


def test_one_may_look_through_cameras_of_instances_that_are_not_seen() -> None:
    """Neither the one below what is invisible in all instances, nor that of an invisible instance, is lost."""
    place = 'double3 xformOp:translate = (%s)\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'
    copies = "".join(
        f'def Xform "{name}" (inherits = </asset>\ninstanceable = true) {{\n{place % at}{more}\n}}\n'
        for name, at, more in (("a", "0, 0, 7", ""), ("b", "0, 0, 9", 'token visibility = "invisible"'))
    )
    scene = load(
        f"""
        class Xform "asset" {{
            def Sphere "ball" {{}}
            def Xform "rig" {{ token visibility = "invisible"
                {place % "0, 1, 0"}
                def Camera "c" {{}}
            }}
        }}
        {copies}
        """
    )
    assert len(scene.instances) == 1
    assert {camera.path: camera.world_from_camera[:3, 3].tolist() for camera in scene.cameras} == {
        "/a/rig/c": [0, 1, 7],
        "/b/rig/c": [0, 1, 9],
    }


# --- what USD says that no picture shows


def test_constant_normals_above_a_mesh_are_told_where_they_would_be_inherited() -> None:
    """Constant primvars are inherited (UsdGeomPrimvarsAPI), by those who have none of the name themselves."""
    scene = load(
        f"""
        def Xform "up" {{
            normal3f[] primvars:normals = [(0, 0, 1)] (interpolation = "constant")
            def Mesh "flat" {{ {TRIANGLE} }}
            def Xform "group" {{
                def Mesh "flat" {{ {TRIANGLE} }}
                def Mesh "own" {{ {TRIANGLE} normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1)]
 }}
            }}
            def Mesh "smooth" {{ {TRIANGLE.replace('"none"', '"loop"')} }}
            def Cube "box" {{ }}
        }}
        def Xform "unused" {{
            normal3f[] primvars:normals = [(0, 0, 1)] (interpolation = "constant")
            def Xform "other" {{
                normal3f[] primvars:normals = [(0, 1, 0)] (interpolation = "constant")
                def Mesh "own" {{ {TRIANGLE} normal3f[] primvars:normals = [(0, 0, 1)] (interpolation = "constant")
 }}
            }}
        }}
        def Xform "by_vertex" {{
            normal3f[] primvars:normals = [(0, 0, 1)] (interpolation = "vertex")
            def Mesh "flat" {{ {TRIANGLE} }}
        }}
        """
    )
    told = [record for record in scene.diagnostics if record.code == "W119"]
    assert [record.prim for record in told] == ["/up"]
    assert (
        told[0].message
        == "its constant primvars:normals do not count for /up/flat and 1 more, which would inherit them"
    )


@pytest.mark.parametrize(
    ("interpolation", "own", "is_told"),
    [("vertex", "", True), ("varying", "", True), ("constant", "", False), ("vertex", "float[] widths = [1]\n", False)],
)
def test_widths_by_instance_are_told_where_points_would_take_them(interpolation: str, own: str, is_told: bool) -> None:
    scene = load(
        f"""
        def PointInstancer "i" {{
            point3f[] positions = [(0, 0, 0), (3, 0, 0)]
            int[] protoIndices = [0, 0]
            rel prototypes = </i/group>
            float[] primvars:widths = [1, 2] (interpolation = "{interpolation}")
            def Xform "group" {{ def Points "p" {{
                point3f[] points = [(0, 0, 0)]
                {own}
            }}
            }}
        }}
        """
    )
    told = {record.prim: record.message for record in scene.diagnostics if record.code == "W119"}
    message = "its primvars:widths, one for each instance, do not count for /i/group/p, which would inherit them"
    assert told == ({"/i": message} if is_told else {})


def test_constant_widths_above_points_are_inherited() -> None:
    """As ``FindPrimvarWithInheritance`` finds them; through instances and instancers each copy has those above it."""
    bare = 'def Points "p" {\npoint3f[] points = [(0, 0, 0)]\n}\n'
    width = "\nfloat[] primvars:widths = [{}] (interpolation = {!r})\n".format
    positions = "point3f[] positions = [(0, 0, 0)]\nint[] protoIndices = [0]\n"
    scene = load(
        f"""
        class "leaf" {{
            def Xform "x" {{ color3f[] primvars:tint = [(1, 0, 0)] (interpolation = "constant")
                {bare}
            }}
        }}
        def Xform "up" {{ {width(2, "constant")}
            {bare}
            def Points "own" {{
                point3f[] points = [(0, 0, 0)]
                float[] widths = [3]
            }}
            def Xform "nearer" {{ {width(4, "constant")}{bare}
}}
            def Xform "hiding" {{ {width("5, 6", "vertex")}{bare}
}}
            def "copy" ( instanceable = true
                inherits = </leaf> ) {{ }}
            def PointInstancer "many" {{
                {positions} rel prototypes = [</up/many/p>]
                {bare}
            }}
        }}
        def Xform "thick" {{ {width(8, "constant")}
            def "copy" ( instanceable = true
                inherits = </leaf> ) {{ }}
            def PointInstancer "many" {{
                {positions} rel prototypes = [</up/p>]
            }}
            def PointInstancer "own" {{
                {positions}{width(10, "uniform")} rel prototypes = [</up/p>]
            }}
        }}
        def "bare" ( instanceable = true
            inherits = </leaf> ) {{ }}
        """
    )
    diameters = sorted(
        (scene.prims[prim], 2 * float(scene.meshes[mesh].radii[0, 0]))
        for prim, mesh in zip(scene.instances.prim, scene.instances.mesh, strict=True)
    )
    assert diameters == [
        ("/bare/x/p", 1),
        ("/thick/copy/x/p", 8),
        ("/up/copy/x/p", 2),
        ("/up/hiding/p", 1),
        ("/up/many/p", 2),
        ("/up/nearer/p", 4),
        ("/up/own", 3),
        ("/up/p", 2),
        ("/up/p", 2),  # of /thick/many: a prototype has what is above it, not its instancer's
        ("/up/p", 10),  # of /thick/own, which has a width for its instances
    ]
    assert {record.prim for record in scene.diagnostics if record.code == "N913"} == {"/up/hiding/p", "/bare/x/p"}


def test_variant_selections_that_select_nothing_are_noted() -> None:
    sets = 'prepend variantSets = "shape"'
    variants = 'variantSet "shape" = {\n"one" {\ndef Cube "c" {\n}\n}\n"two" {\n}\n}'
    scene = load(
        f"""
        def Xform "good" ( {sets}
            variants = {{ string shape = "one" }} ) {{\n{variants}\n}}
        def Xform "none" ( {sets}
            variants = {{ string shape = "" }} ) {{\n{variants}\n}}
        def Xform "misspelt" ( {sets}
            variants = {{ string shape = "ome" }} ) {{\n{variants}\n}}
        def Xform "group" ( kind = "group" ) {{
            def Xform "model" ( kind = "component"
                variants = {{ string look = "red" }} ) {{ }}
        }}
        def Xform "above" {{
            def Xform "no_model" {{
                def Xform "deep" ( {sets}
                    variants = {{ string shape = "three" }} ) {{\n{variants}\n}}
            }}
        }}
        """
    )
    told = {record.prim: record.message for record in scene.diagnostics if record.code == "N925"}
    assert told == {
        "/misspelt": "shape = 'ome' selects nothing: its variants are one, two",
        "/group/model": "look = 'red' is selected, but there is no such variant set",
        "/above/no_model/deep": "shape = 'three' selects nothing: its variants are one, two",
    }
    assert drawn(scene) == {"/good/c"}


def test_that_selections_are_not_looked_for_on_all_of_many_prims_is_noted_once() -> None:
    """Each of the groups is 2,001 prims; the 10,001st is not asked, nor what follows it, but a model is."""
    group = "\n".join(f'def Scope "s{k}" {{ }}' for k in range(2000))
    bad = '(variants = { string look = "red" })'
    scene = load(
        "\n".join(f'def Scope "g{k}" {{\n{group}\n}}' for k in range(6))
        + f'\ndef Scope "late" {{\ndef Scope "plain" {bad} {{ }}\n}}'
        + f'\ndef Xform "models" (kind = "group") {{\ndef Xform "m" (kind = "component"\n{bad[1:]} {{ }}\n}}'
    )
    told = [(record.code, record.prim) for record in scene.diagnostics if record.code in ("N925", "N937")]
    assert told == [("N937", "/g4/s1995"), ("N925", "/models/m")]


def test_a_camera_that_is_declared_a_light_is_a_camera_all_the_same() -> None:
    scene = load('def Camera "c" (prepend apiSchemas = ["LightAPI"]) {\n}\ndef Sphere "s" {\n}')
    assert [camera.path for camera in scene.cameras] == ["/c"]
    assert codes(scene)["/c"] == "W401"
