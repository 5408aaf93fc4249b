# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sectors: what lies around a vertex between two creases, or all of it where there are none."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from warp_rt.subdivision.topology import INFINITE, Topology


class Kind(IntEnum):
    """Rules of vertices at which no sharpness is left to wear off."""

    SMOOTH = 0
    DART = 1
    """One crease ends here."""
    CREASE = 2
    CORNER = 3


@dataclass(frozen=True, eq=False)
class Sectors:
    """The sectors around some vertices of a topology whose faces all have the same number of corners."""

    corners: np.ndarray
    """int64, shape [c], the corners at these vertices."""
    sector: np.ndarray
    """int64, shape [c], sector of each corner."""
    place: np.ndarray
    """int64, shape [c], place of the corner in its sector, counter-clockwise from 0."""
    faces: np.ndarray
    """int64, shape [s], corners of each sector."""
    vertex: np.ndarray
    """int64, shape [s]."""
    is_closed: np.ndarray
    """bool, shape [s]: no crease bounds the sector, it is a full ring."""


def find_sectors(topology: Topology, onward: np.ndarray, is_wanted: np.ndarray) -> Sectors:
    """Return the sectors around vertices.

    Args:
        topology: Faces and edges.
        onward: The next corner of the same vertex, counter-clockwise, shape [c]; -1 across a seam.
        is_wanted: Whether each corner is at one of the vertices, shape [c].
    """
    is_sharp = topology.edge_sharpness >= INFINITE
    # A single crease that ends at a vertex does not part what is around it.
    ends = topology.sum_at_ends(is_sharp.astype(float))
    is_dart = (ends == 1) & ~topology.is_boundary_vertex
    opens = is_sharp[topology.edge] & ~is_dart[topology.corners]
    closes = opens[onward] | (onward < 0)
    count = len(topology.corners)
    sector = np.full(count, -1)
    place = np.zeros(count, np.int64)
    starts = [np.flatnonzero(is_wanted & (opens | topology.is_seam[topology.edge]))]
    total = _walk(starts[0], 0, onward, closes, sector, place)
    # Rings begin at one corner of each vertex; where it is no surface, there are more.
    rest = np.flatnonzero(is_wanted & (sector < 0))
    while len(rest):
        rest = rest[np.argsort(~is_sharp[topology.edge[rest]], kind="stable")]
        _, first = np.unique(topology.corners[rest], return_index=True)
        starts.append(rest[first])
        total = _walk(starts[-1], total, onward, closes, sector, place)
        rest = rest[sector[rest] < 0]
    open_count = len(starts[0])
    first_corners = np.concatenate(starts)
    wanted = np.flatnonzero(is_wanted)
    return Sectors(
        corners=wanted,
        sector=sector[wanted],
        place=place[wanted],
        faces=np.bincount(sector[wanted], minlength=total),
        vertex=topology.corners[first_corners],
        is_closed=np.arange(total) >= open_count,
    )


def vertex_kinds(topology: Topology, around: Sectors) -> np.ndarray:
    """Return the ``Kind`` of each vertex that has sectors, int64, shape [vertex_count]."""
    ends = topology.sum_at_ends((topology.edge_sharpness >= INFINITE).astype(float))
    sectors = np.bincount(around.vertex, minlength=topology.vertex_count)
    closed = np.bincount(around.vertex, around.is_closed, topology.vertex_count)
    kind = np.full(topology.vertex_count, Kind.CORNER)
    kind[(closed == 1) & (sectors == 1)] = Kind.SMOOTH
    kind[(kind == Kind.SMOOTH) & (ends == 1)] = Kind.DART
    # Two creases bound one sector on a boundary, two within the surface, more between fins.
    kind[(ends == 2) & (closed == 0)] = Kind.CREASE
    kind[topology.vertex_sharpness >= INFINITE] = Kind.CORNER
    return kind


def _walk(
    starts: np.ndarray, first: int, onward: np.ndarray, closes: np.ndarray, sector: np.ndarray, place: np.ndarray
) -> int:
    """Number the sectors that begin at some corners; return the number after the last."""
    ids = first + np.arange(len(starts))
    at, step = starts, 0
    while len(at):
        fresh = sector[at] < 0
        at, ids = at[fresh], ids[fresh]
        sector[at], place[at] = ids, step
        goes_on = ~closes[at]
        at, ids = onward[at[goes_on]], ids[goes_on]
        step += 1
    return first + len(starts)
