# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray tree as text, drawn with lines, for terminals of any width."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from warp_rt.tree.equation import nested_equation
from warp_rt.tree.lines import KIND_STYLES, Span, heading, hidden_title, node_lines, node_title, whole_of
from warp_rt.tree.nodes import TreeNode
from warp_rt.tree.numbers import color, number
from warp_rt.tree.pixel_tree import PixelTree
from warp_rt.tree.selection import select

NODES_SHOWN = 30
"""Nodes that are drawn where nobody asks for more: some four screens."""
EQUATION_NODES = 16
"""Nodes that the nested equation writes out: more brackets nobody matches by eye."""
MIN_WIDTH = 48
"""Columns below which lines are not broken any further."""
_UNFOLDED = 1 << 20  # columns: more than any path has
_CHANNELS = ("red", "green", "blue")

Row = tuple[Span, ...]


def tree_rows(tree: PixelTree, *, width: int = 100, levels: int | None = None, folds_heading: bool = True) -> list[Row]:
    """Return the rows of the drawing, each at most ``width`` columns.

    Args:
        tree: What to draw.
        width: Columns that there are.
        folds_heading: Whether the lines about the pixel as a whole keep to them too; programs read these line by line.
        levels: Draw all nodes down to this level; None: the ``NODES_SHOWN`` that lead to most of the pixel's light.
    """
    width = max(width, MIN_WIDTH)
    shown = select(tree.roots, nodes=NODES_SHOWN, levels=levels)
    whole = whole_of(tree)
    room = width if folds_heading else _UNFOLDED
    rows = [row for indent, spans in heading(tree) for row in _fold(spans, room, (), indent)]
    for root, sample in zip(tree.roots, tree.samples, strict=True):
        rows.append(())
        if len(tree.roots) > 1:
            rows.append(((f"sample {sample}: I = {color(root.value)}", "strong"),))
        rows += _subtree(tree, root, shown, whole, width)
    for root, sample in zip(tree.roots, tree.samples, strict=True):
        if root.index in shown:
            rows.append(())
            written = shown & select([root], nodes=EQUATION_NODES)
            title = f"I = I_local + Kr R + Kt T{f' of sample {sample}' if len(tree.roots) > 1 else ''}"
            rest = ", with the value of what is not written out in [ ]" if root.size > len(written) else ""
            rows += _fold(((title, "strong"), (rest, "dim")), width, (), 0)
            rows += _equations(root, written, width)
    return rows


def plain(rows: Sequence[Row]) -> str:
    """Return rows without their styles."""
    return "\n".join("".join(text for text, _ in row).rstrip() for row in rows)


def _equations(root: TreeNode, shown: frozenset[int], width: int) -> Iterator[Row]:
    """Yield the nested equation, channels that read the same together."""
    texts: dict[str, list[int]] = {}
    for channel in range(3):
        equation = nested_equation(root, channel, shown=shown)
        texts.setdefault(f"{number(root.value[channel])} = {equation}", []).append(channel)
    for text, channels in texts.items():
        names = "" if len(channels) == 3 else ", ".join(_CHANNELS[channel] for channel in channels) + ": "
        yield from _fold(((names, "dim"), (text, "")), width, (), 4)


def _subtree(
    tree: PixelTree, root: TreeNode, shown: frozenset[int], whole: tuple[float, float, float], width: int
) -> Iterator[Row]:
    """Yield the rows of a node and of what is shown below it.

    Only where a tree branches does it move to the right, so that a long corridor of mirrors stays readable.
    """
    waiting: list[tuple[TreeNode, Row, Row]] = [(root, (), ())]
    while waiting:
        node, first, rest = waiting.pop()
        if node.index not in shown:
            yield from _fold(hidden_title(node, whole), width, first, 4, rest)
            continue
        yield from _fold(node_title(node, whole), width, first, 4, rest)
        style = KIND_STYLES[node.kind]
        bar: Row = (*rest, ("│ " if node.children else "  ", style))
        for indent, spans in node_lines(node, tree):
            yield from _fold(spans, width, bar, indent + 2, bar, indent)
        below = []
        # A tree too deep for the terminal goes on at the left edge of what room is left.
        is_forked = len(node.children) > 1 and _length(rest) + MIN_WIDTH <= width
        for child in node.children:
            if not is_forked:
                below.append((child, (*rest, ("└", style)), rest))
            elif child is node.children[-1]:
                below.append((child, (*rest, ("└─", style)), (*rest, ("  ", ""))))
            else:
                below.append((child, (*rest, ("├─", style)), (*rest, ("│ ", style))))
        waiting += reversed(below)


def _fold(
    spans: Sequence[Span], width: int, first: Row, hang: int, rest: Row | None = None, indent: int = 0
) -> Iterator[Row]:
    """Yield a line in rows of at most ``width`` columns, broken between words, else within them.

    Args:
        spans: The line.
        width: Columns.
        first: What stands before the first row.
        hang: Columns by which the others are indented.
        rest: What stands before them; None: the same.
        indent: Columns by which the first row is indented.
    """
    rest = first if rest is None else rest
    row: list[Span] = [*first, (" " * indent, "")]
    room = width - _length(row)
    start = True
    for text, style in spans:
        for word in _words(text):
            while word:
                if len(word.rstrip()) > room and not start:
                    yield _joined(row)
                    row = [*rest, (" " * hang, "")]
                    room = width - _length(row)
                    start = True
                    word = word.lstrip()
                piece, word = (word, "") if len(word.rstrip()) <= room else (word[:room], word[room:])
                row.append((piece, style))
                room -= len(piece)
                start = False
    yield _joined(row)


def _joined(row: Sequence[Span]) -> Row:
    """Return a row with neighbours of one style as one."""
    parts = [("".join(text for text, _ in group), style) for style, group in groupby(row, key=lambda span: span[1])]
    return tuple(part for part in parts if part[0])


def _words(text: str) -> list[str]:
    """Return the words with the blanks before each."""
    words: list[str] = []
    for part in text.split(" "):
        words.append(f" {part}" if words else part)
    return words


def _length(row: Sequence[Span]) -> int:
    return sum(len(text) for text, _ in row)
