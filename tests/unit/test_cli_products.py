# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``--product``: which pictures, in which files, with which layers and windows."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import OpenEXR
import pytest

import warp_rt
from warp_rt.cli import main as program
from warp_rt.cli.products import product_file, product_shots
from warp_rt.errors import OptionError, OutputError, SceneError
from warp_rt.scene import Product, RenderVar, Settings

# A square of 1 x 1 in the upper right quarter of a window of 2 x 2, at distance 3.
STAGE = """#usda 1.0
(
    renderSettingsPrimPath = "/S"
)
def Camera "c"
{
    token projection = "orthographic"
    float horizontalAperture = 20
    float verticalAperture = 20
    double3 xformOp:translate = (5, 0, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Camera "other" {}
def Mesh "m"
{
    point3f[] points = [(5, 0, 0), (6, 0, 0), (6, 1, 0), (5, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
}
def RenderSettings "S"
{
    rel camera = </other>
    uniform int2 resolution = (8, 8)
    rel products = [</Window>, </Layers>, </Plain>]
}
def RenderProduct "Window"
{
    token productName = "a/window.exr"
    rel camera = </c>
    uniform float4 dataWindowNDC = (0.5, 0.25, 1.25, 1)
}
def RenderProduct "Layers"
{
    token productName = "layers.tif"
    rel camera = </c>
    rel orderedVars = [</Beauty>, </Eye>, </Prims>, </Far>]
    uniform float pixelAspectRatio = 2
}
def RenderProduct "Plain"
{
    token productName = "plain.png"
    uniform int2 resolution = (4, 6)
    rel camera = </c>
}
def RenderVar "Beauty"
{
    uniform string sourceName = "Ci"
    uniform token dataType = "color3h"
}
def RenderVar "Eye"
{
    uniform string sourceName = "Peye"
}
def RenderVar "Prims"
{
    uniform string sourceName = "primId"
}
def RenderVar "Far"
{
    uniform string sourceName = "cameraDepth"
}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "stage.usda").write_text(STAGE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str) -> int:
    return program.main([*arguments, "-q", "--device", "cpu"])


def read(path: Path) -> tuple[dict, dict[str, np.ndarray]]:
    file = OpenEXR.File(str(path), separate_channels=True)
    return file.header(), {name: channel.pixels for name, channel in file.channels().items()}


def test_all_products_are_written_where_they_say(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run("render", "stage.usda", "--product", "all", "--json") == 0
    told = json.loads(capfd.readouterr().out)
    files = ["a/window.exr", "layers.tif.exr", "layers.tif.ids.json", "plain.png"]
    assert told["outputs"] == files
    assert all((folder / file).is_file() for file in files)
    assert [note["prim"] for note in told["notes"] if note["code"] == "N904"] == ["/Layers"]  # not the name it says
    plain = warp_rt.load_scene(folder / "stage.usda").products[2]
    assert (plain.path, plain.settings.resolution) == ("/Plain", (4, 6))


def test_a_data_window_is_a_part_of_the_picture_and_more(folder: Path) -> None:
    """Columns 4 to 10 of 8, rows 0 to 6: NDC begins at the bottom left."""
    assert run("render", "stage.usda", "--product", "Window", "-o", "w.exr") == 0
    header, channels = read(folder / "w.exr")
    assert [corner.tolist() for corner in header["dataWindow"]] == [[4, 0], [9, 5]]
    assert [corner.tolist() for corner in header["displayWindow"]] == [[0, 0], [7, 7]]
    expected = np.zeros((6, 6))
    expected[:4, :4] = 1
    np.testing.assert_array_equal(channels["A"], expected)


def test_layers_are_render_vars(folder: Path) -> None:
    assert run("render", "stage.usda", "--product", "/Layers") == 0
    header, channels = read(folder / "layers.tif.exr")
    assert header["pixelAspectRatio"] == 2
    assert set(channels) == {*"RGBA", "Eye.X", "Eye.Y", "Eye.Z", "Prims.X", "Far.Z"}
    assert channels["R"].dtype == channels["A"].dtype == np.float16
    assert (channels["Prims.X"].dtype, channels["Eye.X"].dtype) == (np.uint32, np.float32)
    # The policy widens the window to an aspect of 2: x from -2 to 2, pixels of 0.5 x 0.25.
    np.testing.assert_allclose([channels[f"Eye.{axis}"][0, 4] for axis in "XYZ"], [0.25, 0.875, -3], rtol=1e-6)
    assert channels["Far.Z"][0, 4] == 3
    assert np.isinf(channels["Far.Z"][7, 0])
    assert (channels["Prims.X"][0, 4], channels["Prims.X"][7, 0]) == (0, 4294967295)


def test_layers_of_one_name_are_told_apart(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """None is lost: the later one has its prim's name. Channels that differ may share a layer."""
    layer = '    string driver:parameters:aov:name = "far"\n'
    text = STAGE.replace('"Peye"\n', f'"distance"\n{layer}').replace('"cameraDepth"\n', f'"P"\n{layer}')
    text = text.replace('"primId"\n', f'"elementId"\n{layer}')
    (folder / "stage.usda").write_text(text)
    assert run("render", "stage.usda", "--product", "Layers", "--json") == 0
    _, channels = read(folder / "layers.tif.exr")
    assert set(channels) == {*"RGBA", "far.X", "Prims.X", "Far.X", "Far.Y", "Far.Z"}
    told = [note["prim"] for note in json.loads(capfd.readouterr().out)["notes"] if "called" in note["message"]]
    assert told == ["/Prims", "/Far"]
    np.testing.assert_allclose([channels[f"Far.{axis}"][0, 4] for axis in "XYZ"], [5.25, 0.875, 0], rtol=1e-6)


def test_halves_may_be_infinite_without_a_word(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    dark = STAGE.replace('Camera "c"\n{', 'Camera "c"\n{\n    float exposure = 20')
    (folder / "stage.usda").write_text(dark)
    assert run("render", "stage.usda", "--product", "Layers", "-q") == 0
    assert capfd.readouterr().err == ""
    _, channels = read(folder / "layers.tif.exr")
    assert np.isinf(channels["R"][0, 4])


def test_surfaces_are_refined_for_the_camera_of_each_product(folder: Path) -> None:
    """A ball is refined for the one that sees it large, not for the one that comes first and sees it small."""
    cube = STAGE.replace("(5, 1, 0)]", "(5, 1, 0), (5, 0, -1), (6, 0, -1), (6, 1, -1), (5, 1, -1)]")
    cube = cube.replace("[4]", "[4, 4, 4, 4, 4, 4]")
    cube = cube.replace("[0, 1, 2, 3]", "[0, 1, 2, 3, 4, 7, 6, 5, 0, 4, 5, 1, 1, 5, 6, 2, 2, 6, 7, 3, 3, 7, 4, 0]")
    cube = cube.replace('subdivisionScheme = "none"', 'subdivisionScheme = "catmullClark"')
    (folder / "ball.usda").write_text(cube.replace("int2 resolution = (4, 6)", "int2 resolution = (60, 60)"))
    assert run("render", "ball.usda", "--product", "all", "--complexity", "auto") == 0
    alone = ("--camera", "c", "-w", "60", "--crop", "0,0,60,60", "-o", "alone.png")
    assert run("render", "ball.usda", *alone, "--complexity", "auto") == 0
    assert (folder / "plain.png").read_bytes() == (folder / "alone.png").read_bytes()


def test_a_render_var_of_nothing_is_foreseen(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    variable = 'uniform token sourceType = "primvar"\n    uniform string sourceName = "gone"'
    (folder / "stage.usda").write_text(STAGE.replace('uniform string sourceName = "Peye"', variable))
    for command in ("render", "check"):
        assert program.main([command, "stage.usda", "--product", "Layers"]) == 0
        told = capfd.readouterr()
        assert "N933" in told.out + told.err


def test_aovs_of_the_command_go_before_render_vars(folder: Path) -> None:
    assert run("render", "stage.usda", "--product", "Layers", "--aov", "color,Neye", "-o", "n.exr") == 0
    _, channels = read(folder / "n.exr")
    assert set(channels) == {*"RGBA", "Neye.X", "Neye.Y", "Neye.Z"}
    assert [channels[f"Neye.{axis}"][0, 5] for axis in "XYZ"] == [0, 0, 1]


def test_without_the_option_the_command_says_what_is_written(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run("render", "stage.usda", "--json") == 0
    told = json.loads(capfd.readouterr().out)
    assert told["outputs"] == ["stage.png"]
    assert [note["prim"] for note in told["notes"] if note["code"] == "N904"] == ["/Window", "/Layers", "/Plain"]


def test_record_leaves_products_their_size(folder: Path) -> None:
    assert run("record", "stage.usda", "out.exr", "-w", "100", "--product", "Plain") == 0
    assert not (folder / "out.exr").exists()
    header, _ = (folder / "plain.png").read_bytes()[16:24], None
    assert [int.from_bytes(header[:4], "big"), int.from_bytes(header[4:], "big")] == [4, 6]


def test_frames_of_products(folder: Path) -> None:
    assert run("render", "stage.usda", "--product", "Plain", "--frames", "1:2") == 0
    assert sorted(path.name for path in folder.glob("*.png")) == ["plain.0001.png", "plain.0002.png"]


# --- names


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("a.exr", "a.exr"),
        ("a/b.PNG", "a/b.PNG"),
        ("./a.exr", "a.exr"),
        ("a.tif", "a.tif.exr"),
        ("a", "a.exr"),
        ("", "P.exr"),
        ("/home/someone/a.exr", "a.exr"),
        ("C:\\\\out\\\\a.exr", "a.exr"),
        ("../../a.exr", "a.exr"),
        ("a/../../b.exr", "b.exr"),
        ("..", "P.exr"),
        ("/", "P.exr"),
    ],
)
def test_a_stage_does_not_decide_about_other_folders(name: str, file: str) -> None:
    assert product_file("/R/P", name, has_color=True).as_posix() == file


def asking(*products: Product, time: float | None = None) -> SimpleNamespace:
    """A source whose render settings ask for products, and whose scene is at a time."""
    return SimpleNamespace(products=lambda: products, scene=lambda: SimpleNamespace(time=time))


@pytest.mark.parametrize(
    ("time", "frames", "files"),
    [
        (1.0, None, ["a.0001.png"]),
        (None, None, ["a.0000.png"]),
        (1.0, "3:4", ["a.0003.png", "a.0004.png"]),
    ],
)
def test_a_placeholder_takes_the_number_of_the_frame_that_is_drawn(
    time: float | None, frames: str | None, files: list[str]
) -> None:
    shots, _ = product_shots(asking(Product("/P", "a.####.png", Settings()), time=time), "all", frames)
    assert [shot.output.name for shot in shots] == files


@pytest.mark.parametrize(
    ("time", "frames", "files"),
    [
        (1.0, None, ["x.0001.exr"]),
        (None, None, ["x.exr"]),  # the default time
        (1.0, "1:3", ["x.0001.exr", "x.0002.exr", "y.0003.exr"]),
        (1.0, "0", ["x.0001.exr"]),  # as USD holds the first sample before it, and each up to the next
        (1.0, "2.5", ["x.0002.exr"]),
    ],
)
def test_a_name_may_be_another_at_each_frame(time: float | None, frames: str | None, files: list[str]) -> None:
    names = ((1.0, "x.0001.exr"), (2.0, "x.0002.exr"), (3.0, "y.####.exr"))
    product = Product("/P", "x.exr", Settings(), names=names)
    shots, notes = product_shots(asking(product, time=time), "all", frames)
    assert ([shot.output.name for shot in shots], notes) == (files, [])


def test_frames_that_have_one_name_are_refused_beside_others() -> None:
    product = Product("/P", "", Settings(), names=((1.0, "a.exr"), (3.0, "b.exr")))
    with pytest.raises(OutputError, match=r"a\.exr: more than one picture"):
        product_shots(asking(product), "all", "1:3")


@pytest.mark.parametrize(
    ("frames", "files"),
    [
        ("1:2", ["a.0001.exr", "a.0002.exr"]),
        ("1:2x0.5", ["a.0001.0.exr", "a.0001.5.exr", "a.0002.0.exr"]),
        ("1 1.25", ["a.0001.00.exr", "a.0001.25.exr"]),
        ("1.25", ["a.exr"]),
    ],
)
def test_numbers_have_the_decimals_that_frames_need(frames: str, files: list[str]) -> None:
    shots, _ = product_shots(asking(Product("/P", "a.exr", Settings())), "all", frames)
    assert [shot.output.name for shot in shots] == files


def test_a_picture_of_no_colour_is_an_exr() -> None:
    product = Product("/P", "a.png", Settings(), (RenderVar("/V", "V", "normal"),))
    shots, notes = product_shots(asking(product), "all")
    assert [(shot.output.name, shot.aovs) for shot in shots] == [("a.png.exr", ("normal",))]
    assert [note.code for note in notes] == ["N904"]


def test_what_cannot_be_chosen() -> None:
    products = asking(Product("/R/A", "a.exr", Settings()), Product("/R/B", "a.exr", Settings()))
    with pytest.raises(SceneError, match="no raster product 'C'"):
        product_shots(products, "C")
    with pytest.raises(SceneError, match=r"name no raster product$"):
        product_shots(asking(), "all")
    with pytest.raises(OutputError, match=r"a\.exr: more than one picture"):
        product_shots(products, "all")
    with pytest.raises(OptionError, match="one file for 2 products"):
        product_shots(products, "all", output=Path("b.exr"))


@pytest.mark.parametrize(
    ("said", "arguments", "seen"),
    [
        ("", ["--product", "P", "-o", "p.exr"], {"/plain", "/render"}),  # the schema's fallback
        ("", ["-o", "p.exr"], {"/plain", "/proxy"}),  # usdrecord's
        ("", ["--product", "P", "-o", "p.exr", "--purposes", "proxy"], {"/plain", "/proxy"}),
        ('uniform token[] includedPurposes = ["proxy", "guide"]', ["--product", "P", "-o", "p.exr"], {"/proxy"}),
    ],
)
def test_purposes_of_products(said: str, arguments: list[str], seen: set[str], folder: Path) -> None:
    balls = "".join(
        f'def Sphere "{name}" {{ token purpose = "{purpose}"\ndouble radius = 0.1\n'
        f"double3 xformOp:translate = ({x}, 0, 0)\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
        for x, (name, purpose) in enumerate((("plain", "default"), ("render", "render"), ("proxy", "proxy")), start=-1)
    )
    (folder / "purposes.usda").write_text(
        f"""#usda 1.0
(renderSettingsPrimPath = "/S")
def Camera "c" {{
    token projection = "orthographic"
    float horizontalAperture = 30
    float verticalAperture = 30
    double3 xformOp:translate = (0, 0, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def RenderSettings "S" {{
    rel camera = </c>
    uniform int2 resolution = (30, 30)
    rel products = </P>
    {said}
}}
def RenderProduct "P" {{}}
{balls}"""
    )
    assert run("render", "purposes.usda", *arguments, "--aov", "color,primId") == 0
    prims = json.loads((folder / "p.ids.json").read_text())["primId"]
    _, channels = read(folder / "p.exr")
    hit = np.unique(channels["primId.X"].astype(np.int32))
    assert {prims[str(each)]["path"] for each in hit if each >= 0} == seen
