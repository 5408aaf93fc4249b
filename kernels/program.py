# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Programs: what shading networks compute of the place, evaluated where a ray hits.

Registers hold four components each. What is no number, as a division by 0, counts as 0, step by step.
"""

import warp as wp

from .constants import REGISTERS
from .noise import cell_of, hash_of, perlin_2d, perlin_3d, share, worley
from .object_space import between_spaces, padded, point_to_object, vector_to_object
from .op_codes import (
    OP_ABSOLUTE,
    OP_AFFINE,
    OP_ARCSIN,
    OP_ARCTAN2,
    OP_CEIL,
    OP_CELLS_2D,
    OP_CELLS_3D,
    OP_CHOOSE,
    OP_CLIP,
    OP_COS,
    OP_CROSS,
    OP_EQUAL,
    OP_EXP,
    OP_EXP2,
    OP_FLOOR,
    OP_GREATER,
    OP_GREATER_EQUAL,
    OP_GROWTH_S,
    OP_GROWTH_T,
    OP_LENGTH,
    OP_LOG,
    OP_MAXIMUM,
    OP_MINIMUM,
    OP_MODULO,
    OP_MULTIPLY,
    OP_NORMAL_WORLD,
    OP_PERLIN_2D,
    OP_PERLIN_3D,
    OP_POINT_TO_WORLD,
    OP_POSITION,
    OP_POSITION_ACROSS,
    OP_POSITION_DOWN,
    OP_POSITION_WORLD,
    OP_POWER,
    OP_PRIMVAR,
    OP_RECIPROCAL,
    OP_SIGN,
    OP_SIN,
    OP_SQRT,
    OP_TAN,
    OP_TANGENT_WORLD,
    OP_TEXTURE_AT,
    OP_UNIT,
    OP_VIEW_WORLD,
    OP_WORLEY_2D,
    OP_WORLEY_CELLS_2D,
    OP_WORLEY_CELLS_3D,
)
from .ray_differential import coordinate_growth
from .scene_structs import InstructionData, SceneData
from .surface import Surface
from .surface_primvar import eval_primvar, surface_tangents
from .texture_node import eval_texture, texture_of


@wp.func(inline=False)
def of_surface(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], step: wp.ref[InstructionData], wo: wp.vec3, is_averaged: bool
) -> wp.vec4:
    """Return what a step reads of the surface point."""
    if step.op == OP_POSITION:
        return padded(point_to_object(scene, surface, surface.position))
    if step.op == OP_POSITION_WORLD:
        return padded(surface.position + scene.origin)
    if step.op == OP_NORMAL_WORLD:
        return padded(surface.n_shading)
    if step.op == OP_VIEW_WORLD:
        return padded(-wo)
    if step.op == OP_POSITION_ACROSS:
        return padded(vector_to_object(scene, surface, surface.dpdx))
    if step.op == OP_POSITION_DOWN:
        return padded(vector_to_object(scene, surface, surface.dpdy))
    if step.op == OP_TANGENT_WORLD:
        tangent, _bitangent = surface_tangents(scene, surface, step.data)
        return padded(wp.normalize(tangent))
    if step.op == OP_GROWTH_S:
        return padded(vector_to_object(scene, surface, coordinate_growth(scene, surface, step.data, 0)))
    if step.op == OP_GROWTH_T:
        return padded(vector_to_object(scene, surface, coordinate_growth(scene, surface, step.data, 1)))
    if step.op == OP_PRIMVAR:
        return eval_primvar(scene, surface, step.data, scene.program_values[step.values])
    return texture_of(scene, surface, step.data, is_averaged)


@wp.func
def component(op: int, a: float, b: float, c: float) -> float:
    """Return what a step makes of one component of each of its registers."""
    if op == OP_MULTIPLY:
        return a * b
    if op == OP_RECIPROCAL:
        return 1.0 / a
    if op == OP_CLIP:
        return wp.min(wp.max(a, b), c)
    if op == OP_CHOOSE:
        return b if a != 0.0 else c
    if op == OP_GREATER:
        return 1.0 if a > b else 0.0
    if op == OP_GREATER_EQUAL:
        return 1.0 if a >= b else 0.0
    if op == OP_EQUAL:
        return 1.0 if a == b else 0.0
    if op == OP_MINIMUM:
        return wp.min(a, b)
    if op == OP_MAXIMUM:
        return wp.max(a, b)
    if op == OP_POWER:
        return wp.pow(a, b)
    if op == OP_MODULO:
        return a - b * wp.floor(a / b)
    if op == OP_ARCTAN2:
        return wp.atan2(a, b)
    if op == OP_ABSOLUTE:
        return wp.abs(a)
    if op == OP_SIGN:
        return (1.0 if a > 0.0 else 0.0) - (1.0 if a < 0.0 else 0.0)
    if op == OP_FLOOR:
        return wp.floor(a)
    if op == OP_CEIL:
        return wp.ceil(a)
    if op == OP_SQRT:
        return wp.sqrt(a)
    if op == OP_EXP:
        return wp.exp(a)
    if op == OP_EXP2:
        return wp.pow(2.0, a)
    if op == OP_LOG:
        return wp.log(a)
    if op == OP_SIN:
        return wp.sin(a)
    if op == OP_COS:
        return wp.cos(a)
    if op == OP_TAN:
        return wp.tan(a)
    if op == OP_ARCSIN:
        return wp.asin(a)
    return wp.acos(a)


@wp.func(inline=False)
def noise(op: int, place: wp.vec4, jitter: float, size: int) -> wp.vec4:
    """Return a noise at a place: see ``noise.py``."""
    p = wp.vec3(place[0], place[1], place[2])
    if op == OP_PERLIN_3D:
        return perlin_3d(p, size)
    if op == OP_PERLIN_2D:
        return perlin_2d(wp.vec2(p[0], p[1]), size)
    flat = wp.vec3(p[0], p[1], 0.0)
    if op == OP_CELLS_2D:
        return padded(wp.vec3(share(hash_of(cell_of(p[0]), cell_of(p[1]), 0, 2)), 0.0, 0.0))
    if op == OP_CELLS_3D:
        return padded(wp.vec3(share(hash_of(cell_of(p[0]), cell_of(p[1]), cell_of(p[2]), 3)), 0.0, 0.0))
    if op == OP_WORLEY_2D:
        return worley(flat, jitter, 2, size, False)
    if op == OP_WORLEY_CELLS_2D:
        return worley(flat, jitter, 2, size, True)
    return worley(p, jitter, 3, size, op == OP_WORLEY_CELLS_3D)


@wp.func
def affine(scene: wp.ref[SceneData], step: wp.ref[InstructionData], v: wp.vec4) -> wp.vec4:
    """Return four sums over the components of a register, and a constant each."""
    k = step.values
    value = scene.program_values[k]
    if step.size > 0:
        value += scene.program_values[k + 1] * v[0]
    if step.size > 1:
        value += scene.program_values[k + 2] * v[1]
    if step.size > 2:
        value += scene.program_values[k + 3] * v[2]
    if step.size > 3:
        value += scene.program_values[k + 4] * v[3]
    return value


@wp.func(inline=False)
def eval_program(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], program: int, wo: wp.vec3, is_averaged: bool
) -> wp.vec4:
    """Return what a program computes at a surface point.

    Args:
        scene: Shading data.
        surface: Where.
        program: Row of ``SceneData.programs``.
        wo: Unit, towards the viewer.
        is_averaged: Whether textures give their mean over the ray's footprint.
    """
    registers = wp.zeros(shape=(REGISTERS,), dtype=wp.vec4)
    rows = scene.programs[program]
    for k in range(rows[0], rows[0] + rows[1]):
        step = scene.instructions[k]
        op = step.op
        a = registers[step.a]
        b = registers[step.b]
        value = wp.vec4(0.0, 0.0, 0.0, 0.0)
        if op >= OP_MULTIPLY:
            c = registers[step.c]
            for n in range(step.size):
                value[n] = component(op, a[n], b[n], c[n])
        elif op == OP_AFFINE:
            value = affine(scene, step, a)
            if step.data != 0:
                value += b
        elif op == OP_TEXTURE_AT:
            c = registers[step.c]
            place = wp.vec2(a[0], a[1])
            across = wp.vec2(b[0], b[1])
            down = wp.vec2(c[0], c[1])
            if scene.is_filtered == 0 or not is_averaged:
                across = wp.vec2(0.0, 0.0)
                down = wp.vec2(0.0, 0.0)
            value = eval_texture(scene, scene.textures[step.data], place, across, down)
        elif op < OP_POINT_TO_WORLD:
            value = of_surface(scene, surface, step, wo, is_averaged)
        elif op < OP_AFFINE:
            value = between_spaces(scene, surface, op, a)
        elif op == OP_UNIT:
            value = wp.normalize(a)
        elif op == OP_LENGTH:
            value[0] = wp.length(a)
        elif op == OP_CROSS:
            value = padded(wp.cross(wp.vec3(a[0], a[1], a[2]), wp.vec3(b[0], b[1], b[2])))
        else:
            value = noise(op, a, b[0], step.size)
        for n in range(wp.int32(4)):
            if not wp.isfinite(value[n]):
                value[n] = 0.0
        registers[step.out] = value
    return registers[0]
