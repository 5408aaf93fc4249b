# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A scene without USD: a wavy surface from NumPy arrays, with a material and a light of one's own.

python examples/04_from_arrays.py [folder]
"""

import argparse
from pathlib import Path

import numpy as np

import warp_rt
from warp_rt.scene import Input, Light, LightKind, Material, MaterialModel, Settings

parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)

COUNT = 96
x, y = np.meshgrid(np.linspace(-3, 3, COUNT), np.linspace(-3, 3, COUNT))
radius = np.hypot(x, y)
z = 0.6 * np.cos(3 * radius) * np.exp(-0.4 * radius)
points = np.stack([x, y, z], axis=-1).reshape(-1, 3)

corner = (np.arange(COUNT - 1)[:, None] * COUNT + np.arange(COUNT - 1)).reshape(-1)
lower = np.stack([corner, corner + 1, corner + COUNT + 1], axis=-1)
upper = np.stack([corner, corner + COUNT + 1, corner + COUNT], axis=-1)

copper = Material(
    "/copper",
    MaterialModel.WHITTED,
    {
        "ambient": Input((0.10, 0.05, 0.03, 0.0)),
        "diffuse": Input((0.60, 0.30, 0.18, 0.0)),
        "specular": Input((0.60, 0.50, 0.45, 0.0)),
        "shininess": Input((40.0, 0.0, 0.0, 0.0)),
    },
)
tilt, place = np.eye(4), np.eye(4)
tilt[1:3, 1:3] = [[0.45, 0.893], [-0.893, 0.45]]  # lays the surface back, most of the way to the ground
place[:3, 3] = (-4.0, 6.0, 5.0)
scene = warp_rt.Scene.from_arrays(
    points,
    np.concatenate([lower, upper]),
    world_from_local=tilt,
    material=copper,
    lights=[Light("/lamp", LightKind.POINT, place, (1.0, 0.95, 0.9), has_falloff=False)],
    settings=Settings(ambient=(1.0, 1.0, 1.0), background=(0.05, 0.08, 0.12)),
)
image = warp_rt.render(scene, width=320, height=240)
image.save(folder / "waves.png")
print(f"{scene.triangle_count} triangles, {image.film.rays.shadow} shadow rays")
