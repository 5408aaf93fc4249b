# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""One step of Catmull-Clark or Loop subdivision, of a topology and of values at its vertices.

References: Catmull and Clark (1978), Recursively generated B-spline surfaces; Loop (1987), Smooth subdivision surfaces
based on triangles; DeRose, Kass and Truong (1998), Subdivision surfaces in character animation (sharpness), with the
blending of rules of OpenSubdiv's documentation, "Subdivision Surfaces", semi-sharp creases.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warp_rt.subdivision.topology import Edges, Topology, wear

SMOOTH_TRIANGLE_WEIGHT = 0.470
"""Weight of a triangle's face point in the edge points of ``triangleSubdivisionRule = "smooth"``, 0.25 for others."""


@dataclass(frozen=True, eq=False)
class Step:
    """One refinement of a topology.

    New vertices are the old ones, then one an edge, then (Catmull-Clark) one a face.
    """

    parent: Topology
    is_loop: bool = False
    smooth_triangles: bool = False

    @cached_property
    def child(self) -> Topology:
        """The refined topology."""
        parent = self.parent
        middle = parent.vertex_count + parent.edge
        if self.is_loop:
            a, b, c = middle.reshape(-1, 3).T
            around = np.stack([parent.corners, middle, middle[parent.preceding]], axis=1).reshape(-1, 9)
            corners = np.concatenate([around, np.stack([a, b, c], axis=1)], axis=1).reshape(-1)
            size, face_points = 3, 0
        else:
            center = parent.vertex_count + len(parent.edges) + parent.face
            corners = np.stack([parent.corners, middle, center, middle[parent.preceding]], axis=1).reshape(-1)
            size, face_points = 4, len(parent.counts)
        new = len(parent.edges) + face_points
        sharp = np.flatnonzero(wear(parent.edge_sharpness) > 0)
        point = parent.vertex_count + sharp
        return Topology(
            vertex_count=parent.vertex_count + new,
            counts=np.full(len(corners) // size, size),
            corners=corners,
            creases=np.concatenate([np.stack([parent.edges[sharp, end], point], axis=1) for end in (0, 1)]),
            crease_sharpness=np.tile(wear(parent.edge_sharpness)[sharp], 2),
            vertex_sharpness=np.concatenate([wear(parent.vertex_sharpness), np.zeros(new)]),
            known_edges=self._child_edges(middle, face_points),
        )

    def _child_edges(self, middle: np.ndarray, face_points: int) -> Edges | None:
        """Return the refined edges: both halves of each parent's edge, then one a corner, across its face.

        None where an edge leads from a vertex to itself, whose halves are one.

        Args:
            middle: Refined vertex on the edge of each corner, shape [c].
            face_points: Number of refined vertices in faces.
        """
        parent = self.parent
        ends, corners, edge = parent.edges, parent.corners, parent.edge
        if (ends[:, 0] == ends[:, 1]).any():
            return None
        halves = np.stack([ends, np.broadcast_to(np.arange(len(ends))[:, None] + parent.vertex_count, ends.shape)], 2)
        across = 2 * len(ends) + np.arange(len(corners))
        from_here = 2 * edge + (ends[edge, 1] == corners)
        to_here = from_here ^ 1  # of the corner's edge, the half at its other end
        before = parent.preceding
        if face_points:
            inner = np.stack([middle, parent.vertex_count + len(ends) + parent.face], axis=1)
            of_corner = np.stack([from_here, across, across[before], to_here[before]], axis=1).reshape(-1)
        else:
            # A corner's is that between the middles of its own edge and the one before: it cuts off the corner.
            inner = np.stack([middle, middle[before]], axis=1)
            around = np.stack([from_here, across, to_here[before]], axis=1).reshape(-1, 9)
            of_corner = np.concatenate([around, across.reshape(-1, 3)[:, [1, 2, 0]]], axis=1).reshape(-1)
        worn = wear(parent.edge_sharpness)
        return Edges(
            ends=np.concatenate([halves.reshape(-1, 2), inner]),
            of_corner=of_corner,
            sharpness=np.concatenate([np.repeat(worn, 2), np.zeros(len(corners))]),
        )

    @cached_property
    def parent_face(self) -> np.ndarray:
        """The parent's face that each refined face is part of: int64, shape [faces]."""
        children = np.full(len(self.parent.counts), 4) if self.is_loop else self.parent.counts
        return np.repeat(np.arange(len(self.parent.counts)), children)

    def linear(self, values: np.ndarray) -> np.ndarray:
        """Return values of the refined vertices by linear interpolation: shape [n, k] to [refined n, k]."""
        parts = [values, self._edge_middles(values)]
        return np.concatenate(parts if self.is_loop else [*parts, self._face_points(values)])

    def smooth(self, values: np.ndarray) -> np.ndarray:
        """Return values of the refined vertices by the scheme's rules: float64, shape [n, k] to [refined n, k]."""
        faces = self._face_points(values)
        middle = self._edge_middles(values)
        # Of all rules for edges and vertices, the sharp ones are the boundary's in one dimension less.
        edges = self._smooth_edges(values, faces)
        sharp = np.flatnonzero(self._sharp[0])
        blend = np.clip(self.parent.edge_sharpness[sharp], 0, 1)[:, None]
        edges[sharp] = blend * middle[sharp] + (1 - blend) * edges[sharp]
        corner, crease = self._vertex_blend
        vertices = (1 - corner - crease.sum(axis=1))[:, None] * self._smooth_vertices(values, faces)
        vertices += corner[:, None] * values
        for column, is_sharp in enumerate(self._sharp):
            if not is_sharp.any():
                continue
            along = self._sum_over_edges(self.parent.edges[is_sharp], values)
            vertices += crease[:, column, None] * (0.75 * values + 0.125 * along)
        return np.concatenate([vertices, edges] if self.is_loop else [vertices, edges, faces])

    @cached_property
    def _sharp(self) -> tuple[np.ndarray, np.ndarray]:
        """Which edges are sharp before and after the step."""
        sharpness = self.parent.edge_sharpness
        return sharpness > 0, wear(sharpness) > 0

    @cached_property
    def _vertex_blend(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the weights of the corner rule [n], and of the crease rule along the edges of ``_sharp`` [n, 2]."""
        parent = self.parent
        ends = [parent.sum_at_ends(sharp.astype(float)) for sharp in self._sharp]
        points = (parent.vertex_sharpness > 0, wear(parent.vertex_sharpness) > 0)
        is_corner = [sharp | (count > 2) for sharp, count in zip(points, ends, strict=True)]
        is_crease = [~corner & (count == 2) for corner, count in zip(is_corner, ends, strict=True)]
        is_sharp = is_corner[0] | is_crease[0]
        is_same = (is_corner[0] & is_corner[1]) | (is_crease[0] & is_crease[1])
        # Between two rules: the mean sharpness, up to 1, of what wears off in this step.
        worn_edges = self._sharp[0] & ~self._sharp[1]
        worn_points = points[0] & ~points[1]
        total = parent.sum_at_ends(np.where(worn_edges, parent.edge_sharpness, 0.0))
        total += np.where(worn_points, parent.vertex_sharpness, 0.0)
        count = parent.sum_at_ends(worn_edges.astype(float)) + worn_points
        mean = np.minimum(np.divide(total, count, out=np.zeros_like(total), where=count > 0), 1.0)
        before = np.where(is_same, 1.0, mean) * is_sharp
        after = np.where(is_same, 0.0, 1.0 - mean) * is_sharp
        corner = before * is_corner[0] + after * is_corner[1]
        return corner, np.stack([before * is_crease[0], after * is_crease[1]], axis=1)

    def _edge_middles(self, values: np.ndarray) -> np.ndarray:
        ends = self.parent.edges
        return (values.take(ends[:, 0], axis=0) + values.take(ends[:, 1], axis=0)) / 2

    def _face_points(self, values: np.ndarray) -> np.ndarray:
        size = self.parent.size
        if size:
            corners = self.parent.corners.reshape(-1, size).T
            return np.add.reduce([values.take(corner, axis=0) for corner in corners]) / float(size)
        sums = sum_rows(self.parent.face, values[self.parent.corners], len(self.parent.counts))
        return sums / self.parent.counts[:, None]

    def _smooth_edges(self, values: np.ndarray, faces: np.ndarray) -> np.ndarray:
        parent = self.parent
        count = np.maximum(parent.edge_face_count, 1)[:, None]
        if self.is_loop:
            opposite = parent.corners[parent.preceding]
            across = sum_rows(parent.edge, values[opposite], len(parent.edges))
            return 0.75 * self._edge_middles(values) + 0.25 * across / count
        across = sum_rows(parent.edge, faces[parent.face], len(parent.edges)) / count
        weight = np.full(len(parent.edges), 0.5)
        if self.smooth_triangles:
            own = np.where(parent.counts == 3, 2 * SMOOTH_TRIANGLE_WEIGHT, 0.5)
            weight = np.bincount(parent.edge, own[parent.face], len(parent.edges)) / count[:, 0]
        return (1 - weight)[:, None] * self._edge_middles(values) + weight[:, None] * across

    def _smooth_vertices(self, values: np.ndarray, faces: np.ndarray) -> np.ndarray:
        parent = self.parent
        valence = np.maximum(parent.sum_at_ends(np.ones(len(parent.edges))), 1)[:, None]
        around = self._sum_over_edges(parent.edges, values)
        if self.is_loop:
            beta = loop_beta(valence)
            return (1 - valence * beta) * values + beta * around
        across = sum_rows(parent.corners, faces[parent.face], parent.vertex_count)
        own_faces = np.maximum(parent.vertex_face_count, 1)[:, None]
        return ((valence - 2) * values + around / valence + across / own_faces) / valence

    def _sum_over_edges(self, edges: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Return for each vertex the sum of the vertices at the other ends of some edges."""
        near, far = np.concatenate([edges, edges[:, ::-1]]).T
        return sum_rows(near, values.take(far, axis=0), self.parent.vertex_count)


def loop_beta(valence: np.ndarray) -> np.ndarray:
    """Return the weight of each neighbour in Loop's rule for vertices, by how many there are: float64, shape [n]."""
    return (0.625 - (0.375 + 0.25 * np.cos(2 * np.pi / valence)) ** 2) / valence


def sum_rows(rows: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Return the sums of values by row: float64, shape [count, k] of [m, k]."""
    return np.stack([np.bincount(rows, column, count) for column in values.T], axis=1).reshape(count, -1)
