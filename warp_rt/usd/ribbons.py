# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Curves with normals: flat ribbons, as wide as the curves, that face the way the normals do.

Reference: UsdGeomBasisCurves schema documentation, "Tubes and Ribbons".
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warp_rt.errors import LimitError
from warp_rt.scene import Mesh, Primvar
from warp_rt.splines.pieces import bernstein
from warp_rt.usd.subdivision import MAX_FACES

# Distance of a ribbon's triangles from it, in parts of the diagonal of the box about all control points: a pixel where
# the prim fills a picture of a thousand.
TOLERANCE = 1e-3

# A cubic segment has so many steps at least, so that one much smaller than its prim still bends.
_LEAST_STEPS = 4

# More than anybody can mean, and few enough to count them.
_MOST_STEPS = 1 << 40

# A corner between segments is as wide as they are while its miter is no longer than this, in widths.
_MITER_LIMIT = 4.0

# Segments of a curve join where one begins within this part of the prim's size of the other's end.
_JOINED = 1e-6

# Cosine of the angle up to which two segments lie the same way across where they meet.
_SAME_SIDE = 0.9999

_SAMPLES = np.linspace(0, 1, 9)


def make_ribbons(
    controls: np.ndarray,
    radii: np.ndarray,
    normals: Primvar,
    curve: np.ndarray,
    primvars: Mapping[str, Primvar],
    level: int,
    path: str,
) -> Mesh:
    """Return the triangles of ribbons.

    Across, a ribbon runs along the cross product of its tangent and its normal; where segments meet at a corner, it is
    mitered. Its sides are those of the curve's width, at each parameter; its shading normals are the given ones, made
    perpendicular to the curve.

    Args:
        controls: Bezier points of each segment, float64, shape [n, k, 3], k = 2 or 4; those of a curve in order.
        radii: Half the width at them, float64, shape [n, k].
        normals: Along the segments, as primvars of ``Shapes`` are.
        curve: Of each segment, shape [n].
        primvars: Along the segments.
        level: The distance from the ribbon is divided by four for each.
        path: Of the prim, for errors.

    Raises:
        LimitError: There would be more triangles than can be meant.
    """
    size = float(np.linalg.norm(np.ptp(controls.reshape(-1, 3), axis=0)))
    steps = _count_steps(controls, radii, normals, TOLERANCE * size / 4**level)
    if 2 * steps.sum() > MAX_FACES:
        raise LimitError(f"{path}: its ribbons would have {2 * steps.sum()} triangles; {MAX_FACES} can be meant")
    segment = np.repeat(np.arange(len(steps)), steps + 1)
    first = np.cumsum(steps + 1) - steps - 1
    at = (np.arange(len(segment)) - first[segment]) / steps[segment]
    center, tangent, normal, radius = _frame(controls, radii, normals, segment, at)
    into, out_of = _joints(controls, curve, size)
    last = first + steps
    # At a joint both segments have the mean of their directions.
    joint = tangent[last[into]] + tangent[first[out_of]]
    length = np.linalg.norm(joint, axis=1, keepdims=True)
    joint = np.where(length > 1e-6, joint / np.where(length > 0, length, 1), tangent[last[into]])
    miter = 1 / np.maximum(np.einsum("ni,ni->n", joint, tangent[last[into]]), 1 / _MITER_LIMIT)
    for rows in (last[into], first[out_of]):
        tangent[rows] = joint
        radius[rows] *= miter
    side, normal = _across(tangent, normal)
    offset = radius[:, None] * side
    points = np.stack([center - offset, center + offset], axis=1)
    # One pair of points for both segments, to the last bit; a Moebius strip meets itself the other way round.
    agreement = np.einsum("ni,ni->n", side[last[into]], side[first[out_of]])
    for rows, order in ((agreement > _SAME_SIDE, [0, 1]), (agreement < -_SAME_SIDE, [1, 0])):
        points[first[out_of[rows]]] = points[last[into[rows]]][:, order]
    begin = np.setdiff1d(np.arange(len(segment)), last)
    a, b, c, d = 2 * begin, 2 * begin + 1, 2 * begin + 3, 2 * begin + 2
    triangles = np.stack([a, c, b, a, d, c], axis=1).reshape(-1, 3).astype(np.int32)
    own = triangles // 2
    faces = np.repeat(segment[begin], 2)
    return Mesh(
        points=points.reshape(-1, 3).astype(np.float32),
        triangles=triangles,
        normals=Primvar(normal.astype(np.float32), own),
        primvars={name: _laid_out(value, segment, at, own, faces) for name, value in primvars.items()},
        face_ids=curve[faces].astype(np.int32),
    )


def _count_steps(controls: np.ndarray, radii: np.ndarray, normals: Primvar, tolerance: float) -> np.ndarray:
    """Return into how many steps each segment is cut: int64, shape [n].

    Chords of step h are within h^2 / 8 times the second derivative, here by differences, of the ribbon's two edges.
    """
    count = len(controls)
    segment, at = np.repeat(np.arange(count), len(_SAMPLES)), np.tile(_SAMPLES, count)
    center, tangent, normal, radius = _frame(controls, radii, normals, segment, at)
    side, _ = _across(tangent, normal)
    largest = np.zeros(count)
    for sign in (-1, 1):
        edge = (center + sign * radius[:, None] * side).reshape(count, len(_SAMPLES), 3)
        bend = np.diff(edge, n=2, axis=1) / (_SAMPLES[1] - _SAMPLES[0]) ** 2
        largest = np.maximum(largest, np.linalg.norm(bend, axis=2).max(axis=1))
    steps = np.ceil(np.minimum(np.sqrt(largest / (8 * tolerance)), _MOST_STEPS)).astype(np.int64)
    return np.maximum(steps, _LEAST_STEPS if controls.shape[1] == 4 else 1)


def _frame(
    controls: np.ndarray, radii: np.ndarray, normals: Primvar, segment: np.ndarray, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return points of the curves, unit tangents, normals of any length, shape [m, 3] each, and radii, shape [m]."""
    degree = controls.shape[1] - 1
    basis, slope = bernstein(degree, at), bernstein(degree, at, 1)
    own = controls[segment]
    tangent = np.einsum("mk,mkx->mx", slope, own)
    # Where control points coincide at an end, the curve leaves it towards the next one that does not.
    for reach in range(2, degree + 1):
        length = np.linalg.norm(tangent, axis=1)
        lost = np.flatnonzero(length <= 1e-9 * np.abs(own).max(axis=(1, 2)))
        forward = own[lost, reach] - own[lost, 0]
        backward = own[lost, degree] - own[lost, degree - reach]
        tangent[lost] = np.where(at[lost, None] < 0.5, forward, backward)
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    tangent = np.divide(tangent, length, out=np.zeros_like(tangent), where=length > 0)
    center = np.einsum("mk,mkx->mx", basis, own)
    radius = np.einsum("mk,mk->m", basis, radii[segment])
    return center, tangent, _values_at(normals, segment, at).astype(np.float64), radius


def _across(tangent: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit vectors across ribbons, and their unit normals, perpendicular to the tangents.

    A normal along the tangent, or none, says nothing: any perpendicular one is taken.
    """
    side = np.cross(normal, tangent)
    length = np.linalg.norm(side, axis=1, keepdims=True)
    is_lost = length <= 1e-6 * np.linalg.norm(normal, axis=1, keepdims=True)
    axis = np.eye(3)[np.argmin(np.abs(tangent), axis=1)]
    side = np.where(is_lost, np.cross(axis, tangent), side)
    length = np.linalg.norm(side, axis=1, keepdims=True)
    side = np.divide(side, length, out=np.zeros_like(side), where=length > 0)
    return side, np.cross(tangent, side)


def _joints(controls: np.ndarray, curve: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs of segments, one of which begins where the other ends: int64, shape [j] each.

    They follow each other on a curve, or are the last and the first one of a closed curve.
    """
    rows = np.arange(len(controls))
    is_first = np.append(True, curve[1:] != curve[:-1])
    first_of = np.maximum.accumulate(np.where(is_first, rows, 0))
    following = np.where(np.append(is_first[1:], True), first_of, rows + 1)
    gap = np.linalg.norm(controls[following, 0] - controls[:, -1], axis=1)
    joined = rows[(gap <= _JOINED * size) & (following != rows)]
    return joined, following[joined]


def _values_at(primvar: Primvar, segment: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the values of a primvar along segments at parameters: shape [m, c]."""
    if primvar.indices is None:
        return np.broadcast_to(primvar.values[0], (len(segment), primvar.values.shape[1]))
    basis = bernstein(primvar.indices.shape[1] - 1, at)
    return np.einsum("mk,mkc->mc", basis, primvar.values[primvar.indices[segment]])


def _laid_out(primvar: Primvar, segment: np.ndarray, at: np.ndarray, own: np.ndarray, faces: np.ndarray) -> Primvar:
    """Return a primvar along segments by triangle corner."""
    if primvar.indices is None:
        return primvar
    if primvar.indices.shape[1] == 1:
        return Primvar(primvar.values, np.repeat(primvar.indices[faces], 3, axis=1))
    return Primvar(_values_at(primvar, segment, at).astype(np.float32), own)
