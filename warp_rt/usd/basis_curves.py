# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The segments of UsdGeomBasisCurves.

Reference: UsdGeomBasisCurves schema documentation (segment counts, wraps, bases, primvar interpolation).
"""

from __future__ import annotations

import numpy as np
from pxr import Usd

from warp_rt.report import Report, counted
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.curve_layout import Blend, ShapeLayout, curve_counts, ragged, starts
from warp_rt.usd.mesh import INVALID_VALUE

BAD_CURVES = "W117"

_WRAPS = ("nonperiodic", "periodic", "pinned")
_BASES = ("bezier", "bspline", "catmullRom")

# Bezier control points of a segment from four points of its basis.
_BEZIER_FROM = {
    "bezier": np.eye(4),
    "bspline": np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6,
    "catmullRom": np.array([[0, 6, 0, 0], [-1, 6, 1, 0], [0, 1, 6, -1], [0, 0, 6, 0]]) / 6,
}


def lay_out_basis_curves(
    prim: Usd.Prim, lengths: np.ndarray, point_count: int, time: Usd.TimeCode, report: Report
) -> ShapeLayout:
    """Return the segments of BasisCurves: of linear ones the ends, of cubic ones the Bezier points.

    Args:
        prim: The curves.
        lengths: Points of each curve, int64, shape [curves].
        point_count: Of the prim.
        time: When its attributes are read.
        report: Takes the diagnostics.
    """
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    is_linear = attributes.token("type", "cubic", ("cubic", "linear")) == "linear"
    basis = attributes.token("basis", _BASES[0], _BASES)
    wrap = attributes.token("wrap", _WRAPS[0], _WRAPS)
    size, step = (2, 1) if is_linear else (4, 3 if basis == "bezier" else 1)
    is_periodic = wrap == "periodic"
    is_pinned = wrap == "pinned" and step == 1 and not is_linear
    fitting = lengths // step if is_periodic else (lengths - 1 if is_pinned else (lengths - size) // step + 1)
    least = np.where(is_periodic, size - 1 if step == 1 else step, 2 if is_pinned else size)
    is_short = lengths < least
    is_uneven = (lengths % step != 0) if is_periodic else ((lengths - size) % step != 0)
    dropped = is_short | (is_uneven & (step > 1))
    if dropped.any():
        what = "linear" if is_linear else f"{wrap} {basis}"
        report.warn(
            BAD_CURVES, prim.GetPath(), f"{counted(dropped.sum(), 'curve')} left out: points that make no {what} curve"
        )
    segments = np.where(dropped, 0, fitting)
    curve, along = ragged(segments)
    first, count = starts(lengths)[curve], lengths[curve]
    local = along[:, None] * step + np.arange(size) - (1 if is_pinned else 0)
    weights = None if is_linear else np.broadcast_to(_BEZIER_FROM[basis], (len(curve), 4, 4)).copy()
    if is_pinned and weights is not None:
        # A phantom point continues the curve's first two, or last two: 2 p0 - p1.
        before, beyond = local[:, 0] < 0, local[:, 3] >= count
        weights[before] = weights[before] @ _phantom(0)
        weights[beyond] = weights[beyond] @ _phantom(3)
        local = np.clip(local, 0, count[:, None] - 1)
    vertex = Blend(first[:, None] + (local % count[:, None] if is_periodic else local), weights)
    # Curves that are left out have their values too, by the same rule.
    varying_counts = np.maximum(fitting + (0 if is_periodic else 1), 0)
    step_on = along[:, None] + np.arange(2)
    on_curve = step_on % segments[curve][:, None] if is_periodic else step_on
    varying = Blend(starts(varying_counts)[curve][:, None] + on_curve)
    counts = curve_counts(len(lengths), int(varying_counts.sum()), point_count)
    return ShapeLayout(counts, vertex, vertex, varying, curve)


def _phantom(place: int) -> np.ndarray:
    """Return the matrix that makes the first or the last of four points of those next to it."""
    matrix = np.eye(4)
    matrix[place] = [0, 2, -1, 0] if place == 0 else [0, -1, 2, 0]
    return matrix
