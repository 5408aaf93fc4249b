# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Meshes with known properties: points float64, shape [n, 3], and triangles int32, shape [m, 3]."""

from __future__ import annotations

import numpy as np

Shape = tuple[np.ndarray, np.ndarray]


def cube() -> Shape:
    """Return the cube [-1, 1]^3: 12 triangles, wound counter-clockwise seen from outside."""
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)


def octasphere(levels: int) -> Shape:
    """Return a unit sphere of 8 * 4^levels triangles: an octahedron, subdivided."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    triangles = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(levels):
        a, b, c = triangles.T
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        edges, inverse = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = inverse.reshape(3, -1) + len(points)
        middle = points[edges].sum(axis=1)
        points = np.concatenate([points, middle / np.linalg.norm(middle, axis=1, keepdims=True)])
        faces = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
        triangles = np.concatenate([np.stack(corners, axis=1) for corners in faces])
    return points, triangles.astype(np.int32)


def torus(around: int = 24, across: int = 12, thickness: float = 0.35) -> Shape:
    """Return a torus of radius 1 about the z axis."""
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * i / around, 2 * np.pi * j / across
    r = 1 + thickness * np.cos(b)
    points = np.stack([r * np.cos(a), r * np.sin(a), thickness * np.sin(b)], axis=-1).reshape(-1, 3)

    def at(p: np.ndarray, q: np.ndarray) -> np.ndarray:
        return ((p % around) * across + q % across).reshape(-1)

    low, right, up, both = at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)
    triangles = np.concatenate([np.stack([low, right, both], 1), np.stack([low, both, up], 1)])
    return points, triangles.astype(np.int32)


def soup(count: int, seed: int, size: float = 0.2) -> Shape:
    """Return triangles strewn over the unit cube, of all orientations."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(0, 1, (count, 1, 3)) + size * rng.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def brute_force(
    points: np.ndarray, triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return all rays against all triangles in float64, without any hierarchy.

    Returns:
        t (inf: a miss), triangle (-1: a miss), and two flags of rays that float32 may see differently: that pass an
        edge of some triangle closely, or that meet two triangles at nearly the same distance.
    """
    p0, p1, p2 = (points[triangles[:, i]].astype(float) for i in range(3))
    t_best = np.full(len(origins), np.inf)
    best = np.full(len(origins), -1)
    is_near_edge = np.zeros(len(origins), bool)
    is_tie = np.zeros(len(origins), bool)
    for k, (origin, direction) in enumerate(zip(origins.astype(float), directions.astype(float), strict=True)):
        s, e1, e2 = origin - p0, p1 - p0, p2 - p0
        with np.errstate(divide="ignore", invalid="ignore"):
            h = np.cross(direction, e2)
            inverse = 1 / (e1 * h).sum(axis=1)
            u = (s * h).sum(axis=1) * inverse
            q = np.cross(s, e1)
            v = q @ direction * inverse
            t = (e2 * q).sum(axis=1) * inverse
            margin = np.minimum(np.minimum(u, v), 1 - u - v)
        ahead = np.isfinite(t) & (t >= 0)
        t_hit = np.where(ahead & (margin >= 0), t, np.inf)
        if len(t_hit) and np.isfinite(t_hit.min()):
            best[k] = t_hit.argmin()
            t_best[k] = t_hit.min()
            is_tie[k] = (t_hit < t_best[k] * (1 + 1e-4) + 1e-6).sum() > 1
        is_near_edge[k] = (np.abs(margin[ahead & (t < t_best[k] * 1.001 + 1e-3)]) < 1e-4).any()
    return t_best, best, is_near_edge, is_tie
