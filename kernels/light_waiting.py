# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""I_local of the surfaces of a group that wait for their light: it comes light by light, to sixteen at a time."""

import warp as wp

from .bvh_structs import AccelData
from .constants import GROUP
from .features import Features, PlainScene
from .frame_structs import FrameData
from .group_structs import RayGroup
from .group_surfaces import INSTANCE_ROW, POSITION_ROW, TRIANGLE_ROW
from .lit_surfaces import (
    DISTANCE_ROW,
    NORMAL_ROW,
    ORIGIN_ROW,
    SHADOW_ROW,
    TERM_ROW,
    is_point_or_direction,
    light_surfaces,
    set_arriving,
)
from .number_rows import row_int, row_vector
from .per_type import per_type
from .ray_counts import count_shadow
from .ray_set import count_rays, drop_first, first_ray
from .ray_structs import ShadowRay
from .scene_structs import SceneData
from .shadow_queue import settle
from .tile_structs import ShadowQueue
from .whole_light import whole_light


@per_type
def light_waiting(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    group: wp.ref[RayGroup],
    order: wp.array[int],
    start: int,
    surfaces: wp.array[float],
    shadows: wp.ref[ShadowQueue],
    counts: wp.array[wp.int64],
    features: Features,
):
    """Do nothing: no surface waits for its light."""
    pass


@wp.func
def light_waiting(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    group: wp.ref[RayGroup],
    order: wp.array[int],
    start: int,
    surfaces: wp.array[float],
    shadows: wp.ref[ShadowQueue],
    counts: wp.array[wp.int64],
    features: wp.ref[PlainScene],
):
    """Add what lights, each as a whole, add to surfaces of a group's hits that wait for it, if nothing is in the way.

    Args:
        scene: Shading data.
        accel: Hierarchies.
        frame: Terms of the render.
        group: The group, with its hits.
        order: Its nodes, from ``start`` on.
        start: Position of the first.
        surfaces: As ``find_surfaces`` writes them.
        shadows: Where surfaces and shadow rays wait.
        counts: Counter row.
        features: What the kernel can render.
    """
    set = shadows.lit.set
    rows = shadows.lit.rows
    for row in range(scene.light_count):
        if shadows.count + count_rays(set) > shadows.rays.shape[0]:
            settle(scene, accel, frame, shadows, features)
        is_known = is_point_or_direction(scene.lights[row])
        rest = set
        while rest != wp.uint32(0) and not is_known:
            slot = first_ray(rest)
            rest = drop_first(rest)
            position = row_vector(surfaces, POSITION_ROW, slot)
            arriving = whole_light(scene, scene.lights[row], position, row_vector(rows, NORMAL_ROW, slot))
            set_arriving(rows, slot, arriving)
        facing = light_surfaces(scene.lights[row], is_known, group.rays, surfaces, set, rows)
        k = shadows.count
        sum = shadows.sum
        while facing != wp.uint32(0):
            slot = first_ray(facing)
            facing = drop_first(facing)
            ray = ShadowRay()
            ray.distance = rows[DISTANCE_ROW * GROUP + slot]
            ray.reach = -1.0
            if scene.lights[row].casts_shadow != 0:
                count_shadow(counts, shadows.lit.depths[slot])
                ray.reach = ray.distance
            ray.origin = row_vector(rows, ORIGIN_ROW, slot)
            ray.direction = row_vector(rows, SHADOW_ROW, slot)
            ray.from_instance = row_int(surfaces, INSTANCE_ROW, slot)
            ray.from_triangle = row_int(surfaces, TRIANGLE_ROW, slot)
            ray.light = row
            ray.shadow = scene.lights[row].shadow
            ray.node = order[start + slot]
            sum += 1
            ray.sum = sum
            ray.term = row_vector(rows, TERM_ROW, slot)
            shadows.rays[k] = ray
            k += 1
        shadows.count = k
        shadows.sum = sum
        if k == shadows.rays.shape[0]:
            settle(scene, accel, frame, shadows, features)
    shadows.lit.set = wp.uint32(0)
