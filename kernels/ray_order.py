# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""An order for rays that come in none, so that successive ones start near each other: a radix sort of Morton codes.

By the lowest digit first. In each pass every thread of a launch counts, then places, the rays of a part of its own:
rays of the same digit stay in the order that they have, however many parts there are. What is sorted are keys, the code
of a ray above its number, so that each moves by one store.
"""

import warp as wp

from .constants import RAY_CODE_BITS, RAY_DIGITS

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.func
def spread_byte(value: int) -> int:
    """Return the lowest 8 bits of ``value``, two zero bits after each: bit i moves to bit 3 i.

    Reference: Warren (2013), Hacker's Delight, section 7-2.
    """
    bits = value & 0xFF
    bits = (bits | (bits << 8)) & 0xF00F
    bits = (bits | (bits << 4)) & 0xC30C3
    return (bits | (bits << 2)) & 0x249249


@wp.func
def ray_code(place: wp.vec3) -> int:
    """Return the Morton code of a point of the unit cube; outside of it that of the nearest cell, 0 if not finite."""
    if not wp.isfinite(place[0] + place[1] + place[2]):
        return 0
    cells = float(1 << RAY_CODE_BITS)
    x = int(wp.clamp(place[0] * cells, 0.0, cells - 1.0))
    y = int(wp.clamp(place[1] * cells, 0.0, cells - 1.0))
    z = int(wp.clamp(place[2] * cells, 0.0, cells - 1.0))
    return spread_byte(x) | (spread_byte(y) << 1) | (spread_byte(z) << 2)


@wp.func
def digit(key: wp.uint64, shift: int) -> int:
    """Return one of the RAY_DIGITS values of a digit of a key's code, which begins at bit ``shift``."""
    return int(key >> wp.uint64(32 + shift)) & (RAY_DIGITS - 1)


@wp.kernel
def code_rays(
    origins: wp.array[wp.vec3],
    low: wp.vec3,
    scale: float,
    part_bounds: wp.array[int],
    first: int,
    keys_out: wp.array[wp.uint64],
    counts_out: wp.array2d[int],
):
    """Write the keys of the rays of a part, and count the lowest digit.

    Args:
        origins: Of all rays.
        low: Corner of the cube that the codes' grid divides.
        scale: 1 / its side.
        part_bounds: Where the parts begin, and the last one ends.
        first: Part of the first thread.
        keys_out: Of all rays.
        counts_out: Keys by part and digit, 0 before.
    """
    part = first + wp.tid()
    counts = counts_out[part]
    for i in range(part_bounds[part], part_bounds[part + 1]):
        key = wp.uint64(ray_code((origins[i] - low) * scale)) << wp.uint64(32) | wp.uint64(i)
        keys_out[i] = key
        counts[digit(key, 0)] += 1


@wp.kernel
def count_digits(
    keys: wp.array[wp.uint64], part_bounds: wp.array[int], shift: int, first: int, counts_out: wp.array2d[int]
):
    """Count the keys of a part by the digit that begins at bit ``shift``; the other arguments as for ``code_rays``."""
    part = first + wp.tid()
    counts = counts_out[part]
    for i in range(part_bounds[part], part_bounds[part + 1]):
        counts[digit(keys[i], shift)] += 1


@wp.func
def place_next(places: wp.array[int], value: int) -> int:
    """Return the next place of a digit's value, and move it on."""
    place = places[value]
    places[value] = place + 1
    return place


@wp.kernel
def place_keys(
    keys: wp.array[wp.uint64],
    part_bounds: wp.array[int],
    shift: int,
    first: int,
    places: wp.array2d[int],
    keys_out: wp.array[wp.uint64],
):
    """Write the keys of a part where a digit says.

    Args:
        keys: In the order so far.
        part_bounds: See ``code_rays``.
        shift: Bit at which the digit begins.
        first: Part of the first thread.
        places: Where the next one of each part and digit comes; moved on.
        keys_out: In the next order.
    """
    part = first + wp.tid()
    own = places[part]
    for i in range(part_bounds[part], part_bounds[part + 1]):
        key = keys[i]
        keys_out[place_next(own, digit(key, shift))] = key


@wp.kernel
def place_rays(
    keys: wp.array[wp.uint64],
    part_bounds: wp.array[int],
    shift: int,
    first: int,
    places: wp.array2d[int],
    rays_out: wp.array[int],
):
    """Do what ``place_keys`` does by the last digit, of which only the rays' numbers are written."""
    part = first + wp.tid()
    own = places[part]
    for i in range(part_bounds[part], part_bounds[part + 1]):
        key = keys[i]
        rays_out[place_next(own, digit(key, shift))] = int(key & wp.uint64(0xFFFFFFFF))
