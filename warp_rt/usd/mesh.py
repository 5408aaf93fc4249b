# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomMesh to triangles."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from pxr import Tf, Usd, UsdGeom, Vt

from warp_rt.report import Report
from warp_rt.scene import Mesh, Primvar
from warp_rt.subdivision.surface import Surface
from warp_rt.subdivision.topology import Topology
from warp_rt.usd.arrays import hold_throughout, integers, signed_integers, vector_rows
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.cages import Cage, CutMesh, cut_cages, join_cages
from warp_rt.usd.motion import read_points
from warp_rt.usd.normals import UNUSED_NORMALS, have_length, pose_normals, read_normals, repair_normals
from warp_rt.usd.plain_values import PlainConstant, PlainRows, read_plain_values
from warp_rt.usd.polygons import BAD_TOPOLOGY, Polygons
from warp_rt.usd.primvars import Layout, read_primvars
from warp_rt.usd.questions import get_attribute, get_value
from warp_rt.usd.skinning import pose
from warp_rt.usd.sources import MeshSource, Source, report_unreadable
from warp_rt.usd.subdivision import RefinedLayout, read_surface, refined_triangles
from warp_rt.usd.subsets import read_face_slots

BAD_HOLE = "W113"
INVALID_VALUE = "W114"
EMPTY = "N910"

SMOOTH_SCHEMES = ("catmullClark", "loop")
"""Schemes whose surface is smooth. A bilinear one has the edges and corners of its cage, and flat normals."""
SUBDIVISION_SCHEMES = (*SMOOTH_SCHEMES, "bilinear")
_SCHEMES = (*SUBDIVISION_SCHEMES, "none")
ORIENTATIONS = ("rightHanded", "leftHanded")
_NORMALS = ("normals", "primvars:normals")
_TURNING = (*_NORMALS, "orientation")
_VECTORS, _INTEGERS = Vt.Vec3fArray, Vt.IntArray
_SMALL = 1 << 12  # elements of an array up to which it stays USD's until it is joined with others
_JOINED_CORNERS = 1 << 14  # of meshes that are cut together: what is computed on the way stays in the cache


def read_meshes(sources: Sequence[Source], report: Report) -> list[MeshSource | None]:
    """Return the triangles of mesh prims; None, with a diagnostic, where there is nothing to draw.

    At level 0 a mesh with a smooth subdivision scheme is its control cage with smooth normals, as usdrecord draws it at
    complexity low; beyond that it is refined as often, and has the points and normals of the limit surface. Normals
    authored on it do not count (UsdGeomMesh, "Subdivision").

    Args:
        sources: The meshes.
        report: Takes the diagnostics.

    Raises:
        LimitError: One would have more faces than can be meant.
    """
    found: list[MeshSource | None] = [None] * len(sources)
    for rows, cages in _read_groups(sources, report):
        drawn = [
            (row, cage, shape)
            for row, cage, shape in zip(rows, cages, _cut(cages, report), strict=True)
            if shape is not None and len(shape.layout.triangles)
        ]
        finished = _finish([cage for _, cage, _ in drawn], [shape for _, _, shape in drawn], report)
        for (row, _, _), mesh in zip(drawn, finished, strict=True):
            found[row] = mesh
    return found


def _read_groups(sources: Sequence[Source], report: Report) -> Iterator[tuple[list[int], list[Cage]]]:
    """Yield rows of ``sources`` and their cages, in groups that are cut together, without those that have nothing."""
    rows: list[int] = []
    cages: list[Cage] = []
    corner_count = 0
    for row, source in enumerate(sources):
        try:
            cage = _read_cage(source, report)
        except Tf.ErrorException as error:
            report_unreadable(source.prim, error, report)
            continue
        if cage is None:
            continue
        corners = cage.size[2]
        corner_count += corners
        if cages and corner_count > _JOINED_CORNERS:
            yield rows, cages
            rows, cages, corner_count = [], [], corners
        rows.append(row)
        cages.append(cage)
    yield rows, cages


def _read_cage(source: Source, report: Report) -> Cage | None:
    """Return what the triangles of a mesh are cut from; None, with a diagnostic, if it has no points or faces."""
    prim, authored, skin, time, carried_to, level = source[:6]
    points: Any = read_points(prim, time, carried_to) if carried_to else get_value(get_attribute(prim, "points"), time)
    counts = get_value(get_attribute(prim, "faceVertexCounts"), time)
    indices = get_value(get_attribute(prim, "faceVertexIndices"), time)
    is_small = False
    if type(points) is _VECTORS and type(counts) is type(indices) is _INTEGERS:
        size = len(points), len(counts), len(indices)
        is_small = size[0] <= _SMALL and size[1] <= _SMALL and size[2] <= _SMALL
    if not is_small:
        points = _own_array(points, prim, "points", report)
        counts = _own_array(counts, prim, "faceVertexCounts", report)
        indices = _own_array(indices, prim, "faceVertexIndices", report)
        size = len(points), len(counts), len(indices)
    if not (size[0] and size[1]):
        report.warn(EMPTY, prim.GetPath(), "mesh without points or faces")
        return None
    if skin is not None:
        points, skin = pose(np.asarray(points), skin, prim, report)
        source = source._replace(skin=skin)
    names = authored.names
    holes = _read_holes(prim, size[1], time, report) if "holeIndices" in names else None
    scheme = _SCHEMES[0]
    if "subdivisionScheme" in names:
        scheme = get_value(get_attribute(prim, "subdivisionScheme"), time)
    if scheme not in _SCHEMES:
        attributes = AttributeReader(prim, time, INVALID_VALUE, report)
        scheme = attributes.token("subdivisionScheme", _SCHEMES[0], _SCHEMES)
    is_refined = level > 0 and scheme in SUBDIVISION_SCHEMES
    # Its fields by name would take twice as long, for every mesh.
    cage = (source, points, counts, indices, size, holes, scheme, scheme in SMOOTH_SCHEMES, is_refined)
    return tuple.__new__(Cage, cage)


def _cut(cages: Sequence[Cage], report: Report) -> list[CutMesh | None]:
    """Return the triangles of cages, or of the surfaces that they are cages of; None for unreadable ones."""
    drawn = [cage for cage in cages if not cage.is_refined]
    shapes = cut_cages(drawn, join_cages(drawn, report)) if drawn else []
    if len(drawn) == len(cages):
        return [*shapes]
    own = iter(shapes)
    return [_refine(cage, report) if cage.is_refined else next(own) for cage in cages]


def _refine(mesh: Cage, report: Report) -> CutMesh | None:
    """Return the triangles of a subdivision surface, or of its cage where that has none; None where unreadable."""
    try:
        joined = join_cages([mesh], report)
        cage = cut_cages([mesh], joined)[0]
        if not len(cage.layout.triangles):
            return cage
        prim, time = mesh.source.prim, mesh.source.time
        attributes = AttributeReader(prim, time, INVALID_VALUE, report)
        topology = _cage_topology(len(cage.points), joined.polygons)
        surface = read_surface(prim, mesh.source.level, topology, attributes, time, report, scheme=mesh.scheme)
        if surface is None:
            return cage
        shape = _refined_shape(cage, surface, joined.polygons, joined.is_shown)
    except Tf.ErrorException as error:
        report_unreadable(mesh.source.prim, error, report)
        return None
    if not len(shape.layout.triangles):
        message = "interpolateBoundary none leaves no face: all of them are at a boundary"
        report.warn(EMPTY, prim.GetPath(), message)
    return shape


def _finish(cages: Sequence[Cage], shapes: Sequence[CutMesh], report: Report) -> list[MeshSource | None]:
    """Return the meshes of some triangles, with all that is looked up at their corners; None for unreadable ones."""
    have_normals = [_may_have_normals(cage) for cage in cages]
    plain = read_plain_values([cage.source for cage in cages], have_normals, report)
    turned = list(shapes)
    normals = [shape.normals for shape in shapes]
    unreadable = set()
    for k, cage in enumerate(cages):
        if cage.source.authored.names.isdisjoint(_TURNING):
            continue
        try:
            turned[k], normals[k] = _with_normals(cage, shapes[k], have_normals[k], plain[k].normals, report)
        except Tf.ErrorException as error:
            report_unreadable(cage.source.prim, error, report)
            unreadable.add(k)
    held = [(k, one) for k, one in enumerate(normals) if one is not None]
    known = hold_throughout([one.values for _, one in held], have_length)
    for (k, one), are_known in zip(held, known, strict=True):
        if not are_known:
            normals[k] = repair_normals(one, turned[k].points, turned[k].layout.triangles)
    built: list[MeshSource | None] = []
    for k, (cage, shape, own, values) in enumerate(zip(cages, turned, normals, plain, strict=True)):
        if k in unreadable:
            built.append(None)
            continue
        try:
            built.append(_built(cage.source, shape, own, values.primvars, report))
        except Tf.ErrorException as error:
            report_unreadable(cage.source.prim, error, report)
            built.append(None)
    return built


def _may_have_normals(cage: Cage) -> bool:
    """Return whether a mesh may have normals that count."""
    return cage.scheme == "none" and not cage.source.authored.names.isdisjoint(_NORMALS)


def _with_normals(
    mesh: Cage, shape: CutMesh, has_normals: bool, plain: PlainRows | None, report: Report
) -> tuple[CutMesh, Primvar | None]:
    """Return the triangles of a mesh, the right side out, and its normals, some of which may have no length."""
    prim, authored, skin, time, *_ = mesh.source
    if "orientation" in authored.names:
        attributes = AttributeReader(prim, time, INVALID_VALUE, report)
        if attributes.token("orientation", ORIENTATIONS[0], ORIENTATIONS) == "leftHanded":
            shape = _turned(shape)
    if has_normals:
        normals = None if plain is None else plain.lay_out(shape.layout)
        if normals is None:
            normals = read_normals(UsdGeom.Mesh(prim), shape.layout, time, report)
        if normals is not None and skin is not None:
            normals = pose_normals(normals, shape.layout, skin)
        return shape, normals
    if mesh.scheme != "none" and _has_normals(prim, authored.names, time):
        message = f"its normals do not count: the subdivision surface ({mesh.scheme}) has its own"
        report.warn(UNUSED_NORMALS, prim.GetPath(), message)
    return shape, shape.normals


def _built(
    source: Source,
    shape: CutMesh,
    normals: Primvar | None,
    plain: Sequence[PlainRows | PlainConstant] | None,
    report: Report,
) -> MeshSource:
    """Return the mesh of some triangles, with its primvars and subsets."""
    layout = shape.layout
    primvars = None if plain is None else _laid_out(plain, layout)
    if primvars is None:
        primvars = read_primvars(source.prim, layout, source.time, report)
    slots: np.ndarray | None = None
    subsets: tuple[str, ...] = ()
    if source.may_have_subsets:
        slots, subsets = read_face_slots(source.prim, layout.face_count, source.time, report)
    triangle_slots = None if slots is None else slots[layout.face_ids]
    face_ids = None if shape.is_one_to_one else layout.face_ids
    # By position: names take a third longer, for every mesh.
    mesh = Mesh(shape.points, layout.triangles, normals, primvars, triangle_slots, face_ids, shape.is_closed)
    return MeshSource(mesh, subsets)


def _laid_out(plain: Sequence[PlainRows | PlainConstant], layout: Layout) -> dict[str, Primvar] | None:
    """Return primvars by name; None where one has more or fewer values than there are elements."""
    found = {}
    for rows in plain:
        primvar = rows.lay_out(layout)
        if primvar is None:
            return None
        found[rows.name] = primvar
    return found


def _has_normals(prim: Usd.Prim, names: Collection[str], time: Usd.TimeCode) -> bool:
    """Return whether normals are authored, and there are some."""
    return any(name in names and prim.GetAttribute(name).Get(time) for name in _NORMALS)


def _cage_topology(point_count: int, polygons: Polygons) -> Topology:
    """Return the topology of polygons, without creases."""
    return Topology(
        vertex_count=point_count,
        counts=polygons.counts.astype(np.int64),
        corners=polygons.indices[polygons.corners].astype(np.int64),
        creases=np.zeros((0, 2), np.int64),
        crease_sharpness=np.zeros(0),
        vertex_sharpness=np.zeros(point_count),
    )


def _refined_shape(cage: CutMesh, surface: Surface, polygons: Polygons, is_shown: np.ndarray) -> CutMesh:
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
        return CutMesh(
            surface.linear(cage.points.astype(np.float64)).astype(np.float32), layout, None, is_closed, False
        )
    points, normals, normal_rows = surface.limit(cage.points.astype(np.float64))
    rows = Primvar(normals.astype(np.float32), normal_rows[corners].astype(np.int32))
    return CutMesh(points.astype(np.float32), layout, rows, is_closed, False)


def _turned(shape: CutMesh) -> CutMesh:
    """Return a shape with its other side out."""
    swap = [0, 2, 1]
    layout = replace(shape.layout, triangles=shape.layout.triangles[:, swap], corners=shape.layout.corners[:, swap])
    normals = shape.normals
    if normals is not None and normals.indices is not None:
        normals = Primvar(-normals.values, normals.indices[:, swap])
    return shape._replace(layout=layout, normals=normals)


def _own_array(value: Any, prim: Usd.Prim, name: str, report: Report) -> Any:
    """Return points, shape [n, 3], or integers: none where they are absent or, told, of a wrong type."""
    if type(value) is (Vt.Vec3fArray if name == "points" else Vt.IntArray):
        return value if len(value) <= _SMALL else np.array(value)
    array = vector_rows(value, 3) if name == "points" else signed_integers(value)
    if array is not None:
        return array
    if value is not None:
        report.warn(BAD_TOPOLOGY, prim.GetPath(), f"{name} holds a {type(value).__name__}")
    return np.zeros((0, 3), np.float32) if name == "points" else np.zeros(0, np.int32)


def _read_holes(prim: Usd.Prim, face_count: int, time: Usd.TimeCode, report: Report) -> np.ndarray | None:
    """Return which faces ``holeIndices`` takes away: bool, shape [face_count]."""
    value = prim.GetAttribute("holeIndices").Get(time)
    holes = integers(value)
    if holes is None:
        if value is not None:
            report.warn(BAD_TOPOLOGY, prim.GetPath(), f"holeIndices holds a {type(value).__name__}")
        return None
    inside = (holes >= 0) & (holes < face_count)
    if not inside.all():
        report.warn(BAD_HOLE, prim.GetPath(), f"{(~inside).sum()} holeIndices name no face")
    is_hole = np.zeros(face_count, bool)
    is_hole[holes[inside]] = True
    return is_hole
