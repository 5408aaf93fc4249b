# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Builders of the binary tree: midpoint, median, surface area heuristic (SAH), and linear by Morton codes (LBVH).

A builder is a function that splits a range of references in two, moving them in place; everything else is shared.
The tree depends on the references and the builder alone, never on how ranges were dealt to threads.
"""

import warp as wp

from .bounds import box_half_area, widest_axis
from .bvh_structs import BinaryNode, BuildRange, Reference
from .constants import BUILD_STACK, MIN_EXTENT, SAH_BINS, SAH_BINS_SMALL, SAH_SMALL_COUNT
from .morton import morton_code

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})

SAH = wp.constant(0)
MEDIAN = wp.constant(1)
MIDPOINT = wp.constant(2)
LBVH = wp.constant(3)


@wp.struct
class Bin:
    """References whose centroids fall into one slice of the range's centroid box."""

    low: wp.vec4
    high: wp.vec4
    count: int


@wp.func
def xyz(v: wp.vec4) -> wp.vec3:
    """Return a vector without its w."""
    return wp.vec3(v[0], v[1], v[2])


@wp.func
def half_area(low: wp.vec4, high: wp.vec4) -> float:
    """Return half the surface area of a box."""
    return box_half_area(xyz(low), xyz(high))


@wp.func
def empty_range() -> BuildRange:
    """Return a range without references: boxes that any union replaces."""
    inf4 = wp.vec4(wp.inf, wp.inf, wp.inf, wp.inf)
    result = BuildRange()
    result.low = inf4
    result.high = -inf4
    result.centroid_low = inf4
    result.centroid_high = -inf4
    return result


@wp.func
def measure_range(references: wp.array[Reference], first: int, count: int) -> BuildRange:
    """Return references [first, first + count) as a range with its boxes."""
    result = empty_range()
    result.first = first
    result.count = count
    for i in range(first, first + count):
        reference = references[i]
        centroid = reference.low + reference.high
        result.low = wp.min(result.low, reference.low)
        result.high = wp.max(result.high, reference.high)
        result.centroid_low = wp.min(result.centroid_low, centroid)
        result.centroid_high = wp.max(result.centroid_high, centroid)
    return result


@wp.func
def slices_per_unit(work: BuildRange, count: int) -> wp.vec3:
    """Return how many of ``count`` slices of the centroid box go into a unit of length; 0 where it has no extent."""
    extent = xyz(work.centroid_high - work.centroid_low)
    scale = wp.vec3()
    for axis in range(3):
        if extent[axis] > MIN_EXTENT:
            # A little less than count, so that the far end falls into the last slice.
            scale[axis] = (float(count) - 0.001) / extent[axis]
    return scale


@wp.func
def slice_of(reference: Reference, work: BuildRange, scale: wp.vec3, axis: int) -> int:
    """Return the slice of the centroid box that a reference's centroid is in."""
    return int((reference.low[axis] + reference.high[axis] - work.centroid_low[axis]) * scale[axis])


@wp.func
def partition_slices(
    references: wp.array[Reference],
    work: BuildRange,
    scale: wp.vec3,
    axis: int,
    last_left: int,
    halves: wp.array[BuildRange],
) -> int:
    """Move references of slices up to ``last_left`` to the front and return the first of the others.

    Sets the centroid boxes of both halves.
    """
    left_low = wp.vec4(wp.inf)
    left_high = wp.vec4(-wp.inf)
    right_low = wp.vec4(wp.inf)
    right_high = wp.vec4(-wp.inf)
    i = int(work.first)
    j = int(work.first + work.count)
    while i < j:
        reference = references[i]
        centroid = reference.low + reference.high
        if slice_of(reference, work, scale, axis) <= last_left:
            left_low = wp.min(left_low, centroid)
            left_high = wp.max(left_high, centroid)
            i += 1
        else:
            right_low = wp.min(right_low, centroid)
            right_high = wp.max(right_high, centroid)
            j -= 1
            references[i] = references[j]
            references[j] = reference
    halves[0].centroid_low = left_low
    halves[0].centroid_high = left_high
    halves[1].centroid_low = right_low
    halves[1].centroid_high = right_high
    return i


# --- splits: each returns the first reference of the right half, or -1 for a range that it cannot tell apart


@wp.func
def fill_bins(references: wp.array[Reference], work: BuildRange, scale: wp.vec3, bin_count: int, bins: wp.array[Bin]):
    """Sort a range's references into ``bin_count`` bins along each axis; bins of an axis follow each other."""
    for b in range(3 * bin_count):
        bins[b].low = wp.vec4(wp.inf)
        bins[b].high = wp.vec4(-wp.inf)
        bins[b].count = 0
    for i in range(work.first, work.first + work.count):
        reference = references[i]
        for axis in range(3):
            b = axis * bin_count + slice_of(reference, work, scale, axis)
            bins[b].low = wp.min(bins[b].low, reference.low)
            bins[b].high = wp.max(bins[b].high, reference.high)
            bins[b].count += 1


@wp.func
def packet_count(count: int, leaf_size: int) -> float:
    """Return how many leaf packets hold ``count`` references."""
    return float((count + leaf_size - 1) // leaf_size)


@wp.func
def split_sah(
    references: wp.array[Reference],
    work: BuildRange,
    leaf_size: int,
    bins: wp.array[Bin],
    right_costs: wp.array[float],
    halves: wp.array[BuildRange],
) -> int:
    """Split where half area times number of leaf packets, summed over both halves, is least; sets both halves' boxes.

    Counting packets of ``leaf_size`` references instead of references fills the packets.

    Reference: Wald (2007), On Fast Construction of SAH-based Bounding Volume Hierarchies, IEEE Symposium on
    Interactive Ray Tracing, section 3; the cost by blocks after Embree's heuristic_binning.h.
    """
    bin_count = wp.where(work.count <= SAH_SMALL_COUNT, SAH_BINS_SMALL, SAH_BINS)
    scale = slices_per_unit(work, bin_count)
    fill_bins(references, work, scale, bin_count, bins)
    best_cost = float(wp.inf)
    best_axis = int(-1)
    best_bin = int(0)
    for axis in range(3):
        if scale[axis] > 0.0:
            base = axis * bin_count
            low = wp.vec4(wp.inf)
            high = wp.vec4(-wp.inf)
            count = int(0)
            for step in range(bin_count - 1):
                b = bin_count - 1 - step
                low = wp.min(low, bins[base + b].low)
                high = wp.max(high, bins[base + b].high)
                count += bins[base + b].count
                right_costs[b] = half_area(low, high) * packet_count(count, leaf_size)
            low = wp.vec4(wp.inf)
            high = wp.vec4(-wp.inf)
            count = int(0)
            for b in range(bin_count - 1):
                low = wp.min(low, bins[base + b].low)
                high = wp.max(high, bins[base + b].high)
                count += bins[base + b].count
                if count > 0 and count < work.count:
                    cost = half_area(low, high) * packet_count(count, leaf_size) + right_costs[b + 1]
                    if cost < best_cost:
                        best_cost = cost
                        best_axis = axis
                        best_bin = b
    if best_axis < 0:
        return -1
    halves[0] = empty_range()
    halves[1] = empty_range()
    for b in range(bin_count):
        side = wp.where(b <= best_bin, 0, 1)
        halves[side].low = wp.min(halves[side].low, bins[best_axis * bin_count + b].low)
        halves[side].high = wp.max(halves[side].high, bins[best_axis * bin_count + b].high)
    return partition_slices(references, work, scale, best_axis, best_bin, halves)


@wp.func
def split_midpoint(references: wp.array[Reference], work: BuildRange, halves: wp.array[BuildRange]) -> int:
    """Split at the middle of the centroid box's longest side.

    Reference: Komura, Computer Graphics, lecture 10, Where to split objects? At midpoint.
    """
    axis = widest_axis(xyz(work.centroid_high - work.centroid_low))
    scale = slices_per_unit(work, 2)
    if scale[axis] == 0.0:
        return -1
    return partition_slices(references, work, scale, axis, 0, halves)


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
def split_morton(codes: wp.array[wp.uint64], work: BuildRange) -> int:
    """Split where the highest bit that differs within the range changes; references are sorted by Morton code.

    Reference: Lauterbach et al. (2009), Fast BVH Construction on GPUs, Eurographics, section 4.
    """
    low = int(work.first)
    high = int(work.first + work.count - 1)
    difference = codes[low] ^ codes[high]
    if difference == wp.uint64(0):
        return -1
    for shift in range(6):
        difference = difference | (difference >> wp.uint64(1 << shift))
    bit = difference ^ (difference >> wp.uint64(1))
    # The bit is clear at low and set at high; keep it so until they are neighbours.
    while high - low > 1:
        middle = (low + high) // 2
        if (codes[middle] & bit) == wp.uint64(0):
            low = int(middle)
        else:
            high = int(middle)
    return high


@wp.func
def split_range(
    builder: int,
    references: wp.array[Reference],
    codes: wp.array[wp.uint64],
    work: BuildRange,
    leaf_size: int,
    bins: wp.array[Bin],
    right_costs: wp.array[float],
    halves: wp.array[BuildRange],
):
    """Split a range as ``builder`` does, and set both halves.

    References that no split tells apart, such as identical ones, are halved by count: every leaf ends up with at
    most ``leaf_size`` of them.
    """
    middle = int(-1)
    if builder == SAH:
        middle = split_sah(references, work, leaf_size, bins, right_costs, halves)
    elif builder == MEDIAN:
        middle = split_median(references, work)
    elif builder == MIDPOINT:
        middle = split_midpoint(references, work, halves)
    else:
        middle = split_morton(codes, work)
    has_boxes = builder == SAH and middle >= 0
    if middle < 0:
        middle = work.first + work.count // 2
    left_count = middle - work.first
    if not has_boxes:
        halves[0] = measure_range(references, work.first, left_count)
        halves[1] = measure_range(references, middle, work.count - left_count)
    halves[0].first = work.first
    halves[0].count = left_count
    halves[0].node = work.node + 1
    halves[1].first = middle
    halves[1].count = work.count - left_count
    halves[1].node = work.node + 2 * left_count


@wp.func
def write_node(nodes: wp.array[BinaryNode], work: BuildRange, first: int, count: int):
    """Write the node of a range."""
    node = BinaryNode()
    node.low = xyz(work.low)
    node.high = xyz(work.high)
    node.first = first
    node.count = count
    nodes[work.node] = node


# --- kernels


@wp.kernel
def split_range_once(
    builder: int,
    references: wp.array[Reference],
    codes: wp.array[wp.uint64],
    leaf_size: int,
    ranges: wp.array[BuildRange],
    nodes_out: wp.array[BinaryNode],
    halves_out: wp.array[BuildRange],
):
    """Split the first range, write its node, and put its halves into ``halves_out``."""
    bins = wp.zeros(shape=(wp.static(3 * SAH_BINS),), dtype=Bin)
    right_costs = wp.zeros(shape=(SAH_BINS,), dtype=float)
    work = ranges[0]
    split_range(builder, references, codes, work, leaf_size, bins, right_costs, halves_out)
    write_node(nodes_out, work, halves_out[1].node, 0)


@wp.kernel
def build_subtrees(
    builder: int,
    references: wp.array[Reference],
    codes: wp.array[wp.uint64],
    leaf_size: int,
    ranges: wp.array[BuildRange],
    nodes_out: wp.array[BinaryNode],
):
    """Build the whole subtree of a range, one range a thread."""
    bins = wp.zeros(shape=(wp.static(3 * SAH_BINS),), dtype=Bin)
    right_costs = wp.zeros(shape=(SAH_BINS,), dtype=float)
    halves = wp.zeros(shape=(2,), dtype=BuildRange)
    stack = wp.zeros(shape=(BUILD_STACK,), dtype=BuildRange)
    stack[0] = ranges[wp.tid()]
    top = int(1)
    while top > 0:
        top -= 1
        work = stack[top]
        if work.count <= leaf_size:
            write_node(nodes_out, work, work.first, work.count)
        else:
            split_range(builder, references, codes, work, leaf_size, bins, right_costs, halves)
            write_node(nodes_out, work, halves[1].node, 0)
            # The smaller half is taken next: each pending one is at least as big, so that log2(count) are enough.
            larger = wp.where(halves[0].count >= halves[1].count, 0, 1)
            stack[top] = halves[larger]
            stack[top + 1] = halves[1 - larger]
            top += 2


@wp.kernel
def refer_to_triangles(
    points: wp.array[wp.vec3],
    triangles: wp.array[int],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    first: int,
    references_out: wp.array[Reference],
    chunk_ranges_out: wp.array[BuildRange],
):
    """Write the references of one chunk of triangles, and the chunk's boxes."""
    chunk = first + wp.tid()
    begin = chunk_first[chunk]
    count = chunk_count[chunk]
    for i in range(begin, begin + count):
        p0 = points[triangles[3 * i]]
        p1 = points[triangles[3 * i + 1]]
        p2 = points[triangles[3 * i + 2]]
        low = wp.min(wp.min(p0, p1), p2)
        high = wp.max(wp.max(p0, p1), p2)
        reference = Reference()
        reference.low = wp.vec4(low[0], low[1], low[2], wp.cast(i, wp.float32))
        reference.high = wp.vec4(high[0], high[1], high[2], 0.0)
        references_out[i] = reference
    chunk_ranges_out[chunk] = measure_range(references_out, begin, count)


@wp.kernel
def refer_to_boxes(
    low: wp.array[wp.vec3], high: wp.array[wp.vec3], ids: wp.array[int], references_out: wp.array[Reference]
):
    """Write the references of boxes."""
    i = wp.tid()
    reference = Reference()
    reference.low = wp.vec4(low[i][0], low[i][1], low[i][2], wp.cast(ids[i], wp.float32))
    reference.high = wp.vec4(high[i][0], high[i][1], high[i][2], 0.0)
    references_out[i] = reference


@wp.kernel
def encode_references(
    references: wp.array[Reference],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    chunk_tree: wp.array[int],
    ranges: wp.array[BuildRange],
    first: int,
    codes_out: wp.array[wp.uint64],
    order_out: wp.array[int],
):
    """Write the Morton codes of one chunk's centroids within their tree's centroid box, and the references' rows."""
    chunk = first + wp.tid()
    work = ranges[chunk_tree[chunk]]
    scale = slices_per_unit(work, 1)
    for i in range(chunk_first[chunk], chunk_first[chunk] + chunk_count[chunk]):
        centroid = xyz(references[i].low + references[i].high - work.centroid_low)
        codes_out[i] = morton_code(wp.cw_mul(centroid, scale))
        order_out[i] = i


@wp.kernel
def gather_references(references: wp.array[Reference], order: wp.array[int], references_out: wp.array[Reference]):
    """Write the references in the given order."""
    i = wp.tid()
    references_out[i] = references[order[i]]
