# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Links in documents lead somewhere, and the README's commands are the ones that the gate runs."""

import re
from pathlib import Path
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).resolve().parents[2]

DOCUMENTS = sorted(
    path
    for path in ROOT.rglob("*.md")
    if not any(part.startswith(".") or part in ("build", "dist", "out") for part in path.relative_to(ROOT).parts)
)

_FENCE = re.compile(r"^```.*?^```\s*?$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"!?\[[^\]]*\]\(<?([^)>\s]+)>?(?:\s+\"[^\"]*\")?\)|(?:src|href)=\"([^\"]+)\"")
_HEADING = re.compile(r"^#+\s+(.+?)\s*$", re.MULTILINE)


def _text(path):
    return _FENCE.sub("", path.read_text(encoding="utf-8"))


def _anchor(heading):
    """Return the anchor that code hosts give a heading: lower case, words joined by hyphens."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)|[`*]", r"\1", heading)
    return re.sub(r"\s", "-", re.sub(r"[^\w\s-]", "", plain.lower()).strip())


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(document):
    for match in _LINK.finditer(_text(document)):
        link = match[1] or match[2]
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = unquote(link).partition("#")
        target = (document.parent / name).resolve() if name else document
        assert target.exists(), f"{document.name}: {link}"
        assert target.is_relative_to(ROOT), f"{document.name}: {link} leaves the project"
        if anchor and target.suffix == ".md":
            anchors = {_anchor(heading) for heading in _HEADING.findall(_text(target))}
            assert anchor in anchors, f"{document.name}: {link}"


def test_there_are_documents():
    assert {"README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"} <= {path.name for path in DOCUMENTS}


def _opening_commands():
    """Return the README's commands above its first section, as the gate finds them."""
    opening = (ROOT / "README.md").read_text(encoding="utf-8").partition("\n## ")[0]
    return "".join(re.findall(r"^```\w*\n(.*?)^```", opening, re.MULTILINE | re.DOTALL))


def test_readme_opens_with_the_two_commands():
    lines = [line for line in _opening_commands().splitlines() if line and not line.startswith("#")]
    assert len(lines) == 2, lines
    render, test = lines
    assert "pip install ." in render
    assert "warp-rt render scenes/mirror_teapot.usda" in render
    assert "pip install '.[test]'" in test
    assert "pytest" in test
    for line in lines:
        assert "-m venv " in line  # a bare pip install fails where the system's Python is managed by the system


def test_gate_runs_the_readmes_commands():
    """The gate takes them out of the README, so that they cannot drift apart."""
    gate = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert "README.md" in gate
    assert not re.search(r"^\s*pip3? install", gate, re.MULTILINE)  # never outside a virtual environment


def test_the_index_has_every_document():
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    names = [path.name for path in (ROOT / "docs").glob("*.md") if path.name != "README.md"]
    assert [name for name in names if f"]({name})" not in index] == []
