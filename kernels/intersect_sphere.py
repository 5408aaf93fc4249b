# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray against a sphere: both distances, and the test of a bounding sphere."""

import warp as wp


@wp.func
def intersect_sphere(origin: wp.vec3, direction: wp.vec3, center: wp.vec3, radius: float) -> wp.vec2:
    """Return where a ray's line enters and leaves a sphere, in units of the direction's length; (inf, -inf): a miss.

    Distances behind the origin are negative: a caller takes the first one that is not.

    Reference: Haines, Guenther and Akenine-Moeller (2019), Precision Improvements for Ray/Sphere Intersection, Ray
    Tracing Gems, chapter 7: the discriminant from the line's distance to the centre, so that a small sphere far away
    keeps its digits, and no difference of nearly equal roots.
    """
    to_origin = origin - center
    speed = wp.length(direction)
    if not (speed > 0.0):
        return wp.vec2(wp.inf, -wp.inf)
    # By the unit direction, so that no product of four lengths leaves float32's range.
    d = direction / speed
    b = -wp.dot(to_origin, d)
    foot = to_origin + b * d
    discriminant = radius * radius - wp.dot(foot, foot)
    if not (discriminant >= 0.0):
        return wp.vec2(wp.inf, -wp.inf)
    c = wp.dot(to_origin, to_origin) - radius * radius
    q = b + (-1.0 if b < 0.0 else 1.0) * wp.sqrt(discriminant)
    if q == 0.0:
        return wp.vec2(0.0, 0.0)
    t0 = c / q / speed
    t1 = q / speed
    return wp.vec2(wp.min(t0, t1), wp.max(t0, t1))


@wp.func
def is_sphere_met(origin: wp.vec3, direction: wp.vec3, t_max: float, center: wp.vec3, radius: float) -> bool:
    """Return whether a ray meets a bounding sphere's ball anywhere in [0, t_max]."""
    t = intersect_sphere(origin, direction, center, radius)
    return t[0] <= t[1] and t[1] >= 0.0 and t[0] <= t_max
