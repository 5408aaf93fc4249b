# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Drives the kernels that build binary trees: big ranges split by all threads, small ones many to a job."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_rt.device.jobs import as_warp, host_array, numpy_type, sparse_array
from warp_rt.device.workers import Workers
from warp_rt.kernels import bvh_build, bvh_clusters, bvh_collapse
from warp_rt.kernels.bvh_structs import Bin, BinaryNode, BinaryTrees, BuildRange, Reference
from warp_rt.kernels.constants import WIDTH

_GRAIN = 4096  # references up to which a range is never split between jobs
_MOST_GRAIN = 1 << 17  # and beyond which it is: some 50 ms of one, in which no interrupt is heard
_CLUSTERED = 1 << 16  # references from which a range's upper levels are built over clusters
_SUBTREE = 2048  # references at which those end, but for a 512th of the range where that is more
_PIECES = 16  # parts of a range that threads cluster side by side


@dataclass(frozen=True)
class _Ranges:
    """Ranges of references that are to become subtrees."""

    first: np.ndarray
    """int32, shape [n]."""
    count: np.ndarray
    """int32, shape [n]."""
    parent: np.ndarray
    """int32, shape [n], what the subtrees hang from: twice the parent's slot, plus 1 for the right child; or -1 minus
    the number of the tree whose root they are."""
    buffer: int
    """Which of the two arrays the references are in."""

    def select(self, rows: slice | np.ndarray) -> _Ranges:
        return _Ranges(self.first[rows], self.count[rows], self.parent[rows], self.buffer)


class BinaryForest:
    """Binary trees over references, one for each range.

    Args:
        references: ``Reference``, shape [n]. They are moved about.
        ranges: ``BuildRange``, shape [tree_count].
        leaf_bits: Logarithm of the references that a leaf holds at most.
        builder: Of ``bvh_build``.
        workers: Threads to use.
        keeps_costs: Whether the costs of all nodes are kept; else those of a subtree are lost once its root's are
            known, which saves 128 of 228 bytes a reference where leaves hold one.
    """

    def __init__(
        self,
        references: wp.array,
        ranges: np.ndarray,
        leaf_bits: int,
        builder: int,
        workers: Workers,
        *,
        keeps_costs: bool,
    ) -> None:
        count = references.shape[0]
        # The slots of leaves' descendants, and costs that are not kept, are never touched: they stay virtual memory.
        self.nodes = host_array(2 * count, numpy_type(BinaryNode))
        self.trees = BinaryTrees()
        self.trees.nodes = as_warp(self.nodes, BinaryNode)
        self.trees.ids = as_warp(np.empty(count, np.int32), wp.int32)
        make_costs = host_array if keeps_costs else sparse_array
        self.trees.costs = as_warp(make_costs((2 * count, int(WIDTH)), np.float32), wp.float32)
        self.trees.shares = as_warp(host_array((2 * count, int(WIDTH)), np.int8), wp.int8)
        self.roots = np.empty(len(ranges), np.int32)
        """Slots of the trees' roots, shape [tree_count]."""
        # Slots of the nodes above the subtrees that jobs build, parents before their children.
        self._above: list[int] = []
        self._buffers = references, as_warp(host_array(count, numpy_type(Reference)), Reference)
        self._leaf_bits = leaf_bits
        self._builder = builder
        self._workers = workers
        self._keeps_costs = keeps_costs
        self._grain = min(max(count // 32, _GRAIN), _MOST_GRAIN)
        self._build(ranges)

    def _build(self, ranges: np.ndarray) -> None:
        counts = ranges["count"]
        trees = np.arange(len(ranges), dtype=np.int32)
        whole = _Ranges(ranges["first"], counts, -1 - trees, buffer=0)
        is_clustered = (counts > _CLUSTERED) & (self._builder == int(bvh_build.SAH))
        items = self._items(whole.select(~is_clustered))
        todo = [whole.select(slice(i, i + 1)) for i in np.flatnonzero(is_clustered)]
        while todo:
            work = todo.pop()
            parts = self._cluster(work)
            if parts is None:
                items += self._items(work)
                continue
            is_clustered = (parts.count > _CLUSTERED) & (parts.count < 0.9 * work.count)
            items += self._items(parts.select(~is_clustered))
            todo += [parts.select(slice(i, i + 1)) for i in np.flatnonzero(is_clustered)]
        # The biggest first: they have most to be shared out.
        items.sort(key=lambda item: int(item.count.max()), reverse=True)
        self._workers.map(self._run, items, self._make_scratch)
        above = as_warp(np.array(self._above, np.int32), wp.int32)
        wp.launch(bvh_collapse.evaluate_above, 1, inputs=[above], outputs=[self.trees], device="cpu")

    def _items(self, ranges: _Ranges) -> list[_Ranges]:
        """Return ranges as items of work: big ones alone, small ones in groups."""
        small = np.flatnonzero(ranges.count <= self._grain)
        items = [ranges.select(slice(i, i + 1)) for i in np.flatnonzero(ranges.count > self._grain)]
        if len(small):
            group = np.cumsum(ranges.count[small], dtype=np.int64) // self._grain
            items += [ranges.select(rows) for rows in np.split(small, np.flatnonzero(np.diff(group)) + 1)]
        return items

    def _make_scratch(self) -> tuple[wp.array, wp.array]:
        """Return the memory that one thread moves references through, and that for the costs of one subtree."""
        costs = host_array((0 if self._keeps_costs else 2 * self._grain, int(WIDTH)), np.float32)
        return as_warp(host_array(self._grain, numpy_type(Reference)), Reference), as_warp(costs, wp.float32)

    def _run(self, item: _Ranges, scratch: tuple[wp.array, wp.array]) -> list[_Ranges] | None:
        """Build subtrees, or split one big range in two."""
        references = self._buffers[item.buffer]
        if item.count[0] > self._grain:
            return self._split(item)
        inputs = [
            self._builder,
            references,
            *scratch,
            self._leaf_bits,
            as_warp(np.ascontiguousarray(item.first), wp.int32),
            as_warp(np.ascontiguousarray(item.count), wp.int32),
        ]
        wp.launch(bvh_build.build_subtrees, len(item.first), inputs=inputs, outputs=[self.trees], device="cpu")
        self._hang(item.parent, 2 * item.first + 1)
        return None

    def _split(self, item: _Ranges) -> list[_Ranges]:
        """Split one range by one job and return its halves."""
        halves = np.empty(2, numpy_type(BuildRange))
        inputs = [
            self._builder,
            self._buffers[item.buffer],
            self._buffers[1 - item.buffer],
            self._leaf_bits,
            int(item.first[0]),
            int(item.count[0]),
        ]
        outputs = [self.trees, as_warp(halves, BuildRange)]
        wp.launch(bvh_build.split_range_once, 1, inputs=inputs, outputs=outputs, device="cpu")
        slot = 2 * halves["first"][1:]
        self._hang(item.parent, slot)
        self._above.append(int(slot[0]))
        parents = np.array([2 * slot[0], 2 * slot[0] + 1], np.int32)
        both = _Ranges(halves["first"], halves["count"], parents, item.buffer)
        return [both.select(slice(0, 1)), both.select(slice(1, 2))]

    def _hang(self, parents: np.ndarray, slots: np.ndarray) -> None:
        """Make the nodes at ``slots`` the children, or roots, that ``parents`` says."""
        is_root = parents < 0
        self.roots[-1 - parents[is_root]] = slots[is_root]
        for side, name in enumerate(("left", "right")):
            is_side = ~is_root & (parents % 2 == side)
            self.nodes[name][parents[is_side] // 2] = slots[is_side]

    def _cluster(self, work: _Ranges) -> _Ranges | None:
        """Build the upper levels of one range over clusters and move its references to the other array accordingly.

        Returns the ranges below, or None where all references are in one cluster.
        """
        first, count = int(work.first[0]), int(work.count[0])
        source, target = self._buffers[work.buffer], self._buffers[1 - work.buffer]
        ends = first + count * np.arange(1, _PIECES + 1, dtype=np.int64) // _PIECES
        starts = np.concatenate([[first], ends[:-1]])
        box = as_warp(self._measure(source, starts, ends), BuildRange)

        cell_count = int(bvh_clusters.CELL_COUNT)
        counts = np.zeros((_PIECES, cell_count), np.int32)
        device_counts = as_warp(counts, wp.int32)
        tables: list[np.ndarray] = []

        def make_table() -> wp.array:
            table = host_array(cell_count, numpy_type(Bin))
            tables.append(table)
            wp.launch(bvh_clusters.clear_cells, cell_count, outputs=[as_warp(table, Bin)], device="cpu")
            return as_warp(table, Bin)

        def fill(piece: int, table: wp.array) -> None:
            inputs = [source, box, piece, int(starts[piece]), int(ends[piece])]
            wp.launch(bvh_clusters.fill_cells, 1, inputs=inputs, outputs=[table, device_counts], device="cpu")

        self._workers.map(fill, range(_PIECES), make_table)
        totals = counts.sum(axis=0, dtype=np.int32)
        occupied = np.flatnonzero(totals).astype(np.int32)
        if len(occupied) == 1:
            return None
        cells = np.stack(tables)
        clusters, spare = (host_array(len(occupied), numpy_type(Reference)) for _ in range(2))
        wp.launch(
            bvh_clusters.refer_to_cells,
            len(occupied),
            inputs=[as_warp(cells, Bin), as_warp(totals, wp.int32), as_warp(occupied, wp.int32)],
            outputs=[as_warp(clusters, Reference)],
            device="cpu",
        )
        parts, slots = self._split_clusters(clusters, spare, work)

        cell = clusters["low"][:, 3].view(np.int32)
        before = np.cumsum(totals[cell]) - totals[cell]
        places = np.empty_like(counts)
        places[:, cell] = first + before + np.cumsum(counts[:, cell], axis=0) - counts[:, cell]
        device_places = as_warp(places, wp.int32)

        def scatter(piece: int, _scratch: None) -> None:
            inputs = [source, box, piece, int(starts[piece]), int(ends[piece]), device_places]
            wp.launch(bvh_clusters.scatter_references, 1, inputs=inputs, outputs=[target], device="cpu")

        self._workers.map(scatter, range(_PIECES))
        self._above.extend(slots.tolist())
        return parts

    def _measure(self, references: wp.array, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return the range of all references in several pieces: its boxes, shape [1]."""
        pieces = np.empty(len(starts), numpy_type(BuildRange))

        def run(piece: int, _scratch: None) -> None:
            inputs = [references, int(starts[piece]), int(ends[piece] - starts[piece])]
            output = as_warp(pieces[piece : piece + 1], BuildRange)
            wp.launch(bvh_clusters.measure_references, 1, inputs=inputs, outputs=[output], device="cpu")

        self._workers.map(run, range(len(starts)))
        whole = np.zeros(1, numpy_type(BuildRange))
        for name, reduce in (("low", np.min), ("high", np.max)):
            whole[name] = reduce(pieces[name], axis=0)
            whole[f"centroid_{name}"] = reduce(pieces[f"centroid_{name}"], axis=0)
        return whole

    def _split_clusters(self, clusters: np.ndarray, spare: np.ndarray, work: _Ranges) -> tuple[_Ranges, np.ndarray]:
        """Return the ranges of references below the upper levels, and the slots of those levels' nodes."""
        count = len(clusters)
        ranges = np.empty(count, numpy_type(BuildRange))
        slots, found = np.empty(count, np.int32), np.empty(2, np.int32)
        limit = max(_SUBTREE, int(work.count[0]) >> 9)
        inputs = [
            as_warp(clusters, Reference),
            as_warp(spare, Reference),
            self._leaf_bits,
            int(work.first[0]),
            limit,
        ]
        outputs = [self.trees, as_warp(ranges, BuildRange), as_warp(slots, wp.int32), as_warp(found, wp.int32)]
        wp.launch(bvh_clusters.split_clusters, 1, inputs=inputs, outputs=outputs, device="cpu")
        ranges, slots = ranges[: found[0]], slots[: found[1]]
        if len(slots):
            self._hang(work.parent, slots[:1])
        parents = np.where(ranges["node"] < 0, work.parent[0], ranges["node"])
        return _Ranges(ranges["first"], ranges["count"], parents, 1 - work.buffer), slots
