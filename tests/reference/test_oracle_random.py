# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scenes drawn at random, traced by the float64 oracle and, through USD, by the renderer.

Every seed gives other materials (coloured Ka, Kd, Ks, Kr, Kt, other exponents and indices of refraction), lights,
ambient, background, camera, and bodies: floor, teapot, glass ball, a glass box and a mirror.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from warp_rt import Renderer, RenderOptions, load_scene

from .oracle_scenes import assert_same_counts, assert_same_image, oracle_folder, oracle_module

HEAVY = pytest.mark.heavy
SEEDS = [pytest.param(seed, marks=() if seed < 2 else HEAVY) for seed in range(12)]
WIDTH, HEIGHT = 120, 96

BOX_CORNERS = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
BOX_TRIANGLES = np.array(
    [t for a, b, c, d in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
     for t in ((a, b, c), (a, c, d))]
)  # fmt: skip


def draw_scene(seed: int, mkscene: ModuleType) -> object:
    """Return the oracle scene of a seed."""
    rng = np.random.default_rng(seed)
    scene = mkscene.build(teapot=int(rng.integers(2, 5)), ico=2, floor=8, w=WIDTH, h=HEIGHT)
    arrays = {"v": scene.v, "f": scene.f, "n": scene.n, "mat": scene.mat, "obj": scene.obj}
    _add_glass_box(arrays, rng)

    def color(low: float, high: float) -> list[float]:
        return rng.uniform(low, high, 3).round(4).tolist()

    def surface(name: str, **terms: object) -> dict[str, object]:
        return {"name": name, "ka": color(0, 0.2), "kd": color(0, 0.5), "ks": 0, "n": 1, "kr": 0, "kt": 0} | terms

    def glass(name: str) -> dict[str, object]:
        # Kr is grey because at total internal reflection the oracle adds the largest channels of Kr and Kt, where the
        # threshold rule asks for the largest channel of Kr + Kt.
        kr, index = round(rng.uniform(0.05, 0.3), 4), round(rng.uniform(1.2, 2.0), 3)
        return surface(name, ks=color(0, 0.4), n=80, kr=kr, kt=color(0.4, 0.85), ior=index, kd=0)

    eye = np.append(rng.uniform(-5, 5, 1), [-9.0, rng.uniform(2, 6)])
    scene.js |= {
        "camera": mkscene.camera(eye, rng.uniform((-1, -1, 0.5), (1, 1, 1.5)), (0, 0, 1), 45, WIDTH, HEIGHT),
        "ambient": color(0.3, 1.2),
        "background": color(0, 0.5),
        "materials": [
            surface("light tiles"),
            surface("dark tiles", ks=color(0, 0.3), n=round(rng.uniform(2, 40), 2)),
            surface("mirror", kd=0, kr=color(0.4, 0.95)),
            surface("teapot", ks=color(0.1, 0.5), n=round(rng.uniform(5, 90), 2), kr=color(0, 0.5)),
            glass("ball"),
            glass("box"),
        ],
        "lights": [_draw_light(rng) for _ in range(rng.integers(1, 5))],
    }
    return type(scene)(scene.js, arrays)


def _add_glass_box(arrays: dict[str, np.ndarray], rng: np.random.Generator) -> None:
    """Add a turned box in front of the teapot, clear of the other bodies, with material 5."""
    angle = rng.uniform(0, np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    size = rng.uniform(0.3, 0.6, 3)
    corners = (BOX_CORNERS * size) @ turn.T + (-1.6, -3.4, size[2] + 0.01)
    corners = corners.astype(np.float32).astype(float)
    side = corners[BOX_TRIANGLES]
    normal = np.cross(side[:, 1] - side[:, 0], side[:, 2] - side[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    count = len(BOX_TRIANGLES)
    arrays["f"] = np.concatenate([arrays["f"], BOX_TRIANGLES + len(arrays["v"])])
    arrays["v"] = np.concatenate([arrays["v"], corners])
    arrays["n"] = np.concatenate([arrays["n"], np.repeat(normal[:, None], 3, axis=1)])
    arrays["mat"] = np.concatenate([arrays["mat"], np.full(count, 5)])
    arrays["obj"] = np.concatenate([arrays["obj"], np.full(count, arrays["obj"].max() + 1)])


def _draw_light(rng: np.random.Generator) -> dict[str, object]:
    color = rng.uniform(0.05, 0.5, 3).round(4).tolist()
    if rng.random() < 0.5:
        position = rng.uniform((-7, -8, 4), (7, 2, 10)).round(4).tolist()
        return {"type": "point", "position": position, "color": color}
    direction = [*rng.uniform(-0.8, 0.8, 2).round(4).tolist(), -1.0]
    return {"type": "directional", "direction": direction, "color": color}


@pytest.mark.parametrize("seed", SEEDS)
def test_random_scene(seed: int, tmp_path: Path) -> None:
    oracle_folder()  # skips
    oracle, mkscene, scene_to_usd = (oracle_module(name) for name in ("oracle", "mkscene", "scene_to_usd"))
    scene = draw_scene(seed, mkscene)
    scene.save(str(tmp_path / "scene.json"))
    scene_to_usd.write(str(tmp_path / "scene.json"), str(tmp_path / "scene.usda"))
    scene.build()
    loaded = load_scene(tmp_path / "scene.usda")
    for depth, threshold, shadows in ((5, 0.0, "opaque"), (8, 0.03, "transmit")):
        image, counts, _ = oracle.render(scene, depth, threshold, "krkt", shadows)
        options = RenderOptions(width=WIDTH, height=HEIGHT, depth=depth, threshold=threshold, shadows=shadows)
        film = Renderer(loaded, options, device="cpu").render()
        assert_same_image(film.color, image)
        assert_same_counts(film, counts)
