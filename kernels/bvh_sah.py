# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The binned surface area heuristic: where to split a range of references, and the split itself.

Both loops over the references are native: Warp's array access multiplies by strides that it reads at run time, and
clang vectorises neither the unions of boxes nor the moves around them; like this they take half the time.
"""

import warp as wp

from .bvh_references import xyz
from .bvh_structs import Bin, BuildRange, Reference
from .constants import MIN_EXTENT, SAH_BINS, SAH_BINS_SMALL, SAH_SMALL_COUNT


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


# Unions of boxes, a corner at a time. The fourth numbers are bits of integers, denormal ones as floats, for which a CPU
# takes a hundred cycles an operation: they are left out wherever anything is computed.
UNIONS = r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
#define WARP_RT_LOWER(a, b) for (int k = 0; k < 3; ++k) (a)[k] = (b)[k] < (a)[k] ? (b)[k] : (a)[k]
#define WARP_RT_RAISE(a, b) for (int k = 0; k < 3; ++k) (a)[k] = (b)[k] > (a)[k] ? (b)[k] : (a)[k]
#else
typedef float float4_load __attribute__((ext_vector_type(4), aligned(4)));
#define WARP_RT_CORNER(a) (*(float4_load*)&(a)[0])
#define WARP_RT_XYZ0(a) __builtin_shufflevector(WARP_RT_CORNER(a), (float4_load)(0.0f), 0, 1, 2, 4)
#define WARP_RT_LOWER(a, b) \
    WARP_RT_CORNER(a) = WARP_RT_XYZ0(b) < WARP_RT_CORNER(a) ? WARP_RT_XYZ0(b) : WARP_RT_CORNER(a)
#define WARP_RT_RAISE(a, b) \
    WARP_RT_CORNER(a) = WARP_RT_XYZ0(b) > WARP_RT_CORNER(a) ? WARP_RT_XYZ0(b) : WARP_RT_CORNER(a)
#endif
    const float inf = INFINITY;
"""

_FIND_SPLIT = (
    UNIONS
    + r"""
    for (int b = 0; b < 3 * bin_count; ++b) {
        for (int k = 0; k < 4; ++k) {
            bins.data[b].low[k] = inf;
            bins.data[b].high[k] = -inf;
        }
        counts.data[b] = 0;
    }
    int total = 0;
    for (int i = work.first; i < work.first + work.count; ++i) {
        auto &low = references.data[i].low, &high = references.data[i].high;
        const int weight = ((const int*)&references.data[i])[7];
        total += weight;
        int slice[3];
        for (int axis = 0; axis < 3; ++axis)
            slice[axis] = axis * bin_count + (int)((low[axis] + high[axis] - work.centroid_low[axis]) * scale[axis]);
        for (int axis = 0; axis < 3; ++axis) {
            auto& bin = bins.data[slice[axis]];
            WARP_RT_LOWER(bin.low, low);
            WARP_RT_RAISE(bin.high, high);
            counts.data[slice[axis]] += weight;
        }
    }
    float best_cost = inf;
    int best = -1;
    for (int axis = 0; axis < 3; ++axis) {
        if (scale[axis] == 0.0f)
            continue;
        const int base = axis * bin_count;
        float low[4] = {inf, inf, inf, inf}, high[4] = {-inf, -inf, -inf, -inf};
        int count = 0;
        for (int b = bin_count - 1; b > 0; --b) {
            auto& bin = bins.data[base + b];
            WARP_RT_LOWER(low, bin.low);
            WARP_RT_RAISE(high, bin.high);
            count += counts.data[base + b];
            const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
            right_costs.data[b] = (x * (y + z) + y * z) * (float)((count + round_up) >> leaf_bits);
        }
        for (int k = 0; k < 4; ++k) {
            low[k] = inf;
            high[k] = -inf;
        }
        count = 0;
        for (int b = 0; b < bin_count - 1; ++b) {
            auto& bin = bins.data[base + b];
            WARP_RT_LOWER(low, bin.low);
            WARP_RT_RAISE(high, bin.high);
            count += counts.data[base + b];
            const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
            const float left_cost = (x * (y + z) + y * z) * (float)((count + round_up) >> leaf_bits);
            const float cost = left_cost + right_costs.data[b + 1];
            if (count > 0 && count < total && cost < best_cost) {
                best_cost = cost;
                best = base + b;
            }
        }
    }
    if (best < 0)
        return best;
    const int axis = best / bin_count;
    for (int side = 0; side < 2; ++side) {
        const int begin = side == 0 ? axis * bin_count : best + 1;
        const int end = side == 0 ? best + 1 : (axis + 1) * bin_count;
        auto low = bins.data[begin].low, high = bins.data[begin].high;
        for (int b = begin + 1; b < end; ++b) {
            auto& bin = bins.data[b];
            WARP_RT_LOWER(low, bin.low);
            WARP_RT_RAISE(high, bin.high);
        }
        halves.data[side].low = low;
        halves.data[side].high = high;
    }
    return best;
""".replace("round_up", "(1 << leaf_bits) - 1")
)


@wp.func_native(_FIND_SPLIT)
def find_split(
    references: wp.array[Reference],
    work: BuildRange,
    scale: wp.vec3,
    bin_count: int,
    leaf_bits: int,
    bins: wp.array[Bin],
    counts: wp.array[int],
    right_costs: wp.array[float],
    halves: wp.array[BuildRange],
) -> int:
    """Return axis * bin_count + the last bin of the left half, for the split of least cost; -1 where there is none.

    Sorts the references into bins along each axis, of ``slices_per_unit`` ``scale``, and sets the boxes of both halves.
    """
    ...


_PARTITION = r"""
    const float inf = INFINITY;
    const float origin = work.centroid_low[axis], unit = scale[axis];
    float left_low[4] = {inf, inf, inf, inf}, left_high[4] = {-inf, -inf, -inf, -inf};
    float right_low[4] = {inf, inf, inf, inf}, right_high[4] = {-inf, -inf, -inf, -inf};
    int left = work.first, right = spare_first;
    // Each reference is written to both sides and counted on one: no branch to mispredict.
    for (int i = work.first; i < work.first + work.count; ++i) {
        const auto reference = references.data[i];
        const bool is_left = (int)((reference.low[axis] + reference.high[axis] - origin) * unit) <= last_left;
        references.data[left] = reference;
        spare.data[right] = reference;
        left += is_left ? 1 : 0;
        right += is_left ? 0 : 1;
        for (int k = 0; k < 3; ++k) {
            const float centroid = reference.low[k] + reference.high[k];
            const float a = is_left ? centroid : inf, b = is_left ? centroid : -inf;
            const float c = is_left ? inf : centroid, d = is_left ? -inf : centroid;
            left_low[k] = a < left_low[k] ? a : left_low[k];
            left_high[k] = b > left_high[k] ? b : left_high[k];
            right_low[k] = c < right_low[k] ? c : right_low[k];
            right_high[k] = d > right_high[k] ? d : right_high[k];
        }
    }
    for (int i = spare_first; i < right; ++i)
        references.data[left + i - spare_first] = spare.data[i];
    for (int k = 0; k < 3; ++k) {
        halves.data[0].centroid_low[k] = left_low[k];
        halves.data[0].centroid_high[k] = left_high[k];
        halves.data[1].centroid_low[k] = right_low[k];
        halves.data[1].centroid_high[k] = right_high[k];
    }
    return left;
"""


@wp.func_native(_PARTITION)
def partition_slices(
    references: wp.array[Reference],
    spare: wp.array[Reference],
    spare_first: int,
    work: BuildRange,
    scale: wp.vec3,
    axis: int,
    last_left: int,
    halves: wp.array[BuildRange],
) -> int:
    """Move references of slices up to ``last_left`` to the front, in order, and return the first of the others.

    Sets the centroid boxes of both halves. ``spare`` from ``spare_first`` on has room for the whole range.
    """
    ...


@wp.func
def split_sah(
    references: wp.array[Reference],
    spare: wp.array[Reference],
    spare_first: int,
    work: BuildRange,
    leaf_bits: int,
    bins: wp.array[Bin],
    counts: wp.array[int],
    right_costs: wp.array[float],
    halves: wp.array[BuildRange],
) -> int:
    """Split where half area times number of leaf packets, summed over both halves, is least; set both halves' boxes.

    Counting packets of 2^``leaf_bits`` references instead of references fills the packets. Returns the first reference
    of the right half, or -1 where all centroids are the same.

    Reference: Wald (2007), On Fast Construction of SAH-based Bounding Volume Hierarchies, IEEE Symposium on
    Interactive Ray Tracing, section 3; the cost by blocks after Embree's heuristic_binning.h.
    """
    bin_count = SAH_BINS_SMALL if work.count <= SAH_SMALL_COUNT else SAH_BINS
    scale = slices_per_unit(work, bin_count)
    best = find_split(references, work, scale, bin_count, leaf_bits, bins, counts, right_costs, halves)
    if best < 0:
        return -1
    return partition_slices(references, spare, spare_first, work, scale, best // bin_count, best % bin_count, halves)
