# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""docs/materialx.md says of surfaces and nodes what the tables in the code say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from warp_rt.usd.bsdf_graphs import LOBES
from warp_rt.usd.foreign_shaders import foreign_surface
from warp_rt.usd.materialx_nodes import is_known_node

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "materialx.md").read_text(encoding="utf-8")

GRAPH = ("layer", "mix", "add", "multiply")  # nodes that put lobes together


def table(heading: str) -> list[list[str]]:
    """Return the rows of a section's table, the heading among them, without the line below it."""
    lines = [
        line
        for line in TEXT[TEXT.index(heading) :]
        .split("\n## ")[0]
        .split("\n### Surfaces of" if heading == "## Surfaces" else "\n## ")[0]
        .splitlines()
        if line.startswith("|")
    ]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if not line.startswith("|---")]


def names(cell: str) -> list[str]:
    return re.findall(r"`(\w+)`", cell)


SURFACES = table("## Surfaces")


@pytest.mark.parametrize("column", range(1, len(SURFACES[0])))
def test_inputs_of_surfaces_become_what_the_table_says(column: int) -> None:
    surface = foreign_surface(SURFACES[0][column])
    assert surface is not None
    said = {row[0]: names(row[column]) for row in SURFACES[1:]}
    assert sorted(said.pop("lost")) == sorted(surface.lacks)
    assert said.pop("`normal`") == [surface.normal]
    coverage = said.pop("`opacity`, presence, where nothing is transmitted")
    assert coverage == [name for name in (surface.coverage, surface.coverage_mode) if name]
    assert said.pop("reflectance head on, by an `ior` that gives it") == [surface.reflectance]
    said["`opacity`"] = said.pop("`opacity`, transparent")
    expected = {
        f"`{name}`": [part for part in (term.weight, term.name) if part] for name, term in surface.terms.items()
    }
    assert {name: parts for name, parts in said.items() if parts} == expected


def test_lobes_are_those_that_are_named() -> None:
    rows = [row[0] for row in table("### Surfaces of BSDFs")[1:]]
    named = {name for cell in rows for name in re.findall(r"\w+_bsdf", cell) if name.partition("_")[0] not in GRAPH}
    assert named == set(LOBES)


def test_nodes_that_fold_are_those_that_are_named() -> None:
    rows = [
        row for row in table("## Nodes")[1:] if not row[0].startswith(("image", "gltf", "geomprop", "texcoord", "any"))
    ]
    for cell in (row[0] for row in rows):
        for name in re.findall(r"[a-z]+2 to 4|[a-z]+\w*", cell):
            kinds = [f"{name[:-6]}{k}" for k in (2, 3, 4)] if name.endswith(" to 4") else [name]
            assert all(is_known_node(f"ND_{kind}_color3") for kind in kinds), name
