# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The functions that the kernels are made of, called from Python one by one, and then from a kernel of one's own.

python examples/06_kernels.py
"""

import math

import numpy as np
import warp as wp

from warp_rt.kernels.vector import reflect, refract, refraction_discriminant
from warp_rt.warp_setup import init_warp

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
