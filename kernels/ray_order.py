# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""An order for rays that come in none, so that successive ones start near each other: a radix sort of Morton codes.

By the lowest digit first. In each pass every thread of a launch counts, then places, the rays of a part of its own:
rays of the same digit stay in the order that they have, however many parts there are.
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


@wp.kernel
def code_rays(origins: wp.array[wp.vec3], low: wp.vec3, scale: float, first: int, codes_out: wp.array[int]):
    """Write the code of a ray's origin on the grid of a cube with a corner at ``low`` and sides of 1 / ``scale``."""
    i = first + wp.tid()
    codes_out[i] = ray_code((origins[i] - low) * scale)


@wp.func
def digit(code: int, shift: int) -> int:
    """Return one of the RAY_DIGITS values of a digit of a code, which begins at bit ``shift``."""
    return (code >> shift) & (RAY_DIGITS - 1)


@wp.kernel
def count_digits(codes: wp.array[int], part_bounds: wp.array[int], shift: int, first: int, counts_out: wp.array2d[int]):
    """Count the codes of a part by one of their digits.

    Args:
        codes: Of all rays.
        part_bounds: Where the parts begin, and the last one ends.
        shift: Bit at which the digit begins.
        first: Part of the first thread.
        counts_out: Codes by part and digit, 0 before.
    """
    part = first + wp.tid()
    for i in range(part_bounds[part], part_bounds[part + 1]):
        value = digit(codes[i], shift)
        counts_out[part, value] = counts_out[part, value] + 1


@wp.kernel
def place_rays(
    codes: wp.array[int],
    rays: wp.array[int],
    part_bounds: wp.array[int],
    shift: int,
    first: int,
    places: wp.array2d[int],
    codes_out: wp.array[int],
    rays_out: wp.array[int],
):
    """Write the codes and rays of a part where their digit says.

    Args:
        codes: In the order so far.
        rays: Likewise, the rays that they are of.
        part_bounds: See ``count_digits``.
        shift: Likewise.
        first: Part of the first thread.
        places: Where the next one of each part and digit comes; moved on.
        codes_out: In the next order.
        rays_out: Likewise.
    """
    part = first + wp.tid()
    for i in range(part_bounds[part], part_bounds[part + 1]):
        value = digit(codes[i], shift)
        place = places[part, value]
        places[part, value] = place + 1
        codes_out[place] = codes[i]
        rays_out[place] = rays[i]
