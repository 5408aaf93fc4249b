# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The limit surface, at the vertices of a refined mesh of quadrilaterals or triangles: points, values and normals.

Position is a matter of the vertex; each sector has a normal of its own, the cross product of two tangents that are
weighted sums of the neighbours.
"""

from __future__ import annotations

import numpy as np

from warp_rt.subdivision.limit_masks import (
    Fans,
    Ring,
    cross,
    regular_limits,
    regular_normals,
    sector_limits,
    sector_normals,
    unit,
)
from warp_rt.subdivision.refine import Step
from warp_rt.subdivision.sectors import Kind, Sectors, find_sectors, vertex_kinds
from warp_rt.subdivision.topology import INFINITE, Edges, Topology


class Limit:
    """Where the vertices of a topology go as refinement goes on for ever.

    Faces are quadrilaterals, or triangles for Loop's scheme. Around vertices at which sharpness has still to wear off,
    it is refined until it has.

    Args:
        topology: Faces and edges.
        is_loop: Whether the scheme is Loop's.
        wanted: Which vertices are asked for, bool, shape [vertex_count]; None: all.
    """

    def __init__(self, topology: Topology, is_loop: bool, wanted: np.ndarray | None = None) -> None:
        self._topology = topology
        self._is_loop = is_loop
        is_wearing = _are_wearing(topology)
        if wanted is not None:
            is_wearing &= wanted
        self._wearing = _Wearing(topology, is_loop, is_wearing) if is_wearing.any() else None
        settled = ~is_wearing if wanted is None else wanted & ~is_wearing
        self._regular, self._rings = np.zeros(0, np.int64), np.zeros((0, _REGULAR_VALENCE[is_loop]), np.int64)
        self._around: Sectors | None = None
        if not settled.any():
            return
        onward = topology.twin[topology.preceding]
        self._regular, self._rings = _regular_rings(topology, onward, settled, _REGULAR_VALENCE[is_loop])
        is_left = settled[topology.corners]
        is_left[self._rings] = False
        if is_left.any():
            self._around = find_sectors(topology, onward, is_left)
            self._kind = vertex_kinds(topology, self._around)[self._around.vertex]

    def values(self, values: np.ndarray) -> np.ndarray:
        """Return the limit of values of any kind: float64, shape [n, k]; of vertices not wanted, the values."""
        values = values.astype(np.float64)
        moved = values.copy()
        moved[self._regular] = regular_limits(values[self._regular], self._ring(values))
        if self._around is not None:
            at = self._around.vertex
            moved[at] = sector_limits(values[at], self._around, self._kind, self._fans(values, self._around))
        if self._wearing is not None:
            moved[self._wearing.vertices] = self._wearing.values(values)
        return moved

    def normals(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return unit normals of the limit of points, shape [s, 3], and the one of each corner, int64, shape [c].

        They are zero where tangents have no length; corners of vertices that are not wanted have -1.
        """
        points = points.astype(np.float64)
        around = self._around
        rows = np.full(len(self._topology.corners), -1)
        found = [regular_normals(self._ring(points))]
        rows[self._rings] = np.arange(len(self._regular))[:, None]
        if around is not None:
            fans = self._fans(points, around)
            rows[around.corners] = len(self._regular) + around.sector
            found.append(sector_normals(points[around.vertex], around, self._kind, fans))
            # The surface has no tangent plane at a corner: each of its faces goes its own way.
            pinned = np.flatnonzero(self._kind[around.sector] == Kind.CORNER)
            own = around.corners[pinned]
            here = points[self._topology.corners[own]]
            rows[own] = sum(map(len, found)) + np.arange(len(own))
            found.append(unit(cross(fans.spoke[pinned] - here, fans.last[pinned] - here)))
        if self._wearing is not None:
            later, own = self._wearing.normals(points)
            rows[self._wearing.corners] = sum(map(len, found)) + own
            found.append(later)
        return np.concatenate(found), rows

    def _ring(self, values: np.ndarray) -> Ring:
        topology = self._topology
        opening = [topology.following[ring] for ring in self._rings.T]
        beyond = [] if self._is_loop else [topology.following[corner] for corner in opening]
        spokes, across = ([values.take(topology.corners[at], axis=0) for at in part] for part in (opening, beyond))
        return Ring(spokes, across)

    def _fans(self, values: np.ndarray, around: Sectors) -> Fans:
        topology, is_loop = self._topology, self._is_loop
        following = topology.following[around.corners]
        return Fans(
            spoke=values[topology.corners[following]],
            last=values[topology.corners[topology.preceding[around.corners]]],
            across=None if is_loop else values[topology.corners[topology.following[following]]],
        )


class _Wearing:
    """The limit at vertices where sharpness has still to wear off: that of the faces around them, refined once.

    Args:
        topology: Of all faces.
        is_loop: Whether the scheme is Loop's.
        is_wearing: Which vertices they are, shape [vertex_count].
    """

    def __init__(self, topology: Topology, is_loop: bool, is_wearing: np.ndarray) -> None:
        self.vertices = np.flatnonzero(is_wearing)
        at_corner = is_wearing[topology.corners]
        part = np.flatnonzero((np.bincount(topology.face, at_corner) > 0)[topology.face])
        self.corners = part[at_corner[part]]
        self._used, corners = np.unique(topology.corners[part], return_inverse=True)
        edges, edge = np.unique(topology.edge[part], return_inverse=True)
        around = Topology(
            vertex_count=len(self._used),
            counts=topology.counts[np.unique(topology.face[part])],
            corners=corners.reshape(-1),
            creases=np.zeros((0, 2), np.int64),
            crease_sharpness=np.zeros(0),
            vertex_sharpness=topology.vertex_sharpness[self._used],
            known_edges=Edges(
                ends=np.searchsorted(self._used, topology.edges[edges]),
                of_corner=edge.reshape(-1),
                sharpness=topology.edge_sharpness[edges],
            ),
        )
        self._step = Step(around, is_loop)
        child = self._step.child
        self._own = np.searchsorted(self._used, self.vertices)
        wanted = np.zeros(child.vertex_count, bool)
        wanted[self._own] = True
        self._limit = Limit(child, is_loop, wanted)
        # The refined face at a corner begins there.
        corner = np.flatnonzero(at_corner[part])
        self._child_corners = 3 * (corner // 3 * 4 + corner % 3) if is_loop else 4 * corner

    def values(self, values: np.ndarray) -> np.ndarray:
        """Return the limit of values [n, k] at ``vertices``."""
        return self._limit.values(self._step.smooth(values[self._used]))[self._own]

    def normals(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return unit normals [s, 3], and the one of each of ``corners``."""
        normals, rows = self._limit.normals(self._step.smooth(points[self._used]))
        return normals, rows[self._child_corners]


_REGULAR_VALENCE = {False: 4, True: 6}  # by whether the scheme is Loop's


def _regular_rings(
    topology: Topology, onward: np.ndarray, wanted: np.ndarray, valence: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the smooth vertices of regular valence, shape [r], and the corners around each, counter-clockwise: [r, n].

    Nearly all vertices of a refined surface are such, and their limit needs no search for sectors.
    """
    is_regular = wanted & (topology.vertex_face_count == valence)
    is_regular &= topology.sum_at_ends((topology.edge_sharpness > 0).astype(float)) == 0
    is_regular &= topology.vertex_sharpness == 0
    first = np.zeros(topology.vertex_count, np.int64)
    first[topology.corners] = np.arange(len(topology.corners))
    vertices = np.flatnonzero(is_regular)
    rings = [first[vertices]]
    for _ in range(valence):
        rings.append(onward[rings[-1]])  # no seam is met, for seams are sharp
    returns = (rings[-1] == rings[0]) & np.all([ring != rings[0] for ring in rings[1:-1]], axis=0)
    return vertices[returns], np.stack(rings[:-1], axis=1)[returns]


def _are_wearing(topology: Topology) -> np.ndarray:
    """Return at which vertices sharpness has still to wear off and makes a difference: bool, shape [vertex_count]."""
    sharpness, of_vertex = topology.edge_sharpness, topology.vertex_sharpness
    partly = topology.sum_at_ends(((sharpness > 0) & (sharpness < INFINITE)).astype(float)) > 0
    partly |= (of_vertex > 0) & (of_vertex < INFINITE) & (topology.vertex_face_count > 0)
    if not partly.any():
        return partly
    return partly & (topology.sum_at_ends((sharpness >= INFINITE).astype(float)) <= 2) & (of_vertex < INFINITE)
