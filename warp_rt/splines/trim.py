# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Regions of a plane bounded by closed loops: which they are, and what each cell of a grid holds of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import mapbox_earcut
import numpy as np

# Loops cross where edges reach through each other by more than this part of the domain: those that touch may do so by
# less, as polygons of curves.
_CROSSING = 1e-4

# Bounds the temporary arrays to some megabytes.
_BLOCK_PAIRS = 1 << 18

Rings = list[np.ndarray]
"""A region: the corners of its outline, counter-clockwise, and of its holes, clockwise; float64, shape [k, 2] each."""


class CrossingLoopsError(ValueError):
    """Loops cross each other or themselves, so that they bound no region."""


def find_regions(loops: Sequence[np.ndarray], low: np.ndarray, high: np.ndarray) -> list[Rings]:
    """Return the regions to the left of all loops.

    A loop that runs counter-clockwise keeps its inside, one that runs clockwise takes it away; loops may lie within
    one another. Where the outermost ones all take away, what is about them is kept, beyond the domain too. A loop that
    keeps what is kept already, or takes away what is not there, makes no difference.

    Args:
        loops: Closed polygons, their last point before the first one again, shape [k, 2] each.
        low: Lower corner of the domain, u and v, shape [2].
        high: Upper corner, likewise.

    Raises:
        CrossingLoopsError: The loops cross.
    """
    bounding = [loop for loop in loops if len(loop) >= 3 and _area(loop) != 0]
    if _have_crossings(bounding, _CROSSING * float(np.linalg.norm(high - low))):
        raise CrossingLoopsError
    bounding.sort(key=lambda loop: -abs(_area(loop)))
    inner = [_inner_point(loop) for loop in bounding]
    holders = [[row for row in range(place) if _holds(bounding[row], inner[place])] for place in range(len(bounding))]
    if not any(_area(loop) > 0 for loop, held in zip(bounding, holders, strict=True) if not held):
        corners = np.concatenate([low[None], high[None], *bounding])
        margin = np.ptp(corners, axis=0)
        around = _rectangle(corners.min(axis=0) - margin, corners.max(axis=0) + margin)
        bounding = [around, *bounding]
        holders = [[], *([0, *(row + 1 for row in held)] for held in holders)]
    regions: dict[int, Rings] = {}
    counts = [False] * len(bounding)
    for row, loop in enumerate(bounding):
        within = [other for other in holders[row] if counts[other]]
        keeps, is_kept = _area(loop) > 0, bool(within) and _area(bounding[within[-1]]) > 0
        counts[row] = keeps != is_kept
        if counts[row]:
            regions.setdefault(row if keeps else within[-1], []).append(loop)
    return list(regions.values())


def triangulate_regions(
    regions: Sequence[Rings], u_lines: np.ndarray, v_lines: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles that cover the regions within a grid, none of which reaches over a line.

    A cell that is kept whole gives two triangles, one that a loop runs through those of what is left of it. Cells meet
    at the same corners on the lines between them, so that no gap opens where a plane is bent to a surface.

    Args:
        regions: As ``find_regions`` gives them.
        u_lines: Lines of equal u, ascending, shape [k]; what lies beyond the first and the last is left out.
        v_lines: Lines of equal v, likewise.

    Returns:
        Vertices, u and v, float64, shape [n, 2]; rows of them, int64, counter-clockwise, shape [m, 3].
    """
    parts: list[np.ndarray] = [np.zeros((0, 3, 2))]
    pending = [(rings, 0, len(u_lines) - 1, 0, len(v_lines) - 1) for rings in _within(regions, u_lines, v_lines)]
    while pending:
        rings, left, right, bottom, top = pending.pop()
        if _is_rectangle(rings, u_lines[left], u_lines[right], v_lines[bottom], v_lines[top]):
            parts.append(_whole_cells(u_lines[left : right + 1], v_lines[bottom : top + 1]))
        elif right - left == 1 and top - bottom == 1:
            parts.append(np.concatenate(rings)[_clip_ears(rings)])
        elif right - left >= top - bottom:
            middle = (left + right) // 2
            below, above = _split(rings, 0, u_lines[middle])
            pending += [(part, left, middle, bottom, top) for part in below]
            pending += [(part, middle, right, bottom, top) for part in above]
        else:
            middle = (bottom + top) // 2
            below, above = _split(rings, 1, v_lines[middle])
            pending += [(part, left, right, bottom, middle) for part in below]
            pending += [(part, left, right, middle, top) for part in above]
    corners = np.concatenate(parts)
    vertices, rows = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return vertices, rows.reshape(-1, 3).astype(np.int64)


def _within(regions: Sequence[Rings], u_lines: np.ndarray, v_lines: np.ndarray) -> list[Rings]:
    """Return the parts of regions that lie within the first and the last lines."""
    parts = list(regions)
    for axis, lines in ((0, u_lines), (1, v_lines)):
        parts = [part for rings in parts for part in _split(rings, axis, lines[0])[1]]
        parts = [part for rings in parts for part in _split(rings, axis, lines[-1])[0]]
    return parts


def _whole_cells(u_lines: np.ndarray, v_lines: np.ndarray) -> np.ndarray:
    """Return two triangles for each cell between lines: shape [m, 3, 2]."""
    grid = np.stack(np.meshgrid(u_lines, v_lines), axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=2).reshape(-1, 3, 2)


def _have_crossings(loops: Sequence[np.ndarray], depth: float) -> bool:
    """Return whether two edges of polygons reach through each other, each by more than a depth on both sides."""
    if not loops:
        return False
    begin, end = np.concatenate(loops), np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    step = max(1, _BLOCK_PAIRS // len(begin))
    for first in range(0, len(begin), step):
        rows = slice(first, first + step)
        overlap = ((low[rows, None] < high) & (high[rows, None] > low)).all(axis=2)
        one, other = np.nonzero(overlap)
        one += first
        from_one = _distance(begin[other], begin[one], end[one]), _distance(end[other], begin[one], end[one])
        from_other = _distance(begin[one], begin[other], end[other]), _distance(end[one], begin[other], end[other])
        is_through = [(a * b < 0) & (np.minimum(np.abs(a), np.abs(b)) > depth) for a, b in (from_one, from_other)]
        if (is_through[0] & is_through[1]).any():
            return True
    return False


def _distance(points: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the distances of points from lines, positive to their left."""
    along, to = end - begin, points - begin
    length = np.hypot(along[:, 0], along[:, 1])
    return (along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]) / np.where(length > 0, length, 1)


def _rectangle(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.array([(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])])


def _is_rectangle(rings: Rings, left: float, right: float, bottom: float, top: float) -> bool:
    """Return whether a region is all between four lines, with no corner but theirs."""
    if len(rings) != 1 or len(rings[0]) != 4:
        return False
    corners = {(float(u), float(v)) for u, v in rings[0]}
    return corners == {(left, bottom), (right, bottom), (right, top), (left, top)}


def _split(rings: Rings, axis: int, line: float) -> tuple[list[Rings], list[Rings]]:
    """Return the parts of a region on the lower and on the upper side of a line."""
    vertices = np.concatenate(rings)
    side = np.sign(vertices[:, axis] - line)
    if side.max() <= 0:
        return [rings], []
    if side.min() >= 0:
        return [], [rings]
    triangles = _clip_ears(rings)
    outline = {(int(a), int(b)) for a, b in _unmatched_edges(triangles)}
    added: dict[tuple[int, int], int] = {}
    points = list(vertices)
    is_corner = [True] * len(points)
    parts: tuple[list[tuple[int, ...]], list[tuple[int, ...]]] = ([], [])
    for triangle in triangles.tolist():
        polygons: tuple[list[int], list[int]] = ([], [])
        for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
            for which, sign in enumerate((-1, 1)):
                if side[a] * sign >= 0:
                    polygons[which].append(a)
            if side[a] * side[b] < 0:
                edge = (min(a, b), max(a, b))
                if edge not in added:
                    added[edge] = len(points)
                    is_corner.append((a, b) in outline or (b, a) in outline)
                    points.append(_crossing(vertices[edge[0]], vertices[edge[1]], axis, line))
                for polygon in polygons:
                    polygon.append(added[edge])
        for part, polygon in zip(parts, polygons, strict=True):
            part.extend((polygon[0], *pair) for pair in pairwise(polygon[1:]))
    positions, corners = np.array(points), np.array(is_corner)
    below, above = (_outlines(positions, corners, np.array(part, np.int64).reshape(-1, 3)) for part in parts)
    return below, above


def _crossing(begin: np.ndarray, end: np.ndarray, axis: int, line: float) -> np.ndarray:
    """Return where an edge meets a line, exactly on the line."""
    point = begin + (line - begin[axis]) / (end[axis] - begin[axis]) * (end - begin)
    point[axis] = line
    return point


def _outlines(vertices: np.ndarray, is_corner: np.ndarray, triangles: np.ndarray) -> list[Rings]:
    """Return the regions that triangles cover, by those of their vertices that are corners."""
    following: dict[int, list[int]] = {}
    for a, b in _unmatched_edges(triangles).tolist():
        following.setdefault(a, []).append(b)
    outers: list[np.ndarray] = []
    holes: list[np.ndarray] = []
    while following:
        start = next(iter(following))
        ring, here = [], start
        while True:
            ring.append(here)
            choices = following[here]
            onward = choices.pop()
            if not choices:
                del following[here]
            here = onward
            if here == start:
                break
        loop = vertices[[vertex for vertex in ring if is_corner[vertex]]]
        area = _area(loop) if len(loop) >= 3 else 0.0
        if area:
            (outers if area > 0 else holes).append(loop)
    regions = [[outer] for outer in outers]
    for hole in holes:
        holding = [region for region in regions if _holds(region[0], _inner_point(hole))]
        if holding:
            min(holding, key=lambda region: _area(region[0])).append(hole)
    return regions


def _unmatched_edges(triangles: np.ndarray) -> np.ndarray:
    """Return the directed edges of triangles that no other has the other way round: shape [k, 2]."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    size = int(edges.max(initial=0)) + 1
    key, opposite = edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0]
    return edges[~np.isin(key, opposite)]


def _clip_ears(rings: Rings) -> np.ndarray:
    """Return the triangles of a region, counter-clockwise, rows of its rings' corners one after the other."""
    plane = np.concatenate(rings)
    ends = np.cumsum([len(ring) for ring in rings])
    triangles = mapbox_earcut.triangulate_float64(plane, ends.astype(np.uint32)).reshape(-1, 3).astype(np.int64)
    is_turned = _double_areas(plane[triangles]) < 0
    triangles = np.where(is_turned[:, None], triangles[:, [0, 2, 1]], triangles)
    return _with_dropped_corners(triangles, ends, _area(rings[0]) > 0)


def _with_dropped_corners(triangles: np.ndarray, ends: np.ndarray, is_counter_clockwise: bool) -> np.ndarray:
    """Return triangles that use all corners: those that lie on a line with their neighbours are left out by earcut.

    A cell beyond such an edge may have a corner there.
    """
    is_used = np.zeros(ends[-1], bool)
    is_used[triangles.reshape(-1)] = True
    if is_used.all():
        return triangles
    rows = triangles.tolist()
    for start, end in zip(np.append(0, ends[:-1]), ends, strict=True):
        kept = start + np.flatnonzero(is_used[start:end])
        if len(kept) < 2:
            continue
        for begin, stop in zip(kept.tolist(), np.roll(kept, -1).tolist(), strict=True):
            count = (stop - begin - 1) % (end - start)
            dropped = [int(start + (begin - start + step) % (end - start)) for step in range(1, count + 1)]
            chain = [begin, *dropped, stop] if is_counter_clockwise else [stop, *dropped[::-1], begin]
            owner = next((row for row in rows if dropped and _has_edge(row, chain[0], chain[-1])), None)
            if owner is None:
                continue
            apex = next(corner for corner in owner if corner not in (begin, stop))
            rows.remove(owner)
            rows += [[a, b, apex] for a, b in pairwise(chain)]
    return np.array(rows, np.int64).reshape(-1, 3)


def _has_edge(triangle: list[int], begin: int, end: int) -> bool:
    return (begin, end) in zip(triangle, triangle[1:] + triangle[:1], strict=True)


def _area(loop: np.ndarray) -> float:
    """Return the area of a polygon, positive where it runs counter-clockwise."""
    here = loop - loop[0]
    following = np.roll(here, -1, axis=0)
    return float((here[:, 0] * following[:, 1] - here[:, 1] * following[:, 0]).sum() / 2)


def _double_areas(triangles: np.ndarray) -> np.ndarray:
    """Return twice the area of triangles, shape [m, 3, 2], positive where they are counter-clockwise."""
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def _inner_point(loop: np.ndarray) -> np.ndarray:
    """Return a point well within a polygon: the middle of the largest triangle that its ears leave."""
    corners = loop[_clip_ears([loop])]
    return corners[np.argmax(_double_areas(corners))].mean(axis=0)


def _holds(loop: np.ndarray, point: np.ndarray) -> bool:
    """Return whether a point lies within a polygon: a ray from it crosses that an odd number of times."""
    begin = loop - point
    end = np.roll(begin, -1, axis=0)
    spans = (begin[:, 1] > 0) != (end[:, 1] > 0)
    begin, end = begin[spans], end[spans]
    crossing = begin[:, 0] - begin[:, 1] * (end[:, 0] - begin[:, 0]) / (end[:, 1] - begin[:, 1])
    return bool((crossing > 0).sum() % 2)
