# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""B-splines by the recursion of Cox and de Boor, one basis function and one parameter at a time: slow, and plain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def basis(i: int, degree: int, u: float, knots: Sequence[float]) -> float:
    """Return N_{i, degree}(u), with 0 / 0 = 0. The last knot belongs to the last interval that has a length."""
    if degree == 0:
        last = max(k for k in range(len(knots) - 1) if knots[k] < knots[k + 1])
        return float(knots[i] <= u < knots[i + 1] or (i == last and u == knots[i + 1]))
    left, right = knots[i + degree] - knots[i], knots[i + degree + 1] - knots[i + 1]
    value = 0.0
    if left > 0:
        value += (u - knots[i]) / left * basis(i, degree - 1, u, knots)
    if right > 0:
        value += (knots[i + degree + 1] - u) / right * basis(i + 1, degree - 1, u, knots)
    return value


def curve_point(points: np.ndarray, weights: np.ndarray, degree: int, knots: Sequence[float], u: float) -> np.ndarray:
    """Return a point of a rational curve whose control points are ``points``, shape [n, d]."""
    values = np.array([basis(i, degree, u, knots) for i in range(len(points))]) * weights
    return values @ points / values.sum()


def surface_point(
    points: np.ndarray,
    weights: np.ndarray,
    degrees: tuple[int, int],
    knots: tuple[Sequence[float], Sequence[float]],
    u: float,
    v: float,
) -> np.ndarray:
    """Return a point of a rational surface; control points [v_count, u_count, d]."""
    along_u = np.array([basis(i, degrees[0], u, knots[0]) for i in range(points.shape[1])])
    along_v = np.array([basis(i, degrees[1], v, knots[1]) for i in range(points.shape[0])])
    values = np.outer(along_v, along_u) * weights
    return np.tensordot(values, points, axes=((0, 1), (0, 1))) / values.sum()
