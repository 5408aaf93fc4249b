# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A gate for stages: a contact sheet, what is told of each, and the exit code 3 if one has a warning or is refused.

python examples/11_contact_sheet.py [folder] [--stages STAGE ...]
"""

import argparse
import logging
import sys
from pathlib import Path

from PIL import Image

import warp_rt
from warp_rt.image.contact_sheet import Caption, Cell, contact_sheet

SCENES = Path(__file__).parent.parent / "scenes"
OURS = [SCENES / f"{name}.usda" for name in ("glass", "textures", "curves", "shadows", "handedness")]
parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
parser.add_argument("--stages", nargs="+", type=Path, default=OURS, help="default: five of ours")
arguments = parser.parse_args()
arguments.folder.mkdir(parents=True, exist_ok=True)
logging.getLogger("warp_rt").setLevel(logging.ERROR)  # it has the warnings, too, but not of which stage

WIDTH, HEIGHT = 400, 300
cells, failed = [], 0
for stage in arguments.stages:
    try:
        image = warp_rt.render(stage, width=WIDTH, height=HEIGHT, spp=4)
    except warp_rt.WarpRtError as error:
        print(error)
        failed += 1
        continue
    warnings = [told for told in image.film.diagnostics if told.is_warning]  # the others are notes
    for told in warnings:
        print(f"{stage}: {told}")
    failed += bool(warnings)
    codes = sorted({told.code for told in image.film.diagnostics})
    caption = Caption(stage.stem, f"{len(warnings)} warnings", ", ".join(codes))
    cells.append([Cell(image.to_srgb8()[..., :3], caption)])

if cells:
    sheet = contact_sheet(f"{len(arguments.stages)} stages", f"{failed} failed", cells)
    Image.fromarray(sheet).save(arguments.folder / "contact_sheet.png")
print(f"{len(arguments.stages) - failed} of {len(arguments.stages)} stages are clean")
sys.exit(3 if failed else 0)
