# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sample positions: a fixed low-discrepancy sequence of pixel, sample and seed alone."""

import warp as wp

# Bit patterns as typed constants: a plain literal above 2^31 would be made an int32 first.
_MIX_A, _MIX_B = wp.constant(wp.uint32(0x7FEB352D)), wp.constant(wp.uint32(0x846CA68B))
_BYTES_LOW, _BYTES_HIGH = wp.constant(wp.uint32(0x00FF00FF)), wp.constant(wp.uint32(0xFF00FF00))
_NIBBLES_LOW, _NIBBLES_HIGH = wp.constant(wp.uint32(0x0F0F0F0F)), wp.constant(wp.uint32(0xF0F0F0F0))
_PAIRS_LOW, _PAIRS_HIGH = wp.constant(wp.uint32(0x33333333)), wp.constant(wp.uint32(0xCCCCCCCC))
_BITS_LOW, _BITS_HIGH = wp.constant(wp.uint32(0x55555555)), wp.constant(wp.uint32(0xAAAAAAAA))
_TOP_BIT = wp.constant(wp.uint32(0x80000000))
_SHUFFLE_A, _SHUFFLE_B = wp.constant(wp.uint32(0x6C50B47C)), wp.constant(wp.uint32(0xB82F1E52))
_SHUFFLE_C, _SHUFFLE_D = wp.constant(wp.uint32(0xC7AFE638)), wp.constant(wp.uint32(0x8D22F6E6))
# Each domain of integration has a key of its own; the pixel's own area has the pixel's.
_LENS = wp.constant(wp.uint32(0x9E3779B9))


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
def sequence_point(index: wp.uint32, key: wp.uint32) -> wp.vec2:
    """Return a point of the (0, 2)-sequence, in [0, 1)^2, scrambled by the bits of a key: a (0, 2)-sequence again."""
    return wp.vec2(unit_float(radical_inverse(index) ^ key), unit_float(sobol_second(index) ^ hash_uint(key)))


@wp.func
def finer_bits(count: int) -> wp.uint32:
    """Return the fractional bits that are finer than the strata of a number of samples: all of them, of one sample."""
    finer = ~wp.uint32(0)
    rest = wp.uint32(count - 1)
    while rest != wp.uint32(0):
        finer = finer >> wp.uint32(1)
        rest = rest >> wp.uint32(1)
    return finer


@wp.func
def mirror_odd(bits: wp.uint32, finer: wp.uint32) -> wp.uint32:
    """Return fractional bits, mirrored within their stratum if that is an odd one."""
    if (bits & (finer + wp.uint32(1))) != wp.uint32(0):
        return bits ^ finer
    return bits


@wp.func
def mirrored_point(index: wp.uint32, key: wp.uint32, finer: wp.uint32) -> wp.vec2:
    """Return a point of the sequence, scrambled like :func:`sequence_point`, whose strata are mirrored by turns.

    Scrambling moves all points by the same within their strata, which integrals are wrong by in first order. Where each
    coordinate's odd strata are mirrored it cancels; strata, and the even chance of each place, stay what they are.

    Args:
        index: Of the point.
        key: Scrambling.
        finer: The :func:`finer_bits` of all points that are taken.

    Reference: Hickernell (2002), Obtaining O(N^(-2 + e)) Convergence for Lattice Quadrature Rules, Monte Carlo and
    Quasi-Monte Carlo Methods 2000: each coordinate's points are those of a lattice under the baker's transformation.
    """
    first = radical_inverse(index) ^ key
    second = sobol_second(index) ^ hash_uint(key)
    return wp.vec2(unit_float(mirror_odd(first, finer)), unit_float(mirror_odd(second, finer)))


@wp.func
def shuffle_index(index: wp.uint32, key: wp.uint32) -> wp.uint32:
    """Return the index of a sample in a sequence of another domain, so that the two are not correlated.

    A nested uniform permutation: the first 2^m indices become, in another order, some 2^m that follow one another from
    a multiple of 2^m on, whose points are as well distributed as the first.

    Reference: Burley (2020), Practical Hash-based Owen Scrambling, JCGT 9(4), sections 3 and 4.
    """
    x = radical_inverse(index)
    x = x + key
    x = x ^ (x * _SHUFFLE_A)
    x = x ^ (x * _SHUFFLE_B)
    x = x ^ (x * _SHUFFLE_C)
    x = x ^ (x * _SHUFFLE_D)
    return radical_inverse(x)


@wp.func
def pixel_key(x: int, y: int, seed: int) -> wp.uint32:
    """Return the scrambling of a pixel of the whole image."""
    return hash_uint(wp.uint32(x) + hash_uint(wp.uint32(y) + hash_uint(wp.uint32(seed))))


@wp.func
def branch_key(key: wp.uint32, branch: int) -> wp.uint32:
    """Return the scrambling of what springs from something with a scrambling of its own.

    That is a ray of the tree from its parent, or a light from the ray that meets the surface it is sampled for.
    """
    return hash_uint(key ^ hash_uint(wp.uint32(branch + 1)))


@wp.func
def sample_position(x: int, y: int, sample: int, sample_count: int, seed: int) -> wp.vec2:
    """Return where in its pixel a sample lies, both coordinates in [0, 1); the centre if there is only one.

    Pixels share the (0, 2)-sequence, scrambled by the bits of a hash, which keeps it a (0, 2)-sequence.
    """
    if sample_count == 1:
        return wp.vec2(0.5, 0.5)
    return sequence_point(wp.uint32(sample), pixel_key(x, y, seed))


@wp.func
def lens_position(x: int, y: int, sample: int, seed: int) -> wp.vec2:
    """Return where on the lens, the unit disk about 0, a sample of a pixel lies, whatever its place in the pixel."""
    key = hash_uint(pixel_key(x, y, seed) ^ _LENS)
    return concentric_disk(sequence_point(shuffle_index(wp.uint32(sample), key), key))


@wp.func
def concentric_disk(p: wp.vec2) -> wp.vec2:
    """Return the point of the unit disk that a point of the unit square is mapped to, areas in proportion.

    Reference: Shirley and Chiu (1997), A Low Distortion Map Between Disk and Square, JGT 2(3).
    """
    a = 2.0 * p[0] - 1.0
    b = 2.0 * p[1] - 1.0
    if a == 0.0 and b == 0.0:
        return wp.vec2(0.0, 0.0)
    if wp.abs(a) > wp.abs(b):
        turn = 0.25 * wp.pi * (b / a)
        return wp.vec2(a * wp.cos(turn), a * wp.sin(turn))
    turn = 0.5 * wp.pi - 0.25 * wp.pi * (a / b)
    return wp.vec2(b * wp.cos(turn), b * wp.sin(turn))
