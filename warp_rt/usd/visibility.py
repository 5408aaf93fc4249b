# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Visibility: of prims, and of purposes within them.

Reference: UsdGeomImageable, ComputeEffectiveVisibility. There guides are invisible unless something says otherwise;
here that is said by asking for the purpose ``guide``.
"""

from __future__ import annotations

from pxr import Usd

from warp_rt.report import Report
from warp_rt.usd.attribute_values import AttributeReader, shown
from warp_rt.usd.mesh import INVALID_VALUE

_PURPOSES = ("guide", "proxy", "render")  # that have a visibility of their own
_VALUES = ("inherited", "visible", "invisible")


def is_invisible(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> bool:
    """Return whether an imageable prim says that it is not seen, with all below it."""
    visibility = prim.GetAttribute("visibility").Get(time)
    if visibility not in ("invisible", "inherited", None):
        message = f"visibility is {shown(visibility)}, neither inherited nor invisible: drawn"
        report.warn(INVALID_VALUE, prim.GetPath(), message)
    return bool(visibility == "invisible")


def hidden_purposes(prim: Usd.Prim, above: frozenset[str], time: Usd.TimeCode, report: Report) -> frozenset[str]:
    """Return the purposes that are not seen at and below a prim with VisibilityAPI, given those above it.

    The nearest value that is authored holds; ``inherited`` is one, and means that of ``visibility``.
    """
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    hidden = set(above)
    for purpose in _PURPOSES:
        name = f"{purpose}Visibility"
        if not prim.GetAttribute(name).HasAuthoredValue():
            continue
        if attributes.token(name, "inherited", _VALUES) == "invisible":
            hidden.add(purpose)
        else:
            hidden.discard(purpose)
    return frozenset(hidden)
