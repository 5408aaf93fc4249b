# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray tree in a notebook: the drawing, and each node's lines to unfold."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from warp_rt.tree.lines import STYLES, Line, Span, heading, hidden_title, node_lines, node_title, whole_of
from warp_rt.tree.nodes import Color, TreeNode
from warp_rt.tree.pixel_tree import PixelTree
from warp_rt.tree.selection import select
from warp_rt.tree.svg import svg_drawing
from warp_rt.tree.swatch import shown_color

NODES_SHOWN = 40
OPEN_LEVELS = 2
"""Levels that are unfolded at first."""


def notebook_html(tree: PixelTree) -> str:
    """Return HTML without scripts; every name of the scene's is escaped."""
    shown = select(tree.roots, nodes=NODES_SHOWN)
    whole = whole_of(tree)
    patch = f'<span style="background:{shown_color(tree)};padding:0 1.5em"></span>'
    parts = ['<div style="font-family:monospace;font-size:90%">', f"<p>{patch} {_lines(heading(tree))}</p>"]
    parts.append(f'<div style="overflow:auto;max-height:30em">{svg_drawing(tree)}</div>')
    # A list of what is still to be written, for trees can be deeper than Python's calls.
    waiting: list[TreeNode | str] = list(reversed(tree.roots))
    while waiting:
        item = waiting.pop()
        if isinstance(item, str):
            parts.append(item)
        elif item.index not in shown:
            parts.append(f'<div style="margin-left:1.2em">{_spans(hidden_title(item, whole))}</div>')
        else:
            parts.append(_opening(item, tree, whole))
            waiting += ["</details>", *reversed(item.children)]
    return "\n".join([*parts, "</div>"])


def _opening(node: TreeNode, tree: PixelTree, whole: Color) -> str:
    state = ' open="open"' if node.depth <= OPEN_LEVELS else ""
    summary = f"<summary>{_spans(node_title(node, whole))}</summary>"
    body = f'<div style="margin-left:1.2em">{_lines(node_lines(node, tree))}</div>'
    return f'<details{state} style="margin-left:1.2em">{summary}{body}'


def _lines(lines: Iterable[Line]) -> str:
    return "<br/>".join("&#160;" * indent + _spans(spans) for indent, spans in lines)


def _spans(spans: Iterable[Span]) -> str:
    return "".join(_styled(escape(text), style) for text, style in spans)


def _styled(text: str, style: str) -> str:
    if not style:
        return text
    css = f"color:{STYLES[style]}" if STYLES[style] else "font-weight:bold"
    return f'<span style="{css}">{text}</span>'
