# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What prims hand down to those below them in namespace."""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.options import COMPLEXITIES, refinement_level
from warp_rt.report import Report
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.authored import Authored
from warp_rt.usd.bindings import Bindings, extend_bindings
from warp_rt.usd.lod import NO_OVERRIDE, Override, drawn_items, lod_override
from warp_rt.usd.mesh import INVALID_VALUE
from warp_rt.usd.primvars import BLOCKED, Values, inherited_constants, report_connected_constants
from warp_rt.usd.questions import get_filtered_children
from warp_rt.usd.visibility import hidden_purposes

COMPLEXITY = "warp_rt:complexity"
WIDTHS = "primvars:widths"
_PURPOSES = ("default", "render", "proxy", "guide")

# Unloaded prims are met, for they are told; nothing of them is drawn.
SHOWN = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract)
# A prototype may be a class or stand below an over, neither of which is drawn by itself.
SHOWN_IN_PROTOTYPE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimHasDefiningSpecifier)
# What few prims are: a parent is asked once whether any child is, its children only if so.
_UNUSUAL = Usd.TraverseInstanceProxies(~Usd.PrimIsLoaded | Usd.PrimIsModel | Usd.PrimIsInstance)


def has_unusual_children(prim: Usd.Prim) -> bool:
    """Return whether a child of a prim, seen or not, is an instance, a model or not loaded."""
    return bool(get_filtered_children(prim, _UNUSUAL))


class Context(NamedTuple):
    """What a prim has from those above it."""

    world_from_group: np.ndarray
    """float64, shape [4, 4]; within a PointInstancer's prototype, the world is that prototype's space."""
    path_length: int
    """Length of the path that the group's names leave out."""
    tail_start: int
    """Length of the path of the innermost instance or prototype; 0: none, or a prototype that stands elsewhere."""
    predicate: object
    """Which children are visited."""
    purpose: str = ""
    """Purpose authored above; empty: none."""
    bindings: Bindings = ()
    """What relationships above bind materials and skeletons."""
    primvars: Sequence[UsdGeom.Primvar] = ()
    """Constant primvars authored above."""
    constants: Values = MappingProxyType({})
    """Their values; within an instance, ``BLOCKED`` where what is above it is hidden."""
    width: float | None = None
    """Of the constant ``primvars:widths`` above, through instances too; None: there are none."""
    draw_mode: str = "default"
    """Of the model above."""
    card_visibility: str = "full"
    """Which of its cards are drawn."""
    hidden_purposes: frozenset[str] = frozenset()
    """Purposes of which nothing is seen."""
    lod_override: Override = NO_OVERRIDE
    """What is said above of levels of detail."""
    lod_items: frozenset[str] | None = None
    """Names of the children that are drawn of an LOD root, whatever their visibility; None: the parent is no such."""
    has_clips: bool = False
    """Whether value clips may hold values of what nothing authors."""
    level: int | None = None
    """Refinements that prims above ask for; None: none does."""
    is_skinned: bool = False
    """Whether a SkelRoot is above."""
    is_proxy: bool = False
    """Whether the prims are instance proxies."""
    may_have_color_space: bool = False
    """Whether a ColorSpaceAPI is above."""

    def children(self, prim: Usd.Prim) -> Sequence[Usd.Prim]:
        """Return the children of the prim that hands this on that are visited."""
        children = get_filtered_children(prim, self.predicate)
        if self.lod_items is None:
            return children
        return [child for child in children if child.GetName() in self.lod_items]

    def name(self, prim: Usd.Prim) -> str:
        """Return a prim's path as the group has it."""
        return str(prim.GetPath())[self.path_length :]


def apply_schemas(prim: Usd.Prim, here: Context, schemas: Sequence[str], time: Usd.TimeCode, report: Report) -> Context:
    """Return the context with what a prim's applied schemas say of visibility, levels of detail and colour spaces."""
    if "VisibilityAPI" in schemas and prim.IsA(UsdGeom.Imageable):  # which alone it can be applied to
        here = here._replace(hidden_purposes=hidden_purposes(prim, here.hidden_purposes, time, report))
    if "LODOverrideAPI" in schemas:
        here = here._replace(lod_override=lod_override(prim, here.lod_override, time, report))
    if "LODRootAPI" in schemas:
        items = [child for child in prim.GetFilteredChildren(here.predicate) if child.IsLoaded()]
        here = here._replace(lod_items=drawn_items(prim, items, here.lod_override, time, report))
    if "ColorSpaceAPI" in schemas:
        here = here._replace(may_have_color_space=True)
    return here


def own_purpose(prim: Usd.Prim, above: str, time: Usd.TimeCode, report: Report) -> str:
    """Return the purpose of an imageable prim: its own where it is authored, else the one above."""
    if not prim.GetAttribute("purpose").HasAuthoredValue():
        return above
    return AttributeReader(prim, time, INVALID_VALUE, report).token("purpose", above, _PURPOSES)


def own_level(prim: Usd.Prim, above: int | None, time: Usd.TimeCode, report: Report) -> int | None:
    """Return the refinements that a prim with the attribute ``warp_rt:complexity`` asks for, for all below it too."""
    token = AttributeReader(prim, time, INVALID_VALUE, report).token(COMPLEXITY, "", ("", *COMPLEXITIES))
    return refinement_level(token) if token else above


def said_above(prim: Usd.Prim, context: Context, time: Usd.TimeCode, report: Report) -> Context:
    """Return the context with what the schemas on a prim and all above it say, its purpose, clips and complexity."""
    for path in prim.GetPath().GetPrefixes() if prim else ():
        above = prim.GetStage().GetPrimAtPath(path)
        if above.IsA(UsdGeom.Imageable):
            context = context._replace(purpose=own_purpose(above, context.purpose, time, report))
        schemas = [schema for schema in above.GetAppliedSchemas() if schema != "LODRootAPI"]
        context = apply_schemas(above, context, schemas, time, report)
        if above.HasAttribute(COMPLEXITY):
            context = context._replace(level=own_level(above, context.level, time, report))
        if above.HasAuthoredMetadata("clips"):
            context = context._replace(has_clips=True)
    return context


def hand_down(
    prim: Usd.Prim, here: Context, authored: Authored, has_heirs: bool, time: Usd.TimeCode, report: Report
) -> Context:
    """Return the context with the bindings and primvars that a prim hands on.

    Args:
        prim: The prim.
        here: All else that its children have from it.
        authored: What it authors.
        has_heirs: Whether there is anything below it.
        time: When primvars are read.
        report: Takes the diagnostics.
    """
    if authored.bindings:
        bindings = extend_bindings(here.bindings, prim, authored.bindings, has_heirs)
        if bindings is not here.bindings:
            here = here._replace(bindings=bindings)
    if authored.primvars and has_heirs:
        here = hand_down_primvars(prim, here, authored, time, report)
    return here


def hand_down_primvars(
    prim: Usd.Prim, here: Context, authored: Authored, time: Usd.TimeCode, report: Report
) -> Context:
    """Return the context with the primvars that a prim hands on; arguments as ``hand_down``."""
    report_connected_constants(prim, report)
    primvars = _inheritable(UsdGeom.PrimvarsAPI(prim), here.primvars)
    hidden = _hidden_names(prim, authored) if here.path_length else ()
    if primvars is not here.primvars or hidden:
        blocked = {name: value for name, value in here.constants.items() if value is BLOCKED}
        blocked |= dict.fromkeys(hidden, BLOCKED)
        constants = {**blocked, **inherited_constants(primvars, time, report)}
        here = here._replace(primvars=primvars, constants=constants)
    if WIDTHS in authored.names and UsdGeom.Primvar(prim.GetAttribute(WIDTHS)).HasAuthoredValue():
        here = here._replace(width=handed_width(here.constants))  # one that is not constant hides those above
    return here


def handed_width(constants: Values) -> float | None:
    """Return the width that curves and points take from the prims above them; None: there is none."""
    width = constants.get("widths", BLOCKED)
    return None if width is BLOCKED else float(width[0])


def _hidden_names(prim: Usd.Prim, authored: Authored) -> list[str]:
    """Return the names of the primvars that a prim has for its own elements, which hide those above from all below."""
    api = UsdGeom.PrimvarsAPI(prim)
    found = [api.GetPrimvar(name) for name in authored.primvars if not name.endswith(":indices")]
    return [
        primvar.GetPrimvarName()
        for primvar in found
        if primvar.GetInterpolation() != UsdGeom.Tokens.constant and primvar.HasAuthoredValue()
    ]


def _inheritable(own: UsdGeom.PrimvarsAPI, above: Sequence[UsdGeom.Primvar]) -> Sequence[UsdGeom.Primvar]:
    """Return the constant primvars that prims below inherit: those above themselves where a prim changes nothing."""
    primvars = own.FindIncrementallyInheritablePrimvars(list(above))
    # USD returns none both where nothing changes and where the prim's own, not constant, block all of those above.
    if primvars or any(own.GetPrimvar(primvar.GetPrimvarName()).HasAuthoredValue() for primvar in above):
        return primvars
    return above
