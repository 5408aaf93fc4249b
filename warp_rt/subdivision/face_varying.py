# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Face-varying values as a topology of their own: faces over values instead of vertices, with seams where they differ.

Reference: OpenSubdiv's documentation, "Subdivision Surfaces", face-varying interpolation rules; where that is silent,
what its Vtr::FVarLevel does.
"""

from __future__ import annotations

import numpy as np

from warp_rt.subdivision.topology import INFINITE, Topology

RULES = ("cornersPlus1", "none", "cornersOnly", "cornersPlus2", "boundaries", "all")
"""Tokens of ``faceVaryingLinearInterpolation``, the default first; ``all`` is linear everywhere."""


def seam_topology(topology: Topology, rows: np.ndarray, rule: str) -> tuple[Topology, np.ndarray]:
    """Return the topology of values that differ by corner, and for each of its vertices a corner that has the value.

    Args:
        topology: Of the mesh.
        rows: The value of each corner, shape [c].
        rule: One of ``RULES``.
    """
    keys = topology.corners * (rows.max(initial=0) + np.int64(1)) + rows
    _, first, corners = np.unique(keys, return_index=True, return_inverse=True)
    corners = corners.reshape(-1)
    sharp = np.flatnonzero((topology.edge_sharpness > 0)[topology.edge])
    plain = Topology(
        vertex_count=len(first),
        counts=topology.counts,
        corners=corners,
        creases=np.stack([corners[sharp], corners[topology.following[sharp]]], axis=1),
        crease_sharpness=topology.edge_sharpness[topology.edge[sharp]],
        vertex_sharpness=np.zeros(len(first)),
    )
    vertex = topology.corners[first]
    value_count = np.bincount(vertex, minlength=topology.vertex_count)[vertex]
    is_cut = plain.is_seam[plain.edge] & ~topology.is_seam[topology.edge]
    on_seam = value_count > 1
    on_seam[corners[is_cut]] = on_seam[corners[topology.following[is_cut]]] = True
    sharpness = topology.vertex_sharpness[vertex]
    is_sharp = on_seam & ~topology.is_manifold_vertex[vertex]
    if rule == "boundaries":
        is_sharp = on_seam | topology.is_boundary_vertex[vertex]
    elif rule != "none":
        # A value of one face is a corner of its island, in the middle of the surface or at its rim.
        is_corner = plain.vertex_face_count == 1
        is_sharp |= is_corner
        if rule != "cornersOnly":
            is_sharp |= value_count > 2
            # Of two values at a vertex one is as sharp as the other, whether for a crease within its own island ...
            is_pair = value_count == 2
            infinite = plain.sum_at_ends((plain.edge_sharpness >= INFINITE).astype(float)) > 2
            is_sharp |= is_pair & _is_any(infinite, vertex)
            sharpness = np.where(is_pair, np.maximum(sharpness, _of_the_other(_semi_sharp(plain), vertex)), sharpness)
            if rule == "cornersPlus2":
                # ... or for being a corner. Seams that end within the surface are sharp there.
                is_sharp |= is_pair & _is_any(is_corner, vertex)
                is_sharp |= on_seam & (value_count == 1) & ~topology.is_boundary_vertex[vertex]
    seams = Topology(
        len(first),
        plain.counts,
        corners,
        plain.creases,
        plain.crease_sharpness,
        np.where(is_sharp, INFINITE, sharpness),
    )
    return seams, first


def _is_any(of_value: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """Return whether something holds for any value at the vertex of each, shape [v]."""
    return np.bincount(vertex, of_value)[vertex] > 0


def _semi_sharp(plain: Topology) -> np.ndarray:
    """Return the largest finite sharpness of the edges at each value, float64, shape [v]."""
    found = np.zeros(plain.vertex_count)
    is_semi = (plain.edge_sharpness > 0) & (plain.edge_sharpness < INFINITE)
    if is_semi.any():
        np.maximum.at(found, plain.edges[is_semi].reshape(-1), np.repeat(plain.edge_sharpness[is_semi], 2))
    return found


def _of_the_other(of_value: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """Return, of two values at a vertex, what the other has, where the value itself has none: float64, shape [v]."""
    return np.where(of_value > 0, 0.0, np.bincount(vertex, of_value)[vertex])
