# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomPoints to spheres and UsdGeomBasisCurves to tubes, both exact.

Reference: UsdGeomBasisCurves schema documentation (segment counts, wraps, bases, primvar interpolation).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Primvar, ShapeKind, Shapes
from warp_rt.usd.arrays import float_rows, integers
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.mesh import EMPTY, INVALID_VALUE
from warp_rt.usd.motion import read_points
from warp_rt.usd.polygons import MAX_COORDINATE
from warp_rt.usd.primvars import lay_out, read_primvar, read_primvars
from warp_rt.usd.skinning import Skin, pose
from warp_rt.usd.sources import MeshSource

TYPES = ("Points", "BasisCurves")
BAD_CURVES = "W117"
RIBBONS = "W118"
NO_WIDTHS = "N913"

_DEFAULT_WIDTH = 1.0  # Hydra's
_WRAPS = ("nonperiodic", "periodic", "pinned")
_BASES = ("bezier", "bspline", "catmullRom")

# Bezier control points of a segment from four points of its basis.
_BEZIER_FROM = {
    "bezier": np.eye(4),
    "bspline": np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6,
    "catmullRom": np.array([[0, 6, 0, 0], [-1, 6, 1, 0], [0, 1, 6, -1], [0, 0, 6, 0]]) / 6,
}


@dataclass(frozen=True, eq=False)
class ShapeLayout:
    """How the elements of points or curves are numbered, and which of them each shape takes along its length.

    What ``warp_rt.usd.primvars`` asks of ``Elements``.
    """

    counts: dict[str, int]
    """Number of elements by interpolation."""
    vertices: np.ndarray
    """int64, shape [n, k], points of each shape: 1, or 2 or 4 along it."""
    weights: np.ndarray | None
    """float64, shape [n, k, k], coefficients along each shape from those points; None: the points themselves."""
    varying: np.ndarray
    """int64, shape [n, r], varying elements of each shape: 1, or 2 at its ends."""
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
            return Primvar(values, rows[self.curve][:, None].astype(np.int32))
        if interpolation == "vertex" and self.weights is not None:
            blended = np.einsum("nij,njc->nic", self.weights, values[rows[self.vertices]].astype(np.float64))
            own = np.arange(blended.shape[0] * blended.shape[1], dtype=np.int32).reshape(self.vertices.shape)
            return Primvar(blended.reshape(-1, values.shape[1]).astype(np.float32), own)
        elements = self.vertices if interpolation == "vertex" else self.varying
        return Primvar(values, rows[elements].astype(np.int32))

    def __getitem__(self, kept: np.ndarray) -> ShapeLayout:
        weights = None if self.weights is None else self.weights[kept]
        return ShapeLayout(self.counts, self.vertices[kept], weights, self.varying[kept], self.curve[kept])


def read_shapes(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    report: Report,
    skin: Skin | None = None,
    carried_to: Usd.TimeCode | None = None,
) -> MeshSource | None:
    """Return the spheres of Points or the tubes of BasisCurves; None, with a diagnostic, where there are none.

    Args:
        prim: Of one of ``TYPES``.
        time: When its attributes are read.
        report: Takes the diagnostics.
        skin: Deforms its points.
        carried_to: When its velocities have carried the points from their sample; None: they do not.
    """
    path = prim.GetPath()
    points = read_points(prim, time, carried_to)
    if points is None or not len(points):
        report.warn(EMPTY, path, f"{prim.GetTypeName()} without points")
        return None
    points, _ = pose(points, skin, prim, report)
    if prim.GetTypeName() == "Points":
        layout = _lay_out_points(len(points))
    else:
        found = _lay_out_curves(prim, len(points), time, report)
        if found is None:
            return None
        layout = found
    controls = _along(points.astype(np.float64), layout)
    radii = _radii(prim, layout, time, report)
    finite = np.isfinite(controls).all(axis=(1, 2)) & (np.abs(controls).max(axis=(1, 2)) <= MAX_COORDINATE)
    is_usable = finite & np.isfinite(radii).all(axis=1)
    if not is_usable.all():
        report.warn(BAD_CURVES, path, f"{(~is_usable).sum()} parts left out: points or widths that are not finite")
    # What has no width is not seen, and what has no length lies in its neighbours' ends.
    has_length = (np.ptp(controls, axis=1) > 0).any(axis=1) | (controls.shape[1] == 1)
    kept = np.flatnonzero(is_usable & (radii.max(axis=1) > 0) & has_length)
    if not len(kept):
        report.warn(EMPTY, path, f"{prim.GetTypeName()} of no size")
        return None
    kinds = {1: ShapeKind.SPHERE, 2: ShapeKind.LINEAR_TUBE, 4: ShapeKind.CUBIC_TUBE}
    layout = layout[kept]
    shapes = Shapes(
        kinds[controls.shape[1]],
        points=controls[kept].astype(np.float32),
        radii=radii[kept].astype(np.float32),
        primvars={n: v for n, v in read_primvars(prim, layout, time, report).items() if n != "widths"},
        face_ids=layout.curve.astype(np.int32),
        is_closed=controls.shape[1] == 1,  # the segments of a curve overlap, so that none of them bounds a body
    )
    return MeshSource(shapes)


def _lay_out_points(count: int) -> ShapeLayout:
    own = np.arange(count)[:, None]
    counts = {"constant": 1, "uniform": 1, "varying": count, "vertex": count, "faceVarying": count}
    return ShapeLayout(counts, own, None, own, np.arange(count))


def _lay_out_curves(prim: Usd.Prim, point_count: int, time: Usd.TimeCode, report: Report) -> ShapeLayout | None:
    """Return the segments of all curves; None, with a diagnostic, where there are none."""
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    kind = attributes.token("type", "cubic", ("cubic", "linear"))
    basis = attributes.token("basis", _BASES[0], _BASES)
    wrap = attributes.token("wrap", _WRAPS[0], _WRAPS)
    curves = UsdGeom.BasisCurves(prim)
    lengths = integers(curves.GetCurveVertexCountsAttr().Get(time))
    lengths = np.zeros(0, np.int64) if lengths is None else np.maximum(lengths, 0)
    if lengths.sum() != point_count:
        report.warn(
            BAD_CURVES, prim.GetPath(), f"curveVertexCounts sum to {lengths.sum()}, there are {point_count} points"
        )
        lengths = lengths[np.cumsum(lengths) <= point_count]
    if curves.GetNormalsAttr().HasAuthoredValue() or UsdGeom.PrimvarsAPI(prim).HasPrimvar("normals"):
        report.warn(RIBBONS, prim.GetPath(), "curves with normals are ribbons: drawn as tubes of their widths")
    is_linear = kind == "linear"
    size, step = (2, 1) if is_linear else (4, 3 if basis == "bezier" else 1)
    is_periodic = wrap == "periodic"
    is_pinned = wrap == "pinned" and step == 1 and not is_linear
    segments = lengths // step if is_periodic else (lengths - 1 if is_pinned else (lengths - size) // step + 1)
    least = np.where(is_periodic, size - 1 if step == 1 else step, 2 if is_pinned else size)
    is_short = lengths < least
    is_uneven = (lengths % step != 0) if is_periodic else ((lengths - size) % step != 0)
    dropped = is_short | (is_uneven & (step > 1))
    if dropped.any():
        what = "linear" if is_linear else f"{wrap} {basis}"
        report.warn(BAD_CURVES, prim.GetPath(), f"{dropped.sum()} curves left out: their points make no {what} curve")
    segments = np.where(dropped, 0, segments)
    if not segments.sum():
        return None
    curve = np.repeat(np.arange(len(lengths)), segments)
    ends = np.cumsum(segments)
    along = np.arange(ends[-1]) - np.repeat(ends - segments, segments)
    first, count = (np.cumsum(lengths) - lengths)[curve], lengths[curve]
    local = along[:, None] * step + np.arange(size) - (1 if is_pinned else 0)
    weights = None if is_linear else np.broadcast_to(_BEZIER_FROM[basis], (len(curve), 4, 4)).copy()
    if is_pinned and weights is not None:
        # A phantom point continues the curve's first two, or last two: 2 p0 - p1.
        before, beyond = local[:, 0] < 0, local[:, 3] >= count
        weights[before] = weights[before] @ _phantom(0)
        weights[beyond] = weights[beyond] @ _phantom(3)
        local = np.clip(local, 0, count[:, None] - 1)
    vertices = first[:, None] + (local % count[:, None] if is_periodic else local)
    varying_counts = segments + (0 if is_periodic else 1)
    varying_first = (np.cumsum(varying_counts) - varying_counts)[curve]
    step_on = along[:, None] + np.arange(2)
    varying = varying_first[:, None] + (step_on % segments[curve][:, None] if is_periodic else step_on)
    counts = {
        "constant": 1,
        "uniform": len(lengths),
        "varying": int(varying_counts.sum()),
        "vertex": point_count,
        "faceVarying": int(varying_counts.sum()),
    }
    return ShapeLayout(counts, vertices, weights, varying, curve)


def _phantom(place: int) -> np.ndarray:
    """Return the matrix that makes the first or the last of four points of those next to it."""
    matrix = np.eye(4)
    matrix[place] = [0, 2, -1, 0] if place == 0 else [0, -1, 2, 0]
    return matrix


def _along(values: np.ndarray, layout: ShapeLayout) -> np.ndarray:
    """Return vertex values at the control points of each shape: float64, shape [n, k, c]."""
    own = values[layout.vertices]
    return own if layout.weights is None else np.einsum("nij,njc->nic", layout.weights, own)


def _radii(prim: Usd.Prim, layout: ShapeLayout, time: Usd.TimeCode, report: Report) -> np.ndarray:
    """Return half the widths at the control points of each shape: float64, shape [n, k]."""
    shape = layout.vertices.shape
    schema = UsdGeom.Points(prim) if prim.GetTypeName() == "Points" else UsdGeom.Curves(prim)
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("widths")
    widths = None
    if primvar and primvar.HasAuthoredValue():
        widths = read_primvar(primvar, layout, time, report)
    else:
        values = float_rows(schema.GetWidthsAttr().Get(time))
        if values is not None and len(values):
            interpolation = str(schema.GetWidthsInterpolation())
            if len(values) == 1 and layout.element_counts(interpolation) != (1,):
                interpolation = "constant"  # a single width is all that many files have, whatever they call it
            widths = lay_out(values, None, interpolation, layout, str(prim.GetPath()), "widths", report)
    if widths is None:
        report.warn(NO_WIDTHS, prim.GetPath(), f"no widths: {_DEFAULT_WIDTH:g} is taken")
        return np.full(shape, _DEFAULT_WIDTH / 2)
    values = np.maximum(widths.values[:, 0].astype(np.float64), 0) / 2
    if widths.indices is None:
        return np.full(shape, values[0])
    found = values[widths.indices]
    if found.shape[1] == shape[1]:
        return found
    if found.shape[1] == 1:
        return np.repeat(found, shape[1], axis=1)
    share = np.linspace(0, 1, shape[1])
    return found[:, :1] * (1 - share) + found[:, 1:] * share
