# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Tiles, threads, and stopping."""

import threading
import time

import numpy as np
import pytest

from warp_rt.errors import LimitError
from warp_rt.launch import CUDA_BAND_PIXELS, Deadline, bands_of, run_tiles, tiles_of


@pytest.mark.parametrize(("width", "height", "side"), [(1, 1, 32), (100, 37, 32), (64, 64, 64), (5, 300, 7)])
def test_tiles_cover_every_pixel_once(width: int, height: int, side: int) -> None:
    covered = np.zeros((height, width), int)
    for x, y, w, h in tiles_of(width, height, side):
        covered[y : y + h, x : x + w] += 1
    assert (covered == 1).all()


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1920, 1080), (70000, 2)])
def test_bands_cover_every_pixel_once_and_are_small(width: int, height: int) -> None:
    covered = np.zeros((height, width), np.int8)
    for x, y, w, h in bands_of(width, height):
        covered[y : y + h, x : x + w] += 1
        assert w * h <= CUDA_BAND_PIXELS
    assert (covered == 1).all()


def test_every_sample_of_a_tile_is_taken_in_order_by_one_worker() -> None:
    seen: dict[tuple, list[tuple[int, int]]] = {}
    lock = threading.Lock()

    def launch(worker: int, tile: tuple, sample: int) -> None:
        with lock:
            seen.setdefault(tile, []).append((worker, sample))

    fractions: list[float] = []
    tiles = tiles_of(50, 50, 10)
    run_tiles(launch, tiles, 3, threads=4, deadline=Deadline(None), progress=fractions.append)
    assert set(seen) == set(tiles)
    for calls in seen.values():
        assert [sample for _, sample in calls] == [0, 1, 2]
        assert len({worker for worker, _ in calls}) == 1
    assert fractions[-1] == 1.0


def test_an_error_in_a_worker_stops_the_others_and_is_raised() -> None:
    calls: list[int] = []

    def launch(worker: int, tile: tuple, sample: int) -> None:
        calls.append(worker)
        if len(calls) == 5:
            raise KeyboardInterrupt
        time.sleep(0.01)

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run_tiles(launch, tiles_of(100, 100, 1), 1, threads=2, deadline=Deadline(None))
    assert time.monotonic() - start < 2  # the 10,000 tiles would take 50 s
    assert len(calls) < 100


def test_the_time_limit_ends_it() -> None:
    with pytest.raises(LimitError, match=r"time limit of 0\.1 s"):
        run_tiles(lambda *_: time.sleep(0.02), tiles_of(100, 100, 1), 1, threads=2, deadline=Deadline(0.1))
