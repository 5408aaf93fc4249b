# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray tree as a drawing: levels from top to bottom, a disc a node, a line a ray. Nothing needs to be installed."""

from __future__ import annotations

from html import escape

from warp_rt.stand_ins import shown_path
from warp_rt.tree.lines import KIND_NAMES, KIND_STYLES, STYLES
from warp_rt.tree.nodes import TreeNode
from warp_rt.tree.numbers import color
from warp_rt.tree.pixel_tree import PixelTree
from warp_rt.tree.selection import select
from warp_rt.tree.swatch import ink_on, swatch

NODES_SHOWN = 40
_COLUMN, _ROW, _RADIUS, _MARGIN = 116, 64, 16, 24
_NAME_LENGTH = 15


def svg_drawing(tree: PixelTree, *, levels: int | None = None) -> str:
    """Return an SVG image.

    Args:
        tree: What to draw.
        levels: Draw all nodes down to this level; None: the ``NODES_SHOWN`` that lead to most of the pixel's light.
    """
    shown = select(tree.roots, nodes=NODES_SHOWN, levels=levels)
    places = _layout(tree, shown)
    width = max(x for x, _ in places.values()) + 2 * _MARGIN + _COLUMN - 2 * _RADIUS  # the last name's room
    height = max(y for _, y in places.values()) + 2 * _MARGIN
    lines, discs = [], []
    waiting = list(reversed(tree.roots))
    while waiting:
        node = waiting.pop()
        x, y = (value + _MARGIN for value in places[node.index])
        discs.append(_disc(node, tree, x, y, is_shown=node.index in shown))
        if node.index not in shown:
            continue
        for child in node.children:
            child_x, child_y = (value + _MARGIN for value in places[child.index])
            stroke = STYLES[KIND_STYLES[child.kind]]
            lines.append(
                f'<line x1="{x:g}" y1="{y:g}" x2="{child_x:g}" y2="{child_y:g}" stroke="{stroke}" stroke-width="2"/>'
            )
        waiting += reversed(node.children)
    title = escape(f"Ray tree of pixel ({tree.x}, {tree.y})")
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}" font-family="sans-serif">'
    return "\n".join([head, f"<title>{title}</title>", *lines, *discs, "</svg>"])


def _layout(tree: PixelTree, shown: frozenset[int]) -> dict[int, tuple[float, float]]:
    """Return where each node lies that is drawn: leaves side by side, a parent over the middle of its children."""
    places: dict[int, tuple[float, float]] = {}
    column = 0
    for root in tree.roots:
        drawn: list[tuple[TreeNode, int]] = []
        waiting = [(root, 0)]
        while waiting:
            node, row = waiting.pop()
            drawn.append((node, row))
            if node.index in shown:
                waiting += [(child, row + 1) for child in reversed(node.children)]
        leaves = [(node, row) for node, row in drawn if node.index not in shown or not node.children]
        for node, row in leaves:
            places[node.index] = (column * _COLUMN, row * _ROW)
            column += 1
        for node, row in reversed(drawn):  # children before parents
            if node.index not in places:
                across = [places[child.index][0] for child in node.children]
                places[node.index] = ((across[0] + across[-1]) / 2, row * _ROW)
    return places


def _disc(node: TreeNode, tree: PixelTree, x: float, y: float, *, is_shown: bool) -> str:
    stroke = STYLES[KIND_STYLES[node.kind]]
    fill = swatch(node.value, tree)
    met = shown_path(node.place.prim) if node.place else "background"
    name = met.rsplit("/", 1)[-1]
    name = name if len(name) <= _NAME_LENGTH else name[: _NAME_LENGTH - 1] + "…"
    if not is_shown:
        name = f"{node.size:,} nodes"
    about = f"{KIND_NAMES[node.kind]} #{node.index}, level {node.depth}, {met}, I = {color(node.value)}"
    dash = "" if is_shown else ' stroke-dasharray="4 3"'
    circle = f'<circle cx="{x:g}" cy="{y:g}" r="{_RADIUS}" fill="{fill}" stroke="{stroke}" stroke-width="3"{dash}/>'
    middle = 'text-anchor="middle"'
    number = f'<text x="{x:g}" y="{y + 4:g}" font-size="11" {middle} fill="{ink_on(fill)}">{node.index}</text>'
    beside = f'x="{x + _RADIUS + 5:g}" y="{y + 4:g}"'
    label = f'<text {beside} font-size="10" fill="#808080">{escape(name)}</text>'
    return f"<g><title>{escape(about)}</title>{circle}{number}{label}</g>"
