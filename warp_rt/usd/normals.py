# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Authored normals: read, posed with their mesh, and repaired where they have no direction.

Reference: UsdGeomPointBased schema documentation, "normals".
"""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report, counted
from warp_rt.scene import Primvar
from warp_rt.usd.arrays import vector_rows
from warp_rt.usd.primvars import NOT_FINITE, WRONG_TYPE, Elements, Layout, lay_out, read_primvar
from warp_rt.usd.skinning import Skin

UNUSED_NORMALS = "N915"


def read_normals(schema: UsdGeom.PointBased, layout: Elements, time: Usd.TimeCode, report: Report) -> Primvar | None:
    """Return authored normals, in local space; ``primvars:normals`` takes precedence over the attribute ``normals``.

    Args:
        schema: The gprim.
        layout: What normals can be given of: its points, faces and corners.
        time: When.
        report: Takes diagnostics.

    Returns:
        Values of shape [n, 3], of any length, zero where they are not finite; None where none count.
    """
    path = str(schema.GetPath())
    primvar = UsdGeom.PrimvarsAPI(schema).GetPrimvar("normals")
    if primvar and primvar.HasAuthoredValue():
        normals = read_primvar(primvar, layout, time, report)
    else:
        value = schema.GetNormalsAttr().Get(time)
        if value is None:
            return None
        values = vector_rows(value, 3)
        if values is None:
            report.warn(WRONG_TYPE, path, f"normals left out: they hold a {type(value).__name__}, no vectors")
            return None
        if not len(values):
            return None
        is_finite = np.isfinite(values).all(axis=1)
        if not is_finite.all():
            report.warn(
                NOT_FINITE, path, f"{counted((~is_finite).sum(), 'normal')} not finite: the face's own is taken"
            )
            values = np.where(is_finite[:, None], values, np.float32(0))
        normals = lay_out(values, None, str(schema.GetNormalsInterpolation()), layout, path, "normals", report)
    return normals


def pose_normals(normals: Primvar, layout: Layout, skin: Skin) -> Primvar:
    """Return normals deformed by a skin, with values of their own at each corner where joints turn them apart.

    Args:
        normals: In the space that ``skin`` deforms, as laid out over the corners of triangles.
        layout: Of the mesh.
        skin: What deforms it.
    """
    values, rows = normals.values, normals.indices
    if rows is None:
        if skin.is_rigid:
            return normals
        values, rows = np.tile(values[:1], (layout.point_count, 1)), layout.triangles
    if len(values) == layout.point_count and np.array_equal(rows, layout.triangles):
        return Primvar(skin.normals(values, np.arange(layout.point_count), layout.point_count), rows)
    # A value that several corners share may be turned by other joints at each of them.
    corners = skin.normals(values[rows].reshape(-1, 3), layout.triangles.reshape(-1), layout.point_count)
    return Primvar(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))


def repair_normals(normals: Primvar, points: np.ndarray, triangles: np.ndarray) -> Primvar | None:
    """Return normals without zero vectors: corners that had one take the geometric normal of their triangle.

    Args:
        normals: In local space, values of shape [k, 3].
        points: Local space, shape [n, 3].
        triangles: Rows of points, counter-clockwise, shape [t, 3].
    """
    is_zero = ~have_length(normals.values)
    if not is_zero.any():
        return normals
    if normals.indices is None:
        return None
    values = np.where(is_zero[:, None], np.array([0, 0, 1], np.float32), normals.values)
    broken = np.flatnonzero(is_zero[normals.indices].any(axis=1))
    if not len(broken):
        return Primvar(values, normals.indices)
    corner_points = points[triangles[broken]].astype(np.float64)
    geometric = np.cross(corner_points[:, 1] - corner_points[:, 0], corner_points[:, 2] - corner_points[:, 0])
    lengths = np.linalg.norm(geometric, axis=1, keepdims=True)
    geometric = np.where(lengths > 0, geometric / np.where(lengths > 0, lengths, 1), [0.0, 0.0, 1.0])
    indices = normals.indices.copy()
    own_row = (len(values) + np.arange(len(broken), dtype=np.int32))[:, None]
    indices[broken] = np.where(is_zero[indices[broken]], own_row, indices[broken])
    return Primvar(np.concatenate([values, geometric.astype(np.float32)]), indices)


def have_length(vectors: np.ndarray) -> np.ndarray:
    """Return which vectors are not zero, rounding aside: bool, shape [n]."""
    x, y, z = vectors.astype(np.float64).T
    return x * x + y * y + z * z > 0
