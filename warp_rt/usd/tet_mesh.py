# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomTetMesh to the triangles of its surface.

Reference: UsdGeomTetMesh schema documentation (winding, surface faces), GeomSubset (elementType ``tetrahedron``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Mesh
from warp_rt.usd.arrays import integer_rows
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.mesh import EMPTY, INVALID_VALUE, ORIENTATIONS
from warp_rt.usd.motion import read_points
from warp_rt.usd.normals import pose_normals, read_normals, repair_normals
from warp_rt.usd.polygons import BAD_INDEX, BAD_TOPOLOGY, MAX_COORDINATE, drawable_polygons
from warp_rt.usd.primvars import Layout, read_primvars
from warp_rt.usd.skinning import Skin, pose
from warp_rt.usd.sources import MeshSource
from warp_rt.usd.subsets import FaceGroups, read_face_slots
from warp_rt.usd.volumes import encloses_volume

# The corners of a tetrahedron's triangles, counter-clockwise seen from outside where the orientation is right-handed.
_SIDES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])


@dataclass(eq=False)
class TetLayout(Layout):
    """A layout whose uniform values may also be those of the tetrahedra that the faces belong to.

    USD does not say which of the two ``uniform`` means on a TetMesh: a value for each tetrahedron is what simulators
    write, one for each surface face what Hydra takes. The number of values tells; where both fit, it is tetrahedra.
    """

    tet_count: int
    tets: np.ndarray
    """int64, shape [m], tetrahedron of each triangle; -1: a face of none."""

    def element_counts(self, interpolation: str) -> tuple[int, ...]:
        """Return the numbers of elements that fit an interpolation; none if there is no such interpolation."""
        counts = super().element_counts(interpolation)
        return (self.tet_count, *counts) if interpolation == "uniform" and self._has_tets else counts

    def elements(self, interpolation: str, count: int) -> np.ndarray | None:
        """Return which of ``count`` elements each triangle corner takes, [triangles, 3]; None: 0 everywhere."""
        if interpolation == "uniform" and count == self.tet_count and self._has_tets:
            return np.repeat(self.tets[:, None], 3, axis=1).astype(np.int32)
        return super().elements(interpolation, count)

    @property
    def _has_tets(self) -> bool:
        return bool((self.tets >= 0).all())


def read_tet_mesh(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    report: Report,
    skin: Skin | None = None,
    carried_to: Usd.TimeCode | None = None,
) -> MeshSource | None:
    """Return the surface of a TetMesh; None, with a diagnostic, where there is nothing to draw.

    Its faces are ``surfaceFaceVertexIndices``; where those are not authored, the triangles that one tetrahedron has to
    itself, in the order of their corners, as UsdGeomTetMesh::ComputeSurfaceFaces gives them.

    Args:
        prim: The mesh.
        time: When its attributes are read.
        report: Takes the diagnostics.
        skin: Deforms points and normals.
        carried_to: When its velocities have carried the points from their sample; None: they do not.
    """
    path = str(prim.GetPath())
    schema = UsdGeom.TetMesh(prim)
    points = read_points(prim, time, carried_to)
    if points is None or not len(points):
        report.warn(EMPTY, path, "TetMesh without points")
        return None
    tets = _read_corners(schema.GetTetVertexIndicesAttr(), 4, time, report)
    is_tet = ((tets >= 0) & (tets < len(points))).all(axis=1)
    if not is_tet.all():
        report.warn(BAD_INDEX, path, f"{(~is_tet).sum()} tetrahedra left out, index out of range")
    faces = _read_corners(schema.GetSurfaceFaceVertexIndicesAttr(), 3, time, report)
    if not len(faces):
        faces = surface_faces(tets[is_tet])
    if not len(faces):
        why = "no face is one tetrahedron's alone" if is_tet.any() else "it has neither tetrahedra nor surface faces"
        report.warn(EMPTY, path, f"TetMesh without a surface: {why}")
        return None

    face_tets = np.append(np.flatnonzero(is_tet), -1)[tets_of_faces(faces, tets[is_tet])]

    points, skin = pose(points, skin, prim, report)
    is_usable = np.isfinite(points).all(axis=1) & (np.abs(points) <= MAX_COORDINATE).all(axis=1)
    polygons = drawable_polygons(is_usable, np.full(len(faces), 3), faces.reshape(-1), path, report)
    points = np.where(is_usable[:, None], points, np.float32(0))
    corners = polygons.corners.reshape(-1, 3)
    if not len(corners):
        return None
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    if attributes.token("orientation", ORIENTATIONS[0], ORIENTATIONS) == "leftHanded":
        corners = corners[:, [0, 2, 1]]
    layout = TetLayout(
        point_count=len(points),
        face_count=len(faces),
        corner_count=faces.size,
        triangles=polygons.indices[corners].astype(np.int32),
        face_ids=polygons.faces.astype(np.int32),
        corners=corners.astype(np.int32),
        tet_count=len(tets),
        tets=face_tets[polygons.faces],
    )
    normals = read_normals(schema, layout, time, report)
    if normals is not None and skin is not None:
        normals = pose_normals(normals, layout, skin)
    tetrahedra = FaceGroups("tetrahedron", "tetrahedra", len(tets), face_tets)
    slots, subsets = read_face_slots(prim, len(faces), time, report, tetrahedra)
    mesh = Mesh(
        points=points,
        triangles=layout.triangles,
        normals=None if normals is None else repair_normals(normals, points, layout.triangles),
        primvars=read_primvars(prim, layout, time, report),
        material_slots=None if slots is None else slots[layout.face_ids],
        face_ids=layout.face_ids,
        is_closed=encloses_volume(points, layout.triangles),
    )
    return MeshSource(mesh, subsets)


def surface_faces(tets: np.ndarray) -> np.ndarray:
    """Return the triangles that belong to one tetrahedron only: int64, shape [f, 3], in the order of their corners.

    Args:
        tets: Points of each tetrahedron, shape [t, 4].
    """
    sides = tets[:, _SIDES].reshape(-1, 3)
    number = _number_by_corners(sides)
    outer = sides[np.bincount(number)[number] == 1]
    return outer[np.lexsort(outer.T[::-1])]


def tets_of_faces(faces: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Return the first tetrahedron that has each face as a side, whichever way round: int64, shape [f]; -1: none.

    Args:
        faces: Points of each triangle, shape [f, 3].
        tets: Points of each tetrahedron, shape [t, 4].
    """
    sides = tets[:, _SIDES].reshape(-1, 3)
    number = _number_by_corners(np.concatenate([sides, faces]))
    tet_of_number = np.full(number.max(initial=-1) + 1, -1)
    last_to_first = np.arange(len(sides))[::-1]
    tet_of_number[number[last_to_first]] = last_to_first // 4
    return tet_of_number[number[len(sides) :]]


def _number_by_corners(triangles: np.ndarray) -> np.ndarray:
    """Return a number for each triangle, from 0 on, the same for those of the same corners in any order."""
    corners = np.sort(triangles, axis=1)
    order = np.lexsort(corners.T)
    is_new = np.zeros(len(corners), bool)
    is_new[1:] = (corners[order[1:]] != corners[order[:-1]]).any(axis=1)
    number = np.empty(len(corners), np.int64)
    number[order] = np.cumsum(is_new)
    return number


def _read_corners(attribute: Usd.Attribute, count: int, time: Usd.TimeCode, report: Report) -> np.ndarray:
    """Return an array of int3 or int4, shape [n, count]; of no length where it is absent or of a wrong type."""
    value = attribute.Get(time)
    corners = integer_rows(value, count)
    if corners is None and value is not None:
        report.warn(
            BAD_TOPOLOGY, attribute.GetPrim().GetPath(), f"{attribute.GetName()} holds a {type(value).__name__}"
        )
    return np.zeros((0, count), np.int64) if corners is None else corners
