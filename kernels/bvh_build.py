# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Builders of the binary tree from the top down: midpoint, median, surface area heuristic (SAH).

A builder is a function that splits a range of references in two, moving them in place; everything else is shared.
The tree depends on the references and the builder alone, never on how ranges were dealt to threads.
"""

import warp as wp

from .bounds import widest_axis
from .bvh_collapse import evaluate_costs
from .bvh_references import measure_range, xyz
from .bvh_sah import partition_slices, slices_per_unit, split_sah
from .bvh_structs import Bin, BinaryNode, BinaryTrees, BuildRange, Reference
from .constants import BUILD_STACK, SAH_BINS, WIDTH

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SAH = wp.constant(0)
MEDIAN = wp.constant(1)
MIDPOINT = wp.constant(2)


# --- splits: each returns the first reference of the right half, or -1 for a range that it cannot tell apart


@wp.func
def split_midpoint(
    references: wp.array[Reference],
    spare: wp.array[Reference],
    spare_first: int,
    work: BuildRange,
    halves: wp.array[BuildRange],
) -> int:
    """Split at the middle of the centroid box's longest side.

    Reference: Komura, Computer Graphics, lecture 10, Where to split objects? At midpoint.
    """
    axis = widest_axis(xyz(work.centroid_high - work.centroid_low))
    scale = slices_per_unit(work, 2)
    if scale[axis] == 0.0:
        return -1
    return partition_slices(references, spare, spare_first, work, scale, axis, 0, halves)


@wp.func
def doubled_centroid(reference: Reference, axis: int) -> float:
    """Return twice a reference's centroid along an axis."""
    return reference.low[axis] + reference.high[axis]


@wp.func
def median_of_three(a: float, b: float, c: float) -> float:
    """Return the one in the middle."""
    return wp.max(wp.min(a, b), wp.min(wp.max(a, b), c))


@wp.func
def split_median(references: wp.array[Reference], work: BuildRange) -> int:
    """Put half of the references on each side, by centroid along the centroid box's longest side.

    Reference: Komura, Computer Graphics, lecture 10, Where to split objects? Sort, and put half of the objects on
    each side; by selection (Hoare 1961, Algorithm 65: Find) instead of a full sort.
    """
    middle = work.first + work.count // 2
    axis = widest_axis(xyz(work.centroid_high - work.centroid_low))
    low = int(work.first)
    high = int(work.first + work.count - 1)
    while low < high:
        pivot = median_of_three(
            doubled_centroid(references[low], axis),
            doubled_centroid(references[(low + high) // 2], axis),
            doubled_centroid(references[high], axis),
        )
        i = int(low)
        j = int(high)
        while i <= j:
            while doubled_centroid(references[i], axis) < pivot:
                i += 1
            while doubled_centroid(references[j], axis) > pivot:
                j -= 1
            if i <= j:
                swapped = references[i]
                references[i] = references[j]
                references[j] = swapped
                i += 1
                j -= 1
        # Now [low, j] <= pivot <= [i, high], and what lies between equals it.
        if middle <= j:
            high = int(j)
        elif middle >= i:
            low = int(i)
        else:
            low = int(high)
    return middle


@wp.func
def split_range(
    builder: int,
    references: wp.array[Reference],
    spare: wp.array[Reference],
    spare_first: int,
    work: BuildRange,
    leaf_bits: int,
    bins: wp.array[Bin],
    counts: wp.array[int],
    right_costs: wp.array[float],
    halves: wp.array[BuildRange],
):
    """Split a range as ``builder`` does, and set both halves but for their slots.

    References that no split tells apart, such as identical ones, are halved by count: every leaf ends up with at
    most 2^``leaf_bits`` of them.
    """
    middle = int(-1)
    if builder == SAH:
        middle = split_sah(references, spare, spare_first, work, leaf_bits, bins, counts, right_costs, halves)
    elif builder == MEDIAN:
        middle = split_median(references, work)
    else:
        middle = split_midpoint(references, spare, spare_first, work, halves)
    has_boxes = builder == SAH and middle >= 0
    if middle < 0:
        middle = work.first + work.count // 2
    left_count = middle - work.first
    if not has_boxes:
        measure_range(references, work.first, left_count, halves, 0)
        measure_range(references, middle, work.count - left_count, halves, 1)
    halves[0].first = work.first
    halves[0].count = left_count
    halves[1].first = middle
    halves[1].count = work.count - left_count


@wp.func
def write_node(trees: BinaryTrees, work: BuildRange, left: int, right: int):
    """Write the node of a range."""
    node = BinaryNode()
    node.low = xyz(work.low)
    node.high = xyz(work.high)
    node.left = left
    node.right = right
    trees.nodes[work.node] = node


@wp.func
def write_leaf(trees: BinaryTrees, references: wp.array[Reference], work: BuildRange):
    """Write a leaf of all references of a range, and their primitives."""
    write_node(trees, work, work.first, -work.count)
    for i in range(work.first, work.first + work.count):
        trees.ids[i] = wp.cast(references[i].low[3], wp.int32)


# --- kernels


@wp.kernel
def split_range_once(
    builder: int,
    references: wp.array[Reference],
    spare: wp.array[Reference],
    leaf_bits: int,
    first: int,
    count: int,
    trees: BinaryTrees,
    halves_out: wp.array[BuildRange],
):
    """Split references [first, first + count), write the node at the slot that is theirs, and both halves.

    The node's children are for the caller to fill in.
    """
    bins = wp.zeros(shape=(wp.static(3 * SAH_BINS),), dtype=Bin)
    counts = wp.zeros(shape=(wp.static(3 * SAH_BINS),), dtype=int)
    right_costs = wp.zeros(shape=(SAH_BINS,), dtype=float)
    measure_range(references, first, count, halves_out, 0)
    work = halves_out[0]
    split_range(builder, references, spare, first, work, leaf_bits, bins, counts, right_costs, halves_out)
    work.node = 2 * halves_out[1].first
    write_node(trees, work, 0, 0)


@wp.kernel
def build_subtrees(
    builder: int,
    references: wp.array[Reference],
    spare: wp.array[Reference],
    costs: wp.array2d[float],
    leaf_bits: int,
    first: wp.array[int],
    count: wp.array[int],
    trees: BinaryTrees,
):
    """Build the whole subtree of references [first, first + count), one a thread, and find its best wide nodes.

    Where there is memory for ``costs``, those of one subtree, the trees keep only its root's.
    """
    bins = wp.zeros(shape=(wp.static(3 * SAH_BINS),), dtype=Bin)
    counts = wp.zeros(shape=(wp.static(3 * SAH_BINS),), dtype=int)
    right_costs = wp.zeros(shape=(SAH_BINS,), dtype=float)
    halves = wp.zeros(shape=(2,), dtype=BuildRange)
    stack = wp.zeros(shape=(BUILD_STACK,), dtype=BuildRange)
    begin = first[wp.tid()]
    measure_range(references, begin, count[wp.tid()], stack, 0)
    stack[0].node = 2 * begin + 1
    free = int(2 * begin + 2)
    top = int(1)
    while top > 0:
        top -= 1
        work = stack[top]
        if work.count <= 1 << leaf_bits:
            write_leaf(trees, references, work)
        else:
            split_range(builder, references, spare, 0, work, leaf_bits, bins, counts, right_costs, halves)
            write_node(trees, work, free, free + 1)
            halves[0].node = free
            halves[1].node = free + 1
            free += 2
            # The smaller half is taken next: each pending one is at least as big, so that log2(count) are enough.
            larger = 0 if halves[0].count >= halves[1].count else 1
            stack[top] = halves[larger]
            stack[top + 1] = halves[1 - larger]
            top += 2
    root = 2 * begin + 1
    subtree = trees
    if costs.shape[0] > 0:
        subtree.costs = costs
        subtree.first_cost = root
    # Children have higher slots than their parents.
    for step in range(free - root):
        evaluate_costs(subtree, free - 1 - step)
    if costs.shape[0] > 0:
        for k in range(WIDTH):
            trees.costs[root, k] = costs[0, k]
