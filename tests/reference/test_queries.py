# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ray queries against brute force in float64: every builder with every triangle test, and transforms of every kind."""

from __future__ import annotations

import numpy as np
import pytest

import warp_rt
from warp_rt.options import BUILDERS, INTERSECTORS
from warp_rt.scene import Instances, Mesh, Scene

from ..meshes import Shape, brute_force, cube, octasphere, soup, torus

SHAPES = {"soup": soup(400, 1), "sphere": octasphere(3), "torus": torus()}
RAYS = 600
FLOAT32 = 1e-4  # relative, of distances: rays that graze a triangle lose digits


def rays_at(shape: Shape, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return rays around and inside a mesh, of directions of various lengths, exact in float32."""
    rng = np.random.default_rng(seed)
    low, high = shape[0].min(axis=0), shape[0].max(axis=0)
    size = np.linalg.norm(high - low)
    origins = (low + high) / 2 + 0.5 * size * rng.normal(size=(count, 3))
    directions = low + rng.uniform(size=(count, 3)) * (high - low) - origins
    directions *= 10.0 ** rng.uniform(-2, 2, (count, 1))
    return origins.astype(np.float32), directions.astype(np.float32)


@pytest.fixture(scope="module", params=SHAPES)
def answers(request: pytest.FixtureRequest) -> tuple:
    points, triangles = SHAPES[request.param]
    points = points.astype(np.float32)
    rays = rays_at((points, triangles), RAYS, seed=2)
    return points, triangles, rays, brute_force(points, triangles, *rays)


@pytest.mark.parametrize("bvh", BUILDERS)
@pytest.mark.parametrize("intersector", INTERSECTORS)
def test_brute_force_finds_the_same(answers: tuple, bvh: str, intersector: str) -> None:
    points, triangles, rays, (t, triangle, is_near_edge, is_tie) = answers
    accel = warp_rt.build_accel(Scene.from_arrays(points, triangles), bvh=bvh, intersector=intersector)
    hits = warp_rt.closest_hit(accel, *rays)
    clear = ~is_near_edge
    is_hit = np.isfinite(t)
    assert clear.sum() > 0.8 * RAYS
    assert 0.2 < is_hit.mean() < 0.98
    np.testing.assert_array_equal((hits.instance == 0)[clear], is_hit[clear])
    np.testing.assert_allclose(hits.t[clear], t[clear], rtol=FLOAT32)
    certain = clear & ~is_tie
    np.testing.assert_array_equal(hits.triangle[certain], triangle[certain])
    # P = (1 - u - v) p0 + u p1 + v p2 = origin + t direction
    hit = certain & is_hit
    corners = points[triangles[hits.triangle[hit]]].astype(float)
    u, v = hits.u[hit, None], hits.v[hit, None]
    p = (1 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
    size = np.linalg.norm(np.ptp(points, axis=0))
    np.testing.assert_allclose(p, rays[0][hit] + t[hit, None] * rays[1][hit], atol=1e-4 * size)
    np.testing.assert_array_equal(warp_rt.any_hit(accel, *rays)[clear], is_hit[clear])


@pytest.mark.parametrize("intersector", INTERSECTORS)
def test_rays_end_at_t_max(answers: tuple, intersector: str) -> None:
    points, triangles, rays, (t, _, is_near_edge, _) = answers
    accel = warp_rt.build_accel(Scene.from_arrays(points, triangles), intersector=intersector)
    hit = np.isfinite(t) & ~is_near_edge
    origins, directions = (v[hit] for v in rays)
    for factor, is_reached in ((0.999, False), (1.001, True)):
        t_max = (factor * t[hit]).astype(np.float32)
        assert (warp_rt.any_hit(accel, origins, directions, t_max) == is_reached).all()
        assert ((warp_rt.closest_hit(accel, origins, directions, t_max).instance >= 0) == is_reached).all()
    assert not warp_rt.any_hit(accel, origins, directions, t_max=0.0).any()
    assert not warp_rt.any_hit(accel, origins, directions, t_max=-1.0).any()
    assert not warp_rt.any_hit(accel, origins, directions, t_max=np.nan).any()


def instanced_scene(seed: int, spread: float = 3.0) -> Scene:
    """Return many instances of few meshes: mirrored, sheared, unevenly scaled, turned, and one left as it is."""
    rng = np.random.default_rng(seed)
    shapes = [cube(), octasphere(2), soup(30, 3)]
    matrices = np.tile(np.eye(4), (40, 1, 1))
    matrices[1:, :3, :3] = 0.6 * rng.normal(size=(39, 3, 3))
    matrices[1:, :3, 3] = rng.uniform(-spread, spread, (39, 3))
    matrices = matrices[np.abs(np.linalg.det(matrices[:, :3, :3])) > 0.02]
    meshes = rng.integers(0, len(shapes), len(matrices)).astype(np.int32)
    zeros = np.zeros(len(matrices), np.int32)
    return Scene(
        meshes=tuple(Mesh(p.astype(np.float32), t) for p, t in shapes),
        instances=Instances(meshes, matrices, zeros, zeros[:1], zeros, zeros - 1),
    )


def flatten(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return a scene's triangles in world space, float64, and the instance and the mesh's triangle of each."""
    points, triangles, instance, local = [], [], [], []
    count = 0
    for row, (mesh_row, m) in enumerate(zip(scene.instances.mesh, scene.instances.world_from_local, strict=True)):
        mesh = scene.meshes[mesh_row]
        points.append(mesh.points @ m[:3, :3].T + m[:3, 3])
        triangles.append(mesh.triangles + count)
        count += len(mesh.points)
        instance += [row] * len(mesh.triangles)
        local += range(len(mesh.triangles))
    return np.concatenate(points), np.concatenate(triangles), np.array(instance), np.array(local)


@pytest.mark.parametrize("bvh", BUILDERS)
@pytest.mark.parametrize("center", [0.0, 1e6])
def test_instances_are_where_their_transforms_put_them(bvh: str, center: float) -> None:
    scene = instanced_scene(4)
    scene.instances.world_from_local[:, :3, 3] += center * np.array([1.0, -2.0, 0.5])
    accel = warp_rt.build_accel(scene, bvh=bvh)
    points, triangles, instance, local = flatten(scene)
    origins, directions = (v.astype(float) for v in rays_at((points - points[0], triangles), RAYS, seed=5))
    t, flat, is_near_edge, is_tie = brute_force(points - points[0], triangles, origins, directions)
    hits = warp_rt.closest_hit(accel, origins + points[0], directions)
    clear, is_hit = ~is_near_edge, np.isfinite(t)
    assert 0.3 < is_hit.mean() < 0.98
    np.testing.assert_array_equal((hits.instance >= 0)[clear], is_hit[clear])
    np.testing.assert_allclose(hits.t[clear], t[clear], rtol=1e-3)
    certain = clear & ~is_tie & is_hit
    np.testing.assert_array_equal(hits.instance[certain], instance[flat[certain]])
    np.testing.assert_array_equal(hits.triangle[certain], local[flat[certain]])
    np.testing.assert_array_equal(warp_rt.any_hit(accel, origins + points[0], directions)[clear], is_hit[clear])


def test_a_mesh_far_from_its_own_origin_keeps_its_digits() -> None:
    """The mesh lies at 1e5, its transform brings it back: whole-number coordinates, so nothing is lost on the way."""
    shift = np.array([131072.0, -262144.0, 65536.0])
    points, triangles = cube()
    back = np.eye(4)
    back[:3, 3] = -shift
    accel = warp_rt.build_accel(Scene.from_arrays(points + shift, triangles, world_from_local=back))
    rng = np.random.default_rng(6)
    origins = rng.uniform(-0.9, 0.9, (500, 3)).astype(np.float32)
    hits = warp_rt.closest_hit(accel, origins, np.tile([0.0, 0, 2.0], (500, 1)))
    np.testing.assert_allclose(hits.t, (1 - origins[:, 2]) / 2, rtol=1e-6)


def test_rays_that_are_none_miss(answers: tuple) -> None:
    points, triangles, _, _ = answers
    for scene in (Scene.from_arrays(points, triangles), instanced_scene(7)):
        accel = warp_rt.build_accel(scene)
        good = np.ones(3)
        bad = [np.full(3, np.nan), np.array([np.inf, 0, 0]), np.array([0, -np.inf, np.nan])]
        rays = [(b, good) for b in bad] + [(good, b) for b in bad] + [(points[0], np.zeros(3)), (good, np.zeros(3))]
        origins, directions = np.array(rays).swapaxes(0, 1)
        hits = warp_rt.closest_hit(accel, origins, directions)
        assert (hits.instance == -1).all()
        assert (hits.triangle == -1).all()
        assert np.isinf(hits.t).all()
        assert not warp_rt.any_hit(accel, origins, directions).any()
        assert not warp_rt.count_hits(accel, origins, directions).any()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("shift", [0.0, 1e5])
def test_rays_beyond_float32_miss_without_a_warning(answers: tuple, shift: float) -> None:
    """Hierarchies far from the origin have their rays moved before they become float32."""
    points, triangles, _, _ = answers
    accel = warp_rt.build_accel(Scene.from_arrays(points + np.float32(shift), triangles))
    far, good = np.full((40_000, 3), 1e300), np.ones((40_000, 3))
    for query in (warp_rt.closest_hit, warp_rt.any_hit, warp_rt.count_hits):
        for rays in ((far, good), (good, far)):
            found = query(accel, *rays, t_max=1e300, threads=2)
            assert not np.isfinite(found.t).any() if query is warp_rt.closest_hit else not found.any()


@pytest.mark.parametrize("big", [1e30, 1e36, 3e38])
def test_rays_at_the_limits_of_float32_end(big: float) -> None:
    """Their transforms into meshes overflow; whatever they hit, they neither crash nor hang, and hits are finite."""
    scene = instanced_scene(9)
    scene.instances.world_from_local[1::3, :3, :3] *= 1e-3
    accel = warp_rt.build_accel(scene)
    rng = np.random.default_rng(10)
    for o, d in ((1.0, big), (big, 1.0), (big, big), (1.0, 1 / big)):
        origins = rng.uniform(-o, o, (300, 3)).astype(np.float32)
        directions = rng.uniform(-d, d, (300, 3)).astype(np.float32) * rng.choice([0, 1], (300, 3))
        hits = warp_rt.closest_hit(accel, origins, directions.astype(np.float32))
        warp_rt.any_hit(accel, origins, directions.astype(np.float32))
        assert (np.isfinite(hits.t) == (hits.instance >= 0)).all()


@pytest.mark.parametrize("scale", [1e-20, 1e-6, 1e6, 1e20])
def test_the_direction_may_have_any_length(scale: float) -> None:
    accel = warp_rt.build_accel(Scene.from_arrays(*octasphere(3)))
    origins, directions = rays_at(octasphere(3), 200, seed=8)
    one = warp_rt.closest_hit(accel, origins, directions)
    other = warp_rt.closest_hit(accel, origins, directions.astype(float) * scale)
    np.testing.assert_array_equal(one.instance, other.instance)
    np.testing.assert_allclose(other.t.astype(float) * scale, one.t, rtol=1e-4)
