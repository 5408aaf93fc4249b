# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Why has a pixel its colour? Its ray tree, printed, and taken apart: which body gives how much of the light.

python examples/09_ray_tree.py [folder]
"""

import argparse
from collections import Counter
from pathlib import Path

import warp_rt
from warp_rt.scene import Camera, look_at

STAGE = Path(__file__).parent.parent / "scenes" / "mirror_teapot.usda"
parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)

tree = warp_rt.trace_tree(STAGE, 240, 70, width=320, device="cpu")
print(tree.to_text(levels=2))

shares = Counter()
for node in tree:
    body = node.place.prim if node.place else "background"
    shares[body] += sum(node.contribution) / sum(tree.value)
print("\nWhere the light of this pixel comes from:")
for body, share in shares.most_common():
    print(f"{100 * share:5.1f} %  {body}")

total = sum(sum(node.contribution) for node in tree)
print(f"All {len(tree)} nodes sum to {total:.6f}, the pixel's channels to {sum(tree.value):.6f}")

tree.save_usd(folder / "ray_tree.usda")  # the scene with the rays in it, as curves

# From the side: seen from where the eye ray starts, the rays would hide what they meet.
lens = [[340.0, 0.0, 320.0], [0.0, 340.0, 240.0], [0.0, 0.0, 1.0]]
aside = Camera.from_intrinsics(lens, 640, 480, look_at(eye=(8, -7, 6.5), target=(1.5, 0.5, 1), up=(0, 0, 1)))
picture = warp_rt.render(folder / "ray_tree.usda", camera=aside, width=640, height=480, spp=4, device="cpu")
picture.save(folder / "ray_tree.png")
