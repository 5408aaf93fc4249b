# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""GeomSubsets that give faces a material of their own."""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.usd.arrays import integers

OVERLAP = "W110"
BAD_FACE = "W111"


def read_face_slots(
    prim: Usd.Prim, face_count: int, time: Usd.TimeCode, report: Report
) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Return the material slot of each face and the names of the subsets that the slots from 1 on stand for.

    Subsets of the family ``materialBind`` count. Of several that claim a face, the first in namespace order has it;
    faces of none stay in slot 0, which is the mesh's own binding.

    Returns:
        int32, shape [face_count], None where there are no such subsets; names of child prims.
    """
    slots = np.zeros(face_count, np.int32)
    names: list[str] = []
    for child in prim.GetFilteredChildren(Usd.TraverseInstanceProxies()):
        if not child.IsA(UsdGeom.Subset):
            continue
        subset = UsdGeom.Subset(child)
        if subset.GetFamilyNameAttr().Get(time) != "materialBind":
            if child.GetRelationship("material:binding").HasAuthoredTargets():
                report.warn(BAD_FACE, child.GetPath(), "its material left out: it is not of the family materialBind")
            continue
        if subset.GetElementTypeAttr().Get(time) != "face":
            report.warn(BAD_FACE, child.GetPath(), "subset left out: only subsets of faces take materials")
            continue
        value = subset.GetIndicesAttr().Get(time)
        faces = integers(value)
        if faces is None and value is not None:
            report.warn(BAD_FACE, child.GetPath(), f"subset left out: its indices hold a {type(value).__name__}")
        faces = np.zeros(0, np.int64) if faces is None else np.unique(faces)
        inside = faces[(faces >= 0) & (faces < face_count)]
        if len(inside) < len(faces):
            report.warn(BAD_FACE, child.GetPath(), f"{len(faces) - len(inside)} indices name no face of the mesh")
        free = inside[slots[inside] == 0]
        if len(free) < len(inside):
            report.warn(
                OVERLAP, child.GetPath(), f"{len(inside) - len(free)} faces belong to an earlier subset already"
            )
        names.append(child.GetName())
        slots[free] = len(names)
    return (slots, tuple(names)) if names else (None, ())
