# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lecture's nested equation with the numbers of one tree: I_local + Kr (I'_local + K'r (...) + K't (...))."""

from __future__ import annotations

from collections.abc import Callable, Collection

from warp_rt.tree.nodes import Fate, RayKind, TreeNode
from warp_rt.tree.numbers import number


def nested_equation(
    root: TreeNode,
    channel: int,
    *,
    shown: Collection[int] | None = None,
    times: str = " ",
    form: Callable[[float], str] = number,
) -> str:
    """Return the right side of the equation for one channel.

    A child that was dropped counts 0, and so it stands there. What is not shown stands as its value, in brackets.

    Args:
        root: The eye ray's node.
        channel: 0 to 2.
        shown: Indices of the nodes that are written out; None: all.
        times: What stands between a coefficient and what it multiplies.
        form: How a number is written.
    """
    texts: dict[int, str] = {}
    for node in reversed([*root.walk()]):  # children come before their parents
        if shown is None or node.index in shown:
            texts[node.index] = _own(node, channel, texts, times, form)
        else:
            texts[node.index] = f"[{form(node.value[channel])}]" if shown is not None else ""
        for child in node.children:
            texts.pop(child.index, None)
    return texts[root.index]


def _own(node: TreeNode, channel: int, texts: dict[int, str], times: str, form: Callable[[float], str]) -> str:
    below = {child.kind: texts[child.index] for child in node.children}
    parts = [form(node.local[channel])]
    for kind, fate, coefficient in (
        (RayKind.REFLECTION, node.reflection, node.reflection_coefficient[channel]),
        (RayKind.REFRACTION, node.refraction, node.kt[channel]),
    ):
        if fate not in (Fate.NOT_ASKED, Fate.TOTAL_REFLECTION):
            parts.append(_product(form(coefficient), below.get(kind, "0"), times))
    own = " + ".join(parts)
    if node.presence == 1.0:
        return own
    behind = _product(form(1.0 - node.presence), below.get(RayKind.PASSAGE, "0"), times)
    return f"{_product(form(node.presence), own, times)} + {behind}"


def _product(coefficient: str, value: str, times: str) -> str:
    return f"{coefficient}{times}{value}" if value.startswith("[") else f"{coefficient}{times}({value})"
