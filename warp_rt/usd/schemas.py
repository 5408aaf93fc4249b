# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a prim's type takes part in, and what applied schemas say of it: labels, and what does not count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pxr import Usd, UsdGeom, UsdSemantics

from warp_rt.report import Report

MOTION_SCALE = "W423"

_LABELS = "SemanticsLabelsAPI:"


@dataclass(frozen=True)
class TypeTraits:
    """What a prim type takes part in."""

    is_imageable: bool
    is_xformable: bool
    is_boundable: bool
    is_known: bool


def read_traits(prim: Usd.Prim) -> TypeTraits:
    """Return what the type of a prim takes part in."""
    return TypeTraits(
        is_imageable=prim.IsA(UsdGeom.Imageable),
        is_xformable=prim.IsA(UsdGeom.Xformable),
        is_boundable=prim.IsA(UsdGeom.Boundable),
        is_known=not prim.GetTypeName() or not prim.GetPrimTypeInfo().GetSchemaType().isUnknown,
    )


def report_ignored(prim: Usd.Prim, schemas: Sequence[str], report: Report) -> None:
    """Report the applied schemas that do not count."""
    if "MotionAPI" in schemas:
        _report_motion_scales(prim, report)


def _report_motion_scales(prim: Usd.Prim, report: Report) -> None:
    for name in ("motion:blurScale", "motion:velocityScale"):
        attribute = prim.GetAttribute(name)
        scale = attribute.Get(Usd.TimeCode.EarliestTime())
        if attribute.HasAuthoredValue() and scale != 1:
            report.warn(MOTION_SCALE, prim.GetPath(), f"{name} = {scale} is ignored: blurred as it moves")


def read_labels(prim: Usd.Prim, schemas: Sequence[str], time: Usd.TimeCode) -> dict[str, tuple[str, ...]]:
    """Return the semantic labels of a prim, by taxonomy."""
    found: dict[str, tuple[str, ...]] = {}
    if not any(schema.startswith(_LABELS) for schema in schemas):
        return found
    for taxonomy in UsdSemantics.LabelsAPI.GetDirectTaxonomies(prim):
        labels = UsdSemantics.LabelsAPI(prim, taxonomy).GetLabelsAttr().Get(time)
        if labels:
            found[str(taxonomy)] = tuple(str(label) for label in labels)
    return found
