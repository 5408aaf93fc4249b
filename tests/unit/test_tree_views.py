# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray tree as text, equation, JSON, graph and drawing: nothing is lost, nothing breaks out."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import warp_rt
from warp_rt.tree.equation import nested_equation
from warp_rt.tree.numbers import color, number, percent
from warp_rt.tree.selection import select
from warp_rt.tree.text import NODES_SHOWN

from ..analytic.scenes import distant, parallel, scene_of, square, whitted

ROOT = Path(__file__).resolve().parents[2]
EVIL = '/World/"><script>alert(1)</script>\\n&amp;\x1b[31m'


@pytest.fixture(scope="module")
def small() -> warp_rt.RayTree:
    """A tree of some ten nodes: mirror, glass ball, floor."""
    return warp_rt.trace_tree(ROOT / "scenes" / "mirror_teapot.usda", 240, 70, width=320, device="cpu")


@pytest.fixture(scope="module")
def large() -> warp_rt.RayTree:
    """A tree of more nodes than anybody reads: two half mirrors of glass that face each other, many levels deep."""
    glass = whitted(ambient=0.1, reflection=0.45, transmission=0.5)
    panes = [square(glass, z=z) for z in np.linspace(-1, 1, 6)]
    scene = scene_of(*panes, ambient=(1, 1, 1), background=(0.2, 0.3, 0.4))
    options = warp_rt.RenderOptions(width=1, height=1, depth=13, threshold=0.0)
    tree = warp_rt.Renderer(scene, options, device="cpu").trace_tree(0, 0, camera=parallel((0.1, 0.2, 5.0)))
    assert len(tree) > 1000
    return tree


@pytest.fixture(scope="module")
def deep() -> warp_rt.RayTree:
    """A corridor of mirrors, deeper than Python's calls go."""
    mirror = whitted(ambient=0.01, reflection=0.999)
    scene = scene_of(square(mirror, z=-1.0), square(mirror, z=1.0), ambient=(1, 1, 1))
    options = warp_rt.RenderOptions(width=1, height=1, depth=1024, threshold=0.0)
    tree = warp_rt.Renderer(scene, options, device="cpu").trace_tree(0, 0, camera=parallel((0.3, 0.1, 0.0)))
    assert len(tree) == 1024
    return tree


@pytest.fixture(scope="module")
def evil() -> warp_rt.RayTree:
    """A tree whose prims have names that mean something to HTML, DOT and terminals."""
    scene = scene_of(
        square(whitted(ambient=0.1, diffuse=0.5, reflection=0.5)),
        square(whitted(), z=2.0),
        lights=[dataclasses.replace(distant((0, 0, -1)), path=EVIL)],
        background=(0.1, 0.1, 0.1),
    )
    scene = dataclasses.replace(scene, prims=tuple(EVIL for _ in scene.prims), source=EVIL)
    options = warp_rt.RenderOptions(width=1, height=1)
    return warp_rt.Renderer(scene, options, device="cpu").trace_tree(0, 0, camera=parallel((0.0, 0.0, 1.0)))


# --- numbers


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (-0.0, "0"), (0.123456, "0.1235"), (12345.6, "1.235e+04"), (np.inf, "inf")]
)
def test_number(value: float, text: str) -> None:
    assert number(value) == text


def test_color_is_one_number_where_it_reads_the_same() -> None:
    assert color((0.5, 0.50000001, 0.5)) == "0.5"
    assert color((0.5, 0.25, 0.0)) == "0.5 0.25 0"


@pytest.mark.parametrize(
    ("share", "text"), [(None, ""), (0.0, "0.0 %"), (0.0001, "< 0.1 %"), (0.051, "5.1 %"), (0.856, "86 %")]
)
def test_percent(share: float | None, text: str) -> None:
    assert percent(share) == text


# --- the equation


@pytest.mark.parametrize("name", ["small", "large"])
def test_the_equation_evaluates_to_the_value(name: str, request: pytest.FixtureRequest) -> None:
    """Read as Python, with every digit: the nested sum of the lecture is the pixel."""
    tree = request.getfixturevalue(name)
    for channel in range(3):
        shown = select(tree.roots, nodes=60)
        equation = nested_equation(tree.root, channel, times=" * ", form=repr, shown=shown)
        value = eval(re.sub(r"[\[\]]", "", equation))
        assert value == pytest.approx(tree.root.value[channel], rel=1e-12)
        # A float32 sum rounds once a node.
        assert value == pytest.approx(tree.value[channel], rel=len(tree) * 2.0**-24)


def test_the_equation_of_two_mirrors() -> None:
    mirror = whitted(ambient=(0.25, 0.5, 0.75), reflection=0.5)
    scene = scene_of(square(mirror, z=-1.0), square(mirror, z=1.0), ambient=(1, 1, 1))
    options = warp_rt.RenderOptions(width=1, height=1, depth=2)
    tree = warp_rt.Renderer(scene, options, device="cpu").trace_tree(0, 0, camera=parallel((0.3, 0.1, 0.0)))
    assert nested_equation(tree.root, 0) == "0.25 + 0.5 (0.25 + 0.5 (0))"
    assert nested_equation(tree.root, 1, shown=[0]) == "0.5 + 0.5 [0.5]"


# --- what is shown


def test_what_is_shown_hangs_together_and_is_the_most(large: warp_rt.RayTree) -> None:
    shown = select(large.roots, nodes=25)
    assert len(shown) == 25
    parents = {child.index: node for node in large for child in node.children}
    by_index = {node.index: node for node in large}
    assert all(index == 0 or parents[index].index in shown for index in shown)
    hidden = [child for node in large if node.index in shown for child in node.children if child.index not in shown]
    least = min(sum(by_index[index].subtree_contribution) for index in shown)
    assert max(sum(node.subtree_contribution) for node in hidden) <= least


def test_levels_shows_whole_levels(large: warp_rt.RayTree) -> None:
    assert select(large.roots, nodes=1, levels=4) == {node.index for node in large if node.depth <= 4}


# --- text


@pytest.mark.parametrize("width", [48, 60, 80, 120])
@pytest.mark.parametrize("name", ["small", "large", "deep", "evil"])
def test_text_keeps_to_its_width(name: str, width: int, request: pytest.FixtureRequest) -> None:
    tree = request.getfixturevalue(name)
    lines = tree.to_text(width=width).splitlines()
    assert max(map(len, lines)) <= width
    assert len(lines) < 40 * NODES_SHOWN


def test_text_accounts_for_what_it_leaves_out(large: warp_rt.RayTree) -> None:
    text = re.sub(r"\s+", " ", re.sub(r"[│├└─]", " ", large.to_text(width=120)))
    told = len(re.findall(r"(?:eye ray|reflection|refraction) #\d+ level", text))
    hidden = re.findall(r"#\d+, ([\d,]+) nodes? on", text)
    assert told == NODES_SHOWN
    assert told + sum(int(count.replace(",", "")) for count in hidden) == len(large)


def test_the_equation_says_what_its_brackets_are(large: warp_rt.RayTree, small: warp_rt.RayTree) -> None:
    """A branch of either stands in brackets, its value being that of the node."""
    text = " ".join(large.to_text(width=120).split())
    equation = text.split("with the value of what is not written out in [ ]", 1)[1]
    values = {f"{node.value[0]:.4g}" for node in large}
    in_brackets = re.findall(r"\[([\d.e-]+)\]", equation.split("green:")[0])
    assert len(in_brackets) > 3
    assert set(in_brackets) <= values
    assert "written out" not in small.to_text()


def test_text_has_every_node_where_there_are_few(small: warp_rt.RayTree) -> None:
    text = small.to_text()
    assert [f"#{node.index} level {node.depth}" in text for node in small] == [True] * len(small)
    assert "not shown" not in text
    assert str(small) == text


def test_many_lights_are_summed_up() -> None:
    """Of 30 lights, those that add most are told of, and the others counted."""
    lights = [distant((0, 0, -1), 0.5 + 0.01 * k) for k in range(25)] + [distant((0, 0, 1), 9.0)] * 5
    scene = scene_of(square(whitted(diffuse=0.5)), lights=lights)
    options = warp_rt.RenderOptions(width=1, height=1)
    tree = warp_rt.Renderer(scene, options, device="cpu").trace_tree(0, 0, camera=parallel((0.0, 0.0, 1.0)))
    text = tree.to_text()
    assert text.count("N.L = 1,") == 8
    rest = 0.5 * sum(0.5 + 0.01 * k for k in range(17))
    assert f"22 more lights: 5 behind the surface, 0 in shadow, add {rest:.4g}" in text


def test_text_shows_no_control_characters(evil: warp_rt.RayTree) -> None:
    assert "\x1b" not in evil.to_text()


# --- JSON


def test_json_is_complete_and_consistent(large: warp_rt.RayTree) -> None:
    tree = json.loads(json.dumps(large.to_json(), allow_nan=False))
    nodes = {node["index"]: node for node in tree["nodes"]}
    assert len(nodes) == len(large) == tree["rays"]["nodes"]
    for node in nodes.values():
        for child in node["children"]:
            assert nodes[child]["parent"] == node["index"]
    total = np.sum([node["contribution"] for node in nodes.values()], axis=0)
    np.testing.assert_allclose(total, tree["value"], rtol=len(large) * 2.0**-24)


def test_json_of_a_deep_tree(deep: warp_rt.RayTree) -> None:
    assert len(json.loads(json.dumps(deep.to_json()))["nodes"]) == 1024


# --- graph and drawing


@pytest.mark.parametrize("name", ["small", "large", "deep", "evil"])
def test_graphviz_reads_the_graph(name: str, request: pytest.FixtureRequest) -> None:
    if not shutil.which("dot"):
        pytest.skip("Graphviz is not installed")
    tree = request.getfixturevalue(name)
    command = ["dot", "-Tplain"]
    run = subprocess.run(command, input=tree.to_dot(levels=None), capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    drawn = {line.split()[1] for line in run.stdout.splitlines() if line.startswith("node ")}
    nodes = {index for index in drawn if re.fullmatch(r"n\d+", index)}
    edges = [line for line in run.stdout.splitlines() if line.startswith("edge ")]
    assert len(edges) == len(drawn) - 1
    if len(tree) < 100:
        assert nodes == {f"n{node.index}" for node in tree}


@pytest.mark.parametrize("name", ["small", "large", "deep", "evil"])
def test_drawings_are_well_formed(name: str, request: pytest.FixtureRequest) -> None:
    tree = request.getfixturevalue(name)
    svg = ElementTree.fromstring(tree._repr_svg_())
    discs = svg.findall(".//{*}circle")
    lines = svg.findall(".//{*}line")
    assert len(discs) == len(lines) + 1 <= 82
    html = tree._repr_html_()
    page = ElementTree.fromstring(html)
    assert page.findall(".//script") == []
    assert len(page.findall(".//details")) == min(len(tree), 40)
    if len(tree) < 40:
        assert len(discs) == len(tree)


def test_names_stay_text(evil: warp_rt.RayTree) -> None:
    for text in (evil._repr_html_(), evil._repr_svg_()):
        assert "<script" not in text
        assert "\x1b" not in text


def test_repr(small: warp_rt.RayTree) -> None:
    assert repr(small) == "<warp_rt.RayTree of pixel (240, 70): 10 nodes, 6 levels>"
    assert repr(small.root).startswith("<TreeNode 0: eye at depth 1, met /World/Mirror/Glass, 10 nodes")
