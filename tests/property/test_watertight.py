# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""No ray leaves a closed mesh: rays from inside aimed at vertices, edge midpoints and random points of edges."""

from __future__ import annotations

import numpy as np
import pytest

import warp_rt
from warp_rt.accel import Accel
from warp_rt.options import BUILDERS
from warp_rt.scene import Scene

from ..meshes import Shape, cube, octasphere, torus

SHAPES = {"octasphere": octasphere(4), "cube": cube(), "torus": torus(48, 24)}
CENTERS = (0.0, 1e3, 1e4, 1e6)  # in units of the mesh's size
SCALES = (1e-6, 1.0, 1e6)


def place(shape: Shape, scale: float, center: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh scaled and moved in float64; float32 has to make of it what it can."""
    points, triangles = shape
    return scale * (points + center * np.array([1.0, -0.6, 0.3])), triangles


def edge_rays(name: str, points: np.ndarray, triangles: np.ndarray, count: int, seed: int) -> tuple:
    """Return rays from inside at vertices (a third), edge midpoints (a third) and random points of edges.

    Origins and targets are float32 numbers or sums of few of them, so that many rays meet edges exactly.
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
    size = np.ptp(points, axis=0).max() / 2
    if name == "torus":  # from the circle within the tube, at the same angle or another one
        angle = np.arctan2(*(targets - center)[:, [1, 0]].T) + rng.choice([0.0, 0.4], count) * rng.normal(size=count)
        ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        origins = center + size / 1.35 * ring
    else:
        origins = center + 0.3 * size * rng.uniform(-1, 1, (count, 3)) * rng.choice([0.0, 1.0], (count, 1))
    return origins.astype(np.float32), (targets - origins.astype(np.float32)).astype(np.float32)


def leaks(accel: Accel, origins: np.ndarray, directions: np.ndarray) -> int:
    """Return how many rays escape, counted for closest hit and any hit."""
    alive = np.abs(directions).max(axis=1) > 0
    missed = (warp_rt.closest_hit(accel, origins, directions).instance < 0) & alive
    unblocked = ~warp_rt.any_hit(accel, origins, directions) & alive
    return int(missed.sum() + unblocked.sum())


@pytest.mark.parametrize("center", CENTERS)
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("name", SHAPES)
def test_no_ray_leaks(name: str, scale: float, center: float) -> None:
    points, triangles = place(SHAPES[name], scale, center)
    accel = warp_rt.build_accel(Scene.from_arrays(points, triangles))
    assert leaks(accel, *edge_rays(name, points, triangles, 30_000, seed=1)) == 0


@pytest.mark.parametrize("bvh", BUILDERS)
def test_no_ray_leaks_whatever_the_builder(bvh: str) -> None:
    for name, shape in SHAPES.items():
        accel = warp_rt.build_accel(Scene.from_arrays(*shape), bvh=bvh)
        assert leaks(accel, *edge_rays(name, *shape, 30_000, seed=2)) == 0


def test_no_ray_leaks_between_instances_faces() -> None:
    """Sheared, mirrored and scaled: the ray is rounded once on its way into the mesh, for all triangles alike."""
    rng = np.random.default_rng(3)
    for name, shape in SHAPES.items():
        for _ in range(5):
            matrix = np.eye(4)
            matrix[:3, :3] = rng.normal(size=(3, 3)) + np.diag([2.0, -2.0, 1.0])
            matrix[:3, 3] = 10 * rng.normal(size=3)
            accel = warp_rt.build_accel(Scene.from_arrays(*shape, world_from_local=matrix))
            origins, directions = (v.astype(float) for v in edge_rays(name, *shape, 30_000, seed=4))
            origins = origins @ matrix[:3, :3].T + matrix[:3, 3]
            assert leaks(accel, origins, directions @ matrix[:3, :3].T) == 0


def test_degenerate_triangles_open_no_gaps() -> None:
    """Triangles without area, mixed into a closed mesh, neither leak nor hit."""
    points, triangles = SHAPES["octasphere"]
    rng = np.random.default_rng(5)
    a, b = rng.integers(len(points), size=(2, 500))
    extra = np.concatenate([np.stack([a, a, b], 1), np.stack([a, b, a], 1), np.stack([a, a, a], 1)]).astype(np.int32)
    mixed = np.concatenate([triangles, extra])[rng.permutation(len(triangles) + len(extra))]
    accel = warp_rt.build_accel(Scene.from_arrays(points, mixed))
    origins, directions = edge_rays("octasphere", points, triangles, 30_000, seed=6)
    assert leaks(accel, origins, directions) == 0
    hits = warp_rt.closest_hit(accel, origins, directions)
    corners = mixed[hits.triangle]
    assert (corners[:, 0] != corners[:, 1]).all()
    assert np.isfinite(hits.u).all()
    assert np.isfinite(hits.t).all()


@pytest.mark.parametrize("axis", range(3))
def test_rays_along_axes_through_a_lattice(axis: int) -> None:
    """Rays along an axis meet exactly the vertices and edges of a subdivided cube's faces, from inside."""
    steps = 9
    grid = np.linspace(-1, 1, steps)
    points, triangles = [], []
    for normal in range(3):
        for side in (-1, 1):
            u, v = np.meshgrid(grid, grid, indexing="ij")
            face = np.zeros((steps, steps, 3))
            face[..., normal], face[..., (normal + 1) % 3], face[..., (normal + 2) % 3] = side, u, v
            rows = np.arange(steps * steps).reshape(steps, steps) + len(points) * steps * steps
            low, right, up, both = rows[:-1, :-1], rows[1:, :-1], rows[:-1, 1:], rows[1:, 1:]
            points.append(face.reshape(-1, 3))
            triangles += [np.stack([low, right, both], -1).reshape(-1, 3), np.stack([low, both, up], -1).reshape(-1, 3)]
    accel = warp_rt.build_accel(Scene.from_arrays(np.concatenate(points), np.concatenate(triangles)))
    fine = np.linspace(-1, 1, 4 * (steps - 1) + 1)[1:-1]  # vertices, edges and diagonals of the lattice
    u, v = (c.reshape(-1) for c in np.meshgrid(fine, fine, indexing="ij"))
    origins = np.zeros((len(u), 3))
    origins[:, (axis + 1) % 3], origins[:, (axis + 2) % 3] = u, v
    for sign in (-1.0, 1.0):
        direction = np.zeros((len(u), 3))
        direction[:, axis] = sign
        assert leaks(accel, origins, direction) == 0


@pytest.mark.heavy
@pytest.mark.parametrize("center", CENTERS)
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("name", SHAPES)
def test_no_ray_of_a_million_leaks(name: str, scale: float, center: float) -> None:
    points, triangles = place(SHAPES[name], scale, center)
    accel = warp_rt.build_accel(Scene.from_arrays(points, triangles))
    for seed in range(10, 14):
        assert leaks(accel, *edge_rays(name, points, triangles, 250_000, seed=seed)) == 0
