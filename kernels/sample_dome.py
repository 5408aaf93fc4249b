# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Domes: directions above a surface, in proportion to the cosine."""

import warp as wp

from .light_direction import LightDirection
from .sampling import concentric_disk
from .vector import perpendicular_frame


@wp.func
def sample_cosine(n: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction above a surface of unit normal ``n``, in proportion to the cosine.

    Reference: Malley's method: Pharr, Jakob and Humphreys (2023), Physically Based Rendering, section A.5.3.
    """
    q = concentric_disk(u)
    x, y = perpendicular_frame(n)
    cosine = wp.sqrt(wp.max(1.0 - wp.length_sq(q), 0.0))
    s = LightDirection()
    s.wi = wp.normalize(x * q[0] + y * q[1] + n * cosine)
    s.distance = wp.inf
    s.pdf = cosine / wp.pi
    return s
