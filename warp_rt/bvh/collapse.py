# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Drives the kernels that make binary trees wide, level by level: opened downwards, summed upwards, then written."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.jobs import Executor
from warp_rt.errors import LimitError
from warp_rt.kernels import bvh_collapse
from warp_rt.kernels.bvh_collapse import WideNode
from warp_rt.kernels.bvh_structs import Box
from warp_rt.kernels.constants import NODE_FLOATS, WIDTH

_WIDE_NODE_WEIGHT = 32  # a wide node beside one reference: its children are found in some microseconds


@dataclass(frozen=True)
class Layout:
    """Where the nodes and leaves of each tree lie, and what that tells."""

    tree_node: np.ndarray
    """int32, shape [tree_count], number of the tree's first node."""
    node_counts: np.ndarray
    """int32, shape [tree_count]; 0 where the whole tree is one leaf."""
    tree_leaf: np.ndarray
    """int32, shape [tree_count], number of the tree's first leaf."""
    leaf_counts: np.ndarray
    """int32, shape [tree_count]."""
    depths: np.ndarray
    """int32, shape [tree_count], levels of wide nodes."""
    stack_sizes: np.ndarray
    """int32, shape [tree_count], entries that a traversal can leave on its stack at once, whatever the ray."""
    levels: tuple[wp.array, ...]
    """The nodes of all trees by level, the roots first: int32, places in the array of nodes, or -1 for no node."""
    leaf_trees: wp.array
    """int32, shape [leaf_count], tree of each leaf."""

    @property
    def leaf_count(self) -> int:
        """Leaves of all trees."""
        return int(self.leaf_counts.sum())

    @property
    def roots(self) -> np.ndarray:
        """Child codes of the trees: int32, shape [tree_count]."""
        return np.where(self.node_counts > 0, self.tree_node, -1 - self.tree_leaf).astype(np.int32)

    def move(self, executor: Executor) -> Layout:
        """Return the same layout on an executor's device."""
        levels = tuple(executor.adopt(numbers) for numbers in self.levels)
        return replace(self, levels=levels, leaf_trees=executor.adopt(self.leaf_trees))


@dataclass(frozen=True)
class Forest:
    """Wide trees in one array of nodes, and the leaves that the caller packs; arrays are on the executor's device."""

    trees: Any
    """``BinaryTrees`` over the references."""
    leaf_slots: wp.array
    """int32, shape [leaf_count], slot of each leaf's binary node, tree by tree."""
    layout: Layout
    boxes: wp.array
    """``Box``, shape [tree_count]."""
    costs: wp.array
    """float32, shape [tree_count], half area of all nodes and leaves: the expected number of visits times the half
    area of the root's box."""
    nodes: wp.array
    """float32, shape [node_count * 128]."""


def check_words(what: str, count: int, words: int) -> None:
    """Raise LimitError where traversal, which counts words by int32, could not reach the last of ``count`` records."""
    if count * words >= 1 << 31:
        raise LimitError(f"{count} {what} are more than a bounding volume hierarchy can hold ({(1 << 31) // words})")


def collapse_forest(trees: Any, roots: wp.array, node_offset: int, executor: Executor) -> Forest:
    """Return the wide trees of binary ones.

    Args:
        trees: ``BinaryTrees``, their costs known.
        roots: int32, shape [tree_count], slots of the trees' roots.
        node_offset: Number of the first node, where others come before it in memory.
        executor: Where the trees are.

    Raises:
        LimitError: There are more nodes than 32-bit indices reach.
    """
    tree_count = roots.shape[0]
    nothing = executor.empty(0, WideNode)
    level = executor.empty(tree_count, WideNode)
    executor.launch(bvh_collapse.start_levels, tree_count, [roots], [level])
    levels, children = [], []
    while level.shape[0]:
        levels.append(level)
        children.append(executor.empty((level.shape[0], int(WIDTH)), wp.int32))
        level = _open_level(trees, level, children[-1], executor)
    for at in reversed(range(len(levels))):
        below = levels[at + 1] if at + 1 < len(levels) else nothing
        executor.launch(bvh_collapse.summarize_nodes, levels[at].shape[0], [below, children[at]], [levels[at]])

    summaries = levels[0].numpy()
    node_counts, leaf_counts = summaries["node_count"].copy(), summaries["leaf_count"].copy()
    node_count, leaf_count = int(node_counts.sum(dtype=np.int64)), int(leaf_counts.sum(dtype=np.int64))
    check_words("nodes", node_offset + node_count, NODE_FLOATS)
    tree_node = (np.cumsum(node_counts) - node_counts).astype(np.int32)
    tree_leaf = (np.cumsum(leaf_counts) - leaf_counts).astype(np.int32)
    places = [executor.upload(tree_node, wp.int32), executor.upload(tree_leaf, wp.int32)]
    executor.launch(bvh_collapse.place_roots, tree_count, places, [levels[0]])
    nodes = executor.empty(node_count * NODE_FLOATS, wp.float32)
    leaf_slots, leaf_trees = executor.empty(leaf_count, wp.int32), executor.empty(leaf_count, wp.int32)
    numbers = tuple(executor.empty(level.shape[0], wp.int32) for level in levels)
    for at, level in enumerate(levels):
        inputs = [trees, level, children[at], node_offset]
        below = levels[at + 1] if at + 1 < len(levels) else nothing
        outputs = [below, numbers[at], leaf_slots, leaf_trees, nodes]
        executor.launch(bvh_collapse.write_nodes, level.shape[0], inputs, outputs, weight=_WIDE_NODE_WEIGHT)

    boxes, costs = executor.empty(tree_count, Box), executor.empty(tree_count, wp.float32)
    executor.launch(bvh_collapse.summarize_trees, tree_count, [trees, roots], [boxes, costs])
    layout = Layout(
        tree_node=node_offset + tree_node,
        node_counts=node_counts,
        tree_leaf=tree_leaf,
        leaf_counts=leaf_counts,
        depths=summaries["depth"].copy(),
        stack_sizes=summaries["stack_size"].copy(),
        levels=numbers,
        leaf_trees=leaf_trees,
    )
    return Forest(trees, leaf_slots, layout, boxes, costs, nodes)


def _open_level(trees: Any, level: wp.array, children: wp.array, executor: Executor) -> wp.array:
    """Write the children of a level's nodes and return the level below: ``WideNode``, shape [n]."""
    count = level.shape[0]
    inner_counts = executor.empty(count, wp.int32)
    executor.launch(bvh_collapse.open_nodes, count, [trees], [level, children, inner_counts], weight=_WIDE_NODE_WEIGHT)
    inner_ends, below_count = executor.sum_up(inner_counts)
    below = executor.empty(below_count, WideNode)
    executor.launch(bvh_collapse.list_children, count, [trees, level, inner_ends], [children, below])
    return below
