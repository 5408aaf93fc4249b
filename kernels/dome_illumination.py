# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What domes add to I_local: by samples, as lights do, or as a whole, unshadowed."""

import warp as wp

from .albedo import diffuse_albedo
from .bvh_structs import AccelData, Stack
from .environment import dome_irradiance
from .features import Features, PlainScene
from .frame_structs import FrameData
from .light_hooks import tell_dome
from .light_illumination import sampled_illumination
from .light_structs import DomeData
from .observer import Observer, Unobserved, observed
from .per_type import per_type
from .response import MODEL_PREVIEW, Shading
from .sample_emitter import dome_at
from .scene_structs import SceneData
from .shadow_queue import Shadows, add_term, begin_sum
from .surface import Surface
from .vector import max_component
from .visibility import holds


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
