# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""README.md: its Python can be pasted as it stands, its commands' options exist."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from warp_rt.cli import check, info, record, render, series, tree

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = {"render": render, "record": record, "series": series, "tree": tree, "check": check, "info": info}
PARSERS = {name: command.parser() for name, command in COMMANDS.items()}


def test_python_runs_as_it_stands(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    (block,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    told = "\nprint(film, image['depth'].shape, hits.t[0] < 10 + 1e-3, hits.t[1] == np.inf)\n"
    run = subprocess.run(
        [sys.executable, "-c", block + told], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.startswith("<warp_rt.Film 320 x 240: color, alpha; ")
    assert run.stdout.endswith("(240, 320) True True\n")
    with Image.open(tmp_path / "mirror_teapot.png") as picture:
        assert picture.size == (320, 240)


@pytest.mark.parametrize("line", re.findall(r"^    warp-rt (.*?)(?:  |$)", TEXT, re.MULTILINE))
def test_commands_parse(line: str) -> None:
    command, *arguments = shlex.split(line)
    assert PARSERS[command].parse(arguments).scene.startswith("shot.usd")


def test_pictures_of_the_opening_command_are_ignored_by_git() -> None:
    ignored = (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    assert {"/mirror_teapot.png", "*.whl"} <= set(ignored)
