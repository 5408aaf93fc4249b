# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A group of rays taken into the space of an instance, all of them at once."""

import warp as wp

from .bvh_structs import InstanceRecord
from .bvh_traverse import is_ray_finite, transform_ray
from .constants import DIRECTION_ROW, GROUP, GROUP_FLOATS
from .intersect_packet import VECTOR_TYPES
from .native import spell_out
from .ray_group import PREPARE_RAYS, group_ray, set_group_ray

# Sums begin with 0 as those of wp.dot do, so that zeros have the same signs; totals are those of is_ray_finite.
_TRANSFORM = (
    r"""
    const float* from = (const float*)group.data;
    float* lines = (float*)group.data + GROUP_FLOATS;
    const auto& at = instances.data[record];
    uint32_t finite = 0;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int ray = 0; ray < GROUP; ++ray) {
        float total = 0.0f;
        for (int row = 0; row < 6; ++row) {
            const int axis = row % 3, out = row < 3 ? axis : DIRECTION_ROW + axis;
            const float* in = from + (row < 3 ? 0 : DIRECTION_ROW) * GROUP + ray;
            const auto& m = axis == 0 ? at.row_x : axis == 1 ? at.row_y : at.row_z;
            const float sum = ((0.0f + m[0] * in[0]) + m[1] * in[GROUP]) + m[2] * in[2 * GROUP];
            const float value = sum + m[3] * (row < 3 ? 1.0f : 0.0f);
            lines[out * GROUP + ray] = value;
            total += value;
        }
        finite |= (uint32_t)(total - total == 0.0f) << ray;
    }
#else
"""
    + VECTOR_TYPES
    + r"""
    for (int block = 0; block < GROUP; block += 16) {
        floats total = (floats)0.0f;
        for (int row = 0; row < 6; ++row) {
            const int axis = row % 3, out = row < 3 ? axis : DIRECTION_ROW + axis;
            const float* in = from + (row < 3 ? 0 : DIRECTION_ROW) * GROUP + block;
            const auto& m = axis == 0 ? at.row_x : axis == 1 ? at.row_y : at.row_z;
            const floats sum_x = 0.0f + m[0] * WARP_RT_LOAD(in), sum_y = sum_x + m[1] * WARP_RT_LOAD(in + GROUP);
            const floats sum = sum_y + m[2] * WARP_RT_LOAD(in + 2 * GROUP);
            const floats value = sum + m[3] * (row < 3 ? 1.0f : 0.0f);
            *(floats_load*)(lines + out * GROUP + block) = value;
            total += value;
        }
        finite |= (uint32_t)WARP_RT_MASK(total - total == 0.0f) << block;
    }
}
#endif
"""
    + PREPARE_RAYS
    + r"""
    return rays & finite;
"""
)


@wp.func_native(spell_out(_TRANSFORM, GROUP=GROUP, GROUP_FLOATS=GROUP_FLOATS, DIRECTION_ROW=DIRECTION_ROW))
def transform_group(
    instances: wp.array[InstanceRecord], record: int, group: wp.array[float], rays: wp.uint32
) -> wp.uint32:
    """Write all rays of the group at word 0 to the one at GROUP_FLOATS, in the space of an instance's mesh.

    Each as ``transform_ray`` does it. Returns those of ``rays`` that are finite there.

    Args:
        instances: Instance records.
        record: Which one.
        group: Two groups; the first one's bounds are not read, the other one's not written.
        rays: Rays of the group.
    """
    ...


@wp.func
def transform_group_plain(
    instances: wp.array[InstanceRecord], record: int, group: wp.array[float], rays: wp.uint32
) -> wp.uint32:
    """Return and write what ``transform_group`` does, in plain Warp."""
    finite = wp.uint32(0)
    for index in range(wp.int32(GROUP)):
        ray = transform_ray(instances[record], group_ray(group, 0, index))
        set_group_ray(group, GROUP_FLOATS, index, ray)
        if is_ray_finite(ray.origin, ray.direction):
            finite = finite | (wp.uint32(1) << wp.uint32(index))
    return rays & finite
