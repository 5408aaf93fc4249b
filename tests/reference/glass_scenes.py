# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scenes drawn at random about what ray trees find hard: glass within and across glass, eyes in glass, textures.

Kr and Kt are coloured everywhere. Bodies are placed by scaling, turning and mirroring transforms, and round ones have
interpolated normals.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from warp_rt import Scene
from warp_rt.scene import Camera, Image, Input, Light, LightKind, Material, Texture, Wrap

from ..analytic.scenes import Body, box, distant, lamp, looking, scene_of, square, whitted
from ..meshes import octasphere

KINDS = ("nested", "shells", "overlapping", "eye in glass", "textures", "many lights")
WIDTH, HEIGHT = 100, 75
WRAPS = (Wrap.REPEAT, Wrap.MIRROR, Wrap.CLAMP, Wrap.BLACK)


class _Draw:
    """Random materials, bodies and lights of one scene."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def color(self, low: float, high: float) -> tuple[float, ...]:
        return tuple(self.rng.uniform(low, high, 3).tolist())

    def glass(self, **more: object) -> Material:
        terms = {
            "ambient": self.color(0, 0.1),
            "specular": self.color(0, 0.4),
            "shininess": self.rng.uniform(5, 90),
            "reflection": self.color(0.02, 0.4),
            "transmission": self.color(0.3, 0.9),
            "ior": self.rng.uniform(1.1, 2.2),
        }
        return whitted(**(terms | more))

    def opaque(self, **more: object) -> Material:
        terms = {
            "ambient": self.color(0, 0.2),
            "diffuse": self.color(0.1, 0.6),
            "specular": self.color(0, 0.4),
            "shininess": self.rng.uniform(5, 90),
            "reflection": self.color(0, 0.4),
        }
        return whitted(**(terms | more))

    def ball(self, material: Material, center: Sequence[float], radius: float, levels: int = 2) -> Body:
        """A tessellated ball with smooth normals, slightly squashed, turned, and mirrored half of the time."""
        points, faces = octasphere(levels)
        size = radius * self.rng.uniform(0.85, 1.0, 3) * (1, 1, self.rng.choice([-1.0, 1.0]))
        return Body(
            points,
            faces,
            material,
            normals=points,
            world_from_local=_place(center, size, self.rng),
            primvars=_st(points),
        )

    def crate(self, material: Material, center: Sequence[float], half: float) -> Body:
        """A box with flat faces, turned."""
        body = box(material, (-1, -1, -1), (1, 1, 1))
        place = _place(center, half * self.rng.uniform(0.8, 1.0, 3), self.rng)
        return dataclasses.replace(body, world_from_local=place, primvars=_st(body.points))

    def light(self) -> Light:
        color = self.color(0.05, 0.5)
        kind = self.rng.integers(3)
        if kind == 0:
            return distant((*self.rng.uniform(-0.8, 0.8, 2), -1.0), color)
        position = (*self.rng.uniform(-6, 6, 2), self.rng.uniform(5, 9))
        if kind == 1:
            return lamp(LightKind.POINT, position, color, has_falloff=False)
        return lamp(LightKind.POINT, position, np.multiply(color, 200.0), radius=0.5)


def _place(center: Sequence[float], size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.sign(np.linalg.det(turn)) * size
    matrix[:3, 3] = center
    return matrix


def _st(points: np.ndarray) -> dict[str, np.ndarray]:
    return {"st": 0.4 * points[:, :2] + 0.2 * points[:, 2:]}


def draw_scene(kind: str, seed: int) -> Scene:
    """Return a random scene of a kind; its camera is ``scene.cameras[0]``."""
    draw = _Draw(seed * len(KINDS) + KINDS.index(kind))
    rng = draw.rng
    floor = square(draw.opaque(), half=9.0)
    floor = dataclasses.replace(floor, primvars=_st(floor.points))
    eye, target = np.array((rng.uniform(-3, 3), -7.5, rng.uniform(2, 5))), np.array((0.0, 0.0, 1.0))
    bodies = [floor, draw.ball(draw.opaque(), (2.6, 1.4, 1.0), 1.0), draw.crate(draw.opaque(), (-2.8, 1.6, 1.3), 0.8)]
    count = int(rng.integers(1, 4))
    if kind == "nested":
        # Within one another: crate, ball, crate, and a bead of mirror; beside them a ball within a ball.
        bodies += [draw.crate(draw.glass(), (0, 0, 2.2), 2.0), draw.ball(draw.glass(), (0, 0, 2.2), 1.3)]
        bodies += [draw.crate(draw.glass(), (0, 0, 2.2), 0.55), draw.ball(draw.opaque(), (0, 0, 2.2), 0.3)]
        bodies += [draw.ball(draw.glass(), (2.2, -2.4, 0.9), 0.8, 3), draw.ball(draw.glass(), (2.2, -2.4, 0.9), 0.55)]
    elif kind == "shells":
        # So coarse, and so smooth their normals, that many rays are bent to the wrong side of several.
        bodies += [draw.ball(draw.glass(), (0, -1, 1.6), radius, 1) for radius in (1.6, 1.4, 1.2, 1.0)]
    elif kind == "overlapping":
        # Across one another, the floor, and an opaque body.
        bodies += [draw.ball(draw.glass(), (-0.6, -1, 1.4), 1.3), draw.ball(draw.glass(), (0.6, -0.6, 1.2), 1.1)]
        bodies += [draw.crate(draw.glass(), (0.1, -1.6, 0.6), 0.9), draw.ball(draw.glass(), (2.4, 0.4, 1.0), 0.9)]
        bodies += [draw.ball(draw.glass(), (-2.6, -1.5, 0.0), 0.9)]
    elif kind == "eye in glass":
        # In one body, or in two; a third, and an opaque one, share the inside with the eye. Near the origin and not
        # small: float32 places a ray that starts far out to what is much by the size of a bead.
        eye = np.array((rng.uniform(-1, 1), -4.0, rng.uniform(2, 3)))
        ahead = eye + 1.2 * (target - eye) / np.linalg.norm(target - eye)
        shell = draw.ball if rng.random() < 0.5 else draw.crate
        bodies += [shell(draw.glass(), eye, 2.4), draw.ball(draw.glass(), (0.3, 0.8, 1.5), 1.4)]
        bodies += [draw.ball(draw.glass(), ahead + np.array((0.3, 0, 0.3)), 0.5)]
        bodies += [draw.ball(draw.opaque(), ahead - (0.4, 0, 0.3), 0.35)]
        if rng.random() < 0.5:
            bodies.append(draw.crate(draw.glass(), eye + 0.15, 3.2))
    elif kind == "textures":
        image = [Input(texture=row) for row in range(4)]
        bodies[0] = dataclasses.replace(floor, material=draw.opaque(diffuse=image[0], reflection=image[1]))
        bodies += [draw.ball(draw.opaque(reflection=image[1], specular=image[2]), (-1.2, -0.5, 1.4), 1.3)]
        bodies += [draw.ball(draw.glass(transmission=image[3], reflection=image[1]), (1.2, -1.5, 1.1), 1.0)]
        bodies += [draw.crate(draw.glass(transmission=image[3], diffuse=image[0]), (0.3, -3.2, 0.9), 0.7)]
        bodies += [draw.crate(draw.glass(ior=Input(primvar="index")), (-2.2, -3.0, 0.8), 0.7)]
        bodies[-1].primvars["index"] = np.full((8, 1), rng.uniform(1.2, 1.8))
    elif kind == "many lights":
        bodies += [draw.ball(draw.glass(), (-1.2, -0.5, 1.4), 1.3), draw.crate(draw.glass(), (1.2, -1.5, 1.1), 0.9)]
        count = 24
    scene = scene_of(
        *bodies,
        lights=[draw.light() for _ in range(count)],
        ambient=draw.color(0.3, 1.2),
        background=draw.color(0, 0.5),
    )
    camera = Camera("/camera", looking(target - eye, eye), (-0.4, 0.4, -0.3, 0.3))
    scene = dataclasses.replace(scene, cameras=(camera,))
    return _with_textures(scene, draw) if kind == "textures" else scene


def _with_textures(scene: Scene, draw: _Draw) -> Scene:
    """Return a scene with four textures: bytes, sRGB bytes, float, and bytes with black and white texels."""
    rng = draw.rng
    pixels = [rng.integers(0, 256, (5, 7, 4)).astype(np.uint8), rng.integers(0, 160, (8, 8, 4)).astype(np.uint8)]
    pixels += [
        rng.uniform(0, 0.5, (6, 4, 4)).astype(np.float32),
        (rng.integers(0, 2, (6, 6, 4)) * 230).astype(np.uint8),
    ]
    turn = np.array([[0.8, 0.3, rng.uniform()], [-0.3, 0.8, rng.uniform()]], np.float32)
    textures = [
        Texture(row, uv_transform=turn, wrap_s=rng.choice(WRAPS), wrap_t=rng.choice(WRAPS), is_srgb=row == 1)
        for row in range(len(pixels))
    ]
    textures[0] = dataclasses.replace(textures[0], scale=(0.8, 0.7, 0.6, 1.0), bias=(0.05, 0.1, 0.0, 0.0))
    images = tuple(Image(f"texture{row}", values) for row, values in enumerate(pixels))
    return dataclasses.replace(scene, textures=tuple(textures), images=images)
