# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a light adds to I_local: by samples, each with a shadow ray, or as a whole, with one."""

import warp as wp

from .bvh_structs import AccelData, Stack
from .constants import SHADOW_END
from .emission import is_mirrored
from .features import Features, PlainScene
from .frame_structs import FrameData
from .light_hooks import tell_dark_light, tell_light, tell_sample, tell_samples, tell_samples_done, tell_shadow_ray
from .light_structs import LightData
from .observer import Observer, Unobserved, observed
from .per_type import per_type
from .ray_counts import count_shadow
from .response import Shading, eval_response, unmirrored_scales
from .sample_emitter import Emitter, emitter_response, light_at, sample_emitter
from .sample_light import has_extent
from .sampling import branch_key, finer_bits, mirrored_point, shuffle_index
from .scene_structs import SceneData
from .shading_normal import facing
from .shadow_queue import Shadows, add_term, begin_sum, cast_shadow
from .surface import Surface
from .vector import max_component, max_magnitude
from .visibility import holds
from .whole_light import whole_light

LIGHT_BRANCH = wp.constant(8)
"""First number of the branches that are lights: those below are the kinds of rays."""


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
    shadows: Shadows,
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
    begin_sum(shadows)
    finer = finer_bits(frame.sample_count * frame.light_samples)
    for k in range(frame.light_samples):
        index = shuffle_index(wp.uint32(sample * frame.light_samples + k), own_key)
        u = mirrored_point(index, own_key, finer)
        s = sample_emitter(scene, shading, surface.position, emitter, u)
        if max_magnitude(s.irradiance) > 0.0 and facing(scene, surface, shading, s.wi, features) > 0.0:
            visible = wp.vec3(1.0, 1.0, 1.0)
            if emitter.casts_shadow != 0:
                count_shadow(counts, depth)
                tell_shadow_ray(observer)
                reach = s.distance * SHADOW_END
                row, shadow = emitter.row, emitter.shadow
                visible = cast_shadow(
                    scene, accel, frame, stack, surface, row, shadow, s.wi, reach, shadows, features, observer
                )
            light_color = s.irradiance * (1.0 / (wp.pi * float(frame.light_samples)))
            tell_sample(observer, emitter, s, shading, light_color)
            if max_component(visible) > 0.0:
                term = wp.cw_mul(visible, wp.cw_mul(light_color, emitter_response(emitter, shading, s.wi)))
                result += add_term(scene, accel, frame, term, shadows, features)
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
    shadows: Shadows,
    counts: wp.array[wp.int64],
    features: Features,
    observer: Observer,
) -> wp.vec3:
    """Return what a light as a whole adds to I_local, with one shadow ray, where N.L > 0."""
    arriving = whole_light(scene, light, surface.position, shading.n)
    cosine = facing(scene, surface, shading, arriving.wi, features)
    term = wp.vec3(0.0, 0.0, 0.0)
    if cosine <= 0.0:
        tell_dark_light(observer, row, cosine)
        return term
    visible = wp.vec3(1.0, 1.0, 1.0)
    if light.casts_shadow != 0:
        count_shadow(counts, depth)
        tell_shadow_ray(observer)
        shadow, wi, reach = light.shadow, arriving.to_shadow, arriving.distance
        visible = cast_shadow(scene, accel, frame, stack, surface, row, shadow, wi, reach, shadows, features, observer)
    light_color = arriving.irradiance * (1.0 / wp.pi)
    scales = wp.vec3(light.diffuse, light.specular, light.specular)
    if is_mirrored(light, frame.lights_visible):
        scales = unmirrored_scales(shading, light.diffuse, light.specular)
    if max_component(visible) > 0.0:
        term = wp.cw_mul(visible, wp.cw_mul(light_color, eval_response(shading, arriving.wi, scales)))
    tell_light(observer, row, light.casts_shadow, scales, arriving, shading, light_color, visible, term)
    begin_sum(shadows)
    return add_term(scene, accel, frame, term, shadows, features)


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
    shadows: Shadows,
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
            shadows,
            counts,
            features,
            observer,
        )
    return whole_illumination(
        scene, accel, frame, stack, surface, shading, scene.lights[row], row, depth, shadows, counts, features, observer
    )


@per_type
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
    shadows: Shadows,
    counts: wp.array[wp.int64],
    features: wp.ref[PlainScene],
    observer: wp.ref[Unobserved],
) -> wp.vec3:
    """Return it: as a whole."""
    return whole_illumination(
        scene, accel, frame, stack, surface, shading, scene.lights[row], row, depth, shadows, counts, features, observer
    )
