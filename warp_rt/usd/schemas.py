# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a prim's type takes part in, and what applied schemas say of it: labels, and what does not count."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass

from pxr import Usd, UsdGeom, UsdSemantics, Vt

from warp_rt.report import Report
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.color_spaces import UNKNOWN_COLOR_SPACE
from warp_rt.usd.lights import is_light
from warp_rt.usd.mesh import INVALID_VALUE
from warp_rt.usd.questions import get_authored_type_name, get_type_info, get_type_name

MOTION_SCALE = "W423"
IDLE_ATTRIBUTE = "N924"

_LABELS = "SemanticsLabelsAPI:"
_HEEDED = ("MotionAPI", "VisibilityAPI", "LODOverrideAPI", "LODRootAPI", "ColorSpaceAPI")
_OF_IMAGEABLES = ("visibility", "purpose", "guideVisibility", "proxyVisibility", "renderVisibility")
_OF_XFORMABLES = ("xformOpOrder",)
_OF_GEOMETRY = ("points",)  # told of prims without a type, whose author may have forgotten it
FOREIGN = frozenset((*_OF_XFORMABLES, *_OF_IMAGEABLES, *_OF_GEOMETRY))
"""Attributes that other prims than Xformables may have in vain."""
_SAY_NOTHING = ("inherited", "default")


@dataclass(frozen=True, slots=True, eq=False)
class PrimType:
    """What prims of a type, with the schemas that are applied to them, take part in."""

    info: Usd.PrimTypeInfo
    name: str
    """As ``get_type_name`` has it."""
    schemas: tuple[str, ...]
    """Those that the walk heeds, of the applied ones and those that belong to the type."""
    is_imageable: bool
    is_xformable: bool
    is_boundable: bool
    is_known: bool
    is_light: bool


class TypeReader:
    """Tells the types of prims; those of one type, with the same schemas, are asked once and share one record."""

    def __init__(self) -> None:
        self._latest: dict[str, PrimType] = {}
        self._known: dict[tuple[str, ...], PrimType] = {}

    def read(self, prim: Usd.Prim) -> PrimType:
        """Return the type of a prim."""
        info, name = get_type_info(prim), get_authored_type_name(prim)
        latest = self._latest.get(name)
        if latest is not None and latest.info == info:
            return latest
        key = (name, *info.GetAppliedAPISchemas())
        known = self._known.get(key)
        if known is None or known.info != info:
            known = self._known[key] = _prim_type(prim, info)
        self._latest[name] = known
        return known


def _prim_type(prim: Usd.Prim, info: Usd.PrimTypeInfo) -> PrimType:
    name = get_type_name(prim)
    return PrimType(
        info,
        name,
        tuple(filter(_is_heeded, prim.GetAppliedSchemas())),
        is_imageable=prim.IsA(UsdGeom.Imageable),
        is_xformable=prim.IsA(UsdGeom.Xformable),
        is_boundable=prim.IsA(UsdGeom.Boundable),
        is_known=not name or not info.GetSchemaType().isUnknown,
        is_light=is_light(prim),
    )


def _is_heeded(schema: str) -> bool:
    return schema in _HEEDED or schema.startswith(_LABELS)


def report_meaningless(
    prim: Usd.Prim, prim_type: PrimType, names: Set[str], time: Usd.TimeCode, report: Report
) -> None:
    """Note where a prim that is no Xformable is to be moved, one that is no Imageable hidden, one of no type drawn.

    Args:
        prim: No Xformable.
        prim_type: Its type.
        names: What it authors.
        time: When that is read.
        report: Takes the note.
    """
    foreign = _OF_XFORMABLES if prim_type.is_imageable else (*_OF_XFORMABLES, *_OF_IMAGEABLES)
    if not prim_type.name:
        foreign = (*foreign, *_OF_GEOMETRY)
    values = {name: prim.GetAttribute(name).Get(time) for name in foreign if name in names}
    idle = [name for name, value in values.items() if value and not (isinstance(value, str) and value in _SAY_NOTHING)]
    if idle:
        kind = f"a {prim_type.name}" if prim_type.name else "a prim without a type"
        report.warn(IDLE_ATTRIBUTE, prim.GetPath(), f"{', '.join(idle)} on {kind}: without effect, by USD's rules")


def report_ignored(prim: Usd.Prim, schemas: Sequence[str], report: Report) -> None:
    """Report the applied schemas that do not count."""
    if "MotionAPI" in schemas:
        _report_motion_scales(prim, report)
    if "ColorSpaceAPI" in schemas:
        name = prim.GetAttribute("colorSpace:name").Get()
        if name is not None and not isinstance(name, str):
            report.warn(UNKNOWN_COLOR_SPACE, prim.GetPath(), f"colorSpace:name is {shown(name)}, no token; ignored")


def _report_motion_scales(prim: Usd.Prim, report: Report) -> None:
    for name in ("motion:blurScale", "motion:velocityScale"):
        attribute = prim.GetAttribute(name)
        scale = attribute.Get(Usd.TimeCode.EarliestTime())
        if attribute.HasAuthoredValue() and scale != 1:
            report.warn(MOTION_SCALE, prim.GetPath(), f"{name} = {scale} is ignored: blurred as it moves")


def read_labels(
    prim: Usd.Prim, schemas: Sequence[str], time: Usd.TimeCode, report: Report
) -> dict[str, tuple[str, ...]]:
    """Return the semantic labels of a prim, by taxonomy."""
    found: dict[str, tuple[str, ...]] = {}
    if not any(schema.startswith(_LABELS) for schema in schemas):
        return found
    for taxonomy in UsdSemantics.LabelsAPI.GetDirectTaxonomies(prim):
        labels = UsdSemantics.LabelsAPI(prim, taxonomy).GetLabelsAttr().Get(time)
        if not isinstance(labels, Vt.TokenArray | Vt.StringArray | None):
            message = f"semantics:labels:{taxonomy} is {shown(labels)}, no array of tokens; ignored"
            report.warn(INVALID_VALUE, prim.GetPath(), message)
        elif labels:
            found[str(taxonomy)] = tuple(str(label) for label in labels)
    return found
