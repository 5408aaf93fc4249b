# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt record``: usdrecord's flags and defaults, from file to file."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from warp_rt.cli.main import main

# A grey square before two cameras, far to the side of which stands another; "main_cam" is not the first.
STAGE = """\
#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 3
    upAxis = "Y"
)
def Xform "World"
{
    def Camera "First" { double3 xformOp:translate = (0, 0, 1000)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    CAMERA
    def Mesh "Wall" {
        point3f[] points = [(-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        uniform token subdivisionScheme = "none"
    }
    def Mesh "Other" {
        point3f[] points = [(100, 0, 0), (101, 0, 0), (101, 1, 0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
    }
    LIGHT
}
def RenderSettings "Half" { int2 resolution = (32, 16)
    rel camera = </World/First>
}
def RenderPass "Pass" { rel renderSource = </Half>
}
"""
MAIN = """def Camera "main_cam" { double3 xformOp:translate = (0, 0, 10)
        float2 clippingRange = (1, 100)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }"""
DOME = 'def DomeLight "dome" { float inputs:intensity = 1\n}'


@pytest.fixture(autouse=True)
def stage(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "wall.usda"
    path.write_text(STAGE.replace("CAMERA", MAIN).replace("LIGHT", ""))
    return path


def record(*arguments: str) -> int:
    return main(["record", *arguments, "--device", "cpu"])


def summary(capfd, *arguments: str) -> dict:
    assert record(*arguments, "--json") == 0
    return json.loads(capfd.readouterr().out)


def test_a_plain_call(stage, capfd):
    """960 wide, main_cam, a light in the camera: a wall of displayColor's default grey, 0.5, that faces it."""
    assert record("wall.usda", "a.png") == 0
    err = capfd.readouterr().err
    assert "Camera: /World/main_cam\nRenderer plugin: whitted\nRecording time code: 1\n" in err
    with Image.open("a.png") as image:
        assert image.size == (960, 700)
        pixel = np.array(image)[350, 480, :3]
    assert abs(int(pixel[0]) - round(255 * (1.055 * 0.5 ** (1 / 2.4) - 0.055))) <= 1


def test_without_main_cam_the_stage_is_framed_whatever_cameras_it_has(stage, capfd):
    stage.write_text(STAGE.replace("CAMERA", "").replace("LIGHT", ""))
    assert record("wall.usda", "a.png", "-w", "32") == 0
    assert "Camera: framed" in capfd.readouterr().err
    with Image.open("a.png") as image:
        assert np.array(image)[..., 3].any()
    assert record("wall.usda", "b.png", "-w", "32", "-cam", "First") == 0
    assert "Camera: /World/First" in capfd.readouterr().err


def test_the_camera_light_shines_beside_others_and_can_be_put_out(stage, capfd):
    light = 'def DistantLight "sun" { float inputs:intensity = 3.14159265\nfloat inputs:angle = 0\n}'
    stage.write_text(STAGE.replace("CAMERA", MAIN).replace("LIGHT", light))
    values = []
    for extra in ((), ("--disableCameraLight",)):
        assert record("wall.usda", "a.exr", "-w", "32", *extra) == 0
        import OpenEXR

        with OpenEXR.File("a.exr", separate_channels=True) as file:
            values.append(float(file.channels()["R"].pixels[11, 16]))
    capfd.readouterr()
    assert values == pytest.approx([1.0, 0.5], abs=2e-3)  # sun: 0.5 of grey, camera light as much again


def test_a_stage_without_lights_is_dark_when_the_camera_light_is_put_out(stage, capfd):
    assert record("wall.usda", "a.png", "-w", "32", "--disableCameraLight", "--json") == 0
    notes = {note["code"] for note in json.loads(capfd.readouterr().out)["notes"]}
    assert notes == {"N903", "N945"}  # N902 would be a headlight
    with Image.open("a.png") as image:
        assert not np.array(image)[..., :3].any()


def test_domes_light_but_show_only_when_asked(stage, capfd):
    stage.write_text(STAGE.replace("CAMERA", MAIN.replace("10)", "100)")).replace("LIGHT", DOME))
    alphas = []
    for extra in ((), ("--enableDomeLightVisibility",)):
        assert record("wall.usda", "a.png", "-w", "32", *extra) == 0
        with Image.open("a.png") as image:
            alphas.append(np.array(image.convert("RGBA"))[0, 0, 3])
    assert alphas == [0, 255]


def test_color_modes(stage, capfd):
    assert record("wall.usda", "a.png", "-w", "32", "-color", "disabled") == 0
    with Image.open("a.png") as image:
        assert abs(int(np.array(image)[11, 16, 0]) - 128) <= 1
    assert record("wall.usda", "b.png", "-w", "32", "--colorCorrectionMode", "openColorIO") == 2
    assert "openColorIO is not supported" in capfd.readouterr().err


def test_frames_need_a_placeholder_and_it_needs_them(stage, capfd):
    assert record("wall.usda", "a.###.png", "-w", "8", "-f", "1:3x2") == 0
    assert sorted(path.name for path in stage.parent.glob("*.png")) == ["a.001.png", "a.003.png"]
    for arguments in (("b.png", "-f", "1"), ("b.##.png",)):
        assert record("wall.usda", *arguments) == 2
        assert "placeholder" in capfd.readouterr().err


def test_settings_and_passes(stage, capfd):
    for arguments in (("-rs", "/Half"), ("--renderPassPrimPath", "/Pass")):
        result = summary(capfd, "wall.usda", "a.png", *arguments)
        assert (result["width"], result["height"]) == (32, 16)
    for arguments, said in (
        (("-rs", "/World"), "/World"),
        (("-rp", "/Half"), "/Half is no RenderPass"),
        (("-rp", "/Pass", "-rs", "/Half"), "not together with"),
    ):
        assert record("wall.usda", "a.png", *arguments) in (2, 3)
        assert said in capfd.readouterr().err


def test_masks_and_session_layers(stage, capfd):
    whole = summary(capfd, "wall.usda", "a.png", "-w", "8")
    masked = summary(capfd, "wall.usda", "a.png", "-w", "8", "--mask", "/World/Other,/World/main_cam")
    assert (whole["triangles"], masked["triangles"]) == (3, 1)
    (stage.parent / "hide.usda").write_text(
        '#usda 1.0\nover "World" { over "Wall" { token visibility = "invisible"\n}\n}'
    )
    hidden = summary(capfd, "wall.usda", "a.png", "-w", "8", "--sessionLayer", "hide.usda")
    assert hidden["triangles"] == 1
    for mask in ("World", "/World/Wal"):
        assert record("wall.usda", "a.png", "--mask", mask) == 2
        assert mask in capfd.readouterr().err
    assert record("wall.usda", "a.png", "--sessionLayer", "none.usda") == 3
    assert "none.usda: no such file" in capfd.readouterr().err


def test_flags_without_effect_are_taken_and_unknown_renderers_refused(stage, capfd):
    flags = ["--disableGpu", "--memstats", "--resolver", "root", "--traceToFile", "t.json"]
    assert record("wall.usda", "a.png", "-w", "8", *flags, "--traceFormat", "chrome", "-r", "whitted") == 0
    assert not (stage.parent / "t.json").exists()
    assert record("wall.usda", "a.png", "--renderer", "Storm") == 2
    assert "--renderer: there is no 'Storm', only whitted; leave it out" in capfd.readouterr().err


def test_draw_modes_are_obeyed_unless_disabled(tmp_path, monkeypatch):
    """A ball that fills the middle of the picture, or its bounding box, which is empty there."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.usda").write_text(
        """#usda 1.0
        def Xform "m" (kind = "component"
            prepend apiSchemas = ["GeomModelAPI"]) {
            uniform token model:drawMode = "bounds"
            def Sphere "s" {}
        }
        """
    )
    middle = []
    for flags in ((), ("--disableDrawMode",)):
        assert record("model.usda", "a.png", "-w", "33", *flags) == 0
        middle.append(np.asarray(Image.open("a.png"))[12, 16, 3] > 0)
    assert middle == [False, True]
