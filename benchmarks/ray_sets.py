# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The rays that are traced: those of a picture, those that its hits send on, and some in no order at all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .meshes import TriangleMesh

TILE = 8  # pixels along the side of the squares in which a picture's rays follow each other
KINDS = ("primary", "mirror", "shadow", "ao", "diffuse", "random")


@dataclass(frozen=True)
class Rays:
    """Rays of one kind, without an end."""

    origins: np.ndarray
    """float32, shape [n, 3]."""
    directions: np.ndarray
    """float32, unit length, shape [n, 3]."""

    def __len__(self) -> int:
        return len(self.origins)


def primary_rays(mesh: TriangleMesh, size: int) -> Rays:
    """Return the eye rays of a picture that the mesh just fits into, ``size`` pixels a side, tile by tile."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    center, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    eye = center + radius * np.array([1.2, 1.6, 1.4])
    z = (center - eye) / np.linalg.norm(center - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    y = np.cross(x, z)
    seen = (mesh.points - eye) @ np.stack([x, y, z], axis=1)
    (left, bottom), (right, top) = (f(seen[:, :2] / seen[:, 2:], axis=0) for f in (np.min, np.max))
    s = (np.arange(size) + 0.5) / size
    directions = z + (left + s * (right - left))[None, :, None] * x + (top + s * (bottom - top))[:, None, None] * y
    tiles = directions.reshape(size // TILE, TILE, size // TILE, TILE, 3).swapaxes(1, 2)
    directions = _unit(tiles.reshape(-1, 3)).astype(np.float32)
    return Rays(np.broadcast_to(eye.astype(np.float32), directions.shape).copy(), directions)


def secondary_rays(kind: str, mesh: TriangleMesh, primary: Rays, t: np.ndarray, triangle: np.ndarray) -> Rays:
    """Return the rays that the hits of primary rays send on, in the same order.

    Args:
        kind: ``mirror``, ``shadow`` (towards a light outside of the mesh), or ``ao`` and ``diffuse`` (cosine-weighted,
            with different random numbers).
        mesh: What was hit.
        primary: The rays.
        t: Their distances, shape [n].
        triangle: What they hit, -1 for nothing, shape [n].
    """
    hit = triangle >= 0
    incoming = primary.directions[hit].astype(float)
    normals = face_normals(mesh, triangle[hit])
    normals *= -np.sign((normals * incoming).sum(axis=1, keepdims=True))
    size = np.linalg.norm(np.ptp(mesh.points, axis=0))
    origins = primary.origins[hit] + t[hit, None] * incoming + 1e-5 * size * normals
    if kind == "mirror":
        directions = incoming - 2 * (incoming * normals).sum(axis=1, keepdims=True) * normals
    elif kind == "shadow":
        directions = mesh.points.mean(axis=0) + size * np.array([0.5, -1.0, 2.0]) - origins
    else:
        directions = cosine_directions(normals, np.random.default_rng(KINDS.index(kind)))
    return Rays(origins.astype(np.float32), _unit(directions).astype(np.float32))


def random_rays(mesh: TriangleMesh, count: int) -> Rays:
    """Return diffuse rays from random points of all triangles in random order: the worst case for memory."""
    rng = np.random.default_rng(1)
    chosen = rng.integers(len(mesh.triangles), size=count)
    corners = mesh.points[mesh.triangles[chosen]].astype(float)
    normals = face_normals(mesh, chosen)
    size = np.linalg.norm(np.ptp(mesh.points, axis=0))
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)[:, :, None]
    origins = (corners * weights).sum(axis=1) + 1e-5 * size * normals
    return Rays(origins.astype(np.float32), cosine_directions(normals, rng).astype(np.float32))


def face_normals(mesh: TriangleMesh, rows: np.ndarray) -> np.ndarray:
    """Return unit normals of triangles: float64, shape [n, 3]; zero where there is no area."""
    p0, p1, p2 = mesh.points[mesh.triangles[rows]].astype(float).swapaxes(0, 1)
    return _unit(np.cross(p1 - p0, p2 - p0))


def cosine_directions(normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return cosine-weighted random directions about normals: a point of the unit sphere that stands on the surface."""
    return _unit(_unit(rng.normal(size=normals.shape)) + normals)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)
