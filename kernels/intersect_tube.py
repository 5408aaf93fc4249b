# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray against a cubic tube: what a ball sweeps along a Bezier curve, its radius being a cubic too.

In the frame of the ray the ball at parameter u has the centre (x, y, z) and the radius r, all cubics in u. The ray
meets it first at z - sqrt(r^2 - x^2 - y^2), wherever the root is real: where it meets the tube is the least of these
over u, a minimum in one variable. Pieces that halving makes straight give a guess in closed form, which Newton's
method improves between bounds that hold the minimum.
"""

import warp as wp

from .constants import TUBE_DEPTH, TUBE_FLATNESS, TUBE_NEAR, TUBE_STEPS
from .vector import perpendicular_frame


@wp.func
def bezier_blossom(c0: wp.vec4, c1: wp.vec4, c2: wp.vec4, c3: wp.vec4, a: float, b: float, c: float) -> wp.vec4:
    """Return the value of a cubic's polar form, which three equal parameters make the curve itself.

    Reference: Ramshaw (1987), Blossoming: A Connect-the-Dots Approach to Splines.
    """
    q0 = c0 + (c1 - c0) * a
    q1 = c1 + (c2 - c1) * a
    q2 = c2 + (c3 - c2) * a
    r0 = q0 + (q1 - q0) * b
    r1 = q1 + (q2 - q1) * b
    return r0 + (r1 - r0) * c


@wp.func
def bezier_derivative(c0: wp.vec4, c1: wp.vec4, c2: wp.vec4, c3: wp.vec4, u: float) -> wp.vec4:
    """Return the derivative of a cubic by its parameter."""
    q0 = c1 - c0
    q1 = c2 - c1
    q2 = c3 - c2
    r0 = q0 + (q1 - q0) * u
    r1 = q1 + (q2 - q1) * u
    return (r0 + (r1 - r0) * u) * 3.0


@wp.func
def bezier_second_derivative(c0: wp.vec4, c1: wp.vec4, c2: wp.vec4, c3: wp.vec4, u: float) -> wp.vec4:
    """Return the second derivative of a cubic by its parameter."""
    q0 = c2 - 2.0 * c1 + c0
    q1 = c3 - 2.0 * c2 + c1
    return (q0 + (q1 - q0) * u) * 6.0


@wp.func
def straight_minimum(start: wp.vec4, change: wp.vec4) -> float:
    """Return s in [0, 1] at which z - sqrt(r^2 - x^2 - y^2) is least for (x, y, z, r) = start + s change.

    Where the root is real nowhere, or not within [0, 1], the result is where it comes nearest to being so.
    """
    a = change[0] * change[0] + change[1] * change[1] - change[3] * change[3]
    b = start[3] * change[3] - start[0] * change[0] - start[1] * change[1]
    c = start[3] * start[3] - start[0] * start[0] - start[1] * start[1]
    # With w = b - a s, the condition is w = z' sqrt(r^2 - x^2 - y^2), so that w^2 (a + z'^2) = z'^2 (b^2 + a c).
    z = change[2]
    total = a + z * z
    d = wp.max(b * b + a * c, 0.0)
    if not (total > 0.0):  # the balls lie within one another
        return 1.0 if change[3] > 0.0 else 0.0
    w = z * wp.sqrt(d / total)
    s = float(0.0)
    if b * w > 0.0:  # b - w would lose digits
        s = (b * b - z * z * c) / (total * (b + w))
    elif a != 0.0:
        s = (b - w) / a
    if start[3] + s * change[3] < 0.0:  # of balls of negative radius, which continue the cone beyond its tip
        s = 1.0 if change[3] > 0.0 else 0.0
    return wp.clamp(s, 0.0, 1.0)


@wp.func
def tube_slope(c0: wp.vec4, c1: wp.vec4, c2: wp.vec4, c3: wp.vec4, u: float) -> wp.vec4:
    """Return h, its derivative, g and z at u, where h has the sign of the slope of z - sqrt(g), g = r^2 - x^2 - y^2.

    h is z' sqrt(g) - g' / 2; where the root is not real, -g' / 2, which is negative where g rises.
    """
    at = bezier_blossom(c0, c1, c2, c3, u, u, u)
    first = bezier_derivative(c0, c1, c2, c3, u)
    second = bezier_second_derivative(c0, c1, c2, c3, u)
    g = at[3] * at[3] - at[0] * at[0] - at[1] * at[1]
    half_g1 = at[3] * first[3] - at[0] * first[0] - at[1] * first[1]
    half_g2 = (
        first[3] * first[3]
        - first[0] * first[0]
        - first[1] * first[1]
        + at[3] * second[3]
        - at[0] * second[0]
        - at[1] * second[1]
    )
    h = -half_g1
    slope = -half_g2
    if g > 0.0:
        root = wp.sqrt(g)
        h += first[2] * root
        slope += second[2] * root + first[2] * half_g1 / root
    return wp.vec4(h, slope, g, at[2])


@wp.func
def tube_minimum(
    c0: wp.vec4,
    c1: wp.vec4,
    c2: wp.vec4,
    c3: wp.vec4,
    low: float,
    high: float,
    guess: float,
    is_start: bool,
    is_end: bool,
) -> wp.vec2:
    """Return the least z - sqrt(r^2 - x^2 - y^2) of a piece, and where it is; z = inf: the piece has none.

    Where the function falls at one joint of the pieces and rises at the next one, or is not real there, the minimum is
    between them. All pieces judge a joint alike, so that none is lost by both its neighbours, however near to a joint,
    to another one or to the rim of what the ray sees of the tube it lies. Between those bounds Newton's method goes on,
    and halving where a step would leave them.

    Args:
        c0: First control point in the frame of the ray.
        c1: Second control point.
        c2: Third control point.
        c3: Last control point.
        low: Where the piece begins.
        high: Where it ends.
        guess: Where it may be.
        is_start: Whether the tube begins here, so that the function may be least without rising before.
        is_end: Whether it ends here.
    """
    found = wp.vec2(wp.inf, guess)
    at_low = tube_slope(c0, c1, c2, c3, low)
    at_high = tube_slope(c0, c1, c2, c3, high)
    if at_low[2] >= 0.0 and at_low[0] >= 0.0:
        if is_start:
            found = wp.vec2(at_low[3] - wp.sqrt(at_low[2]), low)
        return found
    if at_high[2] >= 0.0 and at_high[0] <= 0.0:
        if is_end:
            found = wp.vec2(at_high[3] - wp.sqrt(at_high[2]), high)
        return found
    near = (high - low) * TUBE_NEAR
    is_low_real = at_low[2] >= 0.0
    is_high_real = at_high[2] >= 0.0
    u = wp.clamp(guess, low, high)
    step = int(0)
    while step < TUBE_STEPS:
        here = tube_slope(c0, c1, c2, c3, u)
        is_real = here[2] >= 0.0
        is_falling = here[0] < 0.0
        if is_real:
            z = here[3] - wp.sqrt(here[2])
            if z < found[0]:
                found = wp.vec2(z, u)
        elif is_low_real or is_high_real:
            is_falling = is_high_real
        if is_falling:
            low = u
            is_low_real = is_low_real or is_real
        else:
            high = u
            is_high_real = is_high_real or is_real
        following = 0.5 * (low + high)
        if here[1] > 0.0 and (is_real or not (is_low_real or is_high_real)):
            newton = u - here[0] / here[1]
            if newton > low and newton < high:
                following = newton
        step += 1
        if wp.abs(following - u) <= near:
            step = TUBE_STEPS
        u = following
    return found


@wp.func
def least(a: float, b: float, c: float, d: float) -> float:
    """Return the least of four numbers."""
    return wp.min(wp.min(a, b), wp.min(c, d))


@wp.func
def second_difference(a: wp.vec4, b: wp.vec4, c: wp.vec4) -> float:
    """Return the largest component of how far the middle one of three points is off the line, times two."""
    d = wp.vec4(a[0] - 2.0 * b[0] + c[0], a[1] - 2.0 * b[1] + c[1], a[2] - 2.0 * b[2] + c[2], a[3] - 2.0 * b[3] + c[3])
    return wp.max(wp.max(wp.abs(d[0]), wp.abs(d[1])), wp.max(wp.abs(d[2]), wp.abs(d[3])))


@wp.func
def intersect_tube(
    origin: wp.vec3,
    direction: wp.vec3,
    t_max: float,
    p0: wp.vec4,
    p1: wp.vec4,
    p2: wp.vec4,
    p3: wp.vec4,
    is_start: bool,
    is_end: bool,
) -> wp.vec2:
    """Return (t, u) where a ray first meets a tube from outside, in [0, t_max); t = inf: nowhere.

    Pieces whose control polygon is off a straight line by less than TUBE_FLATNESS of the radius count as straight for
    a first guess of u. The hit lies on the ball at the u found exactly, so t errs by the square of u's error only. A
    minimum that belongs to the neighbour of a piece is left to that, so that nothing is met within the tube.

    Args:
        origin: Of the ray.
        direction: Of any length but zero.
        t_max: End of the ray.
        p0: First control point, the radius in w.
        p1: Second control point.
        p2: Third control point.
        p3: Last control point.
        is_start: Whether the tube begins with the first ball, and is not a part of a longer one.
        is_end: Whether it ends with the last.

    Reference: halving as Nakamaru and Ohno (2002), Ray Tracing for Curves Primitive, WSCG. Differs by the exact
    surface of the swept ball instead of a distance from the ray's axis.
    """
    speed = wp.length(direction)
    found = wp.vec2(wp.inf, 0.0)
    radius = -least(-p0[3], -p1[3], -p2[3], -p3[3])
    if not (speed > 0.0 and radius > 0.0):
        return found
    d = direction / speed
    e0, e1 = perpendicular_frame(d)
    # In units of the radius, so that no product of four lengths leaves float32's range.
    unit = 1.0 / radius
    c0 = to_ray(p0, origin, e0, e1, d) * unit
    c1 = to_ray(p1, origin, e0, e1, d) * unit
    c2 = to_ray(p2, origin, e0, e1, d) * unit
    c3 = to_ray(p3, origin, e0, e1, d) * unit
    speed = speed * unit
    best = t_max * speed
    index = int(0)  # of the piece, among 2^level
    level = int(0)
    is_done = bool(False)
    while not is_done:
        size = 1.0 / float(1 << level)
        a = float(index) * size
        b = a + size
        q0 = bezier_blossom(c0, c1, c2, c3, a, a, a)
        q1 = bezier_blossom(c0, c1, c2, c3, a, a, b)
        q2 = bezier_blossom(c0, c1, c2, c3, a, b, b)
        q3 = bezier_blossom(c0, c1, c2, c3, b, b, b)
        is_done_here = bool(True)
        if is_box_of_balls_met(q0, q1, q2, q3, best):
            bend = wp.max(second_difference(q0, q1, q2), second_difference(q1, q2, q3))
            if bend <= TUBE_FLATNESS * -least(-q0[3], -q1[3], -q2[3], -q3[3]) or level >= TUBE_DEPTH:
                guess = a + size * straight_minimum(q0, q3 - q0)
                here = tube_minimum(c0, c1, c2, c3, a, b, guess, a == 0.0 and is_start, b == 1.0 and is_end)
                if here[0] >= 0.0 and here[0] < best:
                    best = here[0]
                    found = wp.vec2(here[0] / speed, here[1])
            else:
                is_done_here = False
        if is_done_here:
            index += 1
            while level > 0 and index % 2 == 0:
                index = index // 2
                level -= 1
            is_done = level == 0
        else:
            index = 2 * index
            level += 1
    return found


@wp.func
def to_ray(p: wp.vec4, origin: wp.vec3, e0: wp.vec3, e1: wp.vec3, d: wp.vec3) -> wp.vec4:
    """Return a control point in the frame of a ray; the radius stays."""
    q = wp.vec3(p[0], p[1], p[2]) - origin
    return wp.vec4(wp.dot(q, e0), wp.dot(q, e1), wp.dot(q, d), p[3])


@wp.func
def is_box_of_balls_met(q0: wp.vec4, q1: wp.vec4, q2: wp.vec4, q3: wp.vec4, end: float) -> bool:
    """Return whether the box around four balls, which holds the tube, has z from 0 to ``end`` on the z axis."""
    for axis in range(3):
        low = least(q0[axis] - q0[3], q1[axis] - q1[3], q2[axis] - q2[3], q3[axis] - q3[3])
        high = -least(-q0[axis] - q0[3], -q1[axis] - q1[3], -q2[axis] - q2[3], -q3[axis] - q3[3])
        if high < 0.0 or low > (end if axis == 2 else 0.0):
            return False
    return True


@wp.func
def tube_parameter(p: wp.vec3, u: float, p0: wp.vec4, p1: wp.vec4, p2: wp.vec4, p3: wp.vec4) -> float:
    """Return u of the ball whose surface holds a point of a tube's surface, from a guess: Newton's method.

    There the point's distance from the ball, as a function of u, is stationary: (p - c) . c' + r r' = 0.
    """
    result = float(u)
    for _step in range(4):
        at = bezier_blossom(p0, p1, p2, p3, result, result, result)
        first = bezier_derivative(p0, p1, p2, p3, result)
        second = bezier_second_derivative(p0, p1, p2, p3, result)
        to_point = wp.vec4(p[0] - at[0], p[1] - at[1], p[2] - at[2], at[3])
        value = wp.dot(to_point, first)
        slope = wp.dot(to_point, second) + 2.0 * first[3] * first[3] - wp.dot(first, first)
        if slope < 0.0:
            result = wp.clamp(result - value / slope, 0.0, 1.0)
    return result
