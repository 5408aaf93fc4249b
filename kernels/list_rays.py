# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Waiting rays of a tile, listed so that those which have most in common make a group, and written as one."""

import warp as wp

from .constants import DIRECTION_ROW, GROUP, RAY_LISTS
from .native import spell_out
from .ray_group import PREPARE_RAYS
from .ray_structs import RayTask, ShadowRay

_LIST = r"""
    enum { HALVES = 2, KEYS = 8 * RAY_LISTS + 1 };
    int* keys_ = (int*)keys.data;
    int places[HALVES][KEYS] = {};
    const int half = (count + 1) / 2;
    const auto key_of = [&](int i) {
        const auto& ray = rays.data[first + i];
        const auto &o = ray.origin, &d = ray.direction;
        const float total = o[0] + o[1] + o[2] + d[0] + d[1] + d[2];
        const int octant = (d[0] < 0.0f) + 2 * (d[1] < 0.0f) + 4 * (d[2] < 0.0f);
        const int list = (int)((unsigned int)(LIST) % RAY_LISTS);
        return total - total == 0.0f && ray.reach >= 0.0f ? RAY_LISTS * octant + list : 8 * RAY_LISTS;
    };
    // Neighbours go on the same list, each waiting for its size. So each half of the rays is listed by itself.
    for (int i = 0; i < half; ++i) {
        keys_[i] = key_of(i);
        ++places[0][keys_[i]];
        if (half + i < count) {
            keys_[half + i] = key_of(half + i);
            ++places[1][keys_[half + i]];
        }
    }
    int place = 0;
    for (int octant = 0; octant <= 8; ++octant) {
        const int begin = RAY_LISTS * octant, end = octant == 8 ? KEYS : begin + RAY_LISTS;
        uint32_t used = 0;
        for (int key = begin; key < end; ++key)
            used |= (uint32_t)((places[0][key] | places[1][key]) != 0) << (key - begin);
        for (; used != 0; used &= used - 1) {
#if defined(__CUDA_ARCH__)
            const int key = begin + __ffs(used) - 1;
#else
            const int key = begin + __builtin_ctz(used);
#endif
            for (int part = 0; part < HALVES; ++part) {
                const int size = places[part][key];
                places[part][key] = place;
                place += size;
            }
        }
        ((int*)ends.data)[octant] = place;
    }
    for (int i = 0; i < half; ++i) {
        ((int*)order.data)[places[0][keys_[i]]++] = first + i;
        if (half + i < count)
            ((int*)order.data)[places[1][keys_[half + i]]++] = first + half + i;
    }
"""
_LIST = spell_out(_LIST, RAY_LISTS=RAY_LISTS)


@wp.func_native(_LIST.replace("LIST", "ray.from_instance"))
def list_tasks(
    rays: wp.array[RayTask],
    first: int,
    count: int,
    keys: wp.array[int],
    order: wp.array[int],
    ends: wp.array[int],
):
    """List ``count`` rays from ``first`` on by octant, and within it by what sent them, in their order.

    Args:
        rays: Where they wait.
        first: First of them.
        count: How many.
        keys: Scratch, one a ray.
        order: Output, the rays.
        ends: Output, position behind each octant's rays; the ninth list is of those that meet nothing in any case.
    """
    ...


@wp.func_native(_LIST.replace("LIST", "(5u * (unsigned int)ray.from_instance + (unsigned int)ray.light)"))
def list_shadow_rays(
    rays: wp.array[ShadowRay],
    first: int,
    count: int,
    keys: wp.array[int],
    order: wp.array[int],
    ends: wp.array[int],
):
    """Do for shadow rays what ``list_tasks`` does."""
    ...


_GATHER = (
    r"""
    float* lines = (float*)group.data;
    float* ends_ = (float*)ends.data;
    for (int index = 0; index < GROUP; ++index) {
        const auto& ray = rays.data[((const int*)order.data)[start + (index < count ? index : 0)]];
        for (int axis = 0; axis < 3; ++axis) {
            lines[axis * GROUP + index] = ray.origin[axis];
            lines[(DIRECTION_ROW + axis) * GROUP + index] = ray.direction[axis];
        }
        ends_[index] = index < count ? ray.reach : -1.0f;
        ((int*)senders.data)[index] = ray.from_instance;
        ((int*)triangles.data)[index] = ray.from_triangle;
    }
"""
    + PREPARE_RAYS
)
_GATHER = spell_out(_GATHER, GROUP=GROUP, DIRECTION_ROW=DIRECTION_ROW)


@wp.func_native(_GATHER)
def gather_tasks(
    rays: wp.array[RayTask],
    order: wp.array[int],
    start: int,
    count: int,
    group: wp.array[float],
    ends: wp.array[float],
    senders: wp.array[int],
    triangles: wp.array[int],
):
    """Write ``count`` rays, listed in ``order`` from ``start`` on, and copies of the first of them, as a group.

    Args:
        rays: Where they wait.
        order: As ``list_tasks`` writes it.
        start: Position of the first.
        count: 1 to GROUP.
        group: Output; so are the next three, shape [GROUP].
        ends: Reach of each ray; -1 for the copies.
        senders: Instance that each starts on.
        triangles: Triangle of it.
    """
    ...


@wp.func_native(_GATHER)
def gather_shadow_rays(
    rays: wp.array[ShadowRay],
    order: wp.array[int],
    start: int,
    count: int,
    group: wp.array[float],
    ends: wp.array[float],
    senders: wp.array[int],
    triangles: wp.array[int],
):
    """Do for shadow rays what ``gather_tasks`` does."""
    ...
