# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""USD's arrays as NumPy arrays of a known shape: a value of another type counts as absent, never as a crash.

They are copies. USD's own may lie in the file, mapped into memory: one of them would keep all of it there, and would
change, or be gone, with the file. Small ones may be joined first, and are copied then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from pxr import Usd, Vt

from warp_rt.report import Report

_FORMS = {
    Vt.IntArray: np.dtype(np.int32),
    Vt.FloatArray: np.dtype((np.float32, (1,))),
    Vt.Vec2fArray: np.dtype((np.float32, 2)),
    Vt.Vec3fArray: np.dtype((np.float32, 3)),
    Vt.Vec4fArray: np.dtype((np.float32, 4)),
}
_TESTED = 1 << 16  # numbers or rows at a time: what is computed on the way takes little memory


def concatenated(arrays: Sequence[Any]) -> np.ndarray:
    """Return arrays of one kind, USD's or NumPy's, at least one of them, one after the other: shape [n, ...].

    USD's arrays of one type are joined as memory: NumPy would take seven times as long to look at each.
    """
    kinds = set(map(type, arrays))
    if len(kinds) == 1 and (form := _FORMS.get(*kinds)) is not None:
        return np.frombuffer(bytearray().join(arrays), form)
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def joined_slices(arrays: Sequence[Any]) -> tuple[np.ndarray, list[slice]]:
    """Return arrays as ``concatenated`` does, and where each of them is."""
    ends = np.cumsum([0, *map(len, arrays)]).tolist()
    return concatenated(arrays), list(map(slice, ends[:-1], ends[1:]))


def with_infinities(joined: np.ndarray, slices: Sequence[slice]) -> list[int]:
    """Return which slices of rows, shape [n, c], hold a number that is not finite."""
    flat = joined.reshape(-1)
    starts = range(0, len(flat), _TESTED)
    failing = [start + np.flatnonzero(~np.isfinite(flat[start : start + _TESTED])) for start in starts]
    rows = np.concatenate([np.zeros(0, np.intp), *failing]) // joined.shape[1]
    if not len(rows):
        return []
    return np.unique(np.searchsorted([own.stop for own in slices], rows, "right")).tolist()


def float_rows(value: Any) -> np.ndarray | None:
    """Return numbers or vectors as rows: float32, shape [n, c], c = 1 to 4; None for anything else.

    Args:
        value: What ``Usd.Attribute.Get`` returned for an array of scalars or of vectors, of any precision.
    """
    array = _numbers(value)
    if array is None:
        return None
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != 2 or not 1 <= array.shape[1] <= 4:
        return None
    with np.errstate(over="ignore"):  # a double beyond float32 becomes infinite, which every caller looks for
        return np.array(array, np.float32, order="C")


def vector_rows(value: Any, width: int) -> np.ndarray | None:
    """Return vectors of ``width`` components: float32, shape [n, width]; None for anything else."""
    rows = float_rows(value)
    if rows is None or (len(rows) and rows.shape[1] != width):
        return None
    return rows.reshape(-1, width)


def short_rows(value: Any, width: int) -> np.ndarray | None:
    """Return vectors, shape [n, width], as ``vector_rows`` does; those in half precision stay as short as they are."""
    array = _numbers(value)
    if array is not None and array.dtype == np.float16 and array.shape[1:] == (width,):
        return np.array(array, order="C")
    return vector_rows(value, width)


def integers(value: Any) -> np.ndarray | None:
    """Return integers: int64, shape [n]; None for anything else."""
    array = _numbers(value)
    return array.astype(np.int64) if array is not None and array.ndim == 1 and array.dtype.kind in "iu" else None


def signed_integers(value: Any) -> np.ndarray | None:
    """Return integers as they are stored, else as int64: shape [n]; None: others."""
    array = _numbers(value)
    is_plain = array is not None and array.dtype == np.int32 and array.ndim == 1
    return np.array(array) if is_plain else integers(value)


def integer_rows(value: Any, width: int) -> np.ndarray | None:
    """Return vectors of ``width`` integers: int64, shape [n, width]; None for anything else."""
    array = _numbers(value)
    if array is None or array.dtype.kind not in "iu" or (array.size and array.shape[1:] != (width,)):
        return None
    return array.astype(np.int64).reshape(-1, width)


def doubles(value: Any) -> np.ndarray | None:
    """Return numbers: float64, shape [n]; None for anything else."""
    array = _numbers(value)
    return array.astype(np.float64) if array is not None and array.ndim == 1 else None


def point_weights(attribute: Usd.Attribute, count: int, time: Usd.TimeCode, code: str, report: Report) -> np.ndarray:
    """Return the weights of control points, float64, shape [count]; 1 where they are absent or, told, unusable.

    What lies further apart pulls a spline to single points within float64's rounding, and overflows its derivatives.
    """
    value = attribute.Get(time)
    weights = doubles(value)
    if weights is None and value is None:
        return np.ones(count)
    if weights is None or len(weights) != count or not ((weights >= 1e-12) & (weights <= 1e12)).all():
        message = f"pointWeights are not {count} numbers from 1e-12 to 1e12: 1 is taken"
        report.warn(code, attribute.GetPrim().GetPath(), message)
        return np.ones(count)
    return weights


def double_rows(value: Any, width: int) -> np.ndarray | None:
    """Return vectors of ``width`` components: float64, shape [n, width]; None for anything else."""
    array = _numbers(value)
    if array is None or (array.size and array.shape[1:] != (width,)):
        return None
    return array.astype(np.float64).reshape(-1, width)


def hold_throughout(arrays: Sequence[np.ndarray], test: Callable[[np.ndarray], np.ndarray]) -> list[bool]:
    """Return for each array whether a test holds for all of its rows; small ones are tested together.

    Args:
        arrays: Alike but for their length.
        test: Returns for each row of such an array whether it holds: bool, shape [n].
    """
    holds = [True] * len(arrays)
    small: list[int] = []
    count = 0
    for number, array in enumerate(arrays):
        if len(array) > _TESTED:
            starts = range(0, len(array), _TESTED)
            holds[number] = all(bool(test(array[start : start + _TESTED]).all()) for start in starts)
            continue
        if count + len(array) > _TESTED:
            _test_joined(arrays, small, test, holds)
            small, count = [], 0
        small.append(number)
        count += len(array)
    if small:
        _test_joined(arrays, small, test, holds)
    return holds


def _test_joined(
    arrays: Sequence[np.ndarray], chosen: Sequence[int], test: Callable[[np.ndarray], np.ndarray], holds: list[bool]
) -> None:
    found = [arrays[number] for number in chosen]
    failing = np.flatnonzero(~test(np.concatenate(found)))
    if len(failing):
        ends = np.cumsum([len(array) for array in found])
        for position in np.unique(np.searchsorted(ends, failing, "right")).tolist():
            holds[chosen[position]] = False


def _numbers(value: Any) -> np.ndarray | None:
    if value is None or isinstance(value, str):
        return None
    array = np.asarray(value)
    return array if array.dtype.kind in "fiu" and array.ndim else None
