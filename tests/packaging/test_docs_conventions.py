# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""docs/conventions.md: its tables against a film, its files, the program's JSON and the exit codes."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import warp_rt
from warp_rt import errors
from warp_rt.cli import main as program
from warp_rt.options import AOVS

DOCS = Path(__file__).resolve().parents[2] / "docs"
TEXT = (DOCS / "conventions.md").read_text(encoding="utf-8")

# Seen from (0, 0, 10): a mesh that faces away from the eye, over the right upper quarter of the picture.
STAGE = """#usda 1.0
def Camera "c"
{
    token projection = "orthographic"
    float horizontalAperture = 40
    float verticalAperture = 40
    double3 xformOp:translate = (0, 0, 10)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Mesh "m" (prepend apiSchemas = ["SemanticsLabelsAPI:class"])
{
    token[] semantics:labels:class = ["square"]
    point3f[] points = [(0, 0, 0), (0, 2, 0), (2, 2, 0), (2, 0, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:st = [(0, 0), (0, 1), (1, 1), (1, 0)] (interpolation = "vertex")
}
"""


def table(header: str) -> list[list[str]]:
    """Return the cells of the table below a header row."""
    lines = TEXT[TEXT.index(header) :].splitlines()[2:]
    rows = lines[: next(i for i, line in enumerate([*lines, ""]) if not line.startswith("|"))]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def names(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("conventions")
    (path / "stage.usda").write_text(STAGE)
    return path


@pytest.fixture(scope="module")
def image(folder: Path) -> warp_rt.Image:
    return warp_rt.render(folder / "stage.usda", width=4, height=4, aovs=AOVS)


def test_aovs_are_as_the_table_says(image: warp_rt.Image) -> None:
    rows = table("| AOV |")
    assert [row[0].strip("`") for row in rows] == ["color", "alpha", *AOVS[1:]]
    for name, dtype, count, nothing, *_ in rows:
        values = image[name.strip("`")]
        assert values.dtype == dtype, name
        assert values.shape == ((4, 4) if count == "1" else (4, 4, int(count))), name
        if nothing == "-":  # whatever it took to find that out
            continue
        expected = 0.0 if nothing == "background" else float(nothing)
        np.testing.assert_array_equal(values[3, 0], expected, err_msg=name)


def test_aovs_of_a_square(image: warp_rt.Image) -> None:
    """Pixel (2, 0) looks along -Z through (0.5, 1.5)."""
    found = {name: image[name][0, 2].tolist() for name in AOVS[1:]}
    assert found["position"] == pytest.approx([0.5, 1.5, 0.0], abs=1e-6)
    assert found["uv"] == pytest.approx([0.25, 0.75], abs=1e-6)
    assert (found["depth"], found["distance"]) == (10.0, 10.0)
    assert found["normal"] == [0.0, 0.0, -1.0]
    assert (found["primId"], found["instanceId"], found["elementId"]) == (0, -1, 0)


def test_channels_are_as_the_table_says(image: warp_rt.Image, folder: Path) -> None:
    image.save(folder / "aovs.exr")
    channels = OpenEXR.File(str(folder / "aovs.exr"), separate_channels=True).channels()
    assert set(channels) == {name for row in table("| AOV |") for name in row[4].split()}
    assert channels["primId.X"].pixels[3, 0] == 4294967295
    assert "4294967295" in TEXT


def test_sidecar_is_as_the_example_shows(image: warp_rt.Image, folder: Path) -> None:
    image.save(folder / "aovs.png")
    example = json.loads(re.search(r"```json\n(.*?)```", TEXT, re.DOTALL)[1])
    example["primId"]["0"] = {"path": "/m", "labels": {"class": ["square"]}}
    assert json.loads((folder / "aovs.ids.json").read_text()) == example
    beside = {path.name for path in folder.glob("aovs.*.npy")}
    assert beside == {f"aovs.{aov}.npy" for aov in AOVS if aov != "color"}


def test_exit_codes_are_those_of_the_errors() -> None:
    documented = {int(row[0]) for row in table("| exit code |")}
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type)]
    assert documented == {0, program.EXIT_INTERRUPTED, program.EXIT_TERMINATED} | {kind.exit_code for kind in kinds}


def test_json_has_the_fields_of_the_table(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    output = str(folder / "f.##.png")
    arguments = ["render", str(folder / "stage.usda"), "-o", output, "-w", "4", "--json"]
    assert program.main([*arguments, "--frames", "1:2"]) == 0
    run = json.loads(capfd.readouterr().out)
    frames = run.pop("frames")
    found = set()
    for name, value in run.items():
        found |= {f"{name}.{part}" for part in value} if isinstance(value, dict) else {name}
    rows = {name: meaning for cell, meaning in table("| field |") for name in names(cell)}
    assert found == set(rows)
    assert list(run["rays"]["per_depth"][0]) == names(rows["rays.per_depth"])
    assert list(run["notes"][0]) == names(rows["notes"])
    frame_fields = names(re.search(r"and `frames`\slists (.*?) of each", TEXT, re.DOTALL)[1])
    assert [list(frame) for frame in frames] == [frame_fields] * 2


def test_failure_prints_the_object_of_the_example(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    example = json.loads(re.search(r'{"error".*', TEXT)[0])
    assert program.main(["render", "shot.usda", "--json"]) == example["error"]["code"]
    assert json.loads(capfd.readouterr().out) == example


def test_a_crop_has_the_pixels_of_the_whole(folder: Path, image: warp_rt.Image) -> None:
    crop = warp_rt.render(folder / "stage.usda", width=4, height=4, crop=(1, 0, 3, 2), spp=2)
    whole = warp_rt.render(folder / "stage.usda", width=4, height=4, spp=2)
    np.testing.assert_array_equal(crop.linear, whole.linear[:2, 1:])


def test_what_reads_an_exr_back_reads_what_was_rendered(
    image: warp_rt.Image, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    image.save("layers.exr")
    read: dict[str, np.ndarray] = {}
    exec(re.search(r"```python\n(import numpy.*?)```", TEXT, re.DOTALL)[1], read)
    for name, aov in [("color", "color"), ("depth", "depth"), ("ids", "primId")]:
        np.testing.assert_array_equal(read[name], image[aov])


def test_labels_are_those_of_the_sidecar(image: warp_rt.Image) -> None:
    assert image.labels("primId") == [{"class": ("square",)}]
    assert image.labels("instanceId") == []
    with pytest.raises(errors.OptionError, match="aov: 'depth' is none of primId, instanceId"):
        image.labels("depth")
