# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Stages that sweep LightAPI on curved solids over the floor of :mod:`benchmarks.light_floor`, and what it gets.

What shines is the solid itself: its sums are over the curved surface in float64, not over triangles about it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Usd

from . import light_floor as floor
from . import light_sums as sums
from .light_floor import OVERHEAD, SHEAR, TILTED, LightFrame, moved, scaled, turned
from .mesh_sweeps import PASS as PASS
from .mesh_sweeps import hide_light

_COUNT = 128  # patches each way of each part: the sum's error falls with its square
_FINE_COUNT = 256  # where a rim goes through them
_SIZES = {
    "Sphere": {"radius": 0.5},
    "Cylinder": {"radius": 0.4, "height": 0.8},
    "Cone": {"radius": 0.5, "height": 0.9},
    "Capsule": {"radius": 0.3, "height": 0.6},
}
Part = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Points of a surface at parameters in [0, 1], and their derivatives by the first and the second: each shape [n, 3].
The cross product of the derivatives points out of the solid."""

# --- sweeps


def sweeps(files: Mapping[str, Path]) -> Iterator[tuple[str, str, list[LightFrame]]]:
    """Yield what ``light_sweeps.sweeps`` does; what is swept begins with the solid."""
    for kind in _SIZES:
        for name, frames in _sweeps_of(kind, files):
            yield "LightAPI", f"{kind}, {name}", frames


def _sweeps_of(kind: str, files: Mapping[str, Path]) -> Iterator[tuple[str, list[LightFrame]]]:
    plain = LightFrame(kind, {"intensity": 5.0, "color": (1, 0.5, 0.2)}, OVERHEAD)
    mirrored = moved(0.6, 3, 0.5) @ turned(0, -70) @ turned(1, 30) @ scaled(-1.2, 1.7, 1.15)
    yield "plain", [plain, replace(plain, matrix=mirrored), replace(plain, matrix=TILTED @ SHEAR)]
    far = [replace(plain, matrix=moved(0, y, 0) @ turned(0, -90)) for y in (1.5, 5.0, 25.0)]
    yield "height, normalized", [frame.having(normalize=True) for frame in far]
    shaped = replace(plain.having(**{"shaping:cone:angle": 180.0}), is_shaped=True)
    cone = shaped.having(normalize=True, **{"shaping:cone:angle": 49.0, "shaping:cone:softness": 0.3})
    # Shining along the floor, which gets what the rim leaves: the triangles' being farther out tells most there.
    along = moved(0.57, 3, 0.54) @ turned(2, -110) @ scaled(-2.2, 2.8, 1.9)
    yield "soft cone", [replace(cone, matrix=mirrored), replace(cone, matrix=along), cone]
    alone = replace(plain, is_shaped=True)  # a hard cone of 90 degrees
    yield "ShapingAPI alone", [replace(alone, matrix=place) for place in (OVERHEAD, TILTED, mirrored)]
    hard = alone.having(**{"shaping:cone:angle": 40.0})
    yield "hard cone", [replace(hard, matrix=place) for place in (OVERHEAD, TILTED, mirrored)]
    focused = shaped.having(**{"shaping:focus": 8.0, "shaping:focusTint": (0.3, 0.7, 0.3)})
    yield "focus", [focused, replace(focused, matrix=mirrored), replace(focused, matrix=TILTED)]
    profile = shaped.having(**{"shaping:ies:file": files["profile.ies"]})
    yield "profile", [profile, replace(profile, matrix=mirrored)]


# --- stages


def make_stage(frames: Sequence[LightFrame]) -> Usd.Stage:
    """Return what ``light_floor.make_stage`` does, its light a solid that :data:`PASS` hides from the camera."""
    stage = floor.make_stage(frames)
    light = stage.GetPrimAtPath("/Light")
    for name, value in _SIZES[frames[0].kind].items():
        light.GetAttribute(name).Set(value)
    hide_light(stage)
    return stage


# --- what the floor must show


def expected(frame: LightFrame, points: np.ndarray) -> np.ndarray:
    """Return E / pi on the floor, nothing in between, summed in float64 over the solid's surface: shape [n, 3].

    Args:
        frame: The light.
        points: Of the floor, shape [n, 3].
    """
    places, areas = _patches(frame)
    scale = sums.radiance_of(frame) / math.pi
    if frame.attributes.get("normalize"):
        scale = scale / np.linalg.norm(areas, axis=1).sum()
    return np.array([scale * _irradiance(frame, places - point, areas) for point in points])


def _irradiance(frame: LightFrame, to_light: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Return a floor point's irradiance from patches of radiance 1, the point at the origin: shape [3]."""
    distance = np.linalg.norm(to_light, axis=1)
    wi = to_light / distance[:, None]
    weight = np.maximum(-(areas * wi).sum(axis=1), 0) / distance**2 * np.maximum(wi @ floor.UP, 0)
    axis = frame.matrix[:3, 2] / np.linalg.norm(frame.matrix[:3, 2])
    radiance = sums.float64_lights().shaping(sums.light_of(frame), wi @ axis)
    if "shaping:ies:file" in frame.attributes:
        weight = weight * sums.profile_of(frame, -wi @ np.linalg.inv(frame.matrix[:3, :3]).T)
    return np.asarray((radiance * weight[:, None]).sum(axis=0))


def _patches(frame: LightFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles and the outward area vectors of a solid's patches in world space: shape [n, 3] each."""
    is_hard = frame.is_shaped and not frame.attributes.get("shaping:cone:softness", 0.0)
    count = _FINE_COUNT if is_hard and frame.attributes.get("shaping:cone:angle", 90.0) < 180 else _COUNT
    middles = (np.arange(count) + 0.5) / count
    u, v = (grid.reshape(-1) for grid in np.meshgrid(middles, middles))
    parts = [part(u, v) for part in _parts(frame.kind)]
    places, by_u, by_v = (np.concatenate(arrays) @ frame.matrix[:3, :3].T for arrays in zip(*parts, strict=True))
    areas = np.cross(by_u, by_v) / count**2
    outwards = 1.0 if np.linalg.det(frame.matrix[:3, :3]) > 0 else -1.0
    return places + frame.matrix[:3, 3], outwards * areas


def _parts(kind: str) -> list[Part]:
    """Return the surfaces of a solid about local Z, its schema's fallback axis: each is a profile that is turned."""
    radius, half = _SIZES[kind]["radius"], _SIZES[kind].get("height", 0.0) / 2
    if kind == "Sphere":
        return [_arc(radius, 0.0, -math.pi / 2, math.pi / 2)]
    if kind == "Capsule":
        bottom, top = _arc(radius, -half, -math.pi / 2, 0.0), _arc(radius, half, 0.0, math.pi / 2)
        return [bottom, _line((radius, -half), (radius, half)), top]
    bottom = _line((0.0, -half), (radius, -half))
    if kind == "Cone":
        return [bottom, _line((radius, -half), (0.0, half))]
    return [bottom, _line((radius, -half), (radius, half)), _line((radius, half), (0.0, half))]


def _line(start: tuple[float, float], end: tuple[float, float]) -> Part:
    """Return the surface that a line makes, its ends given by distance from Z and height, from below."""
    change = np.subtract(end, start)
    return lambda u, v: _turned(u, *(start[k] + change[k] * v for k in (0, 1)), *(change[k] + 0 * v for k in (0, 1)))


def _arc(radius: float, height: float, start: float, end: float) -> Part:
    """Return the surface that an arc about a point of Z makes, between two elevations [rad]."""

    def part(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        angle, rate = start + (end - start) * v, radius * (end - start)
        across, up = radius * np.cos(angle), height + radius * np.sin(angle)
        return _turned(u, across, up, -rate * np.sin(angle), rate * np.cos(angle))

    return part


def _turned(
    u: np.ndarray, across: np.ndarray, up: np.ndarray, d_across: np.ndarray, d_up: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points of a profile turned by u about Z, and their derivatives by u and along the profile."""
    cosine, sine = np.cos(2 * math.pi * u), np.sin(2 * math.pi * u)
    places = np.stack([across * cosine, across * sine, up], axis=1)
    by_u = 2 * math.pi * np.stack([-across * sine, across * cosine, 0 * up], axis=1)
    return places, by_u, np.stack([d_across * cosine, d_across * sine, d_up], axis=1)
