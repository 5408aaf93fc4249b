# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays that are aimed at the vertices and edges of closed meshes from inside, and the count of those that get out."""

from __future__ import annotations

import numpy as np

import warp_rt
from warp_rt.bvh.accel import Accel

Shape = tuple[np.ndarray, np.ndarray]
CENTERS = (0.0, 1e3, 1e4, 1e6)  # in units of the mesh's size
SCALES = (1e-6, 1.0, 1e6)


def place(shape: Shape, scale: float, center: float) -> Shape:
    """Return the mesh scaled and moved in float64; float32 has to make of it what it can."""
    points, triangles = shape
    return scale * (points + center * np.array([1.0, -0.6, 0.3])), triangles


def edge_rays(
    points: np.ndarray, triangles: np.ndarray, count: int, seed: int, is_ring: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return rays from inside at vertices (a third), edge midpoints (a third) and random points of edges.

    Origins and targets are float32 numbers or sums of few of them, so that many rays meet edges exactly.

    Args:
        points: Of a closed mesh about its centre.
        triangles: Rows of ``points``.
        count: How many rays.
        seed: Of the random numbers.
        is_ring: Whether the mesh is a torus about z whose tube is about 0.35 radii thick.

    Returns:
        Origins and directions, float32, shape [count, 3] each.
    """
    rng = np.random.default_rng(seed)
    points = points.astype(np.float32).astype(float)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    a, b = points[edges[rng.integers(len(edges), size=count)]].swapaxes(0, 1)
    weight = rng.uniform(size=(count, 1))
    weight[: count // 3] = 0
    weight[count // 3 : 2 * count // 3] = 0.5
    targets = a + weight * (b - a)
    center = (points.max(axis=0) + points.min(axis=0)) / 2
    size = np.ptp(points, axis=0) / 2
    if is_ring:  # from the circle within the tube, at the same angle or another one
        angle = np.arctan2(*(targets - center)[:, [1, 0]].T) + rng.choice([0.0, 0.4], count) * rng.normal(size=count)
        ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        origins = center + size.max() / 1.35 * ring
    else:
        origins = center + 0.3 * size * rng.uniform(-1, 1, (count, 3)) * rng.choice([0.0, 1.0], (count, 1))
    return origins.astype(np.float32), (targets - origins.astype(np.float32)).astype(np.float32)


def leaks(accel: Accel, origins: np.ndarray, directions: np.ndarray) -> int:
    """Return how many rays escape, counted for closest hit and any hit."""
    alive = np.abs(directions).max(axis=1) > 0
    missed = (warp_rt.closest_hit(accel, origins, directions).instance < 0) & alive
    unblocked = ~warp_rt.any_hit(accel, origins, directions) & alive
    return int(missed.sum() + unblocked.sum())
