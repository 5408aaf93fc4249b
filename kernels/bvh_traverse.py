# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Closest hit and any hit through both levels of the hierarchy, with an explicit stack."""

import warp as wp

from .bvh_stack import cull_stack, push, push_children, stack_code
from .bvh_structs import AccelData, Hit, InstanceRecord, Stack
from .constants import LEAF_FLOATS, LEAF_IDS, LEAVE_INSTANCE, NO_TRIANGLE, SHAPE_TEST, TRIANGLES, WATERTIGHT
from .intersect_packet import PacketRay, intersect_triangles, intersect_triangles_plain, make_packet_ray
from .intersect_shape import intersect_shapes, packet_shape
from .observer import Observer, Unobserved, observed
from .per_type import per_type
from .ray_goal import AnyHit, ClosestHit, Goal
from .traverse_hooks import ends_at_hit, tell_node, tell_packet, tell_shapes


@wp.func
def transform_ray(instance: InstanceRecord, ray: PacketRay) -> PacketRay:
    """Return a ray in the space of an instance's mesh.

    The direction is transformed but not normalised again, so that t means the same in both spaces.
    """
    if int(instance.is_identity) == 1:
        return ray
    o = wp.vec4(ray.origin[0], ray.origin[1], ray.origin[2], 1.0)
    d = wp.vec4(ray.direction[0], ray.direction[1], ray.direction[2], 0.0)
    return make_packet_ray(
        wp.vec3(wp.dot(instance.row_x, o), wp.dot(instance.row_y, o), wp.dot(instance.row_z, o)),
        wp.vec3(wp.dot(instance.row_x, d), wp.dot(instance.row_y, d), wp.dot(instance.row_z, d)),
    )


@wp.func
def is_ray_finite(origin: wp.vec3, direction: wp.vec3) -> bool:
    """Return whether no component is inf or NaN, nor so big that their sum is.

    Nothing else may be traversed: NaN makes the boxes of empty lanes pass, whose children do not exist.
    """
    total = origin[0] + origin[1] + origin[2] + direction[0] + direction[1] + direction[2]
    return total - total == 0.0


@wp.func
def set_ray(target: wp.ref[PacketRay], source: PacketRay):
    """Change a ray in place. Assigning a struct in a branch would copy it in every turn of the loop around it."""
    target.origin = source.origin
    target.direction = source.direction
    target.inverse = source.inverse
    target.far_inverse = source.far_inverse
    target.octant = source.octant
    target.shear = source.shear
    target.axes = source.axes
    target.skip = source.skip


@wp.func
def triangle_to_skip(accel: wp.ref[AccelData], record: int, instance: int, triangle: int) -> int:
    """Return the triangle to skip below an instance record, for a ray that starts on an instance's triangle."""
    if accel.instances[record].instance == instance:
        return triangle
    return NO_TRIANGLE


@wp.func
def leaf_test(accel: wp.ref[AccelData], record: int) -> int:
    """Return how a ray is tested against the leaves below an instance record: ``intersector``, or a shape's test."""
    kind = int(accel.instances[record].kind)
    if kind == TRIANGLES:
        return accel.intersector
    return SHAPE_TEST + kind


@per_type
def traverse(
    accel: wp.ref[AccelData],
    origin: wp.vec3,
    direction: wp.vec3,
    t_max: float,
    goal: Goal,
    from_instance: int,
    from_triangle: int,
    stack: Stack,
    observer: Observer,
) -> Hit:
    """Return the closest hit in [0, t_max), or, for ``AnyHit``, the first one found; tell the observer of it all.

    One loop serves both levels: below an instance, the ray is the mesh's, until LEAVE_INSTANCE is popped. The goal is a
    type: left to a flag, the compiler's choice of what to make two functions of, or put in line, cost a render 5 %.
    """
    hit = Hit()
    hit.t = t_max
    hit.triangle = -1
    hit.instance = -1
    if not is_ray_finite(origin, direction):
        return hit
    world_ray = make_packet_ray(origin, direction)
    ray = PacketRay()
    set_ray(ray, world_ray)
    tuv = wp.zeros(shape=(4,), dtype=float)
    word = int(-1)
    found = int(-1)
    instance = int(accel.only_instance)
    test = int(WATERTIGHT)
    if instance >= 0:
        test = leaf_test(accel, instance)
        ray.skip = triangle_to_skip(accel, instance, from_instance, from_triangle)
    push(stack, 0, accel.root, 0.0)
    top = int(1)
    while top > 0:
        top -= 1
        code = stack_code(stack, top)
        if code >= 0:
            tell_node(observer)
            top = push_children(accel.nodes, code, ray, hit.t, stack, top)
        elif instance < 0:
            local_ray = transform_ray(accel.instances[-1 - code], world_ray)
            if is_ray_finite(local_ray.origin, local_ray.direction):
                instance = -1 - code
                set_ray(ray, local_ray)
                test = leaf_test(accel, instance)
                ray.skip = triangle_to_skip(accel, instance, from_instance, from_triangle)
                push(stack, top + 1, accel.instances[instance].root, stack.distances[top])
                push(stack, top, LEAVE_INSTANCE, 0.0)
                top += 2
        elif code == LEAVE_INSTANCE:
            set_ray(ray, world_ray)
            instance = -1
        else:
            lane = int(-1)
            if test == WATERTIGHT:
                tell_packet(observer, accel.leaves, -1 - code)
                lane = intersect_triangles(accel.leaves, -1 - code, ray, hit.t, tuv)
            elif test < SHAPE_TEST:
                tell_packet(observer, accel.leaves, -1 - code)
                lane = intersect_triangles_plain(accel.leaves, -1 - code, test, ray, hit.t, tuv)
            else:
                tell_shapes(observer, accel.shapes, -1 - code)
                lane = intersect_shapes(
                    accel.shapes, -1 - code, test - SHAPE_TEST, ray.origin, ray.direction, ray.skip, hit.t, tuv
                )
            if lane >= 0:
                hit.t = tuv[0]
                word = (-1 - code) * LEAF_FLOATS + LEAF_IDS + lane
                found = instance
                if ends_at_hit(goal):
                    top = 0
                else:
                    top = cull_stack(stack, top, hit.t)
    if found >= 0:
        hit.u = tuv[1]
        hit.v = tuv[2]
        hit.instance = accel.instances[found].instance
        if int(accel.instances[found].kind) == TRIANGLES:
            hit.triangle = wp.cast(accel.leaves[word], wp.int32)
        else:
            leaf = word // LEAF_FLOATS
            hit.triangle = packet_shape(accel.shapes, leaf, word - leaf * LEAF_FLOATS - LEAF_IDS)
    return hit


@wp.func
def closest_hit(accel: wp.ref[AccelData], origin: wp.vec3, direction: wp.vec3, t_max: float, stack: Stack) -> Hit:
    """Return the hit of smallest t in [0, t_max), or a miss: ``instance`` -1 and t = t_max.

    Args:
        accel: The hierarchy.
        origin: Of the ray, relative to the accel's origin.
        direction: Of any length but zero; it is the unit of t.
        t_max: End of the ray; may be inf.
        stack: Scratch memory, from ``stack_of_thread``.
    """
    nobody = Unobserved()
    goal = ClosestHit()
    return traverse(accel, origin, direction, t_max, goal, -1, NO_TRIANGLE, stack, nobody)


@wp.func
def any_hit(accel: wp.ref[AccelData], origin: wp.vec3, direction: wp.vec3, t_max: float, stack: Stack) -> bool:
    """Return whether anything is hit in [0, t_max); arguments as for ``closest_hit``."""
    nobody = Unobserved()
    goal = AnyHit()
    return traverse(accel, origin, direction, t_max, goal, -1, NO_TRIANGLE, stack, nobody).instance >= 0


@observed
def closest_hit_from(
    accel: wp.ref[AccelData],
    origin: wp.vec3,
    direction: wp.vec3,
    t_max: float,
    instance: int,
    triangle: int,
    stack: Stack,
    observer: Observer,
) -> Hit:
    """Return what ``closest_hit`` returns for a ray that starts on a triangle of an instance.

    It cannot meet that triangle again: however near to its plane the ray runs, rounding makes no hit of it.
    ``instance`` -1: the ray starts anywhere.
    """
    goal = ClosestHit()
    return traverse(accel, origin, direction, t_max, goal, instance, triangle, stack, observer)


@observed
def any_hit_from(
    accel: wp.ref[AccelData],
    origin: wp.vec3,
    direction: wp.vec3,
    t_max: float,
    instance: int,
    triangle: int,
    stack: Stack,
    observer: Observer,
) -> bool:
    """Return whether anything but the triangle that the ray starts on is hit in [0, t_max)."""
    goal = AnyHit()
    return traverse(accel, origin, direction, t_max, goal, instance, triangle, stack, observer).instance >= 0
