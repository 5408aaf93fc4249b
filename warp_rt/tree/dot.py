# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray tree in the language of Graphviz."""

from __future__ import annotations

from warp_rt.stand_ins import shown_path
from warp_rt.tree.lines import KIND_NAMES, KIND_STYLES, STYLES, whole_of
from warp_rt.tree.nodes import Fate, RayKind, TreeNode
from warp_rt.tree.numbers import color, number, percent
from warp_rt.tree.pixel_tree import PixelTree
from warp_rt.tree.selection import select, share_of
from warp_rt.tree.swatch import ink_on, swatch

NODES_SHOWN = 200
"""Nodes that are drawn where nobody asks for more: Graphviz draws some thousand in a minute."""


def dot_graph(tree: PixelTree, *, levels: int | None = None) -> str:
    """Return a directed graph: a box a node, filled with its colour, an edge a ray, in the colour of its kind.

    Args:
        tree: What to draw.
        levels: Draw all nodes down to this level; None: the ``NODES_SHOWN`` that lead to most of the pixel's light.
    """
    shown = select(tree.roots, nodes=NODES_SHOWN, levels=levels)
    whole = whole_of(tree)
    lines = [
        "digraph ray_tree {",
        f"  label={_quoted(f'pixel ({tree.x}, {tree.y}): I = {color(tree.value)}')};",
        '  labelloc=t; fontname="sans-serif";',
        '  node [shape=box, style=filled, fontname="sans-serif", fontsize=10];',
        '  edge [fontname="sans-serif", fontsize=9];',
    ]
    waiting = list(reversed(tree.roots))
    while waiting:
        node = waiting.pop()
        name = f"n{node.index}"
        if node.index not in shown:
            text = f"{node.size:,} nodes, not shown\nadds {color(node.subtree_contribution)}"
            lines.append(f"  {name} [label={_quoted(text)}, style=dashed];")
            continue
        fill = swatch(node.value, tree)
        lines.append(
            f'  {name} [label={_quoted(_label(node, whole))}, fillcolor="{fill}", fontcolor="{ink_on(fill)}"];'
        )
        lines += _dropped(node, name)
        for child in node.children:
            text = _coefficient(node, child.kind)
            style = f'color="{STYLES[KIND_STYLES[child.kind]]}", fontcolor="{STYLES[KIND_STYLES[child.kind]]}"'
            lines.append(f"  {name} -> n{child.index} [label={_quoted(text)}, {style}];")
        waiting += reversed(node.children)
    return "\n".join([*lines, "}"])


def _dropped(node: TreeNode, name: str) -> list[str]:
    """Return a word in place of each child that was dropped."""
    lines = []
    for kind, fate in ((RayKind.REFLECTION, node.reflection), (RayKind.REFRACTION, node.refraction)):
        if fate in (Fate.THRESHOLD, Fate.DEPTH):
            child, stroke = f"{name}_{kind.name.lower()}", STYLES[KIND_STYLES[kind]]
            lines.append(f'  {child} [label="dropped by {fate.name.lower()}", shape=plaintext, style=""];')
            label = _quoted(_coefficient(node, kind))
            lines.append(f'  {name} -> {child} [label={label}, style=dashed, color="{stroke}", fontcolor="{stroke}"];')
    return lines


def _coefficient(node: TreeNode, kind: RayKind) -> str:
    if kind is RayKind.REFLECTION:
        return f"{'Kr + Kt' if node.is_totally_reflected else 'Kr'} {color(node.reflection_coefficient)}"
    if kind is RayKind.REFRACTION:
        return f"Kt {color(node.kt)}"
    return number(1.0 - node.presence)


def _label(node: TreeNode, whole: tuple[float, float, float]) -> str:
    share = percent(share_of(node.contribution, whole))
    lines = [
        f"{KIND_NAMES[node.kind]} #{node.index}, level {node.depth}",
        shown_path(node.place.prim) if node.place else "background",
        f"{'I' if node.has_left else 'I_local'} = {color(node.local)}" + (f", {share} of the pixel" if share else ""),
    ]
    if not node.has_left:
        lines.insert(2, f"I = {color(node.value)}")
    shadows = [light for light in node.lights if light.occluder]
    lines += [f"{shown_path(s.light)} shadowed by {shown_path(s.occluder.prim)}" for s in shadows[:4] if s.occluder]
    lines += [f"and {len(shadows) - 4} more shadows"] if len(shadows) > 4 else []
    return "\n".join(lines)


def _quoted(text: str) -> str:
    """Return a DOT string: quotes and backslashes, which begin escapes there, are escaped."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\r", " ").replace("\n", "\\n")
    return f'"{escaped}"'
