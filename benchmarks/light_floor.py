# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A floor under a light, as a stage: frames of the light's attributes and its place.

The floor, y = 0, is white and Lambertian, the camera 30 above it, as in luxtest
(https://github.com/anderslanglands/luxtest); the lights hang where luxtest has them, 1 above the floor and tilted by 45
degrees, or stand on it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade

CAMERA_HEIGHT = 30.0
_HALF_WIDTH = CAMERA_HEIGHT * 0.20955 / 2 / 0.5  # luxtest's aperture and focal length
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

    def each(self, name: str, values: Sequence[Any]) -> list[LightFrame]:
        """Return the frame with each value of an attribute."""
        return [self.having(**{name: value}) for value in values]


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
