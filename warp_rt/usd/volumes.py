# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which surfaces bound a volume."""

from __future__ import annotations

import numpy as np

_BLOCK = 1 << 15  # triangles at a time: what is computed on the way stays in the cache


def encloses_volume(points: np.ndarray, triangles: np.ndarray) -> bool:
    """Return whether each edge is used as often one way as the other, points at the same place being one point.

    Args:
        points: Shape [n, 3].
        triangles: Rows of points, shape [t, 3].
    """
    return bool(enclose_volumes(points, triangles, np.array([len(triangles)]))[0])


def enclose_volumes(points: np.ndarray, triangles: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return for several meshes whether each edge is used as often one way as the other: bool, shape [k].

    Meshes are often cut open along seams of texture or normals although their surface is closed, so vertices are
    told apart by position. A hash of it places each vertex in a plane, and an edge (a, b) has there the signed area of
    the triangle (0, a, b), which its opposite cancels: modulo 2^64 the areas of a closed surface sum to zero, those of
    an open one but for a probability of some 2^-60. That takes one pass, no sort, and three products a triangle.

    Args:
        points: Of all meshes, float32, shape [n, 3].
        triangles: Rows of ``points``, shape [m, 3], mesh by mesh.
        counts: Triangles of each mesh, shape [k].
    """
    bits = np.ascontiguousarray(points, np.float32) + np.float32(0)  # -0 becomes 0
    words = bits.view(np.uint32)
    x = _mix(_mix(_mix(words[:, 0].astype(np.uint64)) + words[:, 1]) + words[:, 2])
    y = _mix(x)
    filled = np.flatnonzero(counts)
    firsts = (np.cumsum(counts) - counts)[filled]
    totals = np.zeros(len(counts), np.uint64)
    for start in range(0, len(triangles), _BLOCK):
        block = np.ascontiguousarray(triangles[start : start + _BLOCK].T)
        meshes = slice(np.searchsorted(firsts, start, "right") - 1, np.searchsorted(firsts, start + block.shape[1]))
        sums = np.add.reduceat(_signed_areas(x[block], y[block]), np.maximum(firsts[meshes] - start, 0))
        totals[filled[meshes]] += sums
    return (counts > 0) & (totals == 0)


def _signed_areas(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return twice the signed area of triangles of the plane modulo 2^64: uint64, shape [m].

    Args:
        x: Of their corners, uint64, shape [3, m].
        y: The same.
    """
    return x[0] * (y[1] - y[2]) + x[1] * (y[2] - y[0]) + x[2] * (y[0] - y[1])


def _mix(words: np.ndarray) -> np.ndarray:
    """Return 64-bit words scattered by the finaliser of splitmix64 (Steele, Lea and Flood 2014)."""
    words = words + np.uint64(0x9E3779B97F4A7C15)
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))
