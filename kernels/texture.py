# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Texels to values: wrapping, sRGB decoding, filtering."""

import warp as wp

from .constants import FOOTPRINT_MAX, MAX_ANISOTROPY
from .scene_structs import ImageData, SceneData

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
def fetch_texel(scene: wp.ref[SceneData], image: ImageData, x: int, y: int) -> wp.vec4:
    """Return texel (x, y), row 0 at the bottom, decoded; alpha is never decoded. A negative index is black."""
    if x < 0 or y < 0:
        return wp.vec4(0.0, 0.0, 0.0, 0.0)
    index = image.offset + y * image.width + x
    if image.is_float != 0:
        texel = scene.texels_float[index]
        if image.is_srgb != 0:
            return wp.vec4(srgb_to_linear(texel[0]), srgb_to_linear(texel[1]), srgb_to_linear(texel[2]), texel[3])
        return texel
    bits = scene.texels_byte[index]
    r = int(bits & wp.uint32(255))
    g = int((bits >> wp.uint32(8)) & wp.uint32(255))
    b = int((bits >> wp.uint32(16)) & wp.uint32(255))
    a = float(int(bits >> wp.uint32(24))) / 255.0
    if image.is_srgb != 0:
        return wp.vec4(scene.srgb_decode[r], scene.srgb_decode[g], scene.srgb_decode[b], a)
    return wp.vec4(float(r) / 255.0, float(g) / 255.0, float(b) / 255.0, a)


@wp.func
def sample_image(scene: wp.ref[SceneData], image: ImageData, u: float, v: float, wrap_s: int, wrap_t: int) -> wp.vec4:
    """Return an image's value at (u, v), (0, 0) being the lower left corner, by bilinear interpolation.

    Texel centres lie at half integers; texels are decoded first and filtered afterwards.
    """
    x = wrap_coordinate(u, wrap_s) * float(image.width) - 0.5
    y = wrap_coordinate(v, wrap_t) * float(image.height) - 0.5
    return between_texels(scene, image, x, y, wrap_s, wrap_t)


@wp.func
def between_texels(scene: wp.ref[SceneData], image: ImageData, x: float, y: float, wrap_s: int, wrap_t: int) -> wp.vec4:
    """Return what lies between the four texels about a place, counted in texels from the centre of texel (0, 0)."""
    x_floor = wp.floor(x)
    y_floor = wp.floor(y)
    fx = x - x_floor
    fy = y - y_floor
    x0 = wrap_texel(int(x_floor), image.width, wrap_s)
    x1 = wrap_texel(int(x_floor) + 1, image.width, wrap_s)
    y0 = wrap_texel(int(y_floor), image.height, wrap_t)
    y1 = wrap_texel(int(y_floor) + 1, image.height, wrap_t)
    bottom = fetch_texel(scene, image, x0, y0) * (1.0 - fx) + fetch_texel(scene, image, x1, y0) * fx
    top = fetch_texel(scene, image, x0, y1) * (1.0 - fx) + fetch_texel(scene, image, x1, y1) * fx
    return bottom * (1.0 - fy) + top * fy


@wp.struct
class Probes:
    """How an elliptic footprint is covered: by so many trilinear look-ups along its major axis."""

    count: wp.int32
    level: wp.float32
    """0: the image itself; 1: half as wide and high, and so on."""
    reach: wp.vec2
    """From the first to the last of them, in texture coordinates."""


@wp.func
def make_probes(width: int, height: int, level_count: int, across: wp.vec2, down: wp.vec2) -> Probes:
    """Return the probes for a footprint, the parallelogram of ``across`` and ``down``, as an ellipse in an image.

    Its axes are the singular values of the footprint in texels. The minor one chooses the level, where it is as wide as
    a texel; the probes are at most a texel of that level apart. What bilinear interpolation adds to the ellipse's
    length is taken off, so that a footprint that grows from one texel on begins with probes that coincide.

    Reference: McCormack, Perry, Farkas and Jouppi (1999), Feline: Fast Elliptical Lines for Anisotropic Texture
    Mapping, SIGGRAPH 99. Differs: as many equal probes as the length needs.

    Args:
        width: Of the image [texel].
        height: Likewise.
        level_count: At least 1.
        across: Change of texture coordinates from one sample to the next across the picture.
        down: Likewise down the picture.
    """
    a = wp.vec2(across[0] * float(width), across[1] * float(height))
    b = wp.vec2(down[0] * float(width), down[1] * float(height))
    xx = a[0] * a[0] + b[0] * b[0]
    yy = a[1] * a[1] + b[1] * b[1]
    xy = a[0] * a[1] + b[0] * b[1]
    area = wp.abs(a[0] * b[1] - a[1] * b[0])
    half_difference = 0.5 * (xx - yy)
    major2 = 0.5 * (xx + yy) + wp.sqrt(half_difference * half_difference + xy * xy)
    result = Probes()
    result.count = 1
    if major2 <= 1.0:
        return result
    if not (major2 < FOOTPRINT_MAX * FOOTPRINT_MAX):
        result.level = float(level_count - 1)
        return result
    major = wp.sqrt(major2)
    texel = wp.max(wp.max(area / major, major / float(MAX_ANISOTROPY)), 1.0)
    result.level = wp.min(wp.log2(texel), float(level_count - 1))
    result.count = wp.clamp(int(wp.ceil(major / texel)), 1, MAX_ANISOTROPY)
    # The eigenvector of the greater eigenvalue, from that row of the matrix in which nothing cancels.
    axis = wp.vec2(major2 - yy, xy) if xx >= yy else wp.vec2(xy, major2 - xx)
    size = wp.length(axis)
    if size > 0.0:
        axis = axis * ((major - texel) / size)
        result.reach = wp.vec2(axis[0] / float(width), axis[1] / float(height))
    return result


# Out of line: within each input of each material it made frames without any texture 10 % slower.
@wp.func(inline=False)
def sample_footprint(
    scene: wp.ref[SceneData],
    image: int,
    u: float,
    v: float,
    across: wp.vec2,
    down: wp.vec2,
    wrap_s: int,
    wrap_t: int,
) -> wp.vec4:
    """Return an image's mean about (u, v) over a footprint; where that is within a texel, ``sample_image`` itself.

    Args:
        scene: Shading data.
        image: Row of ``SceneData.images``.
        u: Place in the image, (0, 0) being the lower left corner.
        v: Likewise.
        across: Change of (u, v) from one sample to the next across the picture.
        down: Likewise down the picture.
        wrap_s: Wrap mode of u.
        wrap_t: Wrap mode of v.
    """
    base = scene.images[image]
    probes = make_probes(base.width, base.height, base.level_count, across, down)
    if probes.count == 1 and probes.level <= 0.0:
        return sample_image(scene, base, u, v, wrap_s, wrap_t)
    lower = int(probes.level)
    share = probes.level - float(lower)
    step = probes.reach / float(wp.max(probes.count - 1, 1))
    s = u - 0.5 * probes.reach[0]
    t = v - 0.5 * probes.reach[1]
    total = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for k in range(probes.count):
        u_k = s + step[0] * float(k)
        v_k = t + step[1] * float(k)
        value = sample_image(scene, scene.images[image + lower], u_k, v_k, wrap_s, wrap_t)
        if share > 0.0:
            value = value * (1.0 - share)
            value += sample_image(scene, scene.images[image + lower + 1], u_k, v_k, wrap_s, wrap_t) * share
        total += value
    return total / float(probes.count)
