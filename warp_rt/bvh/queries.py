# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ray queries on arrays: NumPy or Warp in, the same out, chunked over the CPU's threads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.bvh.ray_order import RayOrder
from warp_rt.bvh.span_launches import describe, keep_span_launches, take_span_launches
from warp_rt.bvh.stacks import make_stacks
from warp_rt.device.kernel_binaries import load_module
from warp_rt.device.workers import Workers
from warp_rt.errors import OptionError
from warp_rt.kernels import constants, query, query_group
from warp_rt.options import check_threads

_CPU_SPANS = 32  # spans of rays of one launch: a few milliseconds, so that Ctrl-C is heard
_MAX_RAYS = (1 << 31) - (1 << 23)  # their counter is an int32, and each worker moves it once beyond the end
_MOVED = 1 << 12  # points moved at once: in cache, and with no array of float64 for all of them
_MOVED_TILE = 1 << 15  # points that one worker moves before it takes others
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
        out: Arrays to write to, of the kind and device of ``origins``; they are what is returned.

    Raises:
        OptionError: A shape, type or device does not fit.
    """
    if out is not None and not isinstance(out, Hits):
        raise OptionError(f"out: Hits expected, got {type(out).__name__}")
    rays = _Rays(accel, query.query_closest_hit, origins, directions, t_max, threads)
    arrays = {name: rays.output(getattr(out, name, None), name, dtype) for name, dtype in _HIT_TYPES.items()}
    _launch(accel, rays, list(arrays.values()))
    written = {name: rays.result(getattr(out, name, None), arrays[name], dtype) for name, dtype in _HIT_TYPES.items()}
    return Hits(**written) if out is None else out


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
    rays = _Rays(accel, query.query_any_hit, origins, directions, t_max, threads)
    return _one_number(accel, rays, out, wp.bool)


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
    rays = _Rays(accel, query.query_count_hits, origins, directions, t_max, threads)
    return _one_number(accel, rays, out, wp.int32)


class _Rays:
    """Validated rays in the memory of the accel's device, and the way back for results.

    That memory is a NumPy array on the CPU, whatever the caller's is, and a Warp array on a GPU.
    """

    def __init__(
        self, accel: Accel, kernel: wp.Kernel, origins: Any, directions: Any, t_max: Any, threads: int | None
    ) -> None:
        if not isinstance(accel, Accel):
            raise OptionError(f"accel: an Accel expected, as build_accel returns, got {type(accel).__name__}")
        check_threads(threads)
        self.workers = Workers(threads if accel.device == "cpu" else 1)
        self.device = accel.device
        self.is_cpu = accel.device == "cpu"
        self.is_grouped = self.is_cpu and accel.data.intersector == constants.WATERTIGHT and kernel in _GROUP_KERNELS
        self.kernel = _GROUP_KERNELS[kernel] if self.is_grouped else kernel
        self.is_warp = isinstance(origins, wp.array)
        if isinstance(directions, wp.array) != self.is_warp:
            raise OptionError("origins and directions: both NumPy or both Warp arrays expected")
        self.count: int | None = None
        # Kernels that take groups of rays subtract the point that the hierarchy's coordinates are relative to. Origins
        # of more digits than float32 has would have lost them by then: they are moved first, as for other kernels all.
        is_late = self.is_grouped and getattr(origins, "dtype", None) in (wp.vec3, np.float32)
        shift = None if is_late or not accel.origin.any() else accel.origin
        self.base = np.array([accel.origin if shift is None else np.zeros(3)], np.float64)
        self.origins = self._vectors("origins", origins, shift)
        self.count = len(self.origins)
        self.directions = self._vectors("directions", directions, None)
        if len(self.directions) != self.count:
            raise OptionError(f"origins and directions: {self.count} and {len(self.directions)} rows")
        if self.count > _MAX_RAYS:
            raise OptionError(f"origins: {self.count} rays are more than {_MAX_RAYS}")
        self.t_max = self._ends(t_max)

    def output(self, array: Any, name: str, dtype: Any) -> Any:
        """Return the memory that a kernel writes: the caller's own wherever that is possible."""
        expected = wp.dtype_to_numpy(dtype)
        if array is None:
            # NumPy's memory comes in huge pages, and what the last call's results were freed of is used again. Warp's
            # own comes in pages of 4 KB that fault one by one: 6 ms for the hits of a million rays, a fifth of what it
            # takes to find them.
            return np.empty(self.count, expected) if self.is_cpu else wp.empty(self.count, dtype, device=self.device)
        if self.is_warp:
            if not self._checked(name, array, dtype).is_contiguous:
                raise OptionError(f"{name}: a contiguous array expected")
            return array.numpy() if self.is_cpu else array
        if not isinstance(array, np.ndarray) or array.dtype != expected or array.shape != (self.count,):
            raise OptionError(f"{name}: a NumPy array of {np.dtype(expected).name}, shape [{self.count}], expected")
        if not array.flags.c_contiguous or not array.flags.writeable:
            raise OptionError(f"{name}: a contiguous, writable array expected")
        return array if self.is_cpu else wp.empty(self.count, dtype, device=self.device)

    def result(self, array: Any, written: Any, dtype: Any) -> Any:
        """Return what the caller gets for an output."""
        if self.is_cpu:
            if array is not None:
                return array
            return wp.array(written, dtype=dtype, device="cpu", copy=False) if self.is_warp else written
        if self.is_warp:
            return written
        if array is None:
            return written.numpy()
        array[...] = written.numpy()
        return array

    def _vectors(self, name: str, values: Any, shift: np.ndarray | None) -> Any:
        if self.is_warp:
            array = self._checked(name, values, wp.vec3).contiguous()
            if shift is None and not self.is_cpu:
                return array
            values = array.numpy()
        values = np.asarray(values)
        if values.ndim != 2 or values.shape[1] != 3 or values.dtype.kind not in "fiu":
            raise OptionError(f"{name}: numbers of shape [n, 3] expected, got {values.dtype} {list(values.shape)}")
        if shift is not None:
            values = self._moved(values, shift)
        values = _as_float32(values)
        return values if self.is_cpu else wp.array(values, dtype=wp.vec3, device=self.device)

    def _moved(self, points: np.ndarray, shift: np.ndarray) -> np.ndarray:
        """Return points minus ``shift``, computed in float64, rounded to float32."""
        moved = np.empty(points.shape, np.float32)
        shifts = np.tile(shift, min(_MOVED, len(points)))

        def move(first: int, _: None) -> None:
            with np.errstate(over="ignore"):  # of each thread its own
                for start in range(first, min(first + _MOVED_TILE, len(points)), _MOVED):
                    rows = points[start : start + _MOVED].reshape(-1)
                    out = moved[start : start + _MOVED].reshape(-1)
                    np.subtract(rows, shifts[: len(rows)], out=out, dtype=np.float64, casting="same_kind")

        tiles = range(0, len(points), _MOVED_TILE)
        Workers(min(self.workers.count, len(tiles))).map(move, tiles)
        return moved

    def _ends(self, t_max: Any) -> Any:
        if isinstance(t_max, wp.array):
            array = self._checked("t_max", t_max, wp.float32).contiguous()
            return array.numpy() if self.is_cpu else array
        values = np.asarray(t_max)
        if values.dtype.kind not in "fiu":
            raise OptionError(f"t_max: one number or shape [{self.count}] expected, got {values.dtype}")
        if values.ndim > 0 and values.shape != (self.count,):
            raise OptionError(f"t_max: one number or shape [{self.count}] expected, got {list(values.shape)}")
        values = _as_float32(values)  # of a number, an array of one
        return values if self.is_cpu else wp.array(values, dtype=wp.float32, device=self.device)

    def _checked(self, name: str, array: Any, dtype: Any) -> wp.array:
        if (
            not isinstance(array, wp.array)
            or array.dtype != dtype
            or array.ndim != 1
            or (self.count is not None and array.shape[0] != self.count)
            or str(array.device) != self.device
        ):
            size = "n" if self.count is None else str(self.count)
            raise OptionError(f"{name}: a Warp array of {dtype.__name__}, shape [{size}], on {self.device} expected")
        return array


def _as_float32(values: np.ndarray) -> np.ndarray:
    """Return numbers in contiguous memory; those beyond float32 are infinite, and such rays hit nothing."""
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(values, np.float32)


def _one_number(accel: Accel, rays: _Rays, out: Any, dtype: Any) -> Any:
    """Return what a query writes of each ray that is one number."""
    written = rays.output(out, "out", dtype)
    _launch(accel, rays, [written])
    return rays.result(out, written, dtype)


def _launch(accel: Accel, rays: _Rays, outputs: list[Any]) -> None:
    """Launch a query's kernel over all rays."""
    if not rays.count:
        return
    if rays.is_grouped:
        _launch_groups(accel, rays, outputs)
        return
    workers = rays.workers
    load_module(query, accel.device)
    count = rays.count
    tile = _cpu_tile(count, workers.count) if rays.is_cpu else _GPU_TILE
    starts = range(0, count, tile)
    workers.count = min(workers.count, len(starts))
    arrays = [accel.table, *(describe(array) for array in (rays.origins, rays.directions, rays.t_max))]
    described = [describe(array) for array in outputs]

    # A recorded launch costs a sixth of a fresh one, time in which no other thread could submit its own.
    # It does not keep its arguments alive: the scratch memory goes with it.
    def record() -> tuple[wp.Launch, Any]:
        scratch = make_stacks(accel, 1 if rays.is_cpu else min(tile, count))
        inputs = [*arrays, scratch, 0]
        return wp.launch(rays.kernel, 1, inputs, described, device=accel.device, record_cmd=True), scratch

    def run(start: int, recorded: tuple[wp.Launch, Any]) -> None:
        command, _ = recorded
        command.set_dim(min(tile, count - start))
        command.set_param_at_index(5, start)
        command.launch()

    workers.map(run, starts, record)


def _launch_groups(accel: Accel, rays: _Rays, outputs: list[Any]) -> None:
    """Launch a query's kernel that takes the rays in groups, once or more in each worker."""
    count, kernel = len(rays.origins), rays.kernel
    workers = rays.workers
    workers.count = min(workers.count, -(-count // constants.GROUP_SPAN))
    order = RayOrder(accel, rays.origins, workers.count)
    progress = _share_rays(count, workers.count)
    arrays = [rays.origins, rays.directions, rays.t_max, rays.base, order.rays, progress.reshape(-1), *outputs]
    launches = take_span_launches(accel)
    launches.prepare(accel, kernel, arrays, workers.count)
    busy, over = progress[:, constants.BUSY_WORD], progress[0, constants.OVER_WORD :]

    def run(worker: int) -> bool:
        # Marked before it looks whether rays are left: where none were and nobody was marked, nobody launches any more,
        # and the launches may be used by another query. Python's lock keeps the order of both; for builds of Python
        # without it there is no USD.
        busy[worker] = 1
        if over[0]:
            busy[worker] = 0
        else:
            order.sort()
            launches.launch(kernel, worker)
        return not over[0]

    workers.repeat(run, lambda: bool(over[0]) and not any(busy.tolist()))
    keep_span_launches(accel, launches)  # not after an interrupt: a thread may still be at work


def _share_rays(count: int, workers: int) -> np.ndarray:
    """Return the progress of workers that have not begun, each with its part of the rays.

    Returns:
        int32, shape [workers, PROGRESS_WORDS], as ``trace_spans`` has it.
    """
    spans = -(-count // constants.GROUP_SPAN)
    progress = np.zeros((workers, constants.PROGRESS_WORDS), np.int32)
    for worker in range(workers):
        progress[worker, 0] = spans * worker // workers * constants.GROUP_SPAN
        progress[worker - 1, constants.END_WORD] = progress[worker, 0]
    progress[-1, constants.END_WORD] = count
    return progress


def _cpu_tile(count: int, workers: int) -> int:
    """Return the rays of one launch: enough of them for threads to finish together, a few milliseconds at most."""
    return min(max(count // (8 * workers) // constants.GROUP_SPAN, 1), _CPU_SPANS) * constants.GROUP_SPAN
