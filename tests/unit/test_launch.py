# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Tiles, threads, and stopping."""

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from warp_rt import Renderer, RenderOptions
from warp_rt.device.launch import (
    CUDA_BAND_PIXELS,
    CUDA_SCRATCH_BYTES,
    Deadline,
    StopFlag,
    bands_of,
    run_tiles,
    tile_side,
    tiles_of,
)
from warp_rt.errors import LimitError
from warp_rt.kernels.ray_structs import RayTask
from warp_rt.options import MAX_DEPTH
from warp_rt.rendering.task_stack import task_bytes, task_capacity
from warp_rt.warp_setup import init_warp

from ..analytic.scenes import parallel, scene_of, square, whitted

init_warp()


@pytest.mark.parametrize(("width", "height", "side"), [(1, 1, 32), (100, 37, 32), (64, 64, 64), (5, 300, 7)])
def test_tiles_cover_every_pixel_once(width: int, height: int, side: int) -> None:
    covered = np.zeros((height, width), int)
    for x, y, w, h in tiles_of(width, height, side):
        covered[y : y + h, x : x + w] += 1
    assert (covered == 1).all()


@pytest.mark.parametrize("threads", [1, 2, 16, 128])
@pytest.mark.parametrize(("width", "height"), [(1, 1), (160, 90), (1024, 768), (8192, 8192), (70000, 2)])
def test_tiles_are_as_large_as_leaves_enough_for_all_threads(width: int, height: int, threads: int) -> None:
    side = tile_side(width, height, threads)
    assert side in (16, 32, 64)
    assert side == 16 or len(tiles_of(width, height, side)) >= 16 * threads
    assert side == 64 or len(tiles_of(width, height, 2 * side)) < 16 * threads


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1920, 1080), (70000, 2)])
@pytest.mark.parametrize("scratch", [1, 300_000, 50_000_000])
def test_bands_cover_every_pixel_once_and_are_small(width: int, height: int, scratch: int) -> None:
    covered = np.zeros((height, width), np.int8)
    for x, y, w, h in bands_of(width, height, scratch):
        covered[y : y + h, x : x + w] += 1
        assert w * h <= CUDA_BAND_PIXELS
        assert w * h * scratch <= CUDA_SCRATCH_BYTES
    assert (covered == 1).all()


def test_a_band_of_the_deepest_trees_has_room_for_its_tasks() -> None:
    """The memory that a renderer asks for on CUDA does not grow with depth without bound, and is that of a band."""
    for depth in (1, 7, 64, MAX_DEPTH):
        pixel = task_capacity(depth) * np.dtype(RayTask.numpy_dtype()).itemsize
        bands = bands_of(1920, 1080, task_bytes(depth))
        assert max(w * h for _, _, w, h in bands) * pixel <= CUDA_SCRATCH_BYTES


def run(launch: Callable, tiles: list, samples: int = 1, **more: Any) -> None:
    arguments = {"threads": 2, "make_scratch": object, "stop": StopFlag("cpu"), "deadline": Deadline(None)} | more
    run_tiles(launch, tiles, range(samples), **arguments)


def test_every_sample_of_a_tile_is_taken_in_order_by_one_worker() -> None:
    seen: dict[tuple, list[tuple[object, int]]] = {}
    lock = threading.Lock()

    def launch(scratch: object, tile: tuple, sample: int) -> None:
        with lock:
            seen.setdefault(tile, []).append((scratch, sample))

    fractions: list[float] = []
    tiles = tiles_of(50, 50, 10)
    run(launch, tiles, 3, threads=4, progress=fractions.append)
    assert set(seen) == set(tiles)
    for calls in seen.values():
        assert [sample for _, sample in calls] == [0, 1, 2]
        assert len({id(scratch) for scratch, _ in calls}) == 1
    assert fractions[-1] == 1.0


def test_an_error_in_a_worker_stops_the_others_and_is_raised() -> None:
    calls: list[tuple] = []

    def launch(scratch: object, tile: tuple, sample: int) -> None:
        calls.append(tile)
        if len(calls) == 5:
            raise KeyboardInterrupt
        time.sleep(0.01)

    with pytest.raises(KeyboardInterrupt):
        run(launch, tiles_of(100, 100, 1))
    assert len(calls) < 100  # of 10,000


def test_the_time_limit_ends_it_and_raises_the_flag() -> None:
    stop = StopFlag("cpu")
    with pytest.raises(LimitError, match=r"time limit of 0\.1 s"):
        run(lambda *_: time.sleep(0.02), tiles_of(100, 100, 1), deadline=Deadline(0.1), stop=stop)
    assert stop.array.numpy().tolist() == [1]


def test_a_tile_of_many_samples_is_left_between_two() -> None:
    calls: list[int] = []

    def launch(scratch: object, tile: tuple, sample: int) -> None:
        calls.append(sample)
        time.sleep(0.001)

    with pytest.raises(LimitError):
        run(launch, tiles_of(1, 1, 1), 1_000_000, deadline=Deadline(0.1))
    assert len(calls) < 5000


def test_a_tree_that_never_ends_is_left_within_the_pixel() -> None:
    """Eight panes that mirror half and pass half: each of 30 levels doubles the rays, for one pixel."""
    panes = [square(whitted(reflection=0.5, transmission=0.5), z=float(z)) for z in range(8)]
    camera = parallel((0.1, 0.2, 20.0))
    renderer = Renderer(scene_of(*panes), RenderOptions(width=1, height=1, depth=30, threshold=0, time_limit=0.3))
    with pytest.raises(LimitError):
        renderer.render(camera=camera)  # untold hours otherwise
