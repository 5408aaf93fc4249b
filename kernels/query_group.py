# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Entry kernels of ray queries on a CPU: one thread a span of successive rays, which it groups by octant."""

import warp as wp

from .bvh_flight import Flights, is_for_flights, trace_flights
from .bvh_group import RayGroup, trace_group
from .bvh_structs import AccelData, InstanceRecord
from .bvh_traverse import any_hit, closest_hit, is_ray_finite
from .constants import GROUP, GROUP_SPAN, SCATTER_STRIDE, SCATTERED
from .intersect_group import load_group
from .intersect_packet import octant_of

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class RaySpan:
    """Scratch memory of a span of rays."""

    order: wp.array[int]
    """Nine lists of rays, shape [9 GROUP_SPAN]: by octant of the direction, and last those that are not finite."""
    sizes: wp.array[int]
    """Rays on each list, shape [9]."""
    group: RayGroup
    flights: Flights


_SORT = r"""
    const float* origin = (const float*)origins.data + 3 * (size_t)first;
    const float* direction = (const float*)directions.data + 3 * (size_t)first;
    int* lists = (int*)order.data;
    int counts[9] = {};
    for (int ray = 0; ray < count; ++ray, origin += 3, direction += 3) {
        const float total = origin[0] + origin[1] + origin[2] + direction[0] + direction[1] + direction[2];
        const int octant = (direction[0] < 0.0f) + 2 * (direction[1] < 0.0f) + 4 * (direction[2] < 0.0f);
        const int list = total - total == 0.0f ? octant : 8;
        lists[list * GROUP_SPAN + counts[list]] = first + ray;
        ++counts[list];
    }
    for (int list = 0; list < 9; ++list)
        ((int*)sizes.data)[list] = counts[list];
""".replace("GROUP_SPAN", str(GROUP_SPAN))


@wp.func_native(_SORT)
def sort_by_octant(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    first: int,
    count: int,
    order: wp.array[int],
    sizes: wp.array[int],
):
    """List ``count`` rays from ``first`` on by octant, in their order; those that are not finite make a ninth list.

    Args:
        origins: Contiguous.
        directions: Likewise.
        first: First ray.
        count: At most GROUP_SPAN.
        order: Output, nine lists of GROUP_SPAN rays each.
        sizes: Output, how many are on each, shape [9].
    """
    ...


@wp.func
def sort_by_octant_plain(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    first: int,
    count: int,
    order: wp.array[int],
    sizes: wp.array[int],
):
    """Write what ``sort_by_octant`` writes, in plain Warp."""
    for i in range(9):
        sizes[i] = 0
    for i in range(first, first + count):
        row = int(8)
        if is_ray_finite(origins[i], directions[i]):
            row = octant_of(directions[i])
        order[row * GROUP_SPAN + sizes[row]] = i
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


_WRITE_HITS = r"""
    const int* rays = (const int*)order.data + start;
    const int *word = (const int*)words.data, *record = (const int*)records.data;
    const float *t = (const float*)ends.data, *u_ = (const float*)u.data, *v_ = (const float*)v.data;
    for (int index = 0; index < count; ++index) {
        const int ray = rays[index];
        const bool is_hit = is_traced && word[index] >= 0;
        ((float*)t_out.data)[ray] = is_hit ? t[index] : INFINITY;
        ((float*)u_out.data)[ray] = is_hit ? u_[index] : 0.0f;
        ((float*)v_out.data)[ray] = is_hit ? v_[index] : 0.0f;
        ((int*)triangle_out.data)[ray] = is_hit ? ((const int*)leaves.data)[word[index]] : -1;
        ((int*)instance_out.data)[ray] = is_hit ? instances.data[record[index]].instance : -1;
    }
"""


@wp.func_native(_WRITE_HITS)
def write_hits(
    leaves: wp.array[float],
    instances: wp.array[InstanceRecord],
    order: wp.array[int],
    start: int,
    count: int,
    is_traced: bool,
    words: wp.array[int],
    records: wp.array[int],
    ends: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    t_out: wp.array[float],
    u_out: wp.array[float],
    v_out: wp.array[float],
    triangle_out: wp.array[int],
    instance_out: wp.array[int],
):
    """Write the closest hits of ``count`` rays, listed in ``order`` from ``start`` on, to where each of them belongs.

    Native, for in plain Warp each of fifteen array accesses a ray reads its array's address anew.

    Args:
        leaves: Leaf packets.
        instances: Instance records.
        order: Rays.
        start: First of them.
        count: How many.
        is_traced: Whether they were; if not, none hits anything.
        words: As in ``RayGroup``; so are the next four.
        records: Instance records of the hits.
        ends: t of the hits.
        u: Weights of the second vertex.
        v: Weights of the third.
        t_out: Output, one a ray, contiguous; so are the next four.
        u_out: Output.
        v_out: Output.
        triangle_out: Output.
        instance_out: Output.
    """
    ...


@wp.kernel
def query_closest_hit_group(
    accels: wp.array[AccelData],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    span: RaySpan,
    first: int,
    count: int,
    t_out: wp.array[float],
    u_out: wp.array[float],
    v_out: wp.array[float],
    triangle_out: wp.array[int],
    instance_out: wp.array[int],
):
    """Write the closest hits of the thread's span of rays ``first`` to ``first + count``."""
    begin = first + wp.tid() * GROUP_SPAN
    size = wp.min(GROUP_SPAN, first + count - begin)
    is_scattered = are_scattered(origins, begin, size)
    if is_scattered and is_for_flights(accels[0]):
        trace_flights(accels[0], span.flights, origins, directions, t_max, begin, size, False)
        for row in range(size):
            word = span.flights.words[row]
            if word >= 0:
                t_out[begin + row] = span.flights.t[row]
                u_out[begin + row] = span.flights.u[row]
                v_out[begin + row] = span.flights.v[row]
                triangle_out[begin + row] = wp.cast(accels[0].leaves[word], wp.int32)
                instance_out[begin + row] = accels[0].instances[0].instance
            else:
                t_out[begin + row] = wp.inf
                u_out[begin + row] = 0.0
                v_out[begin + row] = 0.0
                triangle_out[begin + row] = -1
                instance_out[begin + row] = -1
    elif is_scattered:
        for i in range(begin, begin + size):
            end = t_max[wp.min(i, t_max.shape[0] - 1)]
            hit = closest_hit(accels[0], origins[i], directions[i], end, span.group.single_stack)
            t_out[i] = hit.t if hit.instance >= 0 else wp.inf
            u_out[i] = hit.u
            v_out[i] = hit.v
            triangle_out[i] = hit.triangle
            instance_out[i] = hit.instance
    else:
        sort_by_octant(origins, directions, begin, size, span.order, span.sizes)
        for octant in range(9):
            start = octant * GROUP_SPAN
            end_of_list = start + span.sizes[octant]
            while start < end_of_list:
                together = wp.min(GROUP, end_of_list - start)
                if octant < 8:
                    load_group(
                        origins, directions, t_max, span.order, start, together, span.group.rays, 0, span.group.ends
                    )
                    trace_group(accels[0], span.group, together, False)
                write_hits(
                    accels[0].leaves,
                    accels[0].instances,
                    span.order,
                    start,
                    together,
                    octant < 8,
                    span.group.words,
                    span.group.records,
                    span.group.ends,
                    span.group.u,
                    span.group.v,
                    t_out,
                    u_out,
                    v_out,
                    triangle_out,
                    instance_out,
                )
                start += together


@wp.kernel
def query_any_hit_group(
    accels: wp.array[AccelData],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    span: RaySpan,
    first: int,
    count: int,
    blocked_out: wp.array[wp.bool],
):
    """Write whether the rays of the thread's span hit anything."""
    begin = first + wp.tid() * GROUP_SPAN
    size = wp.min(GROUP_SPAN, first + count - begin)
    is_scattered = are_scattered(origins, begin, size)
    if is_scattered and is_for_flights(accels[0]):
        trace_flights(accels[0], span.flights, origins, directions, t_max, begin, size, True)
        for row in range(size):
            blocked_out[begin + row] = span.flights.words[row] >= 0
    elif is_scattered:
        for i in range(begin, begin + size):
            end = t_max[wp.min(i, t_max.shape[0] - 1)]
            blocked_out[i] = any_hit(accels[0], origins[i], directions[i], end, span.group.single_stack)
    else:
        sort_by_octant(origins, directions, begin, size, span.order, span.sizes)
        for octant in range(9):
            start = octant * GROUP_SPAN
            end_of_list = start + span.sizes[octant]
            while start < end_of_list:
                together = wp.min(GROUP, end_of_list - start)
                if octant < 8:
                    load_group(
                        origins, directions, t_max, span.order, start, together, span.group.rays, 0, span.group.ends
                    )
                    trace_group(accels[0], span.group, together, True)
                for index in range(together):
                    blocked_out[span.order[start + index]] = octant < 8 and span.group.words[index] >= 0
                start += together
