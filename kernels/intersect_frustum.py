# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray against a truncated cone, the convex solid between two circles about a common axis: where it enters and leaves.

Cylinders (equal radii) and cones (one radius 0) are special cases that need no code of their own.
"""

import warp as wp

SIDE = wp.constant(0)
FIRST_CAP = wp.constant(1)
LAST_CAP = wp.constant(2)


@wp.struct
class Span:
    """The part of a ray's line that lies inside a convex solid."""

    enter: float
    """In units of the direction's length; a miss has ``enter`` > ``leave``."""
    leave: float
    enter_part: int
    """Of a frustum, through what: SIDE, FIRST_CAP or LAST_CAP."""
    leave_part: int


@wp.func
def empty_span() -> Span:
    """Return the span of a line that misses."""
    span = Span()
    span.enter = wp.inf
    span.leave = -wp.inf
    return span


@wp.func
def has_part(part: int, caps: int) -> bool:
    """Return whether a frustum has a part: its side always, the caps as bits 0 and 1 of ``caps`` say."""
    return ((2 * caps + 1) >> part) & 1 == 1


@wp.func
def cone_span(a: float, b: float, c: float, growth: float) -> wp.vec2:
    """Return where a s^2 + 2 b s + c <= 0, the inside of an infinite cone, as an interval; (inf, -inf): nowhere.

    Args:
        a: Quadratic coefficient; not positive where the line runs more steeply than the cone's side.
        b: Half the linear coefficient.
        c: Constant coefficient.
        growth: Change of the cone's radius along the line. Steep lines are inside both halves of the double cone; the
            one where the radius is positive is meant.

    No root is a difference of nearly equal numbers: each comes from q / a or c / q, whichever is.
    """
    miss = wp.vec2(wp.inf, -wp.inf)
    discriminant = b * b - a * c
    if a > 0.0:
        if not (discriminant >= 0.0):
            return miss
        q = -(b + (-1.0 if b < 0.0 else 1.0) * wp.sqrt(discriminant))
        if q == 0.0:
            return wp.vec2(0.0, 0.0)
        return wp.vec2(wp.min(q / a, c / q), wp.max(q / a, c / q))
    if growth == 0.0:  # along the axis of a cylinder
        if c <= 0.0:
            return wp.vec2(-wp.inf, wp.inf)
        return miss
    # One root on each half: the line enters the one that widens along it, and leaves the one that narrows.
    direction = 1.0 if growth > 0.0 else -1.0
    root = wp.sqrt(wp.max(discriminant, 0.0))
    toward = -b * direction
    end = float(0.0)
    if toward > 0.0:
        end = c / (toward + root) * direction
    elif a < 0.0:
        end = (toward - root) / a * direction
    if growth > 0.0:
        return wp.vec2(end, wp.inf)
    return wp.vec2(-wp.inf, end)


@wp.func
def intersect_frustum(
    origin: wp.vec3, direction: wp.vec3, p0: wp.vec3, p1: wp.vec3, radius0: float, radius1: float
) -> Span:
    """Return where a ray's line is inside the solid that two disks and the cone between them bound.

    The span of the cone is cut with that between the disks' planes, so that no line passes where side and cap meet.
    All is computed relative to the line's point next to the solid's centre, then next to its axis: a small solid far
    away keeps its digits, and so does a long, thin one.

    Reference: Haines, Guenther and Akenine-Moeller (2019), Precision Improvements for Ray/Sphere Intersection, Ray
    Tracing Gems, chapter 7, whose first step this applies to cones.
    """
    along = p1 - p0
    height = wp.length(along)
    speed = wp.length(direction)
    if not (height > 0.0 and speed > 0.0):
        return empty_span()
    axis = along / height
    d = direction / speed
    # Near the centre: m is the line's nearest point to it, relative to it.
    to_center = (p0 - origin) + 0.5 * along
    s_center = wp.dot(to_center, d)
    m = s_center * d - to_center
    radius = wp.max(radius0, radius1)
    reach = wp.sqrt(0.25 * height * height + radius * radius)
    if not (wp.length(m) <= reach * 1.0001):
        return empty_span()
    # Near the axis, but not beyond the solid.
    dz = wp.dot(d, axis)
    across = d - dz * axis
    mz = wp.dot(m, axis)
    q = m - mz * axis
    across2 = wp.dot(across, across)
    s_axis = float(0.0)
    if across2 > 0.0:
        s_axis = wp.clamp(-wp.dot(q, across) / across2, -reach, reach)
    q = q + s_axis * across
    z = mz + 0.5 * height + s_axis * dz

    slope = (radius1 - radius0) / height
    radius_here = radius0 + slope * z
    growth = slope * dz
    side = cone_span(
        across2 - growth * growth,
        wp.dot(q, across) - radius_here * growth,
        wp.dot(q, q) - radius_here * radius_here,
        growth,
    )
    low = float(-wp.inf)
    high = float(wp.inf)
    if dz != 0.0:
        low = wp.min(-z / dz, (height - z) / dz)
        high = wp.max(-z / dz, (height - z) / dz)
    elif not (z >= 0.0 and z <= height):
        return empty_span()
    enter = wp.max(side[0], low)
    leave = wp.min(side[1], high)
    if not (enter <= leave):  # which distances from afar no longer tell
        return empty_span()
    near_cap = FIRST_CAP if dz > 0.0 else LAST_CAP
    span = Span()
    base = s_center + s_axis
    span.enter = (base + enter) / speed
    span.leave = (base + leave) / speed
    span.enter_part = near_cap if low > side[0] else SIDE
    span.leave_part = FIRST_CAP + LAST_CAP - near_cap if high < side[1] else SIDE
    return span
