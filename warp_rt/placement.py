# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where float32 coordinates are taken from: per scene and per mesh an origin, and the transforms between the two.

All arithmetic is float64 until the result is rounded, once. So a scene far from the world's origin, or a mesh far
from its own, keeps its digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warp_rt.scene import Scene, point_bounds


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
    mesh_origins = np.array([_mesh_origin(mesh.points) for mesh in scene.meshes]).reshape(-1, 3)
    instances = scene.instances
    linear = np.asarray(instances.world_from_local, float).reshape(-1, 4, 4)[:, :3, :3]
    translation = np.asarray(instances.world_from_local, float).reshape(-1, 4, 4)[:, :3, 3]
    translation = translation + np.einsum("nij,nj->ni", linear, mesh_origins[instances.mesh]) - origin
    inverse = _inverse(linear)
    return Placement(
        origin=origin,
        mesh_origins=mesh_origins,
        world_from_local=np.concatenate([linear, translation[:, :, None]], axis=2),
        local_from_world=np.concatenate([inverse, -np.einsum("nij,nj->ni", inverse, translation)[:, :, None]], axis=2),
    )


def relative_points(points: np.ndarray, mesh_origin: np.ndarray) -> np.ndarray:
    """Return a mesh's points relative to its origin: float32, shape [n, 3]."""
    if not mesh_origin.any():
        return np.ascontiguousarray(points, np.float32)
    return (points.astype(np.float64) - mesh_origin).astype(np.float32)


def _mesh_origin(points: np.ndarray) -> np.ndarray:
    """Return the local origin, unless points lie beyond 8 times their extent from it; then the centre of their box."""
    if not len(points):
        return np.zeros(3)
    low, high = point_bounds(points)
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
