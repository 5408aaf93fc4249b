# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Surfaces cut into triangles that stay within a distance of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from warp_rt.splines.patch import Patch, Places
from warp_rt.splines.pieces import Pieces
from warp_rt.splines.trim import Rings, triangulate_regions

# Where second derivatives are looked at, along a piece.
_SAMPLES = np.linspace(0, 1, 5)

# Pieces that are curved at all have this many steps, so that small bends of a large surface do not vanish.
_LEAST_STEPS = 2

# Pieces that would have more equal steps are halved where they bend instead, as those of very uneven weights, which
# bend at one end alone.
_MOST_STEPS = 256

# Along one axis, of all halves: where a surface bends aslant of both axes, no grid of a bearable size is fine enough.
_MOST_LINES = 1 << 10

# Halves of halves: what weights a float64 can blend ask for.
_MOST_HALVES = 52

# Opposite edges, and the points of an edge, coincide within this part of the size of the control net.
_CLOSED = 1e-6


class Lines(NamedTuple):
    """The grid that a surface is cut by."""

    u: np.ndarray
    """float64, shape [m], parameters along u, ascending."""
    v: np.ndarray
    """float64, shape [n]."""
    is_fine: bool
    """Whether the triangles stay within the tolerance."""


@dataclass(frozen=True, eq=False)
class Tessellation:
    """Triangles of a surface. Corners that belong to different pieces have places of their own at the same point."""

    points: np.ndarray
    """float64, shape [n, 3]; the two sides of a seam, and the corners at a pole, have one point."""
    triangles: np.ndarray
    """int64, shape [m, 3], rows of ``points``, counter-clockwise about the cross product of the derivatives."""
    corners: np.ndarray
    """int64, shape [m, 3], rows of ``places``."""
    places: Places
    """Where the corners lie."""
    pieces: np.ndarray
    """int64, shape [m, 2], the piece along u and along v that each triangle is part of."""


def find_lines(patch: Patch, tolerance: float) -> Lines:
    """Return the parameters that a surface is cut at.

    With M_uu, M_uv and M_vv the largest second derivatives, triangles of a grid of step h_u by h_v stay within
    (M_uu h_u^2 + 2 M_uv h_u h_v + M_vv h_v^2) / 8 of the surface. Steps of sqrt(2 tolerance / max(M_uu, M_uv)), and
    likewise along v, make that at most the tolerance. The derivatives are the largest of 5 by 5 samples of a piece, or,
    where that makes more than 256 steps, of what is left of it: a part is halved until one step is enough.

    Reference: Filip, Magedson and Markot (1986), Surface algorithms using bounds on derivatives, Computer Aided
    Geometric Design 3(4), theorem 1.
    """
    (u, is_u_fine), (v, is_v_fine) = (_lines_along(patch, axis, tolerance) for axis in "uv")
    return Lines(u, v, is_u_fine and is_v_fine)


def _lines_along(patch: Patch, axis: str, tolerance: float) -> tuple[np.ndarray, bool]:
    """Return the parameters along ``axis``, u or v, and whether they are as close as the tolerance asks for."""
    pieces = patch.u if axis == "u" else patch.v
    piece, ends = np.arange(len(pieces)), np.tile([0.0, 1.0], (len(pieces), 1))
    count = np.ceil(np.sqrt(_bends(patch, axis, piece, ends) / (2 * tolerance)))
    is_even = count <= _MOST_STEPS
    steps = np.maximum(np.where(is_even, count, 1), _LEAST_STEPS if pieces.degree > 1 else 1).astype(np.int64)
    lines = [_even_lines(pieces, steps)]
    piece, ends = piece[~is_even], ends[~is_even]
    halves = 0
    for _ in range(_MOST_HALVES):
        if not 0 < len(piece) <= _MOST_LINES - halves:
            break
        halves += len(piece)
        middle = ends.mean(axis=1, keepdims=True)
        share = middle[:, 0]
        lines.append((1 - share) * pieces.start[piece] + share * pieces.end[piece])
        piece = np.repeat(piece, 2)
        ends = np.stack([np.hstack([ends[:, :1], middle]), np.hstack([middle, ends[:, 1:]])], axis=1).reshape(-1, 2)
        is_bent = _bends(patch, axis, piece, ends) * np.square(np.diff(ends)[:, 0]) > 2 * tolerance
        piece, ends = piece[is_bent], ends[is_bent]
    return np.unique(np.concatenate(lines)), not len(piece)


def _bends(patch: Patch, axis: str, piece: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the largest second derivatives of parts of pieces along an axis, the other axis throughout: shape [n].

    Args:
        patch: The surface.
        axis: ``u`` or ``v``.
        piece: Of each part, shape [n].
        ends: Where, along the piece, the part begins and ends: shape [n, 2].
    """
    other = patch.v if axis == "u" else patch.u
    row, along, at, off = (
        part.reshape(-1)
        for part in np.meshgrid(np.arange(len(piece)), np.arange(len(other)), _SAMPLES, _SAMPLES, indexing="ij")
    )
    place = (1 - at) * ends[row, 0] + at * ends[row, 1]
    u_first = Places(piece[row], along, place, off)
    places = u_first if axis == "u" else Places(along, piece[row], off, place)
    derivatives = patch.derivatives(places)
    sizes = [np.linalg.norm(derivatives[name], axis=1).reshape(len(piece), -1) for name in (2 * axis, "uv")]
    return np.nan_to_num(np.maximum(*sizes), posinf=0).max(axis=1)


def tessellate(patch: Patch, lines: Lines, regions: Sequence[Rings] | None = None) -> Tessellation:
    """Return the triangles of a surface.

    Args:
        patch: The surface.
        lines: As ``find_lines`` gives them.
        regions: What trim curves leave of its domain; None: all.
    """
    u_lines, v_lines, _ = lines
    if regions is None:
        vertices, triangles = _grid(u_lines, v_lines)
    else:
        vertices, triangles = triangulate_regions(regions, u_lines, v_lines)
    middle = vertices[triangles].mean(axis=1)
    pieces = np.stack([_piece_of(patch.u, middle[:, 0]), _piece_of(patch.v, middle[:, 1])], axis=1)
    points = patch.points(_canonical_places(patch, vertices))
    # A point at a pole, or where the weights cancel out, leaves triangles without area, or none at all.
    corner_points = points[triangles].astype(np.float32)
    is_flat = (corner_points == corner_points[:, [1, 2, 0]]).all(axis=2).any(axis=1)
    kept = np.flatnonzero(~is_flat & np.isfinite(corner_points).all(axis=(1, 2)))
    triangles, pieces = triangles[kept], pieces[kept]
    # A place is a vertex seen from a piece.
    seen = (triangles * len(patch.u) + pieces[:, :1]) * len(patch.v) + pieces[:, 1:]
    unique, corners = np.unique(seen, return_inverse=True)
    vertex, u_piece, v_piece = unique // len(patch.v) // len(patch.u), unique // len(patch.v), unique % len(patch.v)
    places = _places(patch, vertices[vertex], u_piece % len(patch.u), v_piece)
    used, rows = np.unique(triangles, return_inverse=True)
    return Tessellation(points[used], rows.reshape(-1, 3), corners.reshape(-1, 3), places, pieces)


def _even_lines(pieces: Pieces, steps: np.ndarray) -> np.ndarray:
    """Return the parameters that the pieces are cut at, ascending, their ends among them."""
    first = np.cumsum(steps) - steps
    step = np.arange(steps.sum()) - np.repeat(first, steps)
    share = step / np.repeat(steps, steps)
    start, end = np.repeat(pieces.start, steps), np.repeat(pieces.end, steps)
    return np.append((1 - share) * start + share * end, pieces.end[-1])


def _grid(u_lines: np.ndarray, v_lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices of a grid, u fastest, and two triangles a cell."""
    vertices = np.stack(np.meshgrid(u_lines, v_lines), axis=-1).reshape(-1, 2)
    number = np.arange(len(vertices)).reshape(len(v_lines), len(u_lines))
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return vertices, np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def _piece_of(pieces: Pieces, parameter: np.ndarray) -> np.ndarray:
    return np.clip(np.searchsorted(pieces.start, parameter, side="right") - 1, 0, len(pieces) - 1)


def _places(patch: Patch, vertices: np.ndarray, u_piece: np.ndarray, v_piece: np.ndarray) -> Places:
    u, v = (
        np.clip((vertices[:, axis] - p.start[piece]) / (p.end[piece] - p.start[piece]), 0, 1)
        for axis, (p, piece) in enumerate(((patch.u, u_piece), (patch.v, v_piece)))
    )
    return Places(u_piece, v_piece, u, v)


def _canonical_places(patch: Patch, vertices: np.ndarray) -> Places:
    """Return one place for each point: the two sides of a seam, and all places of a pole, are the same one.

    The two sides of a seam would differ in their last bits, which would leave a gap.
    """
    vertices = vertices.copy()
    near = [patch.u.start[0], patch.v.start[0]]
    far = [patch.u.end[-1], patch.v.end[-1]]
    tolerance = _CLOSED * patch.size
    for axis in (0, 1):
        other = 1 - axis
        along = np.unique(vertices[:, other])
        edges = []
        for parameter in (near[axis], far[axis]):
            edge = np.empty((len(along), 2))
            edge[:, axis], edge[:, other] = parameter, along
            edges.append(patch.points(_first_places(patch, edge)))
            if np.ptp(edges[-1], axis=0).max() <= tolerance:
                vertices[vertices[:, axis] == parameter, other] = near[other]
        if np.abs(edges[0] - edges[1]).max() <= tolerance:
            vertices[vertices[:, axis] == far[axis], axis] = near[axis]
    return _first_places(patch, vertices)


def _first_places(patch: Patch, vertices: np.ndarray) -> Places:
    """Return the places of vertices as one of their pieces sees them."""
    return _places(patch, vertices, _piece_of(patch.u, vertices[:, 0]), _piece_of(patch.v, vertices[:, 1]))
