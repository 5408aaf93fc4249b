# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Polygon meshes to triangles, many at a time.

NumPy takes about a microsecond a call, however little there is to do, and a mesh takes a hundred calls. So the arrays
of many meshes are put one after the other, and each step is taken once for all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pxr import Vt

from warp_rt.report import Report
from warp_rt.scene import Primvar
from warp_rt.triangulate import triangulate
from warp_rt.usd.arrays import concatenated
from warp_rt.usd.polygons import MAX_COORDINATE, Polygons, drawable_polygons, smooth_normals
from warp_rt.usd.primvars import Layout
from warp_rt.usd.sources import Source
from warp_rt.usd.volumes import enclose_volumes


class Cage(NamedTuple):
    """A mesh as its arrays say it; there are points and faces."""

    source: Source
    """With the skin that fits it."""
    points: np.ndarray | Vt.Vec3fArray
    """float32, shape [n, 3]."""
    counts: np.ndarray | Vt.IntArray
    """Corners of each face, any integers, shape [f]."""
    indices: np.ndarray | Vt.IntArray
    """Vertex of each corner, any integers, shape [c]."""
    size: tuple[int, int, int]
    """n, f and c."""
    holes: np.ndarray | None
    """bool, shape [f], which faces are not drawn; None: all are."""
    scheme: str
    """Of its subdivision."""
    is_smooth: bool
    """Whether it has normals that change smoothly over its faces."""
    is_refined: bool
    """Whether it is the cage of a surface that is drawn instead."""


class CutMesh(NamedTuple):
    """The triangles of a mesh, whichever way they came about."""

    points: np.ndarray
    """float32, shape [n, 3], all of them finite."""
    layout: Layout
    normals: Primvar | None
    """Those of a smooth surface."""
    is_closed: bool
    is_one_to_one: bool
    """Whether triangle k is face k."""


class JoinedCages(NamedTuple):
    """The arrays of several cages, one after the other."""

    points: np.ndarray
    """float32, shape [n, 3], all of them finite."""
    polygons: Polygons
    """The faces that can be drawn, holes included. ``faces`` count within their cage."""
    is_shown: np.ndarray
    """bool, which of them are no holes."""
    point_first: np.ndarray
    """First point of each cage, and the end; so too of its faces, of ``polygons`` and of its corners."""
    face_first: np.ndarray
    polygon_first: np.ndarray
    corner_first: np.ndarray


def cut_cages(cages: Sequence[Cage], joined: JoinedCages) -> list[CutMesh]:
    """Return the triangles of cages, at least of one.

    Args:
        cages: The cages.
        joined: Their arrays.
    """
    shown = joined.polygons if joined.is_shown.all() else joined.polygons[joined.is_shown]
    corners, rows = triangulate(joined.points, shown.starts, shown.counts, shown.indices)
    # The corners of a cage's triangles all lie between its first and the next one's.
    ends = np.searchsorted(corners[:, 0], joined.corner_first)
    counts = np.diff(ends)
    triangles = shown.indices[corners]
    is_closed = enclose_volumes(joined.points, triangles, counts)
    face_ids = shown.faces[rows].astype(np.int32)
    normals = _smooth_normals(cages, joined)
    numbers = np.arange(len(face_ids))
    if len(cages) > 1:
        corners = corners - np.repeat(joined.corner_first[:-1], counts)[:, None]
        triangles = triangles - np.repeat(joined.point_first[:-1], counts)[:, None]
        numbers = numbers - np.repeat(ends[:-1], counts)
    corners, triangles = corners.astype(np.int32, copy=False), triangles.astype(np.int32, copy=False)
    others_before = np.concatenate([[0], np.cumsum(face_ids != numbers)])[ends]
    is_one_to_one = (np.diff(others_before) == 0).tolist()
    found = []
    slices = map(_slices, (ends, joined.point_first))
    places = zip(cages, is_closed.tolist(), is_one_to_one, *slices, strict=True)
    for cage, closed, one_to_one, own, rows_of_points in places:
        point_count, face_count, corner_count = cage.size
        layout = Layout(point_count, face_count, corner_count, triangles[own], face_ids[own], corners[own])
        smooth = None
        if normals is not None and cage.is_smooth:
            smooth = Primvar(normals[rows_of_points], layout.triangles)  # the very same array, which is uploaded once
        found.append(CutMesh(joined.points[rows_of_points], layout, smooth, closed, one_to_one))
    return found


def join_cages(cages: Sequence[Cage], report: Report) -> JoinedCages:
    """Return the arrays of cages, at least of one, one after the other; bad faces are left out with a diagnostic."""
    points = concatenated([cage.points for cage in cages])
    counts = concatenated([cage.counts for cage in cages])
    indices = concatenated([cage.indices for cage in cages])
    sizes = np.array([(0, 0, 0), *(cage.size for cage in cages)])
    point_first, face_first, corner_first = sizes.T.cumsum(axis=1)
    is_usable = np.abs(points) <= MAX_COORDINATE
    is_usable = np.ones(len(points), bool) if is_usable.all() else is_usable.all(axis=1)
    vertices = np.diff(point_first)  # that indices may name
    if len(cages) > 1:
        vertices = np.repeat(vertices, np.diff(corner_first))
    is_damaged = np.add.reduceat(counts, face_first[:-1]) != np.diff(corner_first)
    for is_good, first in (
        (is_usable, point_first),
        (counts >= 3, face_first),
        ((indices >= 0) & (indices < vertices), corner_first),
    ):
        is_damaged[np.searchsorted(first, np.flatnonzero(~is_good), "right") - 1] = True
    if len(cages) > 1:
        indices = indices + np.repeat(point_first[:-1], np.diff(corner_first))
    if is_damaged.any():
        points = np.where(is_usable[:, None], points, np.float32(0))
        parts = [
            drawable_polygons(
                is_usable[own],
                np.asarray(cage.counts),
                np.asarray(cage.indices),
                str(cage.source.prim.GetPath()),
                report,
            )
            if damaged
            else _all_polygons(np.asarray(cage.counts), indices)
            for cage, damaged, own in zip(cages, is_damaged, _slices(point_first), strict=True)
        ]
        polygons = Polygons(
            np.concatenate([part.faces for part in parts]),
            np.concatenate([part.starts + first for part, first in zip(parts, corner_first[:-1], strict=True)]),
            np.concatenate([part.counts for part in parts]),
            indices,
        )
        polygon_first = np.concatenate([[0], np.cumsum([len(part.faces) for part in parts])])
    else:
        polygons, polygon_first = _all_polygons(counts, indices), face_first
        if len(cages) > 1:
            faces = polygons.faces - np.repeat(face_first[:-1], np.diff(face_first))
            polygons = Polygons(faces, polygons.starts, polygons.counts, indices)
    is_shown = np.ones(len(polygons.faces), bool)
    for row, cage in enumerate(cages):
        if cage.holes is not None:
            own = slice(polygon_first[row], polygon_first[row + 1])
            is_shown[own] = ~cage.holes[polygons.faces[own]]
    return JoinedCages(points, polygons, is_shown, point_first, face_first, polygon_first, corner_first)


def _all_polygons(counts: np.ndarray, indices: np.ndarray) -> Polygons:
    return Polygons(np.arange(len(counts)), np.cumsum(counts) - counts, counts, indices)


def _smooth_normals(cages: Sequence[Cage], joined: JoinedCages) -> np.ndarray | None:
    """Return normals at the points of all cages that are smooth; None where there are none of those."""
    is_smooth = np.array([cage.is_smooth for cage in cages])
    if not is_smooth.any():
        return None
    if is_smooth.all():
        # A hole is still part of the surface that the normals belong to.
        return smooth_normals(joined.points, joined.polygons)
    return smooth_normals(joined.points, joined.polygons[np.repeat(is_smooth, np.diff(joined.polygon_first))])


def _slices(ends: np.ndarray) -> list[slice]:
    """Return the slices between numbers that follow one another."""
    bounds = ends.tolist()
    return list(map(slice, bounds[:-1], bounds[1:]))
