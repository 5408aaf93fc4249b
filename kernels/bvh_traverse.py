# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Closest hit and any hit through both levels of the hierarchy, with an explicit stack."""

import warp as wp

from .bvh_structs import AccelData, Hit, InstanceRecord, Stack
from .constants import LEAF_FLOATS, LEAF_IDS, MOLLER_TRUMBORE, NODE_CHILDREN, NODE_FLOATS, WATERTIGHT, WIDTH
from .intersect_packet import (
    PacketRay,
    intersect_boxes,
    intersect_triangles,
    lowest_bit,
    make_packet_ray,
    packet_vertex,
)
from .intersect_triangle import intersect_moller_trumbore, intersect_plane_projection

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
def descend(
    nodes: wp.array[float], start: int, ray: PacketRay, t_max: float, stack: Stack, top: int, distances: wp.array[float]
):
    """Return (the nearest leaf below a node, the new top of the stack); a code >= 0 stands for no leaf.

    Follows the nearest child at each level and pushes the others in no order. Sorting them costs more mispredicted
    branches than it saves node visits.
    """
    node = int(start)
    while node >= 0:
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
                stack.nodes[top] = nearest
                stack.distances[top] = t_nearest
                nearest = child
                t_nearest = t
            else:
                stack.nodes[top] = child
                stack.distances[top] = t
            top += 1
        node = nearest
    return node, top


@wp.func
def intersect_triangles_one_by_one(
    accel: AccelData, leaf: int, ray: PacketRay, t_max: float, tuv: wp.array[float]
) -> int:
    """Return what ``intersect_triangles`` returns, by the scalar test that ``accel.intersector`` names."""
    nearest = int(-1)
    t_nearest = float(t_max)
    for lane in range(WIDTH):
        p0 = packet_vertex(accel.leaves, leaf, lane, 0)
        p1 = packet_vertex(accel.leaves, leaf, lane, 1)
        p2 = packet_vertex(accel.leaves, leaf, lane, 2)
        if accel.intersector == MOLLER_TRUMBORE:
            hit = intersect_moller_trumbore(ray.origin, ray.direction, p0, p1, p2)
        else:
            hit = intersect_plane_projection(ray.origin, ray.direction, p0, p1, p2)
        if hit.t < t_nearest:
            t_nearest = hit.t
            nearest = lane
            tuv[0] = hit.t
            tuv[1] = hit.u
            tuv[2] = hit.v
    return nearest


@wp.func
def traverse_mesh(
    accel: AccelData,
    root: int,
    ray: PacketRay,
    t_start: float,
    is_any: bool,
    stack: Stack,
    base: int,
    distances: wp.array[float],
    tuv: wp.array[float],
) -> int:
    """Return the word of ``accel.leaves`` that holds the hit triangle's index, or -1; ``tuv`` then holds (t, u, v).

    Uses the stack from entry ``base`` upwards.
    """
    hit = int(-1)
    t_max = float(t_start)
    stack.nodes[base] = root
    stack.distances[base] = 0.0
    top = int(base + 1)
    while top > base:
        top -= 1
        node = stack.nodes[top]
        if stack.distances[top] <= t_max:
            node, top = descend(accel.nodes, node, ray, t_max, stack, top, distances)
            if node < 0:
                lane = int(-1)
                if accel.intersector == WATERTIGHT:
                    lane = intersect_triangles(accel.leaves, -1 - node, ray, t_max, tuv)
                else:
                    lane = intersect_triangles_one_by_one(accel, -1 - node, ray, t_max, tuv)
                if lane >= 0:
                    t_max = tuv[0]
                    hit = (-1 - node) * LEAF_FLOATS + LEAF_IDS + lane
                    if is_any:
                        top = int(base)
    return hit


@wp.func
def traverse(accel: AccelData, origin: wp.vec3, direction: wp.vec3, t_max: float, is_any: bool, stack: Stack) -> Hit:
    """Return the closest hit in [0, t_max), or the first one found if ``is_any``."""
    hit = Hit()
    hit.t = t_max
    hit.triangle = -1
    hit.instance = -1
    # One inf or NaN would make every box pass; no triangle can be hit along no direction.
    if not (wp.isfinite(origin) and wp.isfinite(direction)) or wp.max(wp.abs(direction)) == 0.0:
        return hit
    ray = make_packet_ray(origin, direction)
    distances = wp.zeros(shape=(8,), dtype=float)
    tuv = wp.zeros(shape=(4,), dtype=float)
    found = int(-1)
    stack.nodes[0] = accel.root
    stack.distances[0] = 0.0
    top = int(1)
    while top > 0:
        top -= 1
        node = stack.nodes[top]
        if stack.distances[top] <= hit.t:
            node, top = descend(accel.nodes, node, ray, hit.t, stack, top, distances)
            if node < 0:
                record = accel.instances[-1 - node]
                local_ray = transform_ray(record, ray)
                word = traverse_mesh(accel, record.root, local_ray, hit.t, is_any, stack, top, distances, tuv)
                if word >= 0:
                    hit.t = tuv[0]
                    hit.u = tuv[1]
                    hit.v = tuv[2]
                    hit.instance = record.instance
                    found = word
                    if is_any:
                        top = int(0)
    if found >= 0:
        hit.triangle = wp.cast(accel.leaves[found], wp.int32)
    return hit


@wp.func
def closest_hit(accel: AccelData, origin: wp.vec3, direction: wp.vec3, t_max: float, stack: Stack) -> Hit:
    """Return the hit of smallest t in [0, t_max), or a miss: ``instance`` -1 and t = t_max.

    Args:
        accel: The hierarchy.
        origin: Of the ray, relative to the accel's origin.
        direction: Of any length but zero; it is the unit of t.
        t_max: End of the ray; may be inf.
        stack: Scratch memory, from ``stack_of_thread``.
    """
    return traverse(accel, origin, direction, t_max, False, stack)


@wp.func
def any_hit(accel: AccelData, origin: wp.vec3, direction: wp.vec3, t_max: float, stack: Stack) -> bool:
    """Return whether anything is hit in [0, t_max); arguments as for ``closest_hit``."""
    return traverse(accel, origin, direction, t_max, True, stack).instance >= 0
