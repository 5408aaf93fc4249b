# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Local illumination: I_local, with its shadow rays."""

import warp as wp

from .albedo import diffuse_albedo
from .bvh_structs import AccelData, Stack
from .constants import GROUP, SHADOW_END
from .emission import is_mirrored
from .environment import dome_irradiance
from .features import Features, PlainScene
from .group_structs import RayGroup
from .group_surfaces import INSTANCE_ROW, POSITION_ROW, TRIANGLE_ROW
from .lit_surfaces import (
    DISTANCE_ROW,
    NORMAL_ROW,
    ORIGIN_ROW,
    SHADOW_ROW,
    TERM_ROW,
    await_light,
    is_point_or_direction,
    light_surfaces,
    set_arriving,
)
from .number_rows import row_int, row_vector
from .observer import Observer, Unobserved, observed
from .per_type import per_type
from .ray_counts import count_shadow
from .ray_set import count_rays, drop_first, first_ray
from .response import MODEL_PREVIEW, MODEL_WHITTED, Shading, eval_response, unmirrored_scales
from .sample_emitter import Emitter, dome_at, emitter_response, light_at, sample_emitter
from .sample_light import has_extent
from .sampling import branch_key, sequence_point, shuffle_index
from .shading_normal import facing
from .shadow_queue import Shadows, add_term, begin_local, begin_sum, cast_shadow, settle
from .spawn import is_at_rim
from .structs import DomeData, FrameData, LightData, SceneData, ShadowRay
from .surface import Surface
from .tile_structs import ShadowQueue
from .tree_hooks import (
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
    for k in range(frame.light_samples):
        index = shuffle_index(wp.uint32(sample * frame.light_samples + k), own_key)
        s = sample_emitter(scene, shading, surface.position, emitter, sequence_point(index, own_key))
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
    shadows: Shadows,
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
                    shadows,
                    counts,
                    features,
                    observer,
                )
            else:
                term = whole_dome(scene, shading, scene.domes[k], scene.light_count + k, observer)
                begin_sum(shadows)
                result += add_term(scene, accel, frame, term, shadows, features)


@per_type
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
    shadows: Shadows,
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
    shadows: Shadows,
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
    result = begin_local(shading.emission + ambient, shadows)
    if shading.has_local == 0:
        return result
    for k in range(scene.light_count):
        result += light_illumination(
            scene, accel, frame, stack, surface, shading, k, depth, key, sample, shadows, counts, features, observer
        )
    add_domes(
        result, scene, accel, frame, stack, surface, shading, depth, key, sample, shadows, counts, features, observer
    )
    return result


@per_type
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
    shadows: wp.ref[ShadowQueue],
    counts: wp.array[wp.int64],
    features: wp.ref[PlainScene],
    observer: wp.ref[Unobserved],
) -> wp.vec3:
    """Begin it; surfaces of the lecture's material wait for their light."""
    result = begin_local(shading.emission + wp.cw_mul(shading.ambient, frame.ambient), shadows)
    if shading.has_local == 0:
        return result
    if shadows.lit.slot >= 0 and shading.model == MODEL_WHITTED:
        if not is_at_rim(scene, surface):
            await_light(shadows.lit, shading, depth)
            return result
    for k in range(scene.light_count):
        result += light_illumination(
            scene, accel, frame, stack, surface, shading, k, depth, key, sample, shadows, counts, features, observer
        )
    return result


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
