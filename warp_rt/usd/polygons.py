# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Faces of meshes: which of them can be drawn, and the normals of the surface that they make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warp_rt.report import Report, counted

FEW_VERTICES = "W101"
BAD_INDEX = "W102"
BAD_POINT = "W103"
BAD_TOPOLOGY = "W104"

# The watertight test multiplies three coordinates, which must stay inside float32's range: 1e13 does, 1e14 does not.
MAX_COORDINATE = 1e12


@dataclass(frozen=True)
class Polygons:
    """Faces that can be drawn."""

    faces: np.ndarray
    """int64, shape [f], number of each in the source."""
    starts: np.ndarray
    """int64, shape [f], position of the first corner in ``indices``."""
    counts: np.ndarray
    """int64, shape [f], corners of each."""
    indices: np.ndarray
    """int64, shape [c], vertex of every corner of the source; valid for these faces."""

    @property
    def corners(self) -> np.ndarray:
        """Position in ``indices`` of all corners of these faces, one after the other: int64, shape [corners]."""
        return np.repeat(self.starts, self.counts) + _ranges(self.counts)

    def __getitem__(self, chosen: np.ndarray) -> Polygons:
        return Polygons(self.faces[chosen], self.starts[chosen], self.counts[chosen], self.indices)


def drawable_polygons(
    is_usable: np.ndarray, counts: np.ndarray, indices: np.ndarray, path: str, report: Report
) -> Polygons:
    """Return the faces that have three or more corners, all at usable points; the others give a diagnostic.

    Args:
        is_usable: Whether each point has a position, shape [n].
        counts: Corners of each face, any integers, shape [f].
        indices: Vertex of each corner, any integers, shape [c].
        path: Mesh prim, for diagnostics.
        report: Takes the diagnostics.
    """
    lengths = np.clip(counts, 0, len(indices) + 1)
    ends = np.cumsum(lengths)
    starts = ends - lengths
    is_complete = ends <= len(indices)
    if ends[-1] != len(indices):
        report.warn(
            BAD_TOPOLOGY, path, f"faceVertexCounts sum to {counts.sum()}, faceVertexIndices has {len(indices)} entries"
        )
    in_range = (indices >= 0) & (indices < len(is_usable))
    at_point = in_range.copy()
    at_point[in_range] = is_usable[indices[in_range]]
    is_polygon = counts >= 3
    has_indices = is_complete & _holds_for_all(in_range, starts, ends)
    has_points = is_complete & _holds_for_all(at_point, starts, ends)
    for code, dropped, why in (
        (FEW_VERTICES, ~is_polygon, "fewer than three vertices"),
        (BAD_INDEX, is_polygon & ~has_indices, "index out of range"),
        (BAD_POINT, is_polygon & has_indices & ~has_points, "point not finite"),
    ):
        if dropped.any():
            report.warn(code, path, f"{counted(dropped.sum(), 'face')} dropped, {why}")
    kept = np.flatnonzero(is_polygon & has_points)
    return Polygons(kept, starts[kept], lengths[kept], indices)


def smooth_normals(points: np.ndarray, polygons: Polygons) -> np.ndarray:
    """Return a unit normal for each point: float32, shape [n, 3]; zero where no face of positive area meets it.

    Each corner counts with the cross product of its two edges, so that a quadrilateral's diagonal does not matter.

    Reference: OpenUSD, Hd_SmoothNormals.
    """
    corner = polygons.corners
    first = np.repeat(polygons.starts, polygons.counts)
    count = np.repeat(polygons.counts, polygons.counts)
    position = points.astype(np.float64)
    here = position[polygons.indices[corner]]
    following = position[polygons.indices[first + (corner - first + 1) % count]]
    previous = position[polygons.indices[first + (corner - first - 1) % count]]
    weighted = np.cross(following - here, previous - here)
    vertex = polygons.indices[corner]
    sums = np.stack([np.bincount(vertex, weighted[:, axis], len(points)) for axis in range(3)], axis=1)
    sums = sums.astype(np.float64, copy=False)  # of no corners, bincount makes integers
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.divide(sums, lengths, out=np.zeros_like(sums), where=lengths > 0).astype(np.float32)


def _holds_for_all(holds: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return for each range of corners whether a property holds for all of them; ranges may reach beyond the end."""
    broken = np.concatenate([[0], np.cumsum(~holds)])
    last = len(holds)
    return broken[np.minimum(ends, last)] == broken[np.minimum(starts, last)]


def _ranges(counts: np.ndarray) -> np.ndarray:
    """Return 0 to count - 1 for each count, one after the other."""
    ends = np.cumsum(counts)
    return np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts, counts)
