# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the walk draws, where, and what prims hand down: stages of a few lines against the rules of UsdGeom."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warp_rt.errors import LimitError
from warp_rt.report import Report
from warp_rt.scene import Scene
from warp_rt.usd.load import load_stage
from warp_rt.usd.materials import MaterialReader
from warp_rt.usd.walk import Limits, StageWalk

TRIANGLE = """
    point3f[] points = [(0,0,0), (1,0,0), (0,1,0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token subdivisionScheme = "none"
"""


def stage_of(body: str) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{body}\n")
    return stage


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


# --- what is not drawn yet


@pytest.mark.parametrize("kind", ["BasisCurves", "Points", "NurbsPatch", "HermiteCurves", "TetMesh", "Volume"])
def test_unsupported_geometry_is_named_once_where_it_would_be_drawn(kind: str) -> None:
    scene = load(f'def {kind} "g" {{ }}\ndef {kind} "guide" {{ token purpose = "guide"\n }}')
    assert codes(scene) == {"/g": "W130"}


def test_skinned_meshes_are_drawn_in_their_rest_pose_and_named() -> None:
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


def test_draw_modes_and_unknown_types_are_named() -> None:
    scene = load(
        f"""
        def Xform "model" (kind = "component"
            prepend apiSchemas = ["GeomModelAPI"]
        ) {{
            uniform token model:drawMode = "bounds"
            def Mesh "m" {{ {TRIANGLE} }}
        }}
        def FancyProcedural "p" {{ }}
        """
    )
    assert drawn(scene) == {"/model/m"}
    assert codes(scene) == {"/model": "W132", "/p": "N911"}


# --- limits


def test_a_stage_nested_too_deep_or_too_large_is_refused() -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.DefinePrim("/" + "/".join(f"p{k}" for k in range(300)), "Xform")
    with pytest.raises(LimitError, match="nested more than 256"):
        load_stage(stage)
    stage = stage_of("\n".join(f'def Sphere "s{k}" {{ }}' for k in range(20)))
    for limits in (Limits(prims=19), Limits(instances=19)):
        report = Report()
        materials = MaterialReader(stage, Usd.TimeCode(0), report)
        with pytest.raises(LimitError):
            StageWalk(stage, Usd.TimeCode(0), frozenset({"default"}), materials, report, limits).walk()
