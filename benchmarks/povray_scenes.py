# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scenes that POV-Ray can render term for term: the mirror and the teapot, and random ones made of its meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warp_rt import Scene
from warp_rt.scene import Input, Light, LightKind, Material


def with_povray_glass(scene: Scene) -> Scene:
    """Return the scene with Kr = 1 - Kt on all glass, so that total internal reflection weighs 1 here too."""
    return replace(scene, materials=tuple(_povray_glass(material) for material in scene.materials))


def _povray_glass(material: Material) -> Material:
    transmission = material.inputs.get("transmission")
    if transmission is None or max(transmission.value[:3]) == 0:
        return material
    return replace(material, inputs=dict(material.inputs) | {"reflection": _input(1 - np.array(transmission.value))})


def random_scene(base: Scene, seed: int) -> Scene:
    """Return the bodies of a scene with materials, lights, ambient, background and viewpoint drawn at random.

    Kt and ks are grey, and Kr + Kt = 1 on what is glass.
    """
    rng = np.random.default_rng(seed)
    materials = []
    for material in base.materials:
        kt = material.inputs.get("transmission")
        terms = {"ambient": rng.uniform(0, 0.3, 3), "diffuse": rng.uniform(0, 0.6, 3)}
        terms |= {"specular": np.full(3, rng.uniform(0, 0.5)), "shininess": rng.uniform(2, 90, 1)}
        terms["reflection"] = rng.uniform(0, 0.6, 3) * rng.integers(0, 2)
        if kt is not None and max(kt.value[:3]) > 0:
            weight = rng.uniform(0.4, 0.95)
            terms |= {"transmission": np.full(3, weight), "reflection": np.full(3, 1 - weight)}
            terms |= {"ior": rng.uniform(1.2, 2.0, 1), "diffuse": np.zeros(3)}
        materials.append(replace(material, inputs={name: _input(value) for name, value in terms.items()}))
    settings = replace(base.settings, ambient=_color(rng, 0.3, 1.0), background=_color(rng, 0.0, 0.5))
    camera = base.cameras[0]
    matrix = camera.world_from_camera.copy()
    matrix[:3, 3] += rng.uniform(-0.6, 0.6, 3)
    lights = tuple(_light(rng, row, base.bounds()) for row in range(rng.integers(1, 5)))
    return replace(
        base,
        materials=tuple(materials),
        settings=settings,
        cameras=(replace(camera, world_from_camera=matrix),),
        lights=lights,
        source=f"random {seed}",
    )


def _input(value: np.ndarray) -> Input:
    numbers = np.asarray(value, float).tolist()[:3]
    return Input((*numbers, *[0.0] * (4 - len(numbers))))


def _color(rng: np.random.Generator, low: float, high: float) -> tuple[float, float, float]:
    red, green, blue = rng.uniform(low, high, 3).tolist()
    return red, green, blue


def _light(rng: np.random.Generator, row: int, bounds: np.ndarray) -> Light:
    """Return a lecture's point light above the scene, or a distant light from above."""
    low, high = bounds
    matrix = np.eye(4)
    if rng.random() < 0.5:
        matrix[:3, 3] = (*rng.uniform(low[:2], high[:2]), high[2] + rng.uniform(1, 4))
        return Light(f"/Point{row}", LightKind.POINT, matrix, _color(rng, 0.1, 0.5), has_falloff=False)
    back = np.append(rng.uniform(-0.8, 0.8, 2), 1.0)
    back /= np.linalg.norm(back)
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    radiance = tuple((np.pi * rng.uniform(0.1, 0.5, 3)).tolist())
    return Light(f"/Distant{row}", LightKind.DISTANT, matrix, radiance)
