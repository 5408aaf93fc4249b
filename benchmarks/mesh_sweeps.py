# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Stages that sweep the shaping of mesh lights over the floor of :mod:`benchmarks.light_floor`, and what it gets.

A quad of 2 triangles, a bulging sheet of 288 and a ball of 512 are convex: nothing of them is before what shines.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdRender

from . import light_floor as floor
from . import light_sums as sums
from .light_floor import OVERHEAD, SHEAR, STANDING, TILTED, LightFrame, moved, scaled, turned
from .light_sweeps import EVERYTHING, MIRRORED

PASS = "/Pass"
_WIDTH = 0.04  # [rad] of the patches that triangles are cut into
_FINE_WIDTH = 0.012  # where radiance varies quickly
_RIM_WIDTH = 0.01  # where a rim or the horizon goes through, by the light's own, which is below 1 rad or counts so
_SHARP = 50.0  # focus from which that is so


def _quads(columns: int, bulge: float) -> np.ndarray:
    """Return a square of side 1 in the plane z = 0, its middle moved along -Z, that shines there: shape [n, 3, 3]."""
    places = np.arange(columns + 1) / columns - 0.5
    x, y = np.meshgrid(places, places, indexing="ij")
    points = np.stack([x, y, bulge * ((2 * x) ** 2 + (2 * y) ** 2 - 2)], axis=-1)
    a, b, c, d = (points[i : columns + i, j : columns + j] for i, j in ((0, 0), (0, 1), (1, 1), (1, 0)))
    return np.concatenate([np.stack(t, axis=2).reshape(-1, 3, 3) for t in ((a, b, c), (a, c, d))])


def _ball() -> np.ndarray:
    """Return an octahedron, each side of it cut into 64 that lie on the ball of radius 1 / 2."""
    signs = [(s, t, u) for s in (1, -1) for t in (1, -1) for u in (1, -1)]
    faces = np.array([np.diag(s) if np.prod(s) > 0 else np.diag(s)[::-1] for s in signs], float)
    for _ in range(3):
        faces = _halved(faces)
    return faces / np.linalg.norm(faces, axis=2, keepdims=True) / 2


def _halved(triangles: np.ndarray) -> np.ndarray:
    """Return each triangle as four, of half its sides."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)
    return np.concatenate([np.stack(part, axis=1) for part in parts])


SHAPES = {"quad": _quads(1, 0.0), "sheet": _quads(12, 0.1), "ball": _ball()}
"""Triangles of each, wound as seen from outside, local space: float64, shape [n, 3, 3]."""


# --- sweeps


def sweeps(files: Mapping[str, Path]) -> Iterator[tuple[str, str, list[LightFrame]]]:
    """Yield what ``light_sweeps.sweeps`` does; what is swept begins with the shape."""
    for shape in SHAPES:
        for name, frames in _sweeps_of(shape, files):
            yield "MeshLight", f"{shape}, {name}", frames


def _sweeps_of(shape: str, files: Mapping[str, Path]) -> Iterator[tuple[str, list[LightFrame]]]:
    plain = LightFrame("Mesh", {"intensity": 5.0, "exposure": 1.0, "color": (1, 0.5, 0.2)}, TILTED, shape=shape)
    base = replace(plain, attributes={"intensity": 5.0, "shaping:cone:angle": 180.0}, is_shaped=True)
    down = moved(0.7, 0, -0.4) @ turned(0, -90)
    yield "plain", [plain, replace(plain, matrix=STANDING), replace(plain, matrix=TILTED @ scaled(-1, 1, 2))]
    yield "height", [replace(plain, matrix=moved(0, y, 0) @ down) for y in (0.6, 1.5, 5.0, 25.0, 400.0)]
    scales = [scaled(0.25, 0.25, 0.25), scaled(1.25, 1, 0.75), SHEAR]
    yield "normalized", [replace(plain.having(normalize=True), matrix=OVERHEAD @ scale) for scale in scales]
    focus, tint = "shaping:focus", "shaping:focusTint"
    cone, softness = "shaping:cone:angle", "shaping:cone:softness"
    yield "focus", base.each(focus, [1.25, 5.0, 20.0, 100.0])
    yield "focus, far", [replace(base.having(**{focus: 200.0}), matrix=moved(0, y, 0) @ down) for y in (5, 14)]
    yield "focusTint", base.having(**{focus: 8.0}).each(tint, [(0, 0.5, 0), (0.5, 1, 0.5)])
    yield "cone", base.each(cone, [130.0, 90.0, 50.0, 20.0])
    yield "cone, standing", [replace(frame, matrix=STANDING) for frame in base.each(cone, [130.0, 60.0, 20.0])]
    yield "cone, far", [replace(frame, matrix=moved(0, 20, 0) @ down) for frame in base.each(cone, [3.0, 8.0])]
    yield "softness", base.having(**{cone: 45.0}).each(softness, [0.0, 0.25, 0.5, 1.0])
    mixed = base.having(**{cone: 60.0, softness: 0.3, focus: 3.0, tint: (1, 0, 0)})
    yield (
        "cone, focus, sheared",
        [replace(mixed, matrix=OVERHEAD @ turn @ SHEAR) for turn in (np.eye(4), turned(0, 40))],
    )
    large = [moved(0, y, 0.3) @ turned(0, angle) @ scaled(4, 4, 4) for y, angle in ((2.2, -90), (1.5, -45), (2.2, -10))]
    for name, more in (("focus 20", {focus: 20.0}), ("cone 40", {cone: 40.0, softness: 0.5})):
        yield f"large, {name}", [replace(base.having(**more), matrix=place) for place in large]
    profile = base.having(**{"shaping:ies:file": files["profile.ies"]})
    yield "profile", profile.each("shaping:ies:angleScale", [-0.5, 0.0, 0.5])
    yield "profile, overhead", [replace(profile, matrix=OVERHEAD @ turned(2, angle)) for angle in (0, 70, 200)]
    yield "profile, large", [replace(profile, matrix=place) for place in large]
    everything = replace(plain, attributes=EVERYTHING, is_shaped=True)
    yield "all at once, mirrored", [replace(everything, matrix=place) for place in MIRRORED]
    stripes = profile.having(**{"shaping:ies:file": files["stripes.ies"]})
    yield "profile of stripes", [replace(stripes, matrix=moved(0, 3, 0) @ down), stripes]


# --- stages


def make_stage(frames: Sequence[LightFrame]) -> Usd.Stage:
    """Return what ``light_floor.make_stage`` does, its light a mesh that :data:`PASS` hides from the camera."""
    stage = floor.make_stage(frames)
    corners = SHAPES[frames[0].shape]
    light = UsdGeom.Mesh(stage.GetPrimAtPath("/Light"))
    light.CreatePointsAttr(corners.reshape(-1, 3).tolist())
    light.CreateFaceVertexCountsAttr([3] * len(corners))
    light.CreateFaceVertexIndicesAttr(list(range(3 * len(corners))))
    light.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    hide_light(stage)
    return stage


def hide_light(stage: Usd.Stage) -> None:
    """Write a :data:`PASS` that hides the light of ``light_floor.make_stage`` from the camera."""
    render_pass = UsdRender.Pass.Define(stage, PASS)
    Usd.CollectionAPI(render_pass.GetPrim(), "cameraVisibility").CreateExcludesRel().AddTarget("/Light")
    settings = UsdRender.Settings.Define(stage, "/Settings")
    render_pass.CreateRenderSourceRel().AddTarget(settings.GetPath())
    stage.SetMetadata("renderSettingsPrimPath", str(settings.GetPath()))


# --- what the floor must show


def expected(frame: LightFrame, points: np.ndarray) -> np.ndarray:
    """Return E / pi on the floor, nothing in between, summed in float64 over patches of the triangles: shape [n, 3].

    Args:
        frame: The light.
        points: Of the floor, shape [n, 3].
    """
    matrix = frame.matrix
    corners = SHAPES[frame.shape] @ matrix[:3, :3].T + matrix[:3, 3]
    if np.linalg.det(matrix[:3, :3]) < 0:
        corners = corners[:, ::-1]
    scale = sums.radiance_of(frame) * frame.attributes.get("diffuse", 1.0) / math.pi
    if frame.attributes.get("normalize"):
        scale = scale / (np.linalg.norm(_areas(corners), axis=1).sum())
    return np.array([scale * _irradiance(frame, corners - point) for point in points])


def _areas(triangles: np.ndarray) -> np.ndarray:
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2


def _irradiance(frame: LightFrame, triangles: np.ndarray) -> np.ndarray:
    """Return the floor's irradiance from triangles of radiance 1, the floor's point at the origin: shape [3]."""
    light = sums.light_of(frame)
    facing = np.einsum("nk,nk->n", _areas(triangles), triangles[:, 0]) < 0
    cut = _cut(frame, triangles[facing])
    if not len(cut):
        return np.zeros(3)
    # The middles of the sides: a rule that is exact for parabolas.
    places = ((cut + cut[:, [1, 2, 0]]) / 2).reshape(-1, 3)
    areas = np.repeat(_areas(cut) / 3, 3, axis=0)
    distance = np.linalg.norm(places, axis=1)
    wi = places / distance[:, None]
    weight = np.abs((areas * wi).sum(axis=1)) / distance**2 * np.maximum(wi @ floor.UP, 0)
    axis = frame.matrix[:3, 2] / np.linalg.norm(frame.matrix[:3, 2])
    radiance = sums.float64_lights().shaping(light, wi @ axis)
    if "shaping:ies:file" in frame.attributes:
        weight = weight * sums.profile_of(frame, -wi @ np.linalg.inv(frame.matrix[:3, :3]).T)
    return np.asarray((radiance * weight[:, None]).sum(axis=0))


def _cut(frame: LightFrame, triangles: np.ndarray) -> np.ndarray:
    """Return triangles cut so small that none looks wide from the origin: least where the light's radiance jumps."""
    values = frame.attributes
    is_sharp = values.get("shaping:focus", 0.0) > _SHARP or "stripes" in str(values.get("shaping:ies:file", ""))
    limit = _FINE_WIDTH if is_sharp else _WIDTH
    corners = triangles.reshape(-1, 3)
    far = np.linalg.norm(corners, axis=1).min(initial=np.inf)
    rim_width = _RIM_WIDTH * min(np.linalg.norm(np.ptp(corners, axis=0)) / far, 1.0) if len(corners) else limit
    kept = []
    while len(triangles):
        triangles = triangles[(triangles[:, :, 1] > 0).any(axis=1)]
        middle = triangles.mean(axis=1)
        distance = np.maximum(np.linalg.norm(middle, axis=1), 1e-12)
        width = np.linalg.norm(triangles - triangles[:, [1, 2, 0]], axis=2).max(axis=1) / distance
        is_cut = sums.is_near_rim(frame, middle, width) | (triangles[:, :, 1] < 0).any(axis=1)
        is_wide = width > np.where(is_cut, rim_width, limit)
        kept.append(triangles[~is_wide])
        triangles = _halved(triangles[is_wide])
    return np.concatenate([np.zeros((0, 3, 3)), *kept])
