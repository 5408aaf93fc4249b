# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a light says and the picture lacks, told by diagnostics."""

from __future__ import annotations

from pxr import Usd

from warp_rt.report import Report
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.domes import DOMES
from warp_rt.usd.questions import get_type_name

IGNORED_FILTER = "W403"
OLD_ATTRIBUTE = "W407"
IGNORED_PORTALS = "W410"
CONNECTED_INPUT = "W416"
FOREIGN_LIGHT = "W419"
NO_SHAPING = "N919"
INPUTS_WITHOUT_EFFECT = "N934"

_PREFIX = "inputs:"
# What lights of any type had before USD 21, beside the properties of their own type.
_COMMON_APIS = ("LightAPI", "ShapingAPI", "ShadowAPI")
_COMMON_TYPE = "DomeLight"


def report_ignored(prim: Usd.Prim, attributes: AttributeReader, report: Report) -> None:
    """Report each feature that a light has and the picture lacks."""
    path = prim.GetPath()
    filters = prim.GetRelationship("light:filters")
    if filters and filters.GetTargets():
        report.warn(IGNORED_FILTER, path, "light filters are not supported; ignored")
    shader = attributes.token("light:shaderId", "")
    if shader and shader != prim.GetPrimDefinition().GetAttributeFallbackValue("light:shaderId"):
        report.warn(FOREIGN_LIGHT, path, f"the light shader {shader!r} is not supported; its type decides")
    portals = prim.GetRelationship("portals")
    if portals and portals.GetTargets():
        report.warn(IGNORED_PORTALS, path, "portals are not supported; the dome shines from everywhere")
    shaping = [item for item in prim.GetAuthoredPropertiesInNamespace("inputs:shaping") if _has_value(item)]
    if get_type_name(prim) in (*DOMES, "DistantLight") and shaping:
        names = ", ".join(str(attribute.GetName()) for attribute in shaping)
        report.warn(NO_SHAPING, path, f"{names}: light from infinitely far is not shaped")
    known = _input_names(prim)
    unknown = []
    for attribute in prim.GetAuthoredPropertiesInNamespace("inputs"):
        if attribute.GetName() not in known:
            unknown.append(str(attribute.GetName()))
        elif isinstance(attribute, Usd.Attribute) and attribute.HasAuthoredConnections():
            report.warn(
                CONNECTED_INPUT, attribute.GetPath(), "connections of lights are not followed; its value counts"
            )
    if unknown:
        names = ", ".join(sorted(unknown))
        report.warn(INPUTS_WITHOUT_EFFECT, path, f"a {get_type_name(prim)} has no {names}; ignored")
    if get_type_name(prim) in DOMES and attributes.truth("inputs:normalize", False):
        report.warn(INPUTS_WITHOUT_EFFECT, path, "inputs:normalize: a dome has no area to divide by; ignored")
    for name in sorted(old_names(prim.GetPrimDefinition())):
        attribute = prim.GetAttribute(name)
        if attribute and _has_value(attribute):
            report.warn(OLD_ATTRIBUTE, attribute.GetPath(), f"is ignored; today's schema calls it inputs:{name}")


def _has_value(item: Usd.Property) -> bool:
    return isinstance(item, Usd.Attribute) and (item.HasAuthoredValue() or item.HasAuthoredConnections())


def _input_names(prim: Usd.Prim) -> set[str]:
    """Return the names of the inputs that a light has, or would if the schemas that any light may have were applied."""
    registry = Usd.SchemaRegistry()
    definitions = [prim.GetPrimDefinition()]
    definitions += [registry.FindAppliedAPIPrimDefinition(name) for name in _COMMON_APIS]
    return {name for definition in definitions for name in definition.GetPropertyNames() if name.startswith(_PREFIX)}


def old_names(own: Usd.PrimDefinition) -> set[str]:
    """Return a light's names without the prefix ``inputs:``, of files older than USD 21, which schemas now ignore."""
    registry = Usd.SchemaRegistry()
    definitions = [own, registry.FindConcretePrimDefinition(_COMMON_TYPE)]
    definitions += [registry.FindAppliedAPIPrimDefinition(name) for name in _COMMON_APIS]
    names = {name for definition in definitions for name in definition.GetPropertyNames()}
    old = {name.removeprefix(_PREFIX) for name in names if name.startswith(_PREFIX)}
    return old - set(own.GetPropertyNames())
