# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""README.md: its Python and its commands can be pasted as they stand."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import OpenEXR
import pytest

from warp_rt.cli.main import COMMANDS, main

from ..processes import complaints

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def test_python_runs_as_it_stands(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    (tmp_path / "out").mkdir()
    (block,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    told = "\nprint(film, image['depth'].shape, hits.t[0] < 10 + 1e-3, hits.t[1] == np.inf)\n"
    run = subprocess.run(
        [sys.executable, "-c", block + told], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (run.returncode, complaints(run.stderr)) == (0, [])
    assert run.stdout.startswith("<warp_rt.Film 320 x 240: color, alpha; ")
    assert run.stdout.endswith("(240, 320) True True\n")
    assert {path.name for path in tmp_path.iterdir()} == {"scenes", "out"}  # nothing is left about or written over
    with OpenEXR.File(str(tmp_path / "out" / "teapot.exr"), separate_channels=True) as file:
        assert set(file.channels()) == {"R", "G", "B", "A", "depth.Z", "primId.X"}


COMMAND_LINES = re.findall(r"^warp-rt .*$", TEXT, re.MULTILINE)


@pytest.mark.parametrize("line", COMMAND_LINES)
def test_commands_run_as_they_stand(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the size of the pictures. No comments stand behind them, which zsh would take for arguments."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    (tmp_path / "out").mkdir()
    _, *arguments = shlex.split(line)
    smaller = [] if arguments[0] == "tree" else ["-w", "24"]
    assert main([*arguments, *smaller]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"scenes", "out"}


def test_what_is_fenced_is_nothing_but_commands() -> None:
    blocks = re.findall(r"^```sh\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks[2:] for line in block.splitlines()]
    assert lines == ["source .venv/bin/activate && mkdir -p out", *COMMAND_LINES]


def test_every_command_is_shown() -> None:
    assert {line.split()[1] for line in COMMAND_LINES} | {"warmup", "doctor"} == set(COMMANDS)


def test_what_commands_write_beside_the_readme_is_ignored_by_git() -> None:
    """Pictures and series under the names that they have without ``-o``, and what lies beside pictures."""
    ignored = (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    assert {"/*.png", "/*.exr", "/*.npy", "/*.ids.json", "/*_series/", "/out/", "*.whl"} <= set(ignored)
