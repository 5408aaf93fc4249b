# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Drives the kernels that build trees: a forest at once, over shared arrays and CPU threads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.errors import LimitError
from warp_rt.kernels import bvh_build, bvh_collapse
from warp_rt.kernels.bvh_structs import BinaryNode, BuildRange, Reference, TreeSummary
from warp_rt.kernels.constants import LEAF_FLOATS, NODE_FLOATS, WIDTH
from warp_rt.workers import Workers

BUILDERS = {
    "sah": bvh_build.SAH,
    "median": bvh_build.MEDIAN,
    "midpoint": bvh_build.MIDPOINT,
    "lbvh": bvh_build.LBVH,
}

_CHUNK = 4096  # primitives, nodes or leaves that one job works on
_GRAIN = 4096  # references below which a range is built by one job
_ALIGNMENT = 64  # bytes: a cache line


@dataclass(frozen=True)
class Chunks:
    """Runs of items of several trees, each no longer than a job should be."""

    tree: np.ndarray
    """int32, shape [n]."""
    first: np.ndarray
    """int32, shape [n], first item, counted within the tree."""
    count: np.ndarray
    """int32, shape [n]."""


@dataclass(frozen=True)
class References:
    """Boxes around primitives, grouped by tree."""

    array: wp.array
    """``Reference``, shape [n]."""
    ranges: np.ndarray
    """``BuildRange``, shape [tree_count]: each tree's references and their boxes."""


@dataclass(frozen=True)
class Forest:
    """Wide trees in one array of nodes, and the leaves that the caller packs."""

    references: wp.array
    """``Reference``, shape [n], in leaf order."""
    binary_nodes: wp.array
    """``BinaryNode``, shape [2 n], sparse."""
    leaf_slots: wp.array
    """int32, shape [n]: slot of each leaf, from the tree's first reference on."""
    tree_first: np.ndarray
    """int32, shape [tree_count], first reference."""
    tree_leaf: np.ndarray
    """int32, shape [tree_count], number of the tree's first leaf."""
    summaries: np.ndarray
    """``TreeSummary``, shape [tree_count]."""
    roots: np.ndarray
    """int32, shape [tree_count], child codes."""
    nodes: np.ndarray
    """float32, shape [node_count * 64]."""

    @property
    def leaf_count(self) -> int:
        """Leaves of all trees."""
        return int(self.summaries["leaf_count"].sum())


def host_array(shape: int | tuple[int, ...], dtype: Any) -> np.ndarray:
    """Return new memory that begins at a cache line; its content is undefined."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    memory = np.empty(size + _ALIGNMENT, np.uint8)
    start = -memory.ctypes.data % _ALIGNMENT
    return memory[start : start + size].view(dtype).reshape(shape)


def as_warp(array: np.ndarray, dtype: Any) -> wp.array:
    """Return a Warp array on the CPU over a NumPy array's own memory."""
    return wp.array(array, dtype=dtype, device="cpu", copy=False)


def check_words(what: str, count: int, words: int) -> None:
    """Raise LimitError where traversal, which counts words by int32, could not reach the last of ``count`` records."""
    if count * words >= 1 << 31:
        raise LimitError(f"{count} {what} are more than a bounding volume hierarchy can hold ({(1 << 31) // words})")


def split_chunks(counts: np.ndarray) -> Chunks:
    """Return the chunks of trees that have ``counts`` items each."""
    pieces = -(-counts // _CHUNK)
    tree = np.repeat(np.arange(len(counts)), pieces)
    first = (np.arange(len(tree)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) * _CHUNK
    count = np.minimum(counts[tree] - first, _CHUNK)
    return Chunks(tree.astype(np.int32), first.astype(np.int32), count.astype(np.int32))


def launch_jobs(
    workers: Workers, kernel: wp.Kernel, weights: np.ndarray, inputs: Sequence[Any], outputs: Sequence[Any]
) -> None:
    """Launch a kernel over ``len(weights)`` threads on the CPU, in jobs of about equal weight.

    The kernel's argument after ``inputs`` is the first thread of the job.
    """
    if not len(weights):
        return
    total = np.cumsum(weights)
    jobs = int(min(len(weights), max(1, min(8 * workers.count, total[-1] // 1024)))) if workers.count > 1 else 1
    ends = np.unique(np.searchsorted(total, total[-1] * np.arange(1, jobs + 1) / jobs) + 1).clip(max=len(weights))
    starts = np.concatenate([[0], ends[:-1]])

    def run(job: tuple[int, int], _scratch: None) -> None:
        start, end = job
        wp.launch(kernel, dim=end - start, inputs=[*inputs, start], outputs=outputs, device="cpu")

    workers.map(run, [(int(s), int(e)) for s, e in zip(starts, ends, strict=True) if e > s])


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


def refer_to_boxes(low: np.ndarray, high: np.ndarray, ids: np.ndarray) -> References:
    """Return the references of one tree over boxes.

    Args:
        low: Lower corners, float32, shape [n, 3], n >= 1.
        high: Upper corners, float32, shape [n, 3].
        ids: int32, shape [n].
    """
    references = host_array(len(ids), Reference.numpy_dtype())
    wp.launch(
        bvh_build.refer_to_boxes,
        dim=len(ids),
        inputs=[as_warp(low, wp.vec3), as_warp(high, wp.vec3), as_warp(ids, wp.int32)],
        outputs=[as_warp(references, Reference)],
        device="cpu",
    )
    ranges = np.zeros(1, BuildRange.numpy_dtype())
    centroids = low + high
    for name, values in (
        ("low", low.min(axis=0)),
        ("high", high.max(axis=0)),
        ("centroid_low", centroids.min(axis=0)),
        ("centroid_high", centroids.max(axis=0)),
    ):
        ranges[name][0, :3] = values
    ranges["count"] = len(ids)
    return References(as_warp(references, Reference), ranges)


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
        leaf_size: References that a leaf holds at most.
        builder: One of ``BUILDERS``.
        workers: Threads to use; their number does not change the result.
        node_offset: Number of the forest's first node, where others come before it in memory.

    Raises:
        LimitError: The arrays would have more elements than 32-bit indices reach.
    """
    count = references.array.shape[0]
    if count * NODE_FLOATS // 4 >= 1 << 31:
        raise LimitError(f"{count} primitives are more than a bounding volume hierarchy can hold (2^27)")
    codes = as_warp(np.empty(0, np.uint64), wp.uint64)
    if builder == "lbvh":
        references, codes = _sort_by_morton_code(references, workers)
    # The slots of leaves' descendants are never touched, so that most of this stays virtual memory.
    nodes = as_warp(host_array(2 * count, BinaryNode.numpy_dtype()), BinaryNode)
    _build_binary(references, codes, nodes, leaf_size, BUILDERS[builder], workers)
    return _collapse(references, nodes, node_offset, workers)


def _build_binary(
    references: References, codes: wp.array, nodes: wp.array, leaf_size: int, builder: int, workers: Workers
) -> None:
    """Build the binary trees of all ranges: big ones split by split, small ones many to a job."""
    counts = references.ranges["count"]
    grain = max(int(counts.sum()) // 32, _GRAIN)
    is_big = counts > grain
    order = np.concatenate([np.flatnonzero(is_big), np.flatnonzero(~is_big)])
    big_count = int(is_big.sum())
    ranges = np.ascontiguousarray(references.ranges[order])
    shared = [builder, references.array, codes, leaf_size]

    def run(item: tuple[np.ndarray, int], _scratch: None) -> list[tuple[np.ndarray, int]] | None:
        run_ranges, count = item
        device_ranges = as_warp(run_ranges, BuildRange)
        if run_ranges["count"][0] <= grain:
            wp.launch(bvh_build.build_subtrees, count, inputs=[*shared, device_ranges], outputs=[nodes], device="cpu")
            return None
        halves = np.empty(2, BuildRange.numpy_dtype())
        outputs = [nodes, as_warp(halves, BuildRange)]
        wp.launch(bvh_build.split_range_once, 1, inputs=[*shared, device_ranges], outputs=outputs, device="cpu")
        return [(halves[:1], 1), (halves[1:], 1)]

    items = [(ranges[i : i + 1], 1) for i in range(big_count)]
    if big_count < len(counts):
        job = np.cumsum(counts[order[big_count:]]) // grain
        starts = big_count + np.flatnonzero(np.diff(job, prepend=-1))
        ends = np.append(starts[1:], len(counts))
        items += [(ranges[s:e], int(e - s)) for s, e in zip(starts, ends, strict=True)]
    workers.map(run, items)


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


def _collapse(references: References, nodes: wp.array, node_offset: int, workers: Workers) -> Forest:
    """Return the wide trees of binary ones."""
    ranges = references.ranges
    count = references.array.shape[0]
    scratch = bvh_collapse.CollapseScratch()
    for name in ("slots", "right"):
        setattr(scratch, name, as_warp(np.empty(2 * count, np.int32), wp.int32))
    for name in ("pending", "sources", "levels", "entries"):
        setattr(scratch, name, as_warp(np.empty(count, np.int32), wp.int32))
    scratch.costs = as_warp(np.empty((2 * count, WIDTH), np.float32), wp.float32)
    scratch.shares = as_warp(np.empty((2 * count, WIDTH), np.int8), wp.int8)
    child_codes = as_warp(np.empty((count, WIDTH), np.int32), wp.int32)
    child_slots = as_warp(np.empty((count, WIDTH), np.int32), wp.int32)
    leaf_slots = as_warp(np.empty(count, np.int32), wp.int32)
    summaries = np.zeros(len(ranges), TreeSummary.numpy_dtype())
    tree_first = np.ascontiguousarray(ranges["first"])
    device_first = as_warp(tree_first, wp.int32)
    launch_jobs(
        workers,
        bvh_collapse.collapse_trees,
        ranges["count"],
        [nodes, device_first, scratch],
        [child_codes, child_slots, leaf_slots, as_warp(summaries, TreeSummary)],
    )
    node_counts = summaries["node_count"]
    tree_node = (np.cumsum(node_counts) - node_counts).astype(np.int32)
    tree_leaf = (np.cumsum(summaries["leaf_count"]) - summaries["leaf_count"]).astype(np.int32)
    check_words("nodes", node_offset + int(node_counts.sum()), NODE_FLOATS)
    wide_nodes = host_array(int(node_counts.sum()) * NODE_FLOATS, np.float32)
    chunks = split_chunks(node_counts)
    launch_jobs(
        workers,
        bvh_collapse.pack_nodes,
        chunks.count,
        [
            nodes,
            child_codes,
            child_slots,
            device_first,
            as_warp(tree_node, wp.int32),
            as_warp(tree_leaf, wp.int32),
            node_offset,
            as_warp(chunks.tree, wp.int32),
            as_warp(chunks.first, wp.int32),
            as_warp(chunks.count, wp.int32),
        ],
        [as_warp(wide_nodes, wp.float32)],
    )
    return Forest(
        references=references.array,
        binary_nodes=nodes,
        leaf_slots=leaf_slots,
        tree_first=tree_first,
        tree_leaf=tree_leaf,
        summaries=summaries,
        roots=np.where(node_counts > 0, node_offset + tree_node, -1 - tree_leaf).astype(np.int32),
        nodes=wide_nodes,
    )


def pack_triangles(forest: Forest, points: wp.array, triangles: wp.array, workers: Workers) -> np.ndarray:
    """Return the leaf packets of trees over triangles: float32, shape [leaf_count * 80].

    Args:
        forest: From the references of ``triangles``.
        points: vec3, shape [n].
        triangles: int32, shape [3 m].
        workers: Threads to use.

    Raises:
        LimitError: There are more packets than 32-bit indices reach.
    """
    check_words("leaf packets", forest.leaf_count, LEAF_FLOATS)
    leaves = host_array(forest.leaf_count * LEAF_FLOATS, np.float32)
    chunks = split_chunks(forest.summaries["leaf_count"])
    launch_jobs(
        workers,
        bvh_collapse.pack_triangles,
        chunks.count,
        [
            forest.binary_nodes,
            forest.references,
            points,
            triangles,
            forest.leaf_slots,
            as_warp(forest.tree_first, wp.int32),
            as_warp(forest.tree_leaf, wp.int32),
            as_warp(chunks.tree, wp.int32),
            as_warp(chunks.first, wp.int32),
            as_warp(chunks.count, wp.int32),
        ],
        [as_warp(leaves, wp.float32)],
    )
    return leaves


def list_leaf_primitives(forest: Forest) -> np.ndarray:
    """Return the primitive of each leaf of a forest of one tree with leaves of one: int32, shape [leaf_count]."""
    ids = np.empty(forest.leaf_count, np.int32)
    wp.launch(
        bvh_collapse.list_leaf_primitives,
        len(ids),
        inputs=[forest.binary_nodes, forest.references, forest.leaf_slots],
        outputs=[as_warp(ids, wp.int32)],
        device="cpu",
    )
    return ids
