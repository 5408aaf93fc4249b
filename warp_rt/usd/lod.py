# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Levels of detail: which children of an LOD root are drawn.

Heuristics choose by the place of the eye, for which a ray tracer has no one answer: mirrors see a model from elsewhere.
They are not asked, so that the level of ``lod:default:index`` is drawn where no override names another.

Reference: UsdLod schema documentation, "LOD Evaluation".
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from pxr import Usd

from warp_rt.report import Report
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.mesh import INVALID_VALUE

Override = tuple[str, float]
"""What an LODOverrideAPI says: the mode, and the index of mode ``indexedLOD``."""

NO_OVERRIDE: Override = ("noOverride", 0.0)
UNASKED_HEURISTICS = "W133"

_MODES = ("inherited", "noOverride", "indexedLOD", "noLOD", "allLOD")
_DOMAIN = "imaging"


def lod_override(prim: Usd.Prim, above: Override, time: Usd.TimeCode, report: Report) -> Override:
    """Return the override that holds below a prim with LODOverrideAPI, given the one that holds above."""
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    mode = attributes.token("lod:override:mode", "inherited", _MODES)
    if mode == "inherited":
        return above
    return mode, attributes.number("lod:override:index", 0.0) if mode == "indexedLOD" else 0.0


def drawn_items(
    prim: Usd.Prim, items: Sequence[Usd.Prim], override: Override, time: Usd.TimeCode, report: Report
) -> frozenset[str]:
    """Return the names of the children of an LOD root that are drawn.

    Args:
        prim: The root, of LODRootAPI.
        items: Its children, those that are not loaded left out.
        override: That holds for it.
        time: When attributes are read.
        report: Takes the diagnostics.
    """
    mode, index = override
    names = [item.GetName() for item in items]
    if mode == "allLOD":
        return frozenset(names)
    if mode == "noLOD" or not names:
        return frozenset()
    if mode == "noOverride":
        attributes = AttributeReader(prim, time, INVALID_VALUE, report)
        index = attributes.number("lod:default:index", 0.0)
    chosen = min(max(math.floor(index + 0.5), 0), len(names) - 1)
    if mode == "noOverride" and _has_heuristics(prim, time):
        message = f"lod:heuristics are not asked: level {chosen}, {names[chosen]}, is drawn"
        report.warn(UNASKED_HEURISTICS, prim.GetPath(), message)
    return frozenset(names[chosen : chosen + 1])


def _has_heuristics(prim: Usd.Prim, time: Usd.TimeCode) -> bool:
    """Return whether a root names a heuristic that is meant for pictures."""
    targets = prim.GetRelationship("lod:heuristics").GetForwardedTargets()
    domains = (prim.GetStage().GetAttributeAtPath(target.AppendProperty("lod:domain")) for target in targets)
    return any(domain and domain.Get(time) == _DOMAIN for domain in domains)
