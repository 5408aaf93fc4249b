# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Distant lights with an angle: a cone of directions, the same from everywhere."""

import warp as wp

from .light_direction import LightDirection, direction_in_cone
from .vector import perpendicular_frame


@wp.func
def sample_distant(axis: wp.vec3, cap: float, u: wp.vec2) -> LightDirection:
    """Return a direction of a cone, uniform in solid angle.

    Args:
        axis: Unit, to the middle of the light.
        cap: 1 - cos of the cone's half angle, above 0.
        u: Point of the unit square.
    """
    d = direction_in_cone(cap, u)
    x, y = perpendicular_frame(axis)
    s = LightDirection()
    s.wi = x * d[0] + y * d[1] + axis * d[2]
    s.distance = wp.inf
    s.pdf = 1.0 / (2.0 * wp.pi * cap)
    return s


@wp.func
def meet_distant(axis: wp.vec3, cap: float, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_distant` makes of a unit direction that comes from elsewhere."""
    s = LightDirection()
    s.wi = wi
    s.distance = wp.inf
    # Half the squared chord is 1 - cos, without its cancellation.
    if 0.5 * wp.length_sq(wi - axis) <= cap:
        s.pdf = 1.0 / (2.0 * wp.pi * cap)
    return s
