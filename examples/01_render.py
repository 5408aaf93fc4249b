# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Render a stage to a picture: the lecture's mirror and teapot.

python examples/01_render.py [folder]
"""

import argparse
from pathlib import Path

import warp_rt

STAGE = Path(__file__).parent.parent / "scenes" / "mirror_teapot.usda"
parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)

image = warp_rt.render(STAGE, width=480, depth=7)
image.save(folder / "mirror_teapot.png")
print(f"{image.width} x {image.height} pixels, mean colour {image.linear.mean(axis=(0, 1)).round(3)}")
