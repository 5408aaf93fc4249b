# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""An order in which successive rays of a query start near each other, where they come in none."""

from __future__ import annotations

import math
import time

import numpy as np
import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.bvh.span_launches import describe
from warp_rt.device.kernel_binaries import load_module
from warp_rt.kernels import ray_order
from warp_rt.kernels.constants import FLIGHT_FLOATS, GROUP, RAY_DIGITS

_OCTANTS = 8
_SAMPLED_GROUPS = 32
_WORTHWHILE = 16.0  # how much smaller sorting makes groups before it pays: 80 thousand rays at random
_PARTS = 2  # of the rays for each worker, so that all end a pass at about the same time
_MOST_PARTS = 16  # unless there are more rays: what is counted in all is added up by one
_PART = 1 << 20  # rays of a part at most: some 10 ms
_WAIT_SECONDS = 5e-5  # until one looks again whether a step can be done


class RayOrder:
    """The order in which the rays of a query are best taken.

    Rays that go together are of one octant of directions, so that a group of them spans an eighth of the rays next to
    each other: with n rays all over a surface, sorted, a part of its extent that goes with the root of 8 GROUP / n.
    Where groups as they come span many times that, and the hierarchy lies beyond the caches, the rays are sorted along
    a space-filling curve.
    """

    def __init__(self, accel: Accel, origins: np.ndarray, workers: int) -> None:
        """Find out whether rays are to be sorted.

        Args:
            accel: What they are traced in.
            origins: Of the rays, float32, shape [n, 3], C contiguous.
            workers: How many will sort. Their number does not change the result.
        """
        self.rays = np.empty(0, np.int32)
        """int32, shape [n] or [0]: in the new order, once ``sort`` has returned; empty: as they come."""
        is_big = accel.data.nodes.size + accel.data.leaves.size > FLIGHT_FLOATS
        box = _scattered_box(origins) if is_big else None
        if box is not None:
            self._prepare(origins, *box, workers)

    def _prepare(self, origins: np.ndarray, low: np.ndarray, side: float, workers: int) -> None:
        load_module(ray_order, "cpu")
        count = len(origins)
        parts = max(min(_PARTS * workers, _MOST_PARTS), -(-count // _PART))
        self.rays = np.empty(count, np.int32)
        self._steps = ray_order.SORT_PHASES * parts
        self._words = np.zeros(2 * ray_order.DONE_WORD, np.int32)
        bounds = (count * np.arange(parts + 1) // parts).astype(np.int32)
        counts = np.zeros((parts, RAY_DIGITS), np.int32)
        tables = counts, np.empty_like(counts), np.empty((2, count), np.uint64)
        self._arrays = origins, bounds, *tables  # a launch does not keep them alive
        inputs = [
            describe(origins),
            wp.vec3(low),
            1.0 / side,
            describe(bounds),
            describe(self._words),
            *(describe(table, 2) for table in tables),
            describe(self.rays),
        ]
        self._launch = wp.launch(ray_order.sort_together, dim=1, inputs=inputs, device="cpu", record_cmd=True)

    def sort(self) -> None:
        """Sort the rays, if they are to be, side by side with other threads that call this."""
        if not len(self.rays):
            return
        words = self._words
        while words[ray_order.DONE_WORD] < self._steps:
            done = words[ray_order.DONE_WORD]
            self._launch.launch()
            if words[ray_order.DONE_WORD] == done:  # others are at work, or would be if they had a core
                time.sleep(_WAIT_SECONDS)


def _scattered_box(origins: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return corner and side of a cube around most origins; None where sorting them would not pay.

    Judged by some runs of successive rays; runs in which a number is not finite do not count.
    """
    count = len(origins)
    if count < GROUP * _SAMPLED_GROUPS:
        return None
    first = np.arange(_SAMPLED_GROUPS) * (count - GROUP) // (_SAMPLED_GROUPS - 1)
    runs = origins[first[:, None] + np.arange(GROUP)]
    lows, highs = runs.min(axis=1).astype(np.float64), runs.max(axis=1).astype(np.float64)
    spans = (highs - lows).sum(axis=1)
    is_finite = np.isfinite(spans)
    if not is_finite.any():
        return None
    low, high = lows[is_finite].min(axis=0), highs[is_finite].max(axis=0)
    sorted_span = (high - low).sum() * math.sqrt(_OCTANTS * GROUP / count)
    side = float((high - low).max())
    is_worthwhile = side > 0 and np.median(spans[is_finite]) > _WORTHWHILE * sorted_span
    return (low, side) if is_worthwhile else None
