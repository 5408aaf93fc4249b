# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The upper levels of a big tree, over clusters instead of references: the cells of a grid of their centroids.

Splitting a million references ten times over costs more memory traffic than all the rest; here they are read twice
and moved once, and each pass is shared by all threads. The surface area heuristic then splits the occupied cells as it
would the references, and stops where a range holds few cells: below, references are split again one by one.

Reference: Pantaleoni and Luebke (2010), HLBVH: Hierarchical LBVH Construction for Real-Time Ray Tracing of Dynamic
Geometry, HPG, section 4. Differs by cells along all axes alike instead of by Morton codes, and by clusters being split
down to ranges of several cells, so that no cell's border has to become a node's.
"""

import warp as wp

from .bvh_build import measure_range
from .bvh_references import xyz
from .bvh_sah import slices_per_unit, split_sah
from .bvh_structs import Bin, BinaryNode, BinaryTrees, BuildRange, Reference
from .constants import BUILD_STACK, CLUSTER_CELLS, SAH_BINS

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

CELL_COUNT = wp.constant(int(CLUSTER_CELLS) ** 3)


@wp.func
def cell_of(reference: Reference, work: BuildRange, scale: wp.vec3) -> int:
    """Return the cell of the grid over a range's centroid box that a reference's centroid is in."""
    position = wp.cw_mul(xyz(reference.low + reference.high - work.centroid_low), scale)
    return int(position[0]) + CLUSTER_CELLS * (int(position[1]) + CLUSTER_CELLS * int(position[2]))


@wp.kernel
def measure_references(references: wp.array[Reference], first: int, count: int, ranges_out: wp.array[BuildRange]):
    """Write the boxes of references [first, first + count); one thread."""
    measure_range(references, first, count, ranges_out, 0)


@wp.kernel
def clear_cells(cells_out: wp.array[Bin]):
    """Make a cell empty."""
    cells_out[wp.tid()].low = wp.vec4(wp.inf)
    cells_out[wp.tid()].high = wp.vec4(-wp.inf)


@wp.kernel
def fill_cells(
    references: wp.array[Reference],
    work: wp.array[BuildRange],
    chunk: int,
    begin: int,
    end: int,
    cells_out: wp.array[Bin],
    counts_out: wp.array2d[int],
):
    """Sort references [begin, end) of a range into cells: their boxes, and their numbers in row ``chunk``."""
    scale = slices_per_unit(work[0], CLUSTER_CELLS)
    for i in range(begin, end):
        reference = references[i]
        cell = cell_of(reference, work[0], scale)
        cells_out[cell].low = wp.min(cells_out[cell].low, reference.low)
        cells_out[cell].high = wp.max(cells_out[cell].high, reference.high)
        counts_out[chunk, cell] += 1


@wp.kernel
def refer_to_cells(
    cells: wp.array2d[Bin], counts: wp.array[int], occupied: wp.array[int], references_out: wp.array[Reference]
):
    """Write the references of the occupied cells, whose boxes are spread over the rows of ``cells``."""
    i = wp.tid()
    cell = occupied[i]
    reference = Reference()
    reference.low = cells[0, cell].low
    reference.high = cells[0, cell].high
    for row in range(1, cells.shape[0]):
        reference.low = wp.min(reference.low, cells[row, cell].low)
        reference.high = wp.max(reference.high, cells[row, cell].high)
    reference.low[3] = wp.cast(cell, wp.float32)
    reference.high[3] = wp.cast(counts[cell], wp.float32)
    references_out[i] = reference


@wp.func_native(
    """
    int total = 0;
    for (int i = first; i < first + count; ++i)
        total += ((const int*)&clusters.data[i])[7];
    return total;
"""
)
def weigh(clusters: wp.array[Reference], first: int, count: int) -> int:
    """Return the number of primitives in clusters [first, first + count)."""
    ...


@wp.kernel
def split_clusters(
    clusters: wp.array[Reference],
    spare: wp.array[Reference],
    leaf_bits: int,
    first: int,
    limit: int,
    trees: BinaryTrees,
    ranges_out: wp.array[BuildRange],
    slots_out: wp.array[int],
    counts_out: wp.array[int],
):
    """Build the upper levels over all clusters of a range whose references begin at ``first``.

    Stops at ranges of at most ``limit`` references or one cluster. Writes ``counts_out[0]`` such ranges of references
    and the slots of ``counts_out[1]`` nodes above them, parents first; ``node`` of a range says where it is to hang
    from: twice the parent's slot, plus 1 for the right child; -1 where there is no node.
    """
    bins = wp.zeros(shape=(wp.static(3 * SAH_BINS),), dtype=Bin)
    counts = wp.zeros(shape=(wp.static(3 * SAH_BINS),), dtype=int)
    right_costs = wp.zeros(shape=(SAH_BINS,), dtype=float)
    halves = wp.zeros(shape=(2,), dtype=BuildRange)
    stack = wp.zeros(shape=(BUILD_STACK,), dtype=BuildRange)
    firsts = wp.zeros(shape=(BUILD_STACK,), dtype=int)
    measure_range(clusters, 0, clusters.shape[0], stack, 0)
    stack[0].node = -1
    firsts[0] = first
    top = int(1)
    range_count = int(0)
    slot_count = int(0)
    while top > 0:
        top -= 1
        work = stack[top]
        begin = firsts[top]
        weight = weigh(clusters, work.first, work.count)
        middle = int(-1)
        if weight > limit and work.count > 1:
            middle = split_sah(clusters, spare, 0, work, leaf_bits, bins, counts, right_costs, halves)
        if middle < 0:
            work.first = begin
            work.count = weight
            ranges_out[range_count] = work
            range_count += 1
        else:
            halves[0].first = work.first
            halves[0].count = middle - work.first
            halves[1].first = middle
            halves[1].count = work.count - halves[0].count
            begin_right = begin + weigh(clusters, halves[0].first, halves[0].count)
            slot = 2 * begin_right
            node = BinaryNode()
            node.low = xyz(work.low)
            node.high = xyz(work.high)
            trees.nodes[slot] = node
            if work.node >= 0:
                if work.node % 2 == 0:
                    trees.nodes[work.node // 2].left = slot
                else:
                    trees.nodes[work.node // 2].right = slot
            slots_out[slot_count] = slot
            slot_count += 1
            halves[0].node = 2 * slot
            halves[1].node = 2 * slot + 1
            larger = 0 if halves[0].count >= halves[1].count else 1
            stack[top] = halves[larger]
            stack[top + 1] = halves[1 - larger]
            firsts[top] = begin if larger == 0 else begin_right
            firsts[top + 1] = begin_right if larger == 0 else begin
            top += 2
    counts_out[0] = range_count
    counts_out[1] = slot_count


@wp.kernel
def scatter_references(
    references: wp.array[Reference],
    work: wp.array[BuildRange],
    chunk: int,
    begin: int,
    end: int,
    places: wp.array2d[int],
    references_out: wp.array[Reference],
):
    """Move references [begin, end) of a range to the places of their cells, which row ``chunk`` counts on."""
    scale = slices_per_unit(work[0], CLUSTER_CELLS)
    for i in range(begin, end):
        reference = references[i]
        cell = cell_of(reference, work[0], scale)
        place = places[chunk, cell]
        places[chunk, cell] = place + 1
        references_out[place] = reference
