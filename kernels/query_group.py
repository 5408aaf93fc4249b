# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Entry kernels of ray queries on a CPU: one thread a span of successive rays, which it groups by octant."""

import warp as wp

from .bvh_group import RayGroup, set_group_ray, trace_group
from .bvh_structs import AccelData
from .bvh_traverse import is_ray_finite
from .constants import GROUP, GROUP_SPAN
from .intersect_packet import make_packet_ray, octant_of

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class RaySpan:
    """Scratch memory of a span of rays."""

    keys: wp.array[int]
    """Octant of each ray, shape [GROUP_SPAN]; 8: no ray at all."""
    order: wp.array[int]
    """The rays, octant by octant, shape [GROUP_SPAN]."""
    ends: wp.array[int]
    """Where each octant's rays end in ``order``, shape [9]."""
    group: RayGroup


@wp.func
def sort_by_octant(
    span: wp.ref[RaySpan], origins: wp.array[wp.vec3], directions: wp.array[wp.vec3], first: int, count: int
):
    """List rays octant by octant, in their order within each; the last list is of those that are not finite."""
    for key in range(9):
        span.ends[key] = 0
    for i in range(count):
        key = int(8)
        if is_ray_finite(origins[first + i], directions[first + i]):
            key = octant_of(directions[first + i])
        span.keys[i] = key
        span.ends[key] = span.ends[key] + 1
    total = int(0)
    for key in range(9):
        size = span.ends[key]
        span.ends[key] = total
        total += size
    for i in range(count):
        key = span.keys[i]
        span.order[span.ends[key]] = first + i
        span.ends[key] = span.ends[key] + 1


@wp.func
def gather_group(
    span: wp.ref[RaySpan],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    start: int,
    count: int,
):
    """Make a group of rays ``start`` to ``start + count`` of a span's order."""
    for index in range(wp.int32(GROUP)):
        if index < count:
            i = span.order[start + index]
            set_group_ray(span.group, 0, index, make_packet_ray(origins[i], directions[i]))
            end = t_max[wp.min(i, t_max.shape[0] - 1)]
            span.group.ends[index] = wp.where(end >= 0.0, end, -1.0)  # NaN too: comparing it would stop the others
        else:
            set_group_ray(span.group, 0, index, span.group.rays[0])
            span.group.ends[index] = -1.0
        span.group.word[index] = -1


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
    sort_by_octant(span, origins, directions, begin, size)
    start = int(0)
    for key in range(9):
        while start < span.ends[key]:
            together = wp.min(GROUP, span.ends[key] - start)
            if key < 8:
                gather_group(span, origins, directions, t_max, start, together)
                trace_group(accels[0], span.group, together, False)
            for index in range(together):
                i = span.order[start + index]
                word = int(-1)
                if key < 8:
                    word = span.group.word[index]
                if word >= 0:
                    t_out[i] = span.group.ends[index]
                    u_out[i] = span.group.u[index]
                    v_out[i] = span.group.v[index]
                    triangle_out[i] = wp.cast(accels[0].leaves[word], wp.int32)
                    instance_out[i] = accels[0].instances[span.group.record[index]].instance
                else:
                    t_out[i] = wp.inf
                    u_out[i] = 0.0
                    v_out[i] = 0.0
                    triangle_out[i] = -1
                    instance_out[i] = -1
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
    sort_by_octant(span, origins, directions, begin, size)
    start = int(0)
    for key in range(9):
        while start < span.ends[key]:
            together = wp.min(GROUP, span.ends[key] - start)
            if key < 8:
                gather_group(span, origins, directions, t_max, start, together)
                trace_group(accels[0], span.group, together, True)
            for index in range(together):
                blocked_out[span.order[start + index]] = key < 8 and span.group.word[index] >= 0
            start += together
