# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Refitted hierarchies: every invariant of built ones, and the same hits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import warp_rt
from warp_rt.bvh.accel import refit_accel
from warp_rt.errors import SceneError
from warp_rt.options import BUILDERS
from warp_rt.scene import Scene

from ..meshes import Shape, cube, octasphere, soup, torus
from .test_bvh import check, random_matrices, scene_of


def moved(shape: Shape, seed: int) -> Shape:
    """Return the same triangles, bent, and every point pushed about."""
    points, triangles = shape
    rng = np.random.default_rng(seed)
    bent = points + 0.5 * np.sin(3 * points[:, [1, 2, 0]]) + 0.02 * rng.normal(size=points.shape)
    return bent, triangles


def rays(scene: Scene, count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(count)
    low, high = scene.bounds()
    origins, targets = (rng.uniform(low, high, (count, 3)).astype(np.float32) for _ in range(2))
    return origins, targets - origins


def assert_same_hits(scene: Scene, one: warp_rt.Accel, other: warp_rt.Accel) -> None:
    origins, directions = rays(scene, 20_000)
    a, b = (warp_rt.closest_hit(accel, origins, directions) for accel in (one, other))
    np.testing.assert_array_equal(a.t, b.t)
    assert (a.instance >= 0).mean() > 0.05
    # Triangles that share an edge may tie.
    assert (a.triangle != b.triangle).mean() < 1e-3


@pytest.mark.parametrize("bvh", BUILDERS)
@pytest.mark.parametrize("shape", [cube(), octasphere(4), torus(), soup(3000, 1), soup(1, 2)])
def test_a_mesh_whose_points_moved(shape: Shape, bvh: str) -> None:
    before, after = Scene.from_arrays(*shape), Scene.from_arrays(*moved(shape, 3))
    accel = refit_accel(warp_rt.build_accel(before, bvh=bvh), after)
    check(accel)
    if len(shape[1]) > 1:
        assert_same_hits(after, accel, warp_rt.build_accel(after, bvh=bvh))


def test_instances_and_meshes_move() -> None:
    shapes = [octasphere(3), cube(), soup(200, 5), (np.zeros((0, 3)), np.zeros((0, 3), np.int32)), soup(3, 6)]
    matrices, others = random_matrices(60, 7), random_matrices(50, 8)
    rng = np.random.default_rng(9)
    before = scene_of(shapes, rng.integers(0, 5, len(matrices)).tolist(), matrices)
    after = scene_of([moved(s, i) for i, s in enumerate(shapes)], rng.integers(0, 5, len(others)).tolist(), others)
    accel = refit_accel(warp_rt.build_accel(before), after)
    check(accel)
    assert_same_hits(after, accel, warp_rt.build_accel(after))


def test_a_mesh_that_moved_far_away_keeps_its_digits() -> None:
    points, triangles = octasphere(3)
    before, after = Scene.from_arrays(points, triangles), Scene.from_arrays(points + 1e5, triangles)
    accel = refit_accel(warp_rt.build_accel(before), after)
    hits = warp_rt.closest_hit(accel, np.array([[1e5, 1e5, 1e5 + 3]]), np.array([[0, 0, -1.0]]))
    assert hits.t[0] == pytest.approx(2, abs=0.02)  # float32 points: 0.008 apart there


def test_the_cost_tells_what_moving_did() -> None:
    """The same points cost the same; triangles that changed places with others cost more."""
    points, triangles = octasphere(5)
    scene = Scene.from_arrays(points, triangles)
    accel = warp_rt.build_accel(scene)
    same = refit_accel(accel, scene).statistics
    assert same.sah_cost == pytest.approx(accel.statistics.sah_cost, rel=1e-4)
    torn = refit_accel(accel, Scene.from_arrays(np.random.default_rng(0).permutation(points), triangles)).statistics
    assert torn.built_cost == accel.statistics.sah_cost
    assert torn.sah_cost > 10 * torn.built_cost


def test_thread_count_does_not_change_it() -> None:
    shape = soup(30_000, 10, size=0.02)
    accel = warp_rt.build_accel(Scene.from_arrays(*shape))
    one, three = (refit_accel(accel, Scene.from_arrays(*moved(shape, 4)), threads=n).data for n in (1, 3))
    for name in ("nodes", "leaves", "instances"):
        assert getattr(one, name).numpy().tobytes() == getattr(three, name).numpy().tobytes()


def test_other_triangles_are_refused() -> None:
    points, triangles = octasphere(2)
    accel = warp_rt.build_accel(Scene.from_arrays(points, triangles))
    with pytest.raises(SceneError, match="same triangles"):
        refit_accel(accel, Scene.from_arrays(points, triangles[::-1]))


def test_nothing_can_become_something() -> None:
    shape = octasphere(2)
    scene = Scene.from_arrays(*shape)
    hidden = replace(scene, instances=scene_of([shape], [], np.zeros((0, 4, 4))).instances)
    check(refit_accel(warp_rt.build_accel(hidden), scene))
    assert refit_accel(warp_rt.build_accel(scene), hidden).statistics.leaves == 0


def test_a_renderer_takes_the_hierarchy_of_the_frame_before() -> None:
    """A frame whose points have moved a little is refitted, a torn one is built; the picture is that of either."""
    points, triangles = octasphere(5)
    options = warp_rt.RenderOptions(width=64, height=64, aovs=("color", "depth"))
    first = warp_rt.Renderer(Scene.from_arrays(points, triangles), options, device="cpu")
    torn = np.random.default_rng(0).permutation(points)
    for after, is_built in ((points * [1.1, 0.9, 1.0], False), (torn, True)):
        scene = Scene.from_arrays(after, triangles)
        renderer = warp_rt.Renderer(scene, options, device="cpu", previous=first)
        statistics = renderer.accel.statistics
        assert (statistics.sah_cost == statistics.built_cost) == is_built
        fresh = warp_rt.Renderer(scene, options, device="cpu").render()
        film = renderer.render()
        for name in ("color", "depth"):
            np.testing.assert_allclose(film.aovs[name], fresh.aovs[name], rtol=1e-5, atol=1e-5)
