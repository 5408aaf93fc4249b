# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What sampling a light is about: a direction, and how likely it was."""

import warp as wp

from .constants import LEAST_DIVISOR
from .sampling import concentric_disk


@wp.struct
class LightDirection:
    """A direction from a surface point in which a light is seen."""

    wi: wp.vec3
    """Unit, towards the light."""
    distance: wp.float32
    """To where the light is met; infinite for light from infinity."""
    pdf: wp.float32
    """Density with which sampling the light gives this direction [1/sr]; 0: the light is not seen in it."""


@wp.func
def cone_cap(sine2: float) -> float:
    """Return 1 - cos of an angle up to 90 degrees whose squared sine is given; small angles lose no digit."""
    return sine2 / (1.0 + wp.sqrt(wp.max(1.0 - sine2, 0.0)))


@wp.func
def direction_in_cone(cap: float, u: wp.vec2) -> wp.vec3:
    """Return a unit direction of the cone about +z, uniform in solid angle; what is near in the square stays near.

    Args:
        cap: 1 - cos of the cone's half angle, up to 2.
        u: Point of the unit square.
    """
    p = concentric_disk(u)
    height = wp.length_sq(p) * cap  # 1 - cos: its sine keeps all digits in the narrowest cone
    side = wp.sqrt(cap * (2.0 - height))
    return wp.vec3(p[0] * side, p[1] * side, 1.0 - height)


@wp.func
def solve_axes(x: wp.vec3, y: wp.vec3, z: wp.vec3, v: wp.vec3) -> wp.vec3:
    """Return (a, b, c) of v = a x + b y + c z, for axes that span space: Cramer's rule."""
    yz = wp.cross(y, z)
    return wp.vec3(wp.dot(yz, v), wp.dot(wp.cross(z, x), v), wp.dot(wp.cross(x, y), v)) / wp.dot(x, yz)


@wp.func
def half_angle(size2: float, distance2: float) -> float:
    """Return half the angle that a ball covers, 90 degrees from within.

    Args:
        size2: Its squared radius.
        distance2: Squared distance of its centre.
    """
    return wp.asin(wp.sqrt(wp.min(size2 / wp.max(distance2, LEAST_DIVISOR), 1.0)))
