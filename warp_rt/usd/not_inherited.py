# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Normals and widths above geometry that pictures do not show, though USD hands them down as any primvar."""

from __future__ import annotations

from collections.abc import Iterable

from pxr import Sdf, Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.usd.curves import TYPES as CURVES
from warp_rt.usd.mesh import SUBDIVISION_SCHEMES
from warp_rt.usd.questions import get_type_name

NOT_HANDED_DOWN = "W119"

_EARLIEST = Usd.TimeCode.EarliestTime()
_TAKERS = ("Mesh", "NurbsPatch", "BasisCurves", "NurbsCurves", "HermiteCurves")


def report_not_inherited(prim: Usd.Prim, report: Report) -> None:
    """Report geometry that has a constant ``primvars:normals`` of a prim above it for its own.

    Reference: UsdGeomPrimvarsAPI, "Primvar Inheritance".
    """
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals")
    if not primvar.HasAuthoredValue() or primvar.GetInterpolation() != UsdGeom.Tokens.constant:
        return
    heirs = [
        below
        for below in Usd.PrimRange(prim, Usd.TraverseInstanceProxies())
        if below != prim and _takes(below) and _source(below) == prim
    ]
    _report_heirs(prim, "constant primvars:normals", heirs, report)


def report_widths_by_instance(instancer: Usd.Prim, prototypes: Iterable[Sdf.Path], report: Report) -> None:
    """Report curves and points in prototypes whose copies would each have a width of its own from their PointInstancer.

    Copies share their geometry. Reference: UsdGeomPointInstancer, "Primvars on PointInstancer".
    """
    roots = [instancer.GetStage().GetPrimAtPath(path) for path in prototypes]
    heirs = [
        below
        for root in filter(None, roots)
        for below in Usd.PrimRange(root, Usd.TraverseInstanceProxies())
        if get_type_name(below) in CURVES and not _has_width(below)
    ]
    _report_heirs(instancer, "primvars:widths, one for each instance,", heirs, report)


def _report_heirs(prim: Usd.Prim, what: str, heirs: list[Usd.Prim], report: Report) -> None:
    if heirs:
        more = f" and {len(heirs) - 1} more" if len(heirs) > 1 else ""
        message = f"its {what} do not count for {heirs[0].GetPath()}{more}, which would inherit them"
        report.warn(NOT_HANDED_DOWN, prim.GetPath(), message)


def _has_width(prim: Usd.Prim) -> bool:
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("widths")
    return prim.GetAttribute("widths").HasAuthoredValue() or (bool(primvar) and primvar.HasAuthoredValue())


def _takes(prim: Usd.Prim) -> bool:
    """Return whether a prim is of a kind whose normals count, and has none of its own."""
    if get_type_name(prim) not in _TAKERS or prim.GetAttribute("normals").HasAuthoredValue():
        return False
    is_mesh = prim.IsA(UsdGeom.Mesh)
    return not is_mesh or UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr().Get(_EARLIEST) not in SUBDIVISION_SCHEMES


def _source(prim: Usd.Prim) -> Usd.Prim:
    return UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("normals").GetAttr().GetPrim()
