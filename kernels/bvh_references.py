# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""References: the boxes of primitives, which every builder starts from, and the ranges that they lie in.

Boxes of many references are found in chunks, then chunks of chunks, so that no two threads write to the same place.
"""

import warp as wp

from .bvh_structs import BuildRange, Reference

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def xyz(v: wp.vec4) -> wp.vec3:
    """Return a vector without its w."""
    return wp.vec3(v[0], v[1], v[2])


@wp.func_native(
    r"""
    const float inf = INFINITY;
    float low[4] = {inf, inf, inf, inf}, high[4] = {-inf, -inf, -inf, -inf};
    float centroid_low[4] = {inf, inf, inf, inf}, centroid_high[4] = {-inf, -inf, -inf, -inf};
    for (int i = first; i < first + count; ++i) {
        const auto reference = references.data[i];
        for (int k = 0; k < 3; ++k) {
            const float a = reference.low[k], b = reference.high[k], centroid = a + b;
            low[k] = a < low[k] ? a : low[k];
            high[k] = b > high[k] ? b : high[k];
            centroid_low[k] = centroid < centroid_low[k] ? centroid : centroid_low[k];
            centroid_high[k] = centroid > centroid_high[k] ? centroid : centroid_high[k];
        }
    }
    for (int k = 0; k < 3; ++k) {
        ranges.data[at].low[k] = low[k];
        ranges.data[at].high[k] = high[k];
        ranges.data[at].centroid_low[k] = centroid_low[k];
        ranges.data[at].centroid_high[k] = centroid_high[k];
    }
    ranges.data[at].first = first;
    ranges.data[at].count = count;
"""
)
def measure_range(references: wp.array[Reference], first: int, count: int, ranges: wp.array[BuildRange], at: int):
    """Set element ``at`` of ``ranges`` to references [first, first + count) with their boxes."""
    ...


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
        reference.high = wp.vec4(high[0], high[1], high[2], wp.cast(1, wp.float32))
        references_out[i] = reference
    measure_range(references_out, begin, count, chunk_ranges_out, chunk)


@wp.kernel
def measure_chunks(
    references: wp.array[Reference],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    first: int,
    chunk_ranges_out: wp.array[BuildRange],
):
    """Write the boxes of one chunk of references."""
    chunk = first + wp.tid()
    measure_range(references, chunk_first[chunk], chunk_count[chunk], chunk_ranges_out, chunk)


@wp.kernel
def merge_ranges(
    parts: wp.array[BuildRange],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    first: int,
    ranges_out: wp.array[BuildRange],
):
    """Write the range that a chunk of successive ranges makes up."""
    chunk = first + wp.tid()
    begin = chunk_first[chunk]
    low = parts[begin].low
    high = parts[begin].high
    centroid_low = parts[begin].centroid_low
    centroid_high = parts[begin].centroid_high
    count = parts[begin].count
    for i in range(begin + 1, begin + chunk_count[chunk]):
        low = wp.min(low, parts[i].low)
        high = wp.max(high, parts[i].high)
        centroid_low = wp.min(centroid_low, parts[i].centroid_low)
        centroid_high = wp.max(centroid_high, parts[i].centroid_high)
        count += parts[i].count
    ranges_out[chunk].low = low
    ranges_out[chunk].high = high
    ranges_out[chunk].centroid_low = centroid_low
    ranges_out[chunk].centroid_high = centroid_high
    ranges_out[chunk].first = parts[begin].first
    ranges_out[chunk].count = count
