# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Local illumination: I_local, with its shadow rays."""

import warp as wp

from .bvh_structs import AccelData, Stack
from .dome_illumination import add_domes
from .features import Features, PlainScene
from .frame_structs import FrameData
from .light_hooks import tell_own_light
from .light_illumination import light_illumination
from .lit_surfaces import await_light
from .observer import Observer, Unobserved, observed
from .per_type import per_type
from .response import MODEL_WHITTED, Shading
from .scene_structs import SceneData
from .shadow_queue import Shadows, begin_local
from .spawn import is_at_rim
from .surface import Surface
from .tile_structs import ShadowQueue


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
