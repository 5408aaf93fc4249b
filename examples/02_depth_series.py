# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lecture's series of pictures: the ray tree cut at depth 1 to 7, what each depth adds, and a contact sheet.

python examples/02_depth_series.py [folder]
"""

import argparse
from pathlib import Path

import warp_rt

STAGE = Path(__file__).parent.parent / "scenes" / "mirror_teapot.usda"
parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)

series = warp_rt.render_series(STAGE, range(1, 8), width=320, threshold=0.0)
series.save(folder)
for step in series.steps:
    changed = f"{step.change.share:6.1%} of the pixels change" if step.change else "the first picture"
    print(f"depth {step.depth}: {step.rays.total:7} rays, {changed}")
