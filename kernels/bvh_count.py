# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How many surfaces a ray crosses: a traversal of both levels that leaves nothing out and needs no order."""

import warp as wp

from .bvh_stack import push, push_children, stack_code
from .bvh_structs import AccelData, Stack
from .bvh_traverse import is_ray_finite, leaf_test, set_ray, transform_ray
from .constants import LEAVE_INSTANCE, SHAPE_TEST, WATERTIGHT
from .intersect_packet import PacketRay, count_triangles, count_triangles_plain, make_packet_ray
from .intersect_shape import count_shapes


@wp.func
def count_hits(accel: wp.ref[AccelData], origin: wp.vec3, direction: wp.vec3, t_max: float, stack: Stack) -> int:
    """Return the number of surfaces that a ray meets in [0, t_max); arguments as for ``closest_hit``.

    A ray through an edge or a vertex meets all triangles that share it: the test is watertight, not exclusive.
    """
    count = int(0)
    if not is_ray_finite(origin, direction):
        return count
    world_ray = make_packet_ray(origin, direction)
    ray = PacketRay()
    set_ray(ray, world_ray)
    instance = int(accel.only_instance)
    test = int(WATERTIGHT)
    if instance >= 0:
        test = leaf_test(accel, instance)
    push(stack, 0, accel.root, 0.0)
    top = int(1)
    while top > 0:
        top -= 1
        code = stack_code(stack, top)
        if code >= 0:
            top = push_children(accel.nodes, code, ray, t_max, stack, top)
        elif instance < 0:
            local_ray = transform_ray(accel.instances[-1 - code], world_ray)
            if is_ray_finite(local_ray.origin, local_ray.direction):
                instance = -1 - code
                set_ray(ray, local_ray)
                test = leaf_test(accel, instance)
                push(stack, top, LEAVE_INSTANCE, 0.0)
                push(stack, top + 1, accel.instances[instance].root, 0.0)
                top += 2
        elif code == LEAVE_INSTANCE:
            set_ray(ray, world_ray)
            instance = -1
        elif test == WATERTIGHT:
            count += count_triangles(accel.leaves, -1 - code, ray, t_max)
        elif test < SHAPE_TEST:
            count += count_triangles_plain(accel.leaves, -1 - code, test, ray, t_max)
        else:
            count += count_shapes(accel.shapes, -1 - code, test - SHAPE_TEST, ray.origin, ray.direction, t_max)
    return count
