# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Closest hit and any hit of a group of rays, which go through both levels of the hierarchy together.

The group visits a node once for all rays that meet its box, and takes the children in one order. Where its rays part,
at most GROUP_FEW of them at a node, each is tested against all boxes. A ray is tested against the leaves whose boxes
it meets, by the same test as when it is traced alone, and against more: a hit drops what lies behind it by where the
group enters a box, which is no later than where the ray does.

Reference: Wald et al. (2001), Interactive Rendering with Coherent Ray Tracing, Eurographics; Overbeck, Ramamoorthi and
Mark (2008), Large Ray Packets for Real-time Whitted Ray Tracing, for groups whose rays part.
"""

import warp as wp

from .bvh_structs import AccelData
from .constants import ALL_RAYS, GROUP, GROUP_FEW, GROUP_FLOATS, LANE_COST, LEAVE_INSTANCE, TRIANGLES
from .group_stack import push_children_group, push_group
from .group_stack_each import push_children_of_each
from .group_structs import RayGroup
from .intersect_group import meet_shapes, meet_triangles, note_hits, set_skips
from .intersect_rays import meet_chosen_triangles
from .ray_group import bound_group, greatest_end, rays_of_first_octant, rays_reaching
from .ray_set import count_rays
from .reachable_triangles import reachable_triangles
from .transform_group import transform_group


@wp.func
def meet_leaf(
    accel: wp.ref[AccelData], group: wp.ref[RayGroup], leaf: int, first: int, rays: wp.uint32, record: int, is_any: bool
) -> int:
    """Test rays against a leaf packet, and return 1 if one of them hit something."""
    kind = int(accel.instances[record].kind)
    hits = wp.uint32(0)
    if kind == TRIANGLES:
        lanes = int(-1)
        if count_rays(rays) > GROUP_FEW:
            lanes = reachable_triangles(accel.leaves, leaf, group.rays, first, rays)
        if LANE_COST * count_rays(wp.uint32(lanes)) <= count_rays(rays):
            hits = meet_chosen_triangles(
                accel.leaves,
                leaf,
                lanes,
                group.rays,
                first,
                rays,
                group.skips,
                group.ends,
                group.u,
                group.v,
                group.words,
            )
        else:
            hits = meet_triangles(
                accel.leaves, leaf, group.rays, first, rays, group.skips, group.ends, group.u, group.v, group.words
            )
    else:
        hits = meet_shapes(
            accel.shapes, leaf, kind, group.rays, first, rays, group.skips, group.ends, group.u, group.v, group.words
        )
    if hits == wp.uint32(0):
        return 0
    note_hits(group.records, group.ends, hits, record, is_any)
    return 1


@wp.func
def enter_instance(accel: wp.ref[AccelData], group: wp.ref[RayGroup], record: int, rays: wp.uint32, top: int) -> int:
    """Replace the entry at ``top`` of the group's stack by what its rays visit in an instance; return the new top.

    They are taken into the instance's space, and parted by their octants there. Bounds are found for the part of more
    than GROUP_FEW, of which there can be only one.
    """
    set_skips(group.senders, group.triangles, accel.instances[record].instance, group.skips)
    t_entry = group.stack.distances[top]
    root = accel.instances[record].root
    push_group(group.stack, top, LEAVE_INSTANCE, 0.0, rays)
    above = int(top + 1)
    if int(accel.instances[record].is_identity) == 1:
        push_group(group.stack, above, root, t_entry, rays)
        return above + 1
    rest = transform_group(accel.instances, record, group.rays, rays)
    while rest != wp.uint32(0):
        alike = rays_of_first_octant(group.rays, GROUP_FLOATS, rest)
        rest = rest & ~alike
        if count_rays(alike) > GROUP_FEW:
            bound_group(group.rays, GROUP_FLOATS, alike)
        push_group(group.stack, above, root, t_entry, alike)
        above += 1
    return above


# Out of line: its two callers in a picture's kernel make it twice as long to compile, and no faster.
@wp.func(inline=False)
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
    if record >= 0:
        set_skips(group.senders, group.triangles, accel.instances[record].instance, group.skips)
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
                if count_rays(rays) <= GROUP_FEW:
                    top = push_children_of_each(
                        accel.nodes, code, group.rays, first, rays, group.ends, group.stack, top
                    )
                else:
                    top = push_children_group(
                        accel.nodes, accel.leaves, code, group.rays, first, rays, group.ends, t_end, group.stack, top
                    )
            elif record >= 0:
                hits = meet_leaf(accel, group, -1 - code, first, rays, record, is_any)
            else:
                record = -1 - code
                first = GROUP_FLOATS * (1 - int(accel.instances[record].is_identity))
                top = enter_instance(accel, group, record, rays, top)
        if hits > 0:
            t_end = greatest_end(group.ends)
