# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ray queries on arrays: NumPy or Warp in, the same out, chunked over the CPU's threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.accel import Accel, make_stacks
from warp_rt.errors import OptionError
from warp_rt.kernels import constants, query, query_group
from warp_rt.options import check_threads
from warp_rt.ray_order import sort_rays
from warp_rt.ray_span import keep_ray_spans, take_ray_span
from warp_rt.warp_setup import load_module
from warp_rt.workers import Workers

_CPU_SPANS = 32  # spans of rays of one launch: a few milliseconds, so that Ctrl-C is heard
_MAX_RAYS = (1 << 31) - (1 << 23)  # their counter is an int32, and each worker moves it once beyond the end
_GPU_TILE = 1 << 18  # rays of one launch: each has a stack of its own


@dataclass(frozen=True, eq=False)
class Hits:
    """Closest hits, one row a ray: NumPy arrays, or Warp arrays where the rays were. P = (1-u-v) p0 + u p1 + v p2."""

    t: Any
    """float32, in units of the direction's length; inf where the ray hits nothing."""
    triangle: Any
    """int32, row of the mesh's triangles, or of its ``Shapes``; -1 where the ray hits nothing."""
    instance: Any
    """int32, row of the scene's instances; -1 where the ray hits nothing."""
    u: Any
    """float32, weight of the triangle's second vertex; of a shape, 0 at its first control point, 1 at its last."""
    v: Any
    """float32, weight of its third; of a frustum the part, 0 its side, 1 its first and 2 its last cap; else 0."""


_GROUP_KERNELS = {
    query.query_closest_hit: query_group.query_closest_hit_group,
    query.query_any_hit: query_group.query_any_hit_group,
}
_HIT_TYPES = {"t": wp.float32, "u": wp.float32, "v": wp.float32, "triangle": wp.int32, "instance": wp.int32}


def closest_hit(
    accel: Accel,
    origins: Any,
    directions: Any,
    t_max: Any = np.inf,
    *,
    threads: int | None = None,
    out: Hits | None = None,
) -> Hits:
    """Return the closest hit of each ray in [0, t_max).

    Args:
        accel: What to trace in.
        origins: World space, float32, shape [n, 3]; or a Warp array of vec3, shape [n], on the accel's device.
        directions: Like ``origins``; their lengths, from 1e-20 to 1e20, are the unit of t. A zero or non-finite one
            hits nothing.
        t_max: End of the rays: one number, or shape [n].
        threads: CPU threads; None: one a core.
        out: Arrays to write to, of the kind and device of ``origins``.

    Raises:
        OptionError: A shape, type or device does not fit.
    """
    if out is not None and not isinstance(out, Hits):
        raise OptionError(f"out: Hits expected, got {type(out).__name__}")
    rays = _Rays(accel, origins, directions, t_max)
    arrays = {name: rays.output(getattr(out, name, None), name, dtype) for name, dtype in _HIT_TYPES.items()}
    _launch(accel, query.query_closest_hit, rays, list(arrays.values()), threads)
    return Hits(**{name: rays.result(getattr(out, name, None), array) for name, array in arrays.items()})


def any_hit(
    accel: Accel,
    origins: Any,
    directions: Any,
    t_max: Any = np.inf,
    *,
    threads: int | None = None,
    out: Any = None,
) -> Any:
    """Return whether each ray hits anything in [0, t_max): bool, shape [n]. Arguments as for ``closest_hit``."""
    rays = _Rays(accel, origins, directions, t_max)
    blocked = rays.output(out, "out", wp.bool)
    _launch(accel, query.query_any_hit, rays, [blocked], threads)
    return rays.result(out, blocked)


def count_hits(
    accel: Accel,
    origins: Any,
    directions: Any,
    t_max: Any = np.inf,
    *,
    threads: int | None = None,
    out: Any = None,
) -> Any:
    """Return how many triangles each ray meets in [0, t_max): int32, shape [n]. Arguments as for ``closest_hit``.

    Out of a closed mesh this is odd, in front of it or behind it even: but a ray through an edge or a vertex meets all
    triangles that share it, and counts each of them.
    """
    rays = _Rays(accel, origins, directions, t_max)
    count = rays.output(out, "out", wp.int32)
    _launch(accel, query.query_count_hits, rays, [count], threads)
    return rays.result(out, count)


class _Rays:
    """Validated rays as Warp arrays on the accel's device, and the way back for results."""

    def __init__(self, accel: Accel, origins: Any, directions: Any, t_max: Any) -> None:
        self.device = accel.device
        self.is_warp = isinstance(origins, wp.array)
        if isinstance(directions, wp.array) != self.is_warp:
            raise OptionError("origins and directions: both NumPy or both Warp arrays expected")
        self.origins = self._vectors("origins", origins, accel.origin)
        self.directions = self._vectors("directions", directions, np.zeros(3))
        self.count = self.origins.shape[0]
        if self.directions.shape[0] != self.count:
            raise OptionError(f"origins and directions: {self.count} and {self.directions.shape[0]} rows")
        if self.count > _MAX_RAYS:
            raise OptionError(f"origins: {self.count} rays are more than {_MAX_RAYS}")
        self.t_max = self._ends(t_max)

    def output(self, array: Any, name: str, dtype: Any) -> wp.array:
        """Return the array on the device that a kernel writes: the caller's own wherever that is possible."""
        if array is None:
            return _empty(self.count, dtype, self.device)
        if self.is_warp:
            if not self._checked(name, array, dtype).is_contiguous:
                raise OptionError(f"{name}: a contiguous array expected")
            return array
        expected = wp.dtype_to_numpy(dtype)
        if not isinstance(array, np.ndarray) or array.dtype != expected or array.shape != (self.count,):
            raise OptionError(f"{name}: a NumPy array of {np.dtype(expected).name}, shape [{self.count}], expected")
        if not array.flags.c_contiguous or not array.flags.writeable:
            raise OptionError(f"{name}: a contiguous, writable array expected")
        if self.device == "cpu":
            return wp.array(array, dtype=dtype, device="cpu", copy=False)
        return wp.empty(self.count, dtype=dtype, device=self.device)

    def result(self, array: Any, written: wp.array) -> Any:
        """Return what the caller gets for an output."""
        if self.is_warp:
            return written
        if array is None:
            return written.numpy()
        if self.device != "cpu":
            array[...] = written.numpy()
        return array

    def _vectors(self, name: str, values: Any, shift: np.ndarray) -> wp.array:
        if self.is_warp:
            array = self._checked(name, values, wp.vec3).contiguous()
            if not shift.any():
                return array
            return wp.array(array.numpy().astype(np.float64) - shift, dtype=wp.vec3, device=self.device)
        values = np.asarray(values)
        if values.ndim != 2 or values.shape[1] != 3 or values.dtype.kind not in "fiu":
            raise OptionError(f"{name}: numbers of shape [n, 3] expected, got {values.dtype} {list(values.shape)}")
        if shift.any():
            values = values.astype(np.float64) - shift
        values = np.ascontiguousarray(values, np.float32)
        return wp.array(values, dtype=wp.vec3, device=self.device, copy=self.device != "cpu")

    def _ends(self, t_max: Any) -> wp.array:
        if isinstance(t_max, wp.array):
            return self._checked("t_max", t_max, wp.float32).contiguous()
        values = np.asarray(t_max)
        if values.dtype.kind not in "fiu":
            raise OptionError(f"t_max: one number or shape [{self.count}] expected, got {values.dtype}")
        values = values.astype(np.float32, copy=False)
        if values.ndim == 0:
            values = values.reshape(1)
        elif values.shape != (self.count,):
            raise OptionError(f"t_max: one number or shape [{self.count}] expected, got {list(values.shape)}")
        return wp.array(values, dtype=wp.float32, device=self.device)

    def _checked(self, name: str, array: Any, dtype: Any) -> wp.array:
        expected = self.count if hasattr(self, "count") else None
        if (
            not isinstance(array, wp.array)
            or array.dtype != dtype
            or array.ndim != 1
            or (expected is not None and array.shape[0] != expected)
            or str(array.device) != self.device
        ):
            size = "n" if expected is None else str(expected)
            raise OptionError(f"{name}: a Warp array of {dtype.__name__}, shape [{size}], on {self.device} expected")
        return array


def _empty(count: int, dtype: Any, device: str) -> wp.array:
    """Return an array of nothing yet; on the CPU, NumPy's memory.

    It comes in huge pages, and what the last call's results were freed of is used again. Warp's own comes in pages of
    4 KB that fault one by one: 6 ms for the hits of a million rays, a fifth of what it takes to find them.
    """
    if device != "cpu":
        return wp.empty(count, dtype=dtype, device=device)
    return wp.array(np.empty(count, wp.dtype_to_numpy(dtype)), dtype=dtype, device=device, copy=False)


def _launch(accel: Accel, kernel: wp.Kernel, rays: _Rays, outputs: list[wp.array], threads: int | None) -> None:
    """Launch a query kernel over all rays."""
    check_threads(threads)
    if rays.count == 0:
        return
    arrays = [accel.table, rays.origins, rays.directions, rays.t_max]
    is_cpu = accel.device == "cpu"
    workers = Workers(threads if is_cpu else 1)
    is_for_groups = is_cpu and accel.data.intersector == constants.WATERTIGHT
    if is_for_groups and kernel in _GROUP_KERNELS:
        _launch_groups(accel, _GROUP_KERNELS[kernel], arrays, rays.count, outputs, workers)
        return
    load_module(query, accel.device)
    tile = _cpu_tile(rays.count, workers.count) if is_cpu else _GPU_TILE
    starts = range(0, rays.count, tile)
    workers.count = min(workers.count, len(starts))

    # A recorded launch costs a sixth of a fresh one, time in which no other thread could submit its own.
    # It does not keep its arguments alive: the scratch memory goes with it.
    def record() -> tuple[wp.Launch, Any]:
        scratch = make_stacks(accel, 1 if is_cpu else min(tile, rays.count))
        inputs = [*arrays, scratch, 0]
        return wp.launch(kernel, dim=1, inputs=inputs, outputs=outputs, device=accel.device, record_cmd=True), scratch

    def run(start: int, recorded: tuple[wp.Launch, Any]) -> None:
        command, _ = recorded
        command.set_dim(min(tile, rays.count - start))
        command.set_param_at_index(5, start)
        command.launch()

    workers.map(run, starts, record)


def _launch_groups(
    accel: Accel, kernel: wp.Kernel, arrays: list[wp.array], count: int, outputs: list[wp.array], workers: Workers
) -> None:
    """Launch a query kernel that takes the rays in groups, once or more in each worker."""
    load_module(query_group, "cpu")
    workers.count = min(workers.count, -(-count // constants.GROUP_SPAN))
    order = sort_rays(accel, arrays[1], workers)
    following = wp.zeros(1, dtype=wp.int32, device="cpu")
    taken = following.numpy()
    spans: list[Any] = []

    def record() -> wp.Launch:
        spans.append(take_ray_span(accel))
        inputs = [*arrays, order, spans[-1], following]
        return wp.launch(kernel, dim=1, inputs=inputs, outputs=outputs, device="cpu", record_cmd=True)

    def run(worker: int, command: wp.Launch) -> list[int]:
        command.launch()
        return [worker] if taken[0] < count else []

    workers.map(run, range(workers.count), record)
    keep_ray_spans(accel, spans)  # not after an interrupt: a thread may still be at work


def _cpu_tile(count: int, workers: int) -> int:
    """Return the rays of one launch: enough of them for threads to finish together, a few milliseconds at most."""
    return min(max(count // (8 * workers) // constants.GROUP_SPAN, 1), _CPU_SPANS) * constants.GROUP_SPAN
