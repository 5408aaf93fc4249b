# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Children of a node pushed for few rays of a group: ray by ray against all boxes, as a single ray is tested.

A step of a single ray is a chain of instructions, at whose end it is known what to visit next. Here the chains of the
rays do not depend on each other, and the node is read once.
"""

import warp as wp

from .bounds import intersect_box
from .bvh_stack import LANES_IN_ORDER, NODE_ROWS, PACKED_STORE
from .constants import FAR_ROW, GROUP, INVERSE_ROW, NODE_CHILDREN, NODE_FLOATS, NODE_ORDERS, WIDTH
from .group_stack import push_group
from .group_structs import GroupStack
from .intersect_packet import VECTOR_TYPES, octant_of
from .native import spell_out
from .ray_group import group_vector
from .ray_set import first_ray

_PUSH_OF_EACH = (
    r"""
    const float* lines = (const float*)group.data + first;
    const float* ends_ = (const float*)ends.data;
    int* codes = (int*)stack.codes.data;
    float* distances = (float*)stack.distances.data;
    uint32_t* sets = (uint32_t*)stack.rays.data;
#if defined(__CUDA_ARCH__)
    const float* leader = lines + INVERSE_ROW * GROUP + __ffs(rays) - 1;
#else
    const float* leader = lines + INVERSE_ROW * GROUP + __builtin_ctz(rays);
#endif
    const int octant = (leader[0] < 0.0f) + 2 * (leader[GROUP] < 0.0f) + 4 * (leader[2 * GROUP] < 0.0f);
"""
    + NODE_ROWS
    + r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int position = 0; position < 16; ++position) {
        const int lane = order[position & 1] >> (4 * (position >> 1)) & 15;
        uint32_t met = 0;
        float t_first = INFINITY;
        for (int ray = 0; ray < GROUP; ++ray) {
            const float* line = lines + ray;
            float t_near = wp::max((near_x[lane] - line[0]) * line[INVERSE_ROW * GROUP], 0.0f);
            t_near = wp::max((near_y[lane] - line[GROUP]) * line[(INVERSE_ROW + 1) * GROUP], t_near);
            t_near = wp::max((near_z[lane] - line[2 * GROUP]) * line[(INVERSE_ROW + 2) * GROUP], t_near);
            float t_far = (far_x[lane] - line[0]) * line[FAR_ROW * GROUP];
            t_far = wp::min((far_y[lane] - line[GROUP]) * line[(FAR_ROW + 1) * GROUP], t_far);
            t_far = wp::min((far_z[lane] - line[2 * GROUP]) * line[(FAR_ROW + 2) * GROUP], t_far);
            if ((rays >> ray & 1) && t_near <= wp::min(t_far, ends_[ray])) {
                met |= (uint32_t)1 << ray;
                t_first = wp::min(t_first, t_near);
            }
        }
        if (met != 0) {
            codes[top] = children[lane];
            distances[top] = t_first;
            sets[top] = met;
            ++top;
        }
    }
    return top;
#else
"""
    + VECTOR_TYPES
    + PACKED_STORE
    + r"""
    const floats n_x = WARP_RT_LOAD(near_x), n_y = WARP_RT_LOAD(near_y), n_z = WARP_RT_LOAD(near_z);
    const floats f_x = WARP_RT_LOAD(far_x), f_y = WARP_RT_LOAD(far_y), f_z = WARP_RT_LOAD(far_z);
    ints met = (ints)0;
    floats t_first = (floats)INFINITY;
    for (uint32_t rest = rays; rest != 0; rest &= rest - 1) {
        const int ray = __builtin_ctz(rest);
        const float* line = lines + ray;
        const floats t_x = (n_x - line[0]) * line[INVERSE_ROW * GROUP];
        const floats t_y = (n_y - line[GROUP]) * line[(INVERSE_ROW + 1) * GROUP];
        const floats t_z = (n_z - line[2 * GROUP]) * line[(INVERSE_ROW + 2) * GROUP];
        const floats s_x = (f_x - line[0]) * line[FAR_ROW * GROUP];
        const floats s_y = (f_y - line[GROUP]) * line[(FAR_ROW + 1) * GROUP];
        const floats s_z = (f_z - line[2 * GROUP]) * line[(FAR_ROW + 2) * GROUP];
        const floats t_xy = WARP_RT_MAX(t_x, t_y), t_z0 = WARP_RT_MAX(t_z, (floats)0.0f);
        const floats s_xy = WARP_RT_MIN(s_x, s_y), s_zt = WARP_RT_MIN(s_z, (floats)ends_[ray]);
        const floats t_near = WARP_RT_MAX(t_xy, t_z0), t_far = WARP_RT_MIN(s_xy, s_zt);
        const ints is_met = t_near <= t_far;
        met = is_met ? met | (int)((uint32_t)1 << ray) : met;
        t_first = (is_met & (t_near < t_first)) ? t_near : t_first;
    }
#if defined(__AVX512F__)
"""
    + LANES_IN_ORDER
    + r"""
    const ints met_ = __builtin_ia32_permvarsi512(met, lanes);
    const floats t_first_ = __builtin_ia32_permvarsf512(t_first, lanes);
    const ints codes_ = __builtin_ia32_permvarsi512(WARP_RT_LOAD_INTS(children), lanes);
    const unsigned short mask = WARP_RT_MASK(met_ != 0);
    WARP_RT_PACKED_STORE(stack, top, codes_, t_first_, mask);
    *(ints_load*)(sets + top) = __builtin_ia32_compresssi512_mask(met_, (ints)0, mask);
    return top + __builtin_popcount(mask);
#else
    for (int position = 0; position < 16; ++position) {
        const int lane = order[position & 1] >> (4 * (position >> 1)) & 15;
        codes[top] = children[lane];
        distances[top] = t_first[lane];
        sets[top] = met[lane];
        top += met[lane] != 0;
    }
    return top;
#endif
}
#endif
"""
)


@wp.func_native(spell_out(_PUSH_OF_EACH, GROUP=GROUP, INVERSE_ROW=INVERSE_ROW, FAR_ROW=FAR_ROW))
def push_children_of_each(
    nodes: wp.array[float],
    node: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    ends: wp.array[float],
    stack: GroupStack,
    top: int,
) -> int:
    """Push the same children with the same sets of rays as ``push_children_group``, and the least distance of each.

    Writes up to WIDTH entries beyond those that count. Needs no bounds of the rays.

    Args:
        nodes: Wide nodes.
        node: Which one.
        group: Rays of groups.
        first: Word at which this group's begin.
        rays: Those of them that are at the node, at least one, of one octant.
        ends: t_max of each ray, shape [GROUP].
        stack: To push to.
        top: Entries on it.
    """
    ...


@wp.func
def push_children_of_each_plain(
    nodes: wp.array[float],
    node: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    ends: wp.array[float],
    stack: GroupStack,
    top: int,
) -> int:
    """Return and write what ``push_children_of_each`` does, in plain Warp."""
    octant = octant_of(group_vector(group, first + INVERSE_ROW * GROUP + first_ray(rays), GROUP))
    count = int(top)
    for position in range(wp.int32(WIDTH)):  # a loop, not sixteen copies
        word = node * NODE_FLOATS + NODE_ORDERS + 2 * octant + (position & 1)
        lane = (wp.cast(nodes[word], wp.int32) >> (4 * (position >> 1))) & (WIDTH - 1)
        base = node * NODE_FLOATS + lane
        low = wp.vec3(nodes[base], nodes[base + WIDTH], nodes[base + 2 * WIDTH])
        high = wp.vec3(nodes[base + 3 * WIDTH], nodes[base + 4 * WIDTH], nodes[base + 5 * WIDTH])
        met = wp.uint32(0)
        t_first = float(wp.inf)
        for ray in range(wp.int32(GROUP)):
            bit = rays & (wp.uint32(1) << wp.uint32(ray))
            if bit != wp.uint32(0):
                origin = group_vector(group, first + ray, GROUP)
                inverse = group_vector(group, first + INVERSE_ROW * GROUP + ray, GROUP)
                span = intersect_box(origin, inverse, ends[ray], low, high)
                if span[0] <= span[1]:
                    met = met | bit
                    t_first = wp.min(t_first, span[0])
        if met != wp.uint32(0):
            push_group(stack, count, wp.cast(nodes[base + NODE_CHILDREN], wp.int32), t_first, met)
            count += 1
    return count
