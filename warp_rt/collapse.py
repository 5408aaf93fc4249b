# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Drives the kernels that make binary trees wide: parts of trees are counted, numbered, and then written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.binary_trees import BinaryForest
from warp_rt.errors import LimitError
from warp_rt.jobs import as_warp, host_array, launch_jobs
from warp_rt.kernels import bvh_collapse
from warp_rt.kernels.bvh_collapse import Parts, WideNode
from warp_rt.kernels.bvh_structs import TreeSummary
from warp_rt.kernels.constants import NODE_FLOATS, WIDTH
from warp_rt.workers import Workers


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

    @property
    def leaf_count(self) -> int:
        """Leaves of all trees."""
        return int(self.leaf_counts.sum())

    @property
    def roots(self) -> np.ndarray:
        """Child codes of the trees: int32, shape [tree_count]."""
        return np.where(self.node_counts > 0, self.tree_node, -1 - self.tree_leaf).astype(np.int32)


@dataclass(frozen=True)
class Forest:
    """Wide trees in one array of nodes, and the leaves that the caller packs."""

    trees: Any
    """``BinaryTrees`` over the references."""
    leaf_slots: wp.array
    """int32, shape [leaf_count], slot of each leaf's binary node, tree by tree."""
    tree_first: np.ndarray
    """int32, shape [tree_count], first primitive."""
    layout: Layout
    costs: np.ndarray
    """float32, shape [tree_count], half area of all nodes and leaves: the expected number of visits times the half
    area of the root's box."""
    nodes: np.ndarray
    """float32, shape [node_count * 128]."""


def check_words(what: str, count: int, words: int) -> None:
    """Raise LimitError where traversal, which counts words by int32, could not reach the last of ``count`` records."""
    if count * words >= 1 << 31:
        raise LimitError(f"{count} {what} are more than a bounding volume hierarchy can hold ({(1 << 31) // words})")


def collapse_forest(binary: BinaryForest, ranges: np.ndarray, node_offset: int, workers: Workers) -> Forest:
    """Return the wide trees of binary ones.

    Args:
        binary: The binary trees.
        ranges: ``BuildRange``, shape [tree_count], their references.
        node_offset: Number of the first node, where others come before it in memory.
        workers: Threads to use.

    Raises:
        LimitError: There are more nodes than 32-bit indices reach.
    """
    walk = _Walk(binary, node_offset, workers)
    upper = np.flatnonzero(walk.is_above[binary.roots]).astype(np.int32)
    lower = np.flatnonzero(walk.is_above[binary.roots] == 0).astype(np.int32)
    # The levels above all subtrees are walked first: they tell where the rest is cut into parts.
    sizes = WIDTH * binary.count_subtrees(ranges[upper])
    cuts = np.zeros(int(sizes.sum()), WideNode.numpy_dtype())
    above = _Parts(binary.roots[upper], upper, room=ranges["first"][upper], cut=np.cumsum(sizes) - sizes)
    walk.count(above, np.ones(len(upper)), cuts)
    cut_counts = above.summaries["cut_count"]
    kept = np.repeat(above.cut - np.cumsum(cut_counts) + cut_counts, cut_counts) + np.arange(cut_counts.sum())
    below = _Parts(
        np.concatenate([cuts["slot"][kept], binary.roots[lower]]),
        np.concatenate([np.repeat(upper, cut_counts), lower]),
    )
    shares = ranges["count"] / np.maximum(np.bincount(below.tree, minlength=len(ranges)), 1)
    walk.count(below, shares[below.tree], cuts[:0])

    summaries = np.concatenate([above.summaries, below.summaries])
    tree = np.concatenate([above.tree, below.tree])
    order = np.argsort(tree, kind="stable")
    node_counts, leaf_counts = summaries["node_count"], summaries["leaf_count"]
    check_words("nodes", node_offset + int(node_counts.sum(dtype=np.int64)), NODE_FLOATS)
    first_node, first_leaf = np.empty(len(order), np.int32), np.empty(len(order), np.int32)
    first_node[order] = np.cumsum(node_counts[order]) - node_counts[order]
    first_leaf[order] = np.cumsum(leaf_counts[order]) - leaf_counts[order]
    cuts["number"][kept] = first_node[len(upper) : len(upper) + len(kept)]
    nodes = host_array(int(node_counts.sum()) * NODE_FLOATS, np.float32)
    leaf_slots = as_warp(np.empty(int(leaf_counts.sum()), np.int32), wp.int32)
    for parts, rows in ((above, slice(0, len(upper))), (below, slice(len(upper), None))):
        walk.pack(parts, first_node[rows], first_leaf[rows], cuts, leaf_slots, nodes)

    # What lies on the way to a part adds to its own.
    depths, stack_sizes = summaries["depth"].copy(), summaries["stack_size"].copy()
    is_cut = slice(len(upper), len(upper) + len(kept))
    depths[is_cut] += cuts["level"][kept]
    stack_sizes[is_cut] += cuts["entries"][kept]
    starts = np.flatnonzero(np.diff(tree[order], prepend=-1))
    layout = Layout(
        tree_node=node_offset + first_node[order][starts],
        node_counts=np.add.reduceat(node_counts[order], starts),
        tree_leaf=first_leaf[order][starts],
        leaf_counts=np.add.reduceat(leaf_counts[order], starts),
        depths=np.maximum.reduceat(depths[order], starts),
        stack_sizes=np.maximum.reduceat(stack_sizes[order], starts),
    )
    return Forest(
        trees=binary.trees,
        leaf_slots=leaf_slots,
        tree_first=np.ascontiguousarray(ranges["first"]),
        layout=layout,
        costs=binary.trees.costs.numpy()[binary.roots, 0],
        nodes=nodes,
    )


class _Parts:
    """Parts of trees that are walked side by side; see ``bvh_collapse.Parts``."""

    def __init__(
        self, roots: np.ndarray, tree: np.ndarray, room: np.ndarray | None = None, cut: np.ndarray | None = None
    ) -> None:
        self.tree = tree
        """int32, shape [n], tree of each part."""
        self.cut = np.zeros(len(roots), np.int32) if cut is None else cut.astype(np.int32)
        self.summaries = np.zeros(len(roots), TreeSummary.numpy_dtype())
        self.weights = np.ones(len(roots))
        self.data = Parts()
        self.data.root = as_warp(np.ascontiguousarray(roots, np.int32), wp.int32)
        self.data.is_above = int(room is not None)
        self.data.room = as_warp(np.zeros(0, np.int32) if room is None else np.ascontiguousarray(room), wp.int32)
        self.data.cut = as_warp(self.cut, wp.int32)


class _Walk:
    """Both walks through the wide nodes of parts: one to count, one to write."""

    def __init__(self, binary: BinaryForest, node_offset: int, workers: Workers) -> None:
        above = np.array(binary.above, np.int32)
        self.is_above = np.zeros(len(binary.nodes), np.int8)
        self.is_above[above] = 1
        self._trees = binary.trees
        self._pending = as_warp(np.empty(len(binary.nodes) // 2 + 1, WideNode.numpy_dtype()), WideNode)
        self._node_offset = node_offset
        self._workers = workers
        outputs = [self._trees]
        wp.launch(bvh_collapse.evaluate_above, 1, inputs=[as_warp(above, wp.int32)], outputs=outputs, device="cpu")

    def count(self, parts: _Parts, weights: np.ndarray, cuts: np.ndarray) -> None:
        """Set the parts' summaries, and the slots, levels and entries of their cuts."""
        parts.weights = weights
        nothing = np.empty(0, np.int32), np.empty(0, np.float32)
        self._launch(parts, False, cuts, as_warp(nothing[0], wp.int32), nothing[1])

    def pack(
        self,
        parts: _Parts,
        first_node: np.ndarray,
        first_leaf: np.ndarray,
        cuts: np.ndarray,
        leaf_slots: wp.array,
        nodes: np.ndarray,
    ) -> None:
        """Write the parts' nodes and the slots of their leaves."""
        parts.data.node = as_warp(np.ascontiguousarray(first_node), wp.int32)
        parts.data.leaf = as_warp(np.ascontiguousarray(first_leaf), wp.int32)
        self._launch(parts, True, cuts, leaf_slots, nodes)

    def _launch(
        self, parts: _Parts, is_packing: bool, cuts: np.ndarray, leaf_slots: wp.array, nodes: np.ndarray
    ) -> None:
        is_above = as_warp(self.is_above, wp.int8)
        inputs = [self._trees, is_above, parts.data, self._node_offset, self._pending, is_packing]
        summaries = as_warp(parts.summaries, TreeSummary)
        outputs: list[Any] = [as_warp(cuts, WideNode), summaries, leaf_slots, as_warp(nodes, wp.float32)]
        launch_jobs(self._workers, bvh_collapse.walk_parts, parts.weights, inputs, outputs)
