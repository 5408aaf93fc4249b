# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The geometry of prims, whatever their type."""

from __future__ import annotations

from collections.abc import Sequence

from pxr import Tf

from warp_rt.report import Report
from warp_rt.usd import curves
from warp_rt.usd.mesh import read_meshes
from warp_rt.usd.nurbs_patch import read_nurbs_patch
from warp_rt.usd.sources import MeshSource, Source, report_unreadable
from warp_rt.usd.tet_mesh import read_tet_mesh

TYPES = frozenset(("Mesh", "TetMesh", "NurbsPatch", *curves.TYPES))
"""Types that :func:`read_geometry` reads; those of ``implicit`` share unit shapes instead."""


def read_geometry(sources: Sequence[Source], report: Report) -> list[MeshSource | None]:
    """Return the geometry of prims of ``TYPES``; None, with a diagnostic, where there is nothing to draw.

    Args:
        sources: The prims.
        report: Takes the diagnostics.

    Raises:
        LimitError: One would have more faces than can be meant.
    """
    rows = [row for row, source in enumerate(sources) if source.kind == "Mesh"]
    meshes = read_meshes([sources[row] for row in rows], report)
    found: list[MeshSource | None] = [None] * len(sources)
    for row, mesh in zip(rows, meshes, strict=True):
        found[row] = mesh
    for row in sorted({*range(len(sources))}.difference(rows)):
        try:
            found[row] = _read_other(sources[row], report)
        except Tf.ErrorException as error:
            report_unreadable(sources[row].prim, error, report)
    return found


def _read_other(source: Source, report: Report) -> MeshSource | None:
    prim, _, skin, time, carried_to, level, kind, _, _, width = source
    if kind in curves.TYPES:
        return curves.read_shapes(
            prim, time, report, skin=skin, level=level, carried_to=carried_to, inherited_width=width
        )
    if kind == "TetMesh":
        return read_tet_mesh(prim, time, report, skin, carried_to)
    return read_nurbs_patch(prim, time, report, skin=skin, level=level, carried_to=carried_to)
