# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The inputs of a material at a surface point: constants, primvars, textures, and what programs compute."""

import warp as wp

from .codes import INPUT_COUNT
from .constants import INPUT_MAX
from .features import Features, PlainScene
from .per_type import per_type
from .program import eval_program
from .scene_structs import SceneData
from .surface import Surface
from .surface_primvar import eval_primvar
from .texture_node import texture_of


@wp.func
def pick_channel(value: wp.vec4, channel: int) -> wp.vec4:
    """Return one channel of a value four times; the value itself for -1."""
    if channel >= 0:
        c = value[channel]
        return wp.vec4(c, c, c, c)
    return value


@wp.func
def bounded(value: wp.vec4) -> wp.vec4:
    """Return what may be computed with: a component that is no number counts as 0, a huge one as the limit."""
    result = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for k in range(wp.static(4)):
        if not wp.isnan(value[k]):
            result[k] = wp.clamp(value[k], -INPUT_MAX, INPUT_MAX)
    return result


# Out of line, like the next one: constants, by far the most inputs, are then read without it.
@wp.func(inline=False)
def eval_primvar_input(scene: wp.ref[SceneData], surface: wp.ref[Surface], row: int) -> wp.vec4:
    """Return an input that is a primvar, at a surface point; ``row`` is that of ``SceneData.inputs``."""
    data = scene.inputs[row]
    value = eval_primvar(scene, surface, data.primvar, scene.input_values[row])
    return bounded(pick_channel(wp.cw_mul(value, data.scale) + data.bias, data.channel))


@wp.func(inline=False)
def eval_varying_input(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], row: int, wo: wp.vec3, is_averaged: bool
) -> wp.vec4:
    """Return an input that is no constant, at a surface point; arguments as for the functions around."""
    data = scene.inputs[row]
    if data.program >= 0:
        return bounded(eval_program(scene, surface, data.program, wo, is_averaged))
    if data.texture < 0:
        return eval_primvar_input(scene, surface, row)
    return bounded(pick_channel(texture_of(scene, surface, data.texture, is_averaged), data.channel))


@per_type
def eval_input(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    varying: int,
    index: int,
    wo: wp.vec3,
    is_averaged: bool,
    features: Features,
) -> wp.vec4:
    """Return one input of the surface's material.

    Args:
        scene: Shading data.
        surface: Where.
        varying: ``MaterialData.varying``.
        index: Of the input.
        wo: Unit, towards the viewer.
        is_averaged: Whether a texture gives its mean over the ray's footprint.
        features: What the kernel can render.
    """
    row = surface.material * INPUT_COUNT + index
    if varying & (1 << index) != 0:
        return eval_varying_input(scene, surface, row, wo, is_averaged)
    return scene.input_values[row]


@wp.func
def eval_input(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    varying: int,
    index: int,
    wo: wp.vec3,
    is_averaged: bool,
    features: wp.ref[PlainScene],
) -> wp.vec4:
    """Return it: no texture."""
    row = surface.material * INPUT_COUNT + index
    if varying & (1 << index) != 0:
        return eval_primvar_input(scene, surface, row)
    return scene.input_values[row]


@per_type
def input_vec3(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], varying: int, index: int, wo: wp.vec3, features: Features
) -> wp.vec3:
    """Return a colour input of the surface's material."""
    value = eval_input(scene, surface, varying, index, wo, True, features)
    return wp.vec3(value[0], value[1], value[2])


@per_type
def input_float(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], varying: int, index: int, wo: wp.vec3, features: Features
) -> float:
    """Return a scalar input of the surface's material."""
    return eval_input(scene, surface, varying, index, wo, True, features)[0]
