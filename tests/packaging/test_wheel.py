# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The wheel is whole: built from a clean copy, installed elsewhere, rendering from a third folder. So is the sdist."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]

IGNORED = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "build", "dist", "out")


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A folder with the sdist, made of a copy of the checkout so that nothing stale is in it, and the wheel of it."""
    copy = tmp_path_factory.mktemp("source") / "warp_rt"
    shutil.copytree(ROOT, copy, symlinks=True, ignore=IGNORED)
    target = tmp_path_factory.mktemp("built")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(target), str(copy)]
    result = subprocess.run(command, capture_output=True, text=True, cwd=target)
    assert result.returncode == 0, result.stdout + result.stderr
    return target


@pytest.fixture(scope="module")
def wheel(built):
    (path,) = built.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """A folder that holds the installed wheel; what it depends on comes from the environment of the tests."""
    folder = tmp_path_factory.mktemp("installed")
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", str(folder)]
    subprocess.run([*command, str(wheel)], check=True)
    return folder


def _run(installed, arguments, cwd):
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    return subprocess.run(arguments, env=environment, cwd=cwd, capture_output=True, text=True, timeout=280)


def test_wheel_holds_every_source_file(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    host = {
        path.relative_to(ROOT).as_posix() for path in (ROOT / "warp_rt").rglob("*.py") if "kernels" not in path.parts
    }
    device = {f"warp_rt/kernels/{path.name}" for path in (ROOT / "kernels").glob("*.py")}
    assert len(host) > 20
    assert len(device) > 10
    wanted = host | device | {"warp_rt/py.typed", "warp_rt/kernels/py.typed", "warp_rt/upload/specular_albedo.npy"}
    assert {name for name in names if name.startswith("warp_rt/")} == wanted


def test_sdist_holds_the_whole_project(built):
    """So that the README's commands, the tests and the links of the documents work from it."""
    (path,) = built.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    folders = ("benchmarks", "docs", "examples", "kernels", "scenes", "tests", "warp_rt")
    files = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file()]
    wanted = {path.relative_to(ROOT).as_posix() for path in files if "__pycache__" not in path.parts}
    wanted |= {path.name for path in ROOT.glob("*.md")} | {"LICENSE", "CITATION.cff", "pyproject.toml"}
    assert {name for name in wanted if not name.startswith("warp_rt/kernels/")} <= names


def test_wheel_installs_one_top_level_package(wheel):
    """A top-level package ``kernels`` would overwrite somebody else's."""
    tops = {name.partition("/")[0] for name in zipfile.ZipFile(wheel).namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"warp_rt"}


def test_wheel_states_its_licence_and_its_readme(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        metadata = archive.read(name).decode()
        assert any(name.endswith("/licenses/LICENSE") for name in archive.namelist())
    assert "License-Expression: Apache-2.0" in metadata
    assert "Requires-Python: <3.15,>=3.11" in metadata
    assert "scenes/mirror_teapot.usda" in metadata.partition("\n\n")[2]


def test_wheel_renders_away_from_the_repository(installed, tmp_path):
    scene = tmp_path / "scene"
    shutil.copytree(ROOT / "scenes", scene)
    stage = scene / "mirror_teapot.usda"
    arguments = ["render", str(stage), "--width", "64", "--device", "cpu", "--json"]
    result = _run(installed, [sys.executable, "-m", "warp_rt", *arguments], tmp_path)
    assert result.returncode == 0, result.stderr
    told = json.loads(result.stdout)
    assert told["outputs"] == ["mirror_teapot.png"]
    assert told["rays"]["reflection"] > 0
    assert told["rays"]["refraction"] > 0
    with Image.open(tmp_path / "mirror_teapot.png") as picture:
        assert picture.width == 64
        assert len(picture.convert("RGB").getcolors(1 << 16)) > 100


def test_wheel_is_what_was_tested(installed, tmp_path):
    code = "import warp_rt, warp_rt.kernels.vector as v; print(warp_rt.__file__); print(v.__file__)"
    result = _run(installed, [sys.executable, "-c", code], tmp_path)
    assert result.returncode == 0, result.stderr
    assert all(Path(line).is_relative_to(installed) for line in result.stdout.splitlines())


def test_wheel_has_the_program(installed, tmp_path):
    program = installed / "bin" / "warp-rt"
    if not program.exists():
        program = installed / "Scripts" / "warp-rt.exe"
    result = _run(installed, [str(program), "--version"], tmp_path)
    version = re.search(r'^version = "(.+)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.M)[1]
    assert result.stdout.startswith(f"warp-rt {version} (")


def test_package_and_project_have_the_same_version():
    import warp_rt

    assert f'\nversion = "{warp_rt.__version__}"\n' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
