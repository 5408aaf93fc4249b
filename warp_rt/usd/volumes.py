# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which surfaces bound a volume."""

from __future__ import annotations

import numpy as np

_BLOCK = 1 << 18  # triangles at a time: bounds the temporary arrays to some ten megabytes, however large the mesh


def encloses_volume(points: np.ndarray, triangles: np.ndarray) -> bool:
    """Return whether each edge is used as often one way as the other, points at the same place being one point."""
    return bool(enclose_volumes(points, triangles, np.array([len(triangles)]))[0])


def enclose_volumes(points: np.ndarray, triangles: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return for several meshes whether each edge is used as often one way as the other: bool, shape [k].

    Meshes are often cut open along seams of texture or normals although their surface is closed, so vertices are
    told apart by position. Every directed edge adds a 64-bit hash of its ends, with the sign of its direction: the
    sum is zero for a closed surface, and for an open one with a probability of 2^-64. That takes one pass, no sort.

    Args:
        points: Of all meshes, float32, shape [n, 3].
        triangles: Rows of ``points``, shape [m, 3], mesh by mesh.
        counts: Triangles of each mesh, shape [k].
    """
    bits = np.ascontiguousarray(points, np.float32) + np.float32(0)  # -0 becomes 0
    words = bits.view(np.uint32)
    key = _mix(_mix(_mix(words[:, 0].astype(np.uint64)) + words[:, 1]) + words[:, 2])
    filled = np.flatnonzero(counts)
    firsts = (np.cumsum(counts) - counts)[filled]
    totals = np.zeros(len(counts), np.uint64)
    for start in range(0, len(triangles), _BLOCK):
        block = triangles[start : start + _BLOCK]
        meshes = slice(np.searchsorted(firsts, start, "right") - 1, np.searchsorted(firsts, start + len(block)))
        sums = np.add.reduceat(_signed_edges(key[block]), np.maximum(firsts[meshes] - start, 0))
        totals[filled[meshes]] += sums
    return (counts > 0) & (totals == 0)


def _signed_edges(keys: np.ndarray) -> np.ndarray:
    """Return the sum of a hash of each triangle's edges, turned edges negative modulo 2^64: uint64, shape [m].

    Args:
        keys: Of the triangles' corners, uint64, shape [m, 3].
    """
    total = np.zeros(len(keys), np.uint64)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        from_key, to_key = keys[:, start], keys[:, end]
        edge = _mix(np.minimum(from_key, to_key) + _mix(np.maximum(from_key, to_key)))
        total += np.where(from_key < to_key, edge, np.where(from_key > to_key, 0 - edge, np.uint64(0)))
    return total


def _mix(words: np.ndarray) -> np.ndarray:
    """Return 64-bit words scattered by the finaliser of splitmix64 (Steele, Lea and Flood 2014)."""
    words = words + np.uint64(0x9E3779B97F4A7C15)
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))
