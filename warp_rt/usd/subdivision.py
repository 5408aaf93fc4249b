# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomMesh as a subdivision surface: its cage with creases and corners, refined to triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.errors import LimitError
from warp_rt.report import Report
from warp_rt.scene import Primvar
from warp_rt.scene.equal_rows import first_equal_rows
from warp_rt.subdivision.face_varying import RULES
from warp_rt.subdivision.surface import BOUNDARIES, Rules, Surface
from warp_rt.subdivision.topology import Topology
from warp_rt.usd.arrays import float_rows, integers
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.primvars import Layout

BAD_CREASE = "W115"
NOT_TRIANGLES = "W116"

MAX_FACES = 1 << 26
_TRIANGLE_RULES = ("catmullClark", "smooth")


@dataclass(eq=False)
class RefinedLayout(Layout):
    """A layout whose triangles are a refined surface's; elements are still counted and numbered as in the source."""

    surface: Surface
    cage_corners: np.ndarray
    """int64, shape [c], face-vertex in the source of each corner of the cage."""

    def primvar(self, values: np.ndarray, indices: np.ndarray | None, interpolation: str) -> Primvar:
        """Return values by triangle corner, interpolated as the surface itself is where their kind asks for it.

        Args:
            values: Shape [n, c].
            indices: Rows of the values, one an element, shape [elements]; None: each element has its own.
            interpolation: UsdGeom's.
        """
        if interpolation in ("constant", "uniform"):
            return super().primvar(values, indices, interpolation)
        if interpolation == "faceVarying":
            # "Indexing serves a higher purpose of establishing a surface topology" (UsdGeomPrimvar); without indices,
            # equal values are one.
            of_corner = (first_equal_rows(values) if indices is None else indices)[self.cage_corners]
            refined, rows = self.surface.face_varying(values, of_corner)
            return Primvar(refined.astype(np.float32), rows[self.corners].astype(np.int32))
        elements = values if indices is None else values[indices]
        refine = self.surface.linear if interpolation == "varying" else self.surface.values
        return Primvar(refine(elements).astype(np.float32), self.triangles)


def read_surface(
    prim: Usd.Prim,
    level: int,
    cage: Topology,
    attributes: AttributeReader,
    time: Usd.TimeCode,
    report: Report,
    *,
    scheme: str,
) -> Surface | None:
    """Return the refined surface of a mesh; None, told, where it has none.

    Args:
        prim: The mesh.
        level: Number of refinements, at least 1.
        cage: Its faces, without creases.
        attributes: Reader of the mesh's tokens.
        time: When arrays are read.
        report: Takes the diagnostics.
        scheme: ``catmullClark``, ``loop`` or ``bilinear``.

    Raises:
        LimitError: The surface would have more faces than can be meant.
    """
    is_loop = scheme == "loop"
    if is_loop and (cage.counts != 3).any():
        report.warn(NOT_TRIANGLES, prim.GetPath(), "scheme loop with faces that are no triangles: drawn as its cage")
        return None
    faces = (4 * len(cage.counts) if is_loop else len(cage.corners)) * 4 ** (level - 1)
    if faces > MAX_FACES:
        raise LimitError(f"{prim.GetPath()}: refined {level} times it has {faces} faces; {MAX_FACES} can be meant")
    rules = Rules(
        is_loop=is_loop,
        is_bilinear=scheme == "bilinear",
        boundary=attributes.token("interpolateBoundary", BOUNDARIES[0], BOUNDARIES),
        face_varying=attributes.token("faceVaryingLinearInterpolation", RULES[0], RULES),
        smooth_triangles=attributes.token("triangleSubdivisionRule", _TRIANGLE_RULES[0], _TRIANGLE_RULES) == "smooth",
    )
    creases, crease_sharpness = _read_creases(UsdGeom.Mesh(prim), cage.vertex_count, time, report)
    sharpness = _read_corners(UsdGeom.Mesh(prim), cage.vertex_count, time, report)
    sharp = Topology(cage.vertex_count, cage.counts, cage.corners, creases, crease_sharpness, sharpness)
    if sharp.lost_crease_count:
        message = f"{sharp.lost_crease_count} of {len(creases)} creased edges left out: no face has them"
        report.warn(BAD_CREASE, prim.GetPath(), message)
    return Surface(sharp, rules, level)


def refined_triangles(surface: Surface, is_shown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return corners of the refined mesh by triangle, int64, shape [m, 3], and the cage's face of each, shape [m].

    Args:
        surface: The refined surface.
        is_shown: Whether each face of the cage is drawn, shape [f].
    """
    topology = surface.topology
    shown = np.flatnonzero((is_shown & surface.has_surface)[surface.cage_face])
    start = topology.starts[shown][:, None]
    split = [[0, 1, 2]] if surface.rules.is_loop else [[0, 1, 2], [0, 2, 3]]
    corners = (start[:, None] + np.array(split)).reshape(-1, 3)
    return corners, np.repeat(surface.cage_face[shown], len(split))


def _read_creases(
    mesh: UsdGeom.Mesh, vertex_count: int, time: Usd.TimeCode, report: Report
) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends and the sharpness of creased edges: [k, 2], [k]. A sharpness stands for a crease or an edge."""
    none = np.zeros((0, 2), np.int64), np.zeros(0)
    indices = integers(mesh.GetCreaseIndicesAttr().Get(time))
    lengths = integers(mesh.GetCreaseLengthsAttr().Get(time))
    values = float_rows(mesh.GetCreaseSharpnessesAttr().Get(time))
    if not any(map(_holds_any, (indices, lengths, values))):
        return none
    fits = (
        indices is not None
        and lengths is not None
        and values is not None
        and (lengths >= 2).all()
        and lengths.sum() == len(indices)
        and len(values) in (len(lengths), (lengths - 1).sum())
        and np.isfinite(values).all()
        and indices.min(initial=0) >= 0
        and indices.max(initial=-1) < vertex_count
    )
    if not fits or indices is None or lengths is None or values is None:
        report.warn(BAD_CREASE, mesh.GetPath(), "creases left out: their indices, lengths and sharpnesses do not fit")
        return none
    is_last = np.zeros(len(indices), bool)
    is_last[np.cumsum(lengths) - 1] = True
    first = np.flatnonzero(~is_last)
    per_crease = len(values) == len(lengths)
    sharpness = np.repeat(values[:, 0], lengths - 1) if per_crease else values[:, 0]
    return np.stack([indices[first], indices[first + 1]], axis=1), np.maximum(sharpness, 0).astype(np.float64)


def _read_corners(mesh: UsdGeom.Mesh, vertex_count: int, time: Usd.TimeCode, report: Report) -> np.ndarray:
    """Return the sharpness of each vertex, float64, shape [vertex_count]."""
    sharpness = np.zeros(vertex_count)
    indices = integers(mesh.GetCornerIndicesAttr().Get(time))
    values = float_rows(mesh.GetCornerSharpnessesAttr().Get(time))
    if not (_holds_any(indices) or _holds_any(values)):
        return sharpness
    fits = (
        indices is not None
        and values is not None
        and len(values) == len(indices)
        and np.isfinite(values).all()
        and indices.min(initial=0) >= 0
        and indices.max(initial=-1) < vertex_count
    )
    if not fits or indices is None or values is None:
        report.warn(BAD_CREASE, mesh.GetPath(), "corners left out: their indices and sharpnesses do not fit")
        return sharpness
    sharpness[indices] = np.maximum(values[:, 0], 0)
    return sharpness


def _holds_any(array: np.ndarray | None) -> bool:
    return array is not None and len(array) > 0
