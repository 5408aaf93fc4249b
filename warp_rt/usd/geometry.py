# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The geometry of a prim, whatever its type."""

from __future__ import annotations

from pxr import Usd

from warp_rt.report import Report
from warp_rt.usd import curves
from warp_rt.usd.mesh import MeshSource, read_mesh
from warp_rt.usd.nurbs_patch import read_nurbs_patch
from warp_rt.usd.skinning import Skin
from warp_rt.usd.tet_mesh import read_tet_mesh

TYPES = frozenset(("Mesh", "TetMesh", "NurbsPatch", *curves.TYPES))
"""Types that :func:`read_geometry` reads; those of ``implicit`` share unit shapes instead."""


def read_geometry(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    report: Report,
    *,
    skin: Skin | None = None,
    level: int = 0,
    carried_to: Usd.TimeCode | None = None,
) -> MeshSource | None:
    """Return the geometry of a prim of one of ``TYPES``; None, with a diagnostic, where there is nothing to draw.

    Args:
        prim: The prim.
        time: When its attributes are read.
        report: Takes the diagnostics.
        skin: Deforms it.
        level: Refinements of a smooth surface.
        carried_to: When its velocities have carried its points from their sample; None: they do not.

    Raises:
        LimitError: It would have more faces than can be meant.
    """
    kind = prim.GetTypeName()
    if kind in curves.TYPES:
        return curves.read_shapes(prim, time, report, skin, carried_to)
    if kind == "TetMesh":
        return read_tet_mesh(prim, time, report, skin, carried_to)
    if kind == "NurbsPatch":
        return read_nurbs_patch(prim, time, report, skin=skin, level=level, carried_to=carried_to)
    return read_mesh(prim, time, report, skin=skin, level=level, carried_to=carried_to)
