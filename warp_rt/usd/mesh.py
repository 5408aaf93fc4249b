# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomMesh to triangles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Mesh, Primvar, Shapes
from warp_rt.subdivision.surface import Surface
from warp_rt.subdivision.topology import Topology
from warp_rt.triangulate import triangulate
from warp_rt.usd.arrays import integers, vector_rows
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.motion import read_points
from warp_rt.usd.primvars import NOT_FINITE, WRONG_TYPE, Elements, Layout, lay_out, read_primvar, read_primvars
from warp_rt.usd.skinning import Skin, pose
from warp_rt.usd.subdivision import RefinedLayout, read_surface, refined_triangles
from warp_rt.usd.subsets import read_face_slots

FEW_VERTICES = "W101"
BAD_INDEX = "W102"
BAD_POINT = "W103"
BAD_TOPOLOGY = "W104"
BAD_HOLE = "W113"
INVALID_VALUE = "W114"
EMPTY = "N910"

# The watertight test multiplies three coordinates, which must stay inside float32's range: 1e13 does, 1e14 does not.
MAX_COORDINATE = 1e12

SMOOTH_SCHEMES = ("catmullClark", "loop")
"""Schemes whose surface is smooth. A bilinear one has the edges and corners of its cage, and flat normals."""
SUBDIVISION_SCHEMES = (*SMOOTH_SCHEMES, "bilinear")
_SCHEMES = (*SUBDIVISION_SCHEMES, "none")
ORIENTATIONS = ("rightHanded", "leftHanded")


@dataclass(frozen=True)
class MeshSource:
    """A mesh and what its material slots stand for."""

    mesh: Mesh | Shapes
    subsets: tuple[str, ...] = ()
    """Names of the GeomSubset children that slots 1, 2, ... take their material from; slot 0 is the mesh's own."""


@dataclass(frozen=True)
class Polygons:
    """Faces that can be drawn."""

    faces: np.ndarray
    """int64, shape [f], number of each in the source."""
    starts: np.ndarray
    """int64, shape [f], position of the first corner in ``indices``."""
    counts: np.ndarray
    """int64, shape [f], corners of each."""
    indices: np.ndarray
    """int64, shape [c], vertex of every corner of the source; valid for these faces."""

    @property
    def corners(self) -> np.ndarray:
        """int64, position in ``indices`` of all corners of these faces, one after the other."""
        return np.repeat(self.starts, self.counts) + _ranges(self.counts)

    def __getitem__(self, chosen: np.ndarray) -> Polygons:
        return Polygons(self.faces[chosen], self.starts[chosen], self.counts[chosen], self.indices)


@dataclass(frozen=True)
class _Shape:
    """The triangles of a mesh, whichever way they came about."""

    points: np.ndarray
    layout: Layout
    normals: Primvar | None
    is_closed: bool


def read_mesh(
    prim: Usd.Prim,
    time: Usd.TimeCode,
    report: Report,
    *,
    skin: Skin | None = None,
    level: int = 0,
    carried_to: Usd.TimeCode | None = None,
) -> MeshSource | None:
    """Return the triangles of a mesh prim; None, with a diagnostic, where there is nothing to draw.

    At level 0 a mesh with a smooth subdivision scheme is its control cage with smooth normals, as usdrecord draws it at
    complexity low; beyond that it is refined as often, and has the points and normals of the limit surface. Normals
    authored on it do not count (UsdGeomMesh, "Subdivision").

    Args:
        prim: The mesh.
        time: When its attributes are read.
        report: Takes the diagnostics.
        skin: Deforms points and normals.
        level: Refinements of a subdivision surface.
        carried_to: When its velocities have carried the points from their sample; None: they do not.

    Raises:
        LimitError: It would have more faces than can be meant.
    """
    schema = UsdGeom.Mesh(prim)
    path = prim.GetPath()
    points, counts, indices = _read_arrays(schema, time, carried_to, report)
    if not len(points) or not len(counts):
        report.warn(EMPTY, path, "mesh without points or faces")
        return None
    points, skin = pose(points, skin, prim, report)
    is_usable = np.isfinite(points).all(axis=1) & (np.abs(points) <= MAX_COORDINATE).all(axis=1)
    polygons = drawable_polygons(is_usable, counts, indices, str(path), report)
    points = np.where(is_usable[:, None], points, np.float32(0))
    is_shown = ~_is_hole(schema, len(counts), time, report)[polygons.faces]
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    scheme = attributes.token("subdivisionScheme", _SCHEMES[0], _SCHEMES)

    cage = _cage_shape(points, len(counts), polygons, is_shown)
    if not len(cage.layout.triangles):
        return None
    surface = None
    if level and scheme in SUBDIVISION_SCHEMES:
        cage_topology = _cage_topology(len(points), polygons)
        surface = read_surface(prim, level, cage_topology, attributes, time, report, scheme=scheme)
    if surface is not None:
        shape = _refined_shape(cage, surface, polygons, is_shown)
        if not len(shape.layout.triangles):
            report.warn(EMPTY, path, "interpolateBoundary none leaves no face: all of them are at a boundary")
            return None
    elif scheme in SMOOTH_SCHEMES:
        # A hole is still part of the surface that the normals belong to.
        shape = replace(cage, normals=Primvar(smooth_normals(points, polygons), cage.layout.triangles))
    else:
        shape = cage
    if attributes.token("orientation", ORIENTATIONS[0], ORIENTATIONS) == "leftHanded":
        shape = _turned(shape)
    if scheme == "none":
        normals = read_normals(schema, shape.layout, time, report)
        if normals is not None and skin is not None:
            normals = pose_normals(normals, shape.layout, skin)
        shape = replace(shape, normals=normals)

    layout, normals = shape.layout, shape.normals
    slots, subsets = read_face_slots(prim, len(counts), time, report)
    mesh = Mesh(
        points=shape.points,
        triangles=layout.triangles,
        normals=None if normals is None else repair_normals(normals, shape.points, layout.triangles),
        primvars=read_primvars(prim, layout, time, report),
        material_slots=None if slots is None else slots[layout.face_ids],
        face_ids=None if np.array_equal(layout.face_ids, np.arange(len(layout.triangles))) else layout.face_ids,
        is_closed=shape.is_closed,
    )
    return MeshSource(mesh, subsets)


def _cage_shape(points: np.ndarray, face_count: int, polygons: Polygons, is_shown: np.ndarray) -> _Shape:
    """Return the triangles of the polygons that are shown, without normals."""
    shown = polygons[is_shown]
    corners, rows = triangulate(points, shown.starts, shown.counts, shown.indices)
    layout = Layout(
        point_count=len(points),
        face_count=face_count,
        corner_count=len(polygons.indices),
        triangles=polygons.indices[corners].astype(np.int32),
        face_ids=shown.faces[rows].astype(np.int32),
        corners=corners.astype(np.int32),
    )
    return _Shape(points, layout, None, encloses_volume(points, layout.triangles))


def _cage_topology(point_count: int, polygons: Polygons) -> Topology:
    """Return the topology of polygons, without creases."""
    return Topology(
        vertex_count=point_count,
        counts=polygons.counts,
        corners=polygons.indices[polygons.corners],
        creases=np.zeros((0, 2), np.int64),
        crease_sharpness=np.zeros(0),
        vertex_sharpness=np.zeros(point_count),
    )


def _refined_shape(cage: _Shape, surface: Surface, polygons: Polygons, is_shown: np.ndarray) -> _Shape:
    """Return the triangles of a refined surface, with points and normals of the limit; of a bilinear one, without."""
    corners, faces = refined_triangles(surface, is_shown)
    layout = RefinedLayout(
        point_count=cage.layout.point_count,
        face_count=cage.layout.face_count,
        corner_count=cage.layout.corner_count,
        triangles=surface.topology.corners[corners].astype(np.int32),
        face_ids=polygons.faces[faces].astype(np.int32),
        corners=corners.astype(np.int32),
        surface=surface,
        cage_corners=polygons.corners,
    )
    is_closed = cage.is_closed and bool(surface.has_surface.all())
    if surface.rules.is_bilinear:
        return _Shape(surface.linear(cage.points.astype(np.float64)).astype(np.float32), layout, None, is_closed)
    points, normals, normal_rows = surface.limit(cage.points.astype(np.float64))
    rows = Primvar(normals.astype(np.float32), normal_rows[corners].astype(np.int32))
    return _Shape(points.astype(np.float32), layout, rows, is_closed)


def _turned(shape: _Shape) -> _Shape:
    """Return a shape with its other side out."""
    swap = [0, 2, 1]
    layout = replace(shape.layout, triangles=shape.layout.triangles[:, swap], corners=shape.layout.corners[:, swap])
    normals = shape.normals
    if normals is not None and normals.indices is not None:
        normals = Primvar(-normals.values, normals.indices[:, swap])
    return replace(shape, layout=layout, normals=normals)


def drawable_polygons(
    is_usable: np.ndarray, counts: np.ndarray, indices: np.ndarray, path: str, report: Report
) -> Polygons:
    """Return the faces that have three or more corners, all at usable points; the others give a diagnostic.

    Args:
        is_usable: Whether each point has a position, shape [n].
        counts: Corners of each face, any integers, shape [f].
        indices: Vertex of each corner, any integers, shape [c].
        path: Mesh prim, for diagnostics.
        report: Takes the diagnostics.
    """
    lengths = np.clip(counts, 0, len(indices) + 1)
    ends = np.cumsum(lengths)
    starts = ends - lengths
    is_complete = ends <= len(indices)
    if ends[-1] != len(indices):
        report.warn(
            BAD_TOPOLOGY, path, f"faceVertexCounts sum to {counts.sum()}, faceVertexIndices has {len(indices)} entries"
        )
    in_range = (indices >= 0) & (indices < len(is_usable))
    at_point = in_range.copy()
    at_point[in_range] = is_usable[indices[in_range]]
    is_polygon = counts >= 3
    has_indices = is_complete & _holds_for_all(in_range, starts, ends)
    has_points = is_complete & _holds_for_all(at_point, starts, ends)
    for code, dropped, why in (
        (FEW_VERTICES, ~is_polygon, "fewer than three vertices"),
        (BAD_INDEX, is_polygon & ~has_indices, "index out of range"),
        (BAD_POINT, is_polygon & has_indices & ~has_points, "point not finite"),
    ):
        if dropped.any():
            report.warn(code, path, f"{dropped.sum()} faces dropped, {why}")
    kept = np.flatnonzero(is_polygon & has_points)
    return Polygons(kept, starts[kept], lengths[kept], indices)


def smooth_normals(points: np.ndarray, polygons: Polygons) -> np.ndarray:
    """Return a unit normal for each point: float32, shape [n, 3]; zero where no face of positive area meets it.

    Each corner counts with the cross product of its two edges, so that a quadrilateral's diagonal does not matter.

    Reference: OpenUSD, Hd_SmoothNormals.
    """
    corner = polygons.corners
    first = np.repeat(polygons.starts, polygons.counts)
    count = np.repeat(polygons.counts, polygons.counts)
    position = points.astype(np.float64)
    here = position[polygons.indices[corner]]
    following = position[polygons.indices[first + (corner - first + 1) % count]]
    previous = position[polygons.indices[first + (corner - first - 1) % count]]
    weighted = np.cross(following - here, previous - here)
    vertex = polygons.indices[corner]
    sums = np.stack([np.bincount(vertex, weighted[:, axis], len(points)) for axis in range(3)], axis=1)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.divide(sums, lengths, out=np.zeros_like(sums), where=lengths > 0).astype(np.float32)


def repair_normals(normals: Primvar, points: np.ndarray, triangles: np.ndarray) -> Primvar | None:
    """Return normals without zero vectors: corners that had one take the geometric normal of their triangle."""
    is_zero = ~(np.square(normals.values.astype(np.float64)).sum(axis=1) > 0)
    if not is_zero.any():
        return normals
    if normals.indices is None:
        return None
    values = np.where(is_zero[:, None], np.array([0, 0, 1], np.float32), normals.values)
    broken = np.flatnonzero(is_zero[normals.indices].any(axis=1))
    if not len(broken):
        return Primvar(values, normals.indices)
    corner_points = points[triangles[broken]].astype(np.float64)
    geometric = np.cross(corner_points[:, 1] - corner_points[:, 0], corner_points[:, 2] - corner_points[:, 0])
    lengths = np.linalg.norm(geometric, axis=1, keepdims=True)
    geometric = np.where(lengths > 0, geometric / np.where(lengths > 0, lengths, 1), [0.0, 0.0, 1.0])
    indices = normals.indices.copy()
    own_row = (len(values) + np.arange(len(broken), dtype=np.int32))[:, None]
    indices[broken] = np.where(is_zero[indices[broken]], own_row, indices[broken])
    return Primvar(np.concatenate([values, geometric.astype(np.float32)]), indices)


def encloses_volume(points: np.ndarray, triangles: np.ndarray) -> bool:
    """Return whether each edge is used as often one way as the other, points at the same place being one point.

    Meshes are often cut open along seams of texture or normals although their surface is closed, so vertices are
    told apart by position. Every directed edge adds a 64-bit hash of its ends, with the sign of its direction: the
    sum is zero for a closed surface, and for an open one with a probability of 2^-64. That takes one pass, no sort.
    """
    bits = np.ascontiguousarray(points, np.float32) + np.float32(0)  # -0 becomes 0
    words = bits.view(np.uint32).astype(np.uint64)
    key = _mix(_mix(_mix(words[:, 0]) + words[:, 1]) + words[:, 2])
    total = np.uint64(0)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        from_key, to_key = key[triangles[:, start]], key[triangles[:, end]]
        edge = _mix(np.minimum(from_key, to_key) + _mix(np.maximum(from_key, to_key)))
        forward = edge[from_key < to_key].sum(dtype=np.uint64)
        backward = edge[from_key > to_key].sum(dtype=np.uint64)
        with np.errstate(over="ignore"):
            total = total + forward - backward
    return bool(len(triangles)) and int(total) == 0


def _mix(words: np.ndarray) -> np.ndarray:
    """Return 64-bit words scattered by the finaliser of splitmix64 (Steele, Lea and Flood 2014)."""
    words = words + np.uint64(0x9E3779B97F4A7C15)
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))


def _read_arrays(
    schema: UsdGeom.Mesh, time: Usd.TimeCode, carried_to: Usd.TimeCode | None, report: Report
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points [n, 3], face vertex counts and indices; of no length where one is absent or of a wrong type."""
    found: list[np.ndarray | None] = []
    for attribute in (schema.GetPointsAttr(), schema.GetFaceVertexCountsAttr(), schema.GetFaceVertexIndicesAttr()):
        value = attribute.Get(time)
        array = integers(value) if found else vector_rows(value, 3)
        if array is None and value is not None:
            report.warn(BAD_TOPOLOGY, schema.GetPath(), f"{attribute.GetName()} holds a {type(value).__name__}")
        found.append(array)
    points, counts, indices = found
    if carried_to is not None:
        points = read_points(schema.GetPrim(), time, carried_to)
    return (
        np.zeros((0, 3), np.float32) if points is None else points,
        np.zeros(0, np.int64) if counts is None else counts,
        np.zeros(0, np.int64) if indices is None else indices,
    )


def _is_hole(schema: UsdGeom.Mesh, face_count: int, time: Usd.TimeCode, report: Report) -> np.ndarray:
    """Return which faces ``holeIndices`` takes away: bool, shape [face_count]."""
    is_hole = np.zeros(face_count, bool)
    value = schema.GetHoleIndicesAttr().Get(time)
    holes = integers(value)
    if holes is None and value is not None:
        report.warn(BAD_TOPOLOGY, schema.GetPath(), f"holeIndices holds a {type(value).__name__}")
    elif holes is not None:
        inside = (holes >= 0) & (holes < face_count)
        if not inside.all():
            report.warn(BAD_HOLE, schema.GetPath(), f"{(~inside).sum()} holeIndices name no face")
        is_hole[holes[inside]] = True
    return is_hole


def read_normals(schema: UsdGeom.PointBased, layout: Elements, time: Usd.TimeCode, report: Report) -> Primvar | None:
    """Return authored normals; ``primvars:normals`` takes precedence over the attribute ``normals``."""
    path = str(schema.GetPath())
    primvar = UsdGeom.PrimvarsAPI(schema).GetPrimvar("normals")
    if primvar and primvar.HasAuthoredValue():
        normals = read_primvar(primvar, layout, time, report)
    else:
        value = schema.GetNormalsAttr().Get(time)
        if value is None:
            return None
        values = vector_rows(value, 3)
        if values is None:
            report.warn(WRONG_TYPE, path, f"normals left out: type {schema.GetNormalsAttr().GetTypeName()}")
            return None
        is_finite = np.isfinite(values).all(axis=1)
        if not is_finite.all():
            report.warn(NOT_FINITE, path, f"{(~is_finite).sum()} normals are not finite: the face's own is taken")
            values = np.where(is_finite[:, None], values, np.float32(0))
        normals = lay_out(values, None, str(schema.GetNormalsInterpolation()), layout, path, "normals", report)
    return normals


def pose_normals(normals: Primvar, layout: Layout, skin: Skin) -> Primvar | None:
    """Return normals deformed by a skin; where they are the faces' own, None, for the faces turn with their points."""
    if normals.indices is None:
        return None
    if len(normals.values) == layout.point_count and np.array_equal(normals.indices, layout.triangles):
        vertices = np.arange(layout.point_count)
        return Primvar(skin.normals(normals.values, vertices, layout.point_count), normals.indices)
    # A value that several corners share may be turned by other joints at each of them.
    corners = skin.normals(
        normals.values[normals.indices].reshape(-1, 3), layout.triangles.reshape(-1), layout.point_count
    )
    return Primvar(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))


def _holds_for_all(holds: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return for each range of corners whether a property holds for all of them; ranges may reach beyond the end."""
    broken = np.concatenate([[0], np.cumsum(~holds)])
    last = len(holds)
    return broken[np.minimum(ends, last)] == broken[np.minimum(starts, last)]


def _ranges(counts: np.ndarray) -> np.ndarray:
    """Return 0 to count - 1 for each count, one after the other."""
    ends = np.cumsum(counts)
    return np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts, counts)
