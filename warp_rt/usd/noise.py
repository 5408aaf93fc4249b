# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Noises of two coordinates as MaterialX's reference library has them, which are those of the Open Shading Language.

Reference: Perlin (2002), Improving Noise, SIGGRAPH 2002; Worley (1996), A Cellular Texture Basis Function, SIGGRAPH 96;
Jenkins (2006), lookup3.c, public domain: its final mix of three words is the hash.
"""

from __future__ import annotations

import itertools

import numpy as np

_SEED = 0xDEADBEEF + 13
_ROTATIONS = (14, 11, 25, 16, 4, 14, 24)
_SCALE = 0.6616  # brings sums of gradients about to -1..1


def final_mix(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return the hash of three words, uint32, of any one shape.

    Reference: Jenkins (2006), lookup3.c, macro ``final``.
    """
    words = [a, b, c]
    for step, count in enumerate(_ROTATIONS):
        changed, by = (2 + step) % 3, (1 + step) % 3
        turned = (words[by] << np.uint32(count)) | (words[by] >> np.uint32(32 - count))
        words[changed] = (words[changed] ^ words[by]) - turned
    return words[(2 + len(_ROTATIONS) - 1) % 3]


def hashed(*numbers: np.ndarray) -> np.ndarray:
    """Return the hash of two or three whole numbers at each place, uint32, shape [n]."""
    start = np.uint32((_SEED + 4 * len(numbers)) & 0xFFFFFFFF)
    words = [np.full(len(numbers[0]), start, np.uint32) for _ in range(3)]
    for k, number in enumerate(numbers):
        words[k] = words[k] + (number.astype(np.int64) & 0xFFFFFFFF).astype(np.uint32)
    return final_mix(*words)


def perlin(places: np.ndarray) -> np.ndarray:
    """Return gradient noise, about -1 to 1, at places of shape [n, 2]: shape [n, 4].

    The first component is the noise of one number; the three after it are those of a vector of three.
    """
    cell = np.floor(places)
    place = places - cell
    fade = place**3 * (place * (place * 6.0 - 15.0) + 10.0)
    total = np.zeros((len(places), 4))
    for corner in itertools.product((0, 1), (0, 1)):
        bits = hashed(cell[:, 0] + corner[0], cell[:, 1] + corner[1])
        weight = np.prod(np.where(corner, fade, 1.0 - fade), axis=1)
        of_vector = [(bits >> np.uint32(8 * k)) & np.uint32(0xFF) for k in range(3)]
        for k, chosen in enumerate((bits, *of_vector)):
            total[:, k] += weight * _slope(chosen, place - corner)
    return _SCALE * total


def _slope(bits: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return one of eight gradients, by the lowest bits of a hash, times the way from its corner."""
    is_x = (bits & np.uint32(7)) < 4
    first, second = np.where(is_x, place[:, 0], place[:, 1]), 2.0 * np.where(is_x, place[:, 1], place[:, 0])
    return np.where(bits & np.uint32(1), -first, first) + np.where(bits & np.uint32(2), -second, second)


def cells(places: np.ndarray) -> np.ndarray:
    """Return a number from 0 to 1 for each unit cell that places of shape [n, 2] are in: shape [n, 1]."""
    cell = np.floor(places)
    return _share(hashed(cell[:, 0], cell[:, 1]))[:, None]


def worley(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return the distance to the nearest of points, one a unit cell, by ``jitter`` off its middle: shape [n, 1]."""
    cell = np.floor(places)
    nearest = np.full(len(places), np.inf)
    for step in itertools.product((-1, 0, 1), (-1, 0, 1)):
        at = cell + step
        point = np.stack([_share(hashed(at[:, 0], at[:, 1], np.full(len(at), k))) for k in (0, 1)], axis=1)
        point = at + 0.5 + (point - 0.5) * jitter
        nearest = np.minimum(nearest, np.linalg.norm(point - places, axis=1))
    return nearest[:, None]


def _share(bits: np.ndarray) -> np.ndarray:
    return bits / float(0xFFFFFFFF)
