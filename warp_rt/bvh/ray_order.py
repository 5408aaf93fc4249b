# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""An order in which successive rays of a query start near each other, where they come in none."""

from __future__ import annotations

import math

import numpy as np
import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.device.jobs import Executor
from warp_rt.device.kernel_binaries import load_module
from warp_rt.device.workers import Workers
from warp_rt.kernels import ray_order
from warp_rt.kernels.constants import FLIGHT_FLOATS, GROUP, RAY_CODE_BITS, RAY_DIGITS

_OCTANTS = 8
_SAMPLED_GROUPS = 32
_WORTHWHILE = 16.0  # how much smaller sorting makes groups before it pays: 80 thousand rays at random
_MOST_PARTS = 16  # of the rays, each counted by one thread: what they count is added up by one
_AS_THEY_COME = np.empty(0, np.int32)


def sort_rays(accel: Accel, origins: np.ndarray, workers: Workers) -> np.ndarray:
    """Return the rays of a query in the order in which they are best taken; empty: as they come.

    Rays that go together are of one octant of directions, so that a group of them spans an eighth of the rays next to
    each other: with n rays all over a surface, sorted, a part of its extent that goes with the root of 8 GROUP / n.
    Where groups as they come span many times that, and the hierarchy lies beyond the caches, the rays are sorted along
    a space-filling curve.

    Args:
        accel: What they are traced in.
        origins: Of the rays, float32, shape [n, 3], C contiguous.
        workers: Who sorts them. Their number does not change the result.

    Returns:
        int32, shape [n] or [0].
    """
    is_big = accel.data.nodes.size + accel.data.leaves.size > FLIGHT_FLOATS
    box = _scattered_box(origins) if is_big else None
    if box is None:
        return _AS_THEY_COME
    load_module(ray_order, "cpu")
    low, side = box
    count, parts = len(origins), min(workers.count, _MOST_PARTS)
    executor = Executor("cpu", workers)
    codes, rays = executor.empty(count, wp.int32), executor.upload(np.arange(count, dtype=np.int32), wp.int32)
    executor.launch(ray_order.code_rays, count, [executor.upload(origins, wp.vec3), wp.vec3(low), 1.0 / side], [codes])
    bounds = executor.upload((count * np.arange(parts + 1) // parts).astype(np.int32), wp.int32)
    for shift in range(0, 3 * RAY_CODE_BITS, RAY_DIGITS.bit_length() - 1):
        counts = np.zeros((parts, RAY_DIGITS), np.int32)
        outputs = [executor.upload(counts, wp.int32)]
        executor.launch(ray_order.count_digits, parts, [codes, bounds, shift], outputs, weight=count)
        places = np.cumsum(counts.T, dtype=np.int32).reshape(-1, parts).T - counts
        inputs = [codes, rays, bounds, shift]
        codes, rays = executor.empty(count, wp.int32), executor.empty(count, wp.int32)
        outputs = [executor.upload(places, wp.int32), codes, rays]
        executor.launch(ray_order.place_rays, parts, inputs, outputs, weight=count)
    return rays.numpy()


def _scattered_box(origins: np.ndarray) -> tuple[np.ndarray, float] | None:
    """Return corner and side of a cube around most origins; None where sorting them would not pay.

    Judged by some runs of successive rays; runs in which a number is not finite do not count.
    """
    count = len(origins)
    if count < GROUP * _SAMPLED_GROUPS:
        return None
    first = np.linspace(0, count - GROUP, _SAMPLED_GROUPS).astype(np.int64)
    runs = origins[first[:, None] + np.arange(GROUP)]
    runs = runs[np.isfinite(runs).all(axis=(1, 2))]
    if not len(runs):
        return None
    low, high = runs.min(axis=(0, 1)).astype(np.float64), runs.max(axis=(0, 1)).astype(np.float64)
    spans = np.ptp(runs.astype(np.float64), axis=1).sum(axis=1)
    sorted_span = (high - low).sum() * math.sqrt(_OCTANTS * GROUP / count)
    side = float((high - low).max())
    is_worthwhile = side > 0 and np.median(spans) > _WORTHWHILE * sorted_span
    return (low, side) if is_worthwhile else None
