# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A group of rays against the boxes of a node.

A group is 32 rays whose directions lie in one octant: GROUP_RAY_FLOATS words, 3 rows of origins (x y z), 3 rows of
inverse directions, then four vectors that bound them: the origins' corner that boxes are nearest to, the one that they
are farthest from, the least and the greatest inverse direction. A set of its rays is a word, a bit a ray.
"""

import warp as wp

from .bounds import intersect_box
from .constants import GROUP, GROUP_BOUNDS, NODE_FLOATS, SLAB_SCALE, WIDTH

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

# A vector of the node's lanes and one of sixteen rays. Loads go through types without alignment, and the conditional
# operator becomes one vminps or vmaxps.
_VECTOR_TYPES = r"""
{
#pragma clang fp contract(off)
typedef float lanes __attribute__((ext_vector_type(WIDTH)));
typedef float lanes_load __attribute__((ext_vector_type(WIDTH), aligned(4)));
typedef float sixteen __attribute__((ext_vector_type(16)));
typedef float sixteen_load __attribute__((ext_vector_type(16), aligned(4)));
typedef bool bools8 __attribute__((ext_vector_type(8)));
typedef bool bools16 __attribute__((ext_vector_type(16)));
typedef unsigned char bits8;
typedef unsigned short bits16;
#define WARP_RT_LOAD(type, p) (*(const type##_load*)(p))
#define WARP_RT_MIN(a, b) ((a) < (b) ? (a) : (b))
#define WARP_RT_MAX(a, b) ((a) > (b) ? (a) : (b))
#define WARP_RT_MASK_OF(size, m) __builtin_bit_cast(bits##size, __builtin_convertvector((m), bools##size))
#define WARP_RT_MASK(size, m) WARP_RT_MASK_OF(size, m)
"""

# The bounds lose no ray: rounded differences and products are monotone in their operands, so that the group's interval
# contains those that ``push_children`` finds for its rays, rounding included.
_GROUP_BOXES = (
    r"""
    const float* rows = (const float*)nodes.data + (size_t)node * NODE_FLOATS;
    const float* rays = (const float*)group.data + first;
    const float *near_o = rays + 192, *far_o = rays + 195, *low = rays + 198, *high = rays + 201;
    const int half = 3 * WIDTH;
    const int flip_x = low[0] < 0.0f ? half : 0, flip_y = low[1] < 0.0f ? half : 0, flip_z = low[2] < 0.0f ? half : 0;
    const float *near_x = rows + flip_x, *near_y = rows + WIDTH + flip_y, *near_z = rows + 2 * WIDTH + flip_z;
    rows += half;
    const float *far_x = rows - flip_x, *far_y = rows + WIDTH - flip_y, *far_z = rows + 2 * WIDTH - flip_z;
    int met = 0;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int lane = 0; lane < WIDTH; ++lane) {
        const float x = near_x[lane] - near_o[0], y = near_y[lane] - near_o[1], z = near_z[lane] - near_o[2];
        float t_enter = wp::max(wp::min(x * low[0], x * high[0]), 0.0f);
        t_enter = wp::max(wp::min(y * low[1], y * high[1]), t_enter);
        t_enter = wp::max(wp::min(z * low[2], z * high[2]), t_enter);
        distances.data[lane] = t_enter;
        uint32_t mask = 0;
        for (int ray = 0; ray < 32; ++ray) {
            const float o_x = rays[ray], o_y = rays[32 + ray], o_z = rays[64 + ray];
            const float i_x = rays[96 + ray], i_y = rays[128 + ray], i_z = rays[160 + ray];
            float t_near = wp::max((near_x[lane] - o_x) * i_x, 0.0f);
            t_near = wp::max((near_y[lane] - o_y) * i_y, t_near);
            t_near = wp::max((near_z[lane] - o_z) * i_z, t_near);
            float t_far = (far_x[lane] - o_x) * (i_x * SLAB_SCALE);
            t_far = wp::min((far_y[lane] - o_y) * (i_y * SLAB_SCALE), t_far);
            t_far = wp::min((far_z[lane] - o_z) * (i_z * SLAB_SCALE), t_far);
            mask |= (uint32_t)(t_near <= wp::min(t_far, ends.data[ray])) << ray;
        }
        masks.data[lane] = mask & active;
        met |= ((mask & active) != 0) << lane;
    }
    return met;
#else
"""
    + _VECTOR_TYPES
    + r"""
    const lanes near_bx = WARP_RT_LOAD(lanes, near_x) - near_o[0], far_bx = WARP_RT_LOAD(lanes, far_x) - far_o[0];
    const lanes near_by = WARP_RT_LOAD(lanes, near_y) - near_o[1], far_by = WARP_RT_LOAD(lanes, far_y) - far_o[1];
    const lanes near_bz = WARP_RT_LOAD(lanes, near_z) - near_o[2], far_bz = WARP_RT_LOAD(lanes, far_z) - far_o[2];
    const lanes enter_lx = near_bx * low[0], enter_hx = near_bx * high[0];
    const lanes enter_ly = near_by * low[1], enter_hy = near_by * high[1];
    const lanes enter_lz = near_bz * low[2], enter_hz = near_bz * high[2];
    const lanes leave_lx = far_bx * (low[0] * SLAB_SCALE), leave_hx = far_bx * (high[0] * SLAB_SCALE);
    const lanes leave_ly = far_by * (low[1] * SLAB_SCALE), leave_hy = far_by * (high[1] * SLAB_SCALE);
    const lanes leave_lz = far_bz * (low[2] * SLAB_SCALE), leave_hz = far_bz * (high[2] * SLAB_SCALE);
    const lanes enter_x = WARP_RT_MIN(enter_lx, enter_hx), leave_x = WARP_RT_MAX(leave_lx, leave_hx);
    const lanes enter_y = WARP_RT_MIN(enter_ly, enter_hy), leave_y = WARP_RT_MAX(leave_ly, leave_hy);
    const lanes enter_z = WARP_RT_MIN(enter_lz, enter_hz), leave_z = WARP_RT_MAX(leave_lz, leave_hz);
    const lanes enter_z0 = WARP_RT_MAX(enter_z, (lanes)0.0f), enter_xy = WARP_RT_MAX(enter_x, enter_y);
    const lanes t_enter = WARP_RT_MAX(enter_xy, enter_z0);
    const lanes leave_xy = WARP_RT_MIN(leave_x, leave_y);
    const lanes t_box = WARP_RT_MIN(leave_xy, leave_z);
    const lanes t_leave = WARP_RT_MIN(t_box, (lanes)t_end);
    __builtin_memcpy(distances.data, &t_enter, sizeof(t_enter));
    for (unsigned int mask = WARP_RT_MASK(WIDTH, t_enter <= t_leave); mask != 0; mask &= mask - 1) {
        const int lane = __builtin_ctz(mask);
        uint32_t hits = 0;
        for (int block = 0; block < 32; block += 16) {
            const float* o = rays + block;
            const sixteen o_x = WARP_RT_LOAD(sixteen, o), i_x = WARP_RT_LOAD(sixteen, o + 96);
            const sixteen o_y = WARP_RT_LOAD(sixteen, o + 32), i_y = WARP_RT_LOAD(sixteen, o + 128);
            const sixteen o_z = WARP_RT_LOAD(sixteen, o + 64), i_z = WARP_RT_LOAD(sixteen, o + 160);
            const sixteen t_x = (near_x[lane] - o_x) * i_x, s_x = (far_x[lane] - o_x) * (i_x * SLAB_SCALE);
            const sixteen t_y = (near_y[lane] - o_y) * i_y, s_y = (far_y[lane] - o_y) * (i_y * SLAB_SCALE);
            const sixteen t_z = (near_z[lane] - o_z) * i_z, s_z = (far_z[lane] - o_z) * (i_z * SLAB_SCALE);
            const sixteen t_xy = WARP_RT_MAX(t_x, t_y), t_z0 = WARP_RT_MAX(t_z, (sixteen)0.0f);
            const sixteen t_near = WARP_RT_MAX(t_xy, t_z0), s_xy = WARP_RT_MIN(s_x, s_y);
            const sixteen s_box = WARP_RT_MIN(s_xy, s_z);
            const sixteen end = WARP_RT_LOAD(sixteen, (const float*)ends.data + block), t_far = WARP_RT_MIN(s_box, end);
            hits |= (uint32_t)WARP_RT_MASK(16, t_near <= t_far) << block;
        }
        hits &= active;
        masks.data[lane] = hits;
        met |= (hits != 0) << lane;
    }
    return met;
}
#endif
"""
)
for _name, _value in (("SLAB_SCALE", f"{SLAB_SCALE!r}f"), ("NODE_FLOATS", NODE_FLOATS), ("WIDTH", WIDTH)):
    _GROUP_BOXES = _GROUP_BOXES.replace(_name, str(_value))


@wp.func_native(_GROUP_BOXES)
def intersect_boxes_group(
    nodes: wp.array[float],
    node: int,
    group: wp.array[float],
    first: int,
    active: wp.uint32,
    ends: wp.array[float],
    t_end: float,
    distances: wp.array[float],
    masks: wp.array[wp.uint32],
) -> int:
    """Return the bit mask of a node's children whose boxes at least one of a group's active rays meets.

    Writes for each of them the set of those rays to ``masks``, and to ``distances`` a lower bound of where they enter.

    Args:
        nodes: Wide nodes.
        node: Which one.
        group: Rays of groups.
        first: Word at which this group's begin.
        active: Set of rays.
        ends: t_max of each ray, shape [32].
        t_end: The greatest of the active ones, or more.
        distances: Output, shape [WIDTH].
        masks: Output, shape [WIDTH].

    Reference: Boulos, Wald and Shirley (2006), Geometric and Arithmetic Culling Methods for Entire Ray Packets, for
    the interval that the group is culled by; its rays are then tested one by one.
    """
    ...


@wp.func
def group_vector(group: wp.array[float], first: int, step: int) -> wp.vec3:
    """Return three words of a group's rays, ``step`` apart."""
    return wp.vec3(group[first], group[first + step], group[first + 2 * step])


@wp.func
def intersect_boxes_group_plain(
    nodes: wp.array[float],
    node: int,
    group: wp.array[float],
    first: int,
    active: wp.uint32,
    ends: wp.array[float],
    t_end: float,
    distances: wp.array[float],
    masks: wp.array[wp.uint32],
) -> int:
    """Return what ``intersect_boxes_group`` returns, in plain Warp."""
    near_o = group_vector(group, first + GROUP_BOUNDS, 1)
    least = group_vector(group, first + GROUP_BOUNDS + 6, 1)
    greatest = group_vector(group, first + GROUP_BOUNDS + 9, 1)
    met = int(0)
    for lane in range(wp.int32(WIDTH)):  # a loop, not WIDTH copies
        base = node * NODE_FLOATS + lane
        low = wp.vec3(nodes[base], nodes[base + WIDTH], nodes[base + 2 * WIDTH])
        high = wp.vec3(nodes[base + 3 * WIDTH], nodes[base + 4 * WIDTH], nodes[base + 5 * WIDTH])
        t_enter = float(0.0)
        for axis in range(3):
            near = wp.where(least[axis] < 0.0, high[axis], low[axis]) - near_o[axis]
            t_enter = wp.max(wp.min(near * least[axis], near * greatest[axis]), t_enter)
        distances[lane] = t_enter
        masks[lane] = wp.uint32(0)
        for ray in range(wp.int32(GROUP)):
            bit = wp.uint32(1) << wp.uint32(ray)
            if (active & bit) != wp.uint32(0):
                origin = group_vector(group, first + ray, 32)
                inverse = group_vector(group, first + 96 + ray, 32)
                span = intersect_box(origin, inverse, ends[ray], low, high)
                if span[0] <= span[1]:
                    masks[lane] = masks[lane] | bit
        if masks[lane] != wp.uint32(0):
            met += 1 << lane
    return met


_BOUNDS = r"""
    const float* rays = (const float*)group.data + first;
    float* bounds = (float*)group.data + first + 192;
    for (int axis = 0; axis < 3; ++axis) {
        const float *origins = rays + 32 * axis, *inverses = rays + 96 + 32 * axis;
        float extremes[4];
        for (int row = 0; row < 2; ++row) {
            const float* values = row == 0 ? origins : inverses;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
            float low = values[0], high = values[0];
            for (int ray = 1; ray < 32; ++ray) {
                low = wp::min(low, values[ray]);
                high = wp::max(high, values[ray]);
            }
#else
            typedef float float8 __attribute__((ext_vector_type(8)));
            typedef float float8_load __attribute__((ext_vector_type(8), aligned(4)));
            float8 lows = *(const float8_load*)values, highs = lows;
            for (int ray = 8; ray < 32; ray += 8) {
                const float8 next = *(const float8_load*)(values + ray);
                lows = lows < next ? lows : next;
                highs = highs > next ? highs : next;
            }
            const float low = __builtin_reduce_min(lows), high = __builtin_reduce_max(highs);
#endif
            extremes[2 * row] = low;
            extremes[2 * row + 1] = high;
        }
        const bool is_negative = extremes[2] < 0.0f;
        bounds[axis] = is_negative ? extremes[0] : extremes[1];
        bounds[3 + axis] = is_negative ? extremes[1] : extremes[0];
        bounds[6 + axis] = extremes[2];
        bounds[9 + axis] = extremes[3];
    }
"""


@wp.func_native(_BOUNDS)
def bound_group(group: wp.array[float], first: int):
    """Write the bounds of a group's rays behind them."""
    ...


@wp.func
def bound_group_plain(group: wp.array[float], first: int):
    """Write what ``bound_group`` writes, in plain Warp."""
    for axis in range(3):
        low = float(group[first + 32 * axis])
        high = float(low)
        least = float(group[first + 96 + 32 * axis])
        greatest = float(least)
        for ray in range(wp.int32(GROUP)):
            low = wp.min(low, group[first + 32 * axis + ray])
            high = wp.max(high, group[first + 32 * axis + ray])
            least = wp.min(least, group[first + 96 + 32 * axis + ray])
            greatest = wp.max(greatest, group[first + 96 + 32 * axis + ray])
        bounds = first + GROUP_BOUNDS + axis
        group[bounds] = wp.where(least < 0.0, low, high)
        group[bounds + 3] = wp.where(least < 0.0, high, low)
        group[bounds + 6] = least
        group[bounds + 9] = greatest


_GREATEST = r"""
    const float* values = (const float*)ends.data;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    float greatest = values[0];
    for (int ray = 1; ray < 32; ++ray)
        greatest = wp::max(greatest, values[ray]);
    return greatest;
#else
    typedef float float8 __attribute__((ext_vector_type(8)));
    typedef float float8_load __attribute__((ext_vector_type(8), aligned(4)));
    float8 greatest = *(const float8_load*)values;
    for (int ray = 8; ray < 32; ray += 8) {
        const float8 next = *(const float8_load*)(values + ray);
        greatest = greatest > next ? greatest : next;
    }
    return __builtin_reduce_max(greatest);
#endif
"""


@wp.func_native(_GREATEST)
def greatest_end(ends: wp.array[float]) -> float:
    """Return the greatest of 32 numbers."""
    ...
