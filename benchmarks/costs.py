# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What rays cost in nodes and triangles, counted by the traversal itself as it takes them one by one."""

from __future__ import annotations

import warp as wp

import warp_rt
from warp_rt.bvh.stacks import make_stacks
from warp_rt.kernels.bvh_structs import AccelData, Stacks, stack_of_thread
from warp_rt.kernels.bvh_traverse import any_hit_from, closest_hit_from
from warp_rt.kernels.constants import NO_TRIANGLE
from warp_rt.kernels.observer import CostCounter

from .ray_sets import Rays

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def count_costs(
    accels: wp.array[AccelData],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    is_any: bool,
    stacks: Stacks,
    nodes_out: wp.array[int],
    triangles_out: wp.array[int],
):
    """Write how many nodes each ray visits and how many triangles it is tested against."""
    i = wp.tid()
    cost = CostCounter()
    stack = stack_of_thread(stacks, i)
    if is_any:
        any_hit_from(accels[0], origins[i], directions[i], wp.inf, -1, NO_TRIANGLE, stack, cost)
    else:
        closest_hit_from(accels[0], origins[i], directions[i], wp.inf, -1, NO_TRIANGLE, stack, cost)
    nodes_out[i] = cost.nodes
    triangles_out[i] = cost.triangles


def mean_costs(accel: warp_rt.Accel, rays: Rays, query: str) -> dict[str, float]:
    """Return the mean numbers of nodes and triangles a ray, for ``closest`` or ``any`` hits."""
    vectors: list[wp.array] = [
        wp.array(v, dtype=wp.vec3, device="cpu", copy=False) for v in (rays.origins, rays.directions)
    ]
    outputs = [wp.empty(len(rays), dtype=int, device="cpu") for _ in range(2)]
    inputs = [accel.table, *vectors, query == "any", make_stacks(accel)]
    wp.launch(count_costs, len(rays), inputs=inputs, outputs=outputs, device="cpu")
    nodes, triangles = (round(float(array.numpy().mean()), 3) for array in outputs)
    return {"nodes": nodes, "triangles_tested": triangles}
