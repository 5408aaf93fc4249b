# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The polynomial pieces of B-splines, each in Bezier form.

Reference: Ramshaw (1989), Blossoms are polar forms, Computer Aided Geometric Design 6(4): the Bezier points of a piece
are values of its blossom, and a blossom is de Boor's triangle with an argument of its own at each level.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

# Degree + 1. Weights of Bezier points take work and memory by its cube; modellers write 4, seldom more than 8.
MAX_ORDER = 32


@dataclass(frozen=True, eq=False)
class Pieces:
    """The pieces of B-splines of one degree, within their ranges, one after the other; none is of no length."""

    degree: int
    spline: np.ndarray
    """int64, shape [s], row of the spline that each is part of."""
    number: np.ndarray
    """int64, shape [s], place among the knot intervals of its spline's domain, those of no length counted."""
    first: np.ndarray
    """int64, shape [s], row of the first of the degree + 1 control points that shape it, counted in its spline."""
    knots: np.ndarray
    """float64, shape [s, 2 degree], the knots that shape it: as many before its start as after its end."""
    start: np.ndarray
    """float64, shape [s], parameter, greater than the knot where the range begins later."""
    end: np.ndarray
    """float64, shape [s]."""

    def __len__(self) -> int:
        return len(self.first)

    @cached_property
    def bezier_weights(self) -> np.ndarray:
        """float64, shape [s, degree + 1, degree + 1]: Bezier points from those control points; rows sum to 1."""
        return bezier_weights(self.knots, self.start, self.end)

    @property
    def interval(self) -> tuple[np.ndarray, np.ndarray]:
        """The knots that each piece lies between, whole: float64, shape [s], twice."""
        return self.knots[:, self.degree - 1], self.knots[:, self.degree]


def find_pieces(
    knots: np.ndarray, first_knot: np.ndarray, counts: np.ndarray, degree: int, ranges: np.ndarray
) -> Pieces:
    """Return the pieces of splines.

    Args:
        knots: Those of all splines, one spline's after the other's, ascending in each, float64, shape [k].
        first_knot: Position of the first knot of each spline, shape [n]; it has ``counts + degree + 1``.
        counts: Control points of each spline, more than its degree, shape [n].
        degree: Of all of them, at least 1.
        ranges: Least and greatest parameter of each, shape [n, 2].
    """
    intervals = counts - degree
    ends = np.cumsum(intervals)
    spline = np.repeat(np.arange(len(counts)), intervals)
    number = np.arange(int(intervals.sum())) - np.repeat(ends - intervals, intervals)
    at = first_knot[spline] + number + degree
    start = np.maximum(knots[at], ranges[spline, 0])
    end = np.minimum(knots[at + 1], ranges[spline, 1])
    kept = np.flatnonzero(end > start)
    spline, number, at = spline[kept], number[kept], at[kept]
    local = knots[at[:, None] + np.arange(1 - degree, degree + 1)]
    return Pieces(degree, spline, number, number, local, start[kept], end[kept])


def bezier_weights(knots: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return what takes the control points of pieces to their Bezier points: float64, shape [s, k, k], k = degree + 1.

    Args:
        knots: The 2 degree knots about each piece, shape [s, 2 degree].
        start: Parameters that it begins at, shape [s].
        end: Parameters that it ends at, shape [s].
    """
    degree = knots.shape[1] // 2
    weights = np.empty((len(knots), degree + 1, degree + 1))
    for row in range(degree + 1):
        points = np.broadcast_to(np.eye(degree + 1), (len(knots), degree + 1, degree + 1)).copy()
        for level in range(1, degree + 1):
            argument = start if level <= degree - row else end
            low, high = knots[:, level - 1 : degree], knots[:, degree : 2 * degree - level + 1]
            share = ((argument[:, None] - low) / (high - low))[..., None]
            points[:, level:] = (1 - share) * points[:, level - 1 : -1] + share * points[:, level:]
        weights[:, row] = points[:, degree]
    return weights


def bernstein(degree: int, at: np.ndarray, derivative: int = 0) -> np.ndarray:
    """Return Bernstein polynomials, or derivatives of theirs, float64, shape [m, degree + 1].

    Args:
        degree: Of the polynomials.
        at: Where, from 0 to 1, shape [m].
        derivative: How often they are derived.
    """
    if derivative > degree:
        return np.zeros((len(at), degree + 1))
    if derivative:
        lower = bernstein(degree - 1, at, derivative - 1)
        return degree * (np.pad(lower, ((0, 0), (1, 0))) - np.pad(lower, ((0, 0), (0, 1))))
    values = np.zeros((len(at), degree + 1))
    values[:, 0] = 1
    for k in range(1, degree + 1):
        values[:, 1 : k + 1] = at[:, None] * values[:, :k] + (1 - at)[:, None] * values[:, 1 : k + 1]
        values[:, 0] *= 1 - at
    return values
