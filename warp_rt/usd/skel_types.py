# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Attributes of UsdSkel that hold another type than the schema's: USD's queries pass over them without a word."""

from __future__ import annotations

import functools

from pxr import Usd

from warp_rt.report import Report
from warp_rt.usd.attribute_values import shown

_BINDING = "SkelBindingAPI"
_NOT_OF_POSES = frozenset(("extent", "jointNames", "purpose", "visibility", "xformOpOrder"))


def report_wrong_types(prim: Usd.Prim, schema: str, time: Usd.TimeCode, code: str, report: Report) -> None:
    """Report the attributes of a prim that do not hold what a schema of UsdSkel says.

    Args:
        prim: A Skeleton, SkelAnimation or BlendShape, or what a skeleton deforms.
        schema: ``Skeleton``, ``SkelAnimation``, ``BlendShape`` or ``SkelBindingAPI``.
        time: When they are read.
        code: Of the diagnostics.
        report: Takes them.
    """
    for name, expected in _types(schema).items():
        attribute = prim.GetAttribute(name)
        value = attribute.Get(time) if attribute else None
        if value is not None and not isinstance(value, expected):
            message = f"{name} is {shown(value)}, not a {expected.__name__}: read as if it was not there"
            report.warn(code, prim.GetPath(), message)


@functools.cache
def _types(schema: str) -> dict[str, type]:
    """Return what the attributes of a schema that say something of poses hold, by name."""
    registry = Usd.SchemaRegistry()
    find = registry.FindAppliedAPIPrimDefinition if schema == _BINDING else registry.FindConcretePrimDefinition
    attributes = map(find(schema).GetAttributeDefinition, find(schema).GetPropertyNames())
    return {
        attribute.GetName(): type(attribute.GetTypeName().defaultValue)
        for attribute in attributes
        if attribute and attribute.GetName() not in _NOT_OF_POSES
    }
