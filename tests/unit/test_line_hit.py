# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Hits of spawned rays, corrected for the offset of their origins, against the plane equation in float64."""

from __future__ import annotations

import numpy as np
import warp as wp

from warp_rt import Scene, build_accel
from warp_rt.kernels.bvh_structs import Hit
from warp_rt.kernels.line_hit import correct_hit
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.kernels.transform import transform_vector
from warp_rt.kernels.triangle import load_triangle
from warp_rt.upload.device_scene import upload_scene

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

RAYS = 2000


@wp.kernel
def correct(
    scene: wp.array[SceneData],
    found: wp.array[wp.vec3],
    offsets: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    corrected: wp.array[wp.vec3],
):
    """Correct hits (t, u, v) on the only triangle."""
    i = wp.tid()
    hit = Hit()
    hit.instance = 0
    hit.triangle = 0
    hit.t = found[i][0]
    hit.u = found[i][1]
    hit.v = found[i][2]
    to_local = scene[0].instances[0].local_from_world
    triangle = load_triangle(scene[0], 0, 0)
    correct_hit(hit, triangle, transform_vector(to_local, offsets[i]), transform_vector(to_local, directions[i]))
    corrected[i] = wp.vec3(hit.t, hit.u, hit.v)


def meet(corners: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return t, u, v where rays meet a triangle's plane: o + t d = p0 + u e1 + v e2, shape [n, 3]."""
    e1, e2 = corners[1] - corners[0], corners[2] - corners[0]
    columns = np.stack([-direction, np.broadcast_to(e1, direction.shape), np.broadcast_to(e2, direction.shape)], -1)
    return np.linalg.solve(columns, (origin - corners[0])[..., None])[..., 0]


def run(offset_size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return hits of shifted rays on a placed triangle: as found, corrected, and as of the rays not shifted."""
    rng = np.random.default_rng(5)
    points = rng.normal(size=(3, 3)).astype(np.float32)
    matrix = np.eye(4)
    matrix[:3] = rng.normal(size=(3, 4))
    scene = Scene.from_arrays(points, [(0, 1, 2)], world_from_local=matrix)
    corners = points.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    share = rng.dirichlet((2, 2, 2), RAYS)
    direction = rng.normal(size=(RAYS, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    origin = share @ corners - rng.uniform(1, 5, (RAYS, 1)) * direction
    offset = rng.normal(size=(RAYS, 3)) * offset_size
    found = meet(corners, origin + offset, direction)
    accel = build_accel(scene, device="cpu")
    data = upload_scene(scene, device="cpu", placement=accel.placement)
    corrected = wp.zeros(RAYS, dtype=wp.vec3, device="cpu")
    rows = [wp.array(values.astype(np.float32), dtype=wp.vec3, device="cpu") for values in (found, offset, direction)]
    inputs = [wp.array([data.data], dtype=SceneData, device="cpu"), *rows, corrected]
    wp.launch(correct, dim=RAYS, inputs=inputs, device="cpu")
    return found, corrected.numpy(), meet(corners, origin, direction)


def test_the_offset_leaves_no_trace() -> None:
    found, corrected, expected = run(1e-3)
    inside = (expected[:, 1:].min(axis=1) >= 0) & (expected[:, 1:].sum(axis=1) <= 1)
    steep = np.abs(found[:, 0] - expected[:, 0]) < 0.2  # of a grazing ray's sums little is left
    assert (inside & steep).sum() > 0.9 * RAYS
    rows = inside & steep
    assert np.abs(found - expected)[rows].max() > 1e-2
    np.testing.assert_allclose(corrected[rows], expected[rows], atol=2e-5)


def test_hits_stay_on_the_triangle() -> None:
    found, corrected, _ = run(0.5)
    is_hit = (found[:, 1:].min(axis=1) >= 0) & (found[:, 1:].sum(axis=1) <= 1)
    assert is_hit.sum() > 0.3 * RAYS
    u, v = corrected[is_hit, 1], corrected[is_hit, 2]
    assert u.min() >= 0.0
    assert v.min() >= 0.0
    assert (u + v).max() <= 1.0 + 1e-6


def test_nothing_moves_without_an_offset() -> None:
    found, corrected, _ = run(0.0)
    np.testing.assert_array_equal(corrected, found.astype(np.float32))
