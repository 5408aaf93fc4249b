# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray against a round cone: what a ball sweeps whose centre and radius change linearly. Capsules are one kind."""

import warp as wp

from .intersect_frustum import Span, intersect_frustum
from .intersect_sphere import intersect_sphere


@wp.func
def intersect_round_cone(
    origin: wp.vec3, direction: wp.vec3, p0: wp.vec3, p1: wp.vec3, radius0: float, radius1: float
) -> Span:
    """Return where a ray's line is inside the convex hull of two balls.

    That is the union of both balls and of the frustum between the circles in which its side touches them. The three
    overlap, so that no line passes through a seam.
    """
    ball0 = intersect_sphere(origin, direction, p0, radius0)
    ball1 = intersect_sphere(origin, direction, p1, radius1)
    span = Span()
    span.enter = wp.min(ball0[0], ball1[0])
    span.leave = wp.max(ball0[1], ball1[1])
    along = p1 - p0
    height2 = wp.dot(along, along)
    shrink = radius0 - radius1
    if height2 > shrink * shrink:  # else one ball holds the other
        # The side leans by the angle whose sine is shrink / height: the circles lie that much off the centres.
        offset = along * (shrink / height2)
        cosine = wp.sqrt(1.0 - shrink * shrink / height2)
        side = intersect_frustum(
            origin, direction, p0 + radius0 * offset, p1 + radius1 * offset, radius0 * cosine, radius1 * cosine
        )
        if side.enter <= side.leave:
            span.enter = wp.min(span.enter, side.enter)
            span.leave = wp.max(span.leave, side.leave)
    return span


@wp.func
def round_cone_parameter(p: wp.vec3, p0: wp.vec3, p1: wp.vec3, radius0: float, radius1: float) -> float:
    """Return u of the ball whose surface holds a point of a round cone's surface: its centre is p0 + u (p1 - p0)."""
    along = p1 - p0
    height = wp.length(along)
    if not (height > 0.0):
        return 0.0
    axis = along / height
    z = wp.dot(p - p0, axis)
    shrink = radius0 - radius1
    if height > wp.abs(shrink):
        # The normal leans, so that the centre is not at the foot of the perpendicular.
        sine = shrink / height
        z -= wp.length(p - p0 - z * axis) * sine / wp.sqrt(1.0 - sine * sine)
    elif shrink > 0.0:
        return 0.0
    else:
        return 1.0
    return wp.clamp(z / height, 0.0, 1.0)
