# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Local illumination: I_local, with its shadow rays."""

import warp as wp

from .albedo import diffuse_albedo
from .bvh_structs import AccelData, Stack
from .bvh_traverse import any_hit_from, closest_hit_from
from .constants import SHADOW_END, SHADOW_LIMIT
from .emission import is_mirrored
from .environment import dome_irradiance
from .features import Features, PlainScene
from .material import (
    MODEL_PREVIEW,
    MODEL_WHITTED,
    NO_LEAK,
    Shading,
    eval_material,
    eval_response,
    unmirrored_scales,
)
from .observer import Observer, Unobserved, observed
from .ray_counts import count_shadow
from .sample_emitter import Emitter, dome_at, emitter_response, light_at, sample_emitter
from .sample_light import has_extent
from .sampling import branch_key, sequence_point, shuffle_index
from .structs import DomeData, FrameData, LightData, SceneData, ShadowData
from .surface import Surface, make_surface, spawn_origin
from .tree_hooks import (
    tell_blocked,
    tell_crossing,
    tell_dark_light,
    tell_dome,
    tell_light,
    tell_own_light,
    tell_sample,
    tell_samples,
    tell_samples_done,
    tell_shadow_ray,
)
from .vector import max_component, max_magnitude
from .visibility import CASTS_SHADOW, holds, is_present
from .whole_light import whole_light

SHADOW_OPAQUE = wp.constant(0)
SHADOW_AUTO = wp.constant(1)
SHADOW_TRANSMIT = wp.constant(2)
LIGHT_BRANCH = wp.constant(8)
"""First number of the branches that are lights: those below are the kinds of rays."""


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


@observed
def opaque_shadow(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    direction: wp.vec3,
    distance: float,
    observer: Observer,
) -> wp.vec3:
    """Return 0 where anything is on the way to a light, else 1."""
    origin = spawn_origin(scene, surface, direction)
    if any_hit_from(accel, origin, direction, distance, surface.instance, surface.triangle, stack, observer):
        tell_blocked(observer, scene, accel, origin, direction, distance, surface, stack)
        return wp.vec3(0.0, 0.0, 0.0)
    return wp.vec3(1.0, 1.0, 1.0)


@observed
def shadow_ray(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    mode: int,
    shadow: int,
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    direction: wp.vec3,
    distance: float,
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return the share of a light that arrives, per channel: the lecture's S.

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
    if mode == SHADOW_OPAQUE and shadow < 0 and scene.has_hidden == 0:
        return opaque_shadow(scene, accel, stack, surface, direction, distance, observer)
    origin = spawn_origin(scene, surface, direction)
    result = one
    faded = zero
    remaining = float(distance)
    casters = int(-1)
    if shadow >= 0:
        remaining = wp.min(remaining, scene.shadows[shadow].distance)
        casters = scene.shadows[shadow].casters
    end = remaining
    instance = surface.instance
    triangle = surface.triangle
    for _crossing in range(wp.int32(SHADOW_LIMIT)):
        hit = closest_hit_from(accel, origin, direction, remaining, instance, triangle, stack, observer)
        if hit.instance < 0:
            return shadow_color(scene, shadow, result + faded)
        crossed = make_surface(scene, hit, origin, direction)
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
        origin = spawn_origin(scene, crossed, direction)
        instance = hit.instance
        triangle = hit.triangle
    return zero


@wp.func
def shadow_ray(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    mode: int,
    shadow: int,
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    direction: wp.vec3,
    distance: float,
    features: wp.ref[PlainScene],
    observer: wp.ref[Unobserved],
) -> wp.vec3:
    """Return it: all or nothing."""
    return opaque_shadow(scene, accel, stack, surface, direction, distance, observer)


@observed
def sampled_illumination(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    emitter: wp.ref[Emitter],
    depth: int,
    key: wp.uint32,
    sample: int,
    counts: wp.array[wp.int64],
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return what a light with an extent, or a dome, adds to I_local: the mean of ``FrameData.light_samples`` samples.

    Each has a shadow ray of its own. Samples of the light and of the pixel go through one (0, 2)-sequence, so that they
    are stratified together; its order and digits are scrambled for each pixel, ray of the tree and light.
    """
    result = wp.vec3(0.0, 0.0, 0.0)
    if emitter.reflected <= 0.0:
        return result
    own_key = branch_key(key, emitter.row + LIGHT_BRANCH)
    tell_samples(observer)
    for k in range(frame.light_samples):
        index = shuffle_index(wp.uint32(sample * frame.light_samples + k), own_key)
        s = sample_emitter(scene, shading, surface.position, emitter, sequence_point(index, own_key))
        if max_magnitude(s.irradiance) > 0.0:
            visible = wp.vec3(1.0, 1.0, 1.0)
            if emitter.casts_shadow != 0:
                count_shadow(counts, depth)
                tell_shadow_ray(observer)
                reach = s.distance * SHADOW_END
                mode = frame.shadow_mode
                shadow = emitter.shadow
                visible = shadow_ray(scene, accel, mode, shadow, stack, surface, s.wi, reach, features, observer)
            light_color = s.irradiance * (1.0 / (wp.pi * float(frame.light_samples)))
            tell_sample(observer, emitter, s, shading, light_color)
            if max_component(visible) > 0.0:
                result += wp.cw_mul(wp.cw_mul(visible, light_color), emitter_response(emitter, shading, s.wi))
    tell_samples_done(observer, emitter, frame.light_samples, shading, result)
    return result


@wp.func
def is_sampled(frame: wp.ref[FrameData], light: wp.ref[LightData]) -> bool:
    """Return whether samples of a light are taken."""
    if frame.light_samples == 0:
        return False
    return has_extent(light)


@observed
def whole_illumination(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    light: wp.ref[LightData],
    row: int,
    depth: int,
    counts: wp.array[wp.int64],
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return what a light as a whole adds to I_local, with one shadow ray, where N.L > 0."""
    arriving = whole_light(scene, light, surface.position, shading.n)
    cosine = wp.dot(shading.n, arriving.wi)
    term = wp.vec3(0.0, 0.0, 0.0)
    if cosine <= 0.0:
        tell_dark_light(observer, row, cosine)
        return term
    visible = wp.vec3(1.0, 1.0, 1.0)
    if light.casts_shadow != 0:
        count_shadow(counts, depth)
        tell_shadow_ray(observer)
        mode = frame.shadow_mode
        reach = arriving.distance
        visible = shadow_ray(
            scene, accel, mode, light.shadow, stack, surface, arriving.to_shadow, reach, features, observer
        )
    light_color = arriving.irradiance * (1.0 / wp.pi)
    scales = wp.vec3(light.diffuse, light.specular, light.specular)
    if is_mirrored(light, frame.lights_visible):
        scales = unmirrored_scales(shading, light.diffuse, light.specular)
    if max_component(visible) > 0.0:
        term = wp.cw_mul(wp.cw_mul(visible, light_color), eval_response(shading, arriving.wi, scales))
    tell_light(observer, row, light.casts_shadow, scales, arriving, shading, light_color, visible, term)
    return term


@observed
def whole_dome(
    scene: wp.ref[SceneData], shading: wp.ref[Shading], dome: wp.ref[DomeData], row: int, observer: Observer
) -> wp.vec3:
    """Return what a dome as a whole, unshadowed, adds to what is diffuse, and to what is glossy but no mirror."""
    diffuse = wp.cw_mul(shading.diffuse, dome_irradiance(scene, dome, shading.n)) * (dome.diffuse / wp.pi)
    if shading.model == MODEL_PREVIEW:
        cosine = wp.dot(shading.n, shading.wo)
        diffuse = wp.cw_mul(diffuse, diffuse_albedo(shading.specular, shading.specular_grazing, cosine))
    glossy = wp.vec3(0.0, 0.0, 0.0)
    if max_component(shading.gloss) > 0.0:
        mirrored = 2.0 * wp.dot(shading.n, shading.wo) * shading.n - shading.wo
        glossy = wp.cw_mul(shading.gloss, dome_irradiance(scene, dome, mirrored)) * (dome.specular / wp.pi)
    tell_dome(observer, row, diffuse, glossy)
    return diffuse + glossy


@observed
def light_illumination(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    row: int,
    depth: int,
    key: wp.uint32,
    sample: int,
    counts: wp.array[wp.int64],
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return what one light adds to I_local, by samples or as a whole."""
    if not holds(scene.links, scene.lights[row].receivers, surface.instance):
        tell_dark_light(observer, row, 0.0)
        return wp.vec3(0.0, 0.0, 0.0)
    if is_sampled(frame, scene.lights[row]):
        emitter = light_at(scene, shading, row, frame.lights_visible)
        return sampled_illumination(
            scene, accel, frame, stack, surface, shading, emitter, depth, key, sample, counts, features, observer
        )
    return whole_illumination(
        scene, accel, frame, stack, surface, shading, scene.lights[row], row, depth, counts, features, observer
    )


@wp.func
def light_illumination(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    row: int,
    depth: int,
    key: wp.uint32,
    sample: int,
    counts: wp.array[wp.int64],
    features: wp.ref[PlainScene],
    observer: wp.ref[Unobserved],
) -> wp.vec3:
    """Return it: as a whole."""
    return whole_illumination(
        scene, accel, frame, stack, surface, shading, scene.lights[row], row, depth, counts, features, observer
    )


@observed
def add_domes(
    result: wp.ref[wp.vec3],
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    depth: int,
    key: wp.uint32,
    sample: int,
    counts: wp.array[wp.int64],
    features: Features,
    observer: Observer,
):
    """Add what the domes add to I_local, by samples or as a whole."""
    for k in range(scene.dome_count):
        if holds(scene.links, scene.domes[k].receivers, surface.instance):
            if frame.light_samples > 0:
                emitter = dome_at(scene, shading, k)
                result += sampled_illumination(
                    scene,
                    accel,
                    frame,
                    stack,
                    surface,
                    shading,
                    emitter,
                    depth,
                    key,
                    sample,
                    counts,
                    features,
                    observer,
                )
            else:
                result += whole_dome(scene, shading, scene.domes[k], scene.light_count + k, observer)


@wp.func
def add_domes(
    result: wp.ref[wp.vec3],
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    depth: int,
    key: wp.uint32,
    sample: int,
    counts: wp.array[wp.int64],
    features: wp.ref[PlainScene],
    observer: wp.ref[Unobserved],
):
    """Add nothing: there is none."""
    pass


@observed
def local_illumination(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    stack: wp.ref[Stack],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    depth: int,
    key: wp.uint32,
    sample: int,
    counts: wp.array[wp.int64],
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return I_local = ka Ia + sum over lights with N.L > 0 of S I_l (kd (N.L) + ks max(R_l.V, 0)^n).

    UsdPreviewSurface puts its own BRDF in the bracket and adds its emission. With ``FrameData.light_samples`` lights
    with an extent and domes are sampled. Without, each light counts as a whole, and domes, which have no direction to
    shadow, add their irradiance to what is diffuse, and to what is glossy but no mirror.
    """
    ambient = wp.cw_mul(shading.ambient, frame.ambient)
    tell_own_light(observer, shading.emission, ambient)
    result = shading.emission + ambient
    if shading.has_local == 0:
        return result
    for k in range(scene.light_count):
        result += light_illumination(
            scene, accel, frame, stack, surface, shading, k, depth, key, sample, counts, features, observer
        )
    add_domes(result, scene, accel, frame, stack, surface, shading, depth, key, sample, counts, features, observer)
    return result
