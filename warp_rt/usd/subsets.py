# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""GeomSubsets that give faces a material of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report, counted
from warp_rt.usd.arrays import integers
from warp_rt.usd.bindings import BINDING_PURPOSES, purpose_of
from warp_rt.usd.questions import get_type_name

_ALL = Usd.TraverseInstanceProxies()

OWNERS = ("Mesh", "TetMesh", "NurbsPatch")
"""Types whose subsets may have a material of their own."""

OVERLAP = "W110"
BAD_FACE = "W111"


def report_misplaced(prim: Usd.Prim, bindings: Sequence[str], report: Report) -> None:
    """Report a GeomSubset that nobody asks for its material: see ``Authored.bindings``."""
    parent = prim.GetParent()
    is_drawn = any(purpose_of(name) in BINDING_PURPOSES for name in bindings)  # what physics binds is not
    if is_drawn and get_type_name(parent) not in OWNERS:
        what = f"the {get_type_name(parent)} above" if get_type_name(parent) else "what is above"
        report.warn(BAD_FACE, prim.GetPath(), f"its material left out: {what} has no subsets with materials")


@dataclass(frozen=True, eq=False)
class FaceGroups:
    """Elements that faces belong to, and that subsets may name instead of faces."""

    element_type: str
    """GeomSubset's token for them."""
    plural: str
    """What diagnostics call them."""
    count: int
    of_face: np.ndarray
    """int64, shape [face_count], element of each face; -1: none."""


def read_face_slots(
    prim: Usd.Prim, face_count: int, time: Usd.TimeCode, report: Report, groups: FaceGroups | None = None
) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Return the material slot of each face and the names of the subsets that the slots from 1 on stand for.

    Subsets of the family ``materialBind`` count. Of several that claim a face, the first in namespace order has it;
    faces of none stay in slot 0, which is the mesh's own binding.

    Args:
        prim: The mesh.
        face_count: Of the mesh.
        time: When the subsets' attributes are read.
        report: Takes the diagnostics.
        groups: What the mesh consists of besides faces.

    Returns:
        int32, shape [face_count], None where there are no such subsets; names of child prims.
    """
    children = prim.GetFilteredChildren(_ALL)
    if not children:
        return None, ()
    slots = np.zeros(face_count, np.int32)
    names: list[str] = []
    for child in children:
        if not child.IsA(UsdGeom.Subset):
            continue
        subset = UsdGeom.Subset(child)
        if subset.GetFamilyNameAttr().Get(time) != "materialBind":
            if _binds_material(child):
                report.warn(BAD_FACE, child.GetPath(), "its material left out: it is not of the family materialBind")
            continue
        kind = subset.GetElementTypeAttr().Get(time)
        if kind == "face":
            count, plural, of_face = face_count, "faces", np.arange(face_count)
        elif groups is not None and kind == groups.element_type:
            count, plural, of_face = groups.count, groups.plural, groups.of_face
        else:
            known = " and ".join(["faces", *([groups.plural] if groups else [])])
            report.warn(BAD_FACE, child.GetPath(), f"subset left out: only subsets of {known} take materials")
            continue
        value = subset.GetIndicesAttr().Get(time)
        elements = integers(value)
        if elements is None and value is not None:
            report.warn(BAD_FACE, child.GetPath(), f"subset left out: its indices hold a {type(value).__name__}")
        elements = np.zeros(0, np.int64) if elements is None else np.unique(elements)
        is_inside = (elements >= 0) & (elements < count)
        if not is_inside.all():
            report.warn(BAD_FACE, child.GetPath(), f"{(~is_inside).sum()} indices name no {plural} of the mesh")
        is_named = np.zeros(count + 1, bool)  # the last stands for -1
        is_named[elements[is_inside]] = True
        faces = np.flatnonzero(is_named[of_face])
        free = faces[slots[faces] == 0]
        if len(free) < len(faces):
            report.warn(
                OVERLAP, child.GetPath(), f"{counted(len(faces) - len(free), 'face')} of an earlier subset already"
            )
        names.append(child.GetName())
        slots[free] = len(names)
    return (slots, tuple(names)) if names else (None, ())


def _binds_material(subset: Usd.Prim) -> bool:
    """Return whether a subset binds a material that would be drawn."""
    names = [name for name in subset.GetAuthoredPropertyNames() if name.startswith("material:binding")]
    bindings = [subset.GetRelationship(name) for name in names if purpose_of(name) in BINDING_PURPOSES]
    return any(binding and binding.HasAuthoredTargets() for binding in bindings)
