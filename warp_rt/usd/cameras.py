# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomCamera to Camera.

Focal length and apertures are in tenths of a scene unit, clipping distances in scene units.

Reference: UsdGeomCamera schema documentation.
"""

from __future__ import annotations

import math

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Camera
from warp_rt.usd.attribute_values import numbers, read_float, read_token, read_value, read_vector

DEPTH_OF_FIELD = "W421"
CLIPPING_PLANES = "W422"
MOTION_BLUR = "W423"
INVALID_CAMERA = "W424"

# The schema's fallbacks, which also stand in for values without meaning.
_FOCAL_LENGTH = 50.0
_HORIZONTAL_APERTURE = 20.955
_VERTICAL_APERTURE = 15.2908
_TENTH = 0.1  # scene units in a unit of aperture


def read_camera(prim: Usd.Prim, world_from_local: np.ndarray, time: Usd.TimeCode, report: Report) -> Camera:
    """Return a camera.

    Args:
        prim: A UsdGeomCamera.
        world_from_local: float64, shape [4, 4], acting on column vectors.
        time: When.
        report: Takes diagnostics about what is ignored or makes no sense.
    """
    _report_ignored(prim, time, report)
    is_perspective = read_token(prim, "projection", time, "perspective") != "orthographic"
    width = _positive(prim, "horizontalAperture", time, _HORIZONTAL_APERTURE, report)
    height = _positive(prim, "verticalAperture", time, _VERTICAL_APERTURE, report)
    x = read_float(prim, "horizontalApertureOffset", time, 0.0)
    y = read_float(prim, "verticalApertureOffset", time, 0.0)
    scale = 1 / _positive(prim, "focalLength", time, _FOCAL_LENGTH, report) if is_perspective else _TENTH
    return Camera(
        str(prim.GetPath()),
        _transform(prim, world_from_local, report),
        (scale * (x - width / 2), scale * (x + width / 2), scale * (y - height / 2), scale * (y + height / 2)),
        is_perspective=is_perspective,
        clipping_range=_clipping_range(prim, is_perspective, time, report),
        exposure_scale=_exposure_scale(prim, time, report),
    )


def _positive(prim: Usd.Prim, name: str, time: Usd.TimeCode, default: float, report: Report) -> float:
    value = read_value(prim, name, time)
    found = numbers(value)
    if found is not None and found[0] > 0:
        return found[0]
    report.warn(INVALID_CAMERA, prim.GetPath(), f"{name} is {value}, no length above 0; {default:g} is used")
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


def _clipping_range(prim: Usd.Prim, is_perspective: bool, time: Usd.TimeCode, report: Report) -> tuple[float, float]:
    """Return the authored range. The schema's (1, 1e6) would hide what is nearer than a metre in metre scenes."""
    if not prim.GetAttribute("clippingRange").HasAuthoredValue():
        return 0.0, math.inf
    value = read_vector(prim, "clippingRange", time, 2)
    if value is None or not value[0] < value[1]:
        report.warn(INVALID_CAMERA, prim.GetPath(), "clippingRange is not near < far; nothing is clipped")
        return 0.0, math.inf
    return max(value[0], 0.0) if is_perspective else value[0], value[1]


def _exposure_scale(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> float:
    scale = float(UsdGeom.Camera(prim).ComputeLinearExposureScale(time))
    if math.isfinite(scale) and scale >= 0:
        return scale
    report.warn(INVALID_CAMERA, prim.GetPath(), "the exposure is not finite; ignored")
    return 1.0


def _report_ignored(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> None:
    path = prim.GetPath()
    if read_float(prim, "fStop", time, 0.0) > 0:
        if read_float(prim, "focusDistance", time, 0.0) > 0:
            report.warn(DEPTH_OF_FIELD, path, "depth of field is not supported yet; drawn sharp")
        else:
            report.warn(DEPTH_OF_FIELD, path, "fStop is set without a focusDistance; drawn sharp")
    planes = read_value(prim, "clippingPlanes", time)
    if planes is not None and len(planes):
        report.warn(CLIPPING_PLANES, path, "clippingPlanes are not supported; ignored")
    shutter_open = numbers(read_value(prim, "shutter:open", time)) or (0.0,)
    shutter_close = numbers(read_value(prim, "shutter:close", time)) or (0.0,)
    if shutter_open != shutter_close:
        report.warn(MOTION_BLUR, path, "motion blur is not supported yet; the shutter is instantaneous")
