# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which of a prim's values the spheres or segments drawn of it take along their length."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from warp_rt.scene import Primvar


@dataclass(frozen=True, eq=False)
class Blend:
    """Coefficients along each shape, Bernstein's, as sums of a prim's values."""

    rows: np.ndarray
    """int64, shape [n, k], which values."""
    weights: np.ndarray | None = None
    """float64, shape [n, r, k], of each of them for the r = 1, 2 or 4 coefficients; None: the values themselves."""

    def along(self, values: np.ndarray) -> np.ndarray:
        """Return the coefficients of each shape: shape [n, r, c]."""
        own = values[self.rows]
        return own if self.weights is None else np.einsum("nij,njc->nic", self.weights, own.astype(np.float64))

    def primvar(self, values: np.ndarray, indices: np.ndarray | None) -> Primvar:
        """Return the primvar of values, shape [k, c]; ``indices`` say which of them each element takes."""
        if self.weights is None:
            return Primvar(values, (self.rows if indices is None else indices[self.rows]).astype(np.int32))
        blended = self.along(values if indices is None else values[indices]).astype(np.float32)
        own = np.arange(blended.shape[0] * blended.shape[1], dtype=np.int32)
        return Primvar(blended.reshape(-1, blended.shape[2]), own.reshape(blended.shape[:2]))

    def heaviest(self, end: int) -> np.ndarray:
        """Return which value weighs most in each shape's first (0) or last (-1) coefficient: int64, shape [n]."""
        if self.weights is None:
            return self.rows[:, end]
        column = self.weights[:, end].argmax(axis=1)
        return np.asarray(np.take_along_axis(self.rows, column[:, None], axis=1)[:, 0])

    def __getitem__(self, kept: np.ndarray) -> Blend:
        return Blend(self.rows[kept], None if self.weights is None else self.weights[kept])


@dataclass(frozen=True, eq=False)
class ShapeLayout:
    """How the elements of points or curves are numbered, and which of them each shape takes along its length.

    What ``warp_rt.usd.primvars`` asks of ``Elements``.
    """

    counts: Mapping[str, int]
    """Number of elements by interpolation."""
    controls: Blend
    """Control points from the prim's points; of Hermite curves, from its points and then its tangents."""
    vertex: Blend
    varying: Blend
    curve: np.ndarray
    """int64, shape [n], curve of each shape."""

    def element_counts(self, interpolation: str) -> tuple[int, ...]:
        """Return the numbers of elements that fit an interpolation; none if there is no such interpolation."""
        return (self.counts[interpolation],) if interpolation in self.counts else ()

    def primvar(self, values: np.ndarray, indices: np.ndarray | None, interpolation: str) -> Primvar:
        """Return values, shape [k, c], along each shape; ``indices`` say which of them each element takes."""
        rows = np.arange(len(values)) if indices is None else indices
        if interpolation == "constant":
            return Primvar(values[rows[:1]], None)
        if interpolation == "uniform":
            owner = self.curve if len(rows) > 1 else np.zeros_like(self.curve)  # points have one for all of them
            return Primvar(values, rows[owner][:, None].astype(np.int32))
        return (self.vertex if interpolation == "vertex" else self.varying).primvar(values, indices)

    def point_of_varying(self, count: int) -> np.ndarray:
        """Return the prim's point that each of ``count`` varying values stands next to: int64, shape [count]."""
        points = np.zeros(count, np.int64)
        for end in (0, -1):
            points[self.varying.rows[:, end]] = self.vertex.heaviest(end)
        return points

    def curve_of_point(self, count: int) -> np.ndarray:
        """Return the curve of each of the prim's ``count`` points: int64, shape [count]; 0 where it is not drawn."""
        curves = np.zeros(count, np.int64)
        curves[self.vertex.rows] = self.curve[:, None]
        return curves

    def __getitem__(self, kept: np.ndarray) -> ShapeLayout:
        return ShapeLayout(self.counts, self.controls[kept], self.vertex[kept], self.varying[kept], self.curve[kept])


def ragged(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the owner of each element, and its place among that owner's: int64, shape [sum(counts)] each."""
    ends = np.cumsum(counts)
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(ends - counts, counts)


def starts(counts: np.ndarray) -> np.ndarray:
    """Return where the elements of each owner begin: int64, shape [n]."""
    return np.cumsum(counts) - counts


def lay_out_points(count: int) -> ShapeLayout:
    """Return the layout of so many points, each a shape of its own."""
    own = Blend(np.arange(count)[:, None])
    counts = {"constant": 1, "uniform": 1, "varying": count, "vertex": count, "faceVarying": count}
    return ShapeLayout(counts, own, own, own, np.arange(count))


def lay_out_polylines(lengths: np.ndarray, point_count: int) -> ShapeLayout:
    """Return the layout of curves that are straight from point to point.

    Args:
        lengths: Points of each curve, int64, shape [curves].
        point_count: Of the prim, those of no curve counted.
    """
    curve, along = ragged(np.maximum(lengths - 1, 0))
    rows = (starts(lengths)[curve] + along)[:, None] + np.arange(2)
    own = Blend(rows)
    return ShapeLayout(curve_counts(len(lengths), int(lengths.sum()), point_count), own, own, own, curve)


def curve_counts(curve_count: int, varying_count: int, point_count: int) -> dict[str, int]:
    """Return how many elements each interpolation asks for on curves."""
    return {
        "constant": 1,
        "uniform": curve_count,
        "varying": varying_count,
        "vertex": point_count,
        "faceVarying": varying_count,
    }
