# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Texture nodes: texture coordinates moved, the image or its tiles looked up, the value scaled and shifted."""

import warp as wp

from .magnification import MAG_LINEAR, sample_magnified
from .ray_differential import coordinate_differential
from .scene_structs import SceneData, TextureData
from .surface import Surface
from .surface_primvar import eval_primvar
from .texture import sample_footprint
from .udim import sample_tiles


@wp.func
def eval_texture(
    scene: wp.ref[SceneData], texture: TextureData, uv: wp.vec2, across: wp.vec2, down: wp.vec2
) -> wp.vec4:
    """Return decode(texel) * scale + bias at texture coordinates ``uv``; the unscaled fallback without an image.

    Args:
        scene: Shading data.
        texture: What is read.
        uv: Texture coordinates.
        across: Their change from one sample to the next across the picture; zero: no texels are averaged.
        down: Likewise down the picture.

    Reference: UsdPreviewSurface Specification, UsdUVTexture.
    """
    if texture.image < 0:
        return texture.fallback
    p = wp.vec3(uv[0], uv[1], 1.0)
    u = wp.dot(texture.row_u, p)
    v = wp.dot(texture.row_v, p)
    across_image = wp.vec2(
        texture.row_u[0] * across[0] + texture.row_u[1] * across[1],
        texture.row_v[0] * across[0] + texture.row_v[1] * across[1],
    )
    down_image = wp.vec2(
        texture.row_u[0] * down[0] + texture.row_u[1] * down[1], texture.row_v[0] * down[0] + texture.row_v[1] * down[1]
    )
    if texture.mag_filter != MAG_LINEAR:
        value = sample_magnified(scene, texture, u, v, across_image, down_image)
        return wp.cw_mul(value, texture.scale) + texture.bias
    if texture.tiles >= 0:
        value = sample_tiles(scene, texture.image, texture.tiles, u, v, across_image, down_image)
        return wp.cw_mul(value, texture.scale) + texture.bias
    value = sample_footprint(scene, texture.image, u, v, across_image, down_image, texture.wrap_s, texture.wrap_t)
    return wp.cw_mul(value, texture.scale) + texture.bias


@wp.func
def texture_of(scene: wp.ref[SceneData], surface: wp.ref[Surface], row: int, is_averaged: bool) -> wp.vec4:
    """Return a texture at a surface point's own texture coordinates.

    Args:
        scene: Shading data.
        surface: Where.
        row: Of ``SceneData.textures``.
        is_averaged: Whether it is its mean over the ray's footprint.
    """
    texture = scene.textures[row]
    fallback = wp.vec4(texture.uv_fallback[0], texture.uv_fallback[1], 0.0, 0.0)
    st = eval_primvar(scene, surface, texture.primvar, fallback)
    across = wp.vec2(0.0, 0.0)
    down = wp.vec2(0.0, 0.0)
    if scene.is_filtered != 0 and is_averaged:
        across = coordinate_differential(scene, surface, texture.primvar, surface.dpdx)
        down = coordinate_differential(scene, surface, texture.primvar, surface.dpdy)
    return eval_texture(scene, texture, wp.vec2(st[0], st[1]), across, down)
