# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Waiting rays of a tile, listed so that those which have most in common make a group, and written as one."""

import warp as wp

from .constants import DIRECTION_ROW, GROUP, RAY_LISTS
from .native import spell_out
from .ray_group import PREPARE_RAYS
from .structs import RayTask, ShadowRay

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_LIST = r"""
    int* keys_ = (int*)keys.data;
    int places[8 * RAY_LISTS + 1] = {};
    for (int i = 0; i < count; ++i) {
        const auto& ray = rays.data[first + i];
        const auto &o = ray.origin, &d = ray.direction;
        const float total = o[0] + o[1] + o[2] + d[0] + d[1] + d[2];
        const int octant = (d[0] < 0.0f) + 2 * (d[1] < 0.0f) + 4 * (d[2] < 0.0f);
        const int list = (int)((unsigned int)(LIST) % RAY_LISTS);
        keys_[i] = total - total == 0.0f && ray.reach >= 0.0f ? RAY_LISTS * octant + list : 8 * RAY_LISTS;
        ++places[keys_[i]];
    }
    int place = 0;
    for (int key = 0; key <= 8 * RAY_LISTS; ++key) {
        const int size = places[key];
        places[key] = place;
        place += size;
        if (key % RAY_LISTS == RAY_LISTS - 1)
            ((int*)ends.data)[key / RAY_LISTS] = place;
    }
    ((int*)ends.data)[8] = place;
    for (int i = 0; i < count; ++i)
        ((int*)order.data)[places[keys_[i]]++] = first + i;
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
