# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Launches of the queries that take rays in groups: recorded once, and kept with their scratch memory."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np
import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.bvh.ray_span import make_ray_span
from warp_rt.device.kernel_binaries import load_module
from warp_rt.kernels import query_group


def describe(array: Any, dimensions: int = 1) -> Any:
    """Return what a kernel is told of an array: a launch takes it as it is.

    It keeps nothing alive. To make it of NumPy's array takes a third of the time of a Warp array around the same
    memory, and none of what is asked of that one at each launch.

    Args:
        array: NumPy's, C contiguous, on the CPU; or Warp's.
        dimensions: Of the kernel's array. NumPy's may have one more, which makes vectors of it.
    """
    if isinstance(array, wp.array):
        return array.__ctype__()
    return _Descriptor(_address(array), 0, dimensions, array.shape, _strides(array))


def _strides(array: np.ndarray) -> tuple[int, ...]:
    """Return the strides, in bytes, of a C contiguous array's memory if it had more rows.

    NumPy lets the stride along an axis of one be anything, and calls the array contiguous; a later query puts an array
    of more rows in its place.
    """
    row = accumulate(reversed(array.shape[1:]), operator.mul, initial=array.itemsize)
    return tuple(row)[::-1]


def _address(array: np.ndarray) -> int:
    """Return where a NumPy array's memory begins, in a fifth of the time that its ``ctypes`` takes to."""
    return array.__array_interface__["data"][0]


def take_span_launches(accel: Accel) -> SpanLaunches:
    """Return launches that no other query uses.

    Those of an earlier query where there are any: to make them takes as long as thousands of rays. Ends of a deque are
    taken and put back by one step of the interpreter, so that queries of several threads need no lock.
    """
    try:
        return accel.idle_launches.pop()
    except IndexError:
        return SpanLaunches()


def keep_span_launches(accel: Accel, launches: SpanLaunches) -> None:
    """Leave the launches of a query that is done to later ones."""
    launches.forget_arrays()
    accel.idle_launches.append(launches)


class SpanLaunches:
    """Launches of the kernels of query_group.py by the workers of one query at a time."""

    def __init__(self) -> None:
        self._spans: list[Any] = []  # scratch memory, one a worker
        self._recorded: dict[wp.Kernel, tuple[list[Any], list[wp.Launch]]] = {}
        self._arrays: Sequence[np.ndarray] = ()

    def prepare(self, accel: Accel, kernel: wp.Kernel, arrays: Sequence[np.ndarray], workers: int) -> None:
        """Make the next launches of a kernel use some arrays.

        The launches of all workers share what they are told of these: a new query changes only where they lie and how
        long they are. To record a launch anew takes 50 microseconds.

        Args:
            accel: What rays are traced in, the same each time.
            kernel: One of query_group.py.
            arrays: All that it takes but the hierarchy and the scratch memory, contiguous; alive until
                ``forget_arrays``, for launches do not keep them so.
            workers: How many will launch it.
        """
        self._arrays = arrays
        if kernel not in self._recorded:
            load_module(query_group, "cpu")
            self._recorded[kernel] = [describe(array) for array in arrays], []
        descriptors, launches = self._recorded[kernel]
        for descriptor, array in zip(descriptors, arrays, strict=True):
            descriptor.data = _address(array)
            descriptor.shape[0] = len(array)
        for worker in range(len(launches), workers):
            if worker == len(self._spans):
                self._spans.append(make_ray_span(accel, worker))
            inputs = [accel.table, self._spans[worker], *descriptors]
            launches.append(wp.launch(kernel, dim=1, inputs=inputs, device="cpu", record_cmd=True))

    def launch(self, kernel: wp.Kernel, worker: int) -> None:
        """Take some spans of the query's rays through the hierarchy, as one of its workers."""
        self._recorded[kernel][1][worker].launch()

    def forget_arrays(self) -> None:
        """Let go of what the query read and wrote."""
        self._arrays = ()


_Descriptor = type(wp.array(dtype=float).__ctype__())
