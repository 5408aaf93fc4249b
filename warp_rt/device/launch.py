# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The one place that launches pixel kernels: tiles over a thread pool on a CPU, bands of rows on CUDA."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any

import warp as wp

from warp_rt.device.workers import Workers
from warp_rt.errors import LimitError

Tile = tuple[int, int, int, int]
"""x, y, width, height [pixel], film coordinates."""

CUDA_BAND_PIXELS = 1 << 16
"""Pixels of one launch on CUDA at most: bounds its run time."""

CUDA_SCRATCH_BYTES = 1 << 30
"""Of the scratch memory of one launch on CUDA at most, however deep its ray trees are."""


_TILE_SIDES = (64, 32, 16)  # tiles of 32 pixels take 3 to 7 % longer than of 64, of 16 another 8, of 128 as long
_TILES_A_THREAD = 16  # or more, so that threads end together


def tile_side(width: int, height: int, threads: int) -> int:
    """Return the side of tiles [pixel]: the largest that leaves every thread enough of them, else the smallest.

    Args:
        width: Of the picture [pixel].
        height: Likewise.
        threads: That take tiles.
    """
    for side in _TILE_SIDES:
        if -(-width // side) * -(-height // side) >= _TILES_A_THREAD * threads:
            return side
    return _TILE_SIDES[-1]


def tiles_of(width: int, height: int, side: int) -> list[Tile]:
    """Return the tiles of a picture, row by row; those at the right and bottom edges are cut off."""
    return [
        (x, y, min(side, width - x), min(side, height - y))
        for y in range(0, height, side)
        for x in range(0, width, side)
    ]


def bands_of(width: int, height: int, scratch: int) -> list[Tile]:
    """Return bands of whole rows, or of parts of one where a row alone is too long.

    Args:
        width: Of the picture [pixel].
        height: Likewise.
        scratch: Memory that each pixel of a band needs [byte].
    """
    pixels = max(min(CUDA_BAND_PIXELS, CUDA_SCRATCH_BYTES // scratch), 1)
    rows = max(pixels // width, 1)
    columns = min(width, pixels)
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


class StopFlag:
    """A word of memory that ends ray trees at their next node: one pixel's tree can be larger than anybody waits."""

    def __init__(self, device: str) -> None:
        self.array = wp.zeros(1, dtype=int, device=device)
        self.is_set = False

    def set(self) -> None:
        """End the launches that run on the CPU; what they leave in the film is worth nothing."""
        self.is_set = True
        self.array.fill_(1)


def run_tiles(
    launch: Callable[[Any, Tile, int], None],
    tiles: list[Tile],
    samples: range,
    *,
    threads: int,
    make_scratch: Callable[[], Any],
    stop: StopFlag,
    deadline: Deadline,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Call ``launch(scratch, tile, sample)`` for every sample of every tile, on ``threads`` threads.

    All samples of a tile are taken by one worker, in order, so that sums do not depend on who does what. The caller's
    thread stays free to be interrupted: KeyboardInterrupt, and LimitError of the deadline, stop all workers.
    """
    total = len(tiles) * len(samples)
    done: deque[None] = deque()  # one element a launch: appending is atomic

    def work(tile: Tile, scratch: Any) -> None:
        for sample in samples:
            if stop.is_set:
                return
            launch(scratch, tile, sample)
            done.append(None)

    def watch() -> None:
        if progress is not None:
            progress(len(done) / total)
        if len(done) < total:
            deadline.check()

    Workers(threads).map(work, tiles, make_scratch, watch=watch, on_stop=stop.set)


def run_bands(
    launch: Callable[[Tile, int], None],
    bands: list[Tile],
    samples: range,
    *,
    device: str,
    deadline: Deadline,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Call ``launch(band, sample)`` for every sample of every band on a CUDA device, one at a time."""
    for done, (band, sample) in enumerate(((b, s) for b in bands for s in samples), start=1):
        launch(band, sample)
        wp.synchronize_device(device)
        deadline.check()
        if progress is not None:
            progress(done / (len(bands) * len(samples)))
