# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which nodes of a tree are shown, where it has more than anybody reads."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

from warp_rt.tree.nodes import TreeNode


def select(roots: Sequence[TreeNode], *, nodes: int, levels: int | None = None) -> frozenset[int]:
    """Return the indices of the nodes to show; where a node is shown, so is all on the way to it.

    Args:
        roots: Of the trees.
        nodes: How many at most, those with the largest share of the pixel below them first; unless ``levels`` is given.
        levels: Show all nodes down to this level.
    """
    if levels is not None:
        return frozenset(node.index for root in roots for node in root.walk() if node.depth <= levels)
    shown: set[int] = set()
    waiting = [(-weight_of(root), root.index, root) for root in roots]
    heapq.heapify(waiting)
    while waiting and len(shown) < nodes:
        _, _, node = heapq.heappop(waiting)
        shown.add(node.index)
        for child in node.children:
            heapq.heappush(waiting, (-weight_of(child), child.index, child))
    return frozenset(shown)


def weight_of(node: TreeNode) -> float:
    """Return how much of the pixel comes from a node and all below it, as one number."""
    return sum(abs(channel) for channel in node.subtree_contribution)


def share_of(amount: Sequence[float], whole: Sequence[float]) -> float | None:
    """Return the share of one colour in another, over all channels; None where the whole is black."""
    total = sum(whole)
    return sum(amount) / total if total > 0 else None
