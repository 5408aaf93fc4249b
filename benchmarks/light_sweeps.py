# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Stages that sweep each parameter of each UsdLux light over a floor, one value a frame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from .dome_skies import SKIES
from .light_floor import OVERHEAD, SHEAR, STANDING, TILTED, LightFrame, moved, scaled, turned
from .light_floor import make_stage as make_stage
from .light_sums import expected as expected

PASS = None  # the stage is drawn as it is
AREA_LIGHTS = ("RectLight", "DiskLight", "SphereLight", "CylinderLight")
EVERYTHING = {
    "intensity": 3.0,
    "exposure": 1.5,
    "color": (1, 0.6, 0.3),
    "enableColorTemperature": True,
    "colorTemperature": 3200.0,
    "diffuse": 0.7,
    "normalize": True,
    "shaping:cone:angle": 55.0,
    "shaping:cone:softness": 0.4,
    "shaping:focus": 2.0,
    "shaping:focusTint": (0.2, 0.1, 0.6),
}
"""Attributes that multiply each other."""
MIRRORED = (
    OVERHEAD @ turned(1, 20) @ scaled(-1.5, 0.6, 1.2),
    moved(-1, 1.6, 0.8) @ turned(0, -60) @ turned(2, 25) @ scaled(1, -2, 0.5),
    moved(0.5, 2, -0.3) @ turned(0, -70) @ SHEAR @ scaled(-1, 1.3, 1),
)
"""Places of uneven scale, that mirror; the last is sheared, too."""


def sweeps(files: Mapping[str, Path]) -> Iterator[tuple[str, str, list[LightFrame]]]:
    """Yield each type of light, what is swept, and the frames.

    Args:
        files: As :func:`write_files` returns them.
    """
    for kind in AREA_LIGHTS:
        for name, frames in _area_sweeps(kind, files):
            yield kind, name, frames
    for name, frames in _distant_sweeps():
        yield "DistantLight", name, frames
    for name, frames in _dome_sweeps(files):
        yield "DomeLight", name, frames


_SIZES = {
    "RectLight": ("width", "height"),
    "DiskLight": ("radius",),
    "SphereLight": ("radius",),
    "CylinderLight": ("radius", "length"),
}


def _area_sweeps(kind: str, files: Mapping[str, Path]) -> Iterator[tuple[str, list[LightFrame]]]:
    five = {"intensity": 5.0}
    base = LightFrame(kind, five, TILTED)
    yield "intensity", base.each("intensity", [0.1, 1.0, 5.0, 1000.0])
    yield "exposure", base.each("exposure", [-11.0, -1.0, 0.5, 3.0])
    yield "color", base.each("color", [(1, 0.5, 0), (0.2, 0.3, 4)])
    temperatures = [2000.0, 4250.0, 6500.0, 8750.0, 10000.0]
    yield "temperature", base.having(enableColorTemperature=True).each("colorTemperature", temperatures)
    yield "diffuse", base.each("diffuse", [0.0, 0.5, 2.0])
    for name in _SIZES[kind]:
        sizes = [0.1, 0.2, 0.3, 0.4, 0.5, 1.0, 2.0]
        yield name, base.each(name, sizes)
        yield f"{name}, normalized", base.having(normalize=True).each(name, sizes)
    yield "tilt", [replace(base, matrix=turned(2, angle) @ TILTED) for angle in (0, 15, 30, 45, 60)]
    scales = [scaled(s, s, s) for s in (0.25, 2.0)] + [scaled(1.25, 1, 0.75), scaled(0.5, 2, 1), scaled(-1, 1, 2)]
    for title, more in (("scale", five), ("scale, normalized", {**five, "normalize": True})):
        yield title, [LightFrame(kind, more, TILTED @ scale) for scale in scales]
    yield "shear", [LightFrame(kind, five, OVERHEAD @ SHEAR), LightFrame(kind, five, OVERHEAD @ SHEAR.T)]
    heights = [0.2, 0.5, 1.5, 5.0, 25.0, 400.0]
    yield "distance", [LightFrame(kind, five, moved(0.7, y, -0.4) @ turned(0, -90)) for y in heights]
    yield "standing", [LightFrame(kind, five, STANDING @ turned(1, angle)) for angle in (0, 30, 60, 90)]
    wide = {"width": 6.0, "height": 4.0, "radius": 2.0, "length": 6.0}
    large = {**five, **{name: wide[name] for name in _SIZES[kind]}}
    yield "large", [LightFrame(kind, large, moved(0, y, 0) @ turned(0, a)) for y, a in ((1, -45), (2.5, -90), (0, -10))]
    yield from _shaping_sweeps(kind, files)
    if kind == "RectLight":
        textured = base.having(**{"texture:file": files["texture.png"]}, width=2.0)
        yield "texture", [textured, replace(textured, matrix=OVERHEAD), replace(textured, matrix=STANDING)]
        spot = {"shaping:cone:angle": 40.0, "shaping:focus": 2.0}
        yield "texture, shaped", [replace(textured.having(**spot), is_shaped=True)]


def _shaping_sweeps(kind: str, files: Mapping[str, Path]) -> Iterator[tuple[str, list[LightFrame]]]:
    base = LightFrame(kind, {"intensity": 5.0}, TILTED, is_shaped=True)
    open_ = base.having(**{"shaping:cone:angle": 180.0})
    focus, tint = "shaping:focus", "shaping:focusTint"
    cone, softness = "shaping:cone:angle", "shaping:cone:softness"
    yield "ShapingAPI alone", [base]
    yield "focus", open_.each(focus, [0.0, 1.25, 2.5, 3.75, 5.0, 40.0])
    yield "focusTint", open_.having(**{focus: 3.0}).each(tint, [(0, 0, 0), (0, 0.5, 0), (0.5, 1, 0.5), (1, 1, 1)])
    red = base.having(**{cone: 60.0, tint: (1, 0, 0)})
    yield "focus, cone 60, tint", red.each(focus, [0.0, 1.25, 2.5, 3.75, 5.0])
    angles = [170.0, 130.0, 90.0, 50.0, 10.0]
    small = {name: 0.1 for name in _SIZES[kind] if name == "radius"}
    yield "cone", base.each(cone, angles)
    yield "cone, standing", [replace(f.having(**small), matrix=STANDING) for f in base.each(cone, angles)]
    yield "cone, far", [replace(f, matrix=moved(0.7, 20, -0.4) @ turned(0, -90)) for f in base.each(cone, [3.0, 8.0])]
    down = moved(0.3, 0, 0.2) @ turned(0, -90)
    for value in (20.0, 50.0, 200.0, 1000.0):
        sharp = open_.having(**{focus: value})
        yield f"focus {value:g}, far", [replace(sharp, matrix=moved(0, y, 0) @ down) for y in (5.0, 14.0, 20.0)]
    soft = base.having(**{cone: 40.0, softness: 1.0})
    yield "softness, far", [replace(soft, matrix=moved(0, 20, 0) @ down)]
    wall = {"width": 8.0, "height": 8.0, "radius": 4.0, "length": 8.0}
    through = replace(base.having(**{name: wall[name] for name in _SIZES[kind]}), matrix=moved(0, 4, 3))
    yield "softness, a wall", [through.having(**{cone: c, softness: s}) for c, s in ((60.0, 0.5), (90.0, 1.0))]
    yield "softness", base.having(**{cone: 45.0}).each(softness, [0.0, 0.25, 0.5, 0.75, 1.0])
    sheared = base.having(**small, **{cone: 170.0, focus: 2.0, tint: (0, 0, 1)})
    places = [turned(1, angle) @ SHEAR for angle in (0, 45, 90, 135, 180)]
    yield "shear, focus, cone 170", [replace(sheared, matrix=STANDING @ place) for place in places]
    profile = open_.having(**{"shaping:ies:file": files["profile.ies"]})
    scale, normalize = "shaping:ies:angleScale", "shaping:ies:normalize"
    yield "profile", profile.each(scale, [-1.0, -0.5, 0.0, 0.5, 1.0])
    afar = replace(profile, matrix=moved(0, 60, 0) @ down)
    yield "profile, far, angleScale", afar.each(scale, [0.03, 0.1, -0.97])
    stripes = profile.having(**{"shaping:ies:file": files["stripes.ies"]})
    yield "profile of stripes", [replace(stripes, matrix=moved(0, 3, 0) @ down), stripes]
    yield "profile, normalized", profile.having(**{normalize: True}).each(scale, [-0.5, 0.0, 0.5])
    turns = [OVERHEAD @ turned(2, angle) for angle in (0, 70, 200)]
    yield "profile, overhead", [replace(profile, matrix=turn) for turn in turns]
    everything = LightFrame(kind, EVERYTHING, is_shaped=True)
    yield "all at once, mirrored", [replace(everything, matrix=place) for place in MIRRORED]
    behind = profile.having(**{scale: -0.7, normalize: True})
    yield "profile, mirrored, angleScale", [replace(behind, matrix=place) for place in MIRRORED]
    yield "profile, cone 50", [profile.having(**{cone: 50.0, softness: 0.3})]


def _distant_sweeps() -> Iterator[tuple[str, list[LightFrame]]]:
    down = turned(0, -90)
    base = LightFrame("DistantLight", {"intensity": 3720.0}, down)
    yield "intensity", base.each("intensity", [1.0, 50000.0])
    yield "exposure", base.each("exposure", [-5.0, 1.0])
    yield "color", base.each("color", [(1, 0.5, 0)])
    temperatures = [2000.0, 4250.0, 6500.0, 8750.0, 10000.0]
    yield "temperature", base.having(enableColorTemperature=True).each("colorTemperature", temperatures)
    yield "tilt", [replace(base, matrix=turned(0, -angle)) for angle in (90, 70, 50, 30, 10)]
    dim = base.having(intensity=0.3)
    angles = [0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 120.0, 140.0, 160.0, 180.0]
    yield "angle", dim.each("angle", angles)
    yield "angle, normalized", dim.having(normalize=True).each("angle", angles)
    yield "angle above 180", dim.each("angle", [200.0, 270.0, 360.0])
    low = replace(dim, matrix=turned(0, -30))
    yield "angle, tilted", low.each("angle", [20.0, 80.0, 140.0, 240.0])
    yield "scale", [replace(base, matrix=down @ scaled(*scale)) for scale in ((2, 2, 2), (1, 3, 0.5))]


_STRETCHED = (
    turned(0, 50) @ scaled(3, 3, 3),
    turned(0, 30) @ scaled(2, 1, 0.5),
    turned(2, 70) @ turned(0, 40) @ scaled(-1, 2, 1.5),
    scaled(1, 3, -1) @ turned(1, 25) @ turned(0, 35),  # by a parent
    SHEAR @ turned(2, 60) @ scaled(1, -0.5, 1),
)
"""Transforms of domes, each even, uneven, mirrored or sheared."""


def _dome_sweeps(files: Mapping[str, Path]) -> Iterator[tuple[str, list[LightFrame]]]:
    base = LightFrame("DomeLight", {})
    yield "intensity", base.each("intensity", [0.3, 2.0])
    yield "exposure", base.each("exposure", [-2.0, 1.0])
    yield "color", base.each("color", [(1, 0.5, 0.1)])
    textured = base.having(**{"texture:file": files["sky.png"]})
    turns = [np.eye(4), turned(1, 70), turned(0, 50), turned(2, 120) @ turned(0, -40)]
    yield "image", [replace(textured, matrix=turn) for turn in turns]
    yield "image, scale", [replace(textured, matrix=place) for place in _STRETCHED]
    for layout in SKIES:
        sky = base.having(**{"texture:file": files[layout], "texture:format": layout})
        yield layout, [replace(sky, matrix=place) for place in (*_STRETCHED, *turns)]
    cross = base.having(**{"texture:file": files["cubeMapVerticalCross"], "texture:format": "automatic"})
    yield "automatic", [replace(cross, matrix=turn) for turn in turns]
