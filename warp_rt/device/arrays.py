# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Arrays on a device, made of what the host has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp


def array_of_one(struct: Any, dtype: Any, device: str) -> wp.array:
    """Return a struct as kernels take large ones: in an array, which no thread copies.

    The array keeps the struct, without which the arrays that it points to would be freed.
    """
    result: Any = wp.array([struct], dtype=dtype, device=device)
    result.kept = struct
    return result


def filled(shape: tuple[int, ...], value: float, dtype: Any, device: str) -> wp.array:
    """Return an array of int32, float32 or vectors of float32 that is one number all over.

    On a CPU its memory is NumPy's, which comes in huge pages, and zeros only where they are touched. Warp's own memory
    faults in pages of 4 KB, which takes four times as long.
    """
    if device != "cpu":
        return wp.full(shape, dtype(value), dtype=dtype, device=device)
    row = () if dtype in (wp.int32, wp.float32) else (wp.types.type_size(dtype),)
    scalar = np.int32 if dtype is wp.int32 else np.float32
    values = np.full((*shape, *row), value, scalar) if value else np.zeros((*shape, *row), scalar)
    return wp.array(values, dtype=dtype, ndim=len(shape), device=device, copy=False)


class Joined:
    """Arrays that will lie one after the other, as ``Packer.chunks`` lays them."""

    def __init__(self) -> None:
        self.parts: list[np.ndarray] = []
        self.count = 0
        """Rows of all of them."""

    def append(self, rows: np.ndarray) -> int:
        """Add an array, shape [rows, ...], and return the row where it begins."""
        self.parts.append(rows)
        self.count += len(rows)
        return self.count - len(rows)


class Packer:
    """Makes device arrays and keeps count of their bytes."""

    def __init__(self, device: str) -> None:
        self.device = device
        self.bytes = 0

    def array(self, values: np.ndarray, dtype: Any, ndim: int = 1) -> wp.array:
        """Return an array of some type.

        Args:
            values: Shape [..., components]: ``ndim`` axes, then those of the type.
            dtype: A number, vector, matrix or struct.
            ndim: Axes of the array.
        """
        values = np.ascontiguousarray(values)
        self.bytes += values.nbytes
        if values.size == 0:
            return wp.zeros(shape=values.shape[:ndim], dtype=dtype, device=self.device)
        return wp.array(values, dtype=dtype, ndim=ndim, device=self.device)

    def adopt(self, table: np.ndarray, struct: Any) -> wp.array:
        """Return records, shape [n], that nobody else holds as an array of structs: on a CPU, in their own memory."""
        if not len(table):
            return self.array(table, struct)
        self.bytes += table.nbytes
        return wp.array(table, dtype=struct, device=self.device, copy=False)

    def chunks(self, parts: Sequence[np.ndarray], dtype: Any, row: tuple[int, ...], scalar: type) -> wp.array:
        """Return arrays as one, whose rows are of the shape ``row``."""
        joined = np.concatenate(parts) if parts else np.zeros((0, *row), scalar)
        return self.array(np.ascontiguousarray(joined, scalar).reshape(-1, *row), dtype)

    def records(self, struct: Any, rows: Sequence[dict[str, Any]]) -> wp.array:
        """Return an array of structs from their fields."""
        table = np.zeros(len(rows), struct.numpy_dtype())
        for record, row in zip(table, rows, strict=True):
            for name, value in row.items():
                record[name] = value
        return self.array(table, struct)
