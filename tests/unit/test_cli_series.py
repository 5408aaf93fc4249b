# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt series`` from file to file, against pictures that ``warp-rt render`` makes one by one."""

import json
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PillowImage

from warp_rt.cli.main import main

SCENE = Path(__file__).resolve().parents[2] / "scenes" / "mirror_teapot.usda"
SIZE = ("--width", "80", "--device", "cpu")


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def color_of(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return np.stack([file.channels()[name].pixels for name in "RGB"], axis=-1)


def test_figures_are_those_of_separate_renders(folder, capfd):
    depths = range(1, 6)
    assert main(["series", str(SCENE), "--depths", "1:5", "-o", "s", "--format", "exr", "--json", *SIZE]) == 0
    result = json.loads(capfd.readouterr().out)
    assert [row["depth"] for row in result["depths"]] == list(depths)
    previous = None
    for row in result["depths"]:
        single = f"single_{row['depth']}.exr"
        assert main(["render", str(SCENE), "--depth", str(row["depth"]), "-o", single, "--json", *SIZE]) == 0
        alone = json.loads(capfd.readouterr().out)
        assert row["rays"] == alone["rays"]
        color = color_of(single)
        np.testing.assert_array_equal(color_of(row["picture"]), color)
        if previous is None:
            assert (row["change"], row["changed_share"], row["largest_change"], row["change_scale"]) == (None,) * 4
        else:
            differs = np.count_nonzero((color != previous).any(axis=-1))
            assert row["changed_share"] == differs / color[..., 0].size
            assert row["largest_change"] == np.abs(color - previous).max()
            np.testing.assert_array_equal(color_of(row["change"]), np.abs(color - previous))
        previous = color
    assert result["rays"]["primary"] == 5 * 80 * 60
    assert result["rays"]["shadow"] == sum(row["rays"]["shadow"] for row in result["depths"])
    assert (result["depth"], result["width"], result["height"]) == (5, 80, 60)
    assert sorted(result["outputs"]) == sorted(f"s/{path.name}" for path in (folder / "s").iterdir())


def test_pictures_are_those_of_render(folder):
    """Display values too, with exposure; and differences are multiplied as told."""
    assert main(["series", str(SCENE), "--depths", "2,4", "-o", "s", "--exposure", "0.5", "-q", *SIZE]) == 0
    for depth in (2, 4):
        alone = ["render", str(SCENE), "--depth", str(depth), "-o", "one.png", "--exposure", "0.5", "-q"]
        assert main([*alone, *SIZE]) == 0
        assert (folder / "one.png").read_bytes() == (folder / "s" / f"depth_{depth}.png").read_bytes()
    with PillowImage.open(folder / "s" / "change_4.png") as change:
        assert float(change.text["warp_rt:exposure"]) >= 0


def test_default_folder_has_the_scenes_name(folder, capfd):
    assert main(["series", str(SCENE), "--depths", "1:2", *SIZE]) == 0
    out, err = capfd.readouterr()
    assert out == ""
    assert "mirror_teapot_series/series.png, mirror_teapot_series/depth_1.png, " in err
    assert ": 80 x 60, 1 spp" in err
    assert {path.name for path in (folder / "mirror_teapot_series").iterdir()} == {
        *("series.png", "depth_1.png", "depth_2.png", "change_2.png")
    }


def test_verbose_tells_the_captions(capfd):
    assert main(["series", str(SCENE), "--depths", "1:2", "-v", *SIZE]) == 0
    lines = capfd.readouterr().err.splitlines()
    header = next(i for i, line in enumerate(lines) if line.startswith("depth "))
    assert lines[header].split() == ["depth", "rays", "pixels", "that", "change", "largest", "change"]
    assert lines[header + 1].split()[0] == "1"
    assert lines[header + 2].split()[3] == "%"


@pytest.mark.parametrize(
    ("depths", "said"),
    [
        ("0:3", "0 is outside 1..1024"),
        ("7:1", "'7:1' leads downwards; write 1:7"),
        ("abc", "a list such as 1:7 or 1,2,4 expected, got 'abc'"),
        ("", "a list such as 1:7 or 1,2,4 expected, got ''"),
        ("3,2", "2 comes after 3; they have to grow, such as 1, 2, 3"),
        ("1:9999999999", "9999999999 is outside 1..1024"),
        ("1:101", "1 to 100 pictures expected, got 101"),
    ],
)
def test_depths_that_make_no_series(capfd, depths, said):
    assert main(["series", "none.usda", "--depths", depths]) == 2
    assert capfd.readouterr() == ("", f"warp-rt series: error: --depths: {said}\n")


def test_what_goes_wrong_leaves_nothing(folder, capfd):
    (folder / "file").write_text("")
    (folder / "odd.usda").write_text('#usda 1.0\ndef Sphere "s" { token visibility = "maybe"\n}')
    for arguments, code, said in (
        (["none.usda"], 3, "none.usda: no such file"),
        ([str(SCENE), "-o", "file"], 6, "file: is a file, not a folder"),
        ([str(SCENE), "-o", "no/such"], 6, "no/such: the folder no does not exist"),
        ([str(SCENE), "--camera", "Frond"], 3, "Frond"),
        ([str(SCENE), "--device", "cuda:99"], 4, "'cuda:99' is not available"),
        (["odd.usda", "--strict"], 3, "--strict: 1 warning"),
        ([str(SCENE), "--spp", "1000000", "--time-limit", "0.1"], 5, "time limit"),
    ):
        assert main(["series", *arguments]) == code, arguments
        err = capfd.readouterr().err
        assert said in err
        assert "Traceback" not in err
    assert {path.name for path in folder.iterdir()} == {"file", "odd.usda"}


def test_failures_are_objects_for_json(capfd):
    assert main(["series", "none.usda", "--json"]) == 3
    assert json.loads(capfd.readouterr().out) == {"error": {"code": 3, "message": "none.usda: no such file"}}


def test_files_of_the_scene_are_spared(folder, capfd):
    """A stage that lies where a picture would go, whatever its name says it is."""
    (folder / "s").mkdir()
    stage = folder / "s" / "depth_1.png"
    stage.symlink_to(SCENE)
    copy = folder / "scene.usda"
    copy.symlink_to(SCENE)
    assert main(["series", str(copy), "-o", "s", "--depths", "1:2", *SIZE]) == 6
    assert "s/depth_1.png: the scene reads this file" in capfd.readouterr().err


def test_a_series_is_of_one_frame(folder, capfd):
    assert main(["series", str(SCENE), "--frames", "1:2", *SIZE]) == 2
    assert "--frames: one frame expected, got 2" in capfd.readouterr().err
    assert list(folder.iterdir()) == []
