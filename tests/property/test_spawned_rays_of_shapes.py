# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Spawned rays leave the shape that they start on without meeting it there, and meet it again where they must.

Outwards from a convex solid nothing is met. Inwards its far side is, as far off as float64 says, however short the
chord. A tube, which may be met again, is not met at once.
"""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt import build_accel
from warp_rt.bvh.stacks import make_stacks
from warp_rt.kernels.bvh_structs import AccelData, Stacks, stack_of_thread
from warp_rt.kernels.bvh_traverse import closest_hit, closest_hit_from
from warp_rt.kernels.observer import Unobserved
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.kernels.spawn import spawn_origin
from warp_rt.kernels.surface import make_surface
from warp_rt.scene import Instances, Material, MaterialModel, Scene, ShapeKind, Shapes
from warp_rt.upload.device_scene import upload_scene

from ..shapes_float64 import bezier, cross_swept_ball, crossings, distance_to_swept_ball

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

RAYS = 2_000


@wp.kernel
def bounce(
    scene: wp.array[SceneData],
    accel: wp.array[AccelData],
    stacks: Stacks,
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    onward: wp.array[wp.vec3],
    is_inward: int,
    positions: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    starts: wp.array[wp.vec3],
    leaving: wp.array[wp.vec3],
    t_out: wp.array[float],
):
    """Follow a ray to a shape, send another one from there, and write where that meets the shape again."""
    i = wp.tid()
    stack = stack_of_thread(stacks, 0)
    nobody = Unobserved()
    hit = closest_hit(accel[0], origins[i], directions[i], wp.inf, stack)
    t_out[i] = -1.0
    if hit.instance >= 0:
        surface = make_surface(scene[0], hit, origins[i], directions[i])
        d = onward[i]
        if (wp.dot(d, surface.n_geometric) < 0.0) != (is_inward == 1):
            d = -d
        start = spawn_origin(scene[0], surface, d)
        positions[i] = surface.position
        normals[i] = surface.n_geometric
        starts[i] = start
        leaving[i] = d
        t_out[i] = closest_hit_from(accel[0], start, d, wp.inf, hit.instance, hit.triangle, stack, nobody).t


def scene_of(shapes: Shapes, matrix: np.ndarray) -> Scene:
    row = np.zeros(1, np.int32)
    instances = Instances(row, matrix[None], row, row, row, row - 1)
    return Scene((shapes,), instances, prims=("/s",), materials=(Material("/m", MaterialModel.WHITTED),))


def spawn(shapes: Shapes, matrix: np.ndarray, seed: int, *, inward: bool) -> dict[str, np.ndarray]:
    """Return what ``bounce`` wrote for the rays that met the shape, in world space."""
    rng = np.random.default_rng(seed)
    scene = scene_of(shapes, matrix)
    accel = build_accel(scene, device="cpu")
    data = upload_scene(scene, device="cpu", placement=accel.placement)
    low, high = scene.bounds() - accel.origin
    size = np.linalg.norm(high - low)
    balls = bezier(np.concatenate([shapes.points[0], shapes.radii[0][:, None]], axis=1), rng.uniform(size=RAYS))
    inside = rng.normal(size=(RAYS, 3))
    inside *= (balls[:, 3] * rng.uniform(size=RAYS) / np.linalg.norm(inside, axis=1))[:, None]
    aim = (balls[:, :3] + inside) @ matrix[:3, :3].T + matrix[:3, 3] - accel.origin
    away = rng.normal(size=(RAYS, 3))
    origins = aim + 2 * size * away / np.linalg.norm(away, axis=1, keepdims=True)
    onward = rng.normal(size=(RAYS, 3))
    vectors = [
        wp.array(a.astype(np.float32), dtype=wp.vec3, device="cpu")
        for a in (origins, aim - origins, onward / np.linalg.norm(onward, axis=1, keepdims=True))
    ]
    outputs = [wp.zeros(RAYS, dtype=wp.vec3, device="cpu") for _ in range(4)] + [wp.zeros(RAYS, dtype=float)]
    table = wp.array([data.data], dtype=SceneData, device="cpu")
    inputs = [table, accel.table, make_stacks(accel), *vectors, int(inward), *outputs]
    wp.launch(bounce, RAYS, inputs=inputs, device="cpu")
    names = ("position", "normal", "start", "direction", "t")
    found = {name: array.numpy().astype(float) for name, array in zip(names, outputs, strict=True)}
    is_hit = found["t"] >= 0
    assert is_hit.sum() > 200
    for name in ("position", "start"):
        found[name] += accel.origin
    return {name: values[is_hit] for name, values in found.items()}


SOLIDS = {
    "sphere": Shapes(ShapeKind.SPHERE, np.float32([[[0.2, -0.1, 0.3]]]), np.float32([[1]])),
    "cylinder": Shapes(ShapeKind.FRUSTUM, np.float32([[[0, 0, -1], [0.3, 0, 1]]]), np.float32([[0.7, 0.7]])),
    "cone": Shapes(ShapeKind.FRUSTUM, np.float32([[[0, 0.5, -1], [0, 0, 1]]]), np.float32([[1, 0]])),
    "needle": Shapes(ShapeKind.FRUSTUM, np.float32([[[0, 0, -9], [0.3, 0, 9]]]), np.float32([[0.02, 0.01]])),
    "disk": Shapes(ShapeKind.FRUSTUM, np.float32([[[0, 0, 0], [0, 0, 0.01]]]), np.float32([[1, 1]])),
    "capsule": Shapes(ShapeKind.ROUND_CONE, np.float32([[[0, 0, -1], [1, 0, 1]]]), np.float32([[0.5, 0.5]])),
    "round cone": Shapes(ShapeKind.ROUND_CONE, np.float32([[[0, 0, -1], [1, 0, 1]]]), np.float32([[1, 0.2]])),
}
# Bent so that its ends face each other, a tube's width and more apart.
CURL = np.float32([[[-1, 0, 0], [1.5, 0.1, 0], [1.5, 0.9, 0.3], [-1, 1, 0.4]]])
TUBES = {
    "segment": Shapes(ShapeKind.LINEAR_TUBE, CURL[:, [0, 3]], np.float32([[0.3, 0.1]]), is_closed=False),
    "curl": Shapes(ShapeKind.CUBIC_TUBE, CURL, np.float32([[0.2, 0.1, 0.1, 0.05]]), is_closed=False),
    "hair": Shapes(ShapeKind.CUBIC_TUBE, CURL, np.float32([[2e-3, 1e-3, 1e-3, 1e-4]]), is_closed=False),
}


def places() -> list[np.ndarray]:
    q, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    result = []
    for linear, translation in (
        (np.eye(3), 0.0),
        (q * 1e4, 0.0),
        (q * 1e-5, 0.0),
        (q, 1e3),
        (q @ np.diag([1.0, 5.0, 0.2]) @ q.T @ np.diag([1.0, 2.0, -1.0]), 10.0),
    ):
        matrix = np.eye(4)
        matrix[:3, :3] = linear
        matrix[:3, 3] = translation * np.array([1.0, -0.7, 0.4])
        result.append(matrix)
    return result


PLACES = pytest.mark.parametrize("matrix", places(), ids=["as it is", "great", "small", "far", "sheared"])


@PLACES
@pytest.mark.parametrize("name", [*SOLIDS, "segment"])
def test_outwards_from_a_convex_shape_nothing_is_met(name: str, matrix: np.ndarray) -> None:
    found = spawn((SOLIDS | TUBES)[name], matrix, 1, inward=False)
    assert np.isinf(found["t"]).all()


@PLACES
@pytest.mark.parametrize("name", SOLIDS)
def test_inwards_the_far_side_is_met_where_it_is(name: str, matrix: np.ndarray) -> None:
    found = spawn(SOLIDS[name], matrix, 2, inward=True)
    inverse = np.linalg.inv(matrix)
    origin = found["start"] @ inverse[:3, :3].T + inverse[:3, 3]
    direction = found["direction"] @ inverse[:3, :3].T
    expected = np.nanmax(crossings(SOLIDS[name], 0, origin, direction), axis=1)
    # By the rounding of the start, which counts the more the flatter the ray runs, and against a short chord.
    sine = np.abs((found["direction"] * found["normal"]).sum(axis=1))
    reach = reach_of(SOLIDS[name], matrix)
    is_sure = (sine > 1e-2) & (expected * np.linalg.norm(direction, axis=1) > 1e-4 * reach)
    assert is_sure.sum() > 20
    error = np.abs(found["t"] - expected) * np.linalg.norm(direction, axis=1) * sine
    assert error[is_sure].max() < 2.0**-16 * reach


def reach_of(shapes: Shapes, matrix: np.ndarray) -> float:
    """Return how large the numbers are that a ray is computed with in the shape's space."""
    inverse = np.linalg.inv(matrix)[:3, :3]
    return float(np.abs(shapes.points).max() + shapes.radii.max() + np.linalg.norm(inverse @ matrix[:3, 3]))


@PLACES
@pytest.mark.parametrize("name", ["curl", "hair"])
def test_a_tube_is_not_met_where_a_ray_leaves_it(name: str, matrix: np.ndarray) -> None:
    found = spawn(TUBES[name], matrix, 3, inward=False)
    again = np.isfinite(found["t"])
    if name == "curl":
        assert again.any()  # the curl shadows itself
    inverse = np.linalg.inv(matrix)
    origin = found["start"][again] @ inverse[:3, :3].T + inverse[:3, 3]
    direction = found["direction"][again] @ inverse[:3, :3].T
    points, radii = TUBES[name].points[0].astype(float), TUBES[name].radii[0].astype(float)
    # A hair more, for rays that only just meet the tube.
    expected = cross_swept_ball(origin, direction, points, radii * 1.001, ahead=True, samples=4097)[:, 0]
    assert np.isfinite(expected).all()
    assert (found["t"][again] * np.linalg.norm(direction, axis=1) > 1e-2 * radii.min()).all()


@PLACES
@pytest.mark.parametrize("name", [*SOLIDS, *TUBES])
def test_positions_lie_on_the_surface_and_offsets_are_small(name: str, matrix: np.ndarray) -> None:
    shapes = (SOLIDS | TUBES)[name]
    found = spawn(shapes, matrix, 4, inward=False)
    inverse = np.linalg.inv(matrix)
    position = found["position"] @ inverse[:3, :3].T + inverse[:3, 3]
    points, radii = shapes.points[0].astype(float), shapes.radii[0].astype(float)
    if shapes.kind == ShapeKind.FRUSTUM:
        # A line along the normal, from a little outside.
        normal = found["normal"] @ matrix[:3, :3]
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        away = 1e-2 * radii.max()
        distance = crossings(shapes, 0, position + away * normal, -normal)
        distance = np.nanmin(np.where(distance >= 0, distance, np.nan), axis=1) - away
        is_seen = np.isfinite(distance)
        assert is_seen.mean() > 0.99  # all but some next to the edges of caps
        distance = distance[is_seen]
    else:
        distance = distance_to_swept_ball(position, points, radii)
    reach = reach_of(shapes, matrix)
    assert np.abs(distance).max() < 2.0**-19 * reach
    offset = np.linalg.norm(found["start"] - found["position"], axis=1)
    assert offset.max() < 2.0**-14 * reach * np.linalg.norm(matrix[:3, :3], 2)
    assert offset.min() > 0
