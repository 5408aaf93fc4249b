# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The one place that launches pixel kernels: tiles over a thread pool on a CPU, bands of rows on CUDA."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait

import warp as wp

from warp_rt.errors import LimitError

Tile = tuple[int, int, int, int]
"""x, y, width, height [pixel], film coordinates."""

CUDA_BAND_PIXELS = 1 << 16
"""Pixels of one launch on CUDA: bounds both its run time and the scratch that its threads need."""

_POLL_SECONDS = 0.05  # how soon an interrupt or a time limit is noticed


def tiles_of(width: int, height: int, side: int) -> list[Tile]:
    """Return the tiles of a picture, row by row; those at the right and bottom edges are cut off."""
    return [
        (x, y, min(side, width - x), min(side, height - y))
        for y in range(0, height, side)
        for x in range(0, width, side)
    ]


def bands_of(width: int, height: int) -> list[Tile]:
    """Return bands of whole rows, or of parts of one where a row alone is too long."""
    rows = max(CUDA_BAND_PIXELS // width, 1)
    columns = min(width, CUDA_BAND_PIXELS)
    return [
        (x, y, min(columns, width - x), min(rows, height - y))
        for y in range(0, height, rows)
        for x in range(0, width, columns)
    ]


class Deadline:
    """A wall-clock limit."""

    def __init__(self, seconds: float | None) -> None:
        self._seconds = seconds
        self._start = time.monotonic()

    def check(self) -> None:
        """Raise LimitError once the time is over."""
        if self._seconds is not None and time.monotonic() - self._start > self._seconds:
            raise LimitError(f"time limit of {self._seconds:g} s reached while rendering")


def run_tiles(
    launch: Callable[[int, Tile, int], None],
    tiles: list[Tile],
    sample_count: int,
    *,
    threads: int,
    deadline: Deadline,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Call ``launch(worker, tile, sample)`` for every sample of every tile, on ``threads`` threads.

    All samples of a tile are taken by one worker, in order, so that sums do not depend on who does what. The caller's
    thread stays free to be interrupted: KeyboardInterrupt, and LimitError of the deadline, stop all workers after the
    launch that they are in.
    """
    total = len(tiles) * sample_count
    state = _Queue(iter(tiles), threads)

    def work(worker: int) -> None:
        for tile in state:
            for sample in range(sample_count):
                if state.is_stopped:
                    return
                launch(worker, tile, sample)
                state.done[worker] += 1

    with ThreadPoolExecutor(threads, thread_name_prefix="warp_rt") as pool:
        pending = {pool.submit(work, worker) for worker in range(threads)}
        try:
            while pending:
                finished, pending = wait(pending, timeout=_POLL_SECONDS, return_when=FIRST_COMPLETED)
                for future in finished:
                    future.result()
                if progress is not None:
                    progress(sum(state.done) / total)
                if pending:
                    deadline.check()
        except BaseException:
            state.is_stopped = True
            raise


class _Queue:
    """Tiles to hand out, and whether to stop."""

    def __init__(self, tiles: Iterator[Tile], threads: int) -> None:
        self._tiles = tiles
        self._lock = threading.Lock()
        self.is_stopped = False
        self.done = [0] * threads  # launches, each element written by one worker

    def __iter__(self) -> Iterator[Tile]:
        while not self.is_stopped:
            with self._lock:
                tile = next(self._tiles, None)
            if tile is None:
                return
            yield tile


def run_bands(
    launch: Callable[[int, Tile, int], None],
    bands: list[Tile],
    sample_count: int,
    *,
    device: str,
    deadline: Deadline,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Call ``launch(0, band, sample)`` for every sample of every band on a CUDA device, one at a time."""
    for done, (band, sample) in enumerate(((b, s) for b in bands for s in range(sample_count)), start=1):
        launch(0, band, sample)
        wp.synchronize_device(device)
        deadline.check()
        if progress is not None:
            progress(done / (len(bands) * sample_count))
