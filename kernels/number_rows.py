# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rows of GROUP numbers, a column for each ray of a group: what native functions compute with, sixteen at a time."""

import warp as wp

from .constants import GROUP
from .ray_group import group_vector

NUMBERS = r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    enum { LANES = 1 };
    typedef float number;
    typedef float number_load;
#define WARP_RT_ABS(x) wp::abs(x)
#define WARP_RT_SQRT(x) wp::sqrt(x)
#else
#pragma clang fp contract(off)
    enum { LANES = 16 };
    typedef float number __attribute__((ext_vector_type(16)));
    typedef float number_load __attribute__((ext_vector_type(16), aligned(4)));
#define WARP_RT_ABS(x) __builtin_elementwise_abs(x)
#define WARP_RT_SQRT(x) __builtin_elementwise_sqrt(x)
#endif
    typedef wp::vec_t<3, number> vector;
#define WARP_RT_NUMBER(p) ((number)*(const number_load*)(p))
#define WARP_RT_VECTOR(p, step) \
    vector(WARP_RT_NUMBER(p), WARP_RT_NUMBER((p) + (step)), WARP_RT_NUMBER((p) + 2 * (step)))
#define WARP_RT_KEEP(p, x) (*(number_load*)(p) = (x))
#define WARP_RT_KEEP_VECTOR(p, step, x) \
    (WARP_RT_KEEP(p, (x)[0]), WARP_RT_KEEP((p) + (step), (x)[1]), WARP_RT_KEEP((p) + 2 * (step), (x)[2]))
#define WARP_RT_CHOOSE(test, x, y) ((test) ? (x) : (y))
#define WARP_RT_GREATER(a, b) WARP_RT_CHOOSE((a) > (b), a, b)
"""
"""At the beginning of a block of a native function: ``number`` is a float on a GPU and sixteen on a CPU, ``vector``
three of them, for which Warp's own operators stand in the order of Warp's own code."""


@wp.func
def row_int(rows: wp.array[float], row: int, slot: int) -> int:
    """Return a whole number that stands in a row of numbers."""
    return wp.cast(rows[row * GROUP + slot], wp.int32)


@wp.func
def row_vector(rows: wp.array[float], row: int, slot: int) -> wp.vec3:
    """Return a vector that stands in three rows of numbers."""
    return group_vector(rows, row * GROUP + slot, GROUP)


@wp.func
def set_row(rows: wp.array[float], row: int, slot: int, v: wp.vec3):
    """Write a vector to three rows of numbers."""
    for axis in range(3):
        rows[(row + axis) * GROUP + slot] = v[axis]
