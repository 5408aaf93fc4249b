# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""An order for rays that come in none, so that successive ones start near each other: a radix sort of Morton codes.

By the lowest digit first. Each pass counts, then places, the rays of each part of them: rays of the same digit stay in
the order that they have, however many parts there are. What is sorted are keys, the code of a ray above its number, so
that each moves by one store.

All workers do this in launches that run side by side, and take steps, one a part and phase of a pass, from one counter
as soon as those are done that they build on. To start threads anew for each phase would take as long as the phase.
"""

import warp as wp

from .constants import RAY_CODE_BITS, RAY_DIGIT_BITS, RAY_DIGITS, SORT_STEPS, WAIT_TURNS
from .intersect_packet import COLUMNS, VECTOR_TYPES
from .native import spell_out

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

DONE_WORD = wp.constant(16)
"""Word of the steps that are done: not in the cache line of those that are taken."""

SORT_PHASES = wp.constant(3 * 3 * int(RAY_CODE_BITS) // int(RAY_DIGIT_BITS))
"""For each digit the rays are counted, what was counted is added up, and they are placed."""


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


_CODE = (
    r"""
    int ray = begin;
#if defined(__AVX512F__) && defined(__clang__) && !defined(__CUDA_ARCH__)
"""
    + VECTOR_TYPES
    + COLUMNS
    + r"""
#define WARP_RT_CELL(x) \
    __builtin_convertvector(WARP_RT_MIN(WARP_RT_MAX(x, (floats)0.0f), (floats)(CELLS - 1.0f)), ints)
#define WARP_RT_SPREAD(bits) \
    bits = (bits | (bits << 8)) & 0xF00F; \
    bits = (bits | (bits << 4)) & 0xC30C3; \
    bits = (bits | (bits << 2)) & 0x249249
    for (; ray + 16 <= end; ray += 16) {
        WARP_RT_COLUMNS((const float*)origins.data + 3 * (size_t)ray, o_x, o_y, o_z);
        const floats p_x = (o_x - low[0]) * scale, p_y = (o_y - low[1]) * scale, p_z = (o_z - low[2]) * scale;
        const floats total = p_x + p_y + p_z;
        ints x = WARP_RT_CELL(p_x * CELLS), y = WARP_RT_CELL(p_y * CELLS), z = WARP_RT_CELL(p_z * CELLS);
        WARP_RT_SPREAD(x);
        WARP_RT_SPREAD(y);
        WARP_RT_SPREAD(z);
        const ints all = (total - total == 0.0f) & (x | (y << 1) | (z << 2));
        for (int lane = 0; lane < 16; ++lane) {
            const unsigned int code = all[lane];
            ((unsigned long long*)keys_out.data)[ray + lane] = (unsigned long long)code << 32 | (ray + lane);
            ++((int*)counts.data)[code & (RAY_DIGITS - 1)];
        }
    }
}
#endif
    return ray;
"""
)


@wp.func_native(spell_out(_CODE, CELLS=float(1 << int(RAY_CODE_BITS)), RAY_DIGITS=RAY_DIGITS))
def code_sixteens(
    origins: wp.array[wp.vec3],
    low: wp.vec3,
    scale: float,
    begin: int,
    end: int,
    counts: wp.array[int],
    keys_out: wp.array[wp.uint64],
) -> int:
    """Do what ``code_rays`` does for as many rays as make whole vectors; return the first one that is left."""
    ...


@wp.func
def code_rays(
    origins: wp.array[wp.vec3],
    low: wp.vec3,
    scale: float,
    begin: int,
    end: int,
    counts: wp.array[int],
    keys_out: wp.array[wp.uint64],
):
    """Write the keys of the rays of a part, and count their lowest digit."""
    for i in range(code_sixteens(origins, low, scale, begin, end, counts, keys_out), end):
        key = wp.uint64(ray_code((origins[i] - low) * scale)) << wp.uint64(32) | wp.uint64(i)
        keys_out[i] = key
        counts[digit(key, 0)] += 1


@wp.func
def count_digits(keys: wp.array[wp.uint64], shift: int, begin: int, end: int, counts: wp.array[int]):
    """Count the keys of a part by the digit that begins at bit ``shift``."""
    for i in range(begin, end):
        counts[digit(keys[i], shift)] += 1


@wp.func
def sum_up(counts: wp.array2d[int], places_out: wp.array2d[int]):
    """Write where the first key of each part and digit comes, and set what was counted to 0."""
    total = int(0)
    for value in range(wp.int32(RAY_DIGITS)):
        for part in range(counts.shape[0]):
            places_out[part, value] = total
            total += counts[part, value]
            counts[part, value] = 0


@wp.func
def place_next(places: wp.array[int], value: int) -> int:
    """Return the next place of a digit's value, and move it on."""
    place = places[value]
    places[value] = place + 1
    return place


@wp.func
def place_keys(
    keys: wp.array[wp.uint64],
    shift: int,
    begin: int,
    end: int,
    places: wp.array[int],
    keys_out: wp.array[wp.uint64],
):
    """Write the keys of a part where their digit says."""
    for i in range(begin, end):
        key = keys[i]
        keys_out[place_next(places, digit(key, shift))] = key


@wp.func
def place_rays(
    keys: wp.array[wp.uint64], shift: int, begin: int, end: int, places: wp.array[int], rays_out: wp.array[int]
):
    """Do what ``place_keys`` does by the last digit, of which only the rays' numbers are written."""
    for i in range(begin, end):
        key = keys[i]
        rays_out[place_next(places, digit(key, shift))] = int(key & wp.uint64(0xFFFFFFFF))


_TAKE_STEP = """
#if !defined(__CUDA_ARCH__)
    int* taken = (int*)words.data;
    for (int turn = 0; turn < WAIT_TURNS; ++turn) {
        int step = __atomic_load_n(taken, __ATOMIC_RELAXED);
        const int done = __atomic_load_n(taken + DONE_WORD, __ATOMIC_ACQUIRE);
        if (done == count)
            return -1;
        if (step < count && done >= step - step % parts
            && __atomic_compare_exchange_n(taken, &step, step + 1, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED))
            return step;
    }
#endif
    return -1;
"""


@wp.func_native(spell_out(_TAKE_STEP, DONE_WORD=DONE_WORD, WAIT_TURNS=WAIT_TURNS))
def take_step(words: wp.array[int], parts: int, count: int) -> int:
    """Return a step that nobody has taken, those of earlier phases being done; for this it waits some 0.2 ms.

    Args:
        words: See ``sort_together``.
        parts: Steps of a phase.
        count: Steps of all.

    Returns:
        -1 where all are done, or it has waited in vain.
    """
    ...


_FINISH_STEP = """
#if defined(__CUDA_ARCH__)
    atomicAdd((int*)words.data + DONE_WORD, 1);
#else
    __atomic_fetch_add((int*)words.data + DONE_WORD, 1, __ATOMIC_RELEASE);
#endif
"""


@wp.func_native(spell_out(_FINISH_STEP, DONE_WORD=DONE_WORD))
def finish_step(words: wp.array[int]):
    """Tell the others of a step that is done."""
    ...


@wp.kernel
def sort_together(
    origins: wp.array[wp.vec3],
    low: wp.vec3,
    scale: float,
    part_bounds: wp.array[int],
    words: wp.array[int],
    counts: wp.array2d[int],
    places: wp.array2d[int],
    keys: wp.array2d[wp.uint64],
    rays_out: wp.array[int],
):
    """Take up to SORT_STEPS steps of the sort; end sooner where none is to be had. One thread a launch.

    Args:
        origins: Of all rays.
        low: Corner of the cube that the codes' grid divides.
        scale: 1 / its side.
        part_bounds: Where the parts begin, and the last one ends.
        words: The steps that are taken; at DONE_WORD those that are done.
        counts: Keys by part and digit, 0 before.
        places: Scratch memory, the same shape.
        keys: Scratch memory, shape [2, n].
        rays_out: The rays in their new order.
    """
    parts = part_bounds.shape[0] - 1
    for _turn in range(wp.int32(SORT_STEPS)):
        step = take_step(words, parts, parts * SORT_PHASES)
        if step < 0:
            return
        phase = step // parts
        part = step - phase * parts
        begin = part_bounds[part]
        end = part_bounds[part + 1]
        turn = phase // 3
        shift = turn * RAY_DIGIT_BITS
        source = keys[turn % 2]
        if phase == 0:
            code_rays(origins, low, scale, begin, end, counts[part], source)
        elif phase % 3 == 0:
            count_digits(source, shift, begin, end, counts[part])
        elif phase % 3 == 1:
            if part == 0:
                sum_up(counts, places)
        elif phase == SORT_PHASES - 1:
            place_rays(source, shift, begin, end, places[part], rays_out)
        else:
            place_keys(source, shift, begin, end, places[part], keys[1 - turn % 2])
        finish_step(words)
