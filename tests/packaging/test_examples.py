# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Every example runs as its docstring says, is short, and prints what it is about; every scene of ours is clean."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pxr import Usd, Vt

from ..processes import complaints

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("[0-9][0-9]_*.py"))
SCENES = sorted((ROOT / "scenes").glob("*.usda"))
LONGEST = 60  # lines

WORDS = {
    "01_render.py": "480 x 360 pixels",
    "02_depth_series.py": "depth 7:",
    "03_aovs.py": "/World/Teapot",
    "04_from_arrays.py": "18050 triangles",
    "05_rays.py": "ways are blocked",
    "06_kernels.py": "refracted to 28.13 degrees",
    "07_why_hierarchies.py": "10082        10082 ",
    "08_hierarchy_levels.py": "level 7: 128 boxes",
    "09_ray_tree.py": "All 10 nodes sum to 0.664",
    "10_views.py": "points are ",
    "11_contact_sheet.py": "5 of 5 stages are clean",
    "12_trace_kernel.py": "points see 0% to 98% of the sky",
}
FILES = {
    "01_render.py": {"mirror_teapot.png"},
    "02_depth_series.py": {"series.png"}
    | {f"depth_{depth}.png" for depth in range(1, 8)}
    | {f"change_{depth}.png" for depth in range(2, 8)},
    "03_aovs.py": {"normals.png"},
    "04_from_arrays.py": {"waves.png"},
    "05_rays.py": {"heights.png"},
    "06_kernels.py": {"refraction.png"},
    "07_why_hierarchies.py": set(),
    "08_hierarchy_levels.py": {"hierarchy_levels.png"} | {f"level_{level}.usda" for level in (1, 3, 5, 7)},
    "09_ray_tree.py": {"ray_tree.usda", "ray_tree.png"},
    "10_views.py": {"views.png"} | {f"view_{view}.{kind}" for view in range(4) for kind in ("exr", "ids.json")},
    "11_contact_sheet.py": {"contact_sheet.png"},
    "12_trace_kernel.py": {"sky.png"},
}


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_example(example: Path, tmp_path: Path) -> None:
    to = ["given"] if example.name < "03" else []
    run = subprocess.run([sys.executable, str(example), *to], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (run.returncode, complaints(run.stderr)) == (0, [])
    assert WORDS[example.name] in run.stdout
    written = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}
    assert written == {f"{to[0] if to else 'out'}/{name}" for name in FILES[example.name]}
    for name in written:
        if not name.endswith(".png"):
            continue
        with Image.open(tmp_path / name) as picture:
            low, high = picture.convert("L").getextrema()
        assert low < high, f"{name} is a single grey"


@pytest.mark.parametrize("example", [path for path in EXAMPLES if FILES[path.name]], ids=lambda path: path.name)
def test_help_says_where_files_go_and_does_nothing_else(
    example: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(example), "--help"])
    with pytest.raises(SystemExit) as stop:
        runpy.run_path(str(example), run_name="__main__")
    assert stop.value.code == 0
    assert "for what it writes (default: out)" in " ".join(capsys.readouterr().out.split())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.name)
def test_example_is_short(example: Path) -> None:
    assert len(example.read_text(encoding="utf-8").splitlines()) <= LONGEST


@pytest.mark.parametrize("scene", SCENES, ids=lambda path: path.name)
def test_scene_renders_without_a_warning(scene: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "warp_rt", "render", str(scene), "-o", "out.png", "-w", "64", "--strict", "--json"]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert [record for record in json.loads(run.stdout)["warnings"] if record["code"].startswith("W")] == []


def test_examples_are_in_their_readme_with_all_that_they_write() -> None:
    text = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\d\d_\w+\.py)` \|.*\|(.*)\|$", text, re.MULTILINE))
    assert set(rows) == {path.name for path in EXAMPLES}
    for name, cell in rows.items():
        told = set(re.findall(r"`([^`]+)`", cell))
        for first, last in re.findall(r"`(\w+)_(?=\d)[^`]+` to `\w+_(\d)\.png`", cell):
            told |= {f"{first}_{number}.png" for number in range(2, int(last))}
        assert told == FILES[name]


def test_every_scene_is_in_the_readme() -> None:
    text = (ROOT / "scenes" / "README.md").read_text(encoding="utf-8")
    assert [path.name for path in SCENES if f"`{path.name}`" not in text] == []


def test_mirror_teapot_is_what_its_script_writes(tmp_path: Path) -> None:
    """So that other tessellations are the same scene. Numbers may differ by what processors round differently."""
    path = tmp_path / "mirror_teapot.usda"
    subprocess.run([sys.executable, str(ROOT / "scenes" / "make_mirror_teapot.py"), str(path)], check=True)
    written, kept = Usd.Stage.Open(str(path)), Usd.Stage.Open(str(ROOT / "scenes" / "mirror_teapot.usda"))
    assert [prim.GetPath() for prim in written.TraverseAll()] == [prim.GetPath() for prim in kept.TraverseAll()]
    for prim in written.TraverseAll():
        for attribute in prim.GetAuthoredAttributes():
            other = kept.GetAttributeAtPath(attribute.GetPath()).Get()
            if isinstance(other, (bool, str, type(None))):
                assert attribute.Get() == other, attribute.GetPath()
            elif isinstance(other, Vt.TokenArray):
                assert list(attribute.Get()) == list(other)
            else:
                np.testing.assert_allclose(attribute.Get(), other, atol=1e-6, err_msg=str(attribute.GetPath()))
    assert (ROOT / "scenes" / "mirror_teapot.usda").stat().st_size < 1 << 20
