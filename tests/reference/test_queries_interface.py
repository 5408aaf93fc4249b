# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How ray queries are called: arrays of both kinds, outputs, threads, and what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import warp as wp

import warp_rt
from warp_rt.bvh.accel import Accel
from warp_rt.bvh.queries import Hits
from warp_rt.errors import OptionError
from warp_rt.scene import Scene

from ..meshes import octasphere
from .test_queries import instanced_scene, rays_at

FIELDS = [field.name for field in dataclasses.fields(Hits)]


@pytest.fixture(scope="module")
def accel() -> Accel:
    return warp_rt.build_accel(Scene.from_arrays(*octasphere(4)))


@pytest.fixture(scope="module")
def rays() -> tuple[np.ndarray, np.ndarray]:
    return rays_at(octasphere(4), 40_000, seed=1)


def test_results_do_not_depend_on_threads(rays: tuple) -> None:
    for scene in (Scene.from_arrays(*octasphere(4)), instanced_scene(2)):
        accel = warp_rt.build_accel(scene)
        one, two = (warp_rt.closest_hit(accel, *rays, threads=n) for n in (1, 2))
        for name in FIELDS:
            assert getattr(one, name).tobytes() == getattr(two, name).tobytes()
        assert (warp_rt.any_hit(accel, *rays, threads=1) == warp_rt.any_hit(accel, *rays, threads=3)).all()


def test_warp_arrays_come_back_as_warp_arrays(accel: Accel, rays: tuple) -> None:
    expected = warp_rt.closest_hit(accel, *rays)
    arrays = [wp.array(r, dtype=wp.vec3, device="cpu") for r in rays]
    hits = warp_rt.closest_hit(accel, *arrays)
    for name in FIELDS:
        assert isinstance(getattr(hits, name), wp.array)
        np.testing.assert_array_equal(getattr(hits, name).numpy(), getattr(expected, name))
    blocked = warp_rt.any_hit(accel, *arrays, wp.full(len(rays[0]), 1e30, dtype=float, device="cpu"))
    np.testing.assert_array_equal(blocked.numpy(), expected.instance >= 0)


def test_devices_agree(device: str, rays: tuple) -> None:
    for scene in (Scene.from_arrays(*octasphere(4)), instanced_scene(3)):
        expected = warp_rt.closest_hit(warp_rt.build_accel(scene), *rays)
        hits = warp_rt.closest_hit(warp_rt.build_accel(scene, device=device), *rays)
        assert (hits.instance != expected.instance).mean() < 1e-4
        same = hits.instance == expected.instance
        np.testing.assert_allclose(hits.t[same], expected.t[same], rtol=1e-4)


def test_outputs_are_written_in_place(accel: Accel, rays: tuple) -> None:
    count = len(rays[0])
    out = Hits(
        t=np.empty(count, np.float32),
        triangle=np.empty(count, np.int32),
        instance=np.empty(count, np.int32),
        u=np.empty(count, np.float32),
        v=np.empty(count, np.float32),
    )
    hits = warp_rt.closest_hit(accel, *rays, out=out)
    assert hits is out
    expected = warp_rt.closest_hit(accel, *rays)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(out, name), getattr(expected, name))
    blocked = np.empty(count, bool)
    assert warp_rt.any_hit(accel, *rays, out=blocked) is blocked
    np.testing.assert_array_equal(blocked, expected.instance >= 0)


def test_float32_rays_are_not_copied(accel: Accel, rays: tuple) -> None:
    """Read-only or wider arrays work as well; they are converted."""
    frozen = [r.copy() for r in rays]
    for r in frozen:
        r.flags.writeable = False
    wide = [r.astype(np.float64) for r in rays]
    every_second = [np.repeat(r, 2, axis=0)[::2] for r in rays]
    expected = warp_rt.closest_hit(accel, *rays).t
    for variant in (frozen, wide, every_second, [r.tolist() for r in rays]):
        np.testing.assert_array_equal(warp_rt.closest_hit(accel, *variant).t, expected)


def test_no_rays(accel: Accel) -> None:
    none = np.zeros((0, 3), np.float32)
    assert warp_rt.closest_hit(accel, none, none).t.shape == (0,)
    assert warp_rt.any_hit(accel, none, none).shape == (0,)


def test_one_ray_among_many_ends(accel: Accel) -> None:
    origins, directions = np.zeros((3, 3)), np.tile([0.0, 0, 1], (3, 1))
    assert warp_rt.any_hit(accel, origins, directions, [0.5, 2.0, 0.5]).tolist() == [False, True, False]


@pytest.mark.parametrize(
    "change",
    [
        {"origins": np.zeros(3)},
        {"origins": np.zeros((4, 2))},
        {"origins": np.zeros((5, 3))},
        {"origins": np.array([["a", "b", "c"]] * 4)},
        {"directions": np.zeros((4, 3), complex)},
        {"t_max": np.ones(3)},
        {"t_max": np.ones((4, 1))},
        {"t_max": None},
        {"t_max": "far"},
        {"threads": 0},
        {"threads": 1.5},
        {"out": np.empty(4, np.float32)},
        {"out": np.empty(3, bool)},
        {"out": np.empty(8, bool)[::2]},
    ],
)
def test_what_does_not_fit_is_refused(accel: Accel, change: dict) -> None:
    arguments = {"origins": np.zeros((4, 3)), "directions": np.ones((4, 3))} | change
    with pytest.raises(OptionError) as error:
        warp_rt.any_hit(accel, **arguments)
    assert "\n" not in str(error.value)


def test_closest_hits_are_written_to_hits(accel: Accel) -> None:
    """An array, or a dictionary of them, would not be written to."""
    for out in (np.empty(4, np.float32), {"t": np.empty(4, np.float32)}):
        with pytest.raises(OptionError, match="out: Hits expected"):
            warp_rt.closest_hit(accel, np.zeros((4, 3)), np.ones((4, 3)), out=out)


def test_kinds_of_arrays_are_not_mixed(accel: Accel) -> None:
    array = wp.zeros(4, dtype=wp.vec3, device="cpu")
    with pytest.raises(OptionError, match="both"):
        warp_rt.any_hit(accel, array, np.ones((4, 3)))
    with pytest.raises(OptionError, match="vec3"):
        warp_rt.any_hit(accel, wp.zeros(4, dtype=float, device="cpu"), array)
    with pytest.raises(OptionError, match="out"):
        warp_rt.any_hit(accel, array, array, out=np.empty(4, bool))


def test_build_options_are_checked() -> None:
    scene = Scene.from_arrays(*octasphere(1))
    for change in ({"bvh": "octree"}, {"intersector": "guess"}, {"threads": 0}, {"threads": 1.5}):
        with pytest.raises(OptionError):
            warp_rt.build_accel(scene, **change)


def test_what_is_no_scene_or_no_hierarchy_is_refused() -> None:
    scene = Scene.from_arrays(*octasphere(1))
    for make in (warp_rt.build_accel, warp_rt.Renderer):
        with pytest.raises(OptionError, match=r"^scene: a Scene expected, got str; load_scene reads a file$"):
            make("ball.usda")
    rays = (np.zeros((1, 3)), np.ones((1, 3)))
    for query in (warp_rt.closest_hit, warp_rt.any_hit, warp_rt.count_hits):
        with pytest.raises(OptionError, match=r"^accel: an Accel expected, as build_accel returns, got Scene$"):
            query(scene, *rays)
