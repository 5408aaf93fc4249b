# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A span of successive rays, which a worker of the CPU takes through the hierarchy the way that suits them."""

import warp as wp

from .bvh_flight import Flights, is_for_flights, trace_flights
from .bvh_group import trace_group
from .bvh_structs import AccelData
from .bvh_traverse import is_ray_finite
from .constants import (
    BUSY_WORD,
    END_WORD,
    GROUP,
    GROUP_SPAN,
    LAST_RAYS,
    LAST_SPAN,
    LAUNCH_SPANS,
    OVER_WORD,
    PROGRESS_WORDS,
    SCATTER_STRIDE,
    SCATTERED,
    WAIT_TURNS,
    YIELD_TURNS,
)
from .gather_rays import load_group
from .group_structs import RayGroup
from .intersect_packet import COLUMNS, VECTOR_TYPES, octant_of
from .native import spell_out
from .per_type import per_type
from .ray_results import Results, is_satisfied_by_any, prefetch_results, trace_single, write_flight, write_group
from .vector import relative


@wp.struct
class RaySpan:
    """Scratch memory of a span of rays."""

    order: wp.array[int]
    """Nine lists of rays, shape [9 GROUP_SPAN]: by octant of the direction, and last those that are not finite."""
    sizes: wp.array[int]
    """Rays on each list, shape [9]."""
    group: RayGroup
    flights: Flights
    worker: int
    """Number of the worker that has this memory; 0: the thread that asks the query."""


_TAKE = r"""
    const int workers = words.shape[0] / PROGRESS_WORDS;
    for (int turn = 0; turn < workers; ++turn) {
        int* own = (int*)words.data + PROGRESS_WORDS * ((worker + turn) % workers);
        const int end = own[END_WORD];
        int begin = *(volatile int*)own;
        while (begin < end) {
            const int left = end - begin;
            const int size = left > LAST_RAYS ? GROUP_SPAN : left < LAST_SPAN ? left : LAST_SPAN;
#if defined(__CUDA_ARCH__)
            const int found = atomicCAS(own, begin, begin + size);
            if (found == begin)
                return wp::vec_t<2, int>(begin, size);
            begin = found;
#else
            if (__atomic_compare_exchange_n(own, &begin, begin + size, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
                return wp::vec_t<2, int>(begin, size);
#endif
        }
    }
    *(volatile int*)((int*)words.data + OVER_WORD) = 1;
    return wp::vec_t<2, int>(0, 0);
"""
_PROGRESS = {
    "PROGRESS_WORDS": PROGRESS_WORDS,
    "END_WORD": END_WORD,
    "BUSY_WORD": BUSY_WORD,
    "OVER_WORD": OVER_WORD,
}


@wp.func_native(spell_out(_TAKE, GROUP_SPAN=GROUP_SPAN, LAST_RAYS=LAST_RAYS, LAST_SPAN=LAST_SPAN, **_PROGRESS))
def take_span(words: wp.array[int], worker: int) -> wp.vec2i:
    """Return first ray and size of a span that nobody has taken: of a worker's own part, then of the next ones'.

    Native, for Warp's own atomics are not atomic between launches of several CPU threads.

    Args:
        words: See ``trace_spans``.
        worker: Number of the worker.

    Returns:
        Size 0 where no rays are left.
    """
    ...


_LEAVE = r"""
#if !defined(__CUDA_ARCH__)
    int* all = (int*)words.data;
    const int workers = words.shape[0] / PROGRESS_WORDS;
    const bool is_over = *(volatile int*)(all + OVER_WORD) != 0;
    __atomic_store_n(all + PROGRESS_WORDS * worker + BUSY_WORD, 0, __ATOMIC_RELEASE);
    // Without the processor's pause: a virtual one that pauses often is taken for idle, and loses its core.
    volatile int busy = worker;
    for (int turn = is_over ? 0 : WAIT_TURNS; turn < (worker == 0 ? WAIT_TURNS : YIELD_TURNS); ++turn) {
        busy = worker;
        for (int other = 1; worker == 0 && other < workers; ++other)
            busy = busy | __atomic_load_n(all + PROGRESS_WORDS * other + BUSY_WORD, __ATOMIC_ACQUIRE);
        if (busy == 0)
            break;
    }
#endif
"""


@wp.func_native(spell_out(_LEAVE, WAIT_TURNS=WAIT_TURNS, YIELD_TURNS=YIELD_TURNS, **_PROGRESS))
def leave_query(words: wp.array[int], worker: int):
    """Mark a worker as done with a launch, the last that it does to the memory of a query.

    Where no rays are left, worker 0, whose thread asks the query, then waits for the others: they are at their last
    spans, and end sooner than a sleeping thread wakes up. They give it the time to go on before they need Python's lock
    themselves.

    Args:
        words: See ``trace_spans``.
        worker: Number of the worker.
    """
    ...


_SORT = (
    r"""
    int* lists = (int*)order.data;
    int counts[9] = {};
    int position = first;
#if defined(__AVX512F__) && defined(__clang__) && !defined(__CUDA_ARCH__)
"""
    + VECTOR_TYPES
    + COLUMNS
    + r"""
    const ints steps = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    for (; sorted.shape[0] == 0 && position + 16 <= first + count; position += 16) {
        WARP_RT_COLUMNS((const float*)origins.data + 3 * (size_t)position, o_x, o_y, o_z);
        WARP_RT_COLUMNS((const float*)directions.data + 3 * (size_t)position, d_x, d_y, d_z);
        const floats total = o_x + o_y + o_z + d_x + d_y + d_z;
        const ints octants = ((d_x < 0.0f) & 1) | ((d_y < 0.0f) & 2) | ((d_z < 0.0f) & 4);
        const ints own = (total - total == 0.0f) ? octants : (ints)8;
        for (unsigned int rest = 0xffffu; rest != 0;) {
            const int list = own[__builtin_ctz(rest)];
            const unsigned short mask = WARP_RT_MASK(own == list);
            int* end = lists + list * GROUP_SPAN + counts[list];
            __builtin_ia32_compressstoresi512_mask((ints*)end, position + steps, mask);
            counts[list] += __builtin_popcount(mask);
            rest &= ~mask;
        }
    }
}
#endif
    for (; position < first + count; ++position) {
        const int ray = sorted.shape[0] == 0 ? position : ((const int*)sorted.data)[position];
#if !defined(__CUDA_ARCH__)
        if (position + 16 < sorted.shape[0]) {
            const int next = ((const int*)sorted.data)[position + 16];
            __builtin_prefetch((const float*)origins.data + 3 * (size_t)next);
            __builtin_prefetch((const float*)directions.data + 3 * (size_t)next);
        }
#endif
        const float* origin = (const float*)origins.data + 3 * (size_t)ray;
        const float* direction = (const float*)directions.data + 3 * (size_t)ray;
        const float total = origin[0] + origin[1] + origin[2] + direction[0] + direction[1] + direction[2];
        const int octant = (direction[0] < 0.0f) + 2 * (direction[1] < 0.0f) + 4 * (direction[2] < 0.0f);
        const int list = total - total == 0.0f ? octant : 8;
        lists[list * GROUP_SPAN + counts[list]] = ray;
        ++counts[list];
    }
    for (int list = 0; list < 9; ++list)
        ((int*)sizes.data)[list] = counts[list];
"""
)


@wp.func_native(spell_out(_SORT, GROUP_SPAN=GROUP_SPAN))
def sort_by_octant(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    sorted: wp.array[int],
    first: int,
    count: int,
    order: wp.array[int],
    sizes: wp.array[int],
):
    """List ``count`` rays by octant, in their order; those that are not finite make a ninth list.

    Args:
        origins: Contiguous.
        directions: Likewise.
        sorted: The rays in the order in which they are taken; empty: as they come.
        first: Position of the first ray in that order.
        count: At most GROUP_SPAN.
        order: Output, nine lists of GROUP_SPAN rays each.
        sizes: Output, how many are on each, shape [9].
    """
    ...


@wp.func
def sort_by_octant_plain(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    sorted: wp.array[int],
    first: int,
    count: int,
    order: wp.array[int],
    sizes: wp.array[int],
):
    """Write what ``sort_by_octant`` writes, in plain Warp."""
    for i in range(9):
        sizes[i] = 0
    for position in range(first, first + count):
        ray = position if sorted.shape[0] == 0 else sorted[position]
        row = int(8)
        if is_ray_finite(origins[ray], directions[ray]):
            row = octant_of(directions[ray])
        order[row * GROUP_SPAN + sizes[row]] = ray
        sizes[row] = sizes[row] + 1


@wp.func
def are_scattered(origins: wp.array[wp.vec3], first: int, count: int) -> bool:
    """Return whether successive rays start as far from each other as any two of the span do: they come in no order.

    Judged by every SCATTER_STRIDE-th pair of neighbours. Points at random are a third of their extent apart, those of
    neighbouring pixels a small part of it.
    """
    low = origins[first]
    high = origins[first]
    steps = float(0.0)
    pairs = int(0)
    for i in range(first, first + count - 1, SCATTER_STRIDE):
        a = origins[i]
        b = origins[i + 1]
        low = wp.min(low, wp.min(a, b))
        high = wp.max(high, wp.max(a, b))
        steps += wp.abs(a[0] - b[0]) + wp.abs(a[1] - b[1]) + wp.abs(a[2] - b[2])
        pairs += 1
    extent = high - low
    return steps > SCATTERED * float(pairs) * (extent[0] + extent[1] + extent[2])


@per_type
def trace_span(
    accel: wp.ref[AccelData],
    span: wp.ref[RaySpan],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    base: wp.array[wp.vec3d],
    sorted: wp.array[int],
    begin: int,
    size: int,
    results: Results,
):
    """Trace rays ``begin`` to ``begin + size`` of an order, and write what becomes of them.

    In groups by octant; where they come in no order, several in flight at a time over a hierarchy beyond the caches,
    else one by one.

    Args:
        accel: Hierarchies.
        span: Scratch memory.
        origins: Of all rays, contiguous.
        directions: Likewise.
        t_max: One value for all rays, or one a ray.
        base: Point that the hierarchy's coordinates are relative to, in those of ``origins``, shape [1].
        sorted: The rays so that successive ones are near each other; empty: as they come.
        begin: Position of the first ray.
        size: At most GROUP_SPAN.
        results: Output.
    """
    is_any = is_satisfied_by_any(results)
    if sorted.shape[0] == 0 and are_scattered(origins, begin, size):
        if is_for_flights(accel):
            trace_flights(accel, span.flights, origins, directions, t_max, base[0], begin, size, is_any)
            for row in range(size):
                write_flight(accel, results, begin + row, span.flights, row)
            return
        is_moved = not (base[0] == wp.vec3d())
        for ray in range(begin, begin + size):
            end = t_max[wp.min(ray, t_max.shape[0] - 1)]
            origin = origins[ray]
            if is_moved:
                origin = relative(origin, base[0])
            trace_single(accel, results, ray, origin, directions[ray], end, span.group.single_stack)
        return
    sort_by_octant(origins, directions, sorted, begin, size, span.order, span.sizes)
    for octant in range(9):
        start = octant * GROUP_SPAN
        end_of_list = start + span.sizes[octant]
        while start < end_of_list:
            count = wp.min(GROUP, end_of_list - start)
            if sorted.shape[0] > 0:
                prefetch_results(results, span.order, start, count)
            if octant < 8:
                rays = span.group.rays
                ends = span.group.ends
                load_group(origins, directions, t_max, base[0], span.order, start, count, rays, 0, ends)
                trace_group(accel, span.group, count, is_any)
            write_group(accel, results, span.order, start, count, octant < 8, span.group)
            start += count


@per_type
def trace_spans(
    accel: wp.ref[AccelData],
    span: wp.ref[RaySpan],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    base: wp.array[wp.vec3d],
    sorted: wp.array[int],
    words: wp.array[int],
    results: Results,
):
    """Trace spans that nobody has taken until there are no more, but at most LAUNCH_SPANS. See ``trace_span``.

    Each worker has a part of the rays, so that neighbours meet in one core's cache, and when that is done it helps the
    others. ``words`` has PROGRESS_WORDS words for each, a cache line: the first ray of its part that nobody has taken;
    at END_WORD where the part ends; at BUSY_WORD 0 if the worker is in no launch. OVER_WORD of the first worker's is
    not 0 when all rays are taken.
    """
    for _turn in range(wp.int32(LAUNCH_SPANS)):
        taken = take_span(words, span.worker)
        if taken[1] == 0:
            break
        trace_span(accel, span, origins, directions, t_max, base, sorted, taken[0], taken[1], results)
    leave_query(words, span.worker)
