# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A group of rays: where its words lie, its bounds.

32 rays whose directions lie in one octant: GROUP_FLOATS words, in rows of 32. Rows 0 to 2 are the origins' x, y and z,
three from INVERSE_ROW on the inverse directions, from FAR_ROW on those for far planes, from SHEAR_ROW on the shear
factors, from AXES_ROW on the axes of the shear as the bits of int32, from DIRECTION_ROW on the directions. Four vectors
bound the rays: the corner of the origins' box that is nearest to boxes, the one that is farthest from them, the least
and the greatest inverse direction.
"""

import warp as wp

from .constants import (
    AXES_ROW,
    DIRECTION_ROW,
    FAR_ROW,
    GROUP,
    GROUP_BOUNDS,
    INVERSE_ROW,
    MAX_DIRECTION,
    MIN_DIRECTION,
    NO_TRIANGLE,
    SHEAR_ROW,
    SLAB_SCALE,
)
from .intersect_packet import VECTOR_TYPES, PacketRay, octant_of
from .native import spell_out


@wp.func
def group_vector(group: wp.array[float], first: int, step: int) -> wp.vec3:
    """Return three words of a group's rays, ``step`` apart."""
    return wp.vec3(group[first], group[first + step], group[first + 2 * step])


@wp.func
def set_group_ray(group: wp.array[float], first: int, index: int, ray: PacketRay):
    """Write a ray of a group."""
    word = first + index
    for axis in range(3):
        group[word + axis * GROUP] = ray.origin[axis]
        group[word + (INVERSE_ROW + axis) * GROUP] = ray.inverse[axis]
        group[word + (FAR_ROW + axis) * GROUP] = ray.far_inverse[axis]
        group[word + (SHEAR_ROW + axis) * GROUP] = ray.shear[axis]
        group[word + (AXES_ROW + axis) * GROUP] = wp.cast(ray.axes[axis], float)
        group[word + (DIRECTION_ROW + axis) * GROUP] = ray.direction[axis]


@wp.func
def group_ray(group: wp.array[float], first: int, index: int) -> PacketRay:
    """Return a ray of a group."""
    ray = PacketRay()
    word = first + index
    ray.origin = group_vector(group, word, GROUP)
    ray.inverse = group_vector(group, word + INVERSE_ROW * GROUP, GROUP)
    ray.far_inverse = group_vector(group, word + FAR_ROW * GROUP, GROUP)
    ray.shear = group_vector(group, word + SHEAR_ROW * GROUP, GROUP)
    ray.axes = wp.vec3i(
        wp.cast(group[word + AXES_ROW * GROUP], wp.int32),
        wp.cast(group[word + (AXES_ROW + 1) * GROUP], wp.int32),
        wp.cast(group[word + (AXES_ROW + 2) * GROUP], wp.int32),
    )
    ray.direction = group_vector(group, word + DIRECTION_ROW * GROUP, GROUP)
    ray.octant = octant_of(ray.inverse)
    ray.skip = NO_TRIANGLE
    return ray


RUN_OF_RAYS = spell_out(
    r"""
    if (count == GROUP) {
        const ints steps = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
        ints is_next = (ints)-1;
        for (int block = 0; block < GROUP; block += 16)
            is_next &= WARP_RT_LOAD_INTS(rays + block) == rays[0] + block + steps;
        is_run = WARP_RT_MASK(is_next) == 0xffff;
    }
""",
    GROUP=GROUP,
)
"""For native functions that have a list of ``count`` ``rays``, after VECTOR_TYPES: sets ``is_run`` where they are GROUP
rays that follow each other in memory."""


_PREPARE = (
    r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int index = 0; index < GROUP; ++index) {
        float* line = lines + index;
        float d[3], magnitude[3];
        for (int axis = 0; axis < 3; ++axis) {
            d[axis] = line[(DIRECTION_ROW + axis) * GROUP];
            magnitude[axis] = wp::abs(d[axis]);
            const float kept = wp::min(wp::max(magnitude[axis], MIN_DIRECTION), MAX_DIRECTION);
            line[(INVERSE_ROW + axis) * GROUP] = 1.0f / (d[axis] < 0.0f ? -kept : kept);
            line[(FAR_ROW + axis) * GROUP] = line[(INVERSE_ROW + axis) * GROUP] * SLAB_SCALE;
        }
        int z = magnitude[1] > magnitude[0] ? 1 : 0;
        z = magnitude[2] > magnitude[z] ? 2 : z;
        const int x = z == 2 ? 0 : z + 1, y = x == 2 ? 0 : x + 1;
        const float scale = 1.0f / d[z];
        line[SHEAR_ROW * GROUP] = d[x] * scale;
        line[(SHEAR_ROW + 1) * GROUP] = d[y] * scale;
        line[(SHEAR_ROW + 2) * GROUP] = scale;
        ((int*)line)[AXES_ROW * GROUP] = x;
        ((int*)line)[(AXES_ROW + 1) * GROUP] = y;
        ((int*)line)[(AXES_ROW + 2) * GROUP] = z;
    }
#else
"""
    + VECTOR_TYPES
    + r"""
#define WARP_RT_STORE(row, value) (*(floats_load*)(line + GROUP * (row)) = (value))
#define WARP_RT_STORE_INTS(row, value) (*(ints_load*)(line + GROUP * (row)) = (value))
    for (int block = 0; block < GROUP; block += 16) {
        float* line = lines + block;
        const floats d_x = WARP_RT_LOAD(line + DIRECTION_ROW * GROUP);
        const floats d_y = WARP_RT_LOAD(line + (DIRECTION_ROW + 1) * GROUP);
        const floats d_z = WARP_RT_LOAD(line + (DIRECTION_ROW + 2) * GROUP);
        const floats m_x = d_x < 0.0f ? -d_x : d_x, m_y = d_y < 0.0f ? -d_y : d_y, m_z = d_z < 0.0f ? -d_z : d_z;
        for (int axis = 0; axis < 3; ++axis) {
            const floats d = axis == 0 ? d_x : axis == 1 ? d_y : d_z, m = axis == 0 ? m_x : axis == 1 ? m_y : m_z;
            const floats big = WARP_RT_MAX(m, (floats)MIN_DIRECTION), kept = WARP_RT_MIN(big, (floats)MAX_DIRECTION);
            const floats inverse = 1.0f / (d < 0.0f ? -kept : kept);
            WARP_RT_STORE(INVERSE_ROW + axis, inverse);
            WARP_RT_STORE(FAR_ROW + axis, inverse * SLAB_SCALE);
        }
        const ints is_y = m_y > m_x;
        const ints is_z = m_z > (is_y ? m_y : m_x);
        const floats along = is_z ? d_z : is_y ? d_y : d_x, scale = 1.0f / along;
        WARP_RT_STORE(SHEAR_ROW, (is_z ? d_x : is_y ? d_z : d_y) * scale);
        WARP_RT_STORE(SHEAR_ROW + 1, (is_z ? d_y : is_y ? d_x : d_z) * scale);
        WARP_RT_STORE(SHEAR_ROW + 2, scale);
        WARP_RT_STORE_INTS(AXES_ROW, is_z ? (ints)0 : is_y ? (ints)2 : (ints)1);
        WARP_RT_STORE_INTS(AXES_ROW + 1, is_z ? (ints)1 : is_y ? (ints)0 : (ints)2);
        WARP_RT_STORE_INTS(AXES_ROW + 2, is_z ? (ints)2 : is_y ? (ints)1 : (ints)0);
    }
}
#endif
"""
)
PREPARE_RAYS = spell_out(
    _PREPARE,
    GROUP=GROUP,
    INVERSE_ROW=INVERSE_ROW,
    FAR_ROW=FAR_ROW,
    SHEAR_ROW=SHEAR_ROW,
    AXES_ROW=AXES_ROW,
    DIRECTION_ROW=DIRECTION_ROW,
    MIN_DIRECTION=MIN_DIRECTION,
    MAX_DIRECTION=MAX_DIRECTION,
    SLAB_SCALE=SLAB_SCALE,
)
"""For native functions that have written the origins and directions of all rays to a group that begins at ``lines``:
what their tests need of them, as ``make_packet_ray`` computes it."""


FOLD = r"""
    const auto fold = [](const floats& a, const floats& b) {
        const floats even = __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
        const floats odd = __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
        return (floats)WARP_RT_MAX(even, odd);
    };
"""
"""After VECTOR_TYPES: the greater of each two neighbours in two vectors. Sixteen vectors folded pair by pair, four
times, leave one: the greatest number of each, in their order."""


_BOUNDS = (
    r"""
    const float* lines = (const float*)group.data + first;
    float* bounds = (float*)group.data + first + GROUP_BOUNDS;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int axis = 0; axis < 3; ++axis) {
        float low = INFINITY, high = -INFINITY, least = INFINITY, greatest = -INFINITY;
        for (int ray = 0; ray < GROUP; ++ray)
            if (rays >> ray & 1) {
                const float origin = lines[axis * GROUP + ray], inverse = lines[(INVERSE_ROW + axis) * GROUP + ray];
                low = wp::min(low, origin);
                high = wp::max(high, origin);
                least = wp::min(least, inverse);
                greatest = wp::max(greatest, inverse);
            }
        const bool is_negative = least < 0.0f;
        bounds[axis] = is_negative ? low : high;
        bounds[3 + axis] = is_negative ? high : low;
        bounds[6 + axis] = least;
        bounds[9 + axis] = greatest;
    }
#else
"""
    + VECTOR_TYPES
    + FOLD
    + r"""
    const ints bits = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
    floats extremes[12];
    for (int axis = 0; axis < 3; ++axis) {
        floats low = (floats)INFINITY, least = low, high = -low, greatest = high;
        for (int block = 0; block < GROUP; block += 16) {
            const ints is_in = ((int)(rays >> block) & bits) != 0;
            const floats origin = WARP_RT_LOAD(lines + axis * GROUP + block);
            const floats inverse = WARP_RT_LOAD(lines + (INVERSE_ROW + axis) * GROUP + block);
            low = (is_in & (origin < low)) ? origin : low;
            high = (is_in & (origin > high)) ? origin : high;
            least = (is_in & (inverse < least)) ? inverse : least;
            greatest = (is_in & (inverse > greatest)) ? inverse : greatest;
        }
        extremes[4 * axis] = -low, extremes[4 * axis + 1] = high;
        extremes[4 * axis + 2] = -least, extremes[4 * axis + 3] = greatest;
    }
    floats most[3];
    for (int axis = 0; axis < 3; ++axis) {
        const floats* of_axis = extremes + 4 * axis;
        most[axis] = fold(fold(of_axis[0], of_axis[1]), fold(of_axis[2], of_axis[3]));
    }
    const floats first_two = fold(most[0], most[1]), last = fold(most[2], most[2]);
    const floats all = fold(first_two, last);
    for (int axis = 0; axis < 3; ++axis) {
        const float low = -all[4 * axis], high = all[4 * axis + 1], least = -all[4 * axis + 2];
        bounds[axis] = least < 0.0f ? low : high;
        bounds[3 + axis] = least < 0.0f ? high : low;
        bounds[6 + axis] = least;
        bounds[9 + axis] = all[4 * axis + 3];
    }
}
#endif
"""
)


@wp.func_native(spell_out(_BOUNDS, GROUP=GROUP, GROUP_BOUNDS=GROUP_BOUNDS, INVERSE_ROW=INVERSE_ROW))
def bound_group(group: wp.array[float], first: int, rays: wp.uint32):
    """Write the bounds of some of a group's rays, at least one, behind them."""
    ...


@wp.func
def bound_group_plain(group: wp.array[float], first: int, rays: wp.uint32):
    """Write what ``bound_group`` writes, in plain Warp."""
    for axis in range(3):
        low = float(wp.inf)
        high = float(-wp.inf)
        least = float(wp.inf)
        greatest = float(-wp.inf)
        for ray in range(wp.int32(GROUP)):
            if (rays & (wp.uint32(1) << wp.uint32(ray))) != wp.uint32(0):
                low = wp.min(low, group[first + axis * GROUP + ray])
                high = wp.max(high, group[first + axis * GROUP + ray])
                least = wp.min(least, group[first + (INVERSE_ROW + axis) * GROUP + ray])
                greatest = wp.max(greatest, group[first + (INVERSE_ROW + axis) * GROUP + ray])
        bounds = first + GROUP_BOUNDS + axis
        group[bounds] = low if least < 0.0 else high
        group[bounds + 3] = high if least < 0.0 else low
        group[bounds + 6] = least
        group[bounds + 9] = greatest


_GREATEST = r"""
    const float* values = (const float*)ends.data;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    float greatest = values[0];
    for (int ray = 1; ray < GROUP; ++ray)
        greatest = wp::max(greatest, values[ray]);
    return greatest;
#else
    typedef float float8 __attribute__((ext_vector_type(8)));
    typedef float float8_load __attribute__((ext_vector_type(8), aligned(4)));
    float8 greatest = *(const float8_load*)values;
    for (int ray = 8; ray < GROUP; ray += 8) {
        const float8 next = *(const float8_load*)(values + ray);
        greatest = greatest > next ? greatest : next;
    }
    return __builtin_reduce_max(greatest);
#endif
"""


@wp.func_native(spell_out(_GREATEST, GROUP=GROUP))
def greatest_end(ends: wp.array[float]) -> float:
    """Return the greatest of GROUP numbers."""
    ...


_REACHING = (
    r"""
    const float* values = (const float*)ends.data;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    uint32_t reaching = 0;
    for (int ray = 0; ray < GROUP; ++ray)
        reaching |= (uint32_t)(values[ray] >= t) << ray;
    return rays & reaching;
#else
"""
    + VECTOR_TYPES
    + r"""
    uint32_t reaching = 0;
    for (int block = 0; block < GROUP; block += 16)
        reaching |= (uint32_t)WARP_RT_MASK(WARP_RT_LOAD(values + block) >= t) << block;
    return rays & reaching;
}
#endif
"""
)


@wp.func_native(spell_out(_REACHING, GROUP=GROUP))
def rays_reaching(ends: wp.array[float], t: float, rays: wp.uint32) -> wp.uint32:
    """Return those of some rays of a group that have not ended before ``t``."""
    ...


_OCTANT_OF_FIRST = (
    r"""
    const float* directions = (const float*)group.data + first + DIRECTION_ROW * GROUP;
    const uint32_t first_bit = rays & (0u - rays);
    uint32_t alike = rays;
    for (int axis = 0; axis < 3; ++axis) {
        const float* values = directions + axis * GROUP;
        uint32_t negative = 0;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
        for (int ray = 0; ray < GROUP; ++ray)
            negative |= (uint32_t)(values[ray] < 0.0f) << ray;
#else
"""
    + VECTOR_TYPES
    + r"""
        for (int block = 0; block < GROUP; block += 16)
            negative |= (uint32_t)WARP_RT_MASK(WARP_RT_LOAD(values + block) < 0.0f) << block;
}
#endif
        alike &= negative & first_bit ? negative : ~negative;
    }
    return alike;
"""
)


@wp.func_native(spell_out(_OCTANT_OF_FIRST, GROUP=GROUP, DIRECTION_ROW=DIRECTION_ROW))
def rays_of_first_octant(group: wp.array[float], first: int, rays: wp.uint32) -> wp.uint32:
    """Return those of some rays of a group, at least one, whose directions lie in the octant of the first one's."""
    ...
