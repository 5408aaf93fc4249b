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
from .bvh_traverse import is_ray_finite
from .constants import ALL_RAYS, GROUP, GROUP_FLOATS, GROUP_MIN, LEAVE_INSTANCE, TRIANGLES
from .group_stack import GroupStack, push_children_group, push_group
from .intersect_group import meet_shapes, meet_triangles
from .ray_group import bound_group, greatest_end, group_ray, rays_reaching
from .ray_set import count_rays, drop_first, first_ray
from .transform_group import transform_group

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class RayGroup:
    """The rays that go together, and scratch memory for their way: one a worker."""

    rays: wp.array[float]
    """Groups, shape [2 GROUP_FLOATS]: the rays in world space, then in that of an instance."""
    ends: wp.array[float]
    """t_max, then t of the closest hit, shape [GROUP]; -1 for a ray that needs no more."""
    u: wp.array[float]
    v: wp.array[float]
    words: wp.array[int]
    """Word of the leaves, or of the shapes, at which the triangle's or the shape's index is found; -1: no hit."""
    records: wp.array[int]
    """Instance record of the hit."""
    stack: GroupStack
    single_stack: Stack
    """That of a ray which goes on alone."""


@wp.func
def meet_leaf(
    accel: wp.ref[AccelData], group: wp.ref[RayGroup], leaf: int, first: int, rays: wp.uint32, record: int, is_any: bool
) -> int:
    """Test rays against a leaf packet, and return 1 if one of them hit something."""
    kind = int(accel.instances[record].kind)
    hits = wp.uint32(0)
    if kind == TRIANGLES:
        hits = meet_triangles(accel.leaves, leaf, group.rays, first, rays, group.ends, group.u, group.v, group.words)
    else:
        hits = meet_shapes(accel.shapes, leaf, kind, group.rays, first, rays, group.ends, group.u, group.v, group.words)
    if hits == wp.uint32(0):
        return 0
    while hits != wp.uint32(0):
        index = first_ray(hits)
        hits = drop_first(hits)
        group.records[index] = record
        if is_any:
            group.ends[index] = -1.0
    return 1


@wp.func
def trace_alone(
    accel: wp.ref[AccelData], group: wp.ref[RayGroup], start: int, first: int, index: int, record: int, is_any: bool
) -> int:
    """Take one ray of a group through the tree below a child code, and return 1 if it hit something."""
    is_hit = int(0)
    ray = group_ray(group.rays, first, index)
    push(group.single_stack, 0, start, 0.0)
    top = int(1)
    while top > 0:
        top -= 1
        code = stack_code(group.single_stack, top)
        if code >= 0:
            top = push_children(accel.nodes, code, ray, group.ends[index], group.single_stack, top)
        elif meet_leaf(accel, group, -1 - code, first, wp.uint32(1) << wp.uint32(index), record, is_any) == 1:
            is_hit = 1
            if is_any:
                top = 0
            else:
                top = cull_stack(group.single_stack, top, group.ends[index])
    return is_hit


@wp.func
def trace_each(
    accel: wp.ref[AccelData],
    group: wp.ref[RayGroup],
    start: int,
    first: int,
    rays: wp.uint32,
    record: int,
    is_any: bool,
) -> int:
    """Take some rays of a group through the tree below a child code one by one; return how many hit something."""
    hits = int(0)
    rest = wp.uint32(rays)
    while rest != wp.uint32(0):
        hits += trace_alone(accel, group, start, first, first_ray(rest), record, is_any)
        rest = drop_first(rest)
    return hits


@wp.func
def enter_instance(accel: wp.ref[AccelData], group: wp.ref[RayGroup], record: int, rays: wp.uint32, is_any: bool):
    """Return (the rays that go on as a group in an instance's space, how many others hit something there).

    The group keeps those whose octant is the first one's; the others are traced right here.
    """
    together = transform_group(accel.instances, record, group.rays, rays)
    rest = rays & ~together
    hits = int(0)
    while rest != wp.uint32(0):
        index = first_ray(rest)
        rest = drop_first(rest)
        ray = group_ray(group.rays, GROUP_FLOATS, index)
        if is_ray_finite(ray.origin, ray.direction):
            hits += trace_alone(accel, group, accel.instances[record].root, GROUP_FLOATS, index, record, is_any)
    if count_rays(together) > GROUP_MIN:  # of fewer, each goes on by itself
        bound_group(group.rays, GROUP_FLOATS, together)
    return together, hits


@wp.func
def trace_group(accel: wp.ref[AccelData], group: wp.ref[RayGroup], count: int, is_any: bool):
    """Find the closest hits of a group's first ``count`` rays, or any hits, and leave them in its arrays.

    All 32 rays must be set, finite, and of one octant; those from ``count`` on end at -1.
    """
    for index in range(wp.int32(GROUP)):
        group.words[index] = -1
    everyone = ALL_RAYS >> wp.uint32(GROUP - count)
    bound_group(group.rays, 0, everyone)
    t_end = greatest_end(group.ends)
    record = int(accel.only_instance)
    first = int(0)
    push_group(group.stack, 0, accel.root, 0.0, everyone)
    top = int(1)
    while top > 0:
        top -= 1
        code = group.stack.codes[top]
        rays = rays_reaching(group.ends, group.stack.distances[top], group.stack.rays[top])
        hits = int(0)
        if code == LEAVE_INSTANCE:
            record = -1
            first = 0
        elif rays != wp.uint32(0):
            if code >= 0:
                if record >= 0 and count_rays(rays) <= GROUP_MIN:
                    hits = trace_each(accel, group, code, first, rays, record, is_any)
                else:
                    top = push_children_group(
                        accel.nodes, accel.leaves, code, group.rays, first, rays, group.ends, t_end, group.stack, top
                    )
            elif record >= 0:
                hits = meet_leaf(accel, group, -1 - code, first, rays, record, is_any)
            else:
                if accel.instances[-1 - code].is_identity == 0:
                    rays, hits = enter_instance(accel, group, -1 - code, rays, is_any)
                    first = GROUP_FLOATS
                if rays != wp.uint32(0):
                    record = -1 - code
                    t_entry = group.stack.distances[top]
                    push_group(group.stack, top, LEAVE_INSTANCE, 0.0, rays)
                    push_group(group.stack, top + 1, accel.instances[record].root, t_entry, rays)
                    top += 2
                else:
                    first = 0
        if hits > 0:
            t_end = greatest_end(group.ends)
