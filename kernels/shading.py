# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Local illumination: I_local, with its shadow rays."""

import warp as wp

from .bvh_structs import AccelData, Stack
from .bvh_traverse import any_hit_from, closest_hit_from
from .constants import SHADOW_LIMIT
from .environment import dome_irradiance
from .light import sample_light
from .material import MODEL_WHITTED, NO_LEAK, Shading, eval_material, eval_response
from .observer import Observer, observed
from .ray_counts import count_shadow
from .structs import FrameData, SceneData
from .surface import Surface, make_surface, spawn_origin
from .tree_hooks import (
    tell_blocked,
    tell_crossing,
    tell_dark_light,
    tell_dome,
    tell_light,
    tell_own_light,
    tell_shadow_ray,
)
from .vector import max_component

SHADOW_OPAQUE = wp.constant(0)
SHADOW_AUTO = wp.constant(1)
SHADOW_TRANSMIT = wp.constant(2)


@observed
def shadow_ray(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    mode: int,
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    direction: wp.vec3,
    distance: float,
    observer: Observer,
) -> wp.vec3:
    """Return the share of a light that arrives, per channel: the lecture's S.

    Opaque: any hit on the way gives 0. Transmit: the product of Kt over the surfaces crossed in a straight line. Auto:
    the first for WhittedSurface, the second for UsdPreviewSurface. What is missing of a surface (its presence below 1)
    lets light through in both of these.
    """
    one = wp.vec3(1.0, 1.0, 1.0)
    zero = wp.vec3(0.0, 0.0, 0.0)
    origin = spawn_origin(scene, surface, direction)
    if mode == SHADOW_OPAQUE:
        if any_hit_from(accel, origin, direction, distance, surface.instance, surface.triangle, stack, observer):
            tell_blocked(observer, scene, accel, origin, direction, distance, surface, stack)
            return zero
        return one
    result = one
    remaining = float(distance)
    instance = surface.instance
    triangle = surface.triangle
    for _crossing in range(wp.int32(SHADOW_LIMIT)):
        hit = closest_hit_from(accel, origin, direction, remaining, instance, triangle, stack, observer)
        if hit.instance < 0:
            return result
        crossed = make_surface(scene, hit, origin, direction)
        shading = eval_material(scene, crossed, -direction, NO_LEAK)
        kt = shading.kt * shading.presence
        if mode == SHADOW_AUTO and shading.model == MODEL_WHITTED:
            kt = zero
        factor = kt + one * (1.0 - shading.presence)
        tell_crossing(observer, scene, crossed, hit.t, factor)
        result = wp.cw_mul(result, factor)
        if max_component(result) <= 0.0:
            return zero
        origin = spawn_origin(scene, crossed, direction)
        remaining -= hit.t
        instance = hit.instance
        triangle = hit.triangle
    return zero


@observed
def local_illumination(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    depth: int,
    counts: wp.array[wp.int64],
    observer: Observer,
) -> wp.vec3:
    """Return I_local = ka Ia + sum over lights with N.L > 0 of S I_l (kd (N.L) + ks max(R_l.V, 0)^n).

    UsdPreviewSurface puts its own BRDF in the bracket and adds its emission. Domes have no direction to shadow: they
    add their irradiance to what is diffuse, and to what is glossy but no mirror.
    """
    ambient = wp.cw_mul(shading.ambient, frame.ambient)
    tell_own_light(observer, shading.emission, ambient)
    result = shading.emission + ambient
    if shading.has_local == 0:
        return result
    for k in range(scene.light_count):
        light = scene.lights[k]
        sample = sample_light(light, surface.position)
        cosine = wp.dot(shading.n, sample.wi)
        if cosine > 0.0:
            visible = wp.vec3(1.0, 1.0, 1.0)
            if light.casts_shadow != 0:
                count_shadow(counts, depth)
                tell_shadow_ray(observer)
                mode = frame.shadow_mode
                visible = shadow_ray(scene, accel, mode, stack, surface, sample.to_shadow, sample.distance, observer)
            light_color = sample.irradiance * (1.0 / wp.pi)
            term = wp.vec3(0.0, 0.0, 0.0)
            if max_component(visible) > 0.0:
                response = eval_response(shading, sample.wi, light.diffuse, light.specular)
                term = wp.cw_mul(wp.cw_mul(visible, light_color), response)
                result += term
            tell_light(observer, k, light, sample, shading, light_color, visible, term)
        else:
            tell_dark_light(observer, k, cosine)
    for k in range(scene.dome_count):
        dome = scene.domes[k]
        diffuse = wp.cw_mul(shading.diffuse, dome_irradiance(scene, dome, shading.n)) * (dome.diffuse / wp.pi)
        glossy = wp.vec3(0.0, 0.0, 0.0)
        result += diffuse
        if max_component(shading.gloss) > 0.0:
            mirrored = 2.0 * wp.dot(shading.n, shading.wo) * shading.n - shading.wo
            glossy = wp.cw_mul(shading.gloss, dome_irradiance(scene, dome, mirrored)) * (dome.specular / wp.pi)
            result += glossy
        tell_dome(observer, scene.light_count + k, diffuse, glossy)
    return result
