# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rational B-spline curves by their Bezier pieces."""

from __future__ import annotations

import numpy as np

from warp_rt.splines.pieces import Pieces, bernstein

# Where second derivatives are looked at, along a piece.
_SAMPLES = np.linspace(0, 1, 9)


def homogeneous(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return points [n, d] times their weights [n], and the weights: float64, shape [n, d + 1]."""
    weights = weights.astype(np.float64)[:, None]
    return np.concatenate([points * weights, weights], axis=1)


def bezier_points(pieces: Pieces, controls: np.ndarray, first_control: np.ndarray) -> np.ndarray:
    """Return the Bezier points of each piece, float64, shape [s, degree + 1, c].

    Args:
        pieces: Of the curves.
        controls: Control points of all curves, in as many dimensions as wanted, shape [n, c].
        first_control: Row of the first control point of each curve.
    """
    rows = (first_control[pieces.spline] + pieces.first)[:, None] + np.arange(pieces.degree + 1)
    return np.einsum("sij,sjc->sic", pieces.bezier_weights, controls[rows])


def points_at(bezier: np.ndarray, piece: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return points of rational pieces, float64, shape [m, d].

    Args:
        bezier: Homogeneous Bezier points, shape [s, degree + 1, d + 1].
        piece: Of each point, shape [m].
        at: Where along it, from 0 to 1, shape [m].
    """
    blended = np.einsum("mk,mkc->mc", bernstein(bezier.shape[1] - 1, at), bezier[piece])
    with np.errstate(divide="ignore", invalid="ignore"):
        return blended[:, :-1] / blended[:, -1:]


def count_steps(bezier: np.ndarray, tolerance: float) -> np.ndarray:
    """Return into how many chords each rational piece is cut that they stay within a tolerance: int64, shape [s].

    A chord of step h is within h^2 / 8 times the largest second derivative, here of 9 samples, of the curve.

    Args:
        bezier: Homogeneous Bezier points, shape [s, degree + 1, d + 1].
        tolerance: Distance.
    """
    degree = bezier.shape[1] - 1
    if degree == 1:
        return np.ones(len(bezier), np.int64)  # a straight line, whatever its weights
    value, first, second = (np.einsum("tk,skc->stc", bernstein(degree, _SAMPLES, n), bezier) for n in range(3))
    w, w_1, w_2 = (rows[..., -1:] for rows in (value, first, second))
    with np.errstate(divide="ignore", invalid="ignore"):
        point = value[..., :-1] / w
        slope = (first[..., :-1] - w_1 * point) / w
        bend = (second[..., :-1] - 2 * w_1 * slope - w_2 * point) / w
    largest = np.nan_to_num(np.linalg.norm(bend, axis=2), posinf=0).max(axis=1)
    return np.maximum(np.ceil(np.sqrt(largest / (8 * tolerance))).astype(np.int64), 1)


def polyline(bezier: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return points along pieces that follow each other, from their start to their end: shape [sum(steps) + 1, d]."""
    piece = np.repeat(np.arange(len(steps)), steps)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(steps) - steps, steps)
    last = len(steps) - 1
    return points_at(bezier, np.append(piece, last), np.append(step / steps[piece], 1.0))
