# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A kernel of one's own that traces rays: how much of the sky each point of the floor sees.

python examples/12_trace_kernel.py [folder]
"""

import argparse
from pathlib import Path

import numpy as np
import warp as wp
from PIL import Image

import warp_rt
from warp_rt.bvh.stacks import make_stacks
from warp_rt.kernels.bvh_structs import AccelData, Stacks, stack_of_thread
from warp_rt.kernels.bvh_traverse import any_hit

STAGE = Path(__file__).parent.parent / "scenes" / "mirror_teapot.usda"
parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)

# Functions are compiled with the options of the kernel that calls them; with fused products no test is watertight.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})
RAYS = wp.constant(64)  # a point


@wp.kernel
def see_sky(accels: wp.array[AccelData], origins: wp.array[wp.vec3], stacks: Stacks, share_out: wp.array[float]):
    """Add up the share of rays about +Z, denser towards it as the cosine, that meet nothing; one thread a point."""
    i = wp.tid()
    for ray in range(RAYS):
        radius = wp.sqrt((float(ray) + 0.5) / float(RAYS))
        turn = 2.399963 * float(ray)  # the golden angle
        direction = wp.vec3(radius * wp.cos(turn), radius * wp.sin(turn), wp.sqrt(1.0 - radius * radius))
        if not any_hit(accels[0], origins[i], direction, wp.inf, stack_of_thread(stacks, i)):
            share_out[i] += 1.0 / float(RAYS)


accel = warp_rt.build_accel(warp_rt.load_scene(STAGE), device="cpu")
x, y = np.meshgrid(np.linspace(-6, 6, 360), np.linspace(5, -5, 300))
points = np.stack([x, y, np.full_like(x, 1e-3)], axis=-1).reshape(-1, 3)  # a bit above the floor
origins = wp.array(np.float32(points - accel.origin), dtype=wp.vec3, device="cpu")
share = wp.zeros(len(points), dtype=float, device="cpu")
stacks = make_stacks(accel)  # on a CPU a launch is one thread after the other; on CUDA a row for each
wp.launch(see_sky, dim=len(points), inputs=[accel.table, origins, stacks, share], device="cpu")
sky = share.numpy().reshape(x.shape)
Image.fromarray((255 * sky).astype(np.uint8)).save(folder / "sky.png")
print(f"points see {sky.min():.0%} to {sky.max():.0%} of the sky, half of them {np.median(sky):.0%} or more")
