# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomCamera to Camera.

Focal length and apertures are in tenths of a scene unit, clipping distances in scene units.

Reference: UsdGeomCamera schema documentation.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from pxr import Gf, Usd

from warp_rt.report import Report
from warp_rt.scene import Camera, Settings
from warp_rt.usd.arrays import vector_rows
from warp_rt.usd.attribute_values import AttributeReader, numbers, shown

NO_FOCUS = "W421"
BAD_PLANES = "W422"
INVALID_CAMERA = "W424"
BACK_PLATE = "W425"
HIDES_ALL = "W426"

# The schema's fallbacks, which also stand in for values without meaning.
_FOCAL_LENGTH = 50.0
_HORIZONTAL_APERTURE = 20.955
_VERTICAL_APERTURE = 15.2908
_PROJECTIONS = ("perspective", "orthographic")
_TENTH = 0.1  # scene units in a unit of aperture


def read_camera(prim: Usd.Prim, world_from_local: np.ndarray, time: Usd.TimeCode, report: Report) -> Camera:
    """Return a camera.

    Args:
        prim: A UsdGeomCamera.
        world_from_local: float64, shape [4, 4], acting on column vectors.
        time: When.
        report: Takes diagnostics about what is ignored or makes no sense.
    """
    attributes = AttributeReader(prim, time, INVALID_CAMERA, report)
    _report_ignored(prim, report)
    is_perspective = attributes.token("projection", _PROJECTIONS[0], _PROJECTIONS) == "perspective"
    f_number = attributes.number("fStop", 0.0)
    focal_length = _FOCAL_LENGTH
    if is_perspective or f_number > 0:
        focal_length = _positive(prim, "focalLength", attributes, _FOCAL_LENGTH, report)
    lens_radius, focus_distance = _lens(prim, focal_length, f_number, attributes, report)
    width = _positive(prim, "horizontalAperture", attributes, _HORIZONTAL_APERTURE, report)
    height = _positive(prim, "verticalAperture", attributes, _VERTICAL_APERTURE, report)
    x = attributes.number("horizontalApertureOffset", 0.0)
    y = attributes.number("verticalApertureOffset", 0.0)
    scale = 1 / focal_length if is_perspective else _TENTH
    return Camera(
        str(prim.GetPath()),
        _transform(prim, world_from_local, report),
        (scale * (x - width / 2), scale * (x + width / 2), scale * (y - height / 2), scale * (y + height / 2)),
        is_perspective=is_perspective,
        clipping_range=_clipping_range(prim, is_perspective, attributes, report),
        clipping_planes=_clipping_planes(prim, attributes, report),
        lens_radius=lens_radius,
        focus_distance=focus_distance,
        exposure_scale=_exposure_scale(prim, attributes, report),
        shutter=(attributes.number("shutter:open", 0.0), attributes.number("shutter:close", 0.0)),
    )


def report_hidden(cameras: Sequence[Camera], bounds: np.ndarray, report: Report) -> None:
    """Report the cameras whose clipping hides the whole scene.

    Args:
        cameras: In world space.
        bounds: Box of the scene, shape [2, 3]; NaN where there is none.
        report: Takes the diagnostics.
    """
    if not np.isfinite(bounds).all():
        return
    corners = np.array([(x, y, z, 1.0) for x, y, z in itertools.product(*bounds.T)])
    for camera in cameras:
        matrix = camera.world_from_camera
        forward = np.cross(matrix[:3, 1], matrix[:3, 0])
        forward *= np.sign(forward @ -matrix[:3, 2]) / np.linalg.norm(forward)
        depth = (corners[:, :3] - matrix[:3, 3]) @ forward
        near, far = camera.clipping_range
        in_camera = corners @ np.linalg.inv(matrix).T
        is_ahead = depth.max() > 0 or (near < 0 and not camera.is_perspective)  # else it is not clipping that hides it
        if is_ahead and (depth.max() < near or depth.min() > far):
            reach = f"from {depth.min():g} to {depth.max():g} away"
            report.warn(HIDES_ALL, camera.path, f"clippingRange ({near:g}, {far:g}) hides the whole scene, {reach}")
        for plane in camera.clipping_planes:
            if (in_camera @ plane < 0).all():
                shown_plane = ", ".join(f"{number:g}" for number in plane)
                report.warn(HIDES_ALL, camera.path, f"the clipping plane ({shown_plane}) hides the whole scene")


def report_unexposed(cameras: Sequence[Camera], settings: Sequence[Settings], report: Report) -> None:
    """Report the cameras whose shutter closes before it opens, where render settings leave it so.

    Args:
        cameras: All.
        settings: What pictures may be made with.
        report: Takes the diagnostics.
    """
    leaving = [not (one.disables_motion_blur or one.has_instantaneous_shutter) for one in settings]
    for camera in cameras:
        opens, closes = camera.shutter
        if closes < opens and any(leaving):
            unless = "" if all(leaving) else " where a product leaves the shutter so"
            message = f"shutter:close, {closes:g}, is before shutter:open, {opens:g}: nothing is exposed"
            report.warn(INVALID_CAMERA, camera.path, f"{message}, the picture is black{unless}")


def _positive(prim: Usd.Prim, name: str, attributes: AttributeReader, default: float, report: Report) -> float:
    value = attributes.value(name)
    found = numbers(value)
    if found is not None and len(found) == 1 and found[0] > 0:
        return found[0]
    report.warn(INVALID_CAMERA, prim.GetPath(), f"{name} is {shown(value)}, no length above 0; {default:g} is used")
    return default


def _transform(prim: Usd.Prim, world_from_local: np.ndarray, report: Report) -> np.ndarray:
    matrix = np.array(world_from_local, float)
    linear = matrix[:3, :3]
    if np.isfinite(matrix).all() and abs(np.linalg.det(linear)) > 1e-12 * np.linalg.norm(linear) ** 3:
        return matrix
    report.warn(INVALID_CAMERA, prim.GetPath(), "the transform is singular or not finite; only its translation counts")
    result = np.eye(4)
    result[:3, 3] = np.nan_to_num(matrix[:3, 3], posinf=0.0, neginf=0.0)
    return result


def _clipping_range(
    prim: Usd.Prim, is_perspective: bool, attributes: AttributeReader, report: Report
) -> tuple[float, float]:
    """Return the authored range. The schema's (1, 1e6) would hide what is nearer than a metre in metre scenes."""
    if not prim.GetAttribute("clippingRange").HasAuthoredValue():
        return 0.0, math.inf
    value = attributes.value("clippingRange")
    near, far = map(float, value) if isinstance(value, Gf.Vec2f | Gf.Vec2d) else (math.nan, math.nan)
    if not (math.isfinite(near) and near < far):  # nothing is too far for a far end that is infinite
        report.warn(INVALID_CAMERA, prim.GetPath(), "clippingRange is not near < far; nothing is clipped")
        return 0.0, math.inf
    return max(near, 0.0) if is_perspective else near, far


def _clipping_planes(
    prim: Usd.Prim, attributes: AttributeReader, report: Report
) -> tuple[tuple[float, float, float, float], ...]:
    value = attributes.value("clippingPlanes")
    rows = vector_rows(value, 4)
    if rows is None or not np.isfinite(rows).all():
        if value is not None:
            report.warn(BAD_PLANES, prim.GetPath(), "clippingPlanes are not rows of 4 finite numbers; ignored")
        return ()
    return tuple((a, b, c, d) for a, b, c, d in rows.tolist())


def _lens(
    prim: Usd.Prim, focal_length: float, f_number: float, attributes: AttributeReader, report: Report
) -> tuple[float, float]:
    """Return the radius of the lens and the distance of the plane in focus [scene unit]; zeros: all is sharp."""
    if f_number <= 0:
        if f_number < 0:
            report.warn(INVALID_CAMERA, prim.GetPath(), f"fStop is {f_number:g}, below 0; drawn sharp")
        return 0.0, 0.0
    focus_distance = attributes.number("focusDistance", 0.0)
    if focus_distance <= 0:
        # Which would blur everything without end.
        report.warn(NO_FOCUS, prim.GetPath(), "fStop is set without a focusDistance above 0; drawn sharp")
        return 0.0, 0.0
    return _TENTH * focal_length / f_number / 2, focus_distance


def _exposure_scale(prim: Usd.Prim, attributes: AttributeReader, report: Report) -> float:
    """Return the factor from radiance to pixel values (UsdGeomCamera, "Exposure Attributes")."""
    f_number = attributes.number("exposure:fStop", 1.0)
    gain = attributes.number("exposure:iso", 100.0) / 100.0 * attributes.number("exposure:responsivity", 1.0)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        scale = attributes.number("exposure:time", 1.0) * gain * np.exp2(attributes.number("exposure", 0.0))
        scale = float(np.float32(scale / np.float64(f_number) ** 2))  # as OpenUSD has it, and films
    if math.isfinite(scale) and scale >= 0:
        return scale
    what = "below 0" if scale < 0 else "not finite"
    report.warn(INVALID_CAMERA, prim.GetPath(), f"the exposure, by which colours are multiplied, is {what}; ignored")
    return 1.0


def _report_ignored(prim: Usd.Prim, report: Report) -> None:
    if any(schema.startswith("BackPlateAPI:") for schema in prim.GetAppliedSchemas()):
        report.warn(BACK_PLATE, prim.GetPath(), "back plates are not supported; ignored")
