# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Drives the kernels that build trees: a forest at once, over shared arrays and CPU threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.bvh.binary_trees import BinaryForest
from warp_rt.bvh.collapse import Forest, check_words, collapse_forest
from warp_rt.bvh.morton_trees import build_clustered_trees, build_linear_trees
from warp_rt.bvh.reinsertion import reinsert_subtrees
from warp_rt.device.jobs import Chunks, Executor, as_warp
from warp_rt.errors import LimitError
from warp_rt.kernels import (
    bvh_build,
    bvh_clusters,
    bvh_collapse,
    bvh_instances,
    bvh_linear,
    bvh_ploc,
    bvh_references,
    bvh_reinsert,
)
from warp_rt.kernels.bvh_structs import BuildRange, Reference
from warp_rt.kernels.constants import LEAF_FLOATS, WIDTH
from warp_rt.scene.placement import Placement, blocks

_TOP_DOWN = {"sah": bvh_build.SAH, "median": bvh_build.MEDIAN, "midpoint": bvh_build.MIDPOINT}
_PARALLEL = {"lbvh": build_linear_trees, "ploc": build_clustered_trees}
_SPLITTING = (bvh_build, bvh_clusters)
BUILDER_MODULES = dict.fromkeys(_TOP_DOWN, _SPLITTING) | {
    "sah": (*_SPLITTING, bvh_reinsert),
    "lbvh": (bvh_linear,),
    "ploc": (bvh_linear, bvh_ploc),
}
"""Kernel files of each builder, besides those that all have in common."""


def builder_device(builder: str, device: str) -> str:
    """Return where a builder builds a hierarchy for a device: there, if each of its steps can, else on the CPU."""
    return device if builder in _PARALLEL else "cpu"


def builder_executor(builder: str, executor: Executor) -> Executor:
    """Return what runs a builder for a hierarchy on an executor's device."""
    return Executor(builder_device(builder, executor.device), executor.workers)


@dataclass(frozen=True)
class References:
    """Boxes around primitives, grouped by tree, on an executor's device."""

    array: wp.array
    """``Reference``, shape [n]."""
    ranges: wp.array
    """``BuildRange``, shape [tree_count]: each tree's references and their boxes."""
    counts: np.ndarray
    """int32, shape [tree_count], references of each tree."""

    def move(self, executor: Executor) -> References:
        """Return the same references on another executor's device."""
        return References(executor.adopt(self.array), executor.adopt(self.ranges), self.counts)


def refer_to_triangles(points: wp.array, triangles: wp.array, counts: np.ndarray, executor: Executor) -> References:
    """Return the references of triangles.

    Args:
        points: vec3, shape [n].
        triangles: int32, shape [3 m], rows of ``points``, grouped by tree.
        counts: int32, shape [tree_count], triangles of each tree; none is 0.
        executor: Where points and triangles are.
    """
    chunks = executor.split(counts)
    references = executor.empty(int(counts.sum()), Reference)
    ranges = executor.empty(len(chunks.counts), BuildRange)
    inputs = [points, triangles, chunks.first, chunks.count]
    executor.launch_uneven(bvh_references.refer_to_triangles, chunks.counts, inputs, [references, ranges])
    return References(references, _merge_ranges(ranges, chunks, executor), counts)


def refer_to_instances(
    tree: wp.array,
    roots: wp.array,
    boxes: wp.array,
    nodes: wp.array,
    placement: Placement,
    placed: np.ndarray,
    executor: Executor,
) -> References:
    """Return the references of one tree over instances: world boxes that contain all that float32 rays can hit.

    Args:
        tree: int32, shape [n], n >= 1: tree of each instance's mesh.
        roots: int32, shape [tree_count], child codes of those trees.
        boxes: ``Box``, shape [tree_count], their local boxes.
        nodes: Their nodes.
        placement: Their transforms.
        placed: int32, shape [n], their rows there.
        executor: Where the arrays are.
    """
    references = executor.empty(len(placed), Reference)

    def refer(rows: slice) -> None:
        transforms = executor.upload(placement.world_from_local(placed[rows]), wp.float64)
        inputs = [tree, roots, boxes, nodes, transforms, rows.start, 0]
        kernel = bvh_instances.refer_to_instances
        wp.launch(kernel, rows.stop - rows.start, inputs=inputs, outputs=[references], device=executor.device)

    executor.map(refer, blocks(len(placed)))
    return measure_references(references, np.array([len(placed)], np.int32), executor)


def cost_instances(
    references: References, tree: wp.array, boxes: wp.array, costs: wp.array, executor: Executor
) -> float:
    """Return the half area of all nodes and leaves below instances, each scaled as its tree's box is to its world box.

    Args:
        references: Of the instances.
        tree: int32, shape [n], tree of each.
        boxes: ``Box``, shape [tree_count].
        costs: float32, shape [tree_count], half areas below the trees.
        executor: Where the arrays are.
    """
    each = executor.empty(tree.shape[0], wp.float64)
    inputs = [references.array, tree, boxes, costs]
    executor.launch(bvh_instances.cost_instances, tree.shape[0], inputs, [each])
    return executor.total(each)


def rank_primitives(forest: Forest, executor: Executor) -> wp.array:
    """Return the leaf of each primitive of a forest of one tree with leaves of one: int32, shape [leaf_count]."""
    ranks = executor.empty(forest.layout.leaf_count, wp.int32)
    executor.launch(bvh_collapse.rank_primitives, ranks.shape[0], [forest.trees, forest.leaf_slots], [ranks])
    return ranks


def measure_references(references: wp.array, counts: np.ndarray, executor: Executor) -> References:
    """Return references with their boxes.

    Args:
        references: Tree by tree.
        counts: How many each tree has, int, shape [trees], none of them 0.
        executor: Runs the kernels.
    """
    chunks = executor.split(counts)
    ranges = executor.empty(len(chunks.counts), BuildRange)
    inputs = [references, chunks.first, chunks.count]
    executor.launch_uneven(bvh_references.measure_chunks, chunks.counts, inputs, [ranges])
    return References(references, _merge_ranges(ranges, chunks, executor), counts)


def _merge_ranges(ranges: wp.array, chunks: Chunks, executor: Executor) -> wp.array:
    """Return the range of each whole tree from those of its chunks."""
    while len(chunks.counts) > len(chunks.per_tree):
        chunks = executor.split(chunks.per_tree)
        merged = executor.empty(len(chunks.counts), BuildRange)
        inputs = [ranges, chunks.first, chunks.count]
        executor.launch(bvh_references.merge_ranges, len(chunks.counts), inputs, [merged])
        ranges = merged
    return ranges


def build_forest(
    references: References, *, leaf_size: int, builder: str, executor: Executor, node_offset: int = 0
) -> Forest:
    """Return wide trees over references.

    Args:
        references: What to build over; at least one in each tree.
        leaf_size: References that a leaf holds at most, a power of two.
        builder: One of ``options.BUILDERS``.
        executor: Where to build; what it has to do with does not change the result.
        node_offset: Number of the forest's first node, where others come before it in memory.

    Raises:
        LimitError: The arrays would have more elements than 32-bit indices reach.
    """
    # Trees over instances, whose leaves hold one, win nothing by it.
    is_reinserted = builder == "sah" and references.counts.max() > leaf_size > 1
    trees, roots = build_binary_trees(
        references, leaf_size=leaf_size, builder=builder, executor=executor, keeps_costs=is_reinserted
    )
    if is_reinserted:
        reinsert_subtrees(trees, roots, executor)
    return collapse_forest(trees, roots, node_offset, executor)


def build_binary_trees(
    references: References, *, leaf_size: int, builder: str, executor: Executor, keeps_costs: bool = False
) -> tuple[Any, wp.array]:
    """Return the binary trees that ``build_forest`` makes wide; arguments and errors as there.

    Args:
        references: What to build over.
        leaf_size: References that a leaf holds at most.
        builder: One of ``options.BUILDERS``.
        executor: Where to build.
        keeps_costs: Whether those of all nodes are kept, as reinsertion needs them, not only the roots'.

    Returns:
        ``BinaryTrees``, those costs known, and the slots of their roots, int32, shape [tree_count].
    """
    count = references.array.shape[0]
    if 2 * count * WIDTH >= 1 << 31:
        raise LimitError(f"{count} primitives are more than a bounding volume hierarchy can hold (2^26)")
    if builder in _PARALLEL:
        return _PARALLEL[builder](references.array, references.ranges, references.counts, leaf_size, executor)
    leaf_bits = leaf_size.bit_length() - 1
    ranges = references.ranges.numpy()
    building = _TOP_DOWN[builder]
    binary = BinaryForest(references.array, ranges, leaf_bits, building, executor.workers, keeps_costs=keeps_costs)
    return binary.trees, as_warp(binary.roots, wp.int32)


def pack_triangles(
    forest: Forest, points: wp.array, triangles: wp.array, tree_first: wp.array, executor: Executor
) -> wp.array:
    """Return the leaf packets of trees over triangles: float32, shape [leaf_count * LEAF_FLOATS].

    Args:
        forest: From the references of ``triangles``.
        points: vec3, shape [n].
        triangles: int32, shape [3 m].
        tree_first: int32, shape [tree_count], first triangle of each tree.
        executor: Where all these are.

    Raises:
        LimitError: There are more packets than 32-bit indices reach.
    """
    count = forest.layout.leaf_count
    check_words("leaf packets", count, LEAF_FLOATS)
    leaves = executor.empty(count * LEAF_FLOATS, wp.float32)
    inputs = [forest.trees, points, triangles, forest.leaf_slots, forest.layout.leaf_trees, tree_first]
    executor.launch(bvh_collapse.pack_triangles, count, inputs, [leaves], weight=int(WIDTH))
    return leaves
