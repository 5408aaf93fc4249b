# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which scenes are plain: rendered by the kernel that knows nothing of what they do not use."""

from __future__ import annotations

from warp_rt.kernels.codes import SHADOW_OPAQUE
from warp_rt.options import RenderOptions
from warp_rt.rendering.frame import shadow_mode
from warp_rt.scene import Light, Material, RayMask, Scene

_STRAIGHT = (0.0, 0.0, 1.0)  # what a normal map says where it bends nothing


def is_plain(scene: Scene, options: RenderOptions) -> bool:
    """Return whether ``kernels.features.PlainScene`` describes a scene as it is rendered; a headlight is plain, too."""
    return (
        not scene.domes
        and all(_is_plain_light(light, options) for light in scene.lights)
        and all(_is_plain_material(material) for material in scene.materials)
        and shadow_mode(options.shadows, scene) == int(SHADOW_OPAQUE)
        and (scene.instances.seen_by is None or bool((scene.instances.seen_by == RayMask.ALL).all()))
        and (scene.instances.is_matte is None or not scene.instances.is_matte.any())
    )


def _is_plain_light(light: Light, options: RenderOptions) -> bool:
    has_place = light.has_extent and (bool(options.light_samples) or options.lights_visible)
    return not has_place and light.receivers is None and light.shadow.is_plain


def _is_plain_material(material: Material) -> bool:
    normal = material.inputs.get("normal")
    bends = normal is not None and (normal.varies or tuple(normal.value[:3]) != _STRAIGHT)
    return not bends and not any(source.texture >= 0 or source.program for source in material.inputs.values())
