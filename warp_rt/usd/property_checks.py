# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What properties say in vain: connections, samples where none are looked at, being what the schema's are not.

To ask takes as long as to read the prim. Stages with more prims than are asked are not written by hand, and programs do
the same on all.
"""

from __future__ import annotations

import re

from pxr import Sdf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.lights import is_light
from warp_rt.usd.materials import DANGLING_BINDING
from warp_rt.usd.primvars import CONNECTED_PRIMVAR
from warp_rt.usd.schemas import PrimType
from warp_rt.usd.unknown_names import UnknownNameReporter

WRONG_KIND = "W513"
IDLE_SAMPLES = "N944"

ASKED_FOR_PROPERTIES = 1000
"""Prims whose properties are looked through."""

_SETTINGS = (
    "RenderSettings",
    "RenderProduct",
    "RenderVar",
    "RenderPass",
)  # whose attributes for relationships are W523's
# Whose connections are followed, or told where they are read.
_PORT = re.compile("inputs:|outputs:|info:|primvars:")
# What USD itself asks for at no time, where samples are not looked at.
_ASKED_WITHOUT_TIME = re.compile(
    "xformOpOrder$|collection:|info:|colorSpace:name$|skel:joints$|primvars:skel:skinningMethod$"
)
# What metadata say something of: interpolation, elementSize, colorSpace, bindMaterialAs.
_WITH_METADATA = re.compile("primvars:|inputs:|normals$|widths$|material:binding")
# What is of one kind, whether the prim's schemas hold it or not.
_BINDING = re.compile("material:binding")
_ALWAYS_ATTRIBUTE = re.compile("primvars:|xformOp|inputs:")
_STRENGTHS = (UsdShade.Tokens.weakerThanDescendants, UsdShade.Tokens.strongerThanDescendants)
_ATTRIBUTE, _RELATIONSHIP = "an attribute", "a relationship"


def report_properties(prim: Usd.Prim, prim_type: PrimType, unknown: UnknownNameReporter, report: Report) -> None:
    """Report what a prim's properties say in vain.

    Args:
        prim: The prim.
        prim_type: Its type.
        unknown: Takes their metadata.
        report: Takes the diagnostics.
    """
    is_setting = prim_type.name in _SETTINGS
    for item in prim.GetAuthoredProperties():
        name = item.GetName()
        if _WITH_METADATA.match(name):
            unknown.add_metadata(item)
        is_port = bool(_PORT.match(name))
        if isinstance(item, Usd.Relationship) and _BINDING.match(name):
            _report_strength(item, report)
        if (kind := _wrong_kind(item)) and not (is_setting and kind == _RELATIONSHIP):
            is_a = _ATTRIBUTE if kind == _RELATIONSHIP else _RELATIONSHIP
            report.warn(WRONG_KIND, item.GetPath(), f"it is {is_a}, but USD has {kind} of this name; ignored")
        elif isinstance(item, Usd.Attribute):
            if _ASKED_WITHOUT_TIME.match(name) and _has_samples_alone(item):
                message = "it has time samples alone, but USD asks for its value at no time: they do not count"
                report.warn(IDLE_SAMPLES, item.GetPath(), message)
            if (is_setting or prim_type.is_imageable) and not is_port and item.HasAuthoredConnections():
                what = "its own value counts" if item.HasAuthoredValue() else "it has no value of its own"
                message = f"connections are followed from shaders and materials, not from a {prim_type.name}; {what}"
                report.warn(CONNECTED_PRIMVAR, item.GetPath(), message)


def _report_strength(binding: Usd.Relationship, report: Report) -> None:
    strength = binding.GetMetadata("bindMaterialAs")
    if strength is not None and strength not in _STRENGTHS:
        message = f"bindMaterialAs is {shown(strength)}, none of {', '.join(_STRENGTHS)}; {_STRENGTHS[0]} is taken"
        report.warn(DANGLING_BINDING, binding.GetPath(), message)


def _wrong_kind(item: Usd.Property) -> str:
    """Return what USD's schema has a property for that is something else; empty: it is what it has to be."""
    if isinstance(item, Usd.Relationship):
        if _ALWAYS_ATTRIBUTE.match(item.GetName()) and not is_light(item.GetPrim()):  # whose inputs are N934's
            return _ATTRIBUTE
        is_wrong = not item.HasAuthoredTargets() and _is_declared_as(item, Sdf.AttributeSpec)
        return _RELATIONSHIP if is_wrong else ""
    if _BINDING.match(item.GetName()):
        return _RELATIONSHIP
    is_wrong = not item.HasAuthoredValue() and _is_declared_as(item, Sdf.RelationshipSpec)
    return _ATTRIBUTE if is_wrong and not item.GetName().startswith("outputs:") else ""


def _is_declared_as(item: Usd.Property, kind: type[Sdf.PropertySpec]) -> bool:
    return any(isinstance(spec, kind) for spec in item.GetPropertyStack())


def _has_samples_alone(attribute: Usd.Attribute) -> bool:
    is_default = attribute.GetResolveInfo(Usd.TimeCode.Default()).GetSource() == Usd.ResolveInfoSourceDefault
    return not is_default and attribute.GetNumTimeSamples() > 0
