# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Closest hit and any hit of a group of rays, which go through both levels of the hierarchy together.

The group visits a node once for all rays that meet its box, and takes the children in one order. What is left of it
where its rays part, at most GROUP_MIN of them, goes on ray by ray. A ray is tested against the leaves whose boxes it
meets, and by the same test, as when it is traced alone.

Reference: Wald et al. (2001), Interactive Rendering with Coherent Ray Tracing, Eurographics; Overbeck, Ramamoorthi and
Mark (2008), Large Ray Packets for Real-time Whitted Ray Tracing, for groups whose rays part.
"""

import warp as wp

from .bvh_stack import cull_stack, push, push_children, stack_code
from .bvh_structs import AccelData, Stack
from .bvh_traverse import is_ray_finite, transform_ray
from .constants import (
    ALL_RAYS,
    GROUP,
    GROUP_MIN,
    GROUP_RAY_FLOATS,
    LEAF_FLOATS,
    LEAF_IDS,
    NODE_CHILDREN,
    NODE_FLOATS,
)
from .intersect_group import bound_group, greatest_end, intersect_boxes_group
from .intersect_packet import PacketRay, intersect_triangles, lowest_bit

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class GroupEntry:
    """A child that a group has yet to visit."""

    code: int
    t: float
    """Before it no ray enters the child's box."""
    rays: wp.uint32
    """The rays that meet its box."""


@wp.struct
class RayGroup:
    """The rays that go together, and scratch memory for their way: one a worker."""

    words: wp.array[float]
    """Rays for the box test, shape [2 GROUP_RAY_FLOATS]: in world space, then in that of an instance."""
    rays: wp.array[PacketRay]
    """shape [2 GROUP], likewise."""
    ends: wp.array[float]
    """t_max, then t of the closest hit, shape [GROUP]; -1 for a ray that needs no more."""
    u: wp.array[float]
    v: wp.array[float]
    word: wp.array[int]
    """Word of the leaves at which the triangle's index is found, or -1."""
    record: wp.array[int]
    """Instance record of the hit."""
    distances: wp.array[float]
    """shape [WIDTH]"""
    masks: wp.array[wp.uint32]
    """shape [WIDTH]"""
    tuv: wp.array[float]
    entries: wp.array[GroupEntry]
    """The group's stack, shape [stack_size]."""
    stack: Stack
    """That of a single ray."""


@wp.func
def drop_lowest_bit(rays: wp.uint32) -> wp.uint32:
    """Return a set of rays without its first one."""
    return rays & (rays - wp.uint32(1))


_COUNT_BITS = r"""
#if defined(__CUDA_ARCH__)
    return __popc(rays);
#else
    return __builtin_popcount(rays);
#endif
"""


@wp.func_native(_COUNT_BITS)
def count_bits(rays: wp.uint32) -> int:
    """Return the size of a set of rays."""
    ...


@wp.func
def set_group_ray(group: wp.ref[RayGroup], space: int, index: int, ray: PacketRay):
    """Write a ray of a group, in world space (``space`` 0) or that of an instance (1)."""
    group.rays[space * GROUP + index] = ray
    word = space * GROUP_RAY_FLOATS + index
    for axis in range(3):
        group.words[word + axis * GROUP] = ray.origin[axis]
        group.words[word + (3 + axis) * GROUP] = ray.inverse[axis]


@wp.func
def push_group(group: wp.ref[RayGroup], top: int, code: int, t: float, rays: wp.uint32):
    """Write the entry above the topmost one; the caller counts."""
    group.entries[top].code = code
    group.entries[top].t = t
    group.entries[top].rays = rays


@wp.func
def meet_leaf(
    accel: wp.ref[AccelData], group: wp.ref[RayGroup], leaf: int, space: int, index: int, record: int, is_any: bool
) -> int:
    """Test a ray against a leaf packet, and return 1 if it hit something."""
    slot = space * GROUP + index
    lane = intersect_triangles(accel.leaves, leaf, group.rays[slot], group.ends[index], group.tuv)
    if lane < 0:
        return 0
    group.ends[index] = wp.where(is_any, -1.0, group.tuv[0])
    group.u[index] = group.tuv[1]
    group.v[index] = group.tuv[2]
    group.word[index] = leaf * LEAF_FLOATS + LEAF_IDS + lane
    group.record[index] = record
    return 1


@wp.func
def trace_alone(
    accel: wp.ref[AccelData],
    group: wp.ref[RayGroup],
    start: int,
    t_entry: float,
    space: int,
    index: int,
    record: int,
    is_any: bool,
) -> int:
    """Take one ray of a group through the tree below a child code, and return 1 if it hit something."""
    hit = int(0)
    slot = space * GROUP + index
    top = int(0)
    if t_entry <= group.ends[index]:
        push(group.stack, 0, start, t_entry)
        top += 1
    while top > 0:
        top -= 1
        code = stack_code(group.stack, top)
        if code >= 0:
            top = push_children(accel.nodes, code, group.rays[slot], group.ends[index], group.stack, top)
        elif meet_leaf(accel, group, -1 - code, space, index, record, is_any) == 1:
            hit = 1
            if is_any:
                top = 0
            else:
                top = cull_stack(group.stack, top, group.ends[index])
    return hit


@wp.func
def trace_each(
    accel: wp.ref[AccelData],
    group: wp.ref[RayGroup],
    start: int,
    t_entry: float,
    space: int,
    rays: wp.uint32,
    record: int,
    is_any: bool,
) -> int:
    """Take some rays of a group through the tree below a child code one by one; return how many hit something."""
    hits = int(0)
    rest = wp.uint32(rays)
    while rest != wp.uint32(0):
        hits += trace_alone(accel, group, start, t_entry, space, lowest_bit(int(rest)), record, is_any)
        rest = drop_lowest_bit(rest)
    return hits


@wp.func
def enter_instance(
    accel: wp.ref[AccelData], group: wp.ref[RayGroup], record: int, t_entry: float, rays: wp.uint32, is_any: bool
):
    """Return (the rays that go on as a group in an instance's space, how many others hit something there).

    The group keeps those whose octant is the first one's; the others are traced right here.
    """
    together = wp.uint32(0)
    common = int(-1)
    first = int(0)
    hits = int(0)
    rest = wp.uint32(rays)
    while rest != wp.uint32(0):
        index = lowest_bit(int(rest))
        ray = transform_ray(accel.instances[record], group.rays[index])
        if is_ray_finite(ray.origin, ray.direction):
            set_group_ray(group, 1, index, ray)
            if common < 0:
                common = ray.octant
                first = index
            if ray.octant == common:
                together = together | (wp.uint32(1) << wp.uint32(index))
            else:
                hits += trace_alone(accel, group, accel.instances[record].root, t_entry, 1, index, record, is_any)
        rest = drop_lowest_bit(rest)
    if together != wp.uint32(0):
        for index in range(wp.int32(GROUP)):
            if (together & (wp.uint32(1) << wp.uint32(index))) == wp.uint32(0):
                set_group_ray(group, 1, index, group.rays[GROUP + first])
        bound_group(group.words, GROUP_RAY_FLOATS)
    return together, hits


@wp.func
def trace_group(accel: wp.ref[AccelData], group: wp.ref[RayGroup], count: int, is_any: bool):
    """Find the closest hits of a group's first ``count`` rays, or any hits, and leave them in its arrays.

    All 32 rays must be set, finite, and of one octant; those from ``count`` on copies of another one.
    """
    active = ALL_RAYS >> wp.uint32(GROUP - count)
    bound_group(group.words, 0)
    t_end = greatest_end(group.ends)
    record = int(accel.only_instance)
    space = int(0)
    base = int(-1)
    push_group(group, 0, accel.root, 0.0, active)
    top = int(1)
    while top > 0:
        if top == base:
            record = -1
            space = 0
            base = -1
        top -= 1
        node = group.entries[top].code
        t_entry = group.entries[top].t
        rays = group.entries[top].rays
        if t_entry > t_end:
            rays = wp.uint32(0)
        while node >= 0 and rays != wp.uint32(0):
            if record >= 0 and count_bits(rays) <= GROUP_MIN:
                if trace_each(accel, group, node, t_entry, space, rays, record, is_any) > 0:
                    t_end = greatest_end(group.ends)
                rays = wp.uint32(0)
            else:
                mask = intersect_boxes_group(
                    accel.nodes,
                    node,
                    group.words,
                    space * GROUP_RAY_FLOATS,
                    rays,
                    group.ends,
                    t_end,
                    group.distances,
                    group.masks,
                )
                rays = wp.uint32(0)
                if mask != 0:
                    children = node * NODE_FLOATS + NODE_CHILDREN
                    lane = lowest_bit(mask)
                    mask = mask & (mask - 1)
                    node = wp.cast(accel.nodes[children + lane], wp.int32)
                    t_entry = group.distances[lane]
                    rays = group.masks[lane]
                    while mask != 0:
                        lane = lowest_bit(mask)
                        mask = mask & (mask - 1)
                        child = wp.cast(accel.nodes[children + lane], wp.int32)
                        t = group.distances[lane]
                        if t < t_entry:
                            push_group(group, top, node, t_entry, rays)
                            node = child
                            t_entry = t
                            rays = group.masks[lane]
                        else:
                            push_group(group, top, child, t, group.masks[lane])
                        top += 1
        if rays != wp.uint32(0):
            if record < 0:
                root = accel.instances[-1 - node].root
                if accel.instances[-1 - node].is_identity == 1:
                    record = -1 - node
                    base = top
                    push_group(group, top, root, t_entry, rays)
                    top += 1
                else:
                    together, hits = enter_instance(accel, group, -1 - node, t_entry, rays, is_any)
                    if hits > 0:
                        t_end = greatest_end(group.ends)
                    if together != wp.uint32(0):
                        record = -1 - node
                        space = 1
                        base = top
                        push_group(group, top, root, t_entry, together)
                        top += 1
            else:
                hits = int(0)
                while rays != wp.uint32(0):
                    hits += meet_leaf(accel, group, -1 - node, space, lowest_bit(int(rays)), record, is_any)
                    rays = drop_lowest_bit(rays)
                if hits > 0:
                    t_end = greatest_end(group.ends)
