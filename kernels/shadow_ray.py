# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Shadow rays: the lecture's S."""

import warp as wp

from .bvh_structs import AccelData, Stack
from .bvh_traverse import any_hit_from, closest_hit_from
from .codes import CASTS_SHADOW, SHADOW_AUTO, SHADOW_OPAQUE
from .constants import SHADOW_LIMIT
from .features import Features, PlainScene
from .light_hooks import tell_blocked, tell_crossing
from .light_structs import ShadowData
from .material import NO_LEAK, eval_material
from .observer import Observer, Unobserved, observed
from .response import MODEL_WHITTED
from .scene_structs import SceneData
from .spawn import spawn_origin
from .surface import make_surface
from .vector import max_component
from .visibility import holds, is_present


@wp.func
def casts_shadow(scene: wp.ref[SceneData], casters: int, instance: int) -> bool:
    """Return whether an instance casts shadows, for a light of whose casters ``casters`` is the first word."""
    if scene.has_hidden != 0:  # Warp's ``and`` computes both of its sides
        if not is_present(scene, instance, CASTS_SHADOW):
            return False
    return holds(scene.links, casters, instance)


@wp.func
def shadow_strength(shadow: ShadowData, distance: float) -> float:
    """Return how much of what something takes from the light counts, at its distance from the shadowed surface."""
    if shadow.falloff <= 0.0 or distance <= shadow.distance - shadow.falloff:
        return 1.0
    return wp.pow(wp.clamp((shadow.distance - distance) / shadow.falloff, 0.0, 1.0), shadow.falloff_gamma)


@wp.func
def shadow_color(scene: wp.ref[SceneData], shadow: int, visible: wp.vec3) -> wp.vec3:
    """Return the share of a light that arrives, with the shadow's colour in place of what does not."""
    if shadow < 0:
        return visible
    return visible + wp.cw_mul(scene.shadows[shadow].color, wp.vec3(1.0, 1.0, 1.0) - visible)


@wp.func
def ends_at_any(scene: wp.ref[SceneData], mode: int, shadow: int) -> bool:
    """Return whether whatever a shadow ray meets takes the whole light from it."""
    return mode == SHADOW_OPAQUE and shadow < 0 and scene.has_hidden == 0


@wp.func
def shadow_end(scene: wp.ref[SceneData], shadow: int, distance: float) -> float:
    """Return the distance beyond which nothing casts a shadow, the light being at ``distance``."""
    if shadow < 0:
        return distance
    return wp.min(distance, scene.shadows[shadow].distance)


@observed
def transmitted_light(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    mode: int,
    shadow: int,
    stack: wp.ref[Stack],
    origin: wp.vec3,
    direction: wp.vec3,
    distance: float,
    from_instance: int,
    from_triangle: int,
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return the share of a light that arrives, per channel, surface by surface. Arguments as for ``shadow_ray``.

    Opaque: any hit on the way gives 0. Transmit: the product of Kt over the surfaces crossed in a straight line. Auto:
    the first for WhittedSurface, the second for UsdPreviewSurface. What is missing of a surface (its presence below 1)
    lets light through in both of these.

    A row of ``SceneData.shadows`` changes that: what it does not name is crossed as if it were not there, what stands
    beyond its distance too; within the falloff zone at the end of it, what a surface takes away is taken by a strength
    that falls from 1 to 0, to the power of gamma; and what has been taken comes back times the shadow's colour.

    Reference: UsdLux ShadowAPI.
    """
    one = wp.vec3(1.0, 1.0, 1.0)
    zero = wp.vec3(0.0, 0.0, 0.0)
    result = one
    faded = zero
    remaining = float(shadow_end(scene, shadow, distance))
    casters = int(-1)
    if shadow >= 0:
        casters = scene.shadows[shadow].casters
    end = remaining
    start = origin
    instance = int(from_instance)
    triangle = int(from_triangle)
    for _crossing in range(wp.int32(SHADOW_LIMIT)):
        hit = closest_hit_from(accel, start, direction, remaining, instance, triangle, stack, observer)
        if hit.instance < 0:
            return shadow_color(scene, shadow, result + faded)
        crossed = make_surface(scene, hit, start, direction)
        remaining -= hit.t
        factor = one
        if casts_shadow(scene, casters, hit.instance):
            factor = zero
            if mode != SHADOW_OPAQUE:
                shading = eval_material(scene, crossed, -direction, NO_LEAK, features)
                kt = shading.kt * shading.presence
                if mode == SHADOW_AUTO and shading.model == MODEL_WHITTED:
                    kt = zero
                factor = kt + one * (1.0 - shading.presence)
        kept = float(0.0)
        if shadow >= 0:
            kept = 1.0 - shadow_strength(scene.shadows[shadow], end - remaining)
            faded += wp.cw_mul(result, one - factor) * kept
        tell_crossing(observer, scene, crossed, hit.t, factor + (one - factor) * kept)
        result = wp.cw_mul(result, factor)
        if max_component(result) <= 0.0:
            return shadow_color(scene, shadow, faded)
        start = spawn_origin(scene, crossed, direction)
        instance = hit.instance
        triangle = hit.triangle
    return zero


@observed
def opaque_shadow(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    stack: wp.ref[Stack],
    origin: wp.vec3,
    direction: wp.vec3,
    distance: float,
    from_instance: int,
    from_triangle: int,
    observer: Observer,
) -> wp.vec3:
    """Return 0 where anything is on the way to a light, else 1. Arguments as for ``shadow_ray``."""
    if any_hit_from(accel, origin, direction, distance, from_instance, from_triangle, stack, observer):
        tell_blocked(observer, scene, accel, origin, direction, distance, from_instance, from_triangle, stack)
        return wp.vec3(0.0, 0.0, 0.0)
    return wp.vec3(1.0, 1.0, 1.0)


@observed
def shadow_ray(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    mode: int,
    shadow: int,
    stack: wp.ref[Stack],
    origin: wp.vec3,
    direction: wp.vec3,
    distance: float,
    from_instance: int,
    from_triangle: int,
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return the share of a light that arrives, per channel: the lecture's S.

    Args:
        scene: Shading data.
        accel: Hierarchies.
        mode: SHADOW_OPAQUE, SHADOW_AUTO or SHADOW_TRANSMIT.
        shadow: Row of ``SceneData.shadows``, or -1.
        stack: Scratch of the traversal.
        origin: Of the ray, world space.
        direction: Unit.
        distance: To the light.
        from_instance: Instance and triangle that the ray starts on.
        from_triangle: Likewise.
        features: What the kernel can render.
        observer: Who is told of what is crossed.
    """
    if not ends_at_any(scene, mode, shadow):
        return transmitted_light(
            scene,
            accel,
            mode,
            shadow,
            stack,
            origin,
            direction,
            distance,
            from_instance,
            from_triangle,
            features,
            observer,
        )
    return opaque_shadow(scene, accel, stack, origin, direction, distance, from_instance, from_triangle, observer)


@wp.func
def shadow_ray(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    mode: int,
    shadow: int,
    stack: wp.ref[Stack],
    origin: wp.vec3,
    direction: wp.vec3,
    distance: float,
    from_instance: int,
    from_triangle: int,
    features: wp.ref[PlainScene],
    observer: wp.ref[Unobserved],
) -> wp.vec3:
    """Return it: all or nothing."""
    return opaque_shadow(scene, accel, stack, origin, direction, distance, from_instance, from_triangle, observer)
