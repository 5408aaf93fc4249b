# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Face-varying values as a topology of their own: faces over values instead of vertices, with seams where they differ.

Reference: OpenSubdiv's documentation, "Subdivision Surfaces", face-varying interpolation rules.
"""

from __future__ import annotations

import numpy as np

from warp_rt.subdivision.topology import INFINITE, Topology

RULES = ("cornersPlus1", "none", "cornersOnly", "cornersPlus2", "boundaries", "all")
"""Tokens of ``faceVaryingLinearInterpolation``, the default first; ``all`` is linear everywhere."""


def seam_topology(topology: Topology, values: np.ndarray, rule: str) -> tuple[Topology, np.ndarray]:
    """Return the topology of values that differ by corner, and the values of its vertices.

    Args:
        topology: Of the mesh.
        values: Shape [c, k], one row a corner.
        rule: One of ``RULES``.
    """
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32).reshape(len(values), -1)
    keys = np.concatenate([topology.corners[:, None], bits], axis=1)
    _, first, corners = np.unique(keys, axis=0, return_index=True, return_inverse=True)
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
    is_corner = plain.vertex_face_count == 1
    has_corner = np.bincount(vertex, is_corner, topology.vertex_count)[vertex] > 0
    if rule == "boundaries":
        is_sharp = on_seam
    elif rule == "none":
        is_sharp = np.zeros_like(on_seam)
    else:
        is_sharp = on_seam & is_corner
        if rule in ("cornersPlus1", "cornersPlus2"):
            is_sharp |= value_count > 2
        if rule == "cornersPlus2":
            is_sharp |= on_seam & ((value_count == 1) | ((value_count == 2) & has_corner))
    sharpness = np.where(on_seam, np.where(is_sharp, INFINITE, 0.0), topology.vertex_sharpness[vertex])
    seams = Topology(len(first), plain.counts, corners, plain.creases, plain.crease_sharpness, sharpness)
    return seams, np.asarray(values, np.float64)[first]
