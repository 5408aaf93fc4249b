# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ray trees that grow together, their rays in groups, are those that are walked ray by ray: every bit, every count."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest
import warp as wp

import warp_rt
from warp_rt import Film, Renderer, RenderOptions
from warp_rt.kernels.constants import RAY_LISTS
from warp_rt.kernels.list_rays import gather_shadow_rays, gather_tasks, list_shadow_rays, list_tasks
from warp_rt.kernels.ray_structs import RayTask, ShadowRay
from warp_rt.rendering import worker_scratch
from warp_rt.rendering.tile_scratch import make_tile_trees
from warp_rt.scene import Instances, Mesh, Scene
from warp_rt.warp_setup import init_warp

from ..analytic.scenes import distant, lamp, whitted
from ..analytic.test_film import BUSY_CAMERA, busy_scene
from .test_bvh import random_matrices

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SCENES = Path(__file__).resolve().parents[2] / "scenes"
STAGES = sorted(path.stem for path in SCENES.glob("*.usda"))
SIZE = {"width": 72, "height": 54}
AOVS = ("color", "depth", "normal", "position", "uv", "primId", "instanceId", "elementId")


@functools.cache
def scene_of(stage: str) -> Scene:
    return warp_rt.load_scene(SCENES / f"{stage}.usda")


def both(scene: Scene, camera: object = None, **options: object) -> tuple[Film, Film]:
    """Return the film of trees that grow together, and that of trees which are walked: costs are counted ray by ray."""
    films = []
    for aovs in (AOVS, (*AOVS, "rays")):
        chosen = RenderOptions(**(SIZE | {"aovs": aovs, "threads": 1} | options))
        films.append(Renderer(scene, chosen, device="cpu").render(camera=camera))
    return films[0], films[1]


def assert_same(together: Film, walked: Film) -> None:
    for name, values in together.aovs.items():
        np.testing.assert_array_equal(values, walked.aovs[name], err_msg=name)
    assert together.rays == walked.rays


@pytest.mark.parametrize("stage", STAGES)
def test_every_feature(stage: str) -> None:
    assert_same(*both(scene_of(stage)))


@pytest.mark.parametrize(
    "options",
    [
        {"depth": 1},
        {"depth": 12, "threshold": 0.0},
        {"threshold": 0.2},
        {"spp": 3, "seed": 5},
        {"shadows": "transmit"},
        {"shadows": "opaque"},
        {"light_samples": 3, "lights_visible": True},
        {"crop": (5, 3, 41, 22)},
        {"tile_size": 7},
        {"tile_size": 100},
        {"threads": 3},
    ],
    ids=str,
)
@pytest.mark.parametrize("stage", ["busy", "glass", "preview_surface"])
def test_every_option(stage: str, options: dict[str, object]) -> None:
    if stage == "busy":
        assert_same(*both(busy_scene(), BUSY_CAMERA, **options))
    else:
        assert_same(*both(scene_of(stage), **options))


@pytest.mark.parametrize("spp", [1, 2])
@pytest.mark.parametrize("stage", ["busy", "glass", "preview_surface", "textures", "mirror_corridor"])
def test_what_finds_no_room(stage: str, spp: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Room for few nodes beyond those of the eye rays, and for so few shadow rays that sums are torn apart."""
    small = functools.partial(make_tile_trees, nodes=600, shadow_rays=33)
    monkeypatch.setattr(worker_scratch, "make_tile_trees", small)
    scene, camera = (busy_scene(), BUSY_CAMERA) if stage == "busy" else (scene_of(stage), None)
    assert_same(*both(scene, camera, spp=spp, threshold=0.0, light_samples=2))


def test_surfaces_that_coincide() -> None:
    """Of triangles that are equally far a ray meets the same one in a group as alone: who is met decides the colour."""
    rng = np.random.default_rng(1)
    corners = rng.uniform(-1, 1, (300, 3, 3))
    corners = np.concatenate([corners, corners[rng.permutation(300)], corners[:, [1, 2, 0]]])
    places = np.concatenate([random_matrices(4, seed=1), np.eye(4)[None]]).repeat(3, axis=0)
    rows = np.arange(len(places), dtype=np.int32)
    colors = rng.uniform(0, 1, (len(rows), 3))
    scene = Scene(
        meshes=(Mesh(corners.reshape(-1, 3).astype(np.float32), np.arange(2700, dtype=np.int32).reshape(-1, 3)),),
        instances=Instances(0 * rows, places, rows, rows, rows, 0 * rows - 1),
        prims=tuple(f"/part{row}" for row in rows),
        materials=tuple(whitted(ambient=0.1, diffuse=tuple(color), reflection=0.5) for color in colors),
        lights=(distant((0.5, 0.3, -1.0), 0.5), lamp(2, (2.0, -3.0, 4.0), 8.0)),
    )
    together, walked = both(scene, spp=2)
    assert_same(together, walked)
    assert len(np.unique(together.aovs["elementId"])) > 100
    assert_same(both(scene, spp=2, tile_size=5)[0], together)


@pytest.mark.parametrize("stage", ["glass", "mirror_teapot"])
def test_the_tree_of_a_pixel_adds_up_to_its_colour(stage: str) -> None:
    prepared = Renderer(scene_of(stage), RenderOptions(**SIZE), device="cpu")
    film = prepared.render()
    for x, y in ((36, 27), (20, 30), (50, 40), (3, 50)):
        assert prepared.trace_tree(x, y).value == tuple(film.color[y, x].tolist())


# --- lists and groups, against NumPy


@wp.kernel
def list_and_gather(
    tasks: wp.array[RayTask],
    rays: wp.array[ShadowRay],
    first: int,
    count: int,
    keys: wp.array[int],
    order_out: wp.array2d[int],
    ends_out: wp.array2d[int],
    groups_out: wp.array2d[float],
    group_ends_out: wp.array2d[float],
    senders_out: wp.array2d[int],
    triangles_out: wp.array2d[int],
):
    list_tasks(tasks, first, count, keys, order_out[0], ends_out[0])
    list_shadow_rays(rays, first, count, keys, order_out[1], ends_out[1])
    gather_tasks(tasks, order_out[0], 3, 20, groups_out[0], group_ends_out[0], senders_out[0], triangles_out[0])
    gather_shadow_rays(rays, order_out[1], 3, 20, groups_out[1], group_ends_out[1], senders_out[1], triangles_out[1])


def test_rays_are_listed_by_octant_and_sender() -> None:
    rng = np.random.default_rng(7)
    count, first = 500, 40
    tasks, rays = np.zeros(count, RayTask.numpy_dtype()), np.zeros(count, ShadowRay.numpy_dtype())
    origins, directions = (rng.normal(size=(count, 3)).astype(np.float32) for _ in range(2))
    directions[rng.integers(count, size=20), rng.integers(3, size=20)] = rng.choice([np.nan, np.inf, -0.0], 20)
    reach = rng.choice(np.float32([np.inf, 3, 0, -1, np.nan]), count)
    senders, triangles, lights = (rng.integers(-1, 100, count).astype(np.int32) for _ in range(3))
    for array in (tasks, rays):
        array["origin"], array["direction"], array["reach"] = origins, directions, reach
        array["from_instance"], array["from_triangle"] = senders, triangles
    rays["light"] = lights
    orders, ends = np.zeros((2, 2 * count), np.int32), np.zeros((2, 9), np.int32)
    outputs = [wp.array(values, dtype=int, device="cpu") for values in (orders, ends)]
    groups = [wp.zeros((2, size), dtype=float, device="cpu") for size in (2000, 32)]
    starts = [wp.zeros((2, 32), dtype=int, device="cpu") for _ in range(2)]
    inputs = [
        wp.array(tasks, dtype=RayTask, device="cpu"),
        wp.array(rays, dtype=ShadowRay, device="cpu"),
        *(first, count - first),
        wp.zeros(count, dtype=int, device="cpu"),
    ]
    wp.launch(list_and_gather, 1, inputs=inputs, outputs=[*outputs, *groups, *starts], device="cpu")
    octant = ((directions < 0) * [1, 2, 4]).sum(axis=1)
    octant[~np.isfinite(directions).all(axis=1) | ~(reach >= 0)] = 8
    for row, parts in enumerate((senders.astype(np.uint32), (5 * senders + lights).astype(np.uint32))):
        part = np.where(octant == 8, 0, parts % np.uint32(RAY_LISTS))
        expected = first + np.lexsort((part[first:], octant[first:]))  # stable
        order = outputs[0].numpy()[row, : count - first]
        np.testing.assert_array_equal(order, expected)
        np.testing.assert_array_equal(outputs[1].numpy()[row], np.searchsorted(octant[expected], range(1, 10)))
        chosen = np.where(np.arange(32) < 20, order[3 : 3 + 32], order[3])
        np.testing.assert_array_equal(groups[0].numpy()[row].reshape(-1)[:96].reshape(3, 32), origins[chosen].T)
        np.testing.assert_array_equal(
            groups[1].numpy()[row], np.where(np.arange(32) < 20, reach[chosen], np.float32(-1))
        )
        np.testing.assert_array_equal(starts[0].numpy()[row], senders[chosen])
        np.testing.assert_array_equal(starts[1].numpy()[row], triangles[chosen])
