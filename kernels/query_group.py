# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Entry kernels of ray queries on a CPU: one thread a span of successive rays."""

import warp as wp

from .bvh_structs import AccelData
from .constants import GROUP_SPAN
from .ray_results import AnyHits, ClosestHits
from .trace_span import RaySpan, trace_span

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


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
    results = ClosestHits()
    results.t = t_out
    results.u = u_out
    results.v = v_out
    results.triangle = triangle_out
    results.instance = instance_out
    trace_span(accels[0], span, origins, directions, t_max, begin, size, results)


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
    results = AnyHits()
    results.is_blocked = blocked_out
    trace_span(accels[0], span, origins, directions, t_max, begin, size, results)
