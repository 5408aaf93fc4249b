# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The traversal stack of a group of rays: children pushed with the set of rays that meet them."""

import warp as wp

from .bounds import intersect_box
from .bvh_stack import LANES_IN_ORDER, NODE_ROWS
from .constants import (
    FAR_ROW,
    GROUP,
    GROUP_BOUNDS,
    INVERSE_ROW,
    NODE_CHILDREN,
    NODE_FLOATS,
    NODE_ORDERS,
    SLAB_SCALE,
    WIDTH,
)
from .group_structs import GroupStack
from .intersect_packet import VECTOR_TYPES
from .native import spell_out
from .prefetch import PREFETCH_CHILD
from .ray_group import group_vector


@wp.func
def push_group(stack: GroupStack, top: int, code: int, t: float, rays: wp.uint32):
    """Write the entry above the topmost one; the caller counts."""
    stack.codes[top] = code
    stack.distances[top] = t
    stack.rays[top] = rays


# The bounds lose no ray: rounded differences and products are monotone in their operands, so that the group's interval
# contains those that ``push_children`` finds for its rays, rounding included.
_PUSH_CHILDREN = (
    r"""
    const float* lines = (const float*)group.data + first;
    const float *near_o = lines + GROUP_BOUNDS, *far_o = near_o + 3, *low = near_o + 6, *high = near_o + 9;
    const int octant = (low[0] < 0.0f) + 2 * (low[1] < 0.0f) + 4 * (low[2] < 0.0f);
"""
    + NODE_ROWS
    + r"""
    const float *ends_ = (const float*)ends.data;
    int* codes = (int*)stack.codes.data;
    float* distances = (float*)stack.distances.data;
    uint32_t* sets = (uint32_t*)stack.rays.data;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int position = 0; position < 16; ++position) {
        const int lane = order[position & 1] >> (4 * (position >> 1)) & 15;
        const float x = near_x[lane] - near_o[0], y = near_y[lane] - near_o[1], z = near_z[lane] - near_o[2];
        float t_enter = wp::max(wp::min(x * low[0], x * high[0]), 0.0f);
        t_enter = wp::max(wp::min(y * low[1], y * high[1]), t_enter);
        t_enter = wp::max(wp::min(z * low[2], z * high[2]), t_enter);
        uint32_t met = 0;
        for (int ray = 0; ray < GROUP; ++ray) {
            const float* line = lines + ray;
            float t_near = wp::max((near_x[lane] - line[0]) * line[INVERSE_ROW * GROUP], 0.0f);
            t_near = wp::max((near_y[lane] - line[GROUP]) * line[(INVERSE_ROW + 1) * GROUP], t_near);
            t_near = wp::max((near_z[lane] - line[2 * GROUP]) * line[(INVERSE_ROW + 2) * GROUP], t_near);
            float t_far = (far_x[lane] - line[0]) * line[FAR_ROW * GROUP];
            t_far = wp::min((far_y[lane] - line[GROUP]) * line[(FAR_ROW + 1) * GROUP], t_far);
            t_far = wp::min((far_z[lane] - line[2 * GROUP]) * line[(FAR_ROW + 2) * GROUP], t_far);
            met |= (uint32_t)(t_near <= wp::min(t_far, ends_[ray])) << ray;
        }
        met &= rays;
        if (met != 0) {
            codes[top] = children[lane];
            distances[top] = t_enter;
            sets[top] = met;
            ++top;
        }
    }
    return top;
#else
"""
    + VECTOR_TYPES
    + r"""
    const floats near_bx = WARP_RT_LOAD(near_x) - near_o[0], far_bx = WARP_RT_LOAD(far_x) - far_o[0];
    const floats near_by = WARP_RT_LOAD(near_y) - near_o[1], far_by = WARP_RT_LOAD(far_y) - far_o[1];
    const floats near_bz = WARP_RT_LOAD(near_z) - near_o[2], far_bz = WARP_RT_LOAD(far_z) - far_o[2];
    const floats enter_lx = near_bx * low[0], enter_hx = near_bx * high[0];
    const floats enter_ly = near_by * low[1], enter_hy = near_by * high[1];
    const floats enter_lz = near_bz * low[2], enter_hz = near_bz * high[2];
    const floats leave_lx = far_bx * (low[0] * SLAB_SCALE), leave_hx = far_bx * (high[0] * SLAB_SCALE);
    const floats leave_ly = far_by * (low[1] * SLAB_SCALE), leave_hy = far_by * (high[1] * SLAB_SCALE);
    const floats leave_lz = far_bz * (low[2] * SLAB_SCALE), leave_hz = far_bz * (high[2] * SLAB_SCALE);
    const floats enter_x = WARP_RT_MIN(enter_lx, enter_hx), leave_x = WARP_RT_MAX(leave_lx, leave_hx);
    const floats enter_y = WARP_RT_MIN(enter_ly, enter_hy), leave_y = WARP_RT_MAX(leave_ly, leave_hy);
    const floats enter_z = WARP_RT_MIN(enter_lz, enter_hz), leave_z = WARP_RT_MAX(leave_lz, leave_hz);
    const floats enter_z0 = WARP_RT_MAX(enter_z, (floats)0.0f), enter_xy = WARP_RT_MAX(enter_x, enter_y);
    const floats leave_zt = WARP_RT_MIN(leave_z, (floats)t_end), leave_xy = WARP_RT_MIN(leave_x, leave_y);
    const floats t_enter = WARP_RT_MAX(enter_xy, enter_z0), t_leave = WARP_RT_MIN(leave_xy, leave_zt);
    float entering[16];
    __builtin_memcpy(entering, &t_enter, sizeof(t_enter));
#if defined(__AVX512F__)
"""
    + LANES_IN_ORDER
    + r"""
    unsigned int positions = WARP_RT_MASK(
        __builtin_ia32_permvarsf512(t_enter, lanes) <= __builtin_ia32_permvarsf512(t_leave, lanes));
#else
    const unsigned int mask = WARP_RT_MASK(t_enter <= t_leave);
    unsigned int positions = 0;
    if (mask != 0)
        for (int position = 0; position < 16; ++position)
            positions |= (mask >> (order[position & 1] >> (4 * (position >> 1)) & 15) & 1) << position;
#endif
    for (; positions != 0; positions &= positions - 1) {
        const int position = __builtin_ctz(positions);
        const int lane = order[position & 1] >> (4 * (position >> 1)) & 15;
        uint32_t met = 0;
        for (int block = 0; block < GROUP; block += 16) {
            const float* line = lines + block;
            const floats o_x = WARP_RT_LOAD(line), o_y = WARP_RT_LOAD(line + GROUP);
            const floats o_z = WARP_RT_LOAD(line + 2 * GROUP);
            const floats t_x = (near_x[lane] - o_x) * WARP_RT_LOAD(line + INVERSE_ROW * GROUP);
            const floats t_y = (near_y[lane] - o_y) * WARP_RT_LOAD(line + (INVERSE_ROW + 1) * GROUP);
            const floats t_z = (near_z[lane] - o_z) * WARP_RT_LOAD(line + (INVERSE_ROW + 2) * GROUP);
            const floats s_x = (far_x[lane] - o_x) * WARP_RT_LOAD(line + FAR_ROW * GROUP);
            const floats s_y = (far_y[lane] - o_y) * WARP_RT_LOAD(line + (FAR_ROW + 1) * GROUP);
            const floats s_z = (far_z[lane] - o_z) * WARP_RT_LOAD(line + (FAR_ROW + 2) * GROUP);
            const floats t_xy = WARP_RT_MAX(t_x, t_y), t_z0 = WARP_RT_MAX(t_z, (floats)0.0f);
            const floats end = WARP_RT_LOAD(ends_ + block);
            const floats s_xy = WARP_RT_MIN(s_x, s_y), s_zt = WARP_RT_MIN(s_z, end);
            const floats t_near = WARP_RT_MAX(t_xy, t_z0), t_far = WARP_RT_MIN(s_xy, s_zt);
            met |= (uint32_t)WARP_RT_MASK(t_near <= t_far) << block;
        }
        met &= rays;
        if (met != 0) {
            const int code = children[lane];
            codes[top] = code;
            distances[top] = entering[lane];
            sets[top] = met;
            ++top;
"""
    + PREFETCH_CHILD
    + r"""
        }
    }
    return top;
}
#endif
"""
)
_PUSH_CHILDREN = spell_out(
    _PUSH_CHILDREN,
    GROUP=GROUP,
    GROUP_BOUNDS=GROUP_BOUNDS,
    INVERSE_ROW=INVERSE_ROW,
    FAR_ROW=FAR_ROW,
    SLAB_SCALE=SLAB_SCALE,
)


@wp.func_native(_PUSH_CHILDREN)
def push_children_group(
    nodes: wp.array[float],
    leaves: wp.array[float],
    node: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    ends: wp.array[float],
    t_end: float,
    stack: GroupStack,
    top: int,
) -> int:
    """Push the children of a node whose boxes at least one of some rays meets; return the new top of the stack.

    In the node's order for the rays' octant, the nearest on top; with each child, the rays that meet its box. Each is
    asked for at once: until the group comes to it, there is much to be done for its siblings and their rays.

    Args:
        nodes: Wide nodes.
        leaves: Leaf packets, which are only asked for.
        node: Which one.
        group: Rays of groups.
        first: Word at which this group's begin.
        rays: Those of them that are at the node.
        ends: t_max of each ray, shape [GROUP].
        t_end: The greatest of theirs, or more.
        stack: To push to.
        top: Entries on it.

    Reference: Boulos, Wald and Shirley (2006), Geometric and Arithmetic Culling Methods for Entire Ray Packets, for
    the interval that drops children first; boxes are then tested one by one, against sixteen rays at a time.
    """
    ...


@wp.func
def push_children_group_plain(
    nodes: wp.array[float],
    leaves: wp.array[float],
    node: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    ends: wp.array[float],
    t_end: float,
    stack: GroupStack,
    top: int,
) -> int:
    """Return and write what ``push_children_group`` does, in plain Warp."""
    near_o = group_vector(group, first + GROUP_BOUNDS, 1)
    least = group_vector(group, first + GROUP_BOUNDS + 6, 1)
    greatest = group_vector(group, first + GROUP_BOUNDS + 9, 1)
    octant = (1 if least[0] < 0.0 else 0) + (2 if least[1] < 0.0 else 0) + (4 if least[2] < 0.0 else 0)
    count = int(top)
    for position in range(wp.int32(WIDTH)):  # a loop, not sixteen copies
        word = node * NODE_FLOATS + NODE_ORDERS + 2 * octant + (position & 1)
        lane = (wp.cast(nodes[word], wp.int32) >> (4 * (position >> 1))) & (WIDTH - 1)
        base = node * NODE_FLOATS + lane
        low = wp.vec3(nodes[base], nodes[base + WIDTH], nodes[base + 2 * WIDTH])
        high = wp.vec3(nodes[base + 3 * WIDTH], nodes[base + 4 * WIDTH], nodes[base + 5 * WIDTH])
        t_enter = float(0.0)
        for axis in range(3):
            near = (high[axis] if least[axis] < 0.0 else low[axis]) - near_o[axis]
            t_enter = wp.max(wp.min(near * least[axis], near * greatest[axis]), t_enter)
        met = wp.uint32(0)
        for ray in range(wp.int32(GROUP)):
            origin = group_vector(group, first + ray, GROUP)
            inverse = group_vector(group, first + INVERSE_ROW * GROUP + ray, GROUP)
            span = intersect_box(origin, inverse, ends[ray], low, high)
            if span[0] <= span[1]:
                met = met | (wp.uint32(1) << wp.uint32(ray))
        met = met & rays
        if met != wp.uint32(0):
            push_group(stack, count, wp.cast(nodes[base + NODE_CHILDREN], wp.int32), t_enter, met)
            count += 1
    return count
