# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Skeletons and blend shapes against closed forms, and against the points and normals that USD itself bakes."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel

from warp_rt.scene import Scene, Shapes
from warp_rt.usd.load import load_stage

from ..data import find_test_data

# An arm along x: a shoulder at the origin and an elbow at x = 1, which the animation bends by 90 degrees about z.
# The skeleton stands at y = 5 and the mesh at z = 3, so that neither space is the world's.
ARM = """
def SkelRoot "root" {{
    def Skeleton "skeleton" (prepend apiSchemas = ["SkelBindingAPI"]) {{
        uniform token[] joints = ["shoulder", "shoulder/elbow"]
        uniform matrix4d[] bindTransforms = [
            ((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1)), ((1,0,0,0), (0,1,0,0), (0,0,1,0), (1,0,0,1))]
        uniform matrix4d[] restTransforms = [
            ((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1)), ((1,0,0,0), (0,1,0,0), (0,0,1,0), (1,0,0,1))]
        rel skel:animationSource = </root/bent>
        double3 xformOp:translate = (0, 5, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
    def SkelAnimation "bent" {{
        uniform token[] joints = ["shoulder/elbow"]
        quatf[] rotations = [(0.70710678, 0, 0, 0.70710678)]
        float3[] translations = [(1, 0, 0)]
        half3[] scales = [(1, 1, 1)]
        uniform token[] blendShapes = ["lift", "grow"]
        float[] blendShapeWeights = [{lift}, 0]
    }}
    {prim}
}}
"""
QUAD = """
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 0, 1), (0, 0, 1)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
"""
BOUND = 'prepend apiSchemas = ["SkelBindingAPI"]'
JOINTS = """
    rel skel:skeleton = </root/skeleton>
    int[] primvars:skel:jointIndices = [0, 1, 1, 0] (elementSize = 1
        interpolation = "vertex")
    float[] primvars:skel:jointWeights = [1, 1, 1, 1] (elementSize = 1
        interpolation = "vertex")
    matrix4d primvars:skel:geomBindTransform = ((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1))
"""
SHAPES = """
    rel skel:skeleton = </root/skeleton>
    uniform token[] skel:blendShapes = ["lift"]
    rel skel:blendShapeTargets = </root/m/lift>
    def BlendShape "lift" {
        uniform int[] pointIndices = [1, 2]
        uniform vector3f[] offsets = [(0, 4, 0), (0, 4, 0)]
        uniform vector3f[] normalOffsets = [(3, 0, 0), (3, 0, 0)]
        uniform vector3f[] inbetweens:half = [(0, 1, 0), (0, 1, 0)] (weight = 0.5)
        uniform vector3f[] inbetweens:half:normalOffsets = [(1, 0, 0), (1, 0, 0)]
    }
"""


def stage_of(prim: str, lift: float = 0.0) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString("#usda 1.0\n" + ARM.format(prim=prim, lift=lift))
    return stage


def world_points(scene: Scene, row: int = 0) -> np.ndarray:
    matrix = scene.instances.world_from_local[row]
    return scene.meshes[scene.instances.mesh[row]].points @ matrix[:3, :3].T + matrix[:3, 3]


def test_points_turn_about_their_joint() -> None:
    place = 'double3 xformOp:translate = (0, 0, 3)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {JOINTS} {place}\n}}'))
    # The far side turns about (1, 0) in the skeleton's space, wherever the mesh itself stands.
    expected = [(0, 5, 0), (1, 6, 0), (1, 6, 1), (0, 5, 1)]
    np.testing.assert_allclose(world_points(scene), expected, atol=1e-6)
    assert [record.code for record in scene.diagnostics if record.code == "W131"] == []


@pytest.mark.parametrize("interpolation", ["vertex", "faceVarying"])
def test_normals_turn_with_their_joint(interpolation: str) -> None:
    normals = f'normal3f[] normals = [(0,1,0), (0,1,0), (0,1,0), (0,1,0)] (interpolation = "{interpolation}")'
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {JOINTS} {normals}\n}}'))
    mesh = scene.meshes[0]
    found = mesh.normals.values[mesh.normals.indices]
    expected = np.array([(0, 1, 0), (-1, 0, 0), (-1, 0, 0), (0, 1, 0)])[mesh.triangles]
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize(("weight", "height", "tilt"), [(0.0, 0, 0), (0.25, 0.5, 0.5), (0.5, 1, 1), (1.0, 4, 3)])
def test_blend_shapes_go_by_way_of_their_in_betweens(weight: float, height: float, tilt: float) -> None:
    """Linear from the rest pose to the in-between at 0.5, and from there to the shape: UsdSkelBlendShape."""
    normals = 'normal3f[] normals = [(0,1,0), (0,1,0), (0,1,0), (0,1,0)] (interpolation = "vertex")'
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {SHAPES} {normals}\n}}', lift=weight))
    np.testing.assert_allclose(world_points(scene)[:, 1], [0, height, height, 0], atol=1e-6)
    np.testing.assert_allclose(scene.meshes[0].normals.values[1] * 1.0, (tilt, 1, 0), atol=1e-6)


def test_a_prim_with_constant_influences_moves_as_a_whole() -> None:
    joints = JOINTS.replace("[0, 1, 1, 0]", "[1]").replace("[1, 1, 1, 1]", "[1]").replace('"vertex"', '"constant"')
    for prim in (f'def Mesh "m" ({BOUND}) {{ {QUAD} {joints}\n}}', f'def Cube "m" ({BOUND}) {{ {joints}\n}}'):
        matrix = load_stage(stage_of(prim)).instances.world_from_local[0]
        image = matrix[:3, :3] @ (2, 0, 0) + matrix[:3, 3]
        scale = 1 if "Mesh" in prim else np.linalg.norm(matrix[:3, 0])  # a unit cube is scaled to its size
        expected = (1, 5 + 2 * scale - 1, 0)
        np.testing.assert_allclose(image, expected, atol=1e-6)


def test_a_light_moves_with_the_mesh_that_shines() -> None:
    joints = JOINTS.replace("[0, 1, 1, 0]", "[1]").replace("[1, 1, 1, 1]", "[1]").replace('"vertex"', '"constant"')
    shining = BOUND.replace("]", ', "MeshLightAPI"]')
    scene = load_stage(stage_of(f'def Mesh "m" ({shining}) {{ {QUAD} {joints}\nfloat inputs:intensity = 1\n}}'))
    (light,) = scene.lights
    np.testing.assert_array_equal(light.world_from_light, scene.instances.world_from_local[0])
    corners = light.triangles @ light.world_from_light[:3, :3].T + light.world_from_light[:3, 3]
    np.testing.assert_allclose(corners, world_points(scene)[scene.meshes[0].triangles], atol=1e-6)
    assert np.abs(light.world_from_light[:3, :3] - np.eye(3)).max() > 0.9


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        ("RectLight", ""),
        (
            "PointInstancer",
            """point3f[] positions = [(0, 0, 0)]
            int[] protoIndices = [0]
            rel prototypes = </root/m/p>
            def Mesh "p" { point3f[] points = [(0,0,0), (1,0,0), (0,1,0)]
                int[] faceVertexCounts = [3]
                int[] faceVertexIndices = [0, 1, 2]
            }
            """,
        ),
    ],
)
def test_lights_and_instancers_may_be_moved_as_a_whole_too(kind: str, body: str) -> None:
    """As UsdSkel.BakeSkinning does it: what can be skinned is whatever is a Boundable."""
    joints = JOINTS.replace("[0, 1, 1, 0]", "[1]").replace("[1, 1, 1, 1]", "[1]").replace('"vertex"', '"constant"')
    stage = stage_of(f'def {kind} "m" ({BOUND}) {{ {joints}\n{body}\n}}')
    scene = load_stage(stage)
    found = scene.lights[0].world_from_light if scene.lights else scene.instances.world_from_local[0]
    assert UsdSkel.BakeSkinning(UsdSkel.Root(stage.GetPrimAtPath("/root")))
    baked = UsdGeom.XformCache(0).GetLocalToWorldTransform(stage.GetPrimAtPath("/root/m"))
    np.testing.assert_allclose(found, np.array(baked).T, atol=1e-6)


def test_instances_have_their_own_pose() -> None:
    """The animation is inherited from above the instance, so that one prototype stands in two poses."""
    source = stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {JOINTS}\n}}')
    stage = Usd.Stage.CreateInMemory()
    assert Sdf.CopySpec(source.GetRootLayer(), "/root", stage.GetRootLayer(), "/shared")
    assert Sdf.CopySpec(source.GetRootLayer(), "/root/bent", stage.GetRootLayer(), "/bent")
    shared = stage.GetPrimAtPath("/shared")
    shared.SetSpecifier(Sdf.SpecifierClass)
    shared.GetChild("skeleton").RemoveProperty("skel:animationSource")
    for name in ("straight", "curved"):
        prim = stage.DefinePrim(f"/{name}")
        prim.GetReferences().AddInternalReference("/shared")
        prim.SetInstanceable(True)
    UsdGeom.Xformable(stage.GetPrimAtPath("/curved")).AddTranslateOp(opSuffix="more").Set((0, 0, 7))
    binding = UsdSkel.BindingAPI.Apply(stage.GetPrimAtPath("/curved"))
    binding.CreateAnimationSourceRel().SetTargets(["/bent"])
    scene = load_stage(stage)
    ends = {scene.prims[scene.instances.prim[row]]: world_points(scene, row)[1] for row in range(2)}
    np.testing.assert_allclose(ends["/straight/m"], (2, 5, 0), atol=1e-6)
    np.testing.assert_allclose(ends["/curved/m"], (1, 6, 7), atol=1e-6)


def test_influences_that_do_not_fit_are_told() -> None:
    broken = JOINTS.replace("[0, 1, 1, 0]", "[0, 1, 7, 0]")
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {broken}\n}}'))
    assert ("W131", "/root/m") in [(record.code, record.prim) for record in scene.diagnostics]
    np.testing.assert_allclose(world_points(scene)[1], (2, 0, 0), atol=1e-6)


@pytest.mark.filterwarnings("error")
def test_influences_that_are_not_finite_are_told_in_one_voice() -> None:
    broken = JOINTS.replace("[1, 1, 1, 1]", "[1, inf, 1, 1]")
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {broken}\n}}'))
    assert ("W103", "/root/m") in [(record.code, record.prim) for record in scene.diagnostics]


def test_what_stands_below_no_skel_root_is_not_skinned_and_told() -> None:
    """A SkelRoot is "a scope beneath which skeletally-posed primitives are defined"."""
    stage = Usd.Stage.CreateInMemory()
    mesh = f'def Mesh "m" ({BOUND}) {{ {QUAD} {JOINTS}\n}}'
    assert stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{ARM.format(lift=0, prim='')}\n{mesh}")
    scene = load_stage(stage)
    assert ("W131", "/m") in [(record.code, record.prim) for record in scene.diagnostics]
    np.testing.assert_allclose(world_points(scene)[1], (2, 0, 0), atol=1e-6)


def test_prototypes_of_an_instancer_below_a_skel_root_are_told_not_to_be_skinned() -> None:
    """UsdSkel.BakeSkinning leaves them, too."""
    prim = f"""def PointInstancer "i" {{
        point3f[] positions = [(0, 0, 0)]
        int[] protoIndices = [0]
        rel prototypes = </root/i/m>
        def Mesh "m" ({BOUND}) {{ {QUAD} {JOINTS}\n}}\n}}"""
    scene = load_stage(stage_of(prim))
    assert ("W131", "/root/i/m") in [(record.code, record.prim) for record in scene.diagnostics]
    baked = stage_of(prim)
    UsdSkel.BakeSkinning(UsdSkel.Root(baked.GetPrimAtPath("/root")))
    np.testing.assert_array_equal(world_points(scene), UsdGeom.Mesh.Get(baked, "/root/i/m").GetPointsAttr().Get())


@pytest.mark.parametrize("name", ["lbs.usda", "dqs.usda", "blendshapes.usda", "blendshapesWithNormals.usda"])
@pytest.mark.parametrize("time", [5.0, 11.0])
def test_real_rigs_are_what_usd_bakes(name: str, time: float) -> None:
    corpora = find_test_data("corpora")
    if corpora is None:
        pytest.skip("WARP_RT_TEST_DATA: no corpora")
    path = corpora / "OpenUSD/pxr/usd/usdSkel/testenv/testUsdSkelBakeSkinning" / name
    scene = load_stage(Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(path))), time=time)
    baked = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(path)))
    for prim in baked.Traverse():
        if prim.IsA(UsdSkel.Root):
            assert UsdSkel.BakeSkinning(UsdSkel.Root(prim), Gf.Interval(time, time))
    expected = load_stage(baked, time=time)
    assert len(scene.instances.prim) == len(expected.instances.prim) > 0
    for row, other in enumerate(expected.instances.prim):
        assert scene.prims[scene.instances.prim[row]] == expected.prims[other]
        np.testing.assert_allclose(world_points(scene, row), world_points(expected, row), atol=2e-5)
        if isinstance(scene.meshes[scene.instances.mesh[row]], Shapes):
            continue
        found, wanted = (s.meshes[s.instances.mesh[row]].normals for s in (scene, expected))
        assert (found is None) == (wanted is None)
        if found is not None:
            found, wanted = (_unit(normals.values[normals.indices]) for normals in (found, wanted))
            np.testing.assert_allclose(found, wanted, atol=2e-4)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_the_stage_is_left_as_it_was() -> None:
    stage = stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {JOINTS}\n}}')
    before = stage.GetRootLayer().ExportToString()
    load_stage(stage)
    assert stage.GetRootLayer().ExportToString() == before
    assert tuple(UsdGeom.Mesh(stage.GetPrimAtPath("/root/m")).GetPointsAttr().Get()[1]) == (2, 0, 0)


@pytest.mark.parametrize(
    ("kind", "interpolation", "count", "at_ends"),
    [
        ("linear", "vertex", 4, True),
        ("linear", "varying", 4, True),
        ("linear", "uniform", 1, True),
        ("linear", "constant", 1, True),
        ("cubic", "vertex", 4, True),
        ("cubic", "varying", 2, True),
        ("bspline", "varying", 2, False),  # which stand at the inner points, and these at one joint each
    ],
)
def test_normals_of_ribbons_turn_with_their_joints(kind: str, interpolation: str, count: int, at_ends: bool) -> None:
    """A strand along x: its far half turns by 90 degrees about z, and with it normals that are along y."""
    basis = 'uniform token basis = "bspline"' if kind == "bspline" else ""
    strand = f"""
        uniform token type = "{"linear" if kind == "linear" else "cubic"}"
        {basis}
        point3f[] points = [(0, 0, 0), (0.5, 0, 0), (1.5, 0, 0), (2, 0, 0)]
        int[] curveVertexCounts = [4]
        float[] widths = [0.1] (interpolation = "constant")
        normal3f[] normals = [{", ".join(["(0, 1, 0)"] * count)}] (interpolation = "{interpolation}")
        {JOINTS.replace("[0, 1, 1, 0]", "[0, 0, 1, 1]")}
    """
    scene = load_stage(stage_of(f'def BasisCurves "m" ({BOUND}) {{ {strand}\n}}'))
    mesh = scene.meshes[0]
    normals = mesh.normals.values
    sides = np.abs(np.diff(mesh.points.reshape(-1, 2, 3), axis=1)[[0, -1], 0])
    if at_ends:  # the strand runs along x, then along y; normals are y, then -x, and across both is z
        np.testing.assert_allclose(normals[[0, -1]], [(0, 1, 0), (-1, 0, 0)], atol=1e-6)
        np.testing.assert_allclose(sides, [(0, 0, 0.1)] * 2, atol=1e-6)
    else:  # y and -x without their part along the tangents, which are those of (0, 0), (1/2, 0), (1, 1/2), (1, 1)
        np.testing.assert_allclose(normals[[0, -1]], np.array([(-1, 2, 0), (-2, 1, 0)]) / 5**0.5, atol=1e-6)


@pytest.mark.parametrize("interpolation", ["vertex", "varying", "faceVarying"])
def test_each_point_of_a_ribbon_has_its_own_normal_in_a_pose(interpolation: str) -> None:
    """A strand along x whose joint stays where it is: its normals are those that it is given."""
    strand = f"""
        uniform token type = "linear"
        point3f[] points = [(0, 0, 0), (0.5, 0, 0), (1.5, 0, 0), (2, 0, 0)]
        int[] curveVertexCounts = [4]
        float[] widths = [0.1] (interpolation = "constant")
        normal3f[] normals = [(0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, -1)] (interpolation = "{interpolation}")
        {JOINTS.replace("[0, 1, 1, 0]", "[0, 0, 0, 0]")}
    """
    mesh = load_stage(stage_of(f'def BasisCurves "m" ({BOUND}) {{ {strand}\n}}')).meshes[0]
    for x, normal in ((0, (0, 1, 0)), (0.5, (0, 0, 1)), (1.5, (0, -1, 0)), (2, (0, 0, -1))):
        at = np.flatnonzero(np.abs(mesh.points.reshape(-1, 2, 3)[:, 0, 0] - x) < 1e-6)
        np.testing.assert_allclose(mesh.normals.values[at], [normal] * len(at), atol=1e-6)
        assert len(at) > 0


def test_normals_of_a_patch_that_joints_bend_are_its_own_and_that_is_told() -> None:
    patch = """
        int uVertexCount = 2
        int vVertexCount = 2
        int uOrder = 2
        int vOrder = 2
        double[] uKnots = [0, 0, 1, 1]
        double[] vKnots = [0, 0, 1, 1]
        point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 0, 1), (0, 0, 1)]
        normal3f[] normals = [(0, 1, 0), (0, 1, 0), (0, 1, 0), (0, 1, 0)]
    """
    for joints, told in (("", []), (JOINTS, ["N915"])):
        scene = load_stage(stage_of(f'def NurbsPatch "m" ({BOUND}) {{ {patch} {joints}\n}}'))
        assert [record.code for record in scene.diagnostics if record.prim == "/root/m"] == told


def test_influences_of_curves_that_do_not_fit_are_told_too() -> None:
    strand = """
        point3f[] points = [(0, 0, 0), (2, 0, 0)]
        int[] curveVertexCounts = [2]
        uniform token type = "linear"
        float[] widths = [1] (interpolation = "constant")
    """
    fitting = JOINTS.replace("[0, 1, 1, 0]", "[0, 1]").replace("[1, 1, 1, 1]", "[1, 1]")
    for joints, end, codes in ((fitting, (1, 6, 0), set()), (fitting.replace("[0, 1]", "[0, 7]"), (2, 0, 0), {"W131"})):
        scene = load_stage(stage_of(f'def BasisCurves "m" ({BOUND}) {{ {strand} {joints}\n}}'))
        np.testing.assert_allclose(world_points(scene)[0, 1], end, atol=1e-6)
        assert {record.code for record in scene.diagnostics if record.code[0] == "W"} == codes


@pytest.mark.parametrize("is_rigid", [False, True])
def test_a_constant_normal_turns_with_the_joints_of_each_point(is_rigid: bool) -> None:
    joints = JOINTS.replace("[0, 1, 1, 0]", "[1]").replace("[1, 1, 1, 1]", "[1]").replace('"vertex"', '"constant"')
    normals = 'normal3f[] normals = [(0, 0.6, 0.8)] (interpolation = "constant")'
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {joints if is_rigid else JOINTS} {normals}\n}}'))
    mesh = scene.meshes[0]
    rows = mesh.normals.indices if mesh.normals.indices is not None else np.zeros_like(mesh.triangles)
    found = mesh.normals.values[rows] @ np.linalg.inv(scene.instances.world_from_local[0][:3, :3])
    turned, still = (-0.6, 0, 0.8), (0, 0.6, 0.8)  # by 90 degrees about z, and not
    expected = np.array([turned if is_rigid else still, turned, turned, turned if is_rigid else still])[mesh.triangles]
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_normals_of_a_joint_that_the_skeleton_lacks_turn_as_its_points_do() -> None:
    """The third point is weighed by the joint that is not there: what USD lets it be, it is for both."""
    named = 'uniform token[] skel:joints = ["shoulder", "gone"]\n'
    normals = 'normal3f[] normals = [(0,1,0), (0,1,0), (0,1,0), (0,1,0)] (interpolation = "vertex")'
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {JOINTS} {named} {normals}\n}}'))
    assert ("W131", "/root/m") in [(record.code, record.prim) for record in scene.diagnostics]
    along = world_points(scene)[2] - world_points(scene)[0]
    is_turned = not np.allclose(along, (2, 0, 1))
    np.testing.assert_allclose(scene.meshes[0].normals.values[2], (-1, 0, 0) if is_turned else (0, 1, 0), atol=1e-6)


@pytest.mark.parametrize(
    ("body", "rig", "told"),
    [
        (SHAPES.replace("rel skel:skeleton = </root/skeleton>", ""), ("", ""), "/root/m"),
        (SHAPES.replace("[1, 2]", "[1, 9]"), ("", ""), "/root/m"),
        (SHAPES.replace("[1, 2]", "[1, 2, 3]"), ("", ""), "/root/m"),
        (SHAPES.replace('skel:blendShapes = ["lift"]', 'skel:blendShapes = ["lift", "grow"]'), ("", ""), "/root/m"),
        (SHAPES, ('["lift", "grow"]', '["lift", "grow", "sink"]'), "/root/m"),
        (JOINTS, ("half3[] scales = [(1, 1, 1)]", ""), "/root/skeleton"),
        (JOINTS, ('"skeleton" (prepend apiSchemas = ["SkelBindingAPI"])', '"skeleton"'), "/root/skeleton"),
        (JOINTS, ("animationSource = </root/bent>", "animationSource = </root/gone>"), "/root/skeleton"),
        (JOINTS + 'uniform token[] skel:joints = ["elbow", "shoulder/elbow"]', ("", ""), "/root/m"),
        (
            JOINTS.replace(
                "matrix4d primvars:skel:geomBindTransform", "string primvars:skel:geomBindTransform"
            ).replace("((1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1))", '"here"'),
            ("", ""),
            "/root/m",
        ),
        (
            JOINTS,
            ('uniform token[] joints = ["shoulder/elbow"]', 'uniform string[] joints = ["shoulder/elbow"]'),
            "/root/bent",
        ),
        (SHAPES.replace("uniform vector3f[] offsets = [(0, 4, 0), (0, 4, 0)]", ""), ("", ""), "/root/m/lift"),
        (SHAPES.replace("normalOffsets = [(3, 0, 0)", "normalOffsets = [(nan, 0, 0)"), ("", ""), "/root/m/lift"),
        (SHAPES, ("", ""), None),
        (JOINTS, ("", ""), None),
    ],
)
def test_what_does_not_fit_a_rig_is_told(body: str, rig: tuple[str, str], told: str | None) -> None:
    text = ARM.format(prim=f'def Mesh "m" ({BOUND}) {{ {QUAD} {body}\n}}', lift=1.0).replace(*rig)
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString("#usda 1.0\n" + text)
    prims = [record.prim for record in load_stage(stage).diagnostics if record.code == "W131"]
    assert prims == ([told] if told else [])


@pytest.mark.parametrize("kind", ["Sphere", "RectLight", "PointInstancer"])
def test_what_is_no_mesh_of_points_is_told_not_to_bend(kind: str) -> None:
    stage = stage_of(f'def {kind} "m" ({BOUND}) {{ {JOINTS}\n}}')
    assert [str(record.prim) for record in load_stage(stage).diagnostics if record.code == "W131"] == ["/root/m"]


def test_a_target_that_is_no_blend_shape_is_told() -> None:
    body = SHAPES.replace("= </root/m/lift>", "= </root/gone>")
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {body}\n}}', lift=1.0))
    np.testing.assert_array_equal(world_points(scene)[:, 1], 0)
    assert [record.prim for record in scene.diagnostics if record.code == "W131"] == ["/root/m"]


def test_blend_shapes_of_no_weight_need_no_joints() -> None:
    scene = load_stage(stage_of(f'def Mesh "m" ({BOUND}) {{ {QUAD} {SHAPES}\n}}', lift=0.0))
    assert [str(record) for record in scene.diagnostics] == []


def random_rig(seed: int, method: str) -> Usd.Stage:
    """Return a character whose mesh names some of the joints in an order of its own, with all that may deform it."""
    rng = np.random.default_rng(seed)
    stage = Usd.Stage.CreateInMemory()
    UsdSkel.Root.Define(stage, "/root")
    UsdGeom.Xformable(stage.GetPrimAtPath("/root")).AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    joints = ["a", "a/b", "a/b/c", "a/d", "a/d/e"]

    def placed(count: int, reach: float) -> list[Gf.Matrix4d]:
        rotations = (Gf.Rotation(Gf.Vec3d(*rng.normal(size=3)), rng.uniform(-60, 60)) for _ in range(count))
        return [Gf.Matrix4d(turn, Gf.Vec3d(*(reach * rng.normal(size=3)))) for turn in rotations]

    skeleton = UsdSkel.Skeleton.Define(stage, "/root/skeleton")
    UsdGeom.Xformable(skeleton).AddTransformOp().Set(placed(1, 1)[0])
    skeleton.CreateJointsAttr(joints)
    skeleton.CreateBindTransformsAttr(placed(5, 0.5))
    skeleton.CreateRestTransformsAttr(placed(5, 0.5))
    animation = UsdSkel.Animation.Define(stage, "/root/animation")
    animation.CreateJointsAttr([joints[row] for row in (3, 0, 2)])
    animation.CreateBlendShapesAttr(["wide", "unused", "tall"])
    for time in (0.0, 10.0):
        turns = [Gf.Quatf(Gf.Rotation(Gf.Vec3d(*rng.normal(size=3)), rng.uniform(-90, 90)).GetQuat()) for _ in range(3)]
        animation.CreateRotationsAttr().Set(turns, time)
        animation.CreateTranslationsAttr().Set([Gf.Vec3f(*map(float, rng.normal(size=3))) for _ in range(3)], time)
        animation.CreateScalesAttr().Set([Gf.Vec3h(*([float(rng.uniform(0.8, 1.3))] * 3)) for _ in range(3)], time)
        animation.CreateBlendShapeWeightsAttr().Set([float(w) for w in rng.uniform(-0.3, 1.2, 3)], time)
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])

    mesh = UsdGeom.Mesh.Define(stage, "/root/mesh")
    UsdGeom.Xformable(mesh).AddTransformOp().Set(placed(1, 1)[0])
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, p)) for p in rng.normal(size=(6, 3))])
    mesh.CreateFaceVertexCountsAttr([4, 3, 3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3, 2, 1, 4, 4, 1, 5])
    normals = _unit(rng.normal(size=(6, 3)))
    mesh.CreateNormalsAttr([Gf.Vec3f(*map(float, n)) for n in normals])
    mesh.SetNormalsInterpolation("vertex")
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    binding.CreateJointsAttr(["a/d/e", "a", "a/b/c"])
    binding.CreateSkinningMethodAttr(method)
    weights = rng.uniform(size=(6, 2))
    weights /= weights.sum(axis=1, keepdims=True)
    binding.CreateJointIndicesPrimvar(False, 2).Set([int(row) for row in rng.integers(0, 3, 12)])
    binding.CreateJointWeightsPrimvar(False, 2).Set([float(weight) for weight in weights.reshape(-1)])
    binding.CreateGeomBindTransformAttr(placed(1, 1)[0])
    binding.CreateBlendShapesAttr(["tall", "wide"])
    for name, rows in (("tall", [0, 4, 5]), ("wide", [1, 2])):
        shape = UsdSkel.BlendShape.Define(stage, f"/root/mesh/{name}")
        binding.CreateBlendShapeTargetsRel().AddTarget(shape.GetPath())
        shape.CreatePointIndicesAttr(rows)
        offsets = [Gf.Vec3f(*map(float, o)) for o in rng.normal(size=(len(rows), 3))]
        shape.CreateOffsetsAttr(offsets)
        shape.CreateNormalOffsetsAttr([offset * 0.2 for offset in offsets])
    between = shape.CreateInbetween("half")
    between.SetWeight(0.4)
    between.SetOffsets([offset * 0.7 for offset in offsets])
    between.CreateNormalOffsetsAttr([offset * 0.1 for offset in offsets])
    return stage


@pytest.mark.parametrize("method", ["classicLinear", "dualQuaternion"])
@pytest.mark.parametrize("seed", range(4))
def test_random_rigs_are_what_usd_bakes(seed: int, method: str) -> None:
    stage = random_rig(seed, method)
    baked = Usd.Stage.CreateInMemory()
    baked.GetRootLayer().TransferContent(stage.GetRootLayer())
    assert UsdSkel.BakeSkinning(UsdSkel.Root(baked.GetPrimAtPath("/root")), Gf.Interval(0, 10))
    for time in (0.0, 10.0):
        scene, expected = load_stage(stage, time=time), load_stage(baked, time=time)
        np.testing.assert_allclose(world_points(scene), world_points(expected), atol=2e-5)
        found, wanted = (_unit(s.meshes[0].normals.values[s.meshes[0].normals.indices]) for s in (scene, expected))
        np.testing.assert_allclose(found, wanted, atol=1e-4)


def test_a_character_may_be_hidden_for_a_while() -> None:
    body = f'{QUAD} {JOINTS}\ntoken visibility.timeSamples = {{ 0: "inherited", 5: "invisible", 8: "inherited" }}'
    stage = stage_of(f'def Mesh "m" ({BOUND}) {{ {body}\n}}')
    assert [len(load_stage(stage, time=time).instances) for time in (0, 4, 5, 7, 8)] == [1, 1, 0, 0, 1]
