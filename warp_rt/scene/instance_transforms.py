# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Transforms of instances that are made as they are asked for: the matrices of a million of them would take 128 MB."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

_BLOCK = 1 << 12  # matrices at a time: what is computed on the way stays in the cache


class LazyTransforms(NDArrayOperatorsMixin, ABC):
    """Stands for an array, float64, shape [n, 4, 4], that is computed where it is read; nothing can be written to it.

    ``transforms[rows]`` and ``transforms[rows, ...]`` compute no others: ``rows`` one row, a slice, several or a mask.
    Whatever else an array can do is done with the array of all.
    """

    dtype = np.dtype(np.float64)
    ndim = 3

    @abstractmethod
    def __len__(self) -> int: ...

    @property
    @abstractmethod
    def nbytes(self) -> int:
        """What they are made of takes in memory [byte]."""

    @abstractmethod
    def write(self, rows: np.ndarray, out: np.ndarray) -> None:
        """Compute some of them.

        Args:
            rows: int64, shape [m], none negative; a few thousand, so that all that is computed stays in the cache.
            out: Takes their matrices, float64, shape [m, 4, 4].
        """

    @property
    def shape(self) -> tuple[int, int, int]:
        """Of the array that they stand for."""
        return len(self), 4, 4

    @cached_property
    def are_finite(self) -> bool:
        """Whether all numbers are finite."""
        return all(bool(np.isfinite(self[start : start + _BLOCK]).all()) for start in range(0, len(self), _BLOCK))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or not hasattr(np.ndarray, name):
            raise AttributeError(f"{type(self).__name__} has no {name}")
        return getattr(self[:], name)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        arrays = (item[:] if isinstance(item, LazyTransforms) else item for item in inputs)
        return getattr(ufunc, method)(*arrays, **options)

    __hash__ = object.__hash__

    def __getitem__(self, key: Any) -> np.ndarray:
        rows, *rest = key if isinstance(key, tuple) else (key,)
        if rows is None or rows is Ellipsis or _is_mask_of_numbers(rows):
            return self[:][key]
        numbers = row_numbers(rows, len(self))
        found = np.empty((numbers.size, 4, 4))
        for start in range(0, len(found), _BLOCK):
            block = slice(start, start + _BLOCK)
            self.write(numbers.reshape(-1)[block], found[block])
        if numbers.ndim == 1 and not rest:
            return found
        # NumPy pairs arrays of rows with arrays among the rest.
        rows = slice(None) if isinstance(rows, slice) else np.arange(numbers.size).reshape(numbers.shape)
        return np.asarray(found[(rows, *rest)])

    def __iter__(self) -> Iterator[np.ndarray]:
        for start in range(0, len(self), _BLOCK):
            yield from self[start : start + _BLOCK]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        if copy is False:
            raise ValueError("transforms that are made as they are asked for are no array without a copy")
        return self[:].astype(dtype or np.float64, copy=False)


Transforms: TypeAlias = np.ndarray | LazyTransforms
"""float64, shape [n, 4, 4]."""


class ScatteredTransforms(LazyTransforms):
    """Scale first, then orientation, then position: how a UsdGeomPointInstancer places its instances.

    Quaternions are normalised, for half precision is a thousandth off unit length; one of no length turns nothing.

    Args:
        positions: Shape [n, 3], of any precision, as the others.
        orientations: Quaternions i, j, k, real; shape [n, 4]; None: nothing is turned.
        scales: Shape [n, 3]; None: everything has its own size.
    """

    def __init__(self, positions: np.ndarray, orientations: np.ndarray | None, scales: np.ndarray | None) -> None:
        self._positions = positions
        self._orientations = orientations
        self._scales = scales

    def __len__(self) -> int:
        return len(self._positions)

    @property
    def nbytes(self) -> int:
        return sum(part.nbytes for part in (self._positions, self._orientations, self._scales) if part is not None)

    def write(self, rows: np.ndarray, out: np.ndarray) -> None:
        out[:, 3] = 0, 0, 0, 1
        out[:, :3, 3] = self._positions[rows]
        scales = np.ones((3, 1)) if self._scales is None else np.ascontiguousarray(self._scales[rows].T, np.float64)
        if self._orientations is None:
            out[:, :3, :3] = np.eye(3) * scales.T[:, None]
            return
        for column, (scale, axis) in enumerate(zip(scales, _axes(self._orientations[rows]), strict=True)):
            for row, number in enumerate(axis):
                out[:, row, column] = number * scale

    def are_regular(self) -> np.ndarray:
        """Return which are finite and can be inverted: bool, shape [n]."""
        holds = np.isfinite(self._positions).all(axis=1)
        if self._orientations is not None:
            holds &= np.isfinite(self._orientations).all(axis=1)
        if self._scales is not None:
            holds &= (np.isfinite(self._scales) & (self._scales != 0)).all(axis=1)
        return holds


class ChosenTransforms(LazyTransforms):
    """Some of others.

    Args:
        transforms: The others.
        rows: Which of them, shape [n], none negative.
    """

    def __init__(self, transforms: LazyTransforms, rows: np.ndarray) -> None:
        self._transforms = transforms
        self._rows = rows.astype(np.int32)

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def nbytes(self) -> int:
        return self._transforms.nbytes + self._rows.nbytes

    def write(self, rows: np.ndarray, out: np.ndarray) -> None:
        self._transforms.write(self._rows[rows], out)


class NestedTransforms(LazyTransforms):
    """The products of each of some outer transforms with each of some inner ones.

    Args:
        outer: n of them.
        inner: k of them; row i k + j is outer i after inner j.
    """

    def __init__(self, outer: Transforms, inner: Transforms) -> None:
        self._outer = outer
        self._inner = inner

    def __len__(self) -> int:
        return len(self._outer) * len(self._inner)

    @property
    def nbytes(self) -> int:
        return self._outer.nbytes + self._inner.nbytes

    def write(self, rows: np.ndarray, out: np.ndarray) -> None:
        outer, inner = np.divmod(rows, len(self._inner))
        if len(self._inner) == 1:  # one product of tall matrices is many times as fast
            np.matmul(self._outer[outer].reshape(-1, 4), self._inner[0], out=out.reshape(-1, 4))
        elif len(self._outer) == 1:
            columns = self._inner[inner].swapaxes(1, 2).reshape(-1, 4) @ self._outer[0].T
            out[:] = columns.reshape(-1, 4, 4).swapaxes(1, 2)
        else:
            np.matmul(self._outer[outer], self._inner[inner], out=out)


class JoinedTransforms(LazyTransforms):
    """Transforms one after the other.

    Args:
        parts: The transforms.
    """

    def __init__(self, parts: Sequence[Transforms]) -> None:
        self._parts = [part for part in parts if len(part)]
        self._ends = np.cumsum([len(part) for part in self._parts], dtype=np.int64)

    def __len__(self) -> int:
        return int(self._ends[-1]) if self._parts else 0

    @property
    def nbytes(self) -> int:
        return sum(part.nbytes for part in self._parts)

    def write(self, rows: np.ndarray, out: np.ndarray) -> None:
        holders = np.searchsorted(self._ends, rows, "right")
        for holder in np.unique(holders):
            own = np.flatnonzero(holders == holder)
            part = self._parts[holder]
            out[own] = part[rows[own] - (self._ends[holder] - len(part))]


def row_numbers(rows: Any, count: int) -> np.ndarray:
    """Return which of ``count`` rows an index of one row, a slice, rows or a mask means: int64, shape [n], from 0 on.

    Raises:
        IndexError: One is not there.
    """
    if isinstance(rows, slice):
        return np.arange(*rows.indices(count))
    numbers = np.asarray(rows)
    if numbers.dtype == bool:
        if numbers.shape != (count,):
            raise IndexError(f"a mask of shape {list(numbers.shape)} for {count} rows")
        numbers = np.flatnonzero(numbers)
    elif numbers.size and numbers.dtype.kind not in "iu":
        raise IndexError(f"rows are whole numbers, not {numbers.dtype}")
    elif numbers.size and not (-count <= numbers.min() and numbers.max() < count):
        raise IndexError(f"a row is outside the {count} that there are")
    return np.where(numbers < 0, numbers + count, numbers).astype(np.int64, copy=False)


def _is_mask_of_numbers(rows: Any) -> bool:
    """Return whether an index is a mask of other shape than one truth value a row."""
    if isinstance(rows, slice | int | np.integer) and not isinstance(rows, bool):
        return False
    mask = np.asarray(rows)
    return mask.dtype == bool and mask.ndim != 1


def choose(transforms: Transforms, rows: np.ndarray) -> Transforms:
    """Return some transforms, which are not computed here if they have not been.

    Args:
        transforms: n of them.
        rows: Rows, or a mask of shape [n].
    """
    if isinstance(transforms, LazyTransforms):
        return ChosenTransforms(transforms, row_numbers(rows, len(transforms)))
    return transforms[rows]


def nest(outer: Transforms, inner: Transforms) -> Transforms:
    """Return the products of all n outer and all k inner transforms, shape [n k, 4, 4]; lazy if any of them is."""
    if len(inner) == 1 and np.array_equal(inner[0], np.eye(4)):
        return outer
    if len(outer) == 1 and np.array_equal(outer[0], np.eye(4)):
        return inner
    if isinstance(outer, LazyTransforms) or isinstance(inner, LazyTransforms):
        return NestedTransforms(outer, inner)
    return np.matmul(outer[:, None], inner[None]).reshape(-1, 4, 4)


def join(parts: Sequence[Transforms]) -> Transforms:
    """Return transforms one after the other; lazy if any of them is."""
    arrays = [part for part in parts if not isinstance(part, LazyTransforms)]
    return np.concatenate(arrays) if len(arrays) == len(parts) else JoinedTransforms(parts)


def _axes(quaternions: np.ndarray) -> tuple[tuple[np.ndarray, ...], ...]:
    """Return where rotations turn the axes: three components, shape [n], of each of three.

    Reference: Rodrigues' formula, R = 1 + 2 (w [v] + [v]^2) / |q|^2. What is not finite comes out so.

    Args:
        quaternions: i, j, k, real; shape [n, 4].
    """
    i, j, k, real = np.ascontiguousarray(quaternions.T, np.float64)
    squared = i * i + j * j + k * k + real * real
    factor = np.divide(2.0, squared, out=np.zeros_like(squared), where=squared != 0)
    with np.errstate(invalid="ignore"):
        fi, fj, fk = factor * i, factor * j, factor * k
        ii, jj, kk = fi * i, fj * j, fk * k
        ij, jk, ki = fi * j, fj * k, fk * i
        wi, wj, wk = fi * real, fj * real, fk * real
        return (
            (1 - (jj + kk), ij + wk, ki - wj),
            (ij - wk, 1 - (kk + ii), jk + wi),
            (ki + wj, jk - wi, 1 - (ii + jj)),
        )
