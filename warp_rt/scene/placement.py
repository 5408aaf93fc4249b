# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where float32 coordinates are taken from: per scene and per mesh an origin, and the transforms between the two.

All arithmetic is float64 until the result is rounded, once. So a scene far from the world's origin, or a mesh far
from its own, keeps its digits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

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

    @cached_property
    def _have_origins(self) -> bool:
        return bool(self.mesh_origins.any())

    def world_from_local(self, rows: slice | np.ndarray) -> np.ndarray:
        """Return the transforms of some instances: float64, shape [n, 3, 4]."""
        matrices = np.asarray(self.instances.world_from_local[rows], float)[:, :3]
        placed = matrices.copy()
        if self._have_origins:
            origins = self.mesh_origins[self.instances.mesh[rows]]
            placed[:, :, 3] += np.einsum("nij,nj->ni", matrices[:, :, :3], origins)
        placed[:, :, 3] -= self.origin
        return placed

    def local_from_world(self, rows: slice | np.ndarray) -> np.ndarray:
        """Return the inverses of some instances' transforms: float64, shape [n, 3, 4]."""
        return inverses(self.world_from_local(rows))


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


def inverses(transforms: np.ndarray) -> np.ndarray:
    """Return the inverses of affine transforms: float64, shape [n, 3, 4] both."""
    # The adjugate, a number of all matrices at a time: fast for a million of them.
    (ax, bx, cx, x), (ay, by, cy, y), (az, bz, cz, z) = np.ascontiguousarray(transforms.transpose(1, 2, 0))
    rows = (
        (by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx),
        (cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax),
        (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx),
    )
    determinant = ax * rows[0][0] + ay * rows[0][1] + az * rows[0][2]
    inverse = np.empty_like(transforms)
    for number, minors in enumerate(rows):
        px, py, pz = (minor / determinant for minor in minors)
        inverse[:, number, 0], inverse[:, number, 1], inverse[:, number, 2] = px, py, pz
        inverse[:, number, 3] = -(px * x + py * y + pz * z)
    return inverse


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
