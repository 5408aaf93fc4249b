# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays that are taken in groups find what each of them finds alone: the same triangle, and the same bits of its hit."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
import warp as wp

import warp_rt
from warp_rt.bvh.accel import Accel
from warp_rt.bvh.queries import Hits
from warp_rt.bvh.ray_order import RayOrder, _scattered_box
from warp_rt.bvh.span_launches import SpanLaunches
from warp_rt.bvh.stacks import make_stacks
from warp_rt.errors import OptionError
from warp_rt.kernels import query
from warp_rt.kernels.constants import FLIGHT_FLOATS, GROUP, GROUP_SPAN
from warp_rt.scene import Scene, ShapeKind

from ..aimed_rays import edge_rays
from ..meshes import octasphere, soup, torus
from ..reference.test_queries import instanced_scene, rays_at
from ..reference.test_shapes import scatter, scene_of


def shape_scene(seed: int) -> Scene:
    """Return instances of every kind of shapes among others of triangles."""
    scene = instanced_scene(seed)
    kinds = [scatter(kind, 20, seed + kind) for kind in ShapeKind]
    first = len(scene.meshes)
    mesh = scene.instances.mesh.copy()
    mesh[::2] = first + np.arange(len(mesh[::2])) % len(kinds)
    return replace(scene, meshes=scene.meshes + tuple(kinds), instances=replace(scene.instances, mesh=mesh))


SCENES = {
    "sphere": Scene.from_arrays(*octasphere(5)),
    "torus": Scene.from_arrays(*torus(48, 24)),
    "soup": Scene.from_arrays(*soup(20_000, 1, size=0.05)),
    "one triangle": Scene.from_arrays(*soup(1, 2)),
    "instances": instanced_scene(3),
    "instances far away": instanced_scene(4, spread=30.0),
    "shapes": shape_scene(5),
    "spheres": scene_of(scatter(ShapeKind.SPHERE, 3000, 6)),
    "nothing": Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int)),
}


def each_alone(accel: Accel, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray) -> tuple[Hits, np.ndarray]:
    """Return the closest hits and the any hits that the kernels for single rays find."""
    count = len(origins)
    rays = [wp.array(origins - accel.origin, dtype=wp.vec3), wp.array(directions, dtype=wp.vec3)]
    inputs = [accel.table, *rays, wp.array(t_max, dtype=float), make_stacks(accel), 0]
    floats = [wp.empty(count, dtype=float) for _ in range(3)]
    ints = [wp.empty(count, dtype=int) for _ in range(2)]
    blocked = wp.empty(count, dtype=wp.bool)
    wp.launch(query.query_closest_hit, count, inputs=inputs, outputs=[*floats, *ints])
    wp.launch(query.query_any_hit, count, inputs=inputs, outputs=[blocked])
    t, u, v = (array.numpy() for array in floats)
    return Hits(t, *(array.numpy() for array in ints), u, v), blocked.numpy()


def check(accel: Accel, origins: np.ndarray, directions: np.ndarray, t_max: object = np.inf) -> Hits:
    ends = np.broadcast_to(np.float32(t_max), len(origins)).copy()
    expected, blocked = each_alone(accel, origins, directions, ends)
    hits = warp_rt.closest_hit(accel, origins, directions, t_max)
    for name in ("t", "u", "v", "triangle", "instance"):  # also where triangles meet, and are equally far
        np.testing.assert_array_equal(getattr(hits, name), getattr(expected, name))
    np.testing.assert_array_equal(warp_rt.any_hit(accel, origins, directions, t_max), blocked)
    np.testing.assert_array_equal(blocked, expected.instance >= 0)
    return hits


def pencil(scene: Scene, count: int, spread: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return bundles of 64 rays each: from a common point (spread 0) or from around it, through a patch."""
    rng = np.random.default_rng(seed)
    rays = -(-count // 64)
    eye = 4 * rng.normal(size=(rays, 1, 3)) + spread * rng.normal(size=(rays, 64, 3))
    target = rng.normal(size=(rays, 1, 3)) + 0.3 * rng.normal(size=(rays, 64, 3))
    return eye.reshape(-1, 3)[:count].astype(np.float32), (target - eye).reshape(-1, 3)[:count].astype(np.float32)


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("spread", [0.0, 0.3])
def test_bundles_of_rays(name: str, spread: float) -> None:
    accel = warp_rt.build_accel(SCENES[name])
    rays = pencil(SCENES[name], 20_000, spread, seed=1)
    check(accel, *rays)
    ends = np.random.default_rng(2).choice(np.float32([0.5, 0.9, 1.1, np.inf, 0, -1, np.nan]), len(rays[0]))
    check(accel, *rays, ends)


def test_origins_in_float64_keep_their_digits_far_away() -> None:
    """Groups meet what single rays do whose origins were moved in float64; those in float32 come from elsewhere."""
    scene = instanced_scene(3)
    center = np.array([1e6 + 1 / 3, -2e6, 5e5 + 0.1])
    scene.instances.world_from_local[:, :3, 3] += center
    accel = warp_rt.build_accel(scene)
    assert accel.origin.any()
    origins, directions = pencil(scene, 20_000, 0.3, seed=12)
    hits = check(accel, origins + center, directions)
    assert 0.2 < (hits.instance >= 0).mean() < 1
    rounded = check(accel, (origins + center).astype(np.float32), directions)
    assert (rounded.t != hits.t).mean() > 0.1


@pytest.mark.parametrize("name", SCENES)
def test_rays_in_any_direction(name: str) -> None:
    shape = octasphere(5) if name == "sphere" else torus(48, 24)
    check(warp_rt.build_accel(SCENES[name]), *rays_at(shape, 20_000, seed=3))


@pytest.mark.parametrize("name", ["sphere", "torus"])
def test_rays_at_edges(name: str) -> None:
    shape = octasphere(5) if name == "sphere" else torus(48, 24)
    rays = edge_rays(*shape, 30_000, seed=4, is_ring=name == "torus")
    hits = check(warp_rt.build_accel(SCENES[name]), *rays)
    assert (hits.instance == 0).mean() > 0.99


@pytest.mark.parametrize("count", [1, 2, GROUP - 1, GROUP, GROUP + 1, GROUP_SPAN - 1, GROUP_SPAN + 1, 5000])
def test_any_number_of_rays(count: int) -> None:
    check(warp_rt.build_accel(SCENES["instances"]), *pencil(SCENES["instances"], count, 0.1, seed=5))


@pytest.mark.parametrize("name", ["sphere", "instances", "shapes"])
def test_rays_that_are_none_do_not_disturb_their_neighbours(name: str) -> None:
    origins, directions = pencil(SCENES[name], 20_000, 0.1, seed=6)
    rng = np.random.default_rng(7)
    bad = rng.uniform(size=len(origins)) < 0.2
    values = rng.choice(np.float32([np.nan, np.inf, -np.inf, 0, -0.0, 1e25, -1e25, 1e-40]), (bad.sum(), 6))
    kept = rng.uniform(size=values.shape) < 0.5
    both = np.concatenate([origins, directions], axis=1)
    both[bad] = np.where(kept, both[bad], values)
    check(warp_rt.build_accel(SCENES[name]), both[:, :3].copy(), both[:, 3:].copy())
    directions[bad] = 0
    check(warp_rt.build_accel(SCENES[name]), origins, directions)


def test_parallel_rays_along_axes() -> None:
    """Two components of zero, of both signs: their inverses are huge, and no difference may become NaN."""
    grid = np.linspace(-1.2, 1.2, 97, dtype=np.float32)
    u, v = (c.reshape(-1) for c in np.meshgrid(grid, grid))
    for axis in range(3):
        for sign in (-1.0, 1.0):
            origins = np.stack([np.full_like(u, -2 * sign), u, v], axis=1)
            directions = np.stack([np.full_like(u, sign), 0 * u, -0.0 * v], axis=1)
            for scene in (SCENES["sphere"], SCENES["instances"]):
                check(warp_rt.build_accel(scene), np.roll(origins, axis, axis=1), np.roll(directions, axis, axis=1))


def test_deep_trees_do_not_overflow_stacks() -> None:
    count = 4000
    corners = soup(count, 1)[0].reshape(-1, 3, 3) * 2.0 ** -np.linspace(0, 120, count)[:, None, None]
    accel = warp_rt.build_accel(
        Scene.from_arrays(corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)), bvh="midpoint"
    )
    rng = np.random.default_rng(8)
    origins = rng.uniform(0.5, 1, (6400, 3)).astype(np.float32)
    check(accel, origins, (2.0 ** -rng.uniform(0, 40, (6400, 1)) * rng.uniform(0, 1, (6400, 3)) - origins).astype("f"))


def test_scattered_rays_through_a_big_hierarchy() -> None:
    """Beyond the caches they fly side by side in one thread, each by itself."""
    accel = warp_rt.build_accel(Scene.from_arrays(*soup(400_000, 9, size=0.004)))
    assert accel.data.nodes.size + accel.data.leaves.size > FLIGHT_FLOATS
    rng = np.random.default_rng(10)
    origins, directions = rng.uniform(size=(20_000, 3)).astype("f"), rng.normal(size=(20_000, 3)).astype("f")
    hits = check(accel, origins, directions)
    assert 0.3 < (hits.instance == 0).mean() < 1
    bad = rng.uniform(size=len(origins)) < 0.1
    directions[bad] = rng.choice(np.float32([0, np.nan, np.inf]), (bad.sum(), 3))
    for count in (20_000, 2, 5, 1030):
        ends = rng.choice(np.float32([0.05, 0.3, np.inf, 0, -1, np.nan]), count)
        check(accel, origins[:count], directions[:count], ends)
    directions[:] = np.nan
    check(accel, origins, directions)


def morton_order(origins: np.ndarray) -> np.ndarray:
    """Return points sorted by Morton codes of 8 bits a coordinate on the grid that rays are sorted on, by NumPy."""
    box = _scattered_box(origins)
    assert box is not None
    low, side = box
    with np.errstate(over="ignore", invalid="ignore"):
        places = (origins - low.astype(np.float32)) * np.float32(1 / side)
        is_finite = np.isfinite(places.sum(axis=1))
    cells = np.clip(places[is_finite] * 256, 0, 255).astype(int)
    codes = np.zeros(len(origins), int)
    for bit in range(8):
        for axis in range(3):
            codes[is_finite] |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(codes, kind="stable")


def test_many_scattered_rays_through_a_big_hierarchy() -> None:
    """They are sorted, and their hits stand where they stood."""
    accel = warp_rt.build_accel(Scene.from_arrays(*soup(400_000, 9, size=0.004)))
    rng = np.random.default_rng(11)
    count = 120_001
    origins, directions = rng.uniform(size=(count, 3)).astype("f"), rng.normal(size=(count, 3)).astype("f")
    bad = rng.uniform(size=count) < 0.001
    origins[bad] = rng.choice(np.float32([np.nan, np.inf, -np.inf, 1e30]), (bad.sum(), 3))
    orders = [RayOrder(accel, origins, workers) for workers in (1, 3)]
    orders[0].sort()
    with ThreadPoolExecutor(3) as pool:
        list(pool.map(lambda _: orders[1].sort(), range(3)))
    order = orders[0].rays
    np.testing.assert_array_equal(order, orders[1].rays)
    np.testing.assert_array_equal(order, morton_order(origins))
    steps = np.abs(np.diff(origins[order[~bad[order]]], axis=0)).sum(axis=1)
    assert steps.mean() < 0.1  # 1 for neighbours at random
    hits = check(accel, origins, directions, rng.choice(np.float32([0.05, 0.3, np.inf]), count))
    assert 0.1 < (hits.instance == 0).mean() < 1


def test_queries_of_several_threads_have_scratch_memory_of_their_own() -> None:
    scene = SCENES["torus"]
    accel = warp_rt.build_accel(scene)
    sets = [pencil(scene, 20 * GROUP_SPAN, 0.5, seed) for seed in range(4)]
    alone = [warp_rt.closest_hit(accel, *rays, threads=1) for rays in sets]
    assert len(accel.idle_launches) == 1
    with ThreadPoolExecutor(len(sets)) as pool:
        for _ in range(3):
            together = list(pool.map(lambda rays: warp_rt.closest_hit(accel, *rays, threads=2), sets))
            for hits, expected in zip(together, alone, strict=True):
                for name in ("t", "u", "v", "triangle", "instance"):
                    np.testing.assert_array_equal(getattr(hits, name), getattr(expected, name))
    assert 1 <= len(accel.idle_launches) <= 2 * len(sets)


def test_launches_are_used_again_for_other_arrays() -> None:
    """More and fewer rays, both queries, one end or many, more and fewer threads."""
    scene = SCENES["torus"]
    accel = warp_rt.build_accel(scene)
    for seed, (count, threads) in enumerate([(1, 1), (5000, 2), (300, 1), (9 * GROUP_SPAN, 3), (2, 2), (4097, 1)]):
        origins, directions = pencil(scene, count, 0.5, seed)
        ends = np.random.default_rng(seed).uniform(0, 9, count).astype(np.float32)
        for t_max in (np.inf, ends):
            fresh = warp_rt.build_accel(scene)
            hits = warp_rt.closest_hit(accel, origins, directions, t_max, threads=threads)
            expected = warp_rt.closest_hit(fresh, origins, directions, t_max, threads=1)
            for name in ("t", "u", "v", "triangle", "instance"):
                np.testing.assert_array_equal(getattr(hits, name), getattr(expected, name))
            blocked = warp_rt.any_hit(accel, origins, directions, t_max, threads=threads)
            np.testing.assert_array_equal(blocked, expected.instance >= 0)
    assert len(accel.idle_launches) == 1


@pytest.mark.parametrize("one", ["origins", "directions", "t_max", "hits", "blocked"])
def test_one_row_of_other_arrays_leaves_no_strides_behind(one: str) -> None:
    """NumPy calls an array of one row contiguous whatever its strides; later queries put more rows in its place."""
    scene = SCENES["torus"]
    accel = warp_rt.build_accel(scene)
    origins, directions = pencil(scene, 5000, 0.5, seed=7)
    ends = np.full(5000, 9, np.float32)
    buffer = np.zeros((10, 8), np.float32)
    buffer[0, :3], buffer[0, 3:6], buffer[0, 6] = origins[0], directions[0], 9
    lone = {"origins": origins[:1], "directions": directions[:1], "t_max": ends[:1]}
    views = {"origins": buffer[:1, :3], "directions": buffer[:1, 3:6], "t_max": buffer[:1, 6]}
    if one in lone:
        lone[one] = views[one]
    hits = Hits(
        *(np.empty(10, np.float32), *(np.empty(10, np.int32) for _ in range(2))), *np.empty((2, 10), np.float32)
    )
    blocked = np.empty((10, 2), bool)
    row = replace(hits, **{name: getattr(hits, name)[::5][:1] for name in ("t", "triangle", "instance", "u", "v")})
    warp_rt.closest_hit(accel, *lone.values(), out=row if one == "hits" else None)
    warp_rt.any_hit(accel, *lone.values(), out=blocked[:1, 0] if one == "blocked" else None)
    check(accel, origins, directions, ends)
    rng = np.random.default_rng(8)
    scattered = rng.normal(size=(2, 5000, 3)).astype(np.float32)  # not taken in groups
    check(accel, *scattered, rng.random(5000).astype(np.float32))


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_query_that_is_given_up_does_not_disturb_the_next(error: type[BaseException], monkeypatch) -> None:
    scene = SCENES["torus"]
    accel = warp_rt.build_accel(scene)
    rays = pencil(scene, 20 * GROUP_SPAN, 0.5, 1)
    expected = warp_rt.closest_hit(accel, *rays)

    def fail(*_: object) -> None:
        raise error

    with monkeypatch.context() as patch:
        patch.setattr(SpanLaunches, "launch", fail)
        with pytest.raises(error):
            warp_rt.closest_hit(accel, *rays, threads=2)
    assert len(accel.idle_launches) == 0
    np.testing.assert_array_equal(warp_rt.closest_hit(accel, *rays, threads=2).triangle, expected.triangle)


def test_rays_in_every_second_row_of_warp_arrays() -> None:
    scene = SCENES["sphere"]
    accel = warp_rt.build_accel(scene)
    origins, directions = pencil(scene, 3 * GROUP_SPAN, 0.5, 5)
    ends = np.linspace(0.0, 9.0, len(origins), dtype=np.float32)
    expected = warp_rt.closest_hit(accel, origins[::2], directions[::2], ends[::2])
    rows = [wp.array(array, dtype=wp.vec3, device="cpu")[::2] for array in (origins, directions)]
    hits = warp_rt.closest_hit(accel, *rows, wp.array(ends, dtype=float, device="cpu")[::2])
    np.testing.assert_array_equal(hits.triangle.numpy(), expected.triangle)
    np.testing.assert_array_equal(hits.t.numpy(), expected.t)
    with pytest.raises(OptionError, match="out: a contiguous array expected"):
        warp_rt.any_hit(accel, *rows, out=wp.empty(len(origins), dtype=wp.bool, device="cpu")[::2])
