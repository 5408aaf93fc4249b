# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays of one's own: a ring of range finders in the middle of the scene, and what each of them can see.

python examples/05_rays.py [folder]
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

import warp_rt

STAGE = Path(__file__).parent.parent / "scenes" / "mirror_teapot.usda"
parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)

scene = warp_rt.load_scene(STAGE)
accel = warp_rt.build_accel(scene, device="cpu")

angle = np.radians(np.arange(0, 360, 15))
directions = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1).astype(np.float32)
origins = np.tile(np.float32([1.0, -2.0, 1.0]), (len(angle), 1))

hits = warp_rt.closest_hit(accel, origins, directions)
for degrees, t, instance in zip(np.degrees(angle), hits.t, hits.instance, strict=True):
    seen = f"{t:5.2f}  {scene.prims[scene.instances.prim[instance]]}" if instance >= 0 else "    -"
    print(f"{degrees:5.0f} degrees  {seen}")

blocked = warp_rt.any_hit(accel, origins, directions, t_max=3.0)
print(f"{np.count_nonzero(blocked)} of {len(blocked)} ways are blocked within 3 units")

# A map of heights: rays straight down, a grid of them.
x, y = np.meshgrid(np.linspace(-6, 6, 360), np.linspace(5, -5, 300))
above = np.stack([x, y, np.full_like(x, 10)], axis=-1).reshape(-1, 3)
down = warp_rt.closest_hit(accel, above, np.broadcast_to([0.0, 0.0, -1.0], above.shape))
heights = np.clip(10 - down.t.reshape(x.shape), 0, 5)
Image.fromarray((255 * heights / 5).astype(np.uint8)).save(folder / "heights.png")
