# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From a scene's camera to the camera of a film: which one, how large a picture, and the struct that kernels read."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import warp as wp

from warp_rt.errors import OptionError, SceneError
from warp_rt.kernels import frame_structs
from warp_rt.near_matches import near_matches
from warp_rt.options import DEFAULT_WIDTH, MAX_SIZE, RenderOptions
from warp_rt.rendering.film_buffers import Rectangle
from warp_rt.rendering.framing import frame_scene
from warp_rt.scene import Camera, Scene, Settings

_LEAST_RATIO, _GREATEST_RATIO = 1e-4, 1e30
MAIN_CAMERA = "main_cam"  # UsdUtils.GetPrimaryCameraName()
# Corners of a box's faces, one way round as seen from outside; bit k of a corner's number is its end along axis k.
_FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


def choose_camera(scene: Scene, name: str | None, *, as_usdrecord: bool = False) -> Camera | None:
    """Return the camera to render with; None where the scene has none and must be framed.

    The one that ``name`` says (a path, or the last part of one), else the render settings' camera, else ``main_cam``,
    else the first in the stage, which usdrecord does not look through.

    Raises:
        SceneError: There is no camera of that name.
        OptionError: It is no name.
    """
    if name is not None and not isinstance(name, str):
        raise OptionError(f"camera: a Camera, or the path or name of one expected, got {type(name).__name__}")
    cameras = {camera.path: camera for camera in scene.cameras}
    if name:
        found = [camera for path, camera in cameras.items() if name in (path, path.rsplit("/", 1)[-1])]
        if found:
            return found[0]
        has = f"it has {', '.join(cameras) or 'none'}"
        lights = [*(light.path for light in scene.lights), *(dome.path for dome in scene.domes)]
        if name in (*scene.prims, *lights):
            raise SceneError(f"{scene.source or 'scene'}: {name} is no camera; {has}")
        hint = near_matches(name, [*cameras, *(path.rsplit("/", 1)[-1] for path in cameras)]) or f"; {has}"
        raise SceneError(f"{scene.source or 'scene'}: no camera {name!r}{hint}")
    if scene.settings.camera in cameras:
        return cameras[scene.settings.camera]
    main = [camera for path, camera in cameras.items() if path.endswith("/" + MAIN_CAMERA)]
    others = () if as_usdrecord else cameras.values()
    return next(iter([*main, *others]), None)


def frame_camera(scene: Scene, options: RenderOptions, *, as_usdrecord: bool = False) -> Camera:
    """Return a camera that frames the whole scene; see ``frame_scene``."""
    width, height = options.width or DEFAULT_WIDTH, options.height
    return frame_scene(scene, aspect=width / height if height else 0.0, as_usdrecord=as_usdrecord)


def image_size(camera: Camera, options: RenderOptions, settings: Settings) -> tuple[int, int]:
    """Return width and height of the picture [pixel].

    Sides that the options name are kept. Where they name none, the render settings' resolution; else 960 wide. A side
    that nobody names follows from the aspect ratio of that resolution, else of the camera; heights are truncated, as
    usdrecord does.

    Raises:
        SceneError: A side that nobody names would be too long.
    """
    if options.width is not None and options.height is not None:
        return options.width, options.height
    if options.width is None and options.height is None and settings.resolution is not None:
        return settings.resolution
    across, down = settings.resolution or (_aspect_ratio(camera), np.float32(1))
    if options.height is not None:
        width, height = max(round(options.height * across / down), 1), options.height
    else:
        width = options.width or DEFAULT_WIDTH
        height = max(int(width * down / across), 1)
    if max(width, height) > MAX_SIZE:
        why = f"its aspect ratio, {across / down:g}, makes a picture of {width} x {height} pixels"
        raise SceneError(f"{settings.path if settings.resolution else camera.path}: {why}, above {MAX_SIZE} a side")
    return width, height


def _aspect_ratio(camera: Camera) -> np.float32:
    """Return a camera's aspect ratio in single precision, as GfCamera has it.

    The window's rounding, which depends on the focal length, is below it, and would cost pictures a row now and then.
    One near to 0 counts as 1, as in usdrecord.
    """
    left, right, bottom, top = camera.window
    aspect = (right - left) / (top - bottom) if top != bottom else 0.0
    return np.float32(min(aspect, _GREATEST_RATIO) if aspect > _LEAST_RATIO else 1.0)


def conform_window(
    window: tuple[float, float, float, float], aspect: float, policy: str
) -> tuple[float, float, float, float]:
    """Return the camera's window changed about its centre so that it has the picture's aspect ratio.

    Args:
        window: left, right, bottom, top.
        aspect: Width over height of the picture as seen, pixel aspect included.
        policy: UsdRender's aspectRatioConformPolicy.
    """
    left, right, bottom, top = window
    width, height = right - left, top - bottom
    is_wider = aspect * height > width
    if policy == "adjustPixelAspectRatio":
        return window
    if policy == "adjustApertureWidth" or (policy == "expandAperture" and is_wider):
        width = aspect * height
    elif policy in ("adjustApertureHeight", "expandAperture") or is_wider:
        height = width / aspect
    else:
        width = aspect * height
    x, y = (left + right) / 2, (bottom + top) / 2
    return x - width / 2, x + width / 2, y - height / 2, y + height / 2


def picture_window(camera: Camera, width: int, height: int, settings: Settings) -> tuple[float, float, float, float]:
    """Return what a picture of ``width`` by ``height`` pixels shows of a camera's plane: left, right, bottom, top."""
    if camera.is_conformed:
        return camera.window
    return conform_window(camera.window, width / height * settings.pixel_aspect_ratio, settings.aspect_policy)


def camera_of_film(camera: Camera, size: tuple[int, int], area: Rectangle, settings: Settings) -> Camera:
    """Return the camera whose whole window a film shows, which is all or a part of a picture.

    Args:
        camera: Of the picture.
        size: Width and height of the picture [pixel].
        area: The film's place in it: x, y, width, height [pixel].
        settings: Aspect policy and pixel aspect ratio.
    """
    left, right, bottom, top = picture_window(camera, *size, settings)
    across, down = (right - left) / size[0], (bottom - top) / size[1]
    x, y, width, height = area
    window = left + x * across, left + (x + width) * across, top + (y + height) * down, top + y * down
    return dataclasses.replace(camera, window=window, is_conformed=True)


def has_lens(camera: Camera, settings: Settings) -> bool:
    """Return whether a camera's pictures have depth of field."""
    return camera.lens_radius > 0 and camera.focus_distance > 0 and not settings.disables_depth_of_field


def shutter_of(camera: Camera, settings: Settings) -> tuple[float, float]:
    """Return when a camera's shutter opens and closes, time codes from the frame's, as the render settings leave it."""
    if settings.disables_motion_blur:
        return 0.0, 0.0
    return (camera.shutter[0], camera.shutter[0]) if settings.has_instantaneous_shutter else camera.shutter


def exposed(camera: Camera, settings: Settings) -> Camera:
    """Return the camera with the exposure that the shutter leaves it, none where that closes before it opens.

    "There is no exposure and a renderer should produce a black image" (UsdGeomCamera, ``shutter:close``), but for
    settings that set the interval to [0, 0] (UsdRenderSettings, ``disableMotionBlur``) or close as they open.
    """
    opens, closes = shutter_of(camera, settings)
    return dataclasses.replace(camera, exposure_scale=0.0) if closes < opens else camera


def world_planes(camera: Camera, origin: np.ndarray) -> np.ndarray:
    """Return the clipping planes (a, b, c, d) of coordinates relative to a world point: float64, shape [n, 4].

    (a, b, c) has length 1; planes for which it has none, and which therefore hide everything or nothing, keep their d.
    """
    planes = np.array(camera.clipping_planes, float).reshape(-1, 4) @ np.linalg.inv(camera.world_from_camera)
    planes[:, 3] += planes[:, :3] @ origin
    length = np.linalg.norm(planes[:, :3], axis=1, keepdims=True)
    return planes / np.where(length > 0, length, 1.0)


def share_of_picture(box: np.ndarray, camera: Camera, width: int, height: int, settings: Settings) -> float:
    """Return the part of a picture that a box covers, 0 to 1; what lies behind the camera covers nothing.

    Each face is cut by the planes of the picture's edges (Sutherland and Hodgman 1974). Clipping ranges and planes do
    not count.

    Args:
        box: World space, lower and upper corner, shape [2, 3].
        camera: As the scene has it.
        width: Of the whole picture [pixel].
        height: Likewise.
        settings: Aspect policy and pixel aspect ratio.
    """
    left, right, bottom, top = picture_window(camera, width, height, settings)
    (left, right), (bottom, top) = sorted((left, right)), sorted((bottom, top))
    if right == left or top == bottom:
        return 0.0
    corners = np.array([[*(box[number >> axis & 1, axis] for axis in range(3)), 1.0] for number in range(8)])
    x, y, z, _ = np.linalg.inv(camera.world_from_camera) @ corners.T
    scale = -z if camera.is_perspective else np.ones(8)
    # An orthographic camera also sees what is behind it, if its near distance says so.
    ahead = max(np.finfo(float).eps * np.abs(z).max(), np.finfo(float).tiny)
    nearest = ahead if camera.is_perspective else min(camera.clipping_range[0], 0.0)
    inside = np.stack([-z - nearest, x - left * scale, right * scale - x, y - bottom * scale, top * scale - y])
    seen = np.stack([x / (right - left), y / (top - bottom), scale]).T  # areas are shares of the window's
    areas = [_shown_area(seen[list(face)], inside[:, face].T) for face in _FACES]
    # A line of sight leaves the box through one face; it enters by another, unless it starts inside.
    return float(max(sum(max(one, 0.0) for one in areas), sum(max(-one, 0.0) for one in areas)))


def _shown_area(points: np.ndarray, inside: np.ndarray) -> float:
    """Return the signed area of what a polygon shows on the window.

    Args:
        points: x, y and what divides them, shape [n, 3].
        inside: Distances from planes, linear along the edges, shape [n, k]; what is below 0 of any is cut off.
    """
    rows = np.concatenate([points, inside], axis=1)
    for plane in range(3, rows.shape[1]):
        kept = []
        for start, end in zip(rows, np.roll(rows, -1, axis=0), strict=True):
            if start[plane] >= 0:
                kept.append(start)
            if (start[plane] >= 0) != (end[plane] >= 0):
                kept.append(start + start[plane] / (start[plane] - end[plane]) * (end - start))
        if len(kept) < 3:
            return 0.0
        rows = np.array(kept)
    x, y = rows[:, 0] / rows[:, 2], rows[:, 1] / rows[:, 2]
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def pixel_aspect_ratio(camera: Camera, width: int, height: int, settings: Settings) -> float:
    """Return width by height of a pixel as seen."""
    if settings.aspect_policy != "adjustPixelAspectRatio" and not camera.is_conformed:
        return settings.pixel_aspect_ratio
    left, right, bottom, top = camera.window
    return (right - left) / (top - bottom) / (width / height)


def camera_data(
    camera: Camera, width: int, height: int, settings: Settings, origin: np.ndarray, device: str = "cpu"
) -> Any:
    """Return ``kernels.frame_structs.CameraData`` of a picture of ``width`` by ``height`` pixels.

    Args:
        camera: As the scene has it.
        width: Of the whole picture [pixel].
        height: Likewise.
        settings: Aspect policy, pixel aspect ratio, whether there is depth of field.
        origin: World point that device coordinates are relative to, shape [3].
        device: Where its arrays lie.
    """
    left, right, bottom, top = picture_window(camera, width, height, settings)
    matrix = camera.world_from_camera
    linear = matrix[:3, :3]
    corner = linear @ (left, top, -1.0 if camera.is_perspective else 0.0)
    across, down = linear @ (right - left, 0.0, 0.0), linear @ (0.0, bottom - top, 0.0)
    view = linear @ (0.0, 0.0, -1.0)
    forward = np.cross(across, down)
    if not np.any(forward):
        raise SceneError(f"{camera.path}: the camera's window or transform has no area")
    forward *= np.sign(forward @ view) / np.linalg.norm(forward)
    data = frame_structs.CameraData()
    data.origin = matrix[:3, 3] - origin
    data.corner = corner
    data.right = across
    data.down = down
    data.forward = forward
    data.view = view / np.linalg.norm(view)
    data.is_perspective = int(camera.is_perspective)
    data.near, data.far = camera.clipping_range
    planes = world_planes(camera, origin)
    data.planes = wp.array(planes, dtype=wp.vec4, device=device)
    data.plane_count = len(planes)
    if has_lens(camera, settings):
        axis = across / np.linalg.norm(across)
        data.lens_x, data.lens_y = camera.lens_radius * axis, camera.lens_radius * np.cross(axis, forward)
        data.focus = camera.focus_distance
    data.width, data.height = width, height
    return data
