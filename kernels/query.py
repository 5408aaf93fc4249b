# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Entry kernels of ray queries on arrays: one thread a ray.

The hierarchy comes as an array of one: a struct argument would be copied for each ray.
"""

import warp as wp

from .bvh_count import count_hits
from .bvh_structs import AccelData, Stacks, stack_of_thread
from .bvh_traverse import any_hit, closest_hit

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def query_closest_hit(
    accels: wp.array[AccelData],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    stacks: Stacks,
    first: int,
    t_out: wp.array[float],
    u_out: wp.array[float],
    v_out: wp.array[float],
    triangle_out: wp.array[int],
    instance_out: wp.array[int],
):
    """Write the closest hit of ray ``first`` + thread; ``t_max`` holds one value for all rays, or one a ray."""
    thread = wp.tid()
    i = first + thread
    end = t_max[wp.min(i, t_max.shape[0] - 1)]
    hit = closest_hit(accels[0], origins[i], directions[i], end, stack_of_thread(stacks, thread))
    t_out[i] = hit.t if hit.instance >= 0 else wp.inf
    u_out[i] = hit.u
    v_out[i] = hit.v
    triangle_out[i] = hit.triangle
    instance_out[i] = hit.instance


@wp.kernel
def query_any_hit(
    accels: wp.array[AccelData],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    stacks: Stacks,
    first: int,
    blocked_out: wp.array[wp.bool],
):
    """Write whether ray ``first`` + thread hits anything; ``t_max`` as for ``query_closest_hit``."""
    thread = wp.tid()
    i = first + thread
    end = t_max[wp.min(i, t_max.shape[0] - 1)]
    blocked_out[i] = any_hit(accels[0], origins[i], directions[i], end, stack_of_thread(stacks, thread))


@wp.kernel
def query_count_hits(
    accels: wp.array[AccelData],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    stacks: Stacks,
    first: int,
    count_out: wp.array[int],
):
    """Write how many triangles ray ``first`` + thread meets; ``t_max`` as for ``query_closest_hit``."""
    thread = wp.tid()
    i = first + thread
    end = t_max[wp.min(i, t_max.shape[0] - 1)]
    count_out[i] = count_hits(accels[0], origins[i], directions[i], end, stack_of_thread(stacks, thread))
