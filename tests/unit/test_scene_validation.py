# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scenes made by hand are refused where no hierarchy can be built over them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import warp_rt
from warp_rt.errors import SceneError
from warp_rt.options import BUILDERS
from warp_rt.scene import Instances, Mesh, Scene, ShapeKind, Shapes

from ..meshes import cube

ROW = np.zeros(1, np.int32)


def placed(matrix: np.ndarray) -> Scene:
    mesh = Mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
    return Scene((mesh,), Instances(ROW, matrix[None], ROW, ROW, ROW, ROW - 1), prims=("/m",))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_transforms_are_finite(value: float) -> None:
    with pytest.raises(SceneError, match="finite transforms"):
        placed(np.diag([value, 1, 1, 1]))


def test_transforms_stay_in_the_range_of_float32() -> None:
    with pytest.raises(SceneError, match="range of float32"):
        warp_rt.build_accel(placed(np.diag([1e45, 1, 1, 1])))


@pytest.mark.parametrize("bvh", BUILDERS)
@pytest.mark.parametrize("scale", [1e16, 1e38, np.nan])
def test_points_beyond_what_a_hierarchy_can_measure_are_refused(bvh: str, scale: float) -> None:
    """Sums of two coordinates of 3e38 are infinite, and areas of boxes of 1e20: neither says where to split."""
    corners = np.float32(scale) * np.random.default_rng(0).uniform(-1, 1, (900, 3)).astype(np.float32)
    mesh = Mesh(corners, np.arange(900, dtype=np.int32).reshape(-1, 3))
    scene = Scene((mesh,), Instances(ROW, np.eye(4)[None], ROW, ROW, ROW, ROW - 1))
    with pytest.raises(SceneError, match=r"mesh 0: a point is (not finite|farther than 1e\+15)"):
        warp_rt.build_accel(scene, bvh=bvh)


@pytest.mark.parametrize("bvh", BUILDERS)
def test_the_largest_scenes_have_the_hierarchy_of_small_ones(bvh: str) -> None:
    """A power of two as a scale changes no digit: where nothing overflows, every split and every cost is the same."""
    corners = np.random.default_rng(0).uniform(-1.7, 1.7, (3000, 3)).astype(np.float32)
    triangles = np.arange(3000).reshape(-1, 3)
    small, large = (warp_rt.build_accel(Scene.from_arrays(s * corners, triangles), bvh=bvh) for s in (1, 2.0**49))
    assert large.statistics.nodes == small.statistics.nodes
    assert large.statistics.sah_cost == pytest.approx(small.statistics.sah_cost, rel=1e-5)


@pytest.mark.parametrize("far", [1e38, np.inf, np.nan])
def test_points_that_no_triangle_names_may_lie_anywhere(far: float) -> None:
    points, triangles = cube()
    beside = np.concatenate([points, np.full((1, 3), far)]).astype(np.float32)
    scene = Scene((Mesh(beside, triangles),), Instances(ROW, np.eye(4)[None], ROW, ROW, ROW, ROW - 1))
    accel = warp_rt.build_accel(scene)
    hits = warp_rt.closest_hit(accel, np.float32([[0.1, 0.2, 9]]), np.float32([[0, 0, -1]]))
    assert hits.instance[0] == 0


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ({"mesh": ROW + 7}, "mesh 7 is no row of 1 meshes"),
        ({"mesh": ROW - 1}, "mesh -1 is no row"),
        ({"material_offset": ROW + (1 << 28)}, "material_offset 268435456 is no row of 1 material_table"),
        ({"material_offset": ROW - 1}, "material_offset -1 is no row"),
        ({"material_table": ROW + (1 << 27)}, "material_table 134217728 is no row of 1 materials"),
        ({"material_table": ROW - 1}, "material_table -1 is no row"),
        ({"prim": ROW + 1}, "prim 1 is no row of 1 prims"),
    ],
)
def test_rows_that_do_not_exist_are_refused(rows: dict[str, np.ndarray], message: str) -> None:
    scene = Scene.from_arrays(*cube())
    with pytest.raises(SceneError, match=message):
        replace(scene, instances=replace(scene.instances, **rows))


@pytest.mark.parametrize(
    ("slots", "message"),
    [(1, "material_slots 1 is no row of 1 material_table"), (-1, "material_slots: -1 of mesh 0 is below 0")],
)
def test_a_slot_beyond_the_materials_is_refused(slots: int, message: str) -> None:
    scene = Scene.from_arrays(*cube())
    mesh = scene.meshes[0]
    assert isinstance(mesh, Mesh)
    slotted = replace(mesh, material_slots=np.full(len(mesh.triangles), slots, np.int32))
    with pytest.raises(SceneError, match=message):
        warp_rt.Renderer(replace(scene, meshes=(slotted,)), device="cpu")


def test_what_is_rendered_has_a_material() -> None:
    """A query needs none."""
    scene = replace(Scene.from_arrays(*cube()), materials=())
    warp_rt.build_accel(scene)
    with pytest.raises(SceneError, match="at least one"):
        warp_rt.Renderer(scene, device="cpu")


@pytest.mark.parametrize(("center", "radius"), [(np.nan, 1), (0, np.nan), (0, -1), (np.inf, 1)])
def test_shapes_have_places_and_sizes(center: float, radius: float) -> None:
    with pytest.raises(SceneError, match="shapes: finite"):
        Shapes(ShapeKind.SPHERE, np.full((1, 1, 3), center, np.float32), np.full((1, 1), radius, np.float32))


def test_a_mesh_without_extent_has_a_cost() -> None:
    scene = Scene.from_arrays(np.zeros((3, 3)), [(0, 1, 2)])
    assert warp_rt.build_accel(scene).statistics.sah_cost == 0


@pytest.mark.parametrize(
    "arguments",
    [
        {"points": "abc"},
        {"points": None},
        {"points": [[0, 0, 0], [1, 0]]},
        {"faces": [[0.5, 1, 2]]},
        {"faces": [[0, 1, 1 << 40]]},
        {"normals": [["a"] * 3] * 3},
        {"world_from_local": "xyz"},
        {"material": "/material"},
        {"lights": 3},
        {"cameras": ["/camera"]},
    ],
)
def test_arrays_of_another_type_are_refused_with_a_line_that_names_them(arguments: dict) -> None:
    ((name, _),) = arguments.items()
    with pytest.raises(SceneError, match=f"^{name}: .* expected"):
        Scene.from_arrays(**({"points": np.eye(3), "faces": [[0, 1, 2]]} | arguments))


def test_whole_numbers_may_be_floats() -> None:
    scene = Scene.from_arrays(np.eye(3), [[0.0, 1.0, 2.0]])
    assert scene.meshes[0].triangles.dtype == np.int32
