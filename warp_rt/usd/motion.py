# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What moves while a shutter is open, and points that velocities carry along.

Reference: UsdGeomPointBased and UsdGeomPointInstancer schema documentation, "velocities".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pxr import Gf, Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Camera
from warp_rt.usd.arrays import float_rows, vector_rows
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.questions import get_type_name
from warp_rt.usd.stage import has_rate

IDLE_VELOCITIES = "N936"

# What is carried, and by what.
_OF_POINTS = (("points", "velocities"),)
_OF_INSTANCES = (
    ("positions", "velocities"),
    ("orientations", "angularVelocities"),
    ("orientationsf", "angularVelocities"),
)
# What counts at the frame, and boxes, which are computed.
_STEADY = ("inputs:", "extent")
_MOTIONS = ("velocities", "angularVelocities", "accelerations")


def moves(stage: Usd.Stage, first: float, last: float) -> bool:
    """Return whether anything that blurs differs, or may, between two time codes.

    That is all that a stage says but the inputs of lights and materials.

    Args:
        stage: With its value clips and the velocities of its points.
        first: Time code.
        last: Time code, not before ``first``.
    """
    roots = (stage.GetPseudoRoot(), *stage.GetPrototypes())
    return any(_any_differs(Usd.PrimRange(root, Usd.PrimAllPrimsPredicate), first, last) for root in roots)


def without_idle_shutters(stage: Usd.Stage, cameras: Sequence[Camera], time: Usd.TimeCode) -> list[Camera]:
    """Return the cameras of a frame; those that nothing moves before while their shutter is open have none.

    A shutter that closes before it opens is not idle: it exposes nothing.


    Args:
        stage: What they see.
        cameras: As they are at the frame.
        time: The frame; at the default time nothing moves.
    """
    is_moving: dict[tuple[float, float], bool] = {(0.0, 0.0): False}
    found = []
    for camera in cameras:
        shutter = camera.shutter
        if shutter not in is_moving:
            frame = 0.0 if time.IsDefault() else time.GetValue()
            first, last = frame + min(0.0, shutter[0]), frame + max(0.0, shutter[1])
            is_reversed = shutter[1] < shutter[0]
            is_moving[shutter] = is_reversed or (not time.IsDefault() and moves(stage, first, last))
        found.append(camera if is_moving[shutter] else replace(camera, shutter=(0.0, 0.0)))
    return found


def read_times(
    prim: Usd.Prim, time: Usd.TimeCode, base_time: Usd.TimeCode, report: Report
) -> tuple[Usd.TimeCode, Usd.TimeCode | None]:
    """Return when a prim's arrays are read, and when velocities have carried its points from there; None: they do not.

    Args:
        prim: A UsdGeomPointBased or PointInstancer.
        time: What is drawn.
        base_time: The frame that ``time`` is a moment of: where there are velocities, topology and points are those of
            the sample at or before it.
        report: Takes a note of velocities that carry nothing.
    """
    carrying = carriers(prim, base_time)
    if not base_time.IsDefault() and has_rate(prim.GetStage()):
        for name in dict.fromkeys(carrier for _, carrier in _carried(prim)):
            if name not in carrying:
                what = " or ".join(carried for carried, carrier in _carried(prim) if carrier == name)
                _note_idle(prim, name, what, base_time, report)
        if not ("velocities" in carrying and _fit(prim, "velocities", "accelerations", base_time)):
            _note_idle(prim, "accelerations", "velocities that carry", base_time, report)
    return (base_time, time) if carrying else (time, None)


def _note_idle(prim: Usd.Prim, name: str, what: str, time: Usd.TimeCode, report: Report) -> None:
    value = prim.GetAttribute(name).Get(time)
    speeds = vector_rows(value, 3)
    if speeds is None and value is not None and get_type_name(prim) != "PointInstancer":  # whose arrays are W120's
        report.warn(IDLE_VELOCITIES, prim.GetPath(), f"{name} carry nothing: {shown(value)} are no vectors")
    elif speeds is not None and speeds.any():
        message = f"{name} carry nothing: not as many, or not with samples at the same times, as {what}"
        report.warn(IDLE_VELOCITIES, prim.GetPath(), message)


def _carried(prim: Usd.Prim) -> tuple[tuple[str, str], ...]:
    return _OF_INSTANCES if get_type_name(prim) == "PointInstancer" else _OF_POINTS


def carriers(prim: Usd.Prim, time: Usd.TimeCode) -> set[str]:
    """Return the velocities that move a prim's points, or a PointInstancer's instances, away from their sample.

    They do where both have samples at the same times before and after, and as many elements in the one before.
    """
    if time.IsDefault() or not has_rate(prim.GetStage()):
        return set()
    return {carrier for carried, carrier in _carried(prim) if _fit(prim, carried, carrier, time)}


def _fit(prim: Usd.Prim, carried: str, carrier: str, time: Usd.TimeCode) -> bool:
    """Return whether an attribute can carry another from the sample at or before a time."""
    points, velocities = prim.GetAttribute(carried), prim.GetAttribute(carrier)
    if not (points and velocities and velocities.GetNumTimeSamples()):
        return False
    samples = velocities.GetBracketingTimeSamples(time.GetValue())
    if samples != points.GetBracketingTimeSamples(time.GetValue()):
        return False
    here, speeds = float_rows(points.Get(samples[0])), float_rows(velocities.Get(samples[0]))
    return here is not None and speeds is not None and len(here) == len(speeds) > 0


def read_points(prim: Usd.Prim, time: Usd.TimeCode, carried_to: Usd.TimeCode | None) -> np.ndarray | None:
    """Return the points of a UsdGeomPointBased: float32, shape [n, 3]; None where it has none.

    Args:
        prim: The prim.
        time: When they are read.
        carried_to: When its velocities have carried them from the sample at or before ``time``; None: they do not.
    """
    schema = UsdGeom.PointBased(prim)
    if carried_to is None:
        return vector_rows(schema.GetPointsAttr().Get(time), 3)
    return vector_rows(schema.ComputePointsAtTime(carried_to, time), 3)


def _any_differs(prims: Usd.PrimRange, first: float, last: float) -> bool:
    clipped = None  # path of the topmost prim with value clips that the current one is or is below of
    for prim in prims:
        if clipped is None or not prim.GetPath().HasPrefix(clipped):
            clipped = prim.GetPath() if prim.HasAuthoredMetadata("clips") else None
        # Clips give values to what no layer authors, of which USD does not always know whether it may vary.
        has_clips = clipped is not None
        attributes = prim.GetAttributes() if has_clips else prim.GetAuthoredAttributes()
        if any(_differs(attribute, first, last, has_clips) for attribute in attributes):
            return True
    return False


def _differs(attribute: Usd.Attribute, first: float, last: float, has_clips: bool) -> bool:
    name = attribute.GetName()
    if name in _MOTIONS and attribute.GetNumTimeSamples():
        return True
    if name.startswith(_STEADY) or not (has_clips or attribute.ValueMightBeTimeVarying()):
        return False
    if attribute.HasSpline():
        return True
    start = attribute.Get(first)
    between = attribute.GetTimeSamplesInInterval(Gf.Interval(first, last))
    return any(attribute.Get(time) != start for time in (*between, last))
