# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where float32 coordinates are taken from: per scene and per mesh an origin, and the transforms between the two.

All arithmetic is float64 until the result is rounded, once. So a scene far from the world's origin, or a mesh far
from its own, keeps its digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warp_rt.scene import Mesh, Scene, Shapes, local_bounds, point_bounds

_BLOCK = 4096  # instances at a time: what is computed on the way stays in the cache


@dataclass(frozen=True)
class Placement:
    """Coordinates of the device: local points relative to their mesh's origin, world points to the scene's."""

    origin: np.ndarray
    """float64, shape [3], world space: ``Scene.origin()``."""
    mesh_origins: np.ndarray
    """float64, shape [mesh_count, 3], local space: zero but for meshes that lie far from their own origin."""
    world_from_local: np.ndarray
    """float64, shape [instance_count, 3, 4], between those relative coordinates."""
    local_from_world: np.ndarray
    """float64, shape [instance_count, 3, 4], its inverse."""


def place_scene(scene: Scene) -> Placement:
    """Return the coordinates that a scene is uploaded in."""
    origin = scene.origin()
    mesh_origins = np.array([_mesh_origin(mesh) for mesh in scene.meshes]).reshape(-1, 3)
    mesh, matrices = scene.instances.mesh, np.asarray(scene.instances.world_from_local, float).reshape(-1, 4, 4)
    world_from_local, local_from_world = (np.empty((len(mesh), 3, 4)) for _ in range(2))
    for start in range(0, len(mesh), _BLOCK):
        rows = slice(start, start + _BLOCK)
        linear = matrices[rows, :3, :3]
        shift = np.einsum("nij,nj->ni", linear, mesh_origins[mesh[rows]])
        translation = matrices[rows, :3, 3] + shift - origin
        inverse = _inverse(linear)
        world_from_local[rows, :, :3], world_from_local[rows, :, 3] = linear, translation
        local_from_world[rows, :, :3] = inverse
        local_from_world[rows, :, 3] = -np.einsum("nij,nj->ni", inverse, translation)
    return Placement(origin, mesh_origins, world_from_local, local_from_world)


def relative_points(points: np.ndarray, mesh_origin: np.ndarray) -> np.ndarray:
    """Return a mesh's or shapes' points relative to their origin: float32, of the same shape."""
    if not mesh_origin.any():
        return np.ascontiguousarray(points, np.float32)
    return (points.astype(np.float64) - mesh_origin).astype(np.float32)


def _mesh_origin(geometry: Mesh | Shapes) -> np.ndarray:
    """Return the local origin, unless points lie beyond 8 times their extent from it; then the centre of their box."""
    if not len(geometry.points):
        return np.zeros(3)
    low, high = local_bounds(geometry) if isinstance(geometry, Shapes) else point_bounds(geometry.points)
    center = (low + high) / 2
    if np.abs(center).max() <= 8 * np.linalg.norm(high - low):
        return np.zeros(3)
    # A float32 number, so that differences from it are exact.
    return center.astype(np.float32).astype(float)


def _inverse(linear: np.ndarray) -> np.ndarray:
    """Return the inverses of 3 x 3 matrices, shape [n, 3, 3], by the adjugate: fast for a million of them."""
    a, b, c = linear[:, :, 0], linear[:, :, 1], linear[:, :, 2]
    rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    return rows / np.einsum("ni,ni->n", a, rows[:, 0])[:, None, None]
