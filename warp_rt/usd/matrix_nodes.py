# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's matrices: made of rows, transposed, inverted, and what vectors, as rows, are multiplied by.

Reference: MaterialX Specification 1.39, creatematrix, transpose, determinant, invertmatrix, transformmatrix.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from pxr import Usd, UsdShade

from warp_rt.report import Report
from warp_rt.usd.materialx_places import dot
from warp_rt.usd.shading_network import Node, find_source
from warp_rt.usd.signals import DoesNotFold, Signal, add, apply, apply_to_all, join, multiply

Rows = tuple[Signal, ...]
"""Of a matrix, each of as many components."""
Read = Callable[[UsdShade.Shader, str], Signal | None]
"""What an input of a node says that is no matrix."""

MATRIX_NODE = re.compile(r"ND_(transformmatrix_(?:vector2M3|vector3|vector3M4|vector4)|determinant_matrix(?:33|44))")
_CREATE = re.compile(r"ND_creatematrix_vector([34])_matrix(33|44)")
_OF_MATRICES = re.compile(r"ND_(transpose|invertmatrix|dot|constant)_matrix(33|44)")
_MAX_CHAIN = 64
_ZERO, _ONE = Signal.constant([0.0]), Signal.constant([1.0])


class MatrixNodes:
    """Computes with the matrices of shading networks.

    Args:
        read: Gives vectors and numbers.
        time: When matrices are read.
        report: Takes the diagnostics.
    """

    def __init__(self, read: Read, time: Usd.TimeCode, report: Report) -> None:
        self._read = read
        self._time = time
        self._report = report

    def compute(self, node: Node) -> Signal:
        """Return what a node gives whose identifier ``MATRIX_NODE`` matches.

        Raises:
            DoesNotFold: Its matrix is none that is known, or has no inverse.
        """
        name = node.id.removeprefix("ND_")
        if name.startswith("determinant"):
            return _determinant(self._matrix(node.shader, "in", int(name[-1]), 0))
        size = 4 if name.endswith(("M4", "vector4")) else 3
        count = int(name.partition("vector")[2][0])
        given = (self._read(node.shader, "in") or Signal.constant([0.0] * count)).resized(count)
        rows = self._matrix(node.shader, "mat", size, 0)
        vector = given if count == size else join([given, _ONE])
        total = Signal.constant([0.0] * size)
        for k, row in enumerate(rows):
            total = add(total, multiply(row, vector.pick([k])))
        return total.pick(range(count))

    def _matrix(self, shader: UsdShade.Shader, name: str, size: int, depth: int) -> Rows:
        """Return the matrix on an input; the identity where it says nothing."""
        port = shader.GetInput(name)
        source = find_source(port, self._report) if port else None
        if source is None:
            return _constant_rows(np.eye(size))
        if isinstance(source, Node):
            if depth > _MAX_CHAIN:
                raise DoesNotFold
            return self._of_node(source, size, depth)
        value = np.array(source.Get(self._time), float)
        if value.shape != (size, size) or not np.isfinite(value).all():
            raise DoesNotFold
        return _constant_rows(value)

    def _of_node(self, node: Node, size: int, depth: int) -> Rows:
        created, other = _CREATE.fullmatch(node.id), _OF_MATRICES.fullmatch(node.id)
        if created and int(created[2][0]) == size:
            return self._created(node.shader, int(created[1]), size)
        if other is None or int(other[2][0]) != size:
            raise DoesNotFold
        rows = self._matrix(node.shader, "value" if other[1] == "constant" else "in", size, depth + 1)
        if other[1] == "transpose":
            return _transposed(rows)
        return _inverse(rows) if other[1] == "invertmatrix" else rows

    def _created(self, shader: UsdShade.Shader, count: int, size: int) -> Rows:
        rows = []
        for k in range(size):
            default = np.eye(size)[k, :count]
            row = (self._read(shader, f"in{k + 1}") or Signal.constant(default.tolist())).resized(count)
            rows.append(row if count == size else join([row, _ONE if k == count else _ZERO]))
        return tuple(rows)


def _constant_rows(matrix: np.ndarray) -> Rows:
    return tuple(Signal.constant(row) for row in matrix.tolist())


def _constant(rows: Rows) -> np.ndarray | None:
    values = [row.value for row in rows]
    return np.array(values) if all(value is not None for value in values) else None


def _transposed(rows: Rows) -> Rows:
    return tuple(join([row.pick([k]) for row in rows]) for k in range(len(rows)))


def _cofactors(rows: Rows) -> Rows:
    """Return the cross products of a matrix's rows, which its inverse has as columns, times its determinant."""
    if len(rows) != 3:
        raise DoesNotFold
    return tuple(apply_to_all(np.cross, 3, rows[(k + 1) % 3], rows[(k + 2) % 3]) for k in range(3))


def _determinant(rows: Rows) -> Signal:
    constant = _constant(rows)
    if constant is not None:
        return Signal.constant([float(np.linalg.det(constant))])
    return dot(rows[0], _cofactors(rows)[0])


def _inverse(rows: Rows) -> Rows:
    constant = _constant(rows)
    if constant is not None:
        if np.linalg.det(constant) == 0.0:
            raise DoesNotFold
        return _constant_rows(np.linalg.inv(constant))
    share = apply(np.reciprocal, _determinant(rows))
    return _transposed(tuple(multiply(row, share) for row in _cofactors(rows)))
