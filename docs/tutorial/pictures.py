# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The tutorial's pictures, each made by the renderer from the lecture's test scene.

Every function without an underscore makes one picture; ``build.py`` saves it under the function's name.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image
from pxr import Usd, UsdGeom, UsdLux

import warp_rt
from warp_rt.options import INTERSECTORS

SCENE = Path(__file__).resolve().parents[2] / "scenes" / "mirror_teapot.usda"
sys.path.insert(0, str(SCENE.parent))

from make_teapot import tessellate  # noqa: E402

_WIDTH = 400  # of one panel [pixel]
_GAP = 6  # between panels [pixel]
_SPP = 16
_EDGE_RAYS = 200_000
_BALL = (232, 168, 152, 114)  # crop around the glass ball, in a picture of _WIDTH


def _stage() -> Usd.Stage:
    """Return the test scene, to be changed in memory."""
    stage = Usd.Stage.Open(str(SCENE))
    stage.SetEditTarget(stage.GetSessionLayer())
    return stage


def _set_inputs(stage: Usd.Stage, **values: object) -> Usd.Stage:
    """Give inputs of every WhittedSurface of a stage new values."""
    for prim in stage.Traverse():
        if prim.GetName() == "WhittedSurface":
            for name, value in values.items():
                attribute = prim.GetAttribute(f"inputs:{name}")
                if attribute:
                    attribute.Set(value)
    return stage


def _without_shadows(stage: Usd.Stage) -> Usd.Stage:
    for prim in stage.Traverse():
        if prim.HasAPI(UsdLux.LightAPI):
            UsdLux.ShadowAPI.Apply(prim).CreateShadowEnableAttr(False)
    return stage


def _render(stage: Usd.Stage, **options: object) -> np.ndarray:
    """Return an 8-bit picture of a stage: shape [height, width, 3]."""
    chosen: dict[str, object] = {"width": _WIDTH, "spp": _SPP} | options
    return warp_rt.render(stage, **chosen).to_srgb8()[..., :3]


def _row(*panels: np.ndarray) -> Image.Image:
    """Return panels side by side on white."""
    height, width = panels[0].shape[:2]
    sheet = np.full((height, len(panels) * (width + _GAP) - _GAP, 3), 255, np.uint8)
    for index, panel in enumerate(panels):
        sheet[:, index * (width + _GAP) :][:, :width] = panel
    return Image.fromarray(sheet)


# --- the method


def eye_rays() -> Image.Image:
    """Return which prim each eye ray meets first, and how far away."""
    image = warp_rt.render(SCENE, width=_WIDTH, aovs=("color", "primId", "depth"))
    ids = image["primId"]
    hues = np.random.default_rng(7).integers(70, 236, (int(ids.max()) + 2, 3), np.uint8)
    hues[0] = 255
    near, far = np.nanmin(image["depth"]), np.max(image["depth"], where=np.isfinite(image["depth"]), initial=0.0)
    nearness = np.nan_to_num(1.0 - (image["depth"] - near) / (far - near), neginf=0.0)
    grey = np.where(ids < 0, 255, 20 + 215 * nearness).astype(np.uint8)
    return _row(hues[ids + 1], np.repeat(grey[..., None], 3, axis=2))


def local_illumination() -> Image.Image:
    """Return the ambient term alone, with the diffuse one, and with the specular one."""
    black = (0.0, 0.0, 0.0)
    plain = {"reflection": black, "transmission": black}
    ambient = _set_inputs(_without_shadows(_stage()), diffuse=black, specular=black, **plain)
    diffuse = _set_inputs(_without_shadows(_stage()), specular=black, **plain)
    specular = _set_inputs(_without_shadows(_stage()), **plain)
    return _row(*(_render(stage, depth=1) for stage in (ambient, diffuse, specular)))


def shadows() -> Image.Image:
    """Return the scene without shadow rays and with them."""
    return _row(_render(_without_shadows(_stage()), depth=1), _render(_stage(), depth=1))


def reflections() -> Image.Image:
    """Return the scene without reflection rays, and with them."""
    black = (0.0, 0.0, 0.0)
    return _row(_render(_set_inputs(_stage(), reflection=black)), _render(_stage()))


def refractions() -> Image.Image:
    """Return the glass ball with an index of refraction of 1, 1.1, 1.33 and 1.5."""
    indices = (1.0, 1.1, 1.33, 1.5)
    scale = 2
    crop = tuple(scale * number for number in _BALL)
    return _row(*(_render(_set_inputs(_stage(), ior=ior), width=scale * _WIDTH, crop=crop) for ior in indices))


# --- the intersection


def weights() -> Image.Image:
    """Return the three weights of each hit as red, green and blue, on a coarse ball."""
    scene = _ball(2)
    accel = warp_rt.build_accel(scene)
    x, y = np.meshgrid(np.linspace(-1.6, 1.6, _WIDTH), np.linspace(1.2, -1.2, _WIDTH * 3 // 4))
    origins = np.stack([x, y, np.full_like(x, 4.0)], axis=-1).reshape(-1, 3)
    hits = warp_rt.closest_hit(accel, origins, np.broadcast_to([0.0, 0.0, -1.0], origins.shape))
    rgb = np.stack([1.0 - hits.u - hits.v, hits.u, hits.v], axis=-1)
    rgb[hits.instance < 0] = 1.0
    return Image.fromarray((255 * rgb).astype(np.uint8).reshape(*x.shape, 3))


def edges() -> Image.Image:
    """Return where rays from the middle of a ball, aimed at its edges, escape: one map a triangle test."""
    scene = _ball(4)
    mesh = scene.meshes[0]
    rng = np.random.default_rng(7)
    a, b = mesh.points[mesh.triangles[rng.integers(len(mesh.triangles), size=_EDGE_RAYS)]][:, :2].swapaxes(0, 1)
    directions = a + rng.uniform(size=(_EDGE_RAYS, 1)) * (b - a)
    panels = []
    for intersector in INTERSECTORS:
        accel = warp_rt.build_accel(scene, intersector=intersector)
        escaped = warp_rt.closest_hit(accel, np.zeros_like(directions), directions).instance < 0
        x, y, z = directions[escaped].T / np.linalg.norm(directions[escaped], axis=1)
        column = ((np.arctan2(y, x) / (2 * np.pi) + 0.5) * (_WIDTH - 3)).astype(int)
        row = ((0.5 - np.arcsin(z) / np.pi) * (_WIDTH // 2 - 3)).astype(int)
        panel = np.full((_WIDTH // 2, _WIDTH, 3), (34, 40, 49), np.uint8)
        for shift in (0, 1):
            panel[row + shift, column] = panel[row + shift, column + 1] = (255, 196, 61)
        panels.append(panel)
    return _row(*panels)


def normals() -> Image.Image:
    """Return a coarse teapot by its triangles' own normals, and by interpolated ones."""
    points, polygons, point_normals = tessellate(4)
    panels = []
    for interpolated in (False, True):
        stage = _stage()
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/Teapot"))
        mesh.GetPointsAttr().Set(points.tolist())
        mesh.GetFaceVertexCountsAttr().Set([len(polygon) for polygon in polygons])
        mesh.GetFaceVertexIndicesAttr().Set([index for polygon in polygons for index in polygon])
        if interpolated:
            mesh.GetNormalsAttr().Set(point_normals.tolist())
        else:
            mesh.GetNormalsAttr().Block()
        panels.append(_render(stage))
    return _row(*panels)


def _ball(levels: int) -> warp_rt.Scene:
    """Return a unit ball of 8 * 4^levels triangles: an octahedron, subdivided."""
    axes = np.eye(3)
    faces = [[sx * axes[0], sy * axes[1], sz * axes[2]] for sx in (1, -1) for sy in (1, -1) for sz in (1, -1)]
    corners = np.array(faces)  # [triangle, corner, coordinate]
    for _ in range(levels):
        a, b, c = corners.swapaxes(0, 1)
        ab, bc, ca = a + b, b + c, c + a
        corners = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        corners /= np.linalg.norm(corners, axis=-1, keepdims=True)
    points, faces = np.unique(corners.reshape(-1, 3).astype(np.float32), axis=0, return_inverse=True)
    return warp_rt.Scene.from_arrays(points, faces.reshape(-1, 3))
