# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Noises of the plane as MaterialX's reference library has them, which are those of the Open Shading Language.

Reference: Perlin (2002), Improving Noise, SIGGRAPH 2002; Worley (1996), A Cellular Texture Basis Function, SIGGRAPH 96;
Jenkins (2006), lookup3.c, public domain: its final mix of three words is the hash.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

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


class _Lattice:
    """What a function gives for cells of the plane about places: asked once a cell where places share them.

    Args:
        cell: The whole numbers of the places' cells, float64, shape [2, n].
        reach: Least and greatest step from there that is asked for.
        function: Gives of whole numbers of shape [2, m] an array of shape [k, m].
    """

    def __init__(self, cell: np.ndarray, reach: tuple[int, int], function: Callable[[np.ndarray], np.ndarray]) -> None:
        self._cell = cell
        self._function = function
        self._table: np.ndarray | None = None
        low = cell.min(axis=1, initial=np.inf) + reach[0]
        size = cell.max(axis=1, initial=-np.inf) + reach[1] - low + 1.0
        if size.prod() <= cell.shape[1]:  # nor where any is no number
            self._width = int(size[0])
            x, y = np.meshgrid(low[0] + np.arange(size[0]), low[1] + np.arange(size[1]))
            self._table = function(np.stack([x.ravel(), y.ravel()]))
            self._column = ((cell[1] - low[1]) * size[0] + (cell[0] - low[0])).astype(np.int64)

    def at(self, step: tuple[int, int]) -> np.ndarray:
        """Return what the function gives so many cells away from each place, shape [k, n]."""
        if self._table is None:
            return self._function(self._cell + np.array(step)[:, None])
        return self._table.take(self._column + (step[1] * self._width + step[0]), axis=1)


def perlin(places: np.ndarray) -> np.ndarray:
    """Return gradient noise of one number, about -1 to 1, at places of shape [n, 2]: shape [n, 1]."""
    return _perlin(places, lambda bits: [bits])


def perlin_vector(places: np.ndarray) -> np.ndarray:
    """Return gradient noise of a vector of three, as ``perlin`` of one number: shape [n, 3]."""
    return _perlin(places, lambda bits: [(bits >> np.uint32(8 * k)) & np.uint32(0xFF) for k in range(3)])


def _perlin(places: np.ndarray, split: Callable[[np.ndarray], list[np.ndarray]]) -> np.ndarray:
    """Return gradient noise of as many components as ``split`` makes of the hash of a corner: shape [n, k]."""
    place = np.ascontiguousarray(places.T)
    cell = np.floor(place)
    place = place - cell
    fade = place**3 * (place * (place * 6.0 - 15.0) + 10.0)
    shares = (1.0 - fade, fade)

    def gradients(corners: np.ndarray) -> np.ndarray:
        return np.concatenate([_gradient(bits) for bits in split(hashed(*corners))])

    lattice, total = _Lattice(cell, (0, 1), gradients), np.zeros(1)
    for corner in itertools.product((0, 1), (0, 1)):
        found = lattice.at(corner)
        slope = found[::2] * (place[0] - corner[0]) + found[1::2] * (place[1] - corner[1])
        total = total + slope * (shares[corner[0]][0] * shares[corner[1]][1])
    return np.asarray(_SCALE * total.T)


def _gradient(bits: np.ndarray) -> np.ndarray:
    """Return one of eight gradients, by the lowest bits of a hash: shape [2, n]."""
    is_x = (bits & np.uint32(7)) < 4
    first = np.where(bits & np.uint32(1), -1.0, 1.0)
    second = np.where(bits & np.uint32(2), -2.0, 2.0)
    return np.stack([np.where(is_x, first, second), np.where(is_x, second, first)])


def cells(places: np.ndarray) -> np.ndarray:
    """Return a number from 0 to 1 for each unit cell that places of shape [n, 2] are in: shape [n, 1]."""
    return _share(hashed(*np.floor(places.T)))[:, None]


def worley(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return the distance to the nearest of points, one a unit cell about each place and those beside it: shape [n, 1].

    Args:
        places: Shape [n, 2].
        jitter: How far points may lie off the middles of their cells, shape [n, 1].
    """
    return _worley(places, jitter, 1)


def worley_vector(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return the distances to the three nearest points, in order, as ``worley`` that to one: shape [n, 3]."""
    return _worley(places, jitter, 3)


def _worley(places: np.ndarray, jitter: np.ndarray, count: int) -> np.ndarray:
    place = np.ascontiguousarray(places.T)
    cell = np.floor(place)
    place = place - cell

    def points(at: np.ndarray) -> np.ndarray:
        return np.stack([_share(hashed(*at, np.full(at.shape[1], k))) for k in (0, 1)]) - 0.5

    lattice, nearest = _Lattice(cell, (-1, 1), points), np.full((count, len(places)), np.inf)
    for step in itertools.product((-1, 0, 1), (-1, 0, 1)):
        away = lattice.at(step) * jitter.T + (np.add(step, 0.5)[:, None] - place)
        found = away[0] ** 2 + away[1] ** 2
        for k in range(count - 1):
            nearest[k], found = np.minimum(nearest[k], found), np.maximum(nearest[k], found)
        nearest[-1] = np.minimum(nearest[-1], found)
    return np.sqrt(nearest.T)


def _share(bits: np.ndarray) -> np.ndarray:
    return bits / float(0xFFFFFFFF)
