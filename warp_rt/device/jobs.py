# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Kernel launches cut into jobs for CPU threads, and the memory that they work on."""

from __future__ import annotations

import contextlib
import math
import mmap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.workers import Workers

_CHUNK = 4096  # items that one thread of a kernel takes care of where it does several
_GPU_CHUNK = 32  # the same on a GPU, which wants tens of thousands of threads
_LEAST_JOB = 1 << 10  # weight of a job below which threads do not pay
_MOST_JOB = 1 << 18  # and above which an interrupt would not be heard soon: some 10 ms
_SMALL = 4096  # elements of an array that Warp's allocator makes sooner than NumPy's
_ALIGNMENT = 64  # bytes: a cache line


@dataclass(frozen=True)
class Chunks:
    """Runs of items that lie tree by tree, each as long as what one thread takes care of; Warp arrays on a device."""

    per_tree: np.ndarray
    """int32, shape [tree_count], chunks of each tree."""
    counts: np.ndarray
    """int32, shape [n], items of each chunk."""
    first: wp.array
    """int32, shape [n], first item."""
    count: wp.array
    """int32, shape [n]."""
    tree: wp.array
    """int32, shape [n]."""


@cache
def numpy_type(dtype: Any) -> np.dtype:
    """Return the NumPy type of a Warp type, a scalar, vector or struct; kept, for making a struct's takes 40 us."""
    if wp.types.type_is_vector(dtype):
        return np.dtype((wp.dtype_to_numpy(dtype._wp_scalar_type_), dtype._shape_))
    return np.dtype(dtype.numpy_dtype() if hasattr(dtype, "numpy_dtype") else wp.dtype_to_numpy(dtype))


def host_array(shape: int | tuple[int, ...], dtype: Any) -> np.ndarray:
    """Return new memory that begins at a cache line, vectors as further axes; its content is undefined."""
    shape, dtype = shape if isinstance(shape, tuple) else (shape,), np.dtype(dtype)
    size = math.prod(shape) * dtype.itemsize
    memory = np.empty(size + _ALIGNMENT, np.uint8)
    start = -memory.ctypes.data % _ALIGNMENT
    return memory[start : start + size].view(dtype.base).reshape(*shape, *dtype.shape)


def sparse_array(shape: tuple[int, ...], dtype: Any) -> np.ndarray:
    """Return new memory, zeros, of which only the pages that are written take room: NumPy asks for huge ones."""
    size = math.prod(shape) * np.dtype(dtype).itemsize
    memory = mmap.mmap(-1, max(size, 1))
    if hasattr(mmap, "MADV_NOHUGEPAGE"):
        with contextlib.suppress(OSError):  # a kernel without huge pages does not know it
            memory.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(memory, np.uint8, size).view(dtype).reshape(shape)


def as_warp(array: np.ndarray, dtype: Any) -> wp.array:
    """Return a Warp array on the CPU over a NumPy array's own memory: shape [n], vectors as further axes."""
    return wp.array(array, dtype=dtype, device="cpu", copy=False)


class Executor:
    """Launches data-parallel kernels on the device that a hierarchy is built on; on the CPU by several threads."""

    def __init__(self, device: str, workers: Workers) -> None:
        """Args: device: ``cpu`` or ``cuda:N``. workers: Threads of the CPU; a GPU's work is started by the caller's."""
        self.device = device
        self.workers = workers

    def launch(
        self, kernel: wp.Kernel, count: int, inputs: Sequence[Any], outputs: Sequence[Any] = (), *, weight: int = 1
    ) -> None:
        """Launch ``count`` threads of a kernel, none of which reads what another one writes.

        Args:
            kernel: Its argument after ``inputs`` is the number of the first thread.
            count: Threads.
            inputs: Arguments before that number.
            outputs: Arguments after it.
            weight: How much a thread does, beside one that does next to nothing.
        """
        if self.device == "cpu":
            jobs = _job_count(count * weight, self.workers.count)
            bounds = count * np.arange(jobs + 1) // jobs
            _launch_spans(self.workers, kernel, bounds[:-1], bounds[1:], inputs, outputs)
        elif count:
            wp.launch(kernel, count, inputs=[*inputs, 0], outputs=list(outputs), device=self.device)

    def launch_uneven(
        self, kernel: wp.Kernel, weights: np.ndarray, inputs: Sequence[Any], outputs: Sequence[Any]
    ) -> None:
        """Launch a thread of a kernel for each of ``weights``, shape [threads], what it does; else as ``launch``."""
        if self.device == "cpu":
            launch_jobs(self.workers, kernel, weights, inputs, outputs)
        else:
            self.launch(kernel, len(weights), inputs, outputs)

    def map(self, job: Callable[[Any], None], items: Iterable[Any]) -> None:
        """Call ``job(item)``, which launches something on the device, for each item; on the CPU in several threads."""
        workers = self.workers if self.device == "cpu" else Workers(1)
        workers.map(lambda item, _scratch: job(item), items)

    def upload(self, array: np.ndarray, dtype: Any) -> wp.array:
        """Return an array, shape [n], vectors as further axes, on the device; on the CPU one over the same memory."""
        array = np.ascontiguousarray(array)
        return as_warp(array, dtype) if self.device == "cpu" else wp.array(array, dtype=dtype, device=self.device)

    def empty(self, shape: int | tuple[int, ...], dtype: Any) -> wp.array:
        """Return a new array on the device; its content is undefined."""
        size = math.prod(shape) if isinstance(shape, tuple) else shape
        if self.device != "cpu" or size < _SMALL:
            return wp.empty(shape, dtype=dtype, device=self.device)
        # Warp's own memory comes in pages of 4 KB that fault one by one.
        return as_warp(host_array(shape, numpy_type(dtype)), dtype)

    def split(self, counts: np.ndarray) -> Chunks:
        """Return the chunks of trees that have ``counts`` items each, int32, shape [tree_count], none of them 0."""
        size = _CHUNK if self.device == "cpu" else _GPU_CHUNK
        per_tree = -(-counts // size)
        tree = np.repeat(np.arange(len(counts), dtype=np.int32), per_tree)
        place = (np.arange(len(tree)) - np.repeat(np.cumsum(per_tree) - per_tree, per_tree)) * size
        count = np.minimum(counts[tree] - place, size).astype(np.int32)
        first = ((np.cumsum(counts) - counts)[tree] + place).astype(np.int32)
        return Chunks(per_tree, count, *(self.upload(array, wp.int32) for array in (first, count, tree)))

    def adopt(self, array: wp.array) -> wp.array:
        """Return an array with the same content on this executor's device: itself if it is there already."""
        return array if str(array.device) == self.device else array.to(self.device)

    def concatenate(self, arrays: Sequence[wp.array]) -> wp.array:
        """Return arrays of one type behind each other; the array itself where there is only one with any element."""
        filled = [array for array in arrays if array.shape[0]] or list(arrays[:1])
        if len(filled) == 1:
            return filled[0]
        joined = self.empty(sum(array.shape[0] for array in filled), filled[0].dtype)
        offset = 0
        for array in filled:
            wp.copy(joined, array, dest_offset=offset)
            offset += array.shape[0]
        return joined

    def sum_up(self, counts: wp.array) -> tuple[wp.array, int]:
        """Return the running sums of counts, int32, shape [n], each with its own count, and the last of them.

        Waits for the device: the last sum is a size that the host has to know.
        """
        sums = self.empty(counts.shape[0], wp.int32)
        self.scan(counts, sums)
        return sums, int(sums[-1:].numpy()[0]) if self.device != "cpu" else int(sums.numpy()[-1])

    def scan(self, values: wp.array, sums_out: wp.array) -> None:
        """Write the running sums of integers, or of vectors of them by component, each with its own value."""
        with self._chosen():
            wp.utils.array_scan(values, sums_out)

    def sort_pairs(self, keys: wp.array, values: wp.array, count: int) -> None:
        """Sort ``count`` keys and their values, equal ones in their order; there is room for twice as many."""
        with self._chosen():
            wp.utils.radix_sort_pairs(keys, values, count)

    def total(self, values: wp.array) -> float:
        """Return the sum of float64 values."""
        with self._chosen():
            result: Any = wp.utils.array_sum(values)
        return float(result)

    def _chosen(self) -> contextlib.AbstractContextManager[Any]:
        """Return a context in which Warp's utilities, which go by the current GPU and stream, work on this one."""
        return contextlib.nullcontext() if self.device == "cpu" else wp.ScopedDevice(self.device)


def launch_jobs(
    workers: Workers, kernel: wp.Kernel, weights: np.ndarray, inputs: Sequence[Any], outputs: Sequence[Any]
) -> None:
    """Launch a kernel over ``len(weights)`` threads on the CPU, in jobs of about equal weight.

    The kernel's argument after ``inputs`` is the first thread of the job. Weights are whole numbers, shape [threads].
    """
    if not len(weights):
        return
    total = np.cumsum(weights)
    jobs = min(len(weights), _job_count(int(total[-1]), workers.count))
    ends = np.unique(np.searchsorted(total, total[-1] * np.arange(1, jobs + 1) / jobs) + 1).clip(max=len(weights))
    _launch_spans(workers, kernel, np.concatenate([[0], ends[:-1]]), ends, inputs, outputs)


def _job_count(weight: int, workers: int) -> int:
    """Return into how many jobs work of some weight is cut."""
    shares = min(8 * workers, weight // _LEAST_JOB) if workers > 1 else 1
    return max(shares, -(-weight // _MOST_JOB), 1)


def _launch_spans(
    workers: Workers,
    kernel: wp.Kernel,
    starts: np.ndarray,
    ends: np.ndarray,
    inputs: Sequence[Any],
    outputs: Sequence[Any],
) -> None:
    """Launch a kernel over spans of threads, a job each."""

    def run(job: tuple[int, int], _scratch: None) -> None:
        start, end = job
        wp.launch(kernel, dim=end - start, inputs=[*inputs, start], outputs=outputs, device="cpu")

    workers.map(run, [(int(s), int(e)) for s, e in zip(starts, ends, strict=True) if e > s])
