# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Drives the kernels that build trees: a forest at once, over shared arrays and CPU threads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_rt.binary_trees import BinaryForest
from warp_rt.collapse import Forest, check_words, collapse_forest
from warp_rt.errors import LimitError
from warp_rt.jobs import Chunks, as_warp, host_array, launch_jobs, split_chunks
from warp_rt.kernels import bvh_build, bvh_collapse, bvh_instances
from warp_rt.kernels.bvh_structs import BuildRange, Reference
from warp_rt.kernels.constants import LEAF_FLOATS, WIDTH
from warp_rt.placement import Placement
from warp_rt.workers import Workers

BUILDERS = {
    "sah": bvh_build.SAH,
    "median": bvh_build.MEDIAN,
    "midpoint": bvh_build.MIDPOINT,
    "lbvh": bvh_build.LBVH,
}


@dataclass(frozen=True)
class References:
    """Boxes around primitives, grouped by tree."""

    array: wp.array
    """``Reference``, shape [n]."""
    ranges: np.ndarray
    """``BuildRange``, shape [tree_count]: each tree's references and their boxes."""


def refer_to_triangles(points: wp.array, triangles: wp.array, counts: np.ndarray, workers: Workers) -> References:
    """Return the references of triangles.

    Args:
        points: vec3, shape [n].
        triangles: int32, shape [3 m], rows of ``points``, grouped by tree.
        counts: int32, shape [tree_count], triangles of each tree; none is 0.
        workers: Threads to use.
    """
    tree_first = (np.cumsum(counts) - counts).astype(np.int32)
    chunks = split_chunks(counts)
    references = as_warp(host_array(int(counts.sum()), Reference.numpy_dtype()), Reference)
    chunk_ranges = np.empty(len(chunks.tree), BuildRange.numpy_dtype())
    launch_jobs(
        workers,
        bvh_build.refer_to_triangles,
        chunks.count,
        [
            points,
            triangles,
            as_warp(tree_first[chunks.tree] + chunks.first, wp.int32),
            as_warp(chunks.count, wp.int32),
        ],
        [references, as_warp(chunk_ranges, BuildRange)],
    )
    return References(references, _tree_ranges(chunks, chunk_ranges, tree_first, counts))


def refer_to_instances(
    tree: np.ndarray,
    roots: np.ndarray,
    boxes: np.ndarray,
    nodes: np.ndarray,
    placement: Placement,
    placed: np.ndarray,
    workers: Workers,
) -> References:
    """Return the references of one tree over instances: world boxes that contain all that float32 rays can hit.

    Args:
        tree: int32, shape [n], n >= 1: tree of each instance's mesh.
        roots: int32, shape [tree_count], child codes of those trees.
        boxes: float32, shape [tree_count, 2, 3], their local boxes.
        nodes: Their nodes.
        placement: Their transforms.
        placed: int32, shape [n], their rows there.
        workers: Threads to use.
    """
    count = np.array([len(tree)], np.int32)
    chunks = split_chunks(count)
    references = as_warp(host_array(len(tree), Reference.numpy_dtype()), Reference)
    chunk_ranges = np.empty(len(chunks.tree), BuildRange.numpy_dtype())
    shared = [
        as_warp(tree, wp.int32),
        as_warp(roots, wp.int32),
        wp.array(np.ascontiguousarray(boxes, np.float32), dtype=wp.vec3, ndim=2, device="cpu", copy=False),
        as_warp(nodes, wp.float32),
    ]

    def refer(chunk: int, _scratch: None) -> None:
        first, end = int(chunks.first[chunk]), int(chunks.first[chunk] + chunks.count[chunk])
        transforms = as_warp(placement.world_from_local(placed[first:end]), wp.float64)
        inputs = [*shared, transforms, first, end, chunk]
        outputs = [references, as_warp(chunk_ranges, BuildRange)]
        wp.launch(bvh_instances.refer_to_instances, 1, inputs=inputs, outputs=outputs, device="cpu")

    workers.map(refer, range(len(chunks.first)))
    return References(references, _tree_ranges(chunks, chunk_ranges, np.zeros(1, np.int32), count))


def _tree_ranges(chunks: Chunks, chunk_ranges: np.ndarray, tree_first: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the range of each whole tree from those of its chunks."""
    starts = np.flatnonzero(chunks.first == 0)
    ranges = np.empty(len(counts), BuildRange.numpy_dtype())
    for name in ("low", "centroid_low"):
        ranges[name] = np.minimum.reduceat(chunk_ranges[name], starts, axis=0)
    for name in ("high", "centroid_high"):
        ranges[name] = np.maximum.reduceat(chunk_ranges[name], starts, axis=0)
    ranges["first"] = tree_first
    ranges["count"] = counts
    ranges["node"] = 2 * tree_first
    return ranges


def build_forest(
    references: References, *, leaf_size: int, builder: str, workers: Workers, node_offset: int = 0
) -> Forest:
    """Return wide trees over references.

    Args:
        references: What to build over; at least one in each tree.
        leaf_size: References that a leaf holds at most, a power of two.
        builder: One of ``BUILDERS``.
        workers: Threads to use; their number does not change the result.
        node_offset: Number of the forest's first node, where others come before it in memory.

    Raises:
        LimitError: The arrays would have more elements than 32-bit indices reach.
    """
    binary = build_binary_forest(references, leaf_size=leaf_size, builder=builder, workers=workers)
    return collapse_forest(binary, references.ranges, node_offset, workers)


def build_binary_forest(references: References, *, leaf_size: int, builder: str, workers: Workers) -> BinaryForest:
    """Return the binary trees that ``build_forest`` makes wide; arguments and errors as there."""
    count = references.array.shape[0]
    if 2 * count * WIDTH >= 1 << 31:
        raise LimitError(f"{count} primitives are more than a bounding volume hierarchy can hold (2^26)")
    codes = as_warp(np.empty(0, np.uint64), wp.uint64)
    if builder == "lbvh":
        references, codes = _sort_by_morton_code(references, workers)
    leaf_bits = leaf_size.bit_length() - 1
    return BinaryForest(references.array, codes, references.ranges, leaf_bits, BUILDERS[builder], workers)


def _sort_by_morton_code(references: References, workers: Workers) -> tuple[References, wp.array]:
    """Return the references in the order of their Morton codes within each tree, and the codes."""
    ranges = references.ranges
    count = references.array.shape[0]
    chunks = split_chunks(ranges["count"])
    # A radix sort wants room for twice the keys.
    codes = as_warp(np.empty(2 * count, np.uint64), wp.uint64)
    order = as_warp(np.empty(2 * count, np.int32), wp.int32)
    launch_jobs(
        workers,
        bvh_build.encode_references,
        chunks.count,
        [
            references.array,
            as_warp(ranges["first"][chunks.tree] + chunks.first, wp.int32),
            as_warp(chunks.count, wp.int32),
            as_warp(chunks.tree, wp.int32),
            as_warp(ranges, BuildRange),
        ],
        [codes, order],
    )
    sorted_codes = codes.numpy()
    rows = order.numpy()
    if len(ranges) == 1:
        wp.utils.radix_sort_pairs(codes, order, count)
    else:
        # By tree first: a stable sort of few, long runs that are in place already.
        tree = np.repeat(np.arange(len(ranges)), ranges["count"])
        rows[:count] = np.lexsort((sorted_codes[:count], tree))
        sorted_codes[:count] = sorted_codes[rows[:count]]
    gathered = as_warp(host_array(count, Reference.numpy_dtype()), Reference)
    wp.launch(bvh_build.gather_references, count, inputs=[references.array, order], outputs=[gathered], device="cpu")
    return References(gathered, ranges), codes


def pack_triangles(forest: Forest, points: wp.array, triangles: wp.array, workers: Workers) -> np.ndarray:
    """Return the leaf packets of trees over triangles: float32, shape [leaf_count * LEAF_FLOATS].

    Args:
        forest: From the references of ``triangles``.
        points: vec3, shape [n].
        triangles: int32, shape [3 m].
        workers: Threads to use.

    Raises:
        LimitError: There are more packets than 32-bit indices reach.
    """
    check_words("leaf packets", forest.layout.leaf_count, LEAF_FLOATS)
    leaves = host_array(forest.layout.leaf_count * LEAF_FLOATS, np.float32)
    chunks = split_chunks(forest.layout.leaf_counts)
    launch_jobs(
        workers,
        bvh_collapse.pack_triangles,
        chunks.count,
        [
            forest.trees,
            points,
            triangles,
            forest.leaf_slots,
            as_warp(forest.tree_first, wp.int32),
            as_warp(forest.layout.tree_leaf, wp.int32),
            as_warp(chunks.tree, wp.int32),
            as_warp(chunks.first, wp.int32),
            as_warp(chunks.count, wp.int32),
        ],
        [as_warp(leaves, wp.float32)],
    )
    return leaves


def list_leaf_primitives(forest: Forest) -> np.ndarray:
    """Return the primitive of each leaf of a forest of one tree with leaves of one: int32, shape [leaf_count]."""
    ids = np.empty(forest.layout.leaf_count, np.int32)
    wp.launch(
        bvh_collapse.list_leaf_primitives,
        len(ids),
        inputs=[forest.trees, forest.leaf_slots],
        outputs=[as_warp(ids, wp.int32)],
        device="cpu",
    )
    return ids
