# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The launches that expose a film: its tiles on a CPU, its bands on CUDA, sample after sample."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.device.arrays import array_of_one
from warp_rt.device.launch import StopFlag, Tile, bands_of, run_bands, run_tiles, tile_side, tiles_of
from warp_rt.kernels.frame_structs import FilmData
from warp_rt.options import DEFAULT_DEPTH
from warp_rt.rendering.exposure import Exposure
from warp_rt.rendering.kernel_choice import grows_together
from warp_rt.rendering.task_stack import task_bytes
from warp_rt.rendering.worker_scratch import Scratch, together_scratch, walking_scratch


def expose_film(
    kernel: wp.Kernel,
    terms: list[wp.array],
    accel: Accel,
    film: Exposure,
    samples: range,
    *,
    threads: int,
    progress: Callable[[float], None] | None,
) -> np.ndarray:
    """Add samples of every pixel to a film, and return the rays counted: int64, shape [counters].

    Args:
        kernel: As ``choose_kernel`` returns it.
        terms: Its first arguments: scene, hierarchies and frame.
        accel: The hierarchies.
        film: Takes the samples.
        samples: Which.
        threads: Of a CPU.
        progress: Called now and then from this thread with the finished fraction, 0 to 1.

    Raises:
        LimitError: The time limit was reached.
    """
    depth = film.options.depth or DEFAULT_DEPTH
    launches = _Launches(kernel, [*terms, array_of_one(film.buffers.data, FilmData, accel.device)], accel, depth)
    size = film.buffers.area[2:]
    if accel.device == "cpu":
        tiles = tiles_of(*size, film.options.tile_size or tile_side(*size, threads))
        run_tiles(
            launches.launch,
            tiles,
            samples,
            threads=min(threads, len(tiles)),
            make_scratch=lambda: launches.record(rows=1),
            stop=launches.stop,
            deadline=film.deadline,
            progress=progress,
        )
    else:
        bands = bands_of(*size, task_bytes(depth))
        recorded = launches.record(rows=max(band[2] * band[3] for band in bands))
        run_bands(
            lambda band, sample: launches.launch(recorded, band, sample),
            bands,
            samples,
            device=accel.device,
            deadline=film.deadline,
            progress=progress,
        )
    return launches.counts


class _Launches:
    """Launches of one kernel, recorded once a worker.

    A recorded launch costs a sixth of a fresh one, time in which no other thread could submit its own. It does not keep
    its arguments alive: this object does.
    """

    def __init__(self, kernel: wp.Kernel, shared: list[wp.array], accel: Accel, depth: int) -> None:
        self.stop = StopFlag(accel.device)
        self._kernel = kernel
        self._shared = [*shared, self.stop.array]
        self._accel = accel
        self._depth = depth
        self._is_together = grows_together(kernel)
        self._scratches: list[Scratch] = []

    def record(self, rows: int) -> tuple[wp.Launch, int]:
        """Return a worker's launch, and where among its arguments tile and sample stand.

        Args:
            rows: Threads that run at once, for trees that are walked.
        """
        accel, depth = self._accel, self._depth
        scratch = together_scratch(accel, depth) if self._is_together else walking_scratch(accel, depth, rows)
        self._scratches.append(scratch)
        inputs = [*self._shared, *scratch.arguments]
        following = [wp.vec4i(), 0]
        command = wp.launch(
            self._kernel, dim=1, inputs=[*inputs, *following], device=self._accel.device, record_cmd=True
        )
        return command, len(inputs)

    def launch(self, recorded: tuple[wp.Launch, int], tile: Tile, sample: int) -> None:
        """Add a sample to every pixel of a tile."""
        command, first = recorded
        command.set_dim(1 if self._is_together else tile[2] * tile[3])
        command.set_param_at_index(first, wp.vec4i(*tile))
        command.set_param_at_index(first + 1, sample)
        command.launch()

    @property
    def counts(self) -> np.ndarray:
        """Rays that all workers counted: a row as ``RayCounts.from_row`` takes it."""
        return np.sum([scratch.counts for scratch in self._scratches], axis=0)
