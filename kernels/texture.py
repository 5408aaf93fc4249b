# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Texels to values: wrapping, sRGB decoding, bilinear filtering, scale and bias."""

import warp as wp

from .structs import ImageData, SceneData, TextureData

WRAP_BLACK = wp.constant(0)
WRAP_CLAMP = wp.constant(1)
WRAP_REPEAT = wp.constant(2)
WRAP_MIRROR = wp.constant(3)


@wp.func
def wrap_texel(index: int, size: int, mode: int) -> int:
    """Return the texel that stands for texel ``index`` of an axis of ``size`` texels; -1: black."""
    if index >= 0 and index < size:
        return index
    if mode == WRAP_CLAMP:
        return wp.clamp(index, 0, size - 1)
    if mode == WRAP_REPEAT:
        return index - size * int(wp.floor(float(index) / float(size)))
    if mode == WRAP_MIRROR:
        period = 2 * size
        k = index - period * int(wp.floor(float(index) / float(period)))
        return k if k < size else period - 1 - k
    return -1


@wp.func
def wrap_coordinate(s: float, mode: int) -> float:
    """Return ``s`` with whole periods of the wrap mode taken off, so that texel numbers stay small.

    Black and clamp have no period: there everything beyond one texel outside is alike, hence the bounds. What is not
    finite has no place in a texture; it counts as 0.
    """
    if not wp.isfinite(s):
        return 0.0
    if mode == WRAP_REPEAT:
        return s - wp.floor(s)
    if mode == WRAP_MIRROR:
        return s - 2.0 * wp.floor(0.5 * s)
    return wp.clamp(s, -2.0, 3.0)


@wp.func
def srgb_to_linear(value: float) -> float:
    """Return the linear value of an sRGB encoded one.

    Reference: IEC 61966-2-1:1999, section 5.2.
    """
    if value <= 0.04045:
        return value / 12.92
    return wp.pow((value + 0.055) / 1.055, 2.4)


@wp.func
def fetch_texel(scene: wp.ref[SceneData], image: ImageData, x: int, y: int, is_srgb: int) -> wp.vec4:
    """Return texel (x, y), row 0 at the bottom, decoded; alpha is never decoded. A negative index is black."""
    if x < 0 or y < 0:
        return wp.vec4(0.0, 0.0, 0.0, 0.0)
    index = image.offset + y * image.width + x
    if image.is_float != 0:
        texel = scene.texels_float[index]
        if is_srgb != 0:
            return wp.vec4(srgb_to_linear(texel[0]), srgb_to_linear(texel[1]), srgb_to_linear(texel[2]), texel[3])
        return texel
    bits = scene.texels_byte[index]
    r = int(bits & wp.uint32(255))
    g = int((bits >> wp.uint32(8)) & wp.uint32(255))
    b = int((bits >> wp.uint32(16)) & wp.uint32(255))
    a = float(int(bits >> wp.uint32(24))) / 255.0
    if is_srgb != 0:
        return wp.vec4(scene.srgb_decode[r], scene.srgb_decode[g], scene.srgb_decode[b], a)
    return wp.vec4(float(r) / 255.0, float(g) / 255.0, float(b) / 255.0, a)


@wp.func
def sample_image(
    scene: wp.ref[SceneData], image: ImageData, u: float, v: float, wrap_s: int, wrap_t: int, is_srgb: int
) -> wp.vec4:
    """Return an image's value at (u, v), (0, 0) being the lower left corner, by bilinear interpolation.

    Texel centres lie at half integers; texels are decoded first and filtered afterwards.
    """
    x = wrap_coordinate(u, wrap_s) * float(image.width) - 0.5
    y = wrap_coordinate(v, wrap_t) * float(image.height) - 0.5
    x_floor = wp.floor(x)
    y_floor = wp.floor(y)
    fx = x - x_floor
    fy = y - y_floor
    x0 = wrap_texel(int(x_floor), image.width, wrap_s)
    x1 = wrap_texel(int(x_floor) + 1, image.width, wrap_s)
    y0 = wrap_texel(int(y_floor), image.height, wrap_t)
    y1 = wrap_texel(int(y_floor) + 1, image.height, wrap_t)
    bottom = fetch_texel(scene, image, x0, y0, is_srgb) * (1.0 - fx) + fetch_texel(scene, image, x1, y0, is_srgb) * fx
    top = fetch_texel(scene, image, x0, y1, is_srgb) * (1.0 - fx) + fetch_texel(scene, image, x1, y1, is_srgb) * fx
    return bottom * (1.0 - fy) + top * fy


@wp.func
def eval_texture(scene: wp.ref[SceneData], texture: TextureData, uv: wp.vec2) -> wp.vec4:
    """Return decode(texel) * scale + bias at texture coordinates ``uv``; the unscaled fallback without an image.

    Reference: UsdPreviewSurface Specification, UsdUVTexture.
    """
    if texture.image < 0:
        return texture.fallback
    p = wp.vec3(uv[0], uv[1], 1.0)
    value = sample_image(
        scene,
        scene.images[texture.image],
        wp.dot(texture.row_u, p),
        wp.dot(texture.row_v, p),
        texture.wrap_s,
        texture.wrap_t,
        texture.is_srgb,
    )
    return wp.cw_mul(value, texture.scale) + texture.bias
