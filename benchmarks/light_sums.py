# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the floor of :mod:`benchmarks.light_floor` gets of a light, summed in float64.

From the attributes, by the rules of the schema, so that the loader is held to account with the kernels.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
from pxr import UsdLux

from warp_rt.scene import Light, LightKind

from .dome_skies import SKIES, smooth_sky
from .light_files import PROFILE_HORIZONTAL, PROFILE_VALUES, PROFILE_VERTICAL, PROFILES, rect_texture, sky_image
from .light_floor import UP, LightFrame
from .meshes import load_file
from .results import ROOT

_KINDS = {
    "RectLight": LightKind.RECT,
    "DiskLight": LightKind.DISK,
    "SphereLight": LightKind.SPHERE,
    "CylinderLight": LightKind.CYLINDER,
    "DistantLight": LightKind.DISTANT,
}
Cut = tuple[np.ndarray, np.ndarray]
_FINE, _COARSE = 96, 48  # patches each way, at least: of lights that are shaped or textured, and of others
_PIECES = 8
_DEEPEST = 4


@cache
def float64_lights() -> ModuleType:
    """Return tests/lights_float64.py, which cuts lights into patches."""
    return load_file(ROOT / "tests" / "lights_float64.py")


def expected(frame: LightFrame, points: np.ndarray) -> np.ndarray:
    """Return E / pi on the floor, nothing in between: shape [n, 3].

    Args:
        frame: The light.
        points: Of the floor, shape [n, 3].
    """
    scale = radiance_of(frame) * frame.attributes.get("diffuse", 1.0) / math.pi
    if frame.attributes.get("normalize"):
        scale = scale / _measure(frame)
    if frame.kind == "DomeLight":
        return np.broadcast_to(scale * _sky_irradiance(frame), points.shape)
    light = light_of(frame)
    if light.kind == LightKind.DISTANT:
        axis = frame.matrix[:3, 2] / np.linalg.norm(frame.matrix[:3, 2])
        facing = np.array(max(float(axis @ UP), 0.0))
        if light.angle > 0:
            facing = float64_lights().irradiance(light, np.zeros(3), UP, 1024)
        return np.broadcast_to(scale * facing, points.shape)
    has_detail = frame.is_shaped or any(isinstance(value, Path) for value in frame.attributes.values())
    count = _FINE if has_detail else _COARSE
    coarse = float64_lights().patches(light, count)
    cuts = (_refined(frame, light, point, coarse, count) for point in points)
    return np.array([scale * _irradiance(frame, light, point, cut) for point, cut in zip(points, cuts, strict=True)])


def is_near_rim(frame: LightFrame, to_light: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Return whether a light's cone, or its profile before a pole, may end at patches: bool, shape [n].

    Args:
        frame: The light.
        to_light: Vectors to the patches' middles, shape [n, 3].
        width: How wide they look from where these begin [rad], shape [n].
    """
    axis = frame.matrix[:3, 2]
    theta = _angle(to_light @ axis, to_light, float(np.linalg.norm(axis)))
    near: np.ndarray = np.abs(theta - light_of(frame).cone_angle) < width
    scale = frame.attributes.get("shaping:ies:angleScale", 0.0)
    if "shaping:ies:file" in frame.attributes and scale != 0:
        # Profiles turn with the light's own space, in which an uneven scale makes patches look up to so much wider.
        linear = frame.matrix[:3, :3]
        local = to_light @ np.linalg.inv(linear).T
        end = math.pi * scale if scale > 0 else math.pi * (1 + scale)
        near |= np.abs(_angle(local[:, 2], local, 1.0) - end) < width * np.linalg.cond(linear)
    return near


def _angle(along: np.ndarray, vectors: np.ndarray, length: float) -> np.ndarray:
    """Return the angles of vectors to an axis of a length, given their products with it."""
    sizes = np.maximum(np.linalg.norm(vectors, axis=1) * length, 1e-12)
    return np.arccos(np.clip(along / sizes, -1, 1))


def _refined(frame: LightFrame, light: Light, point: np.ndarray, coarse: Cut, count: int) -> Cut:
    """Return a light's patches, in pieces where they look large from a point or a rim goes through them.

    Pieces that still look large are cut again: a light can come as near to a point as it likes.

    Args:
        frame: Says where the light's radiance jumps.
        light: The light.
        point: Whence.
        coarse: Its patches, ``count`` each way.
        count: See ``coarse``.
    """
    column, row = np.arange(count**2) // count, np.arange(count**2) % count
    kept: list[Cut] = []
    cut = coarse
    for depth in range(_DEEPEST):
        centers, areas = cut
        to_light = centers - point
        distance = np.sqrt(np.einsum("ij,ij->i", to_light, to_light))
        size = np.sqrt(np.einsum("ij,ij->i", areas, areas))
        width = 2 * np.sqrt(size) / distance  # they may be longer one way
        # From behind, and from below the horizon, nothing arrives however fine they are.
        is_seen = np.einsum("ij,ij->i", areas, to_light) < width * size * distance
        is_split = (width > 0.1) & is_seen & (to_light @ UP > -width * distance)
        if depth == 0:
            is_split |= is_near_rim(frame, to_light, width)
        if not is_split.any():
            break
        kept.append((centers[~is_split], areas[~is_split]))
        inner = np.arange(_PIECES)
        column = (column[is_split][:, None, None] * _PIECES + inner[:, None] + 0 * inner).reshape(-1)
        row = (row[is_split][:, None, None] * _PIECES + inner + 0 * inner[:, None]).reshape(-1)
        count *= _PIECES
        cut = float64_lights().patches_at(light, (column + 0.5) / count, (row + 0.5) / count, count)
    centers, areas = (np.concatenate(parts) for parts in zip(*kept, cut, strict=True))
    return centers, areas


def radiance_of(frame: LightFrame) -> np.ndarray:
    """Return the light's own radiance before it is normalised: intensity 2^exposure color, the black body's."""
    values = frame.attributes
    is_distant = frame.kind == "DistantLight"
    radiance = values.get("intensity", 50000.0 if is_distant else 1.0) * 2.0 ** values.get("exposure", 0.0)
    radiance = radiance * np.array(values.get("color", (1, 1, 1)), float)
    if values.get("enableColorTemperature"):
        radiance = radiance * np.array(UsdLux.BlackbodyTemperatureAsRgb(values.get("colorTemperature", 6500.0)))
    return radiance


def _measure(frame: LightFrame) -> float:
    """Return what a normalised light is divided by: its area in world space, or its cone's projected solid angle."""
    values = frame.attributes
    x, y, z = (frame.matrix[:3, k] for k in range(3))
    if frame.kind == "RectLight":
        return float(np.linalg.norm(np.cross(x, y))) * values.get("width", 1.0) * values.get("height", 1.0)
    if frame.kind == "DistantLight":
        half = math.radians(values.get("angle", 0.53)) / 2
        if half == 0:
            return 1.0
        return math.pi * (math.sin(half) ** 2 if half <= math.pi / 2 else 2 - math.sin(half) ** 2)
    a, b, c = (float(np.linalg.norm(axis)) * values.get("radius", 0.5) for axis in (x, y, z))
    if frame.kind == "DiskLight":
        return math.pi * float(np.linalg.norm(np.cross(x, y))) * values.get("radius", 0.5) ** 2
    if frame.kind == "CylinderLight":
        around = math.pi * (3 * (b + c) - math.sqrt((3 * b + c) * (b + 3 * c)))
        return around * float(np.linalg.norm(x)) * values.get("length", 1.0)
    mean = sum((p * q) ** 1.6 for p, q in ((a, b), (a, c), (b, c))) / 3
    return 4 * math.pi * mean ** (1 / 1.6)


def light_of(frame: LightFrame) -> Light:
    """Return the light of radiance 1 with the frame's shape and shaping."""
    values = frame.attributes
    sizes = {name: values[name] for name in ("radius", "width", "height", "length") if name in values}
    fallback = 90.0 if frame.is_shaped else 180.0
    return Light(
        "/Light",
        _KINDS.get(frame.kind, LightKind.MESH),
        frame.matrix,
        (1.0, 1.0, 1.0),
        angle=math.radians(values.get("angle", 0.53)),
        focus=values.get("shaping:focus", 0.0),
        focus_tint=values.get("shaping:focusTint", (0.0, 0.0, 0.0)),
        cone_angle=math.radians(values.get("shaping:cone:angle", fallback)),
        cone_softness=values.get("shaping:cone:softness", 0.0),
        **sizes,
    )


def _irradiance(frame: LightFrame, light: Light, point: np.ndarray, cut: Cut) -> np.ndarray:
    """Return a floor point's irradiance from a light of radiance 1 that is cut into patches."""
    wi, solid_angle, radiance = float64_lights().arriving(light, point, cut=cut)
    weight = np.maximum(wi @ UP, 0) * solid_angle
    if "texture:file" in frame.attributes:
        back = np.linalg.inv(light.world_from_light[:3, :3])[2]
        distance = (light.world_from_light[:3, 3] - point) @ back / (wi @ back)
        weight = weight * _texel(light, point + wi * distance[:, None])
    if "shaping:ies:file" in frame.attributes:
        weight = weight * profile_of(frame, -wi @ np.linalg.inv(frame.matrix[:3, :3]).T)
    return (radiance * weight[:, None]).sum(axis=0)


def _texel(light: Light, place: np.ndarray) -> np.ndarray:
    """Return the bilinear texture at points of a rect light: its left edge at local +X, its top at +Y."""
    local = (place - light.world_from_light[:3, 3]) @ np.linalg.inv(light.world_from_light[:3, :3]).T
    image = rect_texture() / 65535.0
    rows, columns = image.shape
    column = (0.5 - local[:, 0] / light.width) * columns - 0.5
    row = (0.5 - local[:, 1] / light.height) * rows - 0.5
    return _bilinear(image, row, column, wraps=False)


def _bilinear(image: np.ndarray, row: np.ndarray, column: np.ndarray, *, wraps: bool) -> np.ndarray:
    rows, columns = image.shape
    i, j = np.floor(row).astype(int), np.floor(column).astype(int)
    u, v = column - j, row - i
    top, bottom = np.clip(i, 0, rows - 1), np.clip(i + 1, 0, rows - 1)
    left, right = (j % columns, (j + 1) % columns) if wraps else (j.clip(0, columns - 1), (j + 1).clip(0, columns - 1))
    upper = image[top, left] * (1 - u) + image[top, right] * u
    lower = image[bottom, left] * (1 - u) + image[bottom, right] * u
    return upper * (1 - v) + lower * v


def profile_of(frame: LightFrame, emitted: np.ndarray) -> np.ndarray:
    """Return the profile's factor for directions that light leaves in, the light's own space: shape [n]."""
    scale = frame.attributes.get("shaping:ies:angleScale", 0.0)
    factor = _profile_values(emitted, scale, *PROFILES[frame.attributes["shaping:ies:file"].name])
    return factor / _profile_mean() if frame.attributes.get("shaping:ies:normalize") else factor


def _profile_values(
    emitted: np.ndarray, scale: float, vertical: np.ndarray, horizontal: np.ndarray, values: np.ndarray
) -> np.ndarray:
    theta = np.arccos(np.clip(-emitted[:, 2] / np.linalg.norm(emitted, axis=1), -1, 1))
    if scale > 0:
        theta = theta / scale
    elif scale < 0:
        theta = (theta - np.pi) / -scale + np.pi
    phi = np.degrees(np.arctan2(-emitted[:, 1], -emitted[:, 0])) % 360
    theta = np.degrees(theta)
    i = np.clip(np.searchsorted(vertical, theta, side="right") - 1, 0, len(vertical) - 2)
    j = np.clip(np.searchsorted(horizontal, phi, side="right") - 1, 0, len(horizontal) - 2)
    v = (theta - vertical[i]) / np.diff(vertical)[i]
    h = (phi - horizontal[j]) / np.diff(horizontal)[j]
    low = values[j, i] * (1 - v) + values[j, i + 1] * v
    high = values[j + 1, i] * (1 - v) + values[j + 1, i + 1] * v
    return np.where((theta >= 0) & (theta <= 180), low * (1 - h) + high * h, 0.0)


def _profile_mean() -> float:
    """Return the mean over all directions as the reference implementation has it: each cell by its middle."""
    cells = sum(PROFILE_VALUES[i : i + 6, j : j + 6] for i in (0, 1) for j in (0, 1)) / 4
    vertical, horizontal = np.radians(PROFILE_VERTICAL), np.radians(PROFILE_HORIZONTAL)
    weight = np.diff(horizontal)[:, None] * np.diff(vertical) * np.sin((vertical[1:] + vertical[:-1]) / 2)
    return float((cells * weight).sum() / (4 * np.pi))


def _sky_irradiance(frame: LightFrame, count: int = 720) -> np.ndarray:
    """Return the irradiance of the floor from a dome of radiance 1, its pole at local +Y, its middle at +Z."""
    if "texture:file" not in frame.attributes:
        return np.array(math.pi)
    # By the cosine, so that each direction of the upper half weighs the same.
    middles = (np.arange(count) + 0.5) / count
    radius2, angle = (q.reshape(-1) for q in np.meshgrid(middles, 2 * np.pi * middles))
    radius = np.sqrt(radius2)
    wi = np.stack([radius * np.cos(angle), np.sqrt(1 - radius2), radius * np.sin(angle)], axis=1)
    local = wi @ np.linalg.inv(frame.matrix[:3, :3]).T
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    if frame.attributes["texture:file"].stem in SKIES:
        return np.array(math.pi * smooth_sky(local).mean())
    x, y, z = local.T
    t = np.arccos(np.clip(y, -1, 1)) / np.pi
    s = (0.5 - np.arctan2(x, z) / (2 * np.pi)) % 1.0
    image = sky_image() / 65535.0
    rows, columns = image.shape
    return np.array(math.pi * _bilinear(image, t * rows - 0.5, s * columns - 0.5, wraps=True).mean())
