# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Points and normals of the limit surface, at the vertices of a refined mesh of quadrilaterals or triangles.

A sector is what lies around a vertex between two creases, or all of it where there are none. Position is a matter of
the vertex; each sector has a normal of its own, the cross product of two tangents that are weighted sums of the
neighbours.

References: Halstead, Kass and DeRose (1993), Efficient, fair interpolation using Catmull-Clark surfaces, appendix;
Biermann, Levin and Zorin (2000), Piecewise smooth subdivision surfaces with normal control, section 3 (creases);
Hoppe et al. (1994), Piecewise smooth surface reconstruction, appendix A (Loop, the way tangents are found).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from warp_rt.subdivision.refine import loop_beta, sum_rows
from warp_rt.subdivision.topology import INFINITE, Topology


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


def limit(topology: Topology, points: np.ndarray, is_loop: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the limit of points [n, 3], the unit normal of each sector [s, 3], and the sector of each corner [c].

    Points whose sharpness has not worn off yet stay where they are. Normals are zero where tangents have no length.
    """
    onward = topology.twin[topology.preceding]
    regular, rings = _regular_rings(topology, onward, _REGULAR_VALENCE[is_loop])
    moved = points.astype(np.float64).copy()
    moved[regular], regular_normals = _regular_limit(topology, moved, regular, rings)
    is_left = np.ones(len(topology.corners), bool)
    is_left[rings] = False
    around = find_sectors(topology, onward, is_left)
    rows = np.empty(len(topology.corners), np.int64)
    rows[rings] = np.arange(len(regular))[:, None]
    rows[around.corners] = len(regular) + around.sector
    if len(around.corners):
        normals = _limit_of_sectors(topology, points.astype(np.float64), around, moved, is_loop)
        regular_normals = np.concatenate([regular_normals, normals])
    return moved, regular_normals, rows


_REGULAR_VALENCE = {False: 4, True: 6}  # by whether the scheme is Loop's


def _regular_rings(topology: Topology, onward: np.ndarray, valence: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the smooth vertices of regular valence, shape [r], and the corners around each, counter-clockwise: [r, n].

    Nearly all vertices of a refined surface are such, and their limit needs no search for sectors.
    """
    is_regular = topology.vertex_face_count == valence
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


def _regular_limit(
    topology: Topology, points: np.ndarray, vertices: np.ndarray, rings: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return limit points and unit normals of vertices of valence 4, or of 6 between triangles: shape [r, 3] each."""
    opening = [topology.following[ring] for ring in rings.T]
    spokes = [points.take(topology.corners[corner], axis=0) for corner in opening]
    here = points[vertices]
    if len(spokes) == 4:
        across = [points.take(topology.corners[topology.following[corner]], axis=0) for corner in opening]
        limits = (16 * here + 4 * sum(spokes) + sum(across)) / 36
        one, two = across[0] - across[2], across[1] - across[3]
        tangents = 4 * (spokes[0] - spokes[2]) + one - two, 4 * (spokes[1] - spokes[3]) + one + two
    else:
        limits = here / 2 + sum(spokes) / 12
        # Of a wave around the ring, cosines are 1, 1/2, -1/2, ... and sines 0, 1, 1, ... times sqrt(3) / 2.
        tangents = (
            2 * (spokes[0] - spokes[3]) + spokes[1] - spokes[2] - spokes[4] + spokes[5],
            spokes[1] + spokes[2] - spokes[4] - spokes[5],
        )
    return limits, _unit(_cross(*tangents))


def _limit_of_sectors(
    topology: Topology, points: np.ndarray, around: Sectors, moved: np.ndarray, is_loop: bool
) -> np.ndarray:
    """Write the limits of the vertices of sectors to ``moved``; return the unit normal of each sector, shape [s, 3]."""
    sector, place = around.sector, around.place
    following = topology.following[around.corners]
    spoke = points[topology.corners[following]]  # the end of the edge that opens each corner
    last = points[topology.corners[topology.preceding[around.corners]]]  # of the one that closes it
    across = np.zeros_like(spoke) if is_loop else points[topology.corners[topology.following[following]]]
    is_first = place == 0
    is_last = place == around.faces[sector] - 1
    vertex = points[around.vertex]
    begin, end, second = np.zeros_like(vertex), np.zeros_like(vertex), np.zeros_like(vertex)
    begin[sector[is_first]] = spoke[is_first]
    end[sector[is_last]] = last[is_last]
    second[sector[is_first]] = last[is_first]

    smooth = _cross(*_ring_tangents(around, spoke, across, is_loop))
    crease = _cross(begin - end, _inward_tangents(around, spoke, across, vertex, begin + end, is_loop))
    corner = _cross(begin - vertex, second - vertex)
    kind = _vertex_kinds(topology, around)[around.vertex]
    normals = _unit(np.select([around.is_closed[:, None], (kind == _CREASE)[:, None]], [smooth, crease], corner))

    _move_smooth(points, around, np.flatnonzero(around.is_closed & (kind == _SMOOTH)), spoke, across, moved, is_loop)
    _move_darts(
        points, around, np.flatnonzero(around.is_closed & (kind == _DART)), spoke, across, moved, normals, is_loop
    )
    creases = np.flatnonzero(~around.is_closed & (kind == _CREASE))
    at = around.vertex[creases]
    moved[at] = (begin[creases] + 4 * points[at] + end[creases]) / 6
    return normals


def _ring_tangents(
    around: Sectors, spoke: np.ndarray, across: np.ndarray, is_loop: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return two tangents of each sector as if it were a ring without creases, shape [s, 3] each: its first waves.

    Args:
        around: The sectors.
        spoke: End of the edge that opens each corner, shape [c, 3].
        across: The corner across its face, shape [c, 3].
        is_loop: Whether the scheme is Loop's.
    """
    angle = 2 * np.pi / around.faces.astype(float)[around.sector]
    phase = angle * around.place
    if is_loop:
        edge_weight, face_weight = 1.0, 0.0
    else:
        cosine = np.cos(angle)
        edge_weight = 1 + cosine + np.cos(angle / 2) * np.sqrt(2 * (9 + cosine))
        face_weight = 1.0

    def wave(function: np.ufunc) -> np.ndarray:
        spokes = (edge_weight * function(phase))[:, None] * spoke
        diagonals = (face_weight * (function(phase) + function(phase + angle)))[:, None] * across
        return sum_rows(around.sector, spokes + diagonals, len(around.faces))

    return wave(np.cos), wave(np.sin)


def _inward_tangents(
    around: Sectors, spoke: np.ndarray, across: np.ndarray, vertex: np.ndarray, ends: np.ndarray, is_loop: bool
) -> np.ndarray:
    """Return the tangent of each sector that leads away from the creases about it, shape [s, 3].

    Args:
        around: The sectors.
        spoke: End of the edge that opens each corner, shape [c, 3].
        across: The corner across its face, shape [c, 3].
        vertex: Of each sector, shape [s, 3].
        ends: Sum of the far ends of its two creases, shape [s, 3].
        is_loop: Whether the scheme is Loop's.
    """
    sector, place = around.sector, around.place
    faces = around.faces.astype(float)
    theta = np.pi / faces[sector]
    inner = np.where(place == 0, 0.0, np.sin(theta * place))[:, None] * spoke
    interior = sum_rows(sector, inner, len(faces))
    t = (np.pi / faces)[:, None]
    if is_loop:
        # The left eigenvector of the subdivision matrix whose part for inner spokes is sin(i t).
        shrink = 0.375 + 0.25 * np.cos(t)
        outer = np.sin(t) * (0.75 - shrink) - 0.375 / np.tan(t / 2)
        outer /= 1 - 8 * (0.5 - shrink) * (0.75 - shrink)
        inward = interior + outer * ends - (np.sin(t) + 8 * outer * (0.5 - shrink)) * vertex
    else:
        slices = (np.sin(theta * place) + np.sin(theta * (place + 1)))[:, None] * across
        r = np.divide(np.cos(t) + 1, np.sin(t), out=np.zeros_like(t), where=faces[:, None] > 1)
        inward = 4 * interior + sum_rows(sector, slices, len(faces))
        inward += r * (4 * (np.cos(t) - 1) * vertex - (1 + 2 * np.cos(t)) * ends)
    return np.where((faces == 1)[:, None], ends - 2 * vertex, inward)


def _move_smooth(
    points: np.ndarray,
    around: Sectors,
    rings: np.ndarray,
    spoke: np.ndarray,
    across: np.ndarray,
    moved: np.ndarray,
    is_loop: bool,
) -> None:
    """Write the limits of vertices without creases to ``moved``, shape [n, 3]; ``rings``, shape [r]: their sectors."""
    spokes = sum_rows(around.sector, spoke, len(around.faces))[rings]
    k = around.faces.astype(float)[rings][:, None]
    at = around.vertex[rings]
    if is_loop:
        share = 1 / (k + 3 / (8 * loop_beta(k)))
        moved[at] = (1 - k * share) * points[at] + share * spokes
    else:
        diagonals = sum_rows(around.sector, across, len(around.faces))[rings]
        moved[at] = (k * k * points[at] + 4 * spokes + diagonals) / (k * (k + 5))


def _move_darts(
    points: np.ndarray,
    around: Sectors,
    darts: np.ndarray,
    spoke: np.ndarray,
    across: np.ndarray,
    moved: np.ndarray,
    normals: np.ndarray,
    is_loop: bool,
) -> None:
    """Write the limits of vertices at which one crease ends to ``moved``, and to ``normals`` those of their sectors.

    ``darts``, shape [d], are these sectors, and their rows of ``normals``, shape [s, 3], tell the sides.
    """
    by_sector = np.lexsort((around.place, around.sector)) if len(darts) else around.sector
    ends = np.cumsum(around.faces)
    for ring_sector in darts:
        inside = by_sector[ends[ring_sector] - around.faces[ring_sector] : ends[ring_sector]]
        at = around.vertex[ring_sector]
        local = np.concatenate([points[at, None], spoke[inside], across[inside]])
        masks = dart_masks(len(inside), is_loop) @ local[: 1 + len(inside) * (1 if is_loop else 2)]
        moved[at] = masks[0]
        normal = np.cross(masks[1], masks[2])
        normal *= np.sign(normal @ normals[ring_sector]) or 1.0
        length = np.linalg.norm(normal)
        normals[ring_sector] = normal / length if length > 0 else normals[ring_sector]


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return cross products, shape [n, 3], three times as fast as ``np.cross``."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors of length 1; those of length 0 as they are."""
    length = np.sqrt(np.einsum("ni,ni->n", vectors, vectors))[:, None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


_SMOOTH, _DART, _CREASE, _CORNER, _WAITING = range(5)


@cache
def dart_masks(valence: int, is_loop: bool) -> np.ndarray:
    """Return the weights of the limit and of two tangents at the end of a crease: shape [3, 1 + valence (* 2)].

    Columns are the vertex, the ends of its edges from the crease on, and (Catmull-Clark) the corners across its faces.
    They are the left eigenvectors of the matrix that takes these to the same of the next level, for its three largest
    eigenvalues.
    """
    n = valence
    matrix = np.zeros((1 + n, 1 + n)) if is_loop else np.zeros((1 + 2 * n, 1 + 2 * n))
    edge, face = np.eye(len(matrix))[1 : 1 + n], np.eye(len(matrix))[1 + n :]
    vertex = np.eye(len(matrix))[0]
    before, after = np.roll(edge, 1, axis=0), np.roll(edge, -1, axis=0)
    if is_loop:
        beta = loop_beta(np.array(float(n)))
        matrix[0] = (1 - n * beta) * vertex + beta * edge.sum(axis=0)
        matrix[1:] = 0.375 * (vertex + edge) + 0.125 * (before + after)
    else:
        middle = (vertex + edge + after + face) / 4  # face points; face i lies between edges i and i + 1
        matrix[0] = ((n - 2) * vertex + edge.mean(axis=0) + middle.mean(axis=0)) / n
        matrix[1 : 1 + n] = (vertex + edge + middle + np.roll(middle, 1, axis=0)) / 4
        matrix[1 + n :] = middle
    matrix[1] = (vertex + edge[0]) / 2
    values, vectors = np.linalg.eig(matrix.T)
    order = np.argsort(-np.abs(values))[:3]
    masks = np.real(vectors[:, order]).T
    masks[0] /= masks[0].sum()
    return masks


def _vertex_kinds(topology: Topology, around: Sectors) -> np.ndarray:
    """Return which limit rule each vertex takes; _WAITING where sharpness has still to wear off."""
    is_sharp = topology.edge_sharpness >= INFINITE
    ends = topology.sum_at_ends(is_sharp.astype(float))
    partly = topology.sum_at_ends(((topology.edge_sharpness > 0) & ~is_sharp).astype(float)) > 0
    partly |= (topology.vertex_sharpness > 0) & (topology.vertex_sharpness < INFINITE)
    sectors = np.bincount(around.vertex, minlength=topology.vertex_count)
    closed = np.bincount(around.vertex, around.is_closed, topology.vertex_count)
    kind = np.full(topology.vertex_count, _CORNER)
    kind[(closed == 1) & (sectors == 1)] = _SMOOTH
    kind[(kind == _SMOOTH) & (ends == 1)] = _DART
    # Two creases bound one sector on a boundary, two within the surface, more between fins.
    kind[(ends == 2) & (closed == 0)] = _CREASE
    kind[partly & (kind != _CORNER)] = _WAITING
    kind[topology.vertex_sharpness >= INFINITE] = _CORNER
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
