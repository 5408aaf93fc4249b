# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Morton codes: positions along a space-filling curve, by interleaving the bits of three coordinates."""

import warp as wp

from .constants import MORTON_BITS


@wp.func
def spread_bits(value: wp.uint64) -> wp.uint64:
    """Return the lowest 21 bits of ``value``, two zero bits after each: bit i moves to bit 3 i.

    Reference: Warren (2013), Hacker's Delight, section 7-2, extended to 64 bits.
    """
    bits = value & wp.uint64(0x1FFFFF)
    bits = (bits | (bits << wp.uint64(32))) & wp.uint64(0x1F00000000FFFF)
    bits = (bits | (bits << wp.uint64(16))) & wp.uint64(0x1F0000FF0000FF)
    bits = (bits | (bits << wp.uint64(8))) & wp.uint64(0x100F00F00F00F00F)
    bits = (bits | (bits << wp.uint64(4))) & wp.uint64(0x10C30C30C30C30C3)
    bits = (bits | (bits << wp.uint64(2))) & wp.uint64(0x1249249249249249)
    return bits


@wp.func
def morton_cell(position: float) -> wp.uint64:
    """Return the cell of a coordinate in [0, 1] on the grid of 2^21 cells."""
    cells = float(1 << MORTON_BITS)
    return wp.uint64(wp.clamp(position * cells, 0.0, cells - 1.0))


@wp.func
def morton_code(position: wp.vec3) -> wp.uint64:
    """Return the 63-bit Morton code of a point of the unit cube; x holds the lowest bits.

    Reference: Lauterbach et al. (2009), Fast BVH Construction on GPUs, Eurographics, section 4.
    """
    return (
        spread_bits(morton_cell(position[0]))
        | (spread_bits(morton_cell(position[1])) << wp.uint64(1))
        | (spread_bits(morton_cell(position[2])) << wp.uint64(2))
    )
