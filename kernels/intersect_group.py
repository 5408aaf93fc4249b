# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A group of rays: against the boxes of a node, and against the triangles of a leaf packet.

A group is 32 rays whose directions lie in one octant: GROUP_FLOATS words, in rows of 32. Rows 0 to 2 are the origins'
x, y and z, 3 to 5 the inverse directions, 6 to 8 those for far planes, 9 to 11 the shear factors, 12 to 14 the axes of
the shear as the bits of int32, 15 to 17 the directions. Four vectors bound the rays: the corner of the origins' box
that is nearest to boxes, the one that is farthest from them, the least and the greatest inverse direction. A set of
rays is a word, a bit a ray.
"""

import warp as wp

from .bounds import intersect_box
from .constants import (
    GROUP,
    GROUP_BOUNDS,
    GROUP_ROWS,
    LEAF_FLOATS,
    LEAF_IDS,
    MAX_DIRECTION,
    MIN_DIRECTION,
    NO_TRIANGLE,
    NODE_CHILDREN,
    NODE_FLOATS,
    NODE_ORDERS,
    SLAB_SCALE,
    WATERTIGHT,
    WIDTH,
)
from .intersect_packet import (
    ALL_TRIANGLES,
    LEAF_ROWS,
    ONE_TRIANGLE,
    VECTOR_TYPES,
    PacketRay,
    intersect_triangles_plain,
    make_packet_ray,
    octant_of,
)
from .prefetch import PREFETCH_CHILD

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class GroupStack:
    """The traversal stack of a group: children that some of its rays have yet to visit."""

    codes: wp.array[int]
    """Child codes, and LEAVE_INSTANCE."""
    distances: wp.array[float]
    """Before these no ray enters their boxes."""
    rays: wp.array[wp.uint32]
    """The rays that meet their boxes."""


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
    const float* rows = (const float*)nodes.data + (size_t)node * 128;
    const int* children = (const int*)rows + 96;
    const float* lines = (const float*)group.data + first;
    const float *near_o = lines + 576, *far_o = lines + 579, *low = lines + 582, *high = lines + 585;
    const int octant = (low[0] < 0.0f) + 2 * (low[1] < 0.0f) + 4 * (low[2] < 0.0f);
    const unsigned int* order = (const unsigned int*)rows + 112 + 2 * octant;
    const int flip_x = octant & 1 ? 48 : 0, flip_y = octant & 2 ? 48 : 0, flip_z = octant & 4 ? 48 : 0;
    const float *near_x = rows + flip_x, *near_y = rows + 16 + flip_y, *near_z = rows + 32 + flip_z;
    const float *far_x = rows + 48 - flip_x, *far_y = rows + 64 - flip_y, *far_z = rows + 80 - flip_z;
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
        for (int ray = 0; ray < 32; ++ray) {
            const float* line = lines + ray;
            float t_near = wp::max((near_x[lane] - line[0]) * line[96], 0.0f);
            t_near = wp::max((near_y[lane] - line[32]) * line[128], t_near);
            t_near = wp::max((near_z[lane] - line[64]) * line[160], t_near);
            float t_far = (far_x[lane] - line[0]) * line[192];
            t_far = wp::min((far_y[lane] - line[32]) * line[224], t_far);
            t_far = wp::min((far_z[lane] - line[64]) * line[256], t_far);
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
    typedef long long longs __attribute__((ext_vector_type(8)));
    typedef long long long_load __attribute__((aligned(4)));
    const ints shifts = {0, 0, 4, 4, 8, 8, 12, 12, 16, 16, 20, 20, 24, 24, 28, 28};
    const ints lanes = __builtin_bit_cast(ints, (longs)(*(const long_load*)order)) >> shifts;
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
        for (int block = 0; block < 32; block += 16) {
            const float* line = lines + block;
            const floats o_x = WARP_RT_LOAD(line), o_y = WARP_RT_LOAD(line + 32), o_z = WARP_RT_LOAD(line + 64);
            const floats t_x = (near_x[lane] - o_x) * WARP_RT_LOAD(line + 96);
            const floats t_y = (near_y[lane] - o_y) * WARP_RT_LOAD(line + 128);
            const floats t_z = (near_z[lane] - o_z) * WARP_RT_LOAD(line + 160);
            const floats s_x = (far_x[lane] - o_x) * WARP_RT_LOAD(line + 192);
            const floats s_y = (far_y[lane] - o_y) * WARP_RT_LOAD(line + 224);
            const floats s_z = (far_z[lane] - o_z) * WARP_RT_LOAD(line + 256);
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
).replace("SLAB_SCALE", f"{SLAB_SCALE!r}f")


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
    the interval that drops children first; the rays are then tested one by one, sixteen at a time.
    """
    ...


@wp.func
def group_vector(group: wp.array[float], first: int, step: int) -> wp.vec3:
    """Return three words of a group's rays, ``step`` apart."""
    return wp.vec3(group[first], group[first + step], group[first + 2 * step])


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
            origin = group_vector(group, first + ray, 32)
            inverse = group_vector(group, first + 96 + ray, 32)
            span = intersect_box(origin, inverse, ends[ray], low, high)
            if span[0] <= span[1]:
                met = met | (wp.uint32(1) << wp.uint32(ray))
        met = met & rays
        if met != wp.uint32(0):
            push_group(stack, count, wp.cast(nodes[base + NODE_CHILDREN], wp.int32), t_enter, met)
            count += 1
    return count


_BOUNDS = r"""
    const float* rays = (const float*)group.data + first;
    float* bounds = (float*)group.data + first + 576;
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
        group[bounds] = low if least < 0.0 else high
        group[bounds + 3] = high if least < 0.0 else low
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


_FIRST_RAY = r"""
#if defined(__CUDA_ARCH__)
    return __ffs(rays) - 1;
#else
    return __builtin_ctz(rays);
#endif
"""


@wp.func_native(_FIRST_RAY)
def first_ray(rays: wp.uint32) -> int:
    """Return the first ray of a set that is not empty."""
    ...


_COUNT_RAYS = r"""
#if defined(__CUDA_ARCH__)
    return __popc(rays);
#else
    return __builtin_popcount(rays);
#endif
"""


@wp.func_native(_COUNT_RAYS)
def count_rays(rays: wp.uint32) -> int:
    """Return the size of a set of rays."""
    ...


@wp.func
def drop_first(rays: wp.uint32) -> wp.uint32:
    """Return a set of rays without its first one."""
    return rays & (rays - wp.uint32(1))


# --- rays of a group


@wp.func
def set_group_ray(group: wp.array[float], first: int, index: int, ray: PacketRay):
    """Write a ray of a group."""
    word = first + index
    for axis in range(3):
        group[word + axis * GROUP] = ray.origin[axis]
        group[word + (3 + axis) * GROUP] = ray.inverse[axis]
        group[word + (6 + axis) * GROUP] = ray.far_inverse[axis]
        group[word + (9 + axis) * GROUP] = ray.shear[axis]
        group[word + (12 + axis) * GROUP] = wp.cast(ray.axes[axis], float)
        group[word + (15 + axis) * GROUP] = ray.direction[axis]


@wp.func
def group_ray(group: wp.array[float], first: int, index: int) -> PacketRay:
    """Return a ray of a group."""
    ray = PacketRay()
    word = first + index
    ray.origin = group_vector(group, word, GROUP)
    ray.inverse = group_vector(group, word + 3 * GROUP, GROUP)
    ray.far_inverse = group_vector(group, word + 6 * GROUP, GROUP)
    ray.shear = group_vector(group, word + 9 * GROUP, GROUP)
    ray.axes = wp.vec3i(
        wp.cast(group[word + 12 * GROUP], wp.int32),
        wp.cast(group[word + 13 * GROUP], wp.int32),
        wp.cast(group[word + 14 * GROUP], wp.int32),
    )
    ray.direction = group_vector(group, word + 15 * GROUP, GROUP)
    ray.octant = octant_of(ray.inverse)
    ray.skip = NO_TRIANGLE
    return ray


@wp.func
def copy_group_ray(group: wp.array[float], first: int, source: int, index: int):
    """Write a ray of a group over another one."""
    for row in range(wp.int32(GROUP_ROWS)):
        group[first + row * GROUP + index] = group[first + row * GROUP + source]


_LOAD = (
    r"""
    float* lines = (float*)group.data + first;
    float* ends_ = (float*)ends.data;
    for (int index = 0; index < 32; ++index) {
        const int ray = ((const int*)order.data)[start + (index < count ? index : 0)];
        const float* origin = (const float*)origins.data + 3 * (size_t)ray;
        const float* direction = (const float*)directions.data + 3 * (size_t)ray;
        for (int axis = 0; axis < 3; ++axis) {
            lines[32 * axis + index] = origin[axis];
            lines[480 + 32 * axis + index] = direction[axis];
        }
        // An end that is NaN is none, for no comparison may be disturbed by it.
        const float end = ((const float*)t_max.data)[t_max.shape[0] == 1 ? 0 : ray];
        ends_[index] = index < count && end >= 0.0f ? end : -1.0f;
    }
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int index = 0; index < 32; ++index) {
        float* line = lines + index;
        float d[3], magnitude[3];
        for (int axis = 0; axis < 3; ++axis) {
            d[axis] = line[480 + 32 * axis];
            magnitude[axis] = wp::abs(d[axis]);
            const float kept = wp::min(wp::max(magnitude[axis], MIN_DIRECTION), MAX_DIRECTION);
            line[96 + 32 * axis] = 1.0f / (d[axis] < 0.0f ? -kept : kept);
            line[192 + 32 * axis] = line[96 + 32 * axis] * SLAB_SCALE;
        }
        int z = magnitude[1] > magnitude[0] ? 1 : 0;
        z = magnitude[2] > magnitude[z] ? 2 : z;
        const int x = z == 2 ? 0 : z + 1, y = x == 2 ? 0 : x + 1;
        const float scale = 1.0f / d[z];
        line[288] = d[x] * scale;
        line[320] = d[y] * scale;
        line[352] = scale;
        ((int*)line)[384] = x;
        ((int*)line)[416] = y;
        ((int*)line)[448] = z;
    }
#else
"""
    + VECTOR_TYPES
    + r"""
#define WARP_RT_STORE(row, value) (*(floats_load*)(line + 32 * (row)) = (value))
#define WARP_RT_STORE_INTS(row, value) (*(ints_load*)(line + 32 * (row)) = (value))
    for (int block = 0; block < 32; block += 16) {
        float* line = lines + block;
        const floats d_x = WARP_RT_LOAD(line + 480), d_y = WARP_RT_LOAD(line + 512), d_z = WARP_RT_LOAD(line + 544);
        const floats m_x = d_x < 0.0f ? -d_x : d_x, m_y = d_y < 0.0f ? -d_y : d_y, m_z = d_z < 0.0f ? -d_z : d_z;
        for (int axis = 0; axis < 3; ++axis) {
            const floats d = axis == 0 ? d_x : axis == 1 ? d_y : d_z, m = axis == 0 ? m_x : axis == 1 ? m_y : m_z;
            const floats big = WARP_RT_MAX(m, (floats)MIN_DIRECTION), kept = WARP_RT_MIN(big, (floats)MAX_DIRECTION);
            const floats inverse = 1.0f / (d < 0.0f ? -kept : kept);
            WARP_RT_STORE(3 + axis, inverse);
            WARP_RT_STORE(6 + axis, inverse * SLAB_SCALE);
        }
        const ints is_y = m_y > m_x;
        const ints is_z = m_z > (is_y ? m_y : m_x);
        const floats along = is_z ? d_z : is_y ? d_y : d_x, scale = 1.0f / along;
        WARP_RT_STORE(9, (is_z ? d_x : is_y ? d_z : d_y) * scale);
        WARP_RT_STORE(10, (is_z ? d_y : is_y ? d_x : d_z) * scale);
        WARP_RT_STORE(11, scale);
        WARP_RT_STORE_INTS(12, is_z ? (ints)0 : is_y ? (ints)2 : (ints)1);
        WARP_RT_STORE_INTS(13, is_z ? (ints)1 : is_y ? (ints)0 : (ints)2);
        WARP_RT_STORE_INTS(14, is_z ? (ints)2 : is_y ? (ints)1 : (ints)0);
    }
}
#endif
"""
)
for _name, _value in (("MIN", MIN_DIRECTION), ("MAX", MAX_DIRECTION)):
    _LOAD = _LOAD.replace(f"{_name}_DIRECTION", f"{_value!r}f")
_LOAD = _LOAD.replace("SLAB_SCALE", f"{SLAB_SCALE!r}f")


@wp.func_native(_LOAD)
def load_group(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    order: wp.array[int],
    start: int,
    count: int,
    group: wp.array[float],
    first: int,
    ends: wp.array[float],
):
    """Write ``count`` rays of arrays, and copies of the first of them, as a group.

    Args:
        origins: Of all rays, contiguous.
        directions: Likewise.
        t_max: One value for all rays, or one a ray.
        order: Which rays: from ``start`` on.
        start: Row of ``order``.
        count: 1 to GROUP.
        group: Output.
        first: Word at which the group begins.
        ends: Output, t_max of each ray, shape [GROUP]; -1 for the copies, and where t_max is NaN or negative.
    """
    ...


@wp.func
def load_group_plain(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    order: wp.array[int],
    start: int,
    count: int,
    group: wp.array[float],
    first: int,
    ends: wp.array[float],
):
    """Write what ``load_group`` writes, in plain Warp."""
    for index in range(wp.int32(GROUP)):
        ray = order[start + (index if index < count else 0)]
        set_group_ray(group, first, index, make_packet_ray(origins[ray], directions[ray]))
        end = t_max[wp.min(ray, t_max.shape[0] - 1)]
        ends[index] = end if index < count and end >= 0.0 else -1.0


# --- triangles

_MEET_TRIANGLES = (
    r"""
    const float* lines = (const float*)group.data + first;
    float* ends_ = (float*)ends.data;
    uint32_t hits = 0;
    for (uint32_t rest = rays; rest != 0; rest &= rest - 1) {
#if defined(__CUDA_ARCH__)
        const int index = __ffs(rest) - 1;
#else
        const int index = __builtin_ctz(rest);
#endif
        const float* line = lines + index;
        const struct { float origin[3], shear[3]; int axes[3], skip; } ray = {
            {line[0], line[32], line[64]}, {line[288], line[320], line[352]},
            {((const int*)line)[384], ((const int*)line)[416], ((const int*)line)[448]}, NO_TRIANGLE};
        float t_max = ends_[index];
"""
    + LEAF_ROWS
    + r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
        for (int lane = 0; lane < 16; ++lane) {
"""
    + ONE_TRIANGLE
    + r"""
            t_max = t;
            const float inverse = 1.0f / determinant;
            ends_[index] = t;
            ((float*)u.data)[index] = edge_v * inverse;
            ((float*)v.data)[index] = edge_w * inverse;
            ((int*)words.data)[index] = leaf * LEAF_FLOATS + LEAF_IDS + lane;
            hits |= (uint32_t)1 << index;
        }
#else
"""
    + ALL_TRIANGLES.replace("return WARP_RT_NONE;", "continue;")
    + r"""
        if (mask == 0)
            continue;
        int nearest = __builtin_ctz(mask);
        for (mask &= mask - 1; mask != 0; mask &= mask - 1)
            if (t[__builtin_ctz(mask)] < t[nearest])
                nearest = __builtin_ctz(mask);
        const float inverse = 1.0f / determinant[nearest];
        ends_[index] = t[nearest];
        ((float*)u.data)[index] = edge_v[nearest] * inverse;
        ((float*)v.data)[index] = edge_w[nearest] * inverse;
        ((int*)words.data)[index] = leaf * LEAF_FLOATS + LEAF_IDS + nearest;
        hits |= (uint32_t)1 << index;
        }
#endif
    }
    return hits;
"""
)
for _name, _value in (("NO_TRIANGLE", NO_TRIANGLE), ("LEAF_FLOATS", LEAF_FLOATS), ("LEAF_IDS", LEAF_IDS)):
    _MEET_TRIANGLES = _MEET_TRIANGLES.replace(_name, str(_value))


@wp.func_native(_MEET_TRIANGLES)
def meet_triangles(
    leaves: wp.array[float],
    leaf: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    ends: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    words: wp.array[int],
) -> wp.uint32:
    """Return which rays of a group meet a triangle of a leaf packet before their ends, and write where.

    Writes t to ``ends``, u, v, and the word of the leaves that holds the triangle's index. Each ray by itself against
    all triangles, as ``intersect_triangles`` does it.
    """
    ...


@wp.func
def meet_triangles_plain(
    leaves: wp.array[float],
    leaf: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    ends: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    words: wp.array[int],
) -> wp.uint32:
    """Return and write what ``meet_triangles`` does, in plain Warp."""
    tuv = wp.zeros(shape=(4,), dtype=float)
    hits = wp.uint32(0)
    for index in range(wp.int32(GROUP)):
        bit = wp.uint32(1) << wp.uint32(index)
        if (rays & bit) != wp.uint32(0):
            ray = group_ray(group, first, index)
            lane = intersect_triangles_plain(leaves, leaf, WATERTIGHT, ray, ends[index], tuv)
            if lane >= 0:
                ends[index] = tuv[0]
                u[index] = tuv[1]
                v[index] = tuv[2]
                words[index] = leaf * LEAF_FLOATS + LEAF_IDS + lane
                hits = hits | bit
    return hits
