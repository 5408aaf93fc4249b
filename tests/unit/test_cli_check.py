# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt check`` and ``info``: what a render would tell and be, told without rendering."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from warp_rt.cli.main import main

from ..wall_stage import STAGE

CAMERA = STAGE[STAGE.index('    def Camera "Front"') : STAGE.index('    def DistantLight "Sun"')]
LIGHT = STAGE[STAGE.index('    def DistantLight "Sun"') :]


@pytest.fixture
def stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A stage in the current folder, which holds nothing else."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "wall.usda"
    path.write_text(STAGE)
    return path


def told(capfd: pytest.CaptureFixture[str], command: str, *arguments: str) -> set[tuple[str, str]]:
    """Return code and prim of everything that a command tells."""
    assert main([command, "wall.usda", "--json", "-w", "16", *arguments]) == 0
    result = json.loads(capfd.readouterr().out)
    records = result["diagnostics"] if command == "check" else [*result["warnings"], *result["notes"]]
    return {(record["code"], record["prim"]) for record in records}


PRODUCTS = """
def RenderSettings "Settings"
{
    rel products = [</Beauty>, </Ids>]
}
def RenderProduct "Beauty"
{
    token productName = "../beauty.exr"
    rel camera = </World/Front>
}
def RenderProduct "Ids"
{
    token productName = "ids.exr"
}
"""
WITH_PRODUCTS = STAGE.replace("(\n", '(\n    renderSettingsPrimPath = "/Settings"\n', 1) + PRODUCTS
LENS = CAMERA.replace("float horizontal", "float fStop = 2\n        float focusDistance = 5\n        float horizontal")
SHUTTER = CAMERA.replace("float horizontal", "double shutter:close = 0.5\n        float horizontal")
SOFT = LIGHT.replace("angle = 0", "angle = 5\n        bool inputs:normalize = true")
SQUARE = "[(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)]"
COLLAPSING = STAGE.replace(
    f"points = {SQUARE}", f"points.timeSamples = {{ 1: {SQUARE}, 2: {SQUARE.replace('-2', 'nan')} }}"
)


@pytest.mark.parametrize(
    ("text", "arguments", "codes"),
    [
        (STAGE, [], set()),
        (STAGE.replace(CAMERA, ""), [], {"N901"}),
        (STAGE.replace(LIGHT, "}\n"), [], {"N902"}),
        (STAGE, ["--light-samples", "4"], {"N935"}),
        (STAGE.replace(LIGHT, SOFT), [], {"N907"}),
        (STAGE.replace(LIGHT, SOFT), ["--light-samples", "4"], set()),
        (STAGE.replace(CAMERA, LENS.replace('"orthographic"', '"perspective"')), [], {"N930"}),
        (STAGE.replace(CAMERA, SHUTTER), [], {"N931"}),
        (STAGE.replace(CAMERA, SHUTTER), ["--spp", "2"], set()),
        (STAGE, ["--aov", "color,primvars:warmth", "-o", "a.exr"], {"N933"}),
        (STAGE.replace("(0, 0, -10)", "(1e4, 0, -10)"), [], {"N932"}),
        (STAGE.replace("(0, 0, -10)", "(1e4, 0, -10)"), ["--camera", "/World/Front"], {"N932"}),
        (COLLAPSING, [], set()),
        (COLLAPSING, ["--frames", "1:2", "-o", "a.#.png"], {"N905", "W103"}),
        (COLLAPSING.replace(CAMERA, SHUTTER.replace("0.5", "1.5")), ["--spp", "4"], {"N905", "W103"}),
        (WITH_PRODUCTS, [], {"N904"}),
        (WITH_PRODUCTS, ["--product", "all"], {"N904"}),
        (WITH_PRODUCTS, ["--product", "Ids"], set()),
    ],
)
def test_check_tells_what_render_tells(stage, capfd, text, arguments, codes):
    stage.write_text(text)
    foreseen = told(capfd, "check", *arguments)
    assert {path.name for path in stage.parent.iterdir()} == {"wall.usda"}
    assert {code for code, _ in foreseen} == codes
    assert foreseen == told(capfd, "render", "--device", "cpu", *arguments)


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--camera", "Frond"], 3, "no camera 'Frond'; did you mean Front?"),
        (["--frames", "1:2", "-o", "a.png"], 2, "exactly one placeholder"),
        (["--crop", "16,0,4,4"], 2, "--crop: (16, 0, 4, 4) lies outside the picture of 16 x 8 pixels"),
        (["--product", "all"], 3, "the render settings name no raster product"),
        (["--mask", "/World/Gone"], 2, "--mask: /World/Gone is no prim of wall.usda"),
    ],
)
def test_check_refuses_what_render_refuses(stage, capfd, arguments, code, said):
    errors = []
    for command in ("check", "render"):
        assert main([command, "wall.usda", "-w", "16", *arguments]) == code
        errors.append(capfd.readouterr().err.replace(f"warp-rt {command}: ", ""))
    assert errors[0] == errors[1]
    assert said in errors[0]


def test_check_says_from_which_frame_on(stage, capfd):
    stage.write_text(COLLAPSING.replace(LIGHT, "}\n"))
    assert main(["check", "wall.usda", "--frames", "1:3"]) == 0
    lines = sorted(capfd.readouterr().out.splitlines())
    assert [line.split()[0] for line in lines] == ["N902", "N905", "W103"]
    assert not lines[0].endswith(" on)")
    assert all(line.endswith(" (from frame 2 on)") for line in lines[1:])
    assert main(["check", "wall.usda", "--frames", "1:3", "--json"]) == 0
    records = json.loads(capfd.readouterr().out)["diagnostics"]
    assert {record["code"]: record["frame"] for record in records} == {"N902": 1, "N905": 2, "W103": 2}


def test_check_prints_each_diagnostic_and_strict_exits_3(stage, capfd):
    assert main(["check", "wall.usda", "--strict"]) == 0
    assert capfd.readouterr().out == ""
    stage.write_text(STAGE.replace("[0, 1, 2, 3]", "[0, 1, 2, 9]"))
    assert main(["check", "wall.usda"]) == 0
    out = capfd.readouterr().out
    assert out.startswith("W1")
    assert "/World/Wall" in out
    assert main(["check", "wall.usda", "--strict"]) == 3
    assert capfd.readouterr() == (out, "warp-rt check: error: wall.usda: --strict: 1 warning\n")
    assert main(["check", "wall.usda", "--json"]) == 0
    report = json.loads(capfd.readouterr().out)
    assert len(report["diagnostics"]) == out.count("\n")
    assert main(["check", "wall.usda", "--light-samples", "4", "-v"]) == 0
    assert capfd.readouterr().err.endswith("wall.usda: 1 warning, 2 notes\n")
    assert report["warnings"] == sum(line.startswith("W") for line in out.splitlines()) == 1


# --- info


def test_info_counts_what_is_there(stage, capfd):
    assert main(["info", "wall.usda", "--json"]) == 0
    facts = json.loads(capfd.readouterr().out)
    assert (facts["triangles"], facts["triangles_placed"], facts["instances"]) == (2, 2, 1)
    assert facts["cameras"] == ["/World/Front"]
    assert facts["lights"] == [{"path": "/World/Sun", "kind": "distant"}]
    assert facts["bounds"] == [[-2, -2, -10], [2, 2, -10]]
    assert facts["time"] == 1
    assert facts["memory"]["scene_bytes"] >= 4 * 12 + 2 * 12  # 4 points and 2 triangles at least
    assert facts["picture"] == {"camera": "/World/Front", "width": 960, "height": 480}
    assert facts["warnings"] == 0


@pytest.mark.parametrize(
    ("metadata", "time_range", "rate", "row"),
    [
        ("", None, 24, "none named"),
        ("startTimeCode = 3", None, 24, "none named"),
        ("startTimeCode = 3\nendTimeCode = 1", None, 24, "none named"),
        ("startTimeCode = 1\nendTimeCode = 48.5\ntimeCodesPerSecond = 30", [1, 48.5], 30, "1:48.5, 30 a second"),
    ],
)
def test_info_tells_the_frames_that_a_stage_names(stage, capfd, metadata, time_range, rate, row):
    stage.write_text(
        STAGE.replace("    startTimeCode = 1\n    endTimeCode = 3\n", "").replace("(\n", f"(\n{metadata}\n", 1)
    )
    assert main(["info", "wall.usda", "--json"]) == 0
    facts = json.loads(capfd.readouterr().out)
    assert (facts["time_range"], facts["time_codes_per_second"]) == (time_range, rate)
    assert main(["info", "wall.usda"]) == 0
    assert f"\nframes     {row}\n" in capfd.readouterr().out


def test_info_for_people(stage, capfd):
    assert main(["info", "wall.usda"]) == 0
    out = capfd.readouterr().out
    assert "/World/Front" in out
    assert "/World/Sun (distant)" in out
    assert "2 in memory" in out
    assert "picture    960 x 480, /World/Front\n" in out


def test_info_tells_meshes_from_shapes_and_small_sizes(stage, capfd):
    """A ball has no triangles: it is one shape, in memory and in the scene."""
    stage.write_text(STAGE.rstrip().removesuffix("}") + '    def Sphere "Ball" {}\n}\n')
    assert main(["info", "wall.usda"]) == 0
    out = capfd.readouterr().out
    for kind, count in [("meshes", 1), ("triangles", 2), ("shapes", 1)]:
        assert f"{kind:<11}{count} in memory, {count} in the scene\n" in out
    assert main(["info", "wall.usda", "--json"]) == 0
    facts = json.loads(capfd.readouterr().out)
    counts = [facts[name] for name in ("meshes", "meshes_placed", "shapes", "shapes_placed", "instances")]
    assert counts == [1, 1, 1, 1, 2]
    assert f"memory     {facts['memory']['scene_bytes']} B, about " in out  # a few points: below a KiB


def test_info_has_words_for_what_steps_in(stage, capfd):
    bound = "rel material:binding = </World/Blue>"
    bulb = '    def Sphere "Bulb" (prepend apiSchemas = ["LightAPI"]) {}\n}\n'
    stage.write_text(STAGE[: STAGE.index('    def Camera "Front"')].replace(bound, "") + bulb)
    assert main(["info", "wall.usda"]) == 0
    out = capfd.readouterr().out
    assert "(displayColor fallback) (" in out
    assert " (radiance of the light) (" in out
    assert "picture    960 x 700, (framed)\n" in out  # an academy frame, 20.955 by 15.2908 mm
    assert "/__" not in out


def test_info_tells_of_the_frame_and_the_picture_that_are_asked_for(stage, capfd):
    assert main(["info", "wall.usda", "--json", "-f", "3", "-cam", "Front", "-w", "100", "--crop", "0,0,30,20"]) == 0
    facts = json.loads(capfd.readouterr().out)
    assert (facts["time"], facts["bounds"]) == (3, [[-2, -2, -30], [2, 2, -30]])
    assert facts["picture"] == {"camera": "/World/Front", "width": 30, "height": 20}
    assert main(["info", "wall.usda", "--camera", "Frond"]) == 3
    assert "did you mean Front?" in capfd.readouterr().err
