# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Entry kernels of ray queries on a CPU: workers launch them with one thread, which takes span after span of the rays.

So the workers end within a span of each other, and a launch costs nothing that shows.
"""

import warp as wp

from .bvh_structs import AccelData
from .ray_results import AnyHits, ClosestHits
from .trace_span import RaySpan, trace_spans

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def query_closest_hit_group(
    accels: wp.array[AccelData],
    span: RaySpan,
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    base: wp.array[wp.vec3d],
    sorted: wp.array[int],
    words: wp.array[int],
    t_out: wp.array[float],
    u_out: wp.array[float],
    v_out: wp.array[float],
    triangle_out: wp.array[int],
    instance_out: wp.array[int],
):
    """Write the closest hits of up to LAUNCH_SPANS spans of rays."""
    results = ClosestHits()
    results.t = t_out
    results.u = u_out
    results.v = v_out
    results.triangle = triangle_out
    results.instance = instance_out
    trace_spans(accels[0], span, origins, directions, t_max, base, sorted, words, results)


@wp.kernel
def query_any_hit_group(
    accels: wp.array[AccelData],
    span: RaySpan,
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    base: wp.array[wp.vec3d],
    sorted: wp.array[int],
    words: wp.array[int],
    blocked_out: wp.array[wp.bool],
):
    """Write whether the rays of up to LAUNCH_SPANS spans hit anything, as ``query_closest_hit_group`` does."""
    results = AnyHits()
    results.is_blocked = blocked_out
    trace_spans(accels[0], span, origins, directions, t_max, base, sorted, words, results)
