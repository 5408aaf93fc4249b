# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Limits and tangents around a vertex, as weighted sums of its neighbours.

References: Halstead, Kass and DeRose (1993), Efficient, fair interpolation using Catmull-Clark surfaces, appendix;
Biermann, Levin and Zorin (2000), Piecewise smooth subdivision surfaces with normal control, section 3 (creases);
Hoppe et al. (1994), Piecewise smooth surface reconstruction, appendix A (Loop, the way tangents are found).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from warp_rt.subdivision.refine import loop_beta, sum_rows
from warp_rt.subdivision.sectors import Kind, Sectors


class Ring(NamedTuple):
    """What lies around vertices of regular valence, counter-clockwise."""

    spokes: list[np.ndarray]
    """Ends of their edges, shape [r, k] each."""
    across: list[np.ndarray]
    """The corners across their faces, likewise; none of Loop's scheme."""


class Fans(NamedTuple):
    """What lies around the vertices of sectors, by corner."""

    spoke: np.ndarray
    """End of the edge that opens each corner, shape [c, k]."""
    last: np.ndarray
    """End of the edge that closes it, shape [c, k]."""
    across: np.ndarray | None
    """The corner across its face, shape [c, k]; None: the scheme is Loop's."""


def regular_limits(here: np.ndarray, ring: Ring) -> np.ndarray:
    """Return the limits at vertices of valence 4, or of 6 between triangles, shape [r, k], which are at ``here``."""
    if ring.across:
        return (16 * here + 4 * sum(ring.spokes) + sum(ring.across)) / 36
    return here / 2 + sum(ring.spokes) / 12


def regular_normals(ring: Ring) -> np.ndarray:
    """Return unit normals at vertices of valence 4, or of 6 between triangles: shape [r, 3]."""
    spokes, across = ring
    if across:
        one, two = across[0] - across[2], across[1] - across[3]
        tangents = 4 * (spokes[0] - spokes[2]) + one - two, 4 * (spokes[1] - spokes[3]) + one + two
    else:
        # Of a wave around the ring, cosines are 1, 1/2, -1/2, ... and sines 0, 1, 1, ... times sqrt(3) / 2.
        tangents = (
            2 * (spokes[0] - spokes[3]) + spokes[1] - spokes[2] - spokes[4] + spokes[5],
            spokes[1] + spokes[2] - spokes[4] - spokes[5],
        )
    return unit(cross(*tangents))


def sector_limits(here: np.ndarray, around: Sectors, kind: np.ndarray, fans: Fans) -> np.ndarray:
    """Return the limits at the vertices of sectors, shape [s, k].

    Args:
        here: Where these vertices are, shape [s, k].
        around: The sectors.
        kind: Rule of each sector's vertex, shape [s].
        fans: Around them.
    """
    begin, end = _ends(around, fans)
    spokes = sum_rows(around.sector, fans.spoke, len(around.faces))
    n = around.faces.astype(float)[:, None]
    if fans.across is None:
        share = 1 / (n + 3 / (8 * loop_beta(n)))
        smooth = (1 - n * share) * here + share * spokes
    else:
        smooth = (n * n * here + 4 * spokes + sum_rows(around.sector, fans.across, len(around.faces))) / (n * (n + 5))
    of_kind = {Kind.SMOOTH: smooth, Kind.CREASE: (begin + 4 * here + end) / 6}
    limits = np.select([(kind == which)[:, None] for which in of_kind], list(of_kind.values()), here)
    for ring, masked in _darts(here, around, kind, fans):
        limits[ring] = masked[0]
    return limits


def sector_normals(here: np.ndarray, around: Sectors, kind: np.ndarray, fans: Fans) -> np.ndarray:
    """Return the unit normal of each sector, shape [s, 3]; that of corners is not one of the surface.

    Args:
        here: Where the vertices of sectors are, shape [s, 3].
        around: The sectors.
        kind: Rule of each sector's vertex, shape [s].
        fans: Around them.
    """
    begin, end = _ends(around, fans)
    smooth = cross(*_ring_tangents(around, fans))
    crease = cross(begin - end, _inward_tangents(here, around, fans, begin + end))
    normals = unit(np.where(around.is_closed[:, None], smooth, crease))
    for ring, masked in _darts(here, around, kind, fans):
        normal = np.cross(masked[1], masked[2])
        normal *= np.sign(normal @ normals[ring]) or 1.0
        length = np.linalg.norm(normal)
        normals[ring] = normal / length if length > 0 else normals[ring]
    return normals


def _ends(around: Sectors, fans: Fans) -> tuple[np.ndarray, np.ndarray]:
    """Return the ends of the edges that sectors begin and end with, shape [s, k] each."""
    begin, end = np.zeros((2, len(around.faces), fans.spoke.shape[1]))
    is_first = around.place == 0
    is_last = around.place == around.faces[around.sector] - 1
    begin[around.sector[is_first]] = fans.spoke[is_first]
    end[around.sector[is_last]] = fans.last[is_last]
    return begin, end


def _ring_tangents(around: Sectors, fans: Fans) -> tuple[np.ndarray, np.ndarray]:
    """Return two tangents of each sector as if it were a ring without creases, shape [s, 3] each: its first waves."""
    angle = 2 * np.pi / around.faces.astype(float)[around.sector]
    phase = angle * around.place
    cosine = np.cos(angle)
    edge_weight = 1 + cosine + np.cos(angle / 2) * np.sqrt(2 * (9 + cosine))

    def wave(function: np.ufunc) -> np.ndarray:
        if fans.across is None:
            return sum_rows(around.sector, function(phase)[:, None] * fans.spoke, len(around.faces))
        spokes = (edge_weight * function(phase))[:, None] * fans.spoke
        diagonals = (function(phase) + function(phase + angle))[:, None] * fans.across
        return sum_rows(around.sector, spokes + diagonals, len(around.faces))

    return wave(np.cos), wave(np.sin)


def _inward_tangents(here: np.ndarray, around: Sectors, fans: Fans, ends: np.ndarray) -> np.ndarray:
    """Return the tangent of each sector that leads away from the creases about it, shape [s, 3].

    Args:
        here: Where the vertices of sectors are, shape [s, 3].
        around: The sectors.
        fans: Around them.
        ends: Sum of the far ends of the two creases of each sector, shape [s, 3].
    """
    sector, place = around.sector, around.place
    faces = around.faces.astype(float)
    theta = np.pi / faces[sector]
    inner = np.where(place == 0, 0.0, np.sin(theta * place))[:, None] * fans.spoke
    interior = sum_rows(sector, inner, len(faces))
    t = (np.pi / faces)[:, None]
    if fans.across is None:
        # The left eigenvector of the subdivision matrix whose part for inner spokes is sin(i t).
        shrink = 0.375 + 0.25 * np.cos(t)
        outer = np.sin(t) * (0.75 - shrink) - 0.375 / np.tan(t / 2)
        outer /= 1 - 8 * (0.5 - shrink) * (0.75 - shrink)
        inward = interior + outer * ends - (np.sin(t) + 8 * outer * (0.5 - shrink)) * here
    else:
        slices = (np.sin(theta * place) + np.sin(theta * (place + 1)))[:, None] * fans.across
        r = np.divide(np.cos(t) + 1, np.sin(t), out=np.zeros_like(t), where=faces[:, None] > 1)
        inward = 4 * interior + sum_rows(sector, slices, len(faces))
        inward += r * (4 * (np.cos(t) - 1) * here - (1 + 2 * np.cos(t)) * ends)
    return np.where((faces == 1)[:, None], ends - 2 * here, inward)


def _darts(here: np.ndarray, around: Sectors, kind: np.ndarray, fans: Fans) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the rings about the end of one crease, each with its limit and two tangents there: [3, k].

    Args:
        here: Where the vertices of sectors are, shape [s, k].
        around: The sectors.
        kind: Rule of each sector's vertex, shape [s].
        fans: Around them.
    """
    darts = np.flatnonzero(kind == Kind.DART)
    by_sector = np.lexsort((around.place, around.sector)) if len(darts) else around.sector
    last = np.cumsum(around.faces)
    for ring in darts.tolist():
        inside = by_sector[last[ring] - around.faces[ring] : last[ring]]
        parts = [here[ring, None], fans.spoke[inside]]
        if fans.across is not None:
            parts.append(fans.across[inside])
        yield ring, _dart_masks(len(inside), fans.across is None) @ np.concatenate(parts)


@cache
def _dart_masks(valence: int, is_loop: bool) -> np.ndarray:
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


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return cross products, shape [n, 3], three times as fast as ``np.cross``."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors, shape [n, 3], at length 1; those of length 0 as they are."""
    length = np.sqrt(np.einsum("ni,ni->n", vectors, vectors))[:, None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
