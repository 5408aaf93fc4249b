# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Primvars as AOVs: every interpolation, inherited and by instance, in arrays and in files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import warp_rt
from warp_rt.cli import main as program
from warp_rt.errors import OptionError

# Seen along -Z, a unit a pixel: a square over pixels x = 0 and 1 of two rows, a square of half a unit each side about
# (3, 1) that has but what it inherits, and two copies of a triangle.
STAGE = """#usda 1.0
( renderSettingsPrimPath = "/S" )
def Camera "c"
{
    token projection = "orthographic"
    float horizontalAperture = 80
    float verticalAperture = 20
    double3 xformOp:translate = (4, 1, 9)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "m"
{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 2, 0), (1, 2, 0), (0, 2, 0)]
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 5, 1, 2, 3, 4]
    uniform token subdivisionScheme = "none"
    normal3f[] normals = [(0, 0, 2)] (interpolation = "constant")
    float[] primvars:x = [0, 1, 2, 2, 1, 0] (interpolation = "vertex")
    color3f[] primvars:tint = [(1, 0, 0), (0, 0.5, 2)] (interpolation = "uniform")
    int[] primvars:a:b = [3, 4] (interpolation = "uniform")
    int[] primvars:a:b:indices = [0, 1]
    float3[] primvars:mixed = [(1, 2, 3)] (interpolation = "constant")
    string primvars:word = "x"
}
def Xform "above"
{
    float2 primvars:mixed = (7, 8)
    def Cube "cube"
    {
        double size = 1
        double3 xformOp:translate = (3, 1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
}
def PointInstancer "i"
{
    point3f[] positions = [(4, 0, 0), (6, 0, 0)]
    int[] protoIndices = [0, 0]
    rel prototypes = </i/t>
    float[] primvars:x = [10, 20] (interpolation = "vertex")
    def Mesh "t"
    {
        point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        uniform token subdivisionScheme = "none"
        float[] primvars:x = [1, 1, 1, 1] (interpolation = "vertex")
    }
}
def RenderSettings "S" {
    rel products = </P>
    rel camera = </c>
    uniform int2 resolution = (8, 2)
}
def RenderProduct "P" {
    token productName = "p.exr"
    rel orderedVars = [</color>, </ids>, </none>]
}
def RenderVar "color" { }
def RenderVar "ids" {
    uniform string sourceName = "a:b"
    uniform token sourceType = "primvar"
}
def RenderVar "none" {
    uniform string sourceName = "gone"
    uniform token sourceType = "primvar"
}
"""


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("primvars") / "stage.usda"
    path.write_text(STAGE)
    return path


def shown(stage: Path, *names: str) -> warp_rt.Image:
    return warp_rt.render(stage, aovs=("color", *(f"primvars:{name}" for name in names)))


def test_every_interpolation_and_what_instances_say(stage: Path) -> None:
    image = shown(stage, "x", "tint", "a:b", "mixed")
    # Pixel centres lie at x = 0.5, 1.5 of the mesh, 2.5 and 3.5 (the cube's edge), 4.5 to 7.5.
    np.testing.assert_allclose(image["primvars:x"][0], [0.5, 1.5, 0, 0, 10, 10, 20, 20], atol=1e-6)
    assert image["primvars:x"].dtype == np.float32
    np.testing.assert_allclose(image["primvars:tint"][1, :3], [(1, 0, 0), (0, 0.5, 2), (0, 0, 0)], atol=1e-6)
    np.testing.assert_allclose(image["primvars:a:b"][0, :3], [3, 4, 0], atol=1e-6)
    # Of three components on the mesh and two on the cube.
    assert image["primvars:mixed"].shape == (2, 8, 3)
    np.testing.assert_allclose(image["primvars:mixed"][0, 0], (1, 2, 3))
    assert image["primvars:mixed"][0, 5].tolist() == [0, 0, 0]


def test_inherited_constants(stage: Path) -> None:
    camera = warp_rt.load_scene(stage).cameras[0]
    narrow = warp_rt.scene.Camera(
        "/own", camera.world_from_camera, window=(-1.4, -0.6, -0.4, 0.4), is_perspective=False
    )
    renderer = warp_rt.Renderer(
        warp_rt.load_scene(stage), warp_rt.RenderOptions(width=2, height=2, aovs=("primvars:mixed",))
    )
    np.testing.assert_allclose(renderer.render(camera=narrow).aovs["primvars:mixed"], np.full((2, 2, 3), (7, 8, 0)))


def test_normals_are_as_authored_in_the_space_of_the_mesh(stage: Path) -> None:
    np.testing.assert_allclose(shown(stage, "normals")["primvars:normals"][0, 0], (0, 0, 2))


def test_what_nothing_has_is_zero_and_noted(stage: Path) -> None:
    scene = warp_rt.load_scene(stage)
    renderer = warp_rt.Renderer(scene, warp_rt.RenderOptions(aovs=("primvars:gone", "primvars:x")))
    film = renderer.render()
    assert not film.aovs["primvars:gone"].any()
    assert [d.message for d in renderer.diagnostics if d.code == "N933"] == [
        "nothing that is drawn has the AOV primvars:gone: 0 everywhere"
    ]


@pytest.mark.parametrize("aov", ["primvars:", "primvars", "primvars:a/b", "primvars:1a", "primvars:a:", "primvar:x"])
def test_what_is_no_name_of_a_primvar_is_no_aov(aov: str) -> None:
    with pytest.raises(OptionError, match=f"aov: '{aov}'|aov"):
        warp_rt.RenderOptions(aovs=(aov,))


def test_files_hold_them(stage: Path, capfd: pytest.CaptureFixture) -> None:
    names = "color,primvars:x,primvars:tint,primvars:a:b"
    exr, png = stage.with_name("a.exr"), stage.with_name("b.png")
    assert program.main(["render", str(stage), "-o", str(exr), "--aov", names, "-q"]) == 0
    channels = OpenEXR.File(str(exr), separate_channels=True).channels()
    tint = {f"primvars:tint.{component}" for component in "RGB"}
    assert set(channels) == {"R", "G", "B", "A", "primvars:x.X", "primvars:a:b.X", *tint}
    np.testing.assert_allclose(channels["primvars:tint.B"].pixels[0, :3], [0, 2, 0], atol=1e-6)
    capfd.readouterr()
    assert program.main(["render", str(stage), "-o", str(png), "--aov", names, "-q", "--json"]) == 0
    outputs = [Path(output).name for output in json.loads(capfd.readouterr().out)["outputs"]]
    assert outputs == ["b.png", "b.primvars_x.npy", "b.primvars_tint.npy", "b.primvars_a_b.npy"]
    np.testing.assert_allclose(np.load(stage.with_name("b.primvars_x.npy"))[0, :2], [0.5, 1.5], atol=1e-6)


def test_render_vars_hold_them(stage: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(stage.parent)
    assert program.main(["render", str(stage), "--product", "P", "-q"]) == 0
    channels = OpenEXR.File("p.exr", separate_channels=True).channels()
    assert {name for name in channels if name not in "RGBA"} == {"ids.X", "none.X"}
    np.testing.assert_allclose(channels["ids.X"].pixels[0, :3], [3, 4, 0], atol=1e-6)
    assert not channels["none.X"].pixels.any()


def test_of_a_shape_that_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "flat.usda").write_text("""#usda 1.0
def Cube "c"
{
    color3f[] primvars:displayColor = [(0.7, 0.4, 0.2)]
    double3 xformOp:scale = (1e-30, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"]
}
""")
    image = warp_rt.render(tmp_path / "flat.usda", width=4, device="cpu", aovs=("color", "primvars:displayColor"))
    assert not image.alpha.any()
    assert "W105" in {told.code for told in image.film.diagnostics}
