# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The segments of UsdGeomNurbsCurves as cubic Bezier curves: exactly, where they are polynomials of degree 3 or less.

Reference: UsdGeomNurbsCurves schema documentation. ``varying`` values belong to the knots of the curves' domains, those
of no length apart counted, as on a NurbsPatch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report, counted
from warp_rt.splines.pieces import MAX_ORDER, Pieces, bernstein, find_pieces
from warp_rt.usd.arrays import double_rows, doubles, integers, point_weights
from warp_rt.usd.basis_curves import BAD_CURVES
from warp_rt.usd.curve_layout import Blend, ShapeLayout, curve_counts, lay_out_polylines, starts

# Distance of a cubic from the piece of a curve that it stands for, in parts of the diagonal of the box about the
# control points of that piece: below what float32 coordinates of a picture's size tell apart.
FIT_TOLERANCE = 1e-5

# So often is a piece halved at most: the distance falls sixteenfold each time.
_MAX_HALVINGS = 12


@dataclass(frozen=True, eq=False)
class _Cubics:
    """Cubic Bezier curves, each part of a piece of a spline."""

    piece: np.ndarray
    """int64, shape [n]."""
    start: np.ndarray
    """float64, shape [n], from 0 to 1 along the piece."""
    end: np.ndarray
    weights: np.ndarray
    """float64, shape [n, 4, degree + 1], of the piece's control points."""


@dataclass(frozen=True, eq=False)
class _Segments:
    """What is drawn of curves of one degree."""

    curve: np.ndarray
    """int64, shape [n]."""
    start: np.ndarray
    """float64, shape [n], parameter."""
    rows: np.ndarray
    """int64, shape [n, degree + 1], control points of the prim."""
    weights: np.ndarray
    """float64, shape [n, 2 or 4, degree + 1], of them for the Bezier points."""
    varying_rows: np.ndarray
    """int64, shape [n, 2]."""
    varying_weights: np.ndarray
    """float64, shape [n, 2, 2]."""


def lay_out_nurbs_curves(
    prim: Usd.Prim, lengths: np.ndarray, points: np.ndarray, time: Usd.TimeCode, report: Report
) -> ShapeLayout:
    """Return the segments of NurbsCurves. Curves whose orders and knots do not fit are straight from point to point.

    Args:
        prim: The curves.
        lengths: Points of each curve, int64.
        points: Of the prim, shape [n, 3].
        time: When its attributes are read.
        report: Takes the diagnostics.
    """
    schema = UsdGeom.NurbsCurves(prim)
    orders = integers(schema.GetOrderAttr().Get(time))
    knots = doubles(schema.GetKnotsAttr().Get(time))
    if orders is not None and len(orders) == 1:
        orders = np.repeat(orders, len(lengths))  # one for all, as some files have it
    if orders is None or len(orders) != len(lengths) or (orders < 1).any():
        knots = None
    if orders is None or knots is None or len(knots) != (lengths + orders).sum():
        message = "order and knots do not fit curveVertexCounts: drawn as straight lines between points"
        report.warn(BAD_CURVES, prim.GetPath(), message)
        return lay_out_polylines(lengths, len(points))
    first_knot = starts(lengths + orders)
    falls = np.append(0, np.cumsum(~(np.diff(np.where(np.isfinite(knots), knots, np.nan)) >= 0)))
    ascends = falls[first_knot + lengths + orders - 1] == falls[first_knot]
    is_high = orders > MAX_ORDER
    if is_high.any():
        report.warn(
            BAD_CURVES, prim.GetPath(), f"{counted(is_high.sum(), 'curve')} left out: an order above {MAX_ORDER}"
        )
    is_curve = (orders >= 2) & (orders <= lengths) & ascends & ~is_high
    ranges = _read_ranges(schema, knots, first_knot, lengths, orders, is_curve, time, report)
    is_curve &= ranges[:, 0] < ranges[:, 1]
    is_bad = ~(is_curve | is_high)
    if is_bad.any():
        report.warn(BAD_CURVES, prim.GetPath(), f"{counted(is_bad.sum(), 'curve')} left out: knots that make none")
    weights = point_weights(schema.GetPointWeightsAttr(), len(points), time, BAD_CURVES, report)
    varying_counts = np.where(is_curve, lengths - orders + 2, 0)
    parts = []
    degrees = np.unique(orders[is_curve] - 1)
    is_straight = not np.ptp(weights) and (degrees <= 1).all()
    for degree in degrees:
        chosen = np.flatnonzero(is_curve & (orders == degree + 1))
        pieces = find_pieces(knots, first_knot[chosen], lengths[chosen], int(degree), ranges[chosen])
        rows = (starts(lengths)[chosen][pieces.spline] + pieces.first)[:, None] + np.arange(degree + 1)
        cubics = _straight(pieces) if is_straight else _fit(pieces, points[rows].astype(np.float64), weights[rows])
        parts.append(_lay_out(pieces, cubics, rows, chosen[pieces.spline], starts(varying_counts)[chosen]))
    counts = curve_counts(len(lengths), int(varying_counts.sum()), len(points))
    return _joined(parts, counts) if parts else lay_out_polylines(lengths[:0], len(points))


def _lay_out(
    pieces: Pieces, cubics: _Cubics, rows: np.ndarray, curve: np.ndarray, first_varying: np.ndarray
) -> _Segments:
    piece = cubics.piece
    low, high = (knot[piece] for knot in pieces.interval)
    at = [pieces.start[piece] + share * (pieces.end - pieces.start)[piece] for share in (cubics.start, cubics.end)]
    shares = np.stack([(parameter - low) / (high - low) for parameter in at], axis=1)
    return _Segments(
        curve=curve[piece],
        start=at[0],
        rows=rows[piece],
        weights=cubics.weights,
        varying_rows=(first_varying[pieces.spline[piece]] + pieces.number[piece])[:, None] + np.arange(2),
        varying_weights=np.stack([1 - shares, shares], axis=2),
    )


def _joined(parts: list[_Segments], counts: dict[str, int]) -> ShapeLayout:
    """Return the layout of the segments of all degrees, in the order of curves and along each."""
    width = max(part.rows.shape[1] for part in parts)
    padding = [(0, width - part.rows.shape[1]) for part in parts]
    rows = [np.pad(part.rows, ((0, 0), pad)) for part, pad in zip(parts, padding, strict=True)]
    weights = [np.pad(part.weights, ((0, 0), (0, 0), pad)) for part, pad in zip(parts, padding, strict=True)]
    curve = np.concatenate([part.curve for part in parts])
    order = np.lexsort((np.concatenate([part.start for part in parts]), curve))
    vertex = Blend(np.concatenate(rows)[order], np.concatenate(weights)[order])
    varying = Blend(
        np.concatenate([part.varying_rows for part in parts])[order],
        np.concatenate([part.varying_weights for part in parts])[order],
    )
    return ShapeLayout(counts, vertex, vertex, varying, curve[order])


def _straight(pieces: Pieces) -> _Cubics:
    """Return pieces of degree 1 as they are, by their two ends."""
    return _Cubics(np.arange(len(pieces)), np.zeros(len(pieces)), np.ones(len(pieces)), pieces.bezier_weights)


def _fit(pieces: Pieces, points: np.ndarray, weights: np.ndarray) -> _Cubics:
    """Return cubics for pieces: the same curve, where there is one, else as many as it takes.

    Those have the points and the tangents of the piece at their ends.

    Args:
        pieces: Of one degree.
        points: Control points of each, shape [s, degree + 1, 3].
        weights: Of the control points, shape [s, degree + 1].
    """
    is_exact = (np.ptp(weights, axis=1) == 0) & (pieces.degree <= 3)
    found = []
    if is_exact.any():
        elevated = np.einsum("ij,njk->nik", _elevation(pieces.degree), pieces.bezier_weights[is_exact])
        found.append(_Cubics(np.flatnonzero(is_exact), np.zeros(len(elevated)), np.ones(len(elevated)), elevated))
    piece = np.flatnonzero(~is_exact)
    start, end = np.zeros(len(piece)), np.ones(len(piece))
    with np.errstate(invalid="ignore"):  # points that are not finite are told where they are drawn
        allowed = FIT_TOLERANCE * np.linalg.norm(np.ptp(points, axis=1), axis=1)
    for halving in range(_MAX_HALVINGS + 1):
        values, slopes = zip(*(_rational_basis(pieces, weights, piece, at) for at in (start, end)), strict=True)
        third = ((end - start) / 3)[:, None]
        cubic = np.stack([values[0], values[0] + third * slopes[0], values[1] - third * slopes[1], values[1]], axis=1)
        error = np.zeros(len(piece))
        for share in (0.25, 0.5, 0.75):
            expected, _ = _rational_basis(pieces, weights, piece, start + share * (end - start))
            missed = np.einsum("c,ncj->nj", bernstein(3, np.array([share]))[0], cubic) - expected
            error = np.maximum(error, np.linalg.norm(np.einsum("nj,njx->nx", missed, points[piece]), axis=1))
        is_good = (error <= allowed[piece]) | (halving == _MAX_HALVINGS)
        found.append(_Cubics(piece[is_good], start[is_good], end[is_good], cubic[is_good]))
        piece, start, end = (np.repeat(array[~is_good], 2) for array in (piece, start, end))
        middle = (start + end) / 2
        start[1::2], end[::2] = middle[1::2], middle[::2]
    return _Cubics(*(np.concatenate([getattr(part, name) for part in found]) for name in _Cubics.__annotations__))


def _rational_basis(
    pieces: Pieces, weights: np.ndarray, piece: np.ndarray, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rational basis functions of pieces and their derivatives along them, shape [m, degree + 1] each."""
    bezier = pieces.bezier_weights[piece] * weights[piece][:, None, :]
    value, slope = (np.einsum("mk,mkj->mj", bernstein(pieces.degree, at, order), bezier) for order in (0, 1))
    total = value.sum(axis=1, keepdims=True)
    basis = value / total
    return basis, (slope - basis * slope.sum(axis=1, keepdims=True)) / total


def _elevation(degree: int) -> np.ndarray:
    """Return what takes the Bezier points of a degree up to 3 to those of the same curve as a cubic."""
    if degree >= 3:
        return np.eye(degree + 1)
    matrix = np.eye(degree + 1)
    for size in range(degree + 1, 4):
        share = (np.arange(size + 1) / size)[:, None]
        padded = np.pad(matrix, ((1, 1), (0, 0)))
        matrix = share * padded[:-1] + (1 - share) * padded[1:]
    return matrix


def _read_ranges(
    schema: UsdGeom.NurbsCurves,
    knots: np.ndarray,
    first_knot: np.ndarray,
    lengths: np.ndarray,
    orders: np.ndarray,
    is_curve: np.ndarray,
    time: Usd.TimeCode,
    report: Report,
) -> np.ndarray:
    """Return the least and the greatest parameter of each curve, within its knots' domain: float64, shape [n, 2]."""
    domain = np.zeros((len(lengths), 2))
    at = first_knot[is_curve]
    domain[is_curve] = knots[np.stack([at + orders[is_curve] - 1, at + lengths[is_curve]], axis=1)]
    value = schema.GetRangesAttr().Get(time)
    ranges = double_rows(value, 2)
    if value is None or not (ranges is None or len(ranges)):
        return domain
    if ranges is None or len(ranges) != len(lengths) or not np.isfinite(ranges).all():
        report.warn(BAD_CURVES, schema.GetPath(), "ranges do not fit curveVertexCounts: the knots' domains are taken")
        return domain
    cut = np.clip(ranges, domain[:, :1], domain[:, 1:])
    beyond = int(((cut != ranges).any(axis=1) & is_curve).sum())
    if beyond:
        report.warn(BAD_CURVES, schema.GetPath(), f"{beyond} ranges reach beyond their knots: cut")
    return cut
