# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Noises of space, as those of the plane in ``noise``; and the numbers of the cells that points of both are in.

Kernels compute them where rays hit (``warp_rt.kernels.noise``); these are of constants, and what tests hold those to.
"""

from __future__ import annotations

import itertools

import numpy as np

from warp_rt.usd.noise import final_mix, hashed

_SEED = 0xDEADBEEF + 13
_SCALE = 0.9820  # brings sums of gradients about to -1..1
_MIX = (4, 6, 8, 16, 19, 4)  # rotations
_FAR = 1e6  # squared distance of points that are not there, as in the reference library


def perlin_solid(places: np.ndarray) -> np.ndarray:
    """Return gradient noise of one number, about -1 to 1, at places of shape [n, 3]: shape [n, 1]."""
    return perlin_solid_vector(places)[:, :1]


def perlin_solid_vector(places: np.ndarray) -> np.ndarray:
    """Return gradient noise of a vector of three, of which the first is ``perlin_solid``: shape [n, 3]."""
    place = np.asarray(places, float).T
    cell = np.floor(place)
    place = place - cell
    fade = place**3 * (place * (place * 6.0 - 15.0) + 10.0)
    shares = (1.0 - fade, fade)
    total = np.zeros((3, place.shape[1]))
    for corner in itertools.product((0, 1), repeat=3):
        bits = hashed(*(cell + np.array(corner)[:, None]))
        weight = shares[corner[0]][0] * shares[corner[1]][1] * shares[corner[2]][2]
        to_corner = place - np.array(corner)[:, None]
        for k in range(3):
            total[k] += weight * _slope(bits >> np.uint32(8 * k), *to_corner)
    return np.asarray(_SCALE * total.T)


def _slope(bits: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the product of vectors with one of the gradients to the edges of a cube, by the lowest bits of a hash.

    Reference: Perlin (2002), Improving Noise.
    """
    chosen = bits & np.uint32(15)
    u = np.where(chosen < 8, x, y)
    v = np.where(chosen < 4, y, np.where((chosen == 12) | (chosen == 14), x, z))
    return np.where(bits & np.uint32(1), -u, u) + np.where(bits & np.uint32(2), -v, v)


def cells_solid(places: np.ndarray) -> np.ndarray:
    """Return a number from 0 to 1 for each unit cube that places of shape [n, 3] are in: shape [n, 1]."""
    return _share(hashed(*np.floor(places.T)))[:, None]


def worley_solid(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return the distance to the nearest of points, one a unit cube about each place and those beside it: shape [n, 1].

    Args:
        places: Shape [n, 3].
        jitter: How far points may lie off the middles of their cubes, shape [n, 1].
    """
    return worley_solid_vector(places, jitter)[:, :1]


def worley_solid_vector(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return the distances to the three nearest points, in order: shape [n, 3]."""
    return _nearest(places, jitter)[0]


def worley_solid_cells(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return a number from 0 to 1 for the cube whose point is nearest: shape [n, 1]."""
    return cells_solid(_nearest(places, jitter)[1])


def worley_solid_cells_vector(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return three numbers from 0 to 1 for the cube whose point is nearest: shape [n, 3]."""
    return cell_numbers(_nearest(places, jitter)[1])


def worley_cells(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return a number from 0 to 1 for the cell of the plane whose point is nearest: shape [n, 1]."""
    return _share(hashed(*np.floor(_nearest(places, jitter)[1].T)))[:, None]


def worley_cells_vector(places: np.ndarray, jitter: np.ndarray) -> np.ndarray:
    """Return three numbers from 0 to 1 for the cell of the plane whose point is nearest: shape [n, 3]."""
    return cell_numbers(_nearest(places, jitter)[1])


def _nearest(places: np.ndarray, jitter: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances to the three nearest points, shape [n, 3], and where the first of them is, shape [n, d]."""
    places = np.asarray(places, float)
    cell = np.floor(places)
    count, size = places.shape
    distances, nearest = np.full((count, 3), _FAR), places.copy()
    for step in itertools.product((-1, 0, 1), repeat=size):
        numbers = cell_numbers(cell + step)[:, :size]
        point = cell + step + (numbers - 0.5) * jitter + 0.5
        found = ((point - places) ** 2).sum(axis=1)
        nearest = np.where((found < distances[:, 0])[:, None], point, nearest)
        distances = np.sort(np.column_stack([distances, found]), axis=1)[:, :3]
    return np.sqrt(distances), nearest


def cell_numbers(places: np.ndarray) -> np.ndarray:
    """Return three numbers from 0 to 1 for the cells of the plane or of space that places of shape [n, d] are in."""
    cell = np.floor(places.T)
    if len(cell) == 2:
        return np.stack([_share(hashed(*cell, np.full(cell.shape[1], k))) for k in range(3)], axis=1)
    seed = np.uint32((_SEED + 16) & 0xFFFFFFFF)
    words = [seed + (row.astype(np.int64) & 0xFFFFFFFF).astype(np.uint32) for row in cell]
    for step, count in enumerate(_MIX):
        # Jenkins (2006), lookup3.c, macro ``mix``: each word in turn, by the one before it and the one after.
        at, before, after = step % 3, (step + 2) % 3, (step + 1) % 3
        turned = (words[before] << np.uint32(count)) | (words[before] >> np.uint32(32 - count))
        words[at] = (words[at] - words[before]) ^ turned
        words[before] = words[before] + words[after]
    a, b, c = words
    return np.stack([_share(final_mix(a + np.uint32(k), b, c)) for k in range(3)], axis=1)


def _share(bits: np.ndarray) -> np.ndarray:
    return np.asarray(bits / float(0xFFFFFFFF))
