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
_PART = 1 << 20  # rays of a part, if there are that many: a launch of some 10 ms, for an interrupt to be heard
_DIGIT_BITS = RAY_DIGITS.bit_length() - 1
_LAST_SHIFT = 3 * RAY_CODE_BITS - _DIGIT_BITS
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
    count = len(origins)
    parts = max(min(workers.count, _MOST_PARTS), -(-count // _PART))
    executor = Executor("cpu", workers)
    keys, rays = executor.empty(count, wp.uint64), np.empty(count, np.int32)
    bounds = executor.upload((count * np.arange(parts + 1) // parts).astype(np.int32), wp.int32)
    counts = np.zeros((parts, RAY_DIGITS), np.int32)
    inputs = [executor.upload(origins, wp.vec3), wp.vec3(low), 1.0 / side, bounds]
    executor.launch(ray_order.code_rays, parts, inputs, [keys, executor.upload(counts, wp.int32)], weight=count)
    for shift in range(0, _LAST_SHIFT, _DIGIT_BITS):
        sorted_keys = executor.empty(count, wp.uint64)
        outputs = [executor.upload(_places(counts), wp.int32), sorted_keys]
        executor.launch(ray_order.place_keys, parts, [keys, bounds, shift], outputs, weight=count)
        keys, counts = sorted_keys, np.zeros_like(counts)
        outputs = [executor.upload(counts, wp.int32)]
        inputs = [keys, bounds, shift + _DIGIT_BITS]
        executor.launch(ray_order.count_digits, parts, inputs, outputs, weight=count)
    outputs = [executor.upload(_places(counts), wp.int32), executor.upload(rays, wp.int32)]
    executor.launch(ray_order.place_rays, parts, [keys, bounds, _LAST_SHIFT], outputs, weight=count)
    return rays


def _places(counts: np.ndarray) -> np.ndarray:
    """Return where the first ray of each part and digit comes, given how many there are: int32, shape [parts, n]."""
    return np.cumsum(counts.T, dtype=np.int32).reshape(-1, len(counts)).T - counts


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
