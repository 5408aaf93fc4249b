# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""PointInstancer: which prototype stands where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.usd.arrays import integers, vector_rows
from warp_rt.usd.primvars import rows_by_instance
from warp_rt.usd.stage import has_rate
from warp_rt.usd.transforms import is_regular

BAD_ARRAY = "W120"
BAD_PROTOTYPE = "W121"
BAD_TRANSFORM = "W122"

_BLOCK = 1 << 14  # rotations at a time: what is computed on the way takes little memory


@dataclass(frozen=True)
class PointInstances:
    """The instances of a PointInstancer that are shown."""

    prototypes: tuple[Sdf.Path, ...]
    index: np.ndarray
    """int64, shape [n], position of each in the instancer's arrays."""
    prototype: np.ndarray
    """int64, shape [n], row of ``prototypes``."""
    matrices: np.ndarray
    """float64, shape [n, 4, 4], instancer from prototype: scale first, then orientation, then position."""
    values: Mapping[str, np.ndarray]
    """Primvars that differ by instance: float32, shape [n, c], by name."""


def read_point_instances(
    prim: Usd.Prim, time: Usd.TimeCode, carried_to: Usd.TimeCode | None, report: Report
) -> PointInstances:
    """Return the instances of a PointInstancer; what is malformed is left out with a diagnostic.

    ``orientationsf`` takes precedence over ``orientations``; ``invisibleIds`` and the metadata ``inactiveIds`` hide
    instances. Between time samples velocities move the instances (UsdGeomPointInstancer, "Computing an Instance
    Transform").

    Args:
        prim: The instancer.
        time: When its arrays are read.
        carried_to: When its velocities have carried the instances from their sample; None: they do not.
        report: Takes the diagnostics.
    """
    schema = UsdGeom.PointInstancer(prim)
    path = prim.GetPath()
    prototypes = tuple(schema.GetPrototypesRel().GetForwardedTargets())
    prototype = _integers(schema.GetProtoIndicesAttr(), time, report)
    prototype = np.zeros(0, np.int64) if prototype is None else prototype
    count = len(prototype)
    matrices = _moved_matrices(schema, count, time, time if carried_to is None else carried_to, report)
    if matrices is None:
        matrices = _matrices(schema, count, time, report)
    if not count or matrices is None:
        empty = np.zeros(0, np.int64)
        return PointInstances(prototypes, empty, empty, np.zeros((0, 4, 4)), {})
    is_shown = _shown_ids(schema, count, time, report)
    in_range = (prototype >= 0) & (prototype < len(prototypes))
    if not in_range.all():
        report.warn(BAD_PROTOTYPE, path, f"{(~in_range).sum()} instances left out: protoIndices name no prototype")
    is_invertible = is_regular(matrices)
    if not (is_invertible | ~is_shown).all():
        dropped = (is_shown & ~is_invertible).sum()
        report.warn(BAD_TRANSFORM, path, f"{dropped} instances left out: their transform is singular or not finite")
    kept = np.flatnonzero(is_shown & in_range & is_invertible)
    values = rows_by_instance(prim, count, time, report)
    if len(kept) < count:
        prototype, matrices = prototype[kept], matrices[kept]
        values = {name: rows[kept] for name, rows in values.items()}
    return PointInstances(prototypes, kept, prototype, matrices, values)


def rotation_matrices(quaternions: np.ndarray) -> np.ndarray:
    """Return rotations of column vectors: float64, shape [n, 3, 3]; the identity for a quaternion of no length.

    Quaternions are normalised first, for half precision is a thousandth off unit length. UsdGeomPointInstancer's own
    matrices keep that as a change of size.

    Args:
        quaternions: i, j, k, real; shape [n, 4].
    """
    q = quaternions.astype(np.float64)
    norm = np.linalg.norm(q, axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):  # of what is not finite, which the caller leaves out
        q = np.where(norm == 0, [0.0, 0.0, 0.0, 1.0], q / np.where(norm == 0, 1, norm))
    vector, real = q[:, :3], q[:, 3]
    cross = np.zeros((len(q), 3, 3))
    cross[:, [2, 0, 1], [1, 2, 0]] = vector
    cross[:, [1, 2, 0], [2, 0, 1]] = -vector
    # Rodrigues' formula in quaternion form: 1 + 2 w [v] + 2 [v]^2.
    return np.eye(3) + 2 * real[:, None, None] * cross + 2 * (cross @ cross)


def _matrices(schema: UsdGeom.PointInstancer, count: int, time: Usd.TimeCode, report: Report) -> np.ndarray | None:
    """Return instancer-from-prototype matrices, shape [count, 4, 4]; None, with a diagnostic, without positions."""
    path = schema.GetPath()
    positions = vector_rows(schema.GetPositionsAttr().Get(time), 3)
    found = 0 if positions is None else len(positions)
    if positions is None or found < count or not count:
        if found or count:
            report.warn(BAD_ARRAY, path, f"instancer left out: {found} positions for {count} protoIndices")
        return None
    if found > count:
        report.warn(BAD_ARRAY, path, f"{found} positions for {count} protoIndices: the first {count} count")
        positions = positions[:count]
    matrices = np.empty((count, 4, 4))
    matrices[:] = np.eye(4)
    matrices[:, :3, 3] = positions
    precise = schema.GetOrientationsfAttr()
    is_precise = bool(precise.Get(Usd.TimeCode.EarliestTime()))  # which decides for all times, says the schema
    orientations = (precise if is_precise else schema.GetOrientationsAttr()).Get(time)
    for name, value, width in (("orientations", orientations, 4), ("scales", schema.GetScalesAttr().Get(time), 3)):
        rows = vector_rows(value, width)
        if value is None or (rows is not None and not len(rows)):
            continue
        if rows is None or len(rows) != count:
            held = type(value).__name__ if rows is None else len(rows)
            report.warn(BAD_ARRAY, path, f"{name} left out: {held} for {count} protoIndices")
        elif width == 4:
            for start in range(0, count, _BLOCK):
                block = slice(start, start + _BLOCK)
                matrices[block, :3, :3] = rotation_matrices(rows[block])
        else:
            matrices[:, :3, :3] *= rows[:, None, :]
    return matrices


def _moved_matrices(
    schema: UsdGeom.PointInstancer, count: int, time: Usd.TimeCode, carried_to: Usd.TimeCode, report: Report
) -> np.ndarray | None:
    """Return USD's own matrices where velocities move the instances; None where they do not or USD gives none."""
    motions = (schema.GetVelocitiesAttr(), schema.GetAngularVelocitiesAttr(), schema.GetAccelerationsAttr())
    if time.IsDefault() or not any(attribute.HasAuthoredValue() for attribute in motions):
        return None
    if not has_rate(schema.GetPrim().GetStage()):
        return None
    for attribute in motions:
        value = attribute.Get(time)
        if value is not None and vector_rows(value, 3) is None:
            message = f"{attribute.GetName()} left out: it holds a {type(value).__name__}"
            report.warn(BAD_ARRAY, attribute.GetPrimPath(), message)
    try:
        matrices = schema.ComputeInstanceTransformsAtTime(
            carried_to, time, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
    except Tf.ErrorException:
        return None
    if matrices is None or len(matrices) != count or not count:
        return None
    return np.asarray(matrices, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1).copy()


def _integers(attribute: Usd.Attribute, time: Usd.TimeCode, report: Report) -> np.ndarray | None:
    value = attribute.Get(time)
    found = integers(value)
    if found is None and value is not None:
        message = f"{attribute.GetName()} left out: it holds a {type(value).__name__}"
        report.warn(BAD_ARRAY, attribute.GetPrimPath(), message)
    return found


def _shown_ids(schema: UsdGeom.PointInstancer, count: int, time: Usd.TimeCode, report: Report) -> np.ndarray:
    """Return which instances are neither invisible nor inactive: bool, shape [count]."""
    hidden = []
    invisible = _integers(schema.GetInvisibleIdsAttr(), time, report)
    if invisible is not None:
        hidden.append(invisible)
    inactive = schema.GetPrim().GetMetadata("inactiveIds")
    if inactive is not None:
        hidden.append(np.array(list(inactive.GetAppliedItems()), np.int64))
    ids = _integers(schema.GetIdsAttr(), time, report)
    if ids is None or not len(ids):
        ids = np.arange(count)
    elif len(ids) != count:
        report.warn(BAD_ARRAY, schema.GetPath(), f"ids left out: {len(ids)} of them for {count} protoIndices")
        ids = np.arange(count)
    return ~np.isin(ids, np.concatenate(hidden)) if hidden else np.ones(count, bool)
