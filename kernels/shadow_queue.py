# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""When shadow rays are traced: at once, or in groups, once many of them wait.

A shadow ray decides what a light adds to a node's I_local. Who walks a tree node by node wants to know ``AtOnce``.
Where trees grow together, ray and term wait in a ``ShadowQueue``, and terms are added when it is settled, in the order
in which they came: the sums are the same, to the last bit.
"""

from typing import TypeVar

import warp as wp

from .bvh_group import trace_group
from .bvh_structs import AccelData, Stack
from .constants import GROUP
from .features import Features, PlainScene
from .frame_structs import FrameData
from .list_rays import gather_shadow_rays, list_shadow_rays
from .observer import Observer, Unobserved, observed
from .per_type import per_type
from .ray_structs import ShadowRay
from .scene_structs import SceneData
from .shadow_ray import ends_at_any, shadow_end, shadow_ray, transmitted_light
from .spawn import spawn_origin
from .surface import Surface
from .tile_structs import ShadowQueue
from .vector import max_component


@wp.struct
class AtOnce:
    """Shadow rays are traced when they are cast."""


Shadows = TypeVar("Shadows", AtOnce, ShadowQueue)
"""Stands for each of them in the annotations of functions."""


@wp.func
def open_queue(queue: wp.ref[ShadowQueue]):
    """Begin with no sum; none waits."""
    queue.count = 0
    queue.lit.slot = -1
    queue.lit.set = wp.uint32(0)
    queue.is_cast = 0
    queue.sum = 0
    queue.open_sum = 0
    queue.open_node = -1


@wp.func
def close_sum(queue: wp.ref[ShadowQueue]):
    """Add the open sum to its node's I_local."""
    node = queue.open_node
    if node >= 0:
        queue.values[node] = queue.values[node] + queue.open_value
    queue.open_node = -1


@wp.func
def trace_shadow_rays(accel: wp.ref[AccelData], queue: wp.ref[ShadowQueue]):
    """Find out which of the rays that wait meet anything."""
    list_shadow_rays(queue.rays, 0, queue.count, queue.keys, queue.order, queue.ends)
    start = int(0)
    for octant in range(wp.int32(8)):
        end = queue.ends[octant]
        while start < end:
            size = wp.min(GROUP, end - start)
            gather_shadow_rays(
                queue.rays,
                queue.order,
                start,
                size,
                queue.group.rays,
                queue.group.ends,
                queue.group.senders,
                queue.group.triangles,
            )
            trace_group(accel, queue.group, size, True)
            for index in range(size):
                queue.is_blocked[queue.order[start + index]] = 1 if queue.group.words[index] >= 0 else 0
            start += size
    for position in range(start, queue.ends[8]):
        queue.is_blocked[queue.order[position]] = 0


@per_type
def light_past(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    ray: wp.ref[ShadowRay],
    features: Features,
) -> wp.vec3:
    """Return the share of a light that arrives though something is on the way."""
    nobody = Unobserved()
    if ends_at_any(scene, frame.shadow_mode, ray.shadow):
        return wp.vec3(0.0, 0.0, 0.0)
    return transmitted_light(
        scene,
        accel,
        frame.shadow_mode,
        ray.shadow,
        stack,
        ray.origin,
        ray.direction,
        ray.distance,
        ray.from_instance,
        ray.from_triangle,
        features,
        nobody,
    )


@wp.func
def light_past(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    ray: wp.ref[ShadowRay],
    features: wp.ref[PlainScene],
) -> wp.vec3:
    """Return that nothing does."""
    return wp.vec3(0.0, 0.0, 0.0)


@per_type
def settle(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    queue: wp.ref[ShadowQueue],
    features: Features,
):
    """Trace all rays that wait, and add their terms, in their order, as far as their lights arrive.

    The last sum stays open, for more of its terms may follow. Where surfaces let light through, rays that meet any are
    traced again, from surface to surface.
    """
    trace_shadow_rays(accel, queue)
    for k in range(queue.count):
        visible = wp.vec3(1.0, 1.0, 1.0)
        if queue.is_blocked[k] != 0:
            visible = light_past(scene, accel, frame, queue.stack, queue.rays[k], features)
        if max_component(visible) > 0.0:
            if queue.rays[k].sum != queue.open_sum:
                close_sum(queue)
                queue.open_node = queue.rays[k].node
                queue.open_sum = queue.rays[k].sum
                queue.open_value = wp.vec3(0.0, 0.0, 0.0)
            queue.open_value = queue.open_value + wp.cw_mul(visible, queue.rays[k].term)
    queue.count = 0


@per_type
def begin_local(value: wp.vec3, shadows: Shadows) -> wp.vec3:
    """Return what of I_local's terms that no light has a part in is added now."""
    return value


@wp.func
def begin_local(value: wp.vec3, shadows: wp.ref[ShadowQueue]) -> wp.vec3:
    """Add them before the terms that wait."""
    shadows.values[shadows.node] = value
    shadows.is_cast = 0
    return wp.vec3(0.0, 0.0, 0.0)


@per_type
def begin_sum(shadows: Shadows):
    """The terms that follow make a sum of their own."""
    pass


@wp.func
def begin_sum(shadows: wp.ref[ShadowQueue]):
    """Give it a number."""
    shadows.sum += 1


@observed
def cast_shadow(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    light: int,
    shadow: int,
    direction: wp.vec3,
    distance: float,
    shadows: Shadows,
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return the share of a light that arrives at a surface; 1 where that is not known yet.

    Args:
        scene: Shading data.
        accel: Hierarchies.
        frame: Terms of the render.
        stack: Scratch of the traversal.
        surface: Where the ray starts.
        light: Number of the light.
        shadow: Row of ``SceneData.shadows``, or -1.
        direction: Unit.
        distance: To the light.
        shadows: When the ray is traced.
        features: What the kernel can render.
        observer: Who is told of what is crossed.
    """
    return shadow_ray(
        scene,
        accel,
        frame.shadow_mode,
        shadow,
        stack,
        spawn_origin(scene, surface, direction),
        direction,
        distance,
        surface.instance,
        surface.triangle,
        features,
        observer,
    )


@per_type
def cast_shadow(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    light: int,
    shadow: int,
    direction: wp.vec3,
    distance: float,
    shadows: wp.ref[ShadowQueue],
    features: Features,
    observer: wp.ref[Unobserved],
) -> wp.vec3:
    """Write the ray that the next term waits for."""
    k = shadows.count
    shadows.rays[k].origin = spawn_origin(scene, surface, direction)
    shadows.rays[k].direction = direction
    shadows.rays[k].reach = shadow_end(scene, shadow, distance)
    shadows.rays[k].distance = distance
    shadows.rays[k].from_instance = surface.instance
    shadows.rays[k].from_triangle = surface.triangle
    shadows.rays[k].light = light
    shadows.rays[k].shadow = shadow
    shadows.is_cast = 1
    return wp.vec3(1.0, 1.0, 1.0)


@per_type
def add_term(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    term: wp.vec3,
    shadows: Shadows,
    features: Features,
) -> wp.vec3:
    """Return what of a light's term, of which ``cast_shadow`` has said how much arrives, is added now."""
    return term


@per_type
def add_term(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    term: wp.vec3,
    shadows: wp.ref[ShadowQueue],
    features: Features,
) -> wp.vec3:
    """Let it wait with its ray, or without one where none has been cast, for terms are added in their order."""
    k = shadows.count
    if shadows.is_cast == 0:
        shadows.rays[k].reach = -1.0
    shadows.rays[k].node = shadows.node
    shadows.rays[k].sum = shadows.sum
    shadows.rays[k].term = term
    shadows.is_cast = 0
    shadows.count = k + 1
    if k + 1 == shadows.rays.shape[0]:
        settle(scene, accel, frame, shadows, features)
    return wp.vec3(0.0, 0.0, 0.0)
