# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Spawned rays do not meet the surface that they leave, at any scale and place, and start near enough for contact."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt import build_accel
from warp_rt.bvh.stacks import make_stacks
from warp_rt.kernels.bvh_structs import AccelData, Hit, Stacks, stack_of_thread
from warp_rt.kernels.bvh_traverse import any_hit_from
from warp_rt.kernels.observer import Unobserved
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.kernels.spawn import spawn_origin
from warp_rt.kernels.surface import make_surface
from warp_rt.scene import Scene
from warp_rt.upload.device_scene import upload_scene

from ..meshes import cube, octasphere

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

RAYS = 100_000


@wp.kernel
def leave(
    scene: wp.array[SceneData],
    accel: wp.array[AccelData],
    stacks: Stacks,
    triangles: wp.array[int],
    uv: wp.array[wp.vec2],
    directions: wp.array[wp.vec3],
    outcome: wp.array[int],
    steps: wp.array[float],
):
    """Write 1 where a ray away from a convex solid hits it, and how far from its surface the ray starts."""
    i = wp.tid()
    hit = Hit()
    hit.instance = 0
    hit.triangle = triangles[i]
    hit.u = uv[i][0]
    hit.v = uv[i][1]
    # A ray that comes from far away: the position is found by barycentrics.
    far = wp.vec3(1.0e20, 1.0e20, 1.0e20)
    surface = make_surface(scene[0], hit, far, -far)
    d = directions[i]
    if wp.dot(d, surface.n_geometric) < 0.0:
        d = -d
    origin = spawn_origin(scene[0], surface, d)
    stack = stack_of_thread(stacks, 0)
    nobody = Unobserved()
    is_hit = any_hit_from(accel[0], origin, d, wp.inf, 0, triangles[i], stack, nobody)
    outcome[i] = wp.where(is_hit, 1, 0)
    steps[i] = wp.length(origin - surface.position)


def spawn(scene: Scene, seed: int, directions: np.ndarray | None = None) -> tuple[int, np.ndarray]:
    """Return how many spawned rays hit the solid again, and their offsets."""
    rng = np.random.default_rng(seed)
    count = len(scene.meshes[0].triangles) - 1  # the last triangle only keeps the scene from being moved
    u, v = rng.uniform(size=(2, RAYS))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    # A third of the points lie on edges, where the neighbouring triangle is as near, and a third just beside them.
    u[::3] = 0.0
    u[1::3] *= 2.0 ** -rng.uniform(16, 24, len(u[1::3]))
    u[1], v[1] = 0.5, 0.0  # on great_plane: the origin itself
    if directions is None:
        directions = rng.normal(size=(RAYS, 3))
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    accel = build_accel(scene, device="cpu")
    data = upload_scene(scene, device="cpu", placement=accel.placement)
    outcome, steps = wp.zeros(RAYS, dtype=int, device="cpu"), wp.zeros(RAYS, dtype=float, device="cpu")
    inputs = [
        wp.array([data.data], dtype=SceneData, device="cpu"),
        accel.table,
        make_stacks(accel),
        wp.array(rng.integers(0, count, RAYS).astype(np.int32), dtype=int, device="cpu"),
        wp.array(np.stack([u, v], 1).astype(np.float32), dtype=wp.vec2, device="cpu"),
        wp.array(directions.astype(np.float32), dtype=wp.vec3, device="cpu"),
        outcome,
        steps,
    ]
    wp.launch(leave, dim=RAYS, inputs=inputs, device="cpu")
    return int(outcome.numpy().sum()), steps.numpy()


def solid(points: np.ndarray, faces: np.ndarray, matrix: np.ndarray | None = None) -> Scene:
    """A solid and a speck of dust at the origin of its space, which keeps coordinates from being moved to the solid."""
    dust = len(points) + np.array([[0, 1, 2]])
    points = np.concatenate([points, np.eye(3) * 1e-30])
    return Scene.from_arrays(points, np.concatenate([faces, dust]), world_from_local=matrix)


PLACES = [(1.0, 0.0), (1e4, 0.0), (1e-5, 0.0), (1.0, 1e3), (10.0, 1e5)]


@pytest.mark.parametrize(("radius", "center"), PLACES)
@pytest.mark.parametrize("shape", [lambda: octasphere(5), cube], ids=["sphere", "cube"])
def test_rays_leave_solids_of_any_size_and_place(shape, radius: float, center: float) -> None:
    points, faces = shape()
    hits, _ = spawn(solid(points * radius + center * np.array([1.0, -0.7, 0.4]), faces), seed=1)
    assert hits == 0


def rotation(seed: int) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("stretch", "translation"),
    [((1, 1, 1), 0.0), ((1e3, 1e3, 1e3), 1e4), ((1, 5, 0.2), 10.0), ((-1, 1, 1), 1e3), ((1e-3, 1e-3, 1e-3), 1.0)],
)
def test_rays_leave_instances(stretch: tuple, translation: float, seed: int) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(seed) @ np.diag(stretch) @ rotation(seed + 10)
    matrix[:3, 3] = translation * np.array([0.3, -1.0, 0.6])
    points, faces = octasphere(5)
    hits, _ = spawn(solid(points, faces, matrix), seed)
    assert hits == 0


@pytest.mark.parametrize("degrees", [0, 5, 45, 80, 89, 89.9])
@pytest.mark.parametrize("half_size", [1.0, 1e3, 1e6])
def test_rays_leave_a_great_plane(half_size: float, degrees: float) -> None:
    """Tilted ones too: nothing about the plane's position is exact there."""
    square = half_size * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    angle = np.radians(degrees)
    azimuth = np.random.default_rng(0).uniform(0, 2 * np.pi, RAYS)
    d = np.stack([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.full(RAYS, np.cos(angle))], 1)
    for turn in (np.eye(3), rotation(4)):
        hits, _ = spawn(solid(square @ turn.T, np.array([[0, 1, 2], [0, 2, 3]])), 2, d @ turn.T)
        assert hits == 0


def test_a_ray_straight_up_from_a_great_ground_plane_starts_near() -> None:
    """A kilometre of ground and a thing a tenth of a millimetre above it: contact shadows need less."""
    square = 500.0 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    up = np.tile([0.0, 0, 1], (RAYS, 1))
    _, steps = spawn(solid(square, np.array([[0, 1, 2], [0, 2, 3]])), 3, up)
    assert steps.max() < 1e-4
    assert steps.min() > 0


def test_offsets_are_small_beside_the_solid() -> None:
    """R5: below 2^-14 of the coordinates."""
    points, faces = octasphere(5)
    _, steps = spawn(solid(points, faces), 4)
    assert steps.min() > 0
    assert steps.max() < 2.0**-14
