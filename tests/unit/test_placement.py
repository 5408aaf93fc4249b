# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Coordinates of the device against float64 arithmetic on the scene's own."""

import numpy as np

from warp_rt.scene import Scene
from warp_rt.scene.placement import place_scene, relative_points

from ..meshes import cube


def world_points(scene: Scene) -> np.ndarray:
    matrix = scene.instances.world_from_local[0]
    return scene.meshes[0].points.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]


def check(scene: Scene) -> None:
    placement = place_scene(scene)
    local = relative_points(scene.meshes[0].points, placement.mesh_origins[0])
    m = placement.world_from_local(slice(1))[0].astype(np.float32).astype(float)
    world = local @ m[:, :3].T + m[:, 3]
    size = np.ptp(world_points(scene), axis=0).max()
    np.testing.assert_allclose(world + placement.origin, world_points(scene), atol=1e-6 * size)
    full = [
        np.vstack([m, [0, 0, 0, 1]])
        for m in (placement.world_from_local(slice(1))[0], placement.local_from_world(slice(1))[0])
    ]
    np.testing.assert_allclose(full[0] @ full[1], np.eye(4), atol=1e-9)


def test_near_the_origin_nothing_moves() -> None:
    points, triangles = cube()
    placement = place_scene(Scene.from_arrays(points, triangles))
    assert not placement.origin.any()
    assert not placement.mesh_origins.any()
    np.testing.assert_array_equal(placement.world_from_local(slice(1))[0], np.eye(4)[:3])


def test_far_from_the_world_origin() -> None:
    points, triangles = cube()
    matrix = np.array([[0.0, -2, 1, 1e7], [3, 0, 0, -2e7], [0, 0.5, 1, 5e6], [0, 0, 0, 1]])
    check(Scene.from_arrays(points, triangles, world_from_local=matrix))


def test_far_from_its_own_origin() -> None:
    points, triangles = cube()
    shift = np.array([4096.0, -8192, 512])
    matrix = np.diag([2.0, 2, -1, 1])
    matrix[:3, 3] = -2 * shift
    check(Scene.from_arrays(points + shift, triangles, world_from_local=matrix))


def test_no_meshes() -> None:
    scene = Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert place_scene(scene).mesh_origins.shape == (0, 3)
