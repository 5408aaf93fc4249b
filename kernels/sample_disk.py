# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Disk lights, and the ellipses that uneven scales make of them: their area, sampled uniformly."""

import warp as wp

from .light_direction import LightDirection
from .sample_rect import area_pdf, plane_point
from .sampling import concentric_disk


@wp.func
def sample_disk(center: wp.vec3, x: wp.vec3, y: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction to a disk, or an ellipse.

    Args:
        center: As seen from the point.
        x: Conjugate half axis; so too ``y``.
        y: Conjugate half axis.
        u: Point of the unit square.
    """
    q = concentric_disk(u)
    p = center + x * q[0] + y * q[1]
    s = LightDirection()
    s.distance = wp.length(p)
    s.wi = p / s.distance
    s.pdf = area_pdf(wp.pi * wp.cross(x, y), s.wi, s.distance)
    return s


@wp.func
def meet_disk(center: wp.vec3, x: wp.vec3, y: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_disk` makes of a unit direction that comes from elsewhere."""
    s = LightDirection()
    s.wi = wi
    normal = wp.cross(x, y)
    p = plane_point(center, normal, wi)
    n2 = wp.length_sq(normal)
    a = wp.dot(wp.cross(p, y), normal) / n2
    b = wp.dot(wp.cross(x, p), normal) / n2
    distance = wp.dot(p + center, wi)
    if a * a + b * b <= 1.0 and distance > 0.0:
        s.distance = distance
        s.pdf = area_pdf(wp.pi * normal, wi, distance)
    return s
