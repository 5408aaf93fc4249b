# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Noises of the plane and of space as MaterialX's reference library has them, which are the Open Shading Language's.

Reference: Perlin (2002), Improving Noise, SIGGRAPH 2002; Worley (1996), A Cellular Texture Basis Function, SIGGRAPH 96;
Jenkins (2006), lookup3.c, public domain: the hash.
"""

import warp as wp

from .constants import HASH_SEED, NOISE_REACH, PERLIN_SCALE_2D, PERLIN_SCALE_3D, UINT32_MAX


@wp.func
def rotated(bits: wp.uint32, count: int) -> wp.uint32:
    """Return a word turned to the left."""
    return (bits << wp.uint32(count)) | (bits >> wp.uint32(32 - count))


@wp.func
def final_mix(a: wp.uint32, b: wp.uint32, c: wp.uint32) -> wp.uint32:
    """Return the hash of three words.

    Reference: Jenkins (2006), lookup3.c, macro ``final``.
    """
    c = (c ^ b) - rotated(b, 14)
    a = (a ^ c) - rotated(c, 11)
    b = (b ^ a) - rotated(a, 25)
    c = (c ^ b) - rotated(b, 16)
    a = (a ^ c) - rotated(c, 4)
    b = (b ^ a) - rotated(a, 14)
    return (c ^ b) - rotated(b, 24)


@wp.func
def hash_of(x: int, y: int, z: int, count: int) -> wp.uint32:
    """Return the hash of ``count`` whole numbers, 2 or 3; with two, ``z`` is 0."""
    seed = HASH_SEED + wp.uint32(4 * count)
    return final_mix(seed + wp.uint32(x), seed + wp.uint32(y), seed + wp.uint32(z))


@wp.func
def share(bits: wp.uint32) -> float:
    """Return a word as a number from 0 to 1."""
    return float(bits) / UINT32_MAX


@wp.func
def hashed_vector(x: int, y: int, z: int) -> wp.vec3:
    """Return three numbers from 0 to 1 for a cell of space: the hashes of its numbers and 0, 1 or 2.

    Reference: Jenkins (2006), lookup3.c, macros ``mix`` and ``final``.
    """
    seed = HASH_SEED + wp.uint32(16)
    a = seed + wp.uint32(x)
    b = seed + wp.uint32(y)
    c = seed + wp.uint32(z)
    a = (a - c) ^ rotated(c, 4)
    c = c + b
    b = (b - a) ^ rotated(a, 6)
    a = a + c
    c = (c - b) ^ rotated(b, 8)
    b = b + a
    a = (a - c) ^ rotated(c, 16)
    c = c + b
    b = (b - a) ^ rotated(a, 19)
    a = a + c
    c = (c - b) ^ rotated(b, 4)
    b = b + a
    return wp.vec3(
        share(final_mix(a, b, c)), share(final_mix(a + wp.uint32(1), b, c)), share(final_mix(a + wp.uint32(2), b, c))
    )


@wp.func
def cell_of(x: float) -> int:
    """Return the whole number at or below one; of those too large to count, the largest."""
    return int(wp.clamp(wp.floor(x), -NOISE_REACH, NOISE_REACH))


@wp.func
def fade(t: float) -> float:
    """Return a step from 0 to 1 whose first and second derivatives vanish at both ends."""
    return t * t * t * (t * (t * 6.0 - 15.0) + 10.0)


@wp.func
def slope_2d(bits: wp.uint32, x: float, y: float) -> float:
    """Return the product of a vector with one of eight gradients, which the lowest bits choose."""
    u = x
    v = y
    if (bits & wp.uint32(7)) >= wp.uint32(4):
        u = y
        v = x
    if (bits & wp.uint32(1)) != wp.uint32(0):
        u = -u
    if (bits & wp.uint32(2)) != wp.uint32(0):
        v = -v
    return u + 2.0 * v


@wp.func
def slope_3d(bits: wp.uint32, x: float, y: float, z: float) -> float:
    """Return the product of a vector with one of the gradients to the edges of a cube, which the lowest bits choose."""
    chosen = bits & wp.uint32(15)
    u = x
    if chosen >= wp.uint32(8):
        u = y
    v = z
    if chosen < wp.uint32(4):
        v = y
    if chosen == wp.uint32(12) or chosen == wp.uint32(14):
        v = x
    if (chosen & wp.uint32(1)) != wp.uint32(0):
        u = -u
    if (chosen & wp.uint32(2)) != wp.uint32(0):
        v = -v
    return u + v


@wp.func(inline=False)
def perlin_2d(p: wp.vec2, size: int) -> wp.vec4:
    """Return gradient noise of the plane, about -1 to 1, of ``size`` components, 1 to 3."""
    x = cell_of(p[0])
    y = cell_of(p[1])
    s = p[0] - wp.floor(p[0])
    t = p[1] - wp.floor(p[1])
    u = fade(s)
    v = fade(t)
    total = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for corner in range(wp.int32(4)):
        i = corner & 1
        j = corner >> 1
        bits = hash_of(x + i, y + j, 0, 2)
        weight = (u if i == 1 else 1.0 - u) * (v if j == 1 else 1.0 - v)
        for k in range(size):
            total[k] += weight * slope_2d(bits >> wp.uint32(8 * k), s - float(i), t - float(j))
    return total * PERLIN_SCALE_2D


@wp.func(inline=False)
def perlin_3d(p: wp.vec3, size: int) -> wp.vec4:
    """Return gradient noise of space, about -1 to 1, of ``size`` components, 1 to 3."""
    x = cell_of(p[0])
    y = cell_of(p[1])
    z = cell_of(p[2])
    s = p[0] - wp.floor(p[0])
    t = p[1] - wp.floor(p[1])
    r = p[2] - wp.floor(p[2])
    u = fade(s)
    v = fade(t)
    w = fade(r)
    total = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for corner in range(wp.int32(8)):
        i = corner & 1
        j = (corner >> 1) & 1
        k = corner >> 2
        bits = hash_of(x + i, y + j, z + k, 3)
        weight = (u if i == 1 else 1.0 - u) * (v if j == 1 else 1.0 - v) * (w if k == 1 else 1.0 - w)
        for n in range(size):
            total[n] += weight * slope_3d(bits >> wp.uint32(8 * n), s - float(i), t - float(j), r - float(k))
    return total * PERLIN_SCALE_3D


@wp.func
def cell_vector(x: int, y: int, z: int, count: int) -> wp.vec3:
    """Return three numbers from 0 to 1 for a cell of the plane (``count`` 2) or of space (3)."""
    if count == 2:
        return wp.vec3(share(hash_of(x, y, 0, 3)), share(hash_of(x, y, 1, 3)), share(hash_of(x, y, 2, 3)))
    return hashed_vector(x, y, z)


@wp.func(inline=False)
def worley(p: wp.vec3, jitter: float, count: int, size: int, is_solid: bool) -> wp.vec4:
    """Return what the points, one a unit cell about a place and those beside it, say of the place.

    Args:
        p: The place; of the plane, with a third coordinate of 0.
        jitter: How far points may lie off the middles of their cells.
        count: 2 for cells of the plane, 3 for those of space.
        size: Components, 1 to 3.
        is_solid: Whether numbers of the nearest point's cell are wanted, not the distances to the nearest points.
    """
    x = cell_of(p[0])
    y = cell_of(p[1])
    z = cell_of(p[2])
    local = wp.vec3(p[0] - wp.floor(p[0]), p[1] - wp.floor(p[1]), p[2] - wp.floor(p[2]))
    half = wp.vec3(0.5, 0.5, 0.5)
    if count == 2:
        half = wp.vec3(0.5, 0.5, 0.0)
    found = wp.vec4(1.0e6, 1.0e6, 1.0e6, 0.0)
    nearest = wp.vec3(0.0, 0.0, 0.0)
    for step in range(9 if count == 2 else 27):
        i = step % 3 - 1
        j = (step // 3) % 3 - 1
        k = 0 if count == 2 else step // 9 - 1
        off = cell_vector(x + i, y + j, z + k, count) - half
        if count == 2:
            off[2] = 0.0
        away = wp.vec3(float(i), float(j), float(k)) + off * jitter + half - local
        distance = wp.dot(away, away)
        if distance < found[0]:
            found = wp.vec4(distance, found[0], found[1], 0.0)
            nearest = away
        elif distance < found[1]:
            found = wp.vec4(found[0], distance, found[1], 0.0)
        elif distance < found[2]:
            found[2] = distance
    if is_solid:
        at = p + nearest
        if size == 1:
            bits = hash_of(cell_of(at[0]), cell_of(at[1]), cell_of(at[2]) if count == 3 else 0, count)
            return wp.vec4(share(bits), 0.0, 0.0, 0.0)
        numbers = cell_vector(cell_of(at[0]), cell_of(at[1]), cell_of(at[2]), count)
        return wp.vec4(numbers[0], numbers[1], numbers[2], 0.0)
    return wp.vec4(wp.sqrt(found[0]), wp.sqrt(found[1]), wp.sqrt(found[2]), 0.0)
