# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Kernel launches cut into jobs for CPU threads, and the memory that they work on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.workers import Workers

_CHUNK = 4096  # items that one job works on
_ALIGNMENT = 64  # bytes: a cache line


@dataclass(frozen=True)
class Chunks:
    """Runs of items of several trees, each no longer than a job should be."""

    tree: np.ndarray
    """int32, shape [n]."""
    first: np.ndarray
    """int32, shape [n], first item, counted within the tree."""
    count: np.ndarray
    """int32, shape [n]."""


def host_array(shape: int | tuple[int, ...], dtype: Any) -> np.ndarray:
    """Return new memory that begins at a cache line; its content is undefined."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    memory = np.empty(size + _ALIGNMENT, np.uint8)
    start = -memory.ctypes.data % _ALIGNMENT
    return memory[start : start + size].view(dtype).reshape(shape)


def as_warp(array: np.ndarray, dtype: Any) -> wp.array:
    """Return a Warp array on the CPU over a NumPy array's own memory."""
    return wp.array(array, dtype=dtype, device="cpu", copy=False)


def split_chunks(counts: np.ndarray) -> Chunks:
    """Return the chunks of trees that have ``counts`` items each."""
    pieces = -(-counts // _CHUNK)
    tree = np.repeat(np.arange(len(counts)), pieces)
    first = (np.arange(len(tree)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) * _CHUNK
    count = np.minimum(counts[tree] - first, _CHUNK)
    return Chunks(tree.astype(np.int32), first.astype(np.int32), count.astype(np.int32))


def launch_jobs(
    workers: Workers, kernel: wp.Kernel, weights: np.ndarray, inputs: Sequence[Any], outputs: Sequence[Any]
) -> None:
    """Launch a kernel over ``len(weights)`` threads on the CPU, in jobs of about equal weight.

    The kernel's argument after ``inputs`` is the first thread of the job.
    """
    if not len(weights):
        return
    total = np.cumsum(weights)
    jobs = int(min(len(weights), max(1, min(8 * workers.count, total[-1] // 1024)))) if workers.count > 1 else 1
    ends = np.unique(np.searchsorted(total, total[-1] * np.arange(1, jobs + 1) / jobs) + 1).clip(max=len(weights))
    starts = np.concatenate([[0], ends[:-1]])

    def run(job: tuple[int, int], _scratch: None) -> None:
        start, end = job
        wp.launch(kernel, dim=end - start, inputs=[*inputs, start], outputs=outputs, device="cpu")

    workers.map(run, [(int(s), int(e)) for s, e in zip(starts, ends, strict=True) if e > s])
