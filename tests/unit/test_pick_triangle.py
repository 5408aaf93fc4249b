# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Triangles of mesh lights that are taken by chance: how often, and that none that shines is left out."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.light_structs import LightCluster, LightData, LightMeshData, LightTriangle
from warp_rt.kernels.pick_triangle import pick_triangle
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.scene import Light, LightKind
from warp_rt.upload.device_lights import light_record
from warp_rt.upload.light_tables import LightTables
from warp_rt.warp_setup import init_warp

init_warp()
COUNT = 1 << 16


@wp.kernel
def pick_all(
    scenes: wp.array[SceneData],
    lights: wp.array[LightData],
    position: wp.vec3,
    n: wp.vec3,
    rows: wp.array[int],
    chances: wp.array[wp.vec2],
):
    """Pick triangles, and tell how likely each was, the second time by its row."""
    i = wp.tid()
    mesh = scenes[0].light_meshes[0]
    u = (float(i) + 0.5) / float(rows.shape[0])
    picked = pick_triangle(scenes[0], lights[0], mesh, position, n, u, -1)
    rows[i] = picked.row
    chances[i] = wp.vec2(picked.chance, picked.rest)


@wp.kernel
def chance_of_all(
    scenes: wp.array[SceneData], lights: wp.array[LightData], position: wp.vec3, n: wp.vec3, chances: wp.array[float]
):
    """Tell how likely each triangle is."""
    i = wp.tid()
    mesh = scenes[0].light_meshes[0]
    chances[i] = pick_triangle(scenes[0], lights[0], mesh, position, n, 0.0, i).chance


def balls() -> np.ndarray:
    """Return triangles of all sizes that touch two balls, wound as seen from outside: shape [400, 3, 3]."""
    rng = np.random.default_rng(11)
    out = rng.normal(size=(400, 1, 3))
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    corners = out + rng.normal(size=(400, 3, 3)) * rng.uniform(0.01, 0.2, (400, 1, 1))
    corners -= ((corners - out) * out).sum(axis=2, keepdims=True) * out
    inwards = (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * out[:, 0]).sum(axis=1) < 0
    corners[inwards] = corners[inwards, ::-1]
    corners[200:] = 0.5 * corners[200:] + (2, 0, 1)
    return corners.astype(np.float32)


def uploaded(light: Light) -> tuple[SceneData, wp.array, np.ndarray]:
    """Return the scene, which has to outlive its array, the light's array, and the corners of its triangles."""
    tables = LightTables(lambda light: (-1, np.ones(3)))
    record = np.zeros(1, LightData.numpy_dtype())
    for name, value in light_record(light, np.zeros(3), tables).items():
        record[0][name] = value
    scene = SceneData()
    mesh = np.zeros(1, LightMeshData.numpy_dtype())
    for name, value in tables.meshes[0].items():
        mesh[0][name] = value
    scene.light_meshes = wp.array(mesh, dtype=LightMeshData, device="cpu")
    scene.light_triangles = wp.array(tables.triangles[0], dtype=LightTriangle, device="cpu")
    scene.light_clusters = wp.array(tables.clusters[0], dtype=LightCluster, device="cpu")
    table = tables.triangles[0]
    corners = table["origin"][:, None] + np.stack([0 * table["side_x"], table["side_x"], table["side_y"]], axis=1)
    return scene, wp.array(record, dtype=LightData, device="cpu"), corners.astype(float)


def sent(corners: np.ndarray, light: Light, place: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Return about what each triangle sends, from 256 patches of each: float64, shape [n]."""
    middles = np.array([(i + 1 / 3, j + 1 / 3) for i in range(16) for j in range(16 - i)])
    middles = np.concatenate([middles, [(i + 2 / 3, j + 2 / 3) for i in range(15) for j in range(15 - i)]]) / 16
    x, y = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    points = corners[:, None, 0] + middles[:, :1] * x[:, None] + middles[:, 1:] * y[:, None] - place
    d2 = (points**2).sum(axis=2)
    facing = -(points * np.cross(x, y)[:, None]).sum(axis=2)
    facing = np.abs(facing) if light.is_double_sided else np.maximum(facing, 0)
    cosine = points @ light.world_from_light[:3, 2] / np.sqrt(d2)
    shape = np.abs(cosine) ** light.focus * (np.arccos(np.clip(cosine, -1, 1)) < light.cone_angle)
    return (facing * np.maximum(points @ n, 0) / d2**2 * shape).mean(axis=1)


SHAPINGS = ({}, {"is_double_sided": True}, {"focus": 8.0}, {"cone_angle": 0.5})


@pytest.mark.parametrize("place", [(0.2, -1.4, 0.2), (3.0, -2.0, -1.0), (-6.0, 8.0, -20.0)])
@pytest.mark.parametrize("shaping", SHAPINGS, ids=["plain", "both sides", "focus", "cone"])
def test_triangles_are_taken_as_often_as_is_told_and_none_that_shines_is_left_out(shaping: dict, place: tuple) -> None:
    light = Light("/l", LightKind.MESH, np.eye(4), (1, 1, 1), triangles=balls(), **shaping)
    n = np.array([0.0, 0.6, 0.8])
    scene, lights, corners = uploaded(light)
    scenes = wp.array([scene], dtype=SceneData, device="cpu")
    rows = wp.zeros(COUNT, dtype=int, device="cpu")
    chances = wp.zeros(COUNT, dtype=wp.vec2, device="cpu")
    inputs = [scenes, lights, wp.vec3(*place), wp.vec3(*n)]
    wp.launch(pick_all, COUNT, [*inputs, rows, chances], device="cpu")
    each = wp.zeros(len(corners), dtype=float, device="cpu")
    wp.launch(chance_of_all, len(corners), [*inputs, each], device="cpu")
    picked, (chance, rest), expected = rows.numpy(), chances.numpy().T, each.numpy().astype(float)
    amounts = sent(corners, light, np.array(place), n)
    assert expected[amounts > 1e-9 * amounts.sum()].min(initial=1) > 0
    taken = chance > 0
    if not amounts.any():
        return
    assert taken.mean() == pytest.approx(expected.sum(), abs=1e-3)
    np.testing.assert_allclose(chance[taken], expected[picked[taken]], rtol=1e-5)
    often = np.bincount(picked[taken], minlength=len(corners)) / COUNT
    np.testing.assert_allclose(often, expected, atol=3 / COUNT)
    assert rest[taken].min() >= 0
    assert rest[taken].max() <= 1
    assert rest[taken].mean() == pytest.approx(0.5, abs=0.01)
    if np.linalg.norm(place) < 2:
        return  # parts that look as wide as this tell little of what a focus leaves of them; aimed samples do
    # The estimate of all light by one triangle, whose variance is at least twice as large by area alone.
    share = amounts / amounts.sum()
    by_area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    spread = (share[share > 0] ** 2 / expected[share > 0]).sum() - 1
    assert spread < 0.5 * ((share**2 / (by_area / by_area.sum())).sum() - 1)
