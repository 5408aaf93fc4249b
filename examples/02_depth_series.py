# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lecture's series of pictures: the ray tree cut at depth 1 to 7, the scene prepared once for each.

python examples/02_depth_series.py [folder]
"""

import sys
from pathlib import Path

import warp_rt

STAGE = Path(__file__).parent.parent / "scenes" / "mirror_teapot.usda"
folder = Path(sys.argv[1] if len(sys.argv) > 1 else "depth_series")
folder.mkdir(parents=True, exist_ok=True)

scene = warp_rt.load_scene(STAGE)
for depth in range(1, 8):
    image = warp_rt.render(scene, width=320, depth=depth, threshold=0.0)
    image.save(folder / f"depth_{depth}.png")
    rays = image.film.rays
    print(f"depth {depth}: {rays.reflection:6} reflection, {rays.refraction:6} refraction, {rays.shadow:6} shadow rays")
