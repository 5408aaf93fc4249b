# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Depth, normals and ids as NumPy arrays: how much of the picture each prim covers, and how far away it is.

python examples/03_aovs.py [folder]
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
renderer = warp_rt.Renderer(scene, warp_rt.RenderOptions(width=320, aovs=("color", "depth", "normal", "primId")))
film = renderer.render()

ids, depth, normal = film.aovs["primId"], film.aovs["depth"], film.aovs["normal"]
for prim in np.unique(ids):
    here = ids == prim
    if prim < 0:
        print(f"{here.mean():6.1%}  nothing")
    else:
        nearest, up = depth[here].min(), (normal[here][:, 2] > 0.99).mean()
        print(f"{here.mean():6.1%}  {film.prims[prim]}: from {nearest:.1f} units away, {up:.0%} of it level")

Image.fromarray((255 * (0.5 + 0.5 * normal)).astype(np.uint8)).save(folder / "normals.png")
