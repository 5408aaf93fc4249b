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
    GROUP_ROWS,
    INVERSE_ROW,
    NO_TRIANGLE,
    SHEAR_ROW,
)
from .intersect_packet import PacketRay, octant_of
from .native import spell_out

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


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


@wp.func
def copy_group_ray(group: wp.array[float], first: int, source: int, index: int):
    """Write a ray of a group over another one."""
    for row in range(wp.int32(GROUP_ROWS)):
        group[first + row * GROUP + index] = group[first + row * GROUP + source]


_BOUNDS = r"""
    const float* rays = (const float*)group.data + first;
    float* bounds = (float*)group.data + first + GROUP_BOUNDS;
    for (int axis = 0; axis < 3; ++axis) {
        const float *origins = rays + axis * GROUP, *inverses = rays + (INVERSE_ROW + axis) * GROUP;
        float extremes[4];
        for (int row = 0; row < 2; ++row) {
            const float* values = row == 0 ? origins : inverses;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
            float low = values[0], high = values[0];
            for (int ray = 1; ray < GROUP; ++ray) {
                low = wp::min(low, values[ray]);
                high = wp::max(high, values[ray]);
            }
#else
            typedef float float8 __attribute__((ext_vector_type(8)));
            typedef float float8_load __attribute__((ext_vector_type(8), aligned(4)));
            float8 lows = *(const float8_load*)values, highs = lows;
            for (int ray = 8; ray < GROUP; ray += 8) {
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


@wp.func_native(spell_out(_BOUNDS, GROUP=GROUP, GROUP_BOUNDS=GROUP_BOUNDS, INVERSE_ROW=INVERSE_ROW))
def bound_group(group: wp.array[float], first: int):
    """Write the bounds of a group's rays behind them."""
    ...


@wp.func
def bound_group_plain(group: wp.array[float], first: int):
    """Write what ``bound_group`` writes, in plain Warp."""
    for axis in range(3):
        low = float(group[first + axis * GROUP])
        high = float(low)
        least = float(group[first + (INVERSE_ROW + axis) * GROUP])
        greatest = float(least)
        for ray in range(wp.int32(GROUP)):
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
