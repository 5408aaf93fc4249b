# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""docs/tree.md and the README's tree: what they show is what the program prints, and their tables hold."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

import warp_rt
from warp_rt.rendering.tree_recording import MAX_NODES
from warp_rt.tree.curves import CURVE_COLORS, LEAVING
from warp_rt.tree.nodes import Fate
from warp_rt.tree.text import NODES_SHOWN

from ..processes import complaints

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "tree.md").read_text(encoding="utf-8")
NUMBER = re.compile(r"(?<![\w#])-?\d+(?:\.\d+)?(?:e[+-]\d+)?")


def fields(heading: str) -> set[str]:
    """Return the words in the first column of the table below a line."""
    lines = TEXT[TEXT.index(heading) :].split("| field | is |\n|---|---|\n", 1)[1].splitlines()
    rows = [line for line in lines[: lines.index("") if "" in lines else None] if line.startswith("|")]
    return {word for row in rows for word in re.findall(r"`(\w+)`", row.split("|")[1])}


@pytest.mark.parametrize("document", ["README.md", "docs/tree.md"])
def test_the_example_is_what_the_program_prints(document: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Word for word; numbers within what another processor rounds differently."""
    block = re.search(r"```text\n\$ warp-rt (.*?)\n(.*?)```", (ROOT / document).read_text(encoding="utf-8"), re.DOTALL)
    monkeypatch.setenv("COLUMNS", "100")
    command = [sys.executable, "-m", "warp_rt", *shlex.split(block[1]), "--device", "cpu"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, encoding="utf-8", check=True)
    assert NUMBER.sub("0", run.stdout.rstrip()) == NUMBER.sub("0", block[2].rstrip())
    found, shown = (list(map(float, NUMBER.findall(text))) for text in (run.stdout, block[2]))
    assert found == pytest.approx(shown, rel=2e-3, abs=2e-3)


def test_tables_of_fields() -> None:
    tree = warp_rt.trace_tree(ROOT / "scenes" / "mirror_teapot.usda", 185, 91, width=320, device="cpu").to_json()
    assert fields("`tree --json` prints one object") == set(tree) | {"warnings", "notes"}
    for name in (*tree["rays"], *tree["samples"][0]):
        assert re.search(rf"^\| `(rays|samples)` .*`{name}`", TEXT, re.MULTILINE), name
    nodes = tree["nodes"]
    fates = {fate.name.lower() for fate in Fate}
    assert fields("A node:") == set(nodes[0])
    told = re.search(r"what became of each child: (.*)", TEXT)[1]
    assert set(re.findall(r"`(\w+)`", told)) == fates
    lights = [light for node in nodes for light in node["lights"]]
    assert fields("An entry of `lights`:") == set(lights[0])
    crossing = next(light["crossings"][0] for light in lights if light["crossings"])
    assert all(f"`{name}`" in TEXT.rsplit("| `crossings` |", 1)[1] for name in crossing)


def test_numbers_in_the_text() -> None:
    assert f"more than {MAX_NODES:,} nodes ends with exit code {warp_rt.LimitError.exit_code}" in TEXT.replace(
        "\n", " "
    )
    assert f"The text has the {NODES_SHOWN} that lead" in TEXT
    assert LEAVING == 0.25
    assert "a quarter of its diagonal" in TEXT
    for kind in CURVE_COLORS:
        assert f"| `{kind}` |" in TEXT


def test_python_runs(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "scenes", tmp_path / "scenes")
    block = "import warp_rt\n" + re.search(r"```python\n(.*?)```", TEXT, re.DOTALL)[1]
    run = subprocess.run([sys.executable, "-c", block], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (run.returncode, complaints(run.stderr)) == (0, [])
    assert run.stdout.startswith("EYE 1 /World/Mirror/Glass")
    assert (tmp_path / "rays.usda").is_file()


def test_the_drawing_is_of_the_scene() -> None:
    tree = warp_rt.trace_tree(ROOT / "scenes" / "mirror_teapot.usda", 240, 70, width=320, device="cpu")
    drawn, kept = (
        ElementTree.fromstring(text) for text in (tree.to_svg(), (ROOT / "docs/images/ray_tree.svg").read_text())
    )
    titles = [[NUMBER.sub("0", title.text) for title in svg.iter("{*}title")] for svg in (drawn, kept)]
    assert titles[0] == titles[1]
