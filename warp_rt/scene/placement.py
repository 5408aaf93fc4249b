# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where float32 coordinates are taken from: per scene and per mesh an origin, and the transforms between the two.

All arithmetic is float64 until the result is rounded, once. So a scene far from the world's origin, or a mesh far
from its own, keeps its digits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from warp_rt.errors import SceneError
from warp_rt.scene import Instances, Mesh, Scene, Shapes, local_bounds, point_bounds, primitive_count

_BLOCK = 4096
# Areas of boxes are squares of coordinates, and a hierarchy's cost is a sum of areas: with 3 * 2e15^2 for each of the
# 2.6e7 nodes and leaves that a hierarchy can hold, it stays in float32's range.
_MAX_COORDINATE = 1e15


@dataclass(frozen=True)
class Placement:
    """Coordinates of the device: local points relative to their mesh's origin, world points to the scene's.

    Transforms between them are computed as they are asked for: kept, they would take 192 bytes an instance.
    """

    origin: np.ndarray
    """float64, shape [3], world space: ``Scene.origin()``."""
    mesh_origins: np.ndarray
    """float64, shape [mesh_count, 3], local space: zero but for meshes that lie far from their own origin."""
    instances: Instances

    def world_from_local(self, rows: slice | np.ndarray) -> np.ndarray:
        """Return the transforms of some instances: float64, shape [n, 3, 4]."""
        matrices = np.asarray(self.instances.world_from_local, float).reshape(-1, 4, 4)[rows, :3]
        shift = np.einsum("nij,nj->ni", matrices[:, :, :3], self.mesh_origins[self.instances.mesh[rows]])
        placed = matrices.copy()
        placed[:, :, 3] = matrices[:, :, 3] + shift - self.origin
        return placed

    def local_from_world(self, rows: slice | np.ndarray) -> np.ndarray:
        """Return the inverses of some instances' transforms: float64, shape [n, 3, 4]."""
        forward = self.world_from_local(rows)
        inverse = np.empty_like(forward)
        inverse[:, :, :3] = _inverse(forward[:, :, :3])
        inverse[:, :, 3] = -np.einsum("nij,nj->ni", inverse[:, :, :3], forward[:, :, 3])
        return inverse


def place_scene(scene: Scene) -> Placement:
    """Return the coordinates that a scene is uploaded in.

    Raises:
        SceneError: A triangle or a shape reaches farther than 1e15 from its mesh's origin, or is not finite.
    """
    mesh_origins = np.array([_mesh_origin(mesh, row) for row, mesh in enumerate(scene.meshes)]).reshape(-1, 3)
    return Placement(scene.origin(), mesh_origins, scene.instances)


def blocks(count: int) -> Iterator[slice]:
    """Yield slices of so many instances that what is computed of them stays in the cache."""
    for start in range(0, count, _BLOCK):
        yield slice(start, min(start + _BLOCK, count))


def relative_points(points: np.ndarray, mesh_origin: np.ndarray) -> np.ndarray:
    """Return a mesh's or shapes' points relative to their origin: float32, of the same shape."""
    if not mesh_origin.any():
        return np.ascontiguousarray(points, np.float32)
    return (points.astype(np.float64) - mesh_origin).astype(np.float32)


def _mesh_origin(geometry: Mesh | Shapes, row: int) -> np.ndarray:
    """Return the local origin, unless points lie beyond 8 times their extent from it; then the centre of their box."""
    if not primitive_count(geometry):
        return np.zeros(3)
    box = local_bounds(geometry) if isinstance(geometry, Shapes) else point_bounds(geometry.points)
    reach = np.abs(box).max()
    if not reach <= _MAX_COORDINATE:
        box = local_bounds(geometry)  # points that no triangle names may lie anywhere
        reach = np.abs(box).max()
    if not np.isfinite(reach):
        raise SceneError(f"mesh {row}: a point is not finite")
    low, high = box
    center = (low + high) / 2
    origin = np.zeros(3)
    if np.abs(center).max() > 8 * np.linalg.norm(high - low):
        # A float32 number, so that differences from it are exact.
        origin = center.astype(np.float32).astype(float)
        reach = np.abs(box - origin).max()
    if reach > _MAX_COORDINATE:
        raise SceneError(f"mesh {row}: a point is farther than {_MAX_COORDINATE:g} from the origin")
    return origin


def _inverse(linear: np.ndarray) -> np.ndarray:
    """Return the inverses of 3 x 3 matrices, shape [n, 3, 3], by the adjugate: fast for a million of them."""
    a, b, c = linear[:, :, 0], linear[:, :, 1], linear[:, :, 2]
    rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    return rows / np.einsum("ni,ni->n", a, rows[:, 0])[:, None, None]
