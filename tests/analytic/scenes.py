# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Small scenes made of arrays, for tests whose radiance is known in closed form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from warp_rt import Film, Renderer, RenderOptions, Scene
from warp_rt.scene import (
    Camera,
    Dome,
    Input,
    Instances,
    Light,
    LightKind,
    Material,
    MaterialModel,
    Mesh,
    OpacityMode,
    Primvar,
    Settings,
    is_closed,
)

Value = float | Sequence[float] | Input


@dataclass(frozen=True)
class Body:
    """A mesh with its material and place."""

    points: np.ndarray
    faces: np.ndarray
    material: Material
    normals: np.ndarray | None = None
    world_from_local: np.ndarray = field(default_factory=lambda: np.eye(4))
    primvars: Mapping[str, np.ndarray] = field(default_factory=dict)
    """One value a point, shape [n, c]."""


def scene_of(
    *bodies: Body,
    lights: Sequence[Light] = (),
    domes: Sequence[Dome] = (),
    ambient: Sequence[float] = (0.0, 0.0, 0.0),
    background: Sequence[float] | None = (0.0, 0.0, 0.0),
) -> Scene:
    """Return the scene of some bodies. Without lights it gets one of no radiance, so that no headlight steps in."""
    meshes = tuple(
        Mesh(
            np.asarray(body.points, np.float32),
            np.asarray(body.faces, np.int32),
            None if body.normals is None else Primvar(np.asarray(body.normals, np.float32), np.int32(body.faces)),
            {name: Primvar(np.float32(rows), np.int32(body.faces)) for name, rows in body.primvars.items()},
            is_closed=is_closed(np.asarray(body.faces)),
        )
        for body in bodies
    )
    rows = np.arange(len(bodies), dtype=np.int32)
    instances = Instances(
        mesh=rows,
        world_from_local=np.array([body.world_from_local for body in bodies], float).reshape(-1, 4, 4),
        material_offset=rows,
        material_table=rows,
        prim=rows,
        instance_id=np.full_like(rows, -1),
    )
    return Scene(
        meshes=meshes,
        instances=instances,
        prims=tuple(f"/body{row}" for row in rows),
        materials=tuple(body.material for body in bodies),
        lights=tuple(lights) if lights or domes else (distant((0, 0, -1), 0.0),),
        domes=tuple(domes),
        settings=Settings(ambient=tuple(ambient), background=None if background is None else tuple(background)),
    )


def whitted(**inputs: Value) -> Material:
    """Return a WhittedSurface; terms that are not given are black."""
    black = {"ambient": 0.0, "diffuse": 0.0, "specular": 0.0, "reflection": 0.0, "transmission": 0.0}
    return Material("/whitted", MaterialModel.WHITTED, {k: _input(k, v) for k, v in (black | inputs).items()})


def preview(
    *, use_specular_workflow: bool = False, presence: bool = False, opacity_threshold: float = 0.0, **inputs: Value
) -> Material:
    """Return a UsdPreviewSurface; inputs that are not given have their defaults."""
    return Material(
        "/preview",
        MaterialModel.PREVIEW,
        {k: _input(k, v) for k, v in inputs.items()},
        use_specular_workflow=use_specular_workflow,
        opacity_mode=OpacityMode.PRESENCE if presence else OpacityMode.TRANSPARENT,
        opacity_threshold=opacity_threshold,
    )


def _input(name: str, value: Value) -> Input:
    if isinstance(value, Input):
        return value
    is_color = name in ("ambient", "diffuse", "specular", "reflection", "transmission") or name.endswith("Color")
    row = np.broadcast_to(np.asarray(value, float), 3 if is_color else 1).tolist()
    return Input((*row, *[0.0] * (4 - len(row))))


def square(material: Material, *, half: float = 10.0, z: float = 0.0, **more: object) -> Body:
    """Return a square about the z axis, facing +Z."""
    points = np.array([(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)])
    return Body(points, np.array([(0, 1, 2), (0, 2, 3)]), material, **more)


def chart(*, half: float = 20.0, z: float = 0.0) -> Body:
    """Return a square whose colour is the place: red = x, green = y."""
    body = square(whitted(ambient=Input(primvar="place")), half=half, z=z)
    return Body(body.points, body.faces, body.material, primvars={"place": body.points * (1.0, 1.0, 0.0)})


def box(material: Material, low: Sequence[float], high: Sequence[float], **more: object) -> Body:
    """Return a closed box with outward faces."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    points = np.array([np.where([x, y, z], high, low) for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    faces = np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])
    return Body(points, faces, material, **more)


def wedge(material: Material, outline: Sequence[Sequence[float]], *, half: float = 5.0) -> Body:
    """Return the closed prism that a triangle in the xz plane, counter-clockwise seen from -Y, sweeps along y."""
    points = np.array([(x, y, z) for y in (-half, half) for x, z in outline])
    faces = [(0, 1, 2), (5, 4, 3)]
    for a, b in ((0, 1), (1, 2), (2, 0)):
        faces += [(a, a + 3, b + 3), (a, b + 3, b)]
    return Body(points, np.array(faces), material)


def looking(direction: Sequence[float], position: Sequence[float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Return the placement of something whose local -Z points along ``direction``: float64, shape [4, 4]."""
    back = -np.asarray(direction, float) / np.linalg.norm(direction)
    up = np.array([0.0, 1.0, 0.0]) if abs(back[1]) < 0.9 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    matrix[:3, 3] = position
    return matrix


def distant(direction: Sequence[float], color: float | Sequence[float] = 1.0, **more: object) -> Light:
    """Return a light from infinitely far that travels along ``direction``: the lecture's light of colour ``color``."""
    irradiance = np.pi * np.broadcast_to(np.asarray(color, float), 3)
    return Light("/distant", LightKind.DISTANT, looking(direction), tuple(irradiance.tolist()), **more)


def lamp(
    kind: LightKind,
    position: Sequence[float],
    radiance: float | Sequence[float] = 1.0,
    *,
    direction: Sequence[float] = (0, 0, -1),
    **more: object,
) -> Light:
    """Return a light somewhere in the scene that shines along ``direction``."""
    colors = tuple(np.broadcast_to(np.asarray(radiance, float), 3).tolist())
    return Light("/lamp", kind, looking(direction, position), colors, **more)


def parallel(
    position: Sequence[float], direction: Sequence[float] = (0, 0, -1), *, half: float = 1e-3, **more: object
) -> Camera:
    """Return an orthographic camera: a thin beam along ``direction`` unless ``half`` makes it wide."""
    return Camera("/camera", looking(direction, position), (-half, half, -half, half), is_perspective=False, **more)


def render(scene: Scene, camera: Camera, *, width: int = 1, height: int = 1, **options: object) -> Film:
    """Return the film of a camera; one pixel unless told otherwise, no child dropped for its weight."""
    chosen = RenderOptions(width=width, height=height, **({"threshold": 0.0} | options))
    return Renderer(scene, chosen, device="cpu").render(camera=camera)


def radiance(scene: Scene, camera: Camera, **options: object) -> np.ndarray:
    """Return what one eye ray, through the middle of ``camera``, brings back: shape [3]."""
    return render(scene, camera, **options).color[0, 0]


def latlong_directions(height: int) -> np.ndarray:
    """Return the unit direction of each texel of a dome's image by UsdLux's rule: float64, shape [h, 2 h, 3], row 0 at
    -Y. The centre is +Z, longitude pi / 2 is +X and left of it."""
    latitude = (((np.arange(height) + 0.5) / height) - 0.5)[:, None] * np.pi
    longitude = (0.5 - (np.arange(2 * height) + 0.5) / (2 * height)) * 2 * np.pi
    x, z = np.cos(latitude) * np.sin(longitude), np.cos(latitude) * np.cos(longitude)
    return np.stack([x, np.broadcast_to(np.sin(latitude), x.shape), z], axis=-1)
