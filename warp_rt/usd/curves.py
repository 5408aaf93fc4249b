# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomPoints to spheres, and curves of all schemas to tubes, both exact, or to ribbons where they have normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report, counted
from warp_rt.scene import Primvar, ShapeKind, Shapes
from warp_rt.usd.arrays import float_rows, integers, vector_rows
from warp_rt.usd.basis_curves import BAD_CURVES, lay_out_basis_curves
from warp_rt.usd.curve_layout import ShapeLayout, lay_out_points, lay_out_polylines
from warp_rt.usd.hermite_curves import lay_out_hermite_curves
from warp_rt.usd.mesh import EMPTY
from warp_rt.usd.motion import read_points
from warp_rt.usd.normals import UNUSED_NORMALS, read_normals
from warp_rt.usd.nurbs_curves import lay_out_nurbs_curves
from warp_rt.usd.polygons import MAX_COORDINATE
from warp_rt.usd.primvars import lay_out, read_primvar, read_primvars
from warp_rt.usd.questions import get_type_name
from warp_rt.usd.ribbons import make_ribbons
from warp_rt.usd.skinning import Skin, pose
from warp_rt.usd.sources import MeshSource

TYPES = ("Points", "BasisCurves", "NurbsCurves", "HermiteCurves")
NO_WIDTHS = "N913"

_DEFAULT_WIDTH = 1.0  # Hydra's
_KINDS = {1: ShapeKind.SPHERE, 2: ShapeKind.LINEAR_TUBE, 4: ShapeKind.CUBIC_TUBE}


def read_shapes(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    report: Report,
    *,
    skin: Skin | None = None,
    level: int = 0,
    carried_to: Usd.TimeCode | None = None,
    inherited_width: float | None = None,
) -> MeshSource | None:
    """Return the spheres of Points, or the tubes or ribbons of curves; None, with a diagnostic, where there are none.

    Args:
        prim: Of one of ``TYPES``.
        time: When its attributes are read.
        report: Takes the diagnostics.
        skin: Deforms its points.
        level: Refinements of ribbons.
        carried_to: When its velocities have carried the points from their sample; None: they do not.
        inherited_width: What it has where it has no widths of its own; None: nothing hands one down.

    Raises:
        LimitError: Ribbons would have more triangles than can be meant.
    """
    path = prim.GetPath()
    rest = read_points(prim, time, carried_to)
    if rest is None or not len(rest):
        report.warn(EMPTY, path, f"{get_type_name(prim)} without points")
        return None
    points, skin = pose(rest, skin, prim, report)
    layout, values = _lay_out(prim, rest, points, skin, time, report)
    if not len(layout.curve):
        return None
    controls = layout.controls.along(values.astype(np.float64))
    radii = _radii(prim, layout, controls.shape[:2], inherited_width, time, report)
    is_usable = (np.abs(controls) + radii[:, :, None] <= MAX_COORDINATE).all(axis=(1, 2))
    if not is_usable.all():
        what = f"points or widths are not finite, or beyond {MAX_COORDINATE:g}"
        report.warn(BAD_CURVES, path, f"{counted((~is_usable).sum(), 'part')} left out: {what}")
    # What has no width is not seen, and what has no length lies in its neighbours' ends.
    with np.errstate(invalid="ignore"):
        has_length = (np.ptp(controls, axis=1) > 0).any(axis=1) | (controls.shape[1] == 1)
    has_width = is_usable & (radii.max(axis=1, initial=0) > 0)
    kept = np.flatnonzero(has_width & has_length)
    if not len(kept):
        report.warn(EMPTY, path, f"{get_type_name(prim)} of no size")
        return None
    points_alone = np.setdiff1d(layout.curve[has_width], layout.curve[kept])
    if len(points_alone):
        report.warn(BAD_CURVES, path, f"{counted(len(points_alone), 'curve')} left out: all points at one place")
    layout, controls, radii = layout[kept], controls[kept], radii[kept]
    primvars = {name: value for name, value in read_primvars(prim, layout, time, report).items() if name != "widths"}
    if _has_normals(prim, time) and get_type_name(prim) == "Points":
        report.warn(UNUSED_NORMALS, path, "its normals do not count: spheres have their own")
    elif _has_normals(prim, time):
        elements = layout if skin is None else _PosedNormals(layout, skin, len(points))
        normals = read_normals(UsdGeom.PointBased(prim), elements, time, report)
        if normals is not None:
            return MeshSource(make_ribbons(controls, radii, normals, layout.curve, primvars, level, str(path)))
    shapes = Shapes(
        _KINDS[controls.shape[1]],
        points=controls.astype(np.float32),
        radii=radii.astype(np.float32),
        primvars=primvars,
        face_ids=layout.curve.astype(np.int32),
        is_closed=controls.shape[1] == 1,  # the segments of a curve overlap, so that none of them bounds a body
    )
    return MeshSource(shapes)


@dataclass(frozen=True, eq=False)
class _PosedNormals:
    """The elements of curves whose normals a skin turns as it turns the points that they stand at.

    What ``warp_rt.usd.primvars`` asks of ``Elements``.
    """

    layout: ShapeLayout
    skin: Skin
    point_count: int

    def element_counts(self, interpolation: str) -> tuple[int, ...]:
        return self.layout.element_counts(interpolation)

    def primvar(self, values: np.ndarray, indices: np.ndarray | None, interpolation: str) -> Primvar:
        rest = values if indices is None else values[indices]
        vertices = np.arange(self.point_count)
        if interpolation in ("varying", "faceVarying"):  # which are the same on curves
            vertices = self.layout.point_of_varying(len(rest))
        elif interpolation != "vertex":  # a value that several points share may be turned by other joints at each
            rest = rest[self.layout.curve_of_point(self.point_count) if interpolation == "uniform" else 0 * vertices]
            interpolation = "vertex"
        return self.layout.primvar(self.skin.normals(rest, vertices, self.point_count), None, interpolation)


def _lay_out(
    prim: Usd.Prim, rest: np.ndarray, points: np.ndarray, skin: Skin | None, time: Usd.TimeCode, report: Report
) -> tuple[ShapeLayout, np.ndarray]:
    """Return the layout of a prim's shapes, and the values that its control points are sums of: [n, 3]."""
    kind = get_type_name(prim)
    if kind == "Points":
        return lay_out_points(len(points)), points
    lengths = integers(UsdGeom.Curves(prim).GetCurveVertexCountsAttr().Get(time))
    lengths = np.zeros(0, np.int64) if lengths is None else np.maximum(lengths, 0)
    if lengths.sum() != len(points):
        message = f"curveVertexCounts sum to {lengths.sum()}, there are {len(points)} points"
        report.warn(BAD_CURVES, prim.GetPath(), message)
        lengths = lengths[np.cumsum(lengths) <= len(points)]
    if kind == "BasisCurves":
        return lay_out_basis_curves(prim, lengths, len(points), time, report), points
    if kind == "NurbsCurves":
        return lay_out_nurbs_curves(prim, lengths, points, time, report), points
    if (lengths < 2).any():
        report.warn(
            BAD_CURVES, prim.GetPath(), f"{counted((lengths < 2).sum(), 'curve')} left out: fewer than two points"
        )
    tangents = vector_rows(UsdGeom.HermiteCurves(prim).GetTangentsAttr().Get(time), 3)
    if tangents is None or len(tangents) != len(points):
        message = f"tangents are not one for each of {len(points)} points: drawn as straight lines between them"
        report.warn(BAD_CURVES, prim.GetPath(), message)
        return lay_out_polylines(lengths, len(points)), points
    if skin is not None:
        # What moves a point by an affine map turns its tangent by that map's linear part.
        ends, _ = pose(rest + tangents, skin, prim, report)
        tangents = ends - points
    return lay_out_hermite_curves(lengths, len(points)), np.concatenate([points, tangents])


def _has_normals(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals")
    normals = primvar.Get(time) if primvar and primvar.HasAuthoredValue() else None
    if normals is None:
        normals = UsdGeom.PointBased(prim).GetNormalsAttr().Get(time)
    return normals is not None and np.size(normals) > 0


def _radii(
    prim: Usd.Prim,
    layout: ShapeLayout,
    shape: tuple[int, int],
    inherited: float | None,
    time: Usd.TimeCode,
    report: Report,
) -> np.ndarray:
    """Return half the widths at the control points of each shape: float64, ``shape`` [n, k]."""
    schema = UsdGeom.Points(prim) if get_type_name(prim) == "Points" else UsdGeom.Curves(prim)
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("widths")
    widths = None
    if primvar and primvar.HasAuthoredValue():
        values = float_rows(primvar.Get(time))
        widths = read_primvar(primvar, layout, time, report)
    else:
        values = float_rows(schema.GetWidthsAttr().Get(time))
        if values is not None and len(values):
            interpolation = str(schema.GetWidthsInterpolation())
            if len(values) == 1 and layout.element_counts(interpolation) != (1,):
                interpolation = "constant"  # a single width is all that many files have, whatever they call it
            widths = lay_out(values, None, interpolation, layout, str(prim.GetPath()), "widths", report)
        elif inherited is not None:
            widths = Primvar(np.array([[inherited]], np.float32), None)
    if widths is None:
        report.warn(
            NO_WIDTHS,
            prim.GetPath(),
            f"no widths: {_DEFAULT_WIDTH:g} unit thick in their own space; widths would be their diameters",
        )
        return np.full(shape, _DEFAULT_WIDTH / 2)
    # Splines may run below 0 between widths that are not: nothing is there, and nothing is wrong.
    is_negative = np.zeros(0, bool) if values is None else values[:, 0] < 0
    if is_negative.any():
        report.warn(BAD_CURVES, prim.GetPath(), f"{counted(is_negative.sum(), 'width')} below 0: counted as 0")
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
