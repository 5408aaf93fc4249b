# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Constant normals above geometry, which USD hands down as any constant primvar and pictures do not show."""

from __future__ import annotations

from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.usd.mesh import SUBDIVISION_SCHEMES
from warp_rt.usd.questions import get_type_name

NOT_HANDED_DOWN = "W119"

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
    if heirs:
        more = f" and {len(heirs) - 1} more" if len(heirs) > 1 else ""
        message = f"its constant primvars:normals do not count for {heirs[0].GetPath()}{more}, which would inherit them"
        report.warn(NOT_HANDED_DOWN, prim.GetPath(), message)


def _takes(prim: Usd.Prim) -> bool:
    """Return whether a prim is of a kind whose normals count, and has none of its own."""
    if get_type_name(prim) not in _TAKERS or prim.GetAttribute("normals").HasAuthoredValue():
        return False
    is_mesh = prim.IsA(UsdGeom.Mesh)
    return not is_mesh or UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr().Get() not in SUBDIVISION_SCHEMES


def _source(prim: Usd.Prim) -> Usd.Prim:
    return UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("normals").GetAttr().GetPrim()
