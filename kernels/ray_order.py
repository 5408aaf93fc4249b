# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Codes by which rays that come in no order are sorted, so that successive ones start near each other."""

import warp as wp

from .constants import MORTON_BITS, RAY_CODE_BITS
from .morton import morton_code

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def code_rays(
    origins: wp.array[wp.vec3],
    low: wp.vec3,
    scale: float,
    first: int,
    codes_out: wp.array[int],
    rays_out: wp.array[int],
):
    """Write the Morton codes of rays' origins, from ray ``first`` on, and the rays' numbers beside them.

    Args:
        origins: Of all rays.
        low: Corner of the cube in which the codes are told apart; those outside of it have the nearest cell's.
        scale: One over its side.
        first: Ray of the first thread.
        codes_out: Codes of RAY_CODE_BITS a coordinate; 0 where the origin is not finite.
        rays_out: Numbers.
    """
    i = first + wp.tid()
    code = int(0)
    place = (origins[i] - low) * scale
    if wp.isfinite(place[0] + place[1] + place[2]):
        code = int(morton_code(place) >> wp.uint64(3 * (MORTON_BITS - RAY_CODE_BITS)))
    codes_out[i] = code
    rays_out[i] = i
