# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""PointInstancer: which prototype stands where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom

from warp_rt.report import Report, counted
from warp_rt.scene.instance_transforms import ScatteredTransforms, Transforms, choose
from warp_rt.usd.arrays import integers, short_rows, vector_rows
from warp_rt.usd.primvars import rows_by_instance
from warp_rt.usd.transforms import is_regular

BAD_ARRAY = "W120"
BAD_PROTOTYPE = "W121"
BAD_TRANSFORM = "W122"


@dataclass(frozen=True)
class PointInstances:
    """The instances of a PointInstancer that are shown."""

    prototypes: tuple[Sdf.Path, ...]
    index: np.ndarray
    """int64, shape [n], position of each in the instancer's arrays."""
    prototype: np.ndarray
    """int64, shape [n], row of ``prototypes``."""
    matrices: Transforms
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
    motions = (schema.GetVelocitiesAttr(), schema.GetAngularVelocitiesAttr(), schema.GetAccelerationsAttr())
    _report_types(dict.fromkeys(motions, 3), time, report)
    moved = None if carried_to is None else _moved_matrices(schema, count, time, carried_to, report)
    matrices = _transforms(schema, count, time, report) if moved is None else moved
    if not count or matrices is None:
        empty = np.zeros(0, np.int64)
        return PointInstances(prototypes, empty, empty, np.zeros((0, 4, 4)), {})
    is_shown = _shown_ids(schema, count, time, report)
    in_range = (prototype >= 0) & (prototype < len(prototypes))
    if not in_range.all():
        report.warn(
            BAD_PROTOTYPE, path, f"{counted((~in_range).sum(), 'instance')} left out: protoIndices name no prototype"
        )
    is_invertible = is_regular(matrices) if isinstance(matrices, np.ndarray) else matrices.are_regular()
    if not (is_invertible | ~is_shown).all():
        dropped = (is_shown & ~is_invertible).sum()
        report.warn(
            BAD_TRANSFORM, path, f"{counted(dropped, 'instance')} left out: a transform that is singular or not finite"
        )
    kept = np.flatnonzero(is_shown & in_range & is_invertible)
    values = rows_by_instance(prim, count, time, report)
    if len(kept) < count:
        prototype = prototype[kept]
        values = {name: rows[kept] for name, rows in values.items()}
    shown = matrices if len(kept) == count else choose(matrices, kept)
    return PointInstances(prototypes, kept, prototype, shown, values)


def _transforms(
    schema: UsdGeom.PointInstancer, count: int, time: Usd.TimeCode, report: Report
) -> ScatteredTransforms | None:
    """Return the transforms from prototype to instancer; None, with a diagnostic, without positions."""
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
    orientations = _orientations(schema).Get(time)
    parts: dict[str, np.ndarray] = {}
    for name, value, width in (("orientations", orientations, 4), ("scales", schema.GetScalesAttr().Get(time), 3)):
        rows = short_rows(value, width)
        if value is None or (rows is not None and not len(rows)):
            continue
        if rows is None or len(rows) != count:
            held = type(value).__name__ if rows is None else len(rows)
            report.warn(BAD_ARRAY, path, f"{name} left out: {held} for {count} protoIndices")
        else:
            parts[name] = rows
    return ScatteredTransforms(positions, parts.get("orientations"), parts.get("scales"))


def _moved_matrices(
    schema: UsdGeom.PointInstancer, count: int, time: Usd.TimeCode, carried_to: Usd.TimeCode, report: Report
) -> np.ndarray | None:
    """Return USD's own matrices of instances that velocities move; None where it gives none."""
    _report_types({schema.GetScalesAttr(): 3, _orientations(schema): 4}, time, report)
    try:
        matrices = schema.ComputeInstanceTransformsAtTime(
            carried_to, time, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
    except Tf.ErrorException:
        return None
    if matrices is None or len(matrices) != count or not count:
        return None
    return np.asarray(matrices, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1).copy()


def _report_types(widths: Mapping[Usd.Attribute, int], time: Usd.TimeCode, report: Report) -> None:
    """Report attributes whose values are no rows of so many numbers."""
    for attribute, width in widths.items():
        value = attribute.Get(time)
        if value is not None and vector_rows(value, width) is None:
            message = f"{attribute.GetName()} left out: it holds a {type(value).__name__}"
            report.warn(BAD_ARRAY, attribute.GetPrimPath(), message)


def _orientations(schema: UsdGeom.PointInstancer) -> Usd.Attribute:
    """Return the attribute that holds the orientations; the earliest sample decides for all times, says the schema."""
    precise = schema.GetOrientationsfAttr()
    return precise if precise.Get(Usd.TimeCode.EarliestTime()) else schema.GetOrientationsAttr()


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
