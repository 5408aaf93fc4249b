# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomNurbsPatch to triangles with the normals of the surface itself.

Reference: UsdGeomNurbsPatch schema documentation, and RiNuPatch, which it refers to: control points with u fastest,
primitive variables by segment, by segment corner and by control point, normals along dP/du x dP/dv.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.errors import LimitError
from warp_rt.report import Report
from warp_rt.scene import Mesh, Primvar
from warp_rt.splines.patch import Patch
from warp_rt.splines.pieces import MAX_ORDER, Pieces, find_pieces
from warp_rt.splines.tessellation import Tessellation, find_lines, tessellate
from warp_rt.usd.arrays import doubles, point_weights
from warp_rt.usd.attribute_values import AttributeReader, shown
from warp_rt.usd.mesh import EMPTY, INVALID_VALUE, ORIENTATIONS
from warp_rt.usd.motion import read_points
from warp_rt.usd.normals import UNUSED_NORMALS, read_normals, repair_normals
from warp_rt.usd.polygons import BAD_POINT, MAX_COORDINATE
from warp_rt.usd.primvars import read_primvars
from warp_rt.usd.skinning import Skin, pose
from warp_rt.usd.sources import MeshSource
from warp_rt.usd.subdivision import MAX_FACES
from warp_rt.usd.subsets import read_face_slots
from warp_rt.usd.trim_curves import read_regions
from warp_rt.usd.volumes import encloses_volume

BAD_PATCH = "W141"

# Of the diagonal of the control points' box: a pixel where the patch fills a picture of a thousand.
TOLERANCE = 1e-3

_FORMS = ("open", "closed", "periodic")


@dataclass(frozen=True, eq=False)
class PatchLayout:
    """How the elements of a patch are numbered, and what its triangles' corners take of them.

    What ``warp_rt.usd.primvars`` asks of ``Elements``. A segment, USD's uniform element, is what lies between two
    knots in u and two in v; those of no extent are counted.
    """

    patch: Patch
    cut: Tessellation
    u_count: int
    v_count: int

    @property
    def segment_counts(self) -> tuple[int, int]:
        """Segments along u and along v."""
        return self.u_count - self.patch.u.degree, self.v_count - self.patch.v.degree

    @property
    def segments(self) -> np.ndarray:
        """int64, shape [m], segment of each triangle, u fastest."""
        u_piece, v_piece = self.cut.pieces.T
        return self.patch.v.number[v_piece] * self.segment_counts[0] + self.patch.u.number[u_piece]

    def element_counts(self, interpolation: str) -> tuple[int, ...]:
        """Return the numbers of elements that fit an interpolation; none if there is no such interpolation."""
        along_u, along_v = self.segment_counts
        corners = (along_u + 1) * (along_v + 1)
        counts = {
            "constant": 1,
            "uniform": along_u * along_v,
            "varying": corners,
            "vertex": self.u_count * self.v_count,
            "faceVarying": corners,
        }
        return (counts[interpolation],) if interpolation in counts else ()

    def primvar(self, values: np.ndarray, indices: np.ndarray | None, interpolation: str) -> Primvar:
        """Return values, shape [k, c], by triangle corner; ``indices`` say which of them each element takes."""
        if indices is not None:
            values = values[indices]
        if interpolation == "constant":
            return Primvar(values[:1], None)
        if interpolation == "uniform":
            return Primvar(values, np.repeat(self.segments[:, None], 3, axis=1).astype(np.int32))
        if interpolation == "vertex":
            blended = self.patch.values(values.astype(np.float64), self.cut.places)
        else:
            blended = self._bilinear(values.astype(np.float64))
        return Primvar(blended.astype(np.float32), self.cut.corners.astype(np.int32))

    def st(self) -> Primvar:
        """Return the parameters as texture coordinates, from 0 to 1 along the patch's ranges."""
        places = self.cut.places
        axes = []
        for pieces, piece, at in (
            (self.patch.u, places.u_piece, places.u),
            (self.patch.v, places.v_piece, places.v),
        ):
            parameter = (1 - at) * pieces.start[piece] + at * pieces.end[piece]
            axes.append((parameter - pieces.start[0]) / (pieces.end[-1] - pieces.start[0]))
        return Primvar(np.stack(axes, axis=1).astype(np.float32), self.cut.corners.astype(np.int32))

    def _bilinear(self, values: np.ndarray) -> np.ndarray:
        """Return values of segment corners, u fastest, interpolated over each segment."""
        places, row = self.cut.places, self.segment_counts[0] + 1
        u_number, u = _along_segment(self.patch.u, places.u_piece, places.u)
        v_number, v = _along_segment(self.patch.v, places.v_piece, places.v)
        corner = v_number * row + u_number
        lower = (1 - u) * values[corner] + u * values[corner + 1]
        upper = (1 - u) * values[corner + row] + u * values[corner + row + 1]
        return (1 - v) * lower + v * upper


def read_nurbs_patch(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    report: Report,
    *,
    skin: Skin | None = None,
    level: int = 0,
    carried_to: Usd.TimeCode | None = None,
) -> MeshSource | None:
    """Return the triangles of a patch; None, with a diagnostic, where there is nothing to draw.

    They stay within a thousandth of the diagonal of the control points' box from the surface, and within a quarter of
    that for each level.

    Args:
        prim: The patch.
        time: When its attributes are read.
        report: Takes the diagnostics.
        skin: Deforms its control points.
        level: Of refinement.
        carried_to: When its velocities have carried the points from their sample; None: they do not.

    Raises:
        LimitError: It would have more triangles than can be meant.
    """
    path = str(prim.GetPath())
    schema = UsdGeom.NurbsPatch(prim)
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    read = _read_patch(prim, attributes, time, skin, carried_to, report)
    if read is None:
        return None
    patch, (u_count, v_count), skin = read
    tolerance = TOLERANCE * patch.size / 4**level
    lines = find_lines(patch, tolerance)
    count = 2 * (len(lines.u) - 1) * (len(lines.v) - 1)
    if count > MAX_FACES:
        raise LimitError(f"{path}: it would have {count} triangles; {MAX_FACES} can be meant")
    if not lines.is_fine:
        report.warn(BAD_PATCH, path, "its pointWeights are too far apart to be followed: bends are cut coarsely")
    cut = tessellate(patch, lines, read_regions(schema, patch, tolerance, time, report))
    if not len(cut.triangles):
        report.warn(EMPTY, path, "NurbsPatch of which nothing is left")
        return None

    normals = patch.normals(cut.places)
    if attributes.token("orientation", ORIENTATIONS[0], ORIENTATIONS) == "leftHanded":
        swap = [0, 2, 1]
        cut = replace(cut, triangles=cut.triangles[:, swap], corners=cut.corners[:, swap])
        normals = -normals
    layout = PatchLayout(patch, cut, u_count, v_count)
    authored = read_normals(schema, layout, time, report)
    if authored is not None and skin is not None and not skin.is_rigid:
        # Those of the bent surface are right, and authored ones need not stand at points that joints move.
        report.warn(UNUSED_NORMALS, path, "its normals do not count: the patch that is bent has its own")
        authored = None
    shading = authored or Primvar(normals.astype(np.float32), cut.corners.astype(np.int32))
    segments = layout.segments
    triangles, mesh_points = cut.triangles.astype(np.int32), cut.points.astype(np.float32)
    slots, subsets = read_face_slots(prim, int(np.prod(layout.segment_counts)), time, report)
    mesh = Mesh(
        points=mesh_points,
        triangles=triangles,
        normals=repair_normals(shading, mesh_points, triangles),
        primvars={"st": layout.st(), **read_primvars(prim, layout, time, report)},
        material_slots=None if slots is None else slots[segments],
        face_ids=segments.astype(np.int32),
        is_closed=encloses_volume(mesh_points, triangles),
    )
    return MeshSource(mesh, subsets)


def _read_patch(
    prim: Usd.Prim,
    attributes: AttributeReader,
    time: Usd.TimeCode,
    skin: Skin | None,
    carried_to: Usd.TimeCode | None,
    report: Report,
) -> tuple[Patch, tuple[int, int], Skin | None] | None:
    """Return a patch, its control points along u and v, and the skin if it bends them.

    None, with a diagnostic, where that makes no surface.
    """
    path = str(prim.GetPath())
    points = read_points(prim, time, carried_to)
    if points is None or not len(points):
        report.warn(EMPTY, path, "NurbsPatch without points")
        return None
    points, skin = pose(points, skin, prim, report)
    if not (np.isfinite(points).all() and np.abs(points).max() <= MAX_COORDINATE):
        report.warn(BAD_POINT, path, "NurbsPatch left out, point not finite")
        return None
    along_u, along_v = (_read_pieces(prim, axis, attributes, time, report) for axis in "uv")
    if along_u is None or along_v is None:
        return None
    (u, u_count), (v, v_count) = along_u, along_v
    if u_count * v_count != len(points):
        report.warn(BAD_PATCH, path, f"left out: {u_count} x {v_count} control points, {len(points)} points")
        return None
    weights = point_weights(UsdGeom.NurbsPatch(prim).GetPointWeightsAttr(), len(points), time, BAD_PATCH, report)
    patch = Patch(points, weights, u, v, u_count)
    if not patch.size > 0:
        report.warn(EMPTY, path, "NurbsPatch of no size")
        return None
    return patch, (u_count, v_count), skin


def _along_segment(pieces: Pieces, piece: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the segment of places along pieces, shape [m], and how far along it they are, shape [m, 1].

    A range may begin or end within a segment.
    """
    low, high = (knot[piece] for knot in pieces.interval)
    parameter = (1 - at) * pieces.start[piece] + at * pieces.end[piece]
    return pieces.number[piece], ((parameter - low) / (high - low))[:, None]


def _read_pieces(
    prim: Usd.Prim, axis: str, attributes: AttributeReader, time: Usd.TimeCode, report: Report
) -> tuple[Pieces, int] | None:
    """Return the pieces along u or v and the number of control points; None, told, where the attributes do not fit."""

    def give_up(why: str) -> None:
        report.warn(BAD_PATCH, prim.GetPath(), f"left out: {why}")

    attributes.token(f"{axis}Form", _FORMS[0], _FORMS)  # says what the points show; only a wrong one is told
    count, order = (attributes.value(f"{axis}{name}") for name in ("VertexCount", "Order"))
    if not isinstance(count, int) or not isinstance(order, int) or not 2 <= order <= count:
        give_up(f"{axis}VertexCount is {shown(count)}, {axis}Order {shown(order)}")
        return None
    if order > MAX_ORDER:
        give_up(f"{axis}Order is {order}, above {MAX_ORDER}")
        return None
    knots = doubles(attributes.value(f"{axis}Knots"))
    if knots is None or len(knots) != count + order:
        found = "no" if knots is None else len(knots)
        give_up(f"{found} {axis}Knots, {count + order} are needed")
        return None
    if not np.isfinite(knots).all() or (np.diff(knots) < 0).any() or not knots[order - 1] < knots[count]:
        give_up(f"{axis}Knots do not ascend")
        return None
    domain = np.array([knots[order - 1], knots[count]])
    wanted = domain
    if prim.GetAttribute(f"{axis}Range").HasAuthoredValue():
        wanted = np.array(attributes.vector(f"{axis}Range", tuple(domain)))
    span = np.clip(wanted, *domain)
    if not span[0] < span[1]:
        give_up(f"{axis}Range {wanted[0]:g} to {wanted[1]:g} is not within {domain[0]:g} to {domain[1]:g}")
        return None
    if (span != wanted).any():
        what = f"{axis}Range {wanted[0]:g} to {wanted[1]:g} reaches beyond {domain[0]:g} to {domain[1]:g}: cut to that"
        report.warn(BAD_PATCH, prim.GetPath(), what)
    pieces = find_pieces(knots, np.zeros(1, np.int64), np.array([count]), order - 1, span[None])
    return pieces, count
