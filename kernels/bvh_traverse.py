# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Closest hit and any hit through both levels of the hierarchy, with an explicit stack."""

import warp as wp

from .bvh_structs import AccelData, Hit, InstanceRecord, Stack
from .constants import (
    LEAF_FLOATS,
    LEAF_IDS,
    NO_TRIANGLE,
    NODE_CHILDREN,
    NODE_FLOATS,
    WATERTIGHT,
)
from .intersect_packet import (
    PacketRay,
    intersect_boxes,
    intersect_triangles,
    intersect_triangles_plain,
    lowest_bit,
    make_packet_ray,
)
from .observer import Observer, Unobserved, observed
from .traverse_hooks import tell_node, tell_packet

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.func
def transform_ray(instance: InstanceRecord, ray: PacketRay) -> PacketRay:
    """Return a ray in the space of an instance's mesh.

    The direction is transformed but not normalised again, so that t means the same in both spaces.
    """
    if instance.is_identity == 1:
        return ray
    o = wp.vec4(ray.origin[0], ray.origin[1], ray.origin[2], 1.0)
    d = wp.vec4(ray.direction[0], ray.direction[1], ray.direction[2], 0.0)
    return make_packet_ray(
        wp.vec3(wp.dot(instance.row_x, o), wp.dot(instance.row_y, o), wp.dot(instance.row_z, o)),
        wp.vec3(wp.dot(instance.row_x, d), wp.dot(instance.row_y, d), wp.dot(instance.row_z, d)),
    )


@wp.func
def push(stack: Stack, top: int, code: int, t: float):
    """Write the entry above the topmost one; the caller counts."""
    stack.entries[top].code = code
    stack.entries[top].t = t


@observed
def descend(
    nodes: wp.array[float],
    start: int,
    ray: PacketRay,
    t_max: float,
    stack: Stack,
    top: int,
    distances: wp.array[float],
    observer: Observer,
):
    """Return (the nearest leaf below a node, the new top of the stack); a code >= 0 stands for no leaf.

    Follows the nearest child at each level and pushes the others in no order. Sorting them costs more mispredicted
    branches than it saves node visits.
    """
    node = int(start)
    while node >= 0:
        tell_node(observer)
        mask = intersect_boxes(nodes, node, ray, t_max, distances)
        if mask == 0:
            break
        children = node * NODE_FLOATS + NODE_CHILDREN
        lane = lowest_bit(mask)
        mask = mask & (mask - 1)
        nearest = wp.cast(nodes[children + lane], wp.int32)
        t_nearest = distances[lane]
        while mask != 0:
            lane = lowest_bit(mask)
            mask = mask & (mask - 1)
            child = wp.cast(nodes[children + lane], wp.int32)
            t = distances[lane]
            if t < t_nearest:
                push(stack, top, nearest, t_nearest)
                nearest = child
                t_nearest = t
            else:
                push(stack, top, child, t)
            top += 1
        node = nearest
    return node, top


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
    target.shear = source.shear
    target.axes = source.axes
    target.skip = source.skip


@wp.func
def triangle_to_skip(accel: wp.ref[AccelData], record: int, instance: int, triangle: int) -> int:
    """Return the triangle to skip below an instance record, for a ray that starts on an instance's triangle."""
    if accel.instances[record].instance == instance:
        return triangle
    return NO_TRIANGLE


@observed
def traverse(
    accel: wp.ref[AccelData],
    origin: wp.vec3,
    direction: wp.vec3,
    t_max: float,
    is_any: bool,
    from_instance: int,
    from_triangle: int,
    stack: Stack,
    observer: Observer,
) -> Hit:
    """Return the closest hit in [0, t_max), or the first one found if ``is_any``; tell the observer of each step.

    One loop serves both levels: below an instance, the ray is the mesh's, and the stack's entries from ``base`` on.
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
    distances = wp.zeros(shape=(8,), dtype=float)
    tuv = wp.zeros(shape=(4,), dtype=float)
    word = int(-1)
    found = int(-1)
    instance = int(accel.only_instance)
    base = int(-1)
    if instance >= 0:
        ray.skip = triangle_to_skip(accel, instance, from_instance, from_triangle)
    push(stack, 0, accel.root, 0.0)
    top = int(1)
    while top > 0:
        if top == base:
            set_ray(ray, world_ray)
            instance = -1
            base = -1
        top -= 1
        node = stack.entries[top].code
        t_entry = stack.entries[top].t
        if t_entry <= hit.t:
            node, top = descend(accel.nodes, node, ray, hit.t, stack, top, distances, observer)
            if node < 0:
                if instance < 0:
                    local_ray = transform_ray(accel.instances[-1 - node], world_ray)
                    if is_ray_finite(local_ray.origin, local_ray.direction):
                        instance = -1 - node
                        base = top
                        set_ray(ray, local_ray)
                        ray.skip = triangle_to_skip(accel, instance, from_instance, from_triangle)
                        push(stack, top, accel.instances[instance].root, t_entry)
                        top += 1
                else:
                    tell_packet(observer, accel.leaves, -1 - node)
                    lane = int(-1)
                    if accel.intersector == WATERTIGHT:
                        lane = intersect_triangles(accel.leaves, -1 - node, ray, hit.t, tuv)
                    else:
                        lane = intersect_triangles_plain(accel.leaves, -1 - node, accel.intersector, ray, hit.t, tuv)
                    if lane >= 0:
                        hit.t = tuv[0]
                        word = (-1 - node) * LEAF_FLOATS + LEAF_IDS + lane
                        found = instance
                        if is_any:
                            top = 0
    if found >= 0:
        hit.u = tuv[1]
        hit.v = tuv[2]
        hit.triangle = wp.cast(accel.leaves[word], wp.int32)
        hit.instance = accel.instances[found].instance
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
    return traverse(accel, origin, direction, t_max, False, -1, NO_TRIANGLE, stack, nobody)


@wp.func
def any_hit(accel: wp.ref[AccelData], origin: wp.vec3, direction: wp.vec3, t_max: float, stack: Stack) -> bool:
    """Return whether anything is hit in [0, t_max); arguments as for ``closest_hit``."""
    nobody = Unobserved()
    return traverse(accel, origin, direction, t_max, True, -1, NO_TRIANGLE, stack, nobody).instance >= 0


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
    return traverse(accel, origin, direction, t_max, False, instance, triangle, stack, observer)


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
    return traverse(accel, origin, direction, t_max, True, instance, triangle, stack, observer).instance >= 0
