# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The functions that the kernels are made of, called from Python one by one, and then from a kernel of one's own.

python examples/06_kernels.py [folder]
"""

import argparse
import math
from pathlib import Path

import numpy as np
import warp as wp
from PIL import Image, ImageDraw

from warp_rt.kernels.vector import reflect, refract, refraction_discriminant
from warp_rt.warp_setup import init_warp

parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)

init_warp()

# Snell's law: 45 degrees in air are 28.1 degrees in glass.
incoming = wp.normalize(wp.vec3(1.0, 0.0, -1.0))
normal = wp.vec3(0.0, 0.0, 1.0)
inside = refract(incoming, normal, 1.0 / 1.5)
print(f"refracted to {math.degrees(math.asin(inside[0])):.2f} degrees, mirrored to {reflect(incoming, normal)}")

# Leaving the glass at 45 degrees there is no such angle: total internal reflection.
print(f"leaving: discriminant {refraction_discriminant(math.cos(math.radians(45.0)), 1.5):.3f} is negative")


@wp.kernel(enable_backward=False)
def bounce(directions: wp.array[wp.vec3], normal: wp.vec3, reflected_out: wp.array[wp.vec3]):
    """Mirror each direction at a plane; one thread a direction."""
    i = wp.tid()
    reflected_out[i] = reflect(directions[i], normal)


rays = wp.array(np.float32([[1, 0, -1], [0, 2, -1], [3, 3, -3]]), dtype=wp.vec3, device="cpu")
mirrored = wp.empty_like(rays)
wp.launch(bounce, dim=len(rays), inputs=[rays, normal, mirrored], device="cpu")
print(mirrored.numpy())

# A fan of rays that enter glass from above.
picture = Image.new("RGB", (400, 300), "white")
draw = ImageDraw.Draw(picture)
draw.rectangle((0, 150, 400, 300), fill="#cfe3f2")
for degrees in range(0, 90, 15):
    way = wp.vec3(math.sin(math.radians(degrees)), 0.0, -math.cos(math.radians(degrees)))
    inside = refract(way, normal, 1.0 / 1.5)
    draw.line((200 - 140 * way[0], 150 + 140 * way[2], 200, 150), fill="#c75b12", width=2)
    draw.line((200, 150, 200 + 140 * inside[0], 150 - 140 * inside[2]), fill="#1f5fa8", width=2)
picture.save(folder / "refraction.png")
