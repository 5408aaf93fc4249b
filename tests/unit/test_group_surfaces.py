# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Surface points of a group's hits: sixteen at a time and one by one, to the last bit."""

from __future__ import annotations

import numpy as np
import warp as wp

from warp_rt import build_accel
from warp_rt.bvh.ray_group import make_ray_group
from warp_rt.kernels.bvh_structs import AccelData, Hit, InstanceRecord
from warp_rt.kernels.constants import DIRECTION_ROW, GROUP, SPHERE, SURFACE_FLOATS, TRIANGLES
from warp_rt.kernels.group_structs import RayGroup
from warp_rt.kernels.group_surfaces import find_surfaces, surface_in_group
from warp_rt.kernels.line_hit import surface_on_line
from warp_rt.kernels.ray_structs import RayTask
from warp_rt.kernels.scene_structs import InstanceData, SceneData
from warp_rt.kernels.surface import Surface
from warp_rt.scene import Instances, Mesh, Primvar, Scene, ShapeKind, Shapes
from warp_rt.upload.device_scene import upload_scene
from warp_rt.warp_setup import init_warp

from ..analytic.scenes import whitted
from ..property.test_bvh import random_matrices

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

GROUPS = 60
RAYS = GROUPS * int(GROUP)
COUNT = 200
"""Of triangles a mesh."""


def test_the_matrices_of_an_instance_are_its_first_24_numbers() -> None:
    """As ``find_surfaces`` reads them."""
    layout = InstanceData.numpy_dtype()
    assert [layout["offsets"][layout["names"].index(name)] for name in ("world_from_local", "local_from_world")] == [
        0,
        12 * 4,
    ]
    assert {np.dtype(layout["formats"][k]).itemsize for k in range(2)} == {12 * 4}


@wp.kernel
def compare(
    scene: wp.array[SceneData],
    accel: wp.array[AccelData],
    groups: wp.array[RayGroup],
    tasks: wp.array[RayTask],
    hits: wp.array[Hit],
    words: wp.array[int],
    records: wp.array[int],
    surfaces: wp.array[float],
    order: wp.array[int],
    count: wp.array[int],
    found_out: wp.array2d[Surface],
    distances_out: wp.array2d[float],
):
    i = wp.tid()
    for index in range(wp.int32(GROUP)):
        k = order[i * GROUP + index]
        for axis in range(3):
            groups[0].rays[axis * GROUP + index] = tasks[k].origin[axis]
            groups[0].rays[(DIRECTION_ROW + axis) * GROUP + index] = tasks[k].direction[axis]
        groups[0].ends[index] = hits[k].t
        groups[0].u[index] = hits[k].u
        groups[0].v[index] = hits[k].v
        groups[0].words[index] = words[k]
        groups[0].records[index] = records[k]
    find_surfaces(scene[0], accel[0], groups[0], tasks, order, i * GROUP, count[i], surfaces)
    surface = Surface()
    hit = Hit()
    for index in range(count[i]):
        k = order[i * GROUP + index]
        if words[k] >= 0:
            distances_out[0, k] = surface_in_group(
                scene[0], accel[0], groups[0], tasks[k], surfaces, index, hit, surface
            )
            found_out[0, k] = surface
            distances_out[1, k] = surface_on_line(
                scene[0], hits[k], tasks[k].origin, tasks[k].offset, tasks[k].direction, surface
            )
            found_out[1, k] = surface


def scene_of_every_kind(rng: np.random.Generator) -> Scene:
    """Return meshes of COUNT triangles, smooth and flat, slivers and great ones, and balls, in many places."""
    corners = rng.normal(size=(COUNT, 3, 3))
    corners[::5, 2] = corners[::5, 1] + 1e-5 * rng.normal(size=(len(corners[::5]), 3))
    great = 10 ** rng.uniform(-3, 4, (COUNT, 1, 1)) * corners
    triangles = np.arange(3 * COUNT, dtype=np.int32).reshape(-1, 3)
    normals = rng.normal(size=(50, 3)).astype(np.float32)
    normals[:5] = 0.0
    chosen = rng.integers(0, 50, (COUNT, 3)).astype(np.int32)
    points = [values.reshape(-1, 3).astype(np.float32) for values in (corners, great)]
    places = np.concatenate([np.eye(4)[None], random_matrices(30, seed=3)])
    kinds = np.arange(len(places), dtype=np.int32) % 4
    slots = rng.integers(0, 2, COUNT).astype(np.int32)
    return Scene(
        meshes=(
            Mesh(points[0], triangles, normals=Primvar(normals, chosen), material_slots=slots),
            Mesh(points[1], triangles),
            Mesh(points[1], triangles, normals=Primvar(normals[9:10])),
            Shapes(ShapeKind.SPHERE, points[0][:COUNT, None], np.ones((COUNT, 1), np.float32)),
        ),
        instances=Instances(kinds, places, *(0 * kinds for _ in range(3)), 0 * kinds - 1),
        prims=("/part",),
        materials=(whitted(), whitted()),
    )


def test_sixteen_at_a_time_or_one_by_one() -> None:
    rng = np.random.default_rng(2)
    scene = scene_of_every_kind(rng)
    accel = build_accel(scene, device="cpu")
    data = upload_scene(scene, device="cpu", placement=accel.placement)
    kinds = scene.instances.mesh
    table, records = AccelData(), np.zeros(len(kinds), InstanceRecord.numpy_dtype())
    records["instance"] = np.arange(len(kinds))
    records["kind"] = np.where(kinds == 3, int(SPHERE), int(TRIANGLES))
    table.instances = wp.array(records, dtype=InstanceRecord, device="cpu")
    table.leaves = wp.array(np.arange(COUNT, dtype=np.int32).view(np.float32), dtype=float, device="cpu")
    table.shapes = table.leaves
    tasks, hits = np.zeros(RAYS, RayTask.numpy_dtype()), np.zeros(RAYS, Hit.numpy_dtype())
    origin, offset, direction = rng.normal(size=(3, RAYS, 3))
    tasks["origin"], tasks["direction"] = origin, direction / np.linalg.norm(direction, axis=1, keepdims=True)
    tasks["offset"] = offset * 10 ** rng.uniform(-6, 0, (RAYS, 1)) * rng.integers(0, 2, (RAYS, 1))
    # Rays of some groups have met the same instance, those of others any.
    record = rng.integers(0, len(kinds), RAYS).astype(np.int32)
    record.reshape(GROUPS, -1)[::3] = record.reshape(GROUPS, -1)[::3, :1]
    hits["u"], hits["v"] = rng.dirichlet((1, 1, 1), RAYS)[:, :2].T
    hits["t"], hits["instance"] = 10 ** rng.uniform(-3, 3, RAYS), record
    hits["triangle"] = rng.integers(0, COUNT, RAYS)
    words = np.where(rng.uniform(size=RAYS) < 0.9, hits["triangle"], -1).astype(np.int32)
    words.reshape(GROUPS, -1)[-1, :16] = -1
    group = make_ray_group(accel)
    found = wp.zeros((2, RAYS), dtype=Surface, device="cpu")
    distances = wp.zeros((2, RAYS), dtype=float, device="cpu")
    inputs = [
        wp.array([data.data], dtype=SceneData, device="cpu"),
        wp.array([table], dtype=AccelData, device="cpu"),
        wp.array([group], dtype=RayGroup, device="cpu"),
        wp.array(tasks, dtype=RayTask, device="cpu"),
        wp.array(hits, dtype=Hit, device="cpu"),
        *(wp.array(values, dtype=int, device="cpu") for values in (words, record)),
        wp.empty(int(SURFACE_FLOATS), dtype=float, device="cpu"),
        wp.array(rng.permutation(RAYS).astype(np.int32), dtype=int, device="cpu"),
        wp.array(rng.integers(1, int(GROUP) + 1, GROUPS).astype(np.int32), dtype=int, device="cpu"),
    ]
    wp.launch(compare, GROUPS, inputs=inputs, outputs=[found, distances], device="cpu")
    together, alone = found.numpy()
    compared = np.flatnonzero(alone["clearance"] > 0)
    assert len(compared) > RAYS / 3
    for name in together.dtype.names:
        np.testing.assert_array_equal(together[name], alone[name], err_msg=name)
    np.testing.assert_array_equal(*distances.numpy())
