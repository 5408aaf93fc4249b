# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Drives the builders that start from Morton codes, whose every step runs on the device of the references.

The host learns how large the next level or round is and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.jobs import Executor
from warp_rt.kernels import bvh_linear, bvh_ploc
from warp_rt.kernels.bvh_linear import Run
from warp_rt.kernels.bvh_ploc import Cluster
from warp_rt.kernels.bvh_structs import BinaryNode, BinaryTrees, Reference
from warp_rt.kernels.constants import PLOC_RADIUS, WIDTH

_UNLIMITED = (1 << 31) - 1
_BINARY_NODE_WEIGHT = 8  # a node with its costs beside one reference
# A round is slow that joins less than one in so many clusters that could be, and neighbours are joined in the next one,
# at least half of those of any tree of three or more. So there are at most some 300 rounds, which are as many levels.
_SLOW = 16
_ENOUGH = 128  # packets are filled until less than one in so many can still be joined


def build_linear_trees(
    references: wp.array, ranges: wp.array, counts: np.ndarray, leaf_size: int, executor: Executor
) -> tuple[Any, wp.array]:
    """Return linear trees over references, ``BinaryTrees``, and the slots of their roots, int32, shape [tree_count].

    Args:
        references: ``Reference``, shape [n], tree by tree.
        ranges: ``BuildRange``, shape [tree_count], their boxes.
        counts: int32, shape [tree_count], references of each tree; none is 0.
        leaf_size: References that a leaf holds at most.
        executor: Where these are.
    """
    tree_count = len(counts)
    references, codes = _sort(references, ranges, counts, executor)
    level = executor.empty(tree_count, Run)
    firsts = executor.upload((np.cumsum(counts) - counts).astype(np.int32), wp.int32)
    executor.launch(bvh_linear.start_runs, tree_count, [firsts, executor.upload(counts, wp.int32)], [level])
    levels = []
    while level.shape[0]:
        levels.append(level)
        inner_counts = executor.empty(level.shape[0], wp.int32)
        executor.launch(bvh_linear.split_runs, level.shape[0], [codes, leaf_size], [level, inner_counts])
        inner_ends, inner_count = executor.sum_up(inner_counts)
        below = executor.empty(2 * inner_count, Run)
        executor.launch(bvh_linear.list_halves, level.shape[0], [inner_ends], [level, below])
        level = below
    ends = np.cumsum([level.shape[0] for level in levels])
    trees = _make_trees(int(ends[-1]), references.shape[0], executor)
    for level, end in zip(reversed(levels), reversed(ends.tolist()), strict=True):
        inputs = [references, level, end - level.shape[0], end]
        executor.launch(bvh_linear.write_runs, level.shape[0], inputs, [trees], weight=_BINARY_NODE_WEIGHT)
    return trees, executor.upload(np.arange(tree_count, dtype=np.int32), wp.int32)


def build_clustered_trees(
    references: wp.array, ranges: wp.array, counts: np.ndarray, leaf_size: int, executor: Executor
) -> tuple[Any, wp.array]:
    """Return trees over references by locally ordered clustering; arguments and result as for linear ones."""
    references, _ = _sort(references, ranges, counts, executor)
    clusters = executor.empty(references.shape[0], Cluster)
    chunks = executor.split(counts)
    inputs = [references, chunks.first, chunks.count, chunks.tree]
    executor.launch_uneven(bvh_ploc.start_clusters, chunks.counts, inputs, [clusters])

    following = executor.empty(references.shape[0], wp.int32)
    is_slow, is_done = False, leaf_size == 1
    while not is_done:
        round_ = _pair(clusters, leaf_size, is_slow, executor)
        inputs = [clusters, round_.nearest, round_.sums]
        joined = executor.empty(round_.kept, Cluster)
        executor.launch(bvh_ploc.join_packets, clusters.shape[0], inputs, [following, joined])
        clusters = joined
        is_done = not is_slow and round_.able * _ENOUGH <= round_.kept
        is_slow = not is_slow and round_.joined * _SLOW < round_.able

    leaf_count, tree_count = clusters.shape[0], len(counts)
    trees = _make_trees(2 * leaf_count - tree_count, references.shape[0], executor)
    leaf_counts = executor.empty(leaf_count, wp.int32)
    executor.launch(bvh_ploc.count_references, leaf_count, [clusters], [leaf_counts])
    count_ends, _ = executor.sum_up(leaf_counts)
    inputs = [references, following, count_ends]
    executor.launch(bvh_ploc.write_packets, leaf_count, inputs, [clusters, trees], weight=_BINARY_NODE_WEIGHT)
    slot = leaf_count
    is_slow = False
    while clusters.shape[0] > tree_count:
        round_ = _pair(clusters, _UNLIMITED, is_slow, executor)
        inputs = [clusters, round_.nearest, round_.sums, slot]
        joined = executor.empty(round_.kept, Cluster)
        executor.launch(bvh_ploc.join_nodes, clusters.shape[0], inputs, [trees, joined], weight=_BINARY_NODE_WEIGHT)
        clusters = joined
        slot += round_.joined
        is_slow = not is_slow and round_.joined * _SLOW < round_.able
    roots = executor.empty(tree_count, wp.int32)
    executor.launch(bvh_ploc.write_roots, tree_count, [clusters], [roots])
    return trees, roots


@dataclass(frozen=True)
class _Round:
    """Who is joined with whom."""

    nearest: wp.array
    """int32, shape [n], the cluster that each wants to be joined with."""
    sums: wp.array
    """vec3i, shape [n], running sums of ``mark_pairs``; the last of them:"""
    kept: int
    """Clusters after the round."""
    joined: int
    """Pairs that are joined."""
    able: int
    """Clusters that can be joined with some other one."""


def _pair(clusters: wp.array, capacity: int, is_slow: bool, executor: Executor) -> _Round:
    """Return the next round, after one that joined too few: then neighbours are joined, whether near or not."""
    count = clusters.shape[0]
    nearest = executor.empty(count, wp.int32)
    if is_slow:
        executor.launch(bvh_ploc.pair_neighbors, count, [clusters, capacity], [nearest])
    else:
        inputs = [clusters, capacity, capacity != _UNLIMITED]
        executor.launch(bvh_ploc.find_nearest, count, inputs, [nearest], weight=int(PLOC_RADIUS))
    marks, sums = executor.empty(count, wp.vec3i), executor.empty(count, wp.vec3i)
    executor.launch(bvh_ploc.mark_pairs, count, [nearest], [marks])
    executor.scan(marks, sums)
    return _Round(nearest, sums, *(int(number) for number in sums[-1:].numpy()[0]))


def _sort(references: wp.array, ranges: wp.array, counts: np.ndarray, executor: Executor) -> tuple[wp.array, wp.array]:
    """Return the references in the order of their Morton codes within each tree, and the codes."""
    count = references.shape[0]
    # A radix sort wants room for twice the keys.
    codes, order = executor.empty(2 * count, wp.uint64), executor.empty(2 * count, wp.int32)
    chunks = executor.split(counts)
    inputs: list[Any] = [references, chunks.first, chunks.count, chunks.tree, ranges, (len(counts) - 1).bit_length()]
    executor.launch_uneven(bvh_linear.encode_references, chunks.counts, inputs, [codes, order])
    executor.sort_pairs(codes, order, count)
    gathered = executor.empty(count, Reference)
    executor.launch(bvh_linear.gather_references, count, [references, order], [gathered])
    return gathered, codes


def _make_trees(node_count: int, reference_count: int, executor: Executor) -> Any:
    """Return room for trees."""
    trees = BinaryTrees()
    trees.nodes = executor.empty(node_count, BinaryNode)
    trees.ids = executor.empty(reference_count, wp.int32)
    trees.costs = executor.empty((node_count, int(WIDTH)), wp.float32)
    trees.shares = executor.empty((node_count, int(WIDTH)), wp.int8)
    return trees
