# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Faces, edges and their sharpness: what a subdivision rule looks at."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

INFINITE = 10.0
"""Sharpness that no refinement wears off (UsdGeomMesh: SHARPNESS_INFINITE)."""


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a topology, where they need not be found by sorting."""

    ends: np.ndarray
    """int64, shape [e, 2]."""
    of_corner: np.ndarray
    """int64, shape [c], edge of each corner."""
    sharpness: np.ndarray
    """float64, shape [e]; that of seams is infinite without being said here."""


@dataclass(frozen=True, eq=False)
class Topology:
    """Faces over vertices, with the sharpness of edges and vertices.

    A corner is a vertex of a face; corners of a face lie one after the other, and a corner also stands for the edge
    that leads from it to the next.
    """

    vertex_count: int
    counts: np.ndarray
    """int64, shape [f], corners of each face, three or more."""
    corners: np.ndarray
    """int64, shape [c], vertex of each corner."""
    creases: np.ndarray
    """int64, shape [k, 2], ends of the edges that are sharp."""
    crease_sharpness: np.ndarray
    """float64, shape [k]."""
    vertex_sharpness: np.ndarray
    """float64, shape [vertex_count]; that of boundaries is not among it."""
    known_edges: Edges | None = None
    """Says all about edges, creases included; None: they are found."""

    @cached_property
    def size(self) -> int:
        """Corners of each face, where all have the same number; else 0."""
        return int(self.counts[0]) if len(self.counts) and (self.counts == self.counts[0]).all() else 0

    @cached_property
    def starts(self) -> np.ndarray:
        """First corner of each face, int64, shape [f]."""
        return np.cumsum(self.counts) - self.counts

    @cached_property
    def face(self) -> np.ndarray:
        """Face of each corner, int64, shape [c]."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @cached_property
    def following(self) -> np.ndarray:
        """The next corner of the same face, int64, shape [c]."""
        if self.size:
            return np.roll(np.arange(len(self.corners)).reshape(-1, self.size), -1, axis=1).reshape(-1)
        following = np.arange(1, len(self.corners) + 1)
        following[self.starts + self.counts - 1] = self.starts
        return following

    @cached_property
    def preceding(self) -> np.ndarray:
        """The corner before of the same face, int64, shape [c]."""
        if self.size:
            return np.roll(np.arange(len(self.corners)).reshape(-1, self.size), 1, axis=1).reshape(-1)
        preceding = np.empty_like(self.following)
        preceding[self.following] = np.arange(len(self.corners))
        return preceding

    @cached_property
    def _edges(self) -> tuple[np.ndarray, np.ndarray]:
        if self.known_edges is not None:
            return self.known_edges.ends, self.known_edges.of_corner
        ends = np.sort(np.stack([self.corners, self.corners[self.following]], axis=1), axis=1)
        keys, edge = np.unique(self._key(ends), return_inverse=True)
        return np.stack(np.divmod(keys, max(self.vertex_count, 1)), axis=1), edge.reshape(-1)

    @property
    def edges(self) -> np.ndarray:
        """Both ends of each edge: int64, shape [e, 2]."""
        return self._edges[0]

    @property
    def edge(self) -> np.ndarray:
        """Edge of each corner, int64, shape [c]."""
        return self._edges[1]

    @cached_property
    def edge_face_count(self) -> np.ndarray:
        """Faces at each edge, int64, shape [e]."""
        return np.bincount(self.edge, minlength=len(self.edges))

    @cached_property
    def is_seam(self) -> np.ndarray:
        """Whether an edge joins no two faces that agree on a side, shape [e]: boundaries, and what is no surface."""
        is_forward = self.corners < self.corners[self.following]
        forward = np.bincount(self.edge, is_forward, len(self.edges))
        return (self.edge_face_count != 2) | (forward != 1)

    @cached_property
    def _crease_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Edge of each crease, int64, shape [k]; whether there is such an edge."""
        keys = self._key(self.edges)  # in rising order, the lower end first
        wanted = self._key(np.sort(self.creases, axis=1))
        if not len(keys):
            return np.zeros(len(wanted), np.int64), np.zeros(len(wanted), bool)
        row = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        return row, keys[row] == wanted

    @property
    def lost_crease_count(self) -> int:
        """Creases that lie along no edge."""
        return int((~self._crease_rows[1]).sum())

    @cached_property
    def crease_of_edge(self) -> np.ndarray:
        """Sharpness that creases give each edge, float64, shape [e]; of several the last one's, as in OpenSubdiv."""
        if self.known_edges is not None:
            return self.known_edges.sharpness
        sharpness = np.zeros(len(self.edges))
        row, is_edge = self._crease_rows
        sharpness[row[is_edge]] = self.crease_sharpness[is_edge]
        return sharpness

    @cached_property
    def edge_sharpness(self) -> np.ndarray:
        """Sharpness of each edge, float64, shape [e]; boundaries and edges that join no two faces are infinite."""
        return np.where(self.is_seam, INFINITE, self.crease_of_edge)

    @cached_property
    def vertex_face_count(self) -> np.ndarray:
        """Corners at each vertex, int64, shape [vertex_count]."""
        return np.bincount(self.corners, minlength=self.vertex_count)

    @cached_property
    def twin(self) -> np.ndarray:
        """The corner on the other side of each corner's edge, int64, shape [c]; -1 across a seam."""
        is_forward = self.corners < self.corners[self.following]
        sides = np.full((2, len(self.edges)), -1)
        rows = np.arange(len(self.corners))
        for side in (0, 1):
            own = np.flatnonzero(is_forward == bool(side))
            sides[side, self.edge[own]] = rows[own]
        other = np.where(is_forward, sides[0, self.edge], sides[1, self.edge])
        return np.where(self.is_seam[self.edge], -1, other)

    def sum_at_ends(self, values: np.ndarray) -> np.ndarray:
        """Return for each vertex the sum of a number of its edges, shape [vertex_count]."""
        if not values.any():
            return np.zeros(self.vertex_count)
        return np.bincount(self.edges.reshape(-1), np.repeat(values, 2), self.vertex_count)

    @cached_property
    def is_manifold_vertex(self) -> np.ndarray:
        """Whether the faces at a vertex follow one another around it, as a ring or a fan, shape [vertex_count].

        Vertices at an edge that joins no two faces, and is no boundary, are none.
        """
        onward = self.twin[self.preceding]
        start = np.full(self.vertex_count, -1)
        start[self.corners] = np.arange(len(self.corners))
        opens = np.flatnonzero(self.is_seam[self.edge])
        start[self.corners[opens]] = opens
        met = np.zeros(self.vertex_count, np.int64)
        at = start[start >= 0]
        while len(at):
            met[self.corners[at]] += 1
            at = onward[at]
            at = at[at >= 0]
            at = at[at != start[self.corners[at]]]
        is_odd = self.is_seam & (self.edge_face_count != 1)
        return (met == self.vertex_face_count) & (self.sum_at_ends(is_odd.astype(float)) == 0)

    @cached_property
    def is_boundary_vertex(self) -> np.ndarray:
        """Whether a seam edge ends at a vertex, shape [vertex_count]."""
        return self.sum_at_ends(self.is_seam.astype(float)) > 0

    def _key(self, ends: np.ndarray) -> np.ndarray:
        return ends[:, 0] * np.int64(max(self.vertex_count, 1)) + ends[:, 1]


def wear(sharpness: np.ndarray) -> np.ndarray:
    """Return what one refinement leaves of sharpness: float64, any shape."""
    return np.where(sharpness >= INFINITE, INFINITE, np.maximum(sharpness - 1.0, 0.0))
