# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the trim curves of a NurbsPatch leave of its domain.

Reference: UsdGeomNurbsPatch schema documentation, ``trimCurve:*``, and RiTrimCurve: loops of curves that connect head
to tail, homogeneous points, what lies to the left of the curves is kept.
"""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.splines.curve import bezier_points, count_steps, polyline
from warp_rt.splines.patch import Patch
from warp_rt.splines.pieces import MAX_ORDER, find_pieces
from warp_rt.splines.trim import CrossingLoopsError, Rings, find_regions
from warp_rt.usd.arrays import double_rows, doubles, integers
from warp_rt.usd.attribute_values import shown

BAD_TRIM = "W142"

# Of the domain: curves that end farther from where the next one begins do not connect.
_GAP = 1e-3


def read_regions(
    schema: UsdGeom.NurbsPatch, patch: Patch, tolerance: float, time: Usd.TimeCode, report: Report
) -> list[Rings] | None:
    """Return the parts of the domain that are kept; None: all of it.

    Args:
        schema: The prim.
        patch: Its surface.
        tolerance: Distance on the surface that the polygons may be from the curves.
        time: When the attributes are read.
        report: Takes the diagnostics.
    """
    value, path = schema.GetTrimCurveCountsAttr().Get(time), schema.GetPath()
    counts = integers(value)
    if counts is None:
        if value is not None:
            report.warn(BAD_TRIM, path, f"not trimmed: trimCurve:counts is {shown(value)}, no whole numbers")
        return None
    if not len(counts):
        return None
    orders = integers(schema.GetTrimCurveOrdersAttr().Get(time))
    if orders is not None and orders.max(initial=0) > MAX_ORDER:
        report.warn(BAD_TRIM, path, f"not trimmed: a curve's order is {orders.max()}, above {MAX_ORDER}")
        return None
    curves = _read_curves(schema, orders, time)
    if curves is None or (counts < 1).any() or counts.sum() != len(curves):
        report.warn(BAD_TRIM, path, "not trimmed: the arrays trimCurve:* do not fit each other")
        return None
    low = np.array([patch.u.start[0], patch.v.start[0]])
    high = np.array([patch.u.end[-1], patch.v.end[-1]])
    lines = []
    for bezier in curves:
        on_surface = np.concatenate([bezier[..., :2] * patch.speeds(), bezier[..., 2:]], axis=2)
        lines.append(polyline(bezier, count_steps(on_surface, tolerance)))
    loops = []
    open_count = 0
    for end, count in zip(np.cumsum(counts), counts, strict=True):
        parts = lines[end - count : end]
        gaps = [np.abs((a[-1] - b[0]) / (high - low)).max() for a, b in zip(parts, parts[1:] + parts[:1], strict=True)]
        closed = [part[:-1] if gap <= _GAP else part for part, gap in zip(parts, gaps, strict=True)]
        loops.append(np.concatenate(closed))
        open_count += max(gaps) > _GAP
    if open_count:
        report.warn(BAD_TRIM, path, f"{open_count} trim loops have gaps: closed by straight lines")
    try:
        return find_regions(loops, low, high)
    except CrossingLoopsError:
        report.warn(BAD_TRIM, path, "not trimmed: its loops cross each other or themselves")
        return None


def _read_curves(schema: UsdGeom.NurbsPatch, orders: np.ndarray | None, time: Usd.TimeCode) -> list[np.ndarray] | None:
    """Return homogeneous Bezier points of each curve's pieces, [s, order, 3]; None where the arrays do not fit."""
    vertex_counts = integers(schema.GetTrimCurveVertexCountsAttr().Get(time))
    knots = doubles(schema.GetTrimCurveKnotsAttr().Get(time))
    ranges = double_rows(schema.GetTrimCurveRangesAttr().Get(time), 2)
    points = double_rows(schema.GetTrimCurvePointsAttr().Get(time), 3)
    if orders is None or vertex_counts is None or knots is None or ranges is None or points is None:
        return None
    count = len(orders)
    fits = (
        len(vertex_counts) == len(ranges) == count
        and ((orders >= 2) & (orders <= vertex_counts)).all()
        and len(points) == vertex_counts.sum()
        and len(knots) == vertex_counts.sum() + orders.sum()
        and all(np.isfinite(array).all() for array in (knots, ranges, points))
        and (points[:, 2] > 0).all()
    )
    if not fits:
        return None
    curves = []
    first_knot = np.cumsum(vertex_counts + orders) - vertex_counts - orders
    first_point = np.cumsum(vertex_counts) - vertex_counts
    for row in range(count):
        own = knots[first_knot[row] : first_knot[row] + vertex_counts[row] + orders[row]]
        if (np.diff(own) < 0).any():
            return None
        domain = own[[orders[row] - 1, vertex_counts[row]]]
        span = np.clip(ranges[row], *domain)[None]
        pieces = find_pieces(own, np.zeros(1, np.int64), vertex_counts[row : row + 1], int(orders[row]) - 1, span)
        if not len(pieces):
            return None
        curves.append(bezier_points(pieces, points, first_point[row : row + 1]))
    return curves
