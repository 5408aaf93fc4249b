# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What prims hand down to those below them in namespace."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.usd.authored import Authored
from warp_rt.usd.bindings import Bindings, extend_bindings
from warp_rt.usd.primvars import Values, inherited_constants

# Unloaded prims are met, for they are told; nothing of them is drawn.
SHOWN = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract)
# A prototype may be a class or stand below an over, neither of which is drawn by itself.
SHOWN_IN_PROTOTYPE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimHasDefiningSpecifier)


@dataclass(slots=True)
class Context:
    """What a prim has from those above it. It is never changed: most prims hand on what they were given."""

    matrix: np.ndarray
    """float64, shape [4, 4], group from parent."""
    world_from_group: np.ndarray
    """float64, shape [4, 4]; within a PointInstancer's prototype, the world is that prototype's space."""
    path_length: int
    """Length of the path that the group's names leave out."""
    tail_start: int
    """Length of the path of the innermost instance; 0: none, or a prototype that stands elsewhere."""
    predicate: object
    """Which children are visited."""
    purpose: str = ""
    """Purpose authored above; empty: none."""
    bindings: Bindings = ()
    """What relationships above bind materials and skeletons."""
    primvars: list[UsdGeom.Primvar] = field(default_factory=list)
    """Constant primvars authored above."""
    constants: Values = field(default_factory=dict)
    """Their values."""
    draw_mode: str = "default"
    """Of the model above."""
    card_visibility: str = "full"
    """Which of its cards are drawn."""
    has_clips: bool = False
    """Whether value clips may hold values of what nothing authors."""
    is_skinned: bool = False
    """Whether a SkelRoot is above."""

    def name(self, prim: Usd.Prim) -> str:
        """Return a prim's path as the group has it."""
        return str(prim.GetPath())[self.path_length :]


def hand_down(prim: Usd.Prim, here: Context, authored: Authored, time: Usd.TimeCode, report: Report) -> Context:
    """Return the context with the bindings and primvars that a prim hands on.

    Args:
        prim: The prim.
        here: All else that its children have from it.
        authored: What it authors.
        time: When primvars are read.
        report: Takes the diagnostics.
    """
    primvars = None
    if authored.primvars:
        primvars = UsdGeom.PrimvarsAPI(prim).FindIncrementallyInheritablePrimvars(here.primvars)
    bindings = extend_bindings(here.bindings, prim, authored.bindings)
    if not primvars:
        return here if bindings is here.bindings else replace(here, bindings=bindings)
    constants = inherited_constants(primvars, time, report)
    return replace(here, bindings=bindings, primvars=primvars, constants=constants)
