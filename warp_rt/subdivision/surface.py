# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A subdivision surface, refined: its limit points and normals, and the values that are interpolated over it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warp_rt.subdivision.face_varying import RULES, seam_topology
from warp_rt.subdivision.limit import Limit
from warp_rt.subdivision.refine import Step
from warp_rt.subdivision.topology import INFINITE, Topology

BOUNDARIES = ("edgeAndCorner", "edgeOnly", "none")
"""Tokens of ``interpolateBoundary``, the default first."""


@dataclass(frozen=True, eq=False)
class Rules:
    """What UsdGeomMesh says of a subdivision surface, by its tokens."""

    is_loop: bool = False
    is_bilinear: bool = False
    """Faces are split, and nothing is smoothed."""
    boundary: str = BOUNDARIES[0]
    face_varying: str = RULES[0]
    smooth_triangles: bool = False


class Surface:
    """A cage refined so many times.

    Args:
        cage: Its topology; of triangles for Loop's scheme.
        rules: How it is refined.
        level: Number of refinements, at least 1.
    """

    def __init__(self, cage: Topology, rules: Rules, level: int) -> None:
        self.rules = rules
        self.level = level
        sharpness = cage.vertex_sharpness
        if not rules.is_bilinear:
            is_corner = _is_torn(cage)
            if rules.boundary == BOUNDARIES[0]:
                is_corner |= cage.is_boundary_vertex & (cage.vertex_face_count == 1)
            sharpness = np.where(is_corner, INFINITE, sharpness)
        self.cage = Topology(
            cage.vertex_count, cage.counts, cage.corners, cage.creases, cage.crease_sharpness, sharpness
        )
        self._steps = self._refine(self.cage)

    @property
    def topology(self) -> Topology:
        """Of the refined mesh."""
        return self._steps[-1].child

    @cached_property
    def cage_face(self) -> np.ndarray:
        """The cage's face that each refined face is part of: int64, shape [f]."""
        face = self._steps[-1].parent_face
        for step in reversed(self._steps[:-1]):
            face = step.parent_face[face]
        return face

    @property
    def has_surface(self) -> np.ndarray:
        """Whether each face of the cage has a surface: bool, shape [faces].

        Without boundary rules, those have none that have a corner where the boundary is not creased for ever.
        """
        cage = self.cage
        if self.rules.boundary != BOUNDARIES[2] or self.rules.is_bilinear:
            return np.ones(len(cage.counts), bool)
        is_open = (cage.edge_face_count == 1) & (cage.crease_of_edge < INFINITE)
        touches = np.bincount(cage.face, cage.sum_at_ends(is_open.astype(float))[cage.corners], len(cage.counts))
        return touches == 0

    def limit(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return limit points of the cage's [n, 3], unit normals, and the normal of each refined corner."""
        refined = self.smooth(points)
        return self._limit.values(refined), *self._limit.normals(refined)

    def values(self, values: np.ndarray) -> np.ndarray:
        """Return values of vertices, shape [n, k], on the limit surface, as its points are: float64."""
        return self.linear(values) if self.rules.is_bilinear else self._limit.values(self.smooth(values))

    @cached_property
    def _limit(self) -> Limit:
        return Limit(self.topology, self.rules.is_loop)

    def smooth(self, values: np.ndarray) -> np.ndarray:
        """Return values of vertices, shape [n, k], at the refined vertices, by the rules that points follow."""
        if self.rules.is_bilinear:
            return self.linear(values)
        for step in self._steps:
            values = step.smooth(values)
        return values

    def linear(self, values: np.ndarray) -> np.ndarray:
        """Return values of vertices, shape [n, k], at the refined vertices, by linear interpolation."""
        for step in self._steps:
            values = step.linear(values)
        return values

    def face_varying(self, values: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return values of corners on the limit surface, float64, shape [m, k], and the row of each refined corner.

        Args:
            values: Shape [n, k].
            rows: The value of each of the cage's corners, shape [c]: where those of neighbours differ, there is a seam.
        """
        seams, first = seam_topology(self.cage, rows, self.rules.face_varying)
        steps = self._refine(seams)
        values = values[rows[first]].astype(np.float64)
        is_linear = self.rules.is_bilinear or self.rules.face_varying == "all"
        for step in steps:
            values = step.linear(values) if is_linear else step.smooth(values)
        refined = steps[-1].child
        return values if is_linear else Limit(refined, self.rules.is_loop).values(values), refined.corners

    def _refine(self, topology: Topology) -> list[Step]:
        steps = [Step(topology, self.rules.is_loop, self.rules.smooth_triangles)]
        for _ in range(self.level - 1):
            steps.append(Step(steps[-1].child, self.rules.is_loop))
        return steps


def _is_torn(cage: Topology) -> np.ndarray:
    """Return which vertices are corners because the faces around them make no surface, shape [vertex_count].

    All at which these are no ring and no fan, but for those on a crease between fins: two edges of more than two faces
    each, no boundary. (OpenSubdiv, Far::TopologyRefinerFactory, sharpens the same.)
    """
    is_torn = ~cage.is_manifold_vertex
    if not is_torn.any():
        return is_torn
    is_rim = cage.edge_face_count == 1
    edges, rims, odd = (
        cage.sum_at_ends(which.astype(float)) for which in (np.ones_like(is_rim), is_rim, cage.is_seam & ~is_rim)
    )
    is_between_fins = (odd == 2) & (rims == 0) & (cage.vertex_face_count > edges)
    return is_torn & ~is_between_fins & (cage.vertex_face_count > 0)
