# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How many surfaces a ray crosses: a traversal of both levels that leaves nothing out and needs no order."""

import warp as wp

from .bvh_structs import AccelData, Stack
from .bvh_traverse import is_ray_finite, push, set_ray, transform_ray
from .constants import NODE_CHILDREN, NODE_FLOATS, WATERTIGHT
from .intersect_packet import (
    PacketRay,
    count_triangles,
    count_triangles_plain,
    intersect_boxes,
    lowest_bit,
    make_packet_ray,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.func
def count_hits(accel: wp.ref[AccelData], origin: wp.vec3, direction: wp.vec3, t_max: float, stack: Stack) -> int:
    """Return the number of triangles that a ray meets in [0, t_max); arguments as for ``closest_hit``.

    A ray through an edge or a vertex meets all triangles that share it: the test is watertight, not exclusive.
    """
    count = int(0)
    if not is_ray_finite(origin, direction):
        return count
    world_ray = make_packet_ray(origin, direction)
    ray = PacketRay()
    set_ray(ray, world_ray)
    distances = wp.zeros(shape=(8,), dtype=float)
    instance = int(accel.only_instance)
    base = int(-1)
    push(stack, 0, accel.root, 0.0)
    top = int(1)
    while top > 0:
        if top == base:
            set_ray(ray, world_ray)
            instance = -1
            base = -1
        top -= 1
        node = stack.entries[top].code
        if node >= 0:
            mask = intersect_boxes(accel.nodes, node, ray, t_max, distances)
            while mask != 0:
                lane = lowest_bit(mask)
                mask = mask & (mask - 1)
                push(stack, top, wp.cast(accel.nodes[node * NODE_FLOATS + NODE_CHILDREN + lane], wp.int32), 0.0)
                top += 1
        elif instance < 0:
            local_ray = transform_ray(accel.instances[-1 - node], world_ray)
            if is_ray_finite(local_ray.origin, local_ray.direction):
                instance = -1 - node
                base = top
                set_ray(ray, local_ray)
                push(stack, top, accel.instances[instance].root, 0.0)
                top += 1
        elif accel.intersector == WATERTIGHT:
            count += count_triangles(accel.leaves, -1 - node, ray, t_max)
        else:
            count += count_triangles_plain(accel.leaves, -1 - node, accel.intersector, ray, t_max)
    return count
