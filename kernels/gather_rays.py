# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays of arrays, gathered into a group."""

import warp as wp

from .constants import (
    AXES_ROW,
    DIRECTION_ROW,
    FAR_ROW,
    GROUP,
    INVERSE_ROW,
    MAX_DIRECTION,
    MIN_DIRECTION,
    SHEAR_ROW,
    SLAB_SCALE,
)
from .intersect_packet import VECTOR_TYPES, make_packet_ray
from .native import spell_out
from .ray_group import set_group_ray

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


_LOAD = (
    r"""
    float* lines = (float*)group.data + first;
    float* ends_ = (float*)ends.data;
    for (int index = 0; index < GROUP; ++index) {
        const int ray = ((const int*)order.data)[start + (index < count ? index : 0)];
        const float* origin = (const float*)origins.data + 3 * (size_t)ray;
        const float* direction = (const float*)directions.data + 3 * (size_t)ray;
        for (int axis = 0; axis < 3; ++axis) {
            lines[axis * GROUP + index] = origin[axis];
            lines[(DIRECTION_ROW + axis) * GROUP + index] = direction[axis];
        }
        // An end that is NaN is none, for no comparison may be disturbed by it.
        const float end = ((const float*)t_max.data)[t_max.shape[0] == 1 ? 0 : ray];
        ends_[index] = index < count && end >= 0.0f ? end : -1.0f;
    }
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
_LOAD = spell_out(
    _LOAD,
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
