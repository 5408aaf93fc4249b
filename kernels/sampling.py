# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sub-pixel sample positions: a fixed low-discrepancy sequence of pixel, sample and seed alone."""

import warp as wp

# Bit patterns as typed constants: a plain literal above 2^31 would be made an int32 first.
_MIX_A, _MIX_B = wp.constant(wp.uint32(0x7FEB352D)), wp.constant(wp.uint32(0x846CA68B))
_BYTES_LOW, _BYTES_HIGH = wp.constant(wp.uint32(0x00FF00FF)), wp.constant(wp.uint32(0xFF00FF00))
_NIBBLES_LOW, _NIBBLES_HIGH = wp.constant(wp.uint32(0x0F0F0F0F)), wp.constant(wp.uint32(0xF0F0F0F0))
_PAIRS_LOW, _PAIRS_HIGH = wp.constant(wp.uint32(0x33333333)), wp.constant(wp.uint32(0xCCCCCCCC))
_BITS_LOW, _BITS_HIGH = wp.constant(wp.uint32(0x55555555)), wp.constant(wp.uint32(0xAAAAAAAA))
_TOP_BIT = wp.constant(wp.uint32(0x80000000))


@wp.func
def hash_uint(x: wp.uint32) -> wp.uint32:
    """Return a well mixed permutation of 32 bits.

    Reference: Wellons (2018), Prospecting for Hash Functions, the function lowbias32.
    """
    x = x ^ (x >> wp.uint32(16))
    x = x * _MIX_A
    x = x ^ (x >> wp.uint32(15))
    x = x * _MIX_B
    return x ^ (x >> wp.uint32(16))


@wp.func
def unit_float(bits: wp.uint32) -> float:
    """Return bits as a number in [0, 1): the upper 24, which float32 holds exactly."""
    return float(bits >> wp.uint32(8)) * (1.0 / 16777216.0)


@wp.func
def radical_inverse(index: wp.uint32) -> wp.uint32:
    """Return the base-2 radical inverse of ``index`` as 32 fractional bits (van der Corput).

    Reference: Kollig and Keller (2002), Efficient Multidimensional Sampling, CGF 21(3), appendix.
    """
    x = (index << wp.uint32(16)) | (index >> wp.uint32(16))
    x = ((x & _BYTES_LOW) << wp.uint32(8)) | ((x & _BYTES_HIGH) >> wp.uint32(8))
    x = ((x & _NIBBLES_LOW) << wp.uint32(4)) | ((x & _NIBBLES_HIGH) >> wp.uint32(4))
    x = ((x & _PAIRS_LOW) << wp.uint32(2)) | ((x & _PAIRS_HIGH) >> wp.uint32(2))
    return ((x & _BITS_LOW) << wp.uint32(1)) | ((x & _BITS_HIGH) >> wp.uint32(1))


@wp.func
def sobol_second(index: wp.uint32) -> wp.uint32:
    """Return the second dimension of Sobol's sequence as 32 fractional bits; with the first, a (0, 2)-sequence.

    Reference: Kollig and Keller (2002), Efficient Multidimensional Sampling, CGF 21(3), appendix.
    """
    result = wp.uint32(0)
    direction = wp.uint32(_TOP_BIT)
    rest = index
    while rest != wp.uint32(0):
        if (rest & wp.uint32(1)) != wp.uint32(0):
            result = result ^ direction
        direction = direction ^ (direction >> wp.uint32(1))
        rest = rest >> wp.uint32(1)
    return result


@wp.func
def sample_position(x: int, y: int, sample: int, sample_count: int, seed: int) -> wp.vec2:
    """Return where in its pixel a sample lies, both coordinates in [0, 1); the centre if there is only one.

    Pixels share the (0, 2)-sequence, scrambled by the bits of a hash, which keeps it a (0, 2)-sequence.
    """
    if sample_count == 1:
        return wp.vec2(0.5, 0.5)
    key = hash_uint(wp.uint32(x) + hash_uint(wp.uint32(y) + hash_uint(wp.uint32(seed))))
    index = wp.uint32(sample)
    u = radical_inverse(index) ^ key
    v = sobol_second(index) ^ hash_uint(key)
    return wp.vec2(unit_float(u), unit_float(v))
