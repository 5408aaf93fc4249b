# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What changes with time: samples, value clips, topology, instances. Expected values are authored or USD's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

import warp_rt
from warp_rt import Renderer, RenderOptions
from warp_rt.scene import Mesh, Scene
from warp_rt.usd.motion import moves

QUAD = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def load(stage: Usd.Stage | Path, time: float, **options) -> Scene:
    return warp_rt.load_scene(stage, time=time, **options)


def height(scene: Scene) -> float:
    """Return z of the first point in the world."""
    (matrix,) = scene.instances.world_from_local
    mesh = scene.meshes[0]
    assert isinstance(mesh, Mesh)
    return float((matrix @ [*mesh.points[0].astype(float), 1])[2])


# --- samples


def moving(samples: dict[float, float], default: float | None = None) -> Usd.Stage:
    """Return a mesh whose points rise."""
    stage = Usd.Stage.CreateInMemory()
    mesh = UsdGeom.Mesh.Define(stage, "/m")
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    points = mesh.CreatePointsAttr()
    if default is not None:
        points.Set([(x, y, default) for x, y, _ in QUAD])
    for time, z in samples.items():
        points.Set([(x, y, z) for x, y, _ in QUAD], time)
    return stage


@pytest.mark.parametrize(("time", "z"), [(-5, 1), (0, 1), (5, 2), (10, 3), (99, 3)])
def test_samples_are_interpolated_and_held_at_both_ends(time: float, z: float) -> None:
    assert height(load(moving({0: 1, 10: 3}, default=7), time)) == z


def test_the_default_value_is_another_one() -> None:
    stage = moving({0: 1, 10: 3}, default=7)
    assert height(warp_rt.load_scene(stage, default_time=True)) == 7
    assert height(warp_rt.load_scene(stage)) == 1


def test_held_interpolation() -> None:
    stage = moving({0: 1, 10: 3})
    stage.SetInterpolationType(Usd.InterpolationTypeHeld)
    assert height(load(stage, 9.9)) == 1


def test_a_spline_gives_its_value() -> None:
    from pxr import Ts

    stage = moving({}, default=0)
    operation = UsdGeom.Xformable(stage.GetPrimAtPath("/m")).AddTranslateZOp(UsdGeom.XformOp.PrecisionDouble)
    spline = Ts.Spline("double")
    for time, value in ((0.0, 1.0), (10.0, 5.0)):
        spline.SetKnot(Ts.Knot(typeName="double", time=time, value=value, nextInterp=Ts.InterpLinear))
    operation.GetAttr().SetSpline(spline)
    assert height(load(stage, 5)) == 3


# --- value clips


def clipped(folder: Path, heights: dict[str, dict[float, float] | None], **metadata: object) -> Path:
    """Return a stage whose mesh takes points from clips.

    Args:
        folder: Where files go.
        heights: By clip: samples of z; None: the clip has no points.
        metadata: Of the clip set.
    """
    for name, samples in heights.items():
        layer = Sdf.Layer.CreateNew(str(folder / name))
        prim = Sdf.CreatePrimInLayer(layer, "/m")
        prim.specifier = Sdf.SpecifierOver
        if samples is not None:
            points = Sdf.AttributeSpec(prim, "points", Sdf.ValueTypeNames.Point3fArray)
            for time, z in samples.items():
                layer.SetTimeSample(points.path, time, Vt.Vec3fArray([Gf.Vec3f(x, y, z) for x, y, _ in QUAD]))
        layer.Save()
    manifest = Sdf.Layer.CreateNew(str(folder / "manifest.usda"))
    Sdf.AttributeSpec(Sdf.CreatePrimInLayer(manifest, "/m"), "points", Sdf.ValueTypeNames.Point3fArray)
    manifest.Save()
    stage = Usd.Stage.CreateNew(str(folder / "stage.usda"))
    mesh = UsdGeom.Mesh.Define(stage, "/w/m")
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    clips = Usd.ClipsAPI(mesh.GetPrim())
    clips.SetClips({"default": {"primPath": "/m", "manifestAssetPath": Sdf.AssetPath("./manifest.usda"), **metadata}})
    stage.Save()
    return folder / "stage.usda"


def explicit(heights: dict[str, dict[float, float] | None], active: list[tuple[float, float]], **more: object) -> dict:
    return {
        "assetPaths": Vt.StringArray([])
        if not heights
        else Sdf.AssetPathArray([Sdf.AssetPath(f"./{n}") for n in heights]),
        "active": Vt.Vec2dArray([Gf.Vec2d(*pair) for pair in active]),
        **more,
    }


TWO = {"a.usda": {0: 0.0, 10: 10.0}, "b.usda": {0: 100.0, 10: 110.0}}


@pytest.mark.parametrize(("time", "z"), [(-3, 0), (0, 0), (4, 4), (9.5, 9.5), (10, 100), (15, 105), (25, 110)])
def test_explicit_clips(time: float, z: float, tmp_path: Path) -> None:
    """Clip a until 10, then b from its own time 0 on."""
    times = Vt.Vec2dArray([Gf.Vec2d(*pair) for pair in ((0, 0), (10, 10), (10, 0), (20, 10))])
    file = clipped(tmp_path, TWO, **explicit(TWO, [(0, 0), (10, 1)], times=times))
    assert height(load(file, time)) == pytest.approx(z)


def test_clip_times_stretch_a_clip(tmp_path: Path) -> None:
    times = Vt.Vec2dArray([Gf.Vec2d(0, 0), Gf.Vec2d(40, 10)])
    file = clipped(tmp_path, TWO, **explicit(TWO, [(0, 0)], times=times))
    assert height(load(file, 10)) == pytest.approx(2.5)


def test_template_clips(tmp_path: Path) -> None:
    frames = {f"frame.{number:03}.usda": {number: float(number * number)} for number in (1, 2, 3)}
    template = {
        "templateAssetPath": "./frame.###.usda",
        "templateStartTime": 1.0,
        "templateEndTime": 3.0,
        "templateStride": 1.0,
    }
    file = clipped(tmp_path, frames, **template)
    assert [height(load(file, time)) for time in (1, 2, 3)] == [1, 4, 9]
    assert not any(record.code == "W501" for record in load(file, 1).diagnostics)
    for number in (1, 2, 3):
        (tmp_path / f"frame.{number:03}.usda").unlink()
    assert [record.prim for record in load(file, 1).diagnostics if record.code == "W501"] == ["/w/m"]


def test_a_clip_that_is_missing_is_told(tmp_path: Path) -> None:
    file = clipped(tmp_path, TWO, **explicit(TWO, [(0, 0), (10, 1)]))
    (tmp_path / "b.usda").unlink()
    told = [(record.prim, record.message) for record in load(file, 4).diagnostics if record.code == "W501"]
    assert told == [("/w/m", "1 value clips are missing, such as @./b.usda@: their values are left out")]


@pytest.mark.parametrize("is_instanced", [False, True])
def test_points_that_clips_alone_hold_blur(is_instanced: bool, tmp_path: Path) -> None:
    """No layer of the stage authors them, and below an instance USD does not tell that they vary."""
    times = Vt.Vec2dArray([Gf.Vec2d(0, 0), Gf.Vec2d(9, 9)])
    asset = clipped(tmp_path, TWO, **explicit(TWO, [(0, 0)], times=times))
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/i")
    prim.GetReferences().AddReference(str(asset), "/w")
    prim.SetInstanceable(is_instanced)
    assert [moves(stage, *interval) for interval in ((3.0, 4.0), (20.0, 21.0))] == [True, False]


def test_clips_on_an_instance_reach_nothing_below_it_and_that_is_told(tmp_path: Path) -> None:
    asset = Usd.Stage.CreateNew(str(tmp_path / "asset.usda"))
    mesh = UsdGeom.Mesh.Define(asset, "/a/m")
    mesh.CreateFaceVertexCountsAttr([4])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    mesh.CreatePointsAttr([(x, y, 7) for x, y, _ in QUAD])
    asset.Save()
    clip = Sdf.Layer.CreateNew(str(tmp_path / "clip.usda"))
    Sdf.AttributeSpec(Sdf.CreatePrimInLayer(clip, "/m/m"), "points", Sdf.ValueTypeNames.Point3fArray)
    clip.SetTimeSample("/m/m.points", 0.0, Vt.Vec3fArray(QUAD))
    clip.Save()
    stage = Usd.Stage.CreateNew(str(tmp_path / "stage.usda"))
    prim = stage.DefinePrim("/i")
    prim.GetReferences().AddReference("./asset.usda", "/a")
    clips = explicit({"clip.usda": None}, [(0, 0)], primPath="/m", manifestAssetPath=Sdf.AssetPath("./clip.usda"))
    Usd.ClipsAPI(prim).SetClips({"default": clips})
    for is_instanced, z, codes in ((False, 0, []), (True, 7, ["N922"])):
        prim.SetInstanceable(is_instanced)
        scene = load(stage, 0)
        assert height(scene) == z == UsdGeom.Mesh(stage.GetPrimAtPath("/i/m")).GetPointsAttr().Get(0)[0][2]
        assert [record.code for record in scene.diagnostics if record.code not in ("N901", "N902")] == codes


@pytest.mark.parametrize("is_far_first", [False, True])
def test_clips_above_a_prototype_count_whoever_repeats_it(is_far_first: bool, tmp_path: Path) -> None:
    """What clips hold of the prototype's visibility holds for instancers below the clips and elsewhere."""
    for name in ("clip.usda", "manifest.usda"):
        layer = Sdf.Layer.CreateNew(str(tmp_path / name))
        Sdf.AttributeSpec(Sdf.CreatePrimInLayer(layer, "/c/m"), "visibility", Sdf.ValueTypeNames.Token)
        if name == "clip.usda":
            layer.SetTimeSample("/c/m.visibility", 0.0, "inherited")
            layer.SetTimeSample("/c/m.visibility", 5.0, "invisible")
        layer.Save()
    stage = Usd.Stage.CreateNew(str(tmp_path / "stage.usda"))
    for path in ("/I", "/w") if is_far_first else ("/w", "/I"):
        UsdGeom.Xform.Define(stage, path)  # in the order of the walk
    clip = {"primPath": "/c", "manifestAssetPath": Sdf.AssetPath("./manifest.usda")}
    Usd.ClipsAPI(stage.GetPrimAtPath("/w")).SetClips({"default": clip | explicit({"clip.usda": None}, [(0, 0)])})
    UsdGeom.Sphere.Define(stage, "/w/m")
    for path in ("/I", "/w/I"):
        instancer = UsdGeom.PointInstancer.Define(stage, path)
        instancer.CreatePrototypesRel().SetTargets(["/w/m"])
        instancer.CreateProtoIndicesAttr([0])
        instancer.CreatePositionsAttr([(0, 0, 0)])
    stage.Save()
    file = tmp_path / "stage.usda"
    assert len(load(file, 0).instances) == 3
    assert len(load(file, 5).instances) == 0


@pytest.mark.parametrize("interpolates", [False, True])
def test_clips_that_lack_a_value(interpolates: bool, tmp_path: Path) -> None:
    """The middle one of three has no points: the manifest's fallback, or what lies between its neighbours."""
    heights = {"a.usda": {0: 2.0}, "b.usda": None, "c.usda": {20: 6.0}}
    file = clipped(
        tmp_path,
        heights,
        **explicit(heights, [(0, 0), (10, 1), (20, 2)], interpolateMissingClipValues=interpolates),
    )
    stage = Usd.Stage.Open(str(file))
    value = UsdGeom.Mesh(stage.GetPrimAtPath("/w/m")).GetPointsAttr().Get(15)
    scene = load(stage, 15)
    if interpolates:
        assert height(scene) == pytest.approx(value[0][2])
        assert 2 < height(scene) < 6
    else:
        assert value is None
        assert len(scene.instances) == 0  # and that is told
        assert {record.code for record in scene.diagnostics} >= {"N910"}


def test_clips_hold_visibility_and_transforms_that_nothing_else_authors(tmp_path: Path) -> None:
    layer = Sdf.Layer.CreateNew(str(tmp_path / "clip.usda"))
    layer.ImportFromString(
        """#usda 1.0
        over "m" {
            double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 10: (0, 0, 20) }
            token visibility.timeSamples = { 0: "inherited", 8: "invisible" }
        }
        """
    )
    layer.Save()
    (tmp_path / "stage.usda").write_text(
        """#usda 1.0
        def Xform "w" (
            clips = { dictionary default = {
                string primPath = "/m"
                asset[] assetPaths = [@./clip.usda@]
                double2[] active = [(0, 0)]
                double2[] times = [(0, 0), (10, 10)]
                asset manifestAssetPath = @./clip.usda@
            } }
        ) {
            double3 xformOp:translate
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def Mesh "m" {
                point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]
                int[] faceVertexCounts = [4]
                int[] faceVertexIndices = [0, 1, 2, 3]
            }
        }
        """
    )
    assert height(load(tmp_path / "stage.usda", 5)) == pytest.approx(10)
    assert len(load(tmp_path / "stage.usda", 9).instances) == 0


@pytest.mark.parametrize("gprim", ["Sphere", "Points", "Mesh"], ids=["shape without elements", "points", "mesh"])
def test_clips_hold_display_colors_that_nothing_else_authors(gprim: str, tmp_path: Path) -> None:
    (tmp_path / "clip.usda").write_text(
        """#usda 1.0
        over "m" {
            color3f[] primvars:displayColor.timeSamples = { 0: [(1, 0, 0)], 10: [(0, 0, 1)] }
        }
        """
    )
    (tmp_path / "stage.usda").write_text(
        f"""#usda 1.0
        def {gprim} "m" (
            clips = {{ dictionary default = {{
                string primPath = "/m"
                asset[] assetPaths = [@./clip.usda@]
                double2[] active = [(0, 0)]
                asset manifestAssetPath = @./clip.usda@
            }} }}
        ) {{
            point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]
            float[] widths = [1, 1, 1, 1]
            int[] faceVertexCounts = [4]
            int[] faceVertexIndices = [0, 1, 2, 3]
        }}
        """
    )
    scene = load(tmp_path / "stage.usda", 5)
    held = scene.meshes[0].primvars.get("displayColor")
    color = scene.instances.primvars["displayColor"] if held is None else held.values
    np.testing.assert_allclose(color[0], (0.5, 0, 0.5))


# --- topology


def test_frames_of_changing_topology_are_those_of_single_loads(tmp_path: Path) -> None:
    """Same, other and same number of faces as the frame before: refitted or built anew, the picture is the same."""
    stage = Usd.Stage.CreateInMemory()
    mesh = UsdGeom.Mesh.Define(stage, "/m")
    mesh.CreateSubdivisionSchemeAttr("none")
    for time, count in ((1, 4), (2, 4), (3, 6), (4, 3)):
        turn = 2 * np.pi * np.arange(count) / count + 0.1 * time
        points = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)), time)
        mesh.GetFaceVertexCountsAttr().Set([count], time)
        mesh.GetFaceVertexIndicesAttr().Set(list(range(count)), time)
    renderer = None
    options = RenderOptions(width=24, height=24, aovs=("color", "elementId"))
    triangles = []
    for time in (1, 2, 3, 4):
        scene = load(stage, time)
        triangles.append(scene.triangle_count)
        renderer = Renderer(scene, options, device="cpu", previous=renderer)
        alone = Renderer(scene, options, device="cpu").render()
        np.testing.assert_array_equal(renderer.render().color, alone.color)
    assert triangles == [2, 2, 4, 1]


# --- composition


def test_variants_and_payloads_decide_what_is_drawn(tmp_path: Path) -> None:
    (tmp_path / "ball.usda").write_text('#usda 1.0\n( defaultPrim = "b" )\ndef Sphere "b" {\n}\n')
    (tmp_path / "stage.usda").write_text(
        """#usda 1.0
        def Xform "w" (
            variants = { string shape = "box" }
            prepend variantSets = "shape"
        ) {
            variantSet "shape" = {
                "box" {
                    def Cube "it" {}
                }
                "ball" {
                    def "it" (payload = @./ball.usda@) {}
                }
            }
        }
        """
    )
    assert isinstance(load(tmp_path / "stage.usda", 0).meshes[0], Mesh)
    (tmp_path / "session.usda").write_text('#usda 1.0\nover "w" (variants = { string shape = "ball" }) {}\n')
    scene = load(tmp_path / "stage.usda", 0, session_layer=tmp_path / "session.usda")
    assert not isinstance(scene.meshes[0], Mesh)
    assert scene.prims == ("/w/it",)


# --- point instancers


def instancer_stage(seed: int, *, count: int = 40) -> Usd.Stage:
    """Return an instancer with everything that USD's computation of its transforms takes into account."""
    rng = np.random.default_rng(seed)

    def vectors(scale: float) -> Vt.Vec3fArray:
        return Vt.Vec3fArray.FromNumpy((scale * rng.normal(size=(count, 3))).astype(np.float32))

    stage = Usd.Stage.CreateInMemory()
    stage.SetTimeCodesPerSecond(12)
    instancer = UsdGeom.PointInstancer.Define(stage, "/w/i")
    UsdGeom.Xformable(instancer).AddTransformOp().Set(Gf.Matrix4d(Gf.Rotation((1, 2, 3), 40), (5, -3, 2)))
    for name in ("a", "b"):
        ball = UsdGeom.Cube.Define(stage, f"/w/i/{name}")
        UsdGeom.Xformable(ball).AddTranslateOp().Set(Gf.Vec3d(*rng.normal(size=3)))
        instancer.GetPrototypesRel().AddTarget(ball.GetPath())
    turns = rng.normal(size=(count, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    for time in (0.0, 24.0):
        instancer.CreateProtoIndicesAttr().Set(Vt.IntArray.FromNumpy(rng.integers(0, 2, count).astype(np.int32)), time)
        instancer.CreatePositionsAttr().Set(vectors(10), time)
        if seed % 2:
            instancer.CreateVelocitiesAttr().Set(vectors(4), time)
            instancer.CreateAngularVelocitiesAttr().Set(vectors(90), time)
            if seed % 4 == 1:
                instancer.CreateAccelerationsAttr().Set(vectors(2), time)
        instancer.CreateOrientationsfAttr().Set(Vt.QuatfArray([Gf.Quatf(*map(float, turn)) for turn in turns]), time)
        instancer.CreateScalesAttr().Set(
            Vt.Vec3fArray.FromNumpy(rng.uniform(0.5, 2, (count, 3)).astype(np.float32)), time
        )
    instancer.CreateIdsAttr([int(x) for x in rng.permutation(count) + 100])
    instancer.CreateInvisibleIdsAttr([101, 107, 250])
    instancer.DeactivateId(110)
    return stage


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("time", [-2.0, 0.0, 7.5, 24.0, 30.0])
def test_instances_stand_where_usd_computes_them(seed: int, time: float) -> None:
    stage = instancer_stage(seed)
    scene = load(stage, time)
    instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath("/w/i"))
    expected = np.array(instancer.ComputeInstanceTransformsAtTime(time, time)).transpose(0, 2, 1)
    above = np.array(UsdGeom.XformCache(time).GetLocalToWorldTransform(instancer.GetPrim())).T
    shown = np.flatnonzero(instancer.ComputeMaskAtTime(time))
    assert len(expected) == len(shown) == 37
    found = {
        scene.instance_paths[row]: m
        for row, m in zip(scene.instances.instance_id, scene.instances.world_from_local, strict=True)
    }
    assert set(found) == {f"/w/i[{index}]" for index in shown}
    for index, matrix in zip(shown, expected, strict=True):
        np.testing.assert_allclose(found[f"/w/i[{index}]"], above @ matrix, atol=2e-5)
