# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays of arrays, gathered into a group."""

import warp as wp

from .constants import DIRECTION_ROW, GROUP
from .intersect_packet import COLUMNS, VECTOR_TYPES, make_packet_ray
from .native import spell_out
from .ray_group import PREPARE_RAYS, RUN_OF_RAYS, set_group_ray
from .vector import relative

_LOAD = (
    r"""
    float* lines = (float*)group.data + first;
    float* ends_ = (float*)ends.data;
    const int* rays = (const int*)order.data + start;
    bool is_run = false;
#if defined(__clang__) && !defined(__CUDA_ARCH__)
"""
    + VECTOR_TYPES
    + COLUMNS
    + RUN_OF_RAYS
    + r"""
    for (int block = 0; is_run && block < GROUP; block += 16) {
        const size_t ray = (size_t)rays[0] + block;
        float *o = lines + block, *d = o + DIRECTION_ROW * GROUP;
        WARP_RT_COLUMNS((const float*)origins.data + 3 * ray, o_x, o_y, o_z);
        WARP_RT_COLUMNS((const float*)directions.data + 3 * ray, d_x, d_y, d_z);
        *(floats_load*)o = o_x, *(floats_load*)(o + GROUP) = o_y, *(floats_load*)(o + 2 * GROUP) = o_z;
        *(floats_load*)d = d_x, *(floats_load*)(d + GROUP) = d_y, *(floats_load*)(d + 2 * GROUP) = d_z;
        const float* t = (const float*)t_max.data;
        const floats end = t_max.shape[0] == 1 ? (floats)t[0] : WARP_RT_LOAD(t + ray);
        *(floats_load*)(ends_ + block) = end >= 0.0f ? end : (floats)-1.0f;
    }
}
#endif
    for (int index = 0; index < GROUP && !is_run; ++index) {
        const int ray = rays[index < count ? index : 0];
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
    for (int axis = 0; axis < 3; ++axis) {
        if (base[axis] == 0.0)
            continue;
        for (int index = 0; index < GROUP; ++index)
            lines[axis * GROUP + index] = (float)((double)lines[axis * GROUP + index] - base[axis]);
    }
"""
    + PREPARE_RAYS
)
_LOAD = spell_out(_LOAD, GROUP=GROUP, DIRECTION_ROW=DIRECTION_ROW)


@wp.func_native(_LOAD)
def load_group(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    base: wp.vec3d,
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
        base: Point that the group's coordinates are relative to, in those of the arrays.
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
    base: wp.vec3d,
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
        set_group_ray(group, first, index, make_packet_ray(relative(origins[ray], base), directions[ray]))
        end = t_max[wp.min(ray, t_max.shape[0] - 1)]
        ends[index] = end if index < count and end >= 0.0 else -1.0
