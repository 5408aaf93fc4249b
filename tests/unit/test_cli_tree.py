# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt tree`` from a stage to text, JSON, a graph and a layer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from pxr import Usd

import warp_rt
from warp_rt.cli.main import main
from warp_rt.errors import OptionError

SCENES = Path(__file__).resolve().parents[2] / "scenes"
STAGE = str(SCENES / "mirror_teapot.usda")
VIEW = ("--width", "64", "--height", "48", "--device", "cpu")


def tree(capfd: pytest.CaptureFixture[str], *arguments: str, stage: str = STAGE, code: int = 0) -> tuple[str, str]:
    """Run the command; return stdout and stderr."""
    assert main(["tree", stage, *arguments, *VIEW]) == code
    return capfd.readouterr()


def test_text_goes_to_stdout(capfd: pytest.CaptureFixture[str]) -> None:
    out, err = tree(capfd, "48", "14")
    assert out.startswith("pixel (48, 14) of 64 x 48, ")
    assert "eye ray #0 level 1, weight 1, I = " in out
    assert "I = I_local + Kr R + Kt T" in out
    assert "\x1b" not in out
    # With an empty cache of kernels a line says that they are being compiled.
    assert [line for line in err.splitlines() if "compiling" not in line] == []


def test_text_fits_the_columns_there_are(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    out, _ = tree(capfd, "48", "14")
    assert 50 < max(map(len, out.splitlines())) <= 60


def test_a_pipe_gets_the_heading_in_lines_of_their_own(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Programs read it line by line, however long the name of the scene is."""
    folder = tmp_path / ("f" * 120)
    folder.mkdir()
    scene = folder / "a.usda"
    scene.write_text('#usda 1.0\ndef Sphere "s" {\n}\n', encoding="utf-8")
    monkeypatch.delenv("COLUMNS", raising=False)
    assert main(["tree", str(scene), "4", "3", "-w", "8", "-q"]) == 0
    first, second, third, *_ = capfd.readouterr().out.splitlines()
    assert first.startswith("pixel (4, 3) of 8 x 5, ")
    assert first.endswith("a.usda, camera (framed), time 0")
    assert (second[:4], third[:7]) == ("I = ", "1 node,")


def test_color_on_demand(capfd: pytest.CaptureFixture[str]) -> None:
    out, _ = tree(capfd, "48", "14", "--color", "always")
    assert "\x1b[" in out


def test_json_is_the_pixel_of_the_picture(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    options = ("--spp", "3", "--seed", "7", "--depth", "4", "--shadows", "transmit")
    out, _ = tree(capfd, "40", "20", "--json", *options)
    found = json.loads(out)
    picture = str(tmp_path / "picture.exr")
    assert main(["render", STAGE, "-o", picture, "-q", *options, *VIEW]) == 0
    with OpenEXR.File(picture, separate_channels=True) as file:
        pixel = [file.channels()[name].pixels[20, 40] for name in "RGB"]
    assert np.float32(found["value"]).tobytes() == np.float32(pixel).tobytes()
    assert [sample["sample"] for sample in found["samples"]] == [0, 1, 2]
    assert found["warnings"] == []
    assert (found["x"], found["y"], found["width"], found["height"]) == (40, 20, 64, 48)


def test_one_sample(capfd: pytest.CaptureFixture[str]) -> None:
    every, one = (
        json.loads(tree(capfd, "40", "20", "--json", "--spp", "3", *more)[0]) for more in ((), ("--sample", "2"))
    )
    assert one["samples"][0]["value"] == every["samples"][2]["value"]
    assert len(one["samples"]) == 1


def test_a_crop_counts_from_its_own_corner(capfd: pytest.CaptureFixture[str]) -> None:
    whole, part = (
        json.loads(tree(capfd, *arguments, "--json")[0])
        for arguments in (("40", "20"), ("10", "5", "--crop", "30,15,20,10"))
    )
    assert part["value"] == whole["value"]
    assert (part["width"], part["height"]) == (20, 10)


def test_time_picks_the_frame(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """A wall that is there in frame 2 alone."""
    stage = tmp_path / "wall.usda"
    stage.write_text("""\
#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 2
)
def Plane "Wall"
{
    token visibility.timeSamples = { 1: "invisible", 2: "inherited" }
    uniform token axis = "Z"
}
def Camera "Eye"
{
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
""")
    for frames, met in (((), None), (("--frames", "2"), "/Wall"), (("-f", "1"), None)):
        found = json.loads(tree(capfd, "32", "24", "--json", *frames, stage=str(stage))[0])
        assert found["nodes"][0]["prim"] == met
    _, err = tree(capfd, "32", "24", "--frames", "1:2", stage=str(stage), code=2)
    assert "--frames: one frame expected, got 2" in err


def test_dot(capfd: pytest.CaptureFixture[str]) -> None:
    out, _ = tree(capfd, "48", "14", "--dot")
    assert out.startswith("digraph ray_tree {")


def test_levels(capfd: pytest.CaptureFixture[str]) -> None:
    out, _ = tree(capfd, "48", "14", "--levels", "1")
    assert "#0 level 1" in out
    assert "#1 level 2" not in out
    assert "not shown: adds" in out


def test_usd_beside_the_text(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out, err = tree(capfd, "48", "14", "--usd", str(tmp_path / "rays.usda"))
    assert out.startswith("pixel ")
    assert f"{tmp_path / 'rays.usda'}: the rays over " in err
    assert Usd.Stage.Open(str(tmp_path / "rays.usda")).GetPrimAtPath("/RayTree_48_14/eye")


def test_display_values_follow_exposure(capfd: pytest.CaptureFixture[str]) -> None:
    plain, bright, raw = (
        json.loads(tree(capfd, "40", "20", "--json", *more)[0])
        for more in ((), ("--exposure", "1"), ("--tonemap", "raw"))
    )
    assert plain["value"] == bright["value"] == raw["value"]
    assert raw["rgb8"] == np.round(255 * np.minimum(raw["value"], 1)).tolist()
    assert max(plain["rgb8"]) < max(bright["rgb8"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("64", "0"), "pixel (64, 0) lies outside the picture of 64 x 48 pixels"),
        (("0", "48"), "pixel (0, 48) lies outside the picture of 64 x 48 pixels"),
        (("-1", "0"), "pixel (-1, 0) lies outside the picture, whose top left one is (0, 0)"),
        (("20", "0", "--crop", "30,15,20,10"), "pixel (20, 0) lies outside the picture of 20 x 10 pixels"),
        (("x", "0"), "X: a whole number expected, got 'x'"),
        (("1",), "missing: Y"),
        (("1", "1", "--sample", "1"), "--sample: 1 is outside 0..0"),
        (("1", "1", "--levels", "0"), "--levels: 0 is less than 1"),
        (("1", "1", "--json", "--dot"), "--json and --dot: stdout holds one of them"),
        (("1", "1", "--usd", "rays.png"), "rays.png: a USD layer ends in .usda, .usdc, .usd"),
    ],
)
def test_usage_errors(capfd: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str) -> None:
    out, err = tree(capfd, *arguments, code=2)
    assert message in err
    assert err.count("\n") == 1
    if "--json" not in arguments:
        assert out == ""


def test_what_no_stage_has_is_refused_before_it_is_read(capfd: pytest.CaptureFixture[str]) -> None:
    for arguments in (("-1", "0"), ("20", "0", "--crop", "30,15,20,10"), ("1", "1", "--spp", "4", "--sample", "4")):
        _, err = tree(capfd, *arguments, stage="missing.usda", code=2)
        assert "missing.usda" not in err


def test_a_pixel_outside_is_refused_before_anything_is_built(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("warp_rt.rendering.renderer.Renderer", None)  # whoever made one would fail otherwise
    _, err = tree(capfd, "64", "0", code=2)
    assert "pixel (64, 0) lies outside the picture of 64 x 48 pixels" in err
    with pytest.raises(OptionError, match=r"pixel \(0, 48\) lies outside the picture of 64 x 48 pixels"):
        warp_rt.trace_tree(STAGE, 0, 48, width=64, height=48)


def test_the_scenes_own_file_is_spared(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    stage = tmp_path / "scene.usda"
    stage.write_text('#usda 1.0\ndef Sphere "Ball" {}\n')
    _, err = tree(capfd, "1", "1", "--usd", str(stage), stage=str(stage), code=6)
    assert "the scene reads this file" in err


def test_a_tree_that_nobody_would_read(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Two facing half mirrors of glass, thirty levels: 2^15 rays and more at each of the last; it ends at a limit."""
    stage = tmp_path / "panes.usda"
    panes = "".join(
        f"""
def Plane "Pane{k}" (prepend apiSchemas = ["MaterialBindingAPI"])
{{
    rel material:binding = </Glass>
    uniform token axis = "Z"
    double3 xformOp:translate = (0, 0, {k})
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""
        for k in range(6)
    )
    stage.write_text(f"""\
#usda 1.0
def Camera "Front"
{{
    double3 xformOp:translate = (0, 0, 20)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
{panes}
def Material "Glass"
{{
    token outputs:warp_rt:surface.connect = </Glass/Surface.outputs:surface>
    def Shader "Surface"
    {{
        uniform token info:id = "WhittedSurface"
        color3f inputs:reflection = (0.5, 0.5, 0.5)
        color3f inputs:transmission = (0.5, 0.5, 0.5)
        token outputs:surface
    }}
}}
""")
    _, err = tree(capfd, "32", "24", "--depth", "40", "--threshold", "0", stage=str(stage), code=5)
    assert "the pixel's ray tree has more than 262,144 nodes: a lower depth or a higher threshold prunes it" in err


def test_plain_letters_where_an_encoding_has_no_lines() -> None:
    command = [sys.executable, "-m", "warp_rt", "tree", STAGE, "48", "14", *VIEW]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    run = subprocess.run(command, capture_output=True, env=environment, check=False)
    assert run.returncode == 0
    text = run.stdout.decode("ascii")
    assert "`T refraction" in text or "`-T refraction" in text
    assert "\\u" not in text
