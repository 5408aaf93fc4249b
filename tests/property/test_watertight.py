# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""No ray leaves a closed mesh: rays from inside aimed at vertices, edge midpoints and random points of edges."""

from __future__ import annotations

import numpy as np
import pytest

import warp_rt
from warp_rt.options import BUILDERS
from warp_rt.scene import Scene

from ..aimed_rays import CENTERS, SCALES, edge_rays, leaks, place
from ..meshes import cube, octasphere, torus

SHAPES = {"octasphere": octasphere(4), "cube": cube(), "torus": torus(48, 24)}


@pytest.mark.parametrize("center", CENTERS)
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("name", SHAPES)
def test_no_ray_leaks(name: str, scale: float, center: float) -> None:
    points, triangles = place(SHAPES[name], scale, center)
    accel = warp_rt.build_accel(Scene.from_arrays(points, triangles))
    assert leaks(accel, *edge_rays(points, triangles, 30_000, seed=1, is_ring=name == "torus")) == 0


@pytest.mark.parametrize("bvh", BUILDERS)
def test_no_ray_leaks_whatever_the_builder(bvh: str) -> None:
    for name, shape in SHAPES.items():
        accel = warp_rt.build_accel(Scene.from_arrays(*shape), bvh=bvh)
        assert leaks(accel, *edge_rays(*shape, 30_000, seed=2, is_ring=name == "torus")) == 0


def test_no_ray_leaks_between_instances_faces() -> None:
    """Sheared, mirrored and scaled: the ray is rounded once on its way into the mesh, for all triangles alike."""
    rng = np.random.default_rng(3)
    for name, shape in SHAPES.items():
        for _ in range(5):
            matrix = np.eye(4)
            matrix[:3, :3] = rng.normal(size=(3, 3)) + np.diag([2.0, -2.0, 1.0])
            matrix[:3, 3] = 10 * rng.normal(size=3)
            accel = warp_rt.build_accel(Scene.from_arrays(*shape, world_from_local=matrix))
            origins, directions = (v.astype(float) for v in edge_rays(*shape, 30_000, seed=4, is_ring=name == "torus"))
            origins = origins @ matrix[:3, :3].T + matrix[:3, 3]
            assert leaks(accel, origins, directions @ matrix[:3, :3].T) == 0


@pytest.mark.parametrize("stretch", [(1, 1, 1e-3), (1, 1e-5, 1), (1e-9, 1, 1), (1, 1e-4, 1e-8), (1e-18, 1, 1)])
@pytest.mark.parametrize("name", ["octasphere", "cube"])
def test_no_ray_leaks_through_needles(name: str, stretch: tuple[float, float, float]) -> None:
    """Flattened until triangles are thinner than a unit in the last place of their own coordinates."""
    points, triangles = SHAPES[name]
    thin = points * np.array(stretch)
    accel = warp_rt.build_accel(Scene.from_arrays(thin, triangles))
    assert leaks(accel, *edge_rays(thin, triangles, 30_000, seed=7)) == 0


def test_degenerate_triangles_open_no_gaps() -> None:
    """Triangles without area, mixed into a closed mesh, neither leak nor hit."""
    points, triangles = SHAPES["octasphere"]
    rng = np.random.default_rng(5)
    a, b = rng.integers(len(points), size=(2, 500))
    extra = np.concatenate([np.stack([a, a, b], 1), np.stack([a, b, a], 1), np.stack([a, a, a], 1)]).astype(np.int32)
    mixed = np.concatenate([triangles, extra])[rng.permutation(len(triangles) + len(extra))]
    accel = warp_rt.build_accel(Scene.from_arrays(points, mixed))
    origins, directions = edge_rays(points, triangles, 30_000, seed=6)
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
        assert leaks(accel, *edge_rays(points, triangles, 250_000, seed=seed, is_ring=name == "torus")) == 0
