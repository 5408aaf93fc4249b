# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Stages that sweep each parameter of each UsdLux light over a floor, one value a frame, and what the floor gets.

The floor, y = 0, is white and Lambertian, the camera 30 above it, as in luxtest
(https://github.com/anderslanglands/luxtest); the lights hang where luxtest has them, 1 above the floor and tilted by 45
degrees, or stand on it. What a frame must show is summed in float64 from the attributes, by the rules of the schema, so
that the loader is held to account with the kernels: :func:`expected`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from PIL import Image as PillowImage
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

from warp_rt.scene import Light, LightKind

from .dome_skies import SKIES, smooth_sky
from .meshes import load_file
from .results import ROOT

CAMERA_HEIGHT = 30.0
PASS = None  # the stage is drawn as it is
_HALF_WIDTH = CAMERA_HEIGHT * 0.20955 / 2 / 0.5  # luxtest's aperture and focal length
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
AREA_LIGHTS = ("RectLight", "DiskLight", "SphereLight", "CylinderLight")
UP = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class LightFrame:
    """One frame of a sweep: a light's attributes and its place."""

    kind: str
    attributes: Mapping[str, Any] = field(default_factory=dict)
    matrix: np.ndarray = field(default_factory=lambda: np.eye(4))
    """float64, shape [4, 4], acting on column vectors."""
    is_shaped: bool = False
    """Whether ShapingAPI is applied, whose cone is 90 degrees unless authored."""
    shape: str = ""
    """Of a mesh: of ``mesh_sweeps.SHAPES``."""

    def having(self, **more: Any) -> LightFrame:
        """Return the frame with some attributes more."""
        return replace(self, attributes={**self.attributes, **more})


# --- places


def moved(x: float, y: float, z: float) -> np.ndarray:
    """Return a translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def turned(axis: int, degrees: float) -> np.ndarray:
    """Return a rotation about a coordinate axis."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(4)
    matrix[[a, a, b, b], [a, b, a, b]] = c, -s, s, c
    return matrix


def scaled(x: float, y: float, z: float) -> np.ndarray:
    """Return a scale along the axes."""
    return np.diag([x, y, z, 1.0])


TILTED = moved(0, 1, 0) @ turned(0, -45)
"""luxtest's place of a light: 1 above the floor, shining downwards to -Z by 45 degrees."""
STANDING = moved(0, 0.3, 0)
"""luxtest's other one: 0.3 above the floor, shining along it."""
OVERHEAD = moved(0.7, 2, -0.4) @ turned(0, -90)
SHEAR = np.array([[1.25, 0, 0.6, 0], [0, 1, 0, 0], [0, 0, 0.75, 0], [0, 0, 0, 1.0]])

# --- files

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

_PROFILE_VERTICAL = np.array([0.0, 20, 50, 80, 100, 140, 180])
_PROFILE_HORIZONTAL = np.array([0.0, 45, 90, 160, 270, 315, 360])
_PROFILE_VALUES = np.array(  # no two halves are alike
    [
        [300, 250, 220, 150, 60, 30, 20],
        [300, 220, 180, 120, 50, 20, 20],
        [300, 180, 120, 100, 60, 20, 20],
        [300, 260, 260, 200, 40, 10, 20],
        [300, 320, 300, 180, 80, 40, 20],
        [300, 280, 240, 160, 70, 40, 20],
        [300, 250, 220, 150, 60, 30, 20],
    ],
    float,
)


_STRIPES = np.array([0.0, *(10.0 * k + side for k in range(1, 18) for side in (-0.5, 0.5)), 180.0])
"""Angles between which the second profile, like luxtest's, is bright and dark by turns, over all horizontal angles."""
_PROFILES = {
    "profile.ies": (_PROFILE_VERTICAL, _PROFILE_HORIZONTAL, _PROFILE_VALUES),
    "stripes.ies": (_STRIPES, np.array([0.0, 360.0]), np.tile(np.repeat(np.resize([300.0, 30.0], 18), 2), (2, 1))),
}


def write_files(folder: Path) -> dict[str, Path]:
    """Write two profiles, a rect's texture and images of domes into a folder; return their paths by name.

    Those of ``SKIES`` go by the names of their layouts.
    """
    paths = {name: folder / name for name in (*_PROFILES, "texture.png", "sky.png")}
    for name, (vertical, horizontal, values) in _PROFILES.items():
        numbers = [1, -1, 1, len(vertical), len(horizontal), 1, 2, 0, 0, 0, 1, 1, 0]
        text = "\n".join(" ".join(f"{number:g}" for number in row) for row in (numbers, vertical, horizontal, *values))
        paths[name].write_text(f"IESNA:LM-63-2002\nTILT=NONE\n{text}\n", encoding="ascii")
    PillowImage.fromarray(_texture()).save(paths["texture.png"])
    PillowImage.fromarray(_sky()).save(paths["sky.png"])
    for name, paint in SKIES.items():
        paths[name] = folder / f"{name}.png"
        PillowImage.fromarray(np.round(65535 * paint()).astype(np.uint16)).save(paths[name])
    return paths


def _texture() -> np.ndarray:
    """Return 16 bits a pixel, which are not decoded: rows from the top; brighter to the left, and at the top."""
    rows, columns = np.mgrid[0:32, 0:32]
    chequer = 0.4 * ((rows // 8 + columns // 8) % 2)
    return np.round(65535 * np.clip(0.6 - columns / 64 + 0.3 * (rows < 8) + chequer, 0, 1)).astype(np.uint16)


def _sky() -> np.ndarray:
    rows, columns = np.mgrid[0:32, 0:64]
    return np.round(65535 * np.clip(0.9 - rows / 40 - columns / 160 + 0.1 * (columns == 50), 0, 1)).astype(np.uint16)


# --- sweeps


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
    yield "intensity", _each(base, "intensity", [0.1, 1.0, 5.0, 1000.0])
    yield "exposure", _each(base, "exposure", [-11.0, -1.0, 0.5, 3.0])
    yield "color", _each(base, "color", [(1, 0.5, 0), (0.2, 0.3, 4)])
    temperatures = [2000.0, 4250.0, 6500.0, 8750.0, 10000.0]
    yield "temperature", _each(_with(base, enableColorTemperature=True), "colorTemperature", temperatures)
    yield "diffuse", _each(base, "diffuse", [0.0, 0.5, 2.0])
    for name in _SIZES[kind]:
        sizes = [0.1, 0.2, 0.3, 0.4, 0.5, 1.0, 2.0]
        yield name, _each(base, name, sizes)
        yield f"{name}, normalized", _each(_with(base, normalize=True), name, sizes)
    yield "tilt", [replace(base, matrix=turned(2, angle) @ TILTED) for angle in (0, 15, 30, 45, 60)]
    scales = [scaled(s, s, s) for s in (0.25, 2.0)] + [scaled(1.25, 1, 0.75), scaled(0.5, 2, 1), scaled(-1, 1, 2)]
    for title, more in (("scale", five), ("scale, normalized", {**five, "normalize": True})):
        yield title, [LightFrame(kind, more, TILTED @ scale) for scale in scales]
    yield "shear", [LightFrame(kind, five, OVERHEAD @ SHEAR), LightFrame(kind, five, OVERHEAD @ SHEAR.T)]
    heights = [0.2, 0.5, 1.5, 5.0, 25.0, 400.0]
    yield "height", [LightFrame(kind, five, moved(0.7, y, -0.4) @ turned(0, -90)) for y in heights]
    yield "standing", [LightFrame(kind, five, STANDING @ turned(1, angle)) for angle in (0, 30, 60, 90)]
    wide = {"width": 6.0, "height": 4.0, "radius": 2.0, "length": 6.0}
    large = {**five, **{name: wide[name] for name in _SIZES[kind]}}
    yield "large", [LightFrame(kind, large, moved(0, y, 0) @ turned(0, a)) for y, a in ((1, -45), (2.5, -90), (0, -10))]
    yield from _shaping_sweeps(kind, files)
    if kind == "RectLight":
        textured = _with(base, **{"texture:file": files["texture.png"]}, width=2.0)
        yield "texture", [textured, replace(textured, matrix=OVERHEAD), replace(textured, matrix=STANDING)]
        spot = {"shaping:cone:angle": 40.0, "shaping:focus": 2.0}
        yield "texture, shaped", [replace(_with(textured, **spot), is_shaped=True)]


def _shaping_sweeps(kind: str, files: Mapping[str, Path]) -> Iterator[tuple[str, list[LightFrame]]]:
    base = LightFrame(kind, {"intensity": 5.0}, TILTED, is_shaped=True)
    open_ = _with(base, **{"shaping:cone:angle": 180.0})
    focus, tint = "shaping:focus", "shaping:focusTint"
    cone, softness = "shaping:cone:angle", "shaping:cone:softness"
    yield "ShapingAPI alone", [base]
    yield "focus", _each(open_, focus, [0.0, 1.25, 2.5, 3.75, 5.0, 40.0])
    yield "focusTint", _each(_with(open_, **{focus: 3.0}), tint, [(0, 0, 0), (0, 0.5, 0), (0.5, 1, 0.5), (1, 1, 1)])
    red = _with(base, **{cone: 60.0, tint: (1, 0, 0)})
    yield "focus, cone 60, tint", _each(red, focus, [0.0, 1.25, 2.5, 3.75, 5.0])
    angles = [170.0, 130.0, 90.0, 50.0, 10.0]
    small = {name: 0.1 for name in _SIZES[kind] if name == "radius"}
    yield "cone", _each(base, cone, angles)
    yield "cone, standing", [replace(_with(f, **small), matrix=STANDING) for f in _each(base, cone, angles)]
    yield "cone, far", [replace(f, matrix=moved(0.7, 20, -0.4) @ turned(0, -90)) for f in _each(base, cone, [3.0, 8.0])]
    down = moved(0.3, 0, 0.2) @ turned(0, -90)
    for value in (20.0, 50.0, 200.0, 1000.0):
        sharp = _with(open_, **{focus: value})
        yield f"focus {value:g}, far", [replace(sharp, matrix=moved(0, y, 0) @ down) for y in (5.0, 14.0, 20.0)]
    soft = _with(base, **{cone: 40.0, softness: 1.0})
    yield "softness, far", [replace(soft, matrix=moved(0, 20, 0) @ down)]
    wall = {"width": 8.0, "height": 8.0, "radius": 4.0, "length": 8.0}
    through = replace(_with(base, **{name: wall[name] for name in _SIZES[kind]}), matrix=moved(0, 4, 3))
    yield "softness, a wall", [_with(through, **{cone: c, softness: s}) for c, s in ((60.0, 0.5), (90.0, 1.0))]
    yield "softness", _each(_with(base, **{cone: 45.0}), softness, [0.0, 0.25, 0.5, 0.75, 1.0])
    sheared = _with(base, **small, **{cone: 170.0, focus: 2.0, tint: (0, 0, 1)})
    places = [turned(1, angle) @ SHEAR for angle in (0, 45, 90, 135, 180)]
    yield "shear, focus, cone 170", [replace(sheared, matrix=STANDING @ place) for place in places]
    profile = _with(open_, **{"shaping:ies:file": files["profile.ies"]})
    scale, normalize = "shaping:ies:angleScale", "shaping:ies:normalize"
    yield "profile", _each(profile, scale, [-1.0, -0.5, 0.0, 0.5, 1.0])
    afar = replace(profile, matrix=moved(0, 60, 0) @ down)
    yield "profile, far, angleScale", _each(afar, scale, [0.03, 0.1, -0.97])
    stripes = _with(profile, **{"shaping:ies:file": files["stripes.ies"]})
    yield "profile of stripes", [replace(stripes, matrix=moved(0, 3, 0) @ down), stripes]
    yield "profile, normalized", _each(_with(profile, **{normalize: True}), scale, [-0.5, 0.0, 0.5])
    turns = [OVERHEAD @ turned(2, angle) for angle in (0, 70, 200)]
    yield "profile, overhead", [replace(profile, matrix=turn) for turn in turns]
    everything = LightFrame(kind, EVERYTHING, is_shaped=True)
    yield "all at once, mirrored", [replace(everything, matrix=place) for place in MIRRORED]
    behind = _with(profile, **{scale: -0.7, normalize: True})
    yield "profile, mirrored, angleScale", [replace(behind, matrix=place) for place in MIRRORED]
    yield "profile, cone 50", [_with(profile, **{cone: 50.0, softness: 0.3})]


def _distant_sweeps() -> Iterator[tuple[str, list[LightFrame]]]:
    down = turned(0, -90)
    base = LightFrame("DistantLight", {"intensity": 3720.0}, down)
    yield "intensity", _each(base, "intensity", [1.0, 50000.0])
    yield "exposure", _each(base, "exposure", [-5.0, 1.0])
    yield "color", _each(base, "color", [(1, 0.5, 0)])
    temperatures = [2000.0, 4250.0, 6500.0, 8750.0, 10000.0]
    yield "temperature", _each(_with(base, enableColorTemperature=True), "colorTemperature", temperatures)
    yield "tilt", [replace(base, matrix=turned(0, -angle)) for angle in (90, 70, 50, 30, 10)]
    dim = _with(base, intensity=0.3)
    angles = [0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 120.0, 140.0, 160.0, 180.0]
    yield "angle", _each(dim, "angle", angles)
    yield "angle, normalized", _each(_with(dim, normalize=True), "angle", angles)
    yield "angle above 180", _each(dim, "angle", [200.0, 270.0, 360.0])
    low = replace(dim, matrix=turned(0, -30))
    yield "angle, tilted", _each(low, "angle", [20.0, 80.0, 140.0, 240.0])
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
    yield "intensity", _each(base, "intensity", [0.3, 2.0])
    yield "exposure", _each(base, "exposure", [-2.0, 1.0])
    yield "color", _each(base, "color", [(1, 0.5, 0.1)])
    textured = _with(base, **{"texture:file": files["sky.png"]})
    turns = [np.eye(4), turned(1, 70), turned(0, 50), turned(2, 120) @ turned(0, -40)]
    yield "image", [replace(textured, matrix=turn) for turn in turns]
    yield "image, scale", [replace(textured, matrix=place) for place in _STRETCHED]
    for layout in SKIES:
        sky = _with(base, **{"texture:file": files[layout], "texture:format": layout})
        yield layout, [replace(sky, matrix=place) for place in (*_STRETCHED, *turns)]
    cross = _with(base, **{"texture:file": files["cubeMapVerticalCross"], "texture:format": "automatic"})
    yield "automatic", [replace(cross, matrix=turn) for turn in turns]


def _with(frame: LightFrame, **more: Any) -> LightFrame:
    return frame.having(**more)


def _each(frame: LightFrame, name: str, values: Sequence[Any]) -> list[LightFrame]:
    return [_with(frame, **{name: value}) for value in values]


# --- stages


def make_stage(frames: Sequence[LightFrame]) -> Usd.Stage:
    """Return a stage with the floor, the camera and one light, frame k at time code k."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    camera = UsdGeom.Camera.Define(stage, "/Camera")
    camera.CreateFocalLengthAttr(0.5)
    camera.CreateHorizontalApertureAttr(0.20955)
    camera.CreateVerticalApertureAttr(0.20955)
    camera.AddTransformOp().Set(_gf(moved(0, CAMERA_HEIGHT, 0) @ turned(0, -90)))
    floor = UsdGeom.Mesh.Define(stage, "/Floor")
    floor.CreatePointsAttr([(-9, 0, -9), (-9, 0, 9), (9, 0, 9), (9, 0, -9)])
    floor.CreateFaceVertexCountsAttr([4])
    floor.CreateFaceVertexIndicesAttr([0, 1, 2, 3])
    floor.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    material = UsdShade.Material.Define(stage, "/White")
    shader = UsdShade.Shader.Define(stage, "/White/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    for name, kind, value in (
        ("diffuseColor", Sdf.ValueTypeNames.Color3f, (1, 1, 1)),
        ("useSpecularWorkflow", Sdf.ValueTypeNames.Int, 1),
        ("ior", Sdf.ValueTypeNames.Float, 1.0),
    ):
        shader.CreateInput(name, kind).Set(value)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(floor.GetPrim()).Bind(material)
    light = stage.DefinePrim("/Light", frames[0].kind)
    if frames[0].kind == "Mesh":
        UsdLux.MeshLightAPI.Apply(light)
    elif not light.HasAPI(UsdLux.LightAPI):
        UsdLux.LightAPI.Apply(light)
    if frames[0].is_shaped:
        UsdLux.ShapingAPI.Apply(light)
    place = UsdGeom.Xformable(light).AddTransformOp()
    for time, frame in enumerate(frames):
        place.Set(_gf(frame.matrix), time)
        for name, value in frame.attributes.items():
            attribute = light.GetAttribute(f"inputs:{name}")
            if not attribute:
                attribute = light.CreateAttribute(f"inputs:{name}", Sdf.ValueTypeNames.Asset)
            attribute.Set(Sdf.AssetPath(str(value)) if isinstance(value, Path) else value, time)
    return stage


def _gf(matrix: np.ndarray) -> Gf.Matrix4d:
    return Gf.Matrix4d(matrix.T.tolist())


def floor_points(across: int) -> np.ndarray:
    """Return where the middles of a square picture's pixels see the floor, rows from the top: shape [across^2, 3]."""
    places = _HALF_WIDTH * (2 * (np.arange(across) + 0.5) / across - 1)
    z, x = np.meshgrid(places, places, indexing="ij")  # the picture's top is at -Z
    return np.stack([x, 0 * x, z], axis=-1).reshape(-1, 3)


# --- what the floor must show

_EXACT: ModuleType | None = None


def float64_lights() -> ModuleType:
    """Return tests/lights_float64.py, which cuts lights into patches."""
    global _EXACT
    if _EXACT is None:
        _EXACT = load_file(ROOT / "tests" / "lights_float64.py")
    return _EXACT


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
    image = _texture() / 65535.0
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
    factor = _profile_values(emitted, scale, *_PROFILES[frame.attributes["shaping:ies:file"].name])
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
    cells = sum(_PROFILE_VALUES[i : i + 6, j : j + 6] for i in (0, 1) for j in (0, 1)) / 4
    vertical, horizontal = np.radians(_PROFILE_VERTICAL), np.radians(_PROFILE_HORIZONTAL)
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
    image = _sky() / 65535.0
    rows, columns = image.shape
    return np.array(math.pi * _bilinear(image, t * rows - 0.5, s * columns - 0.5, wraps=True).mean())
