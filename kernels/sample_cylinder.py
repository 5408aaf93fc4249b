# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Cylinder lights, without caps, circular or not: the part of the lateral surface that faces the point."""

import warp as wp

from .constants import LEAST_DIVISOR, LEAST_SINE
from .light_direction import LightDirection, solve_axes


@wp.struct
class CylinderView:
    """A cylinder as a point outside sees it: angles about its axis, and along it."""

    axis: wp.vec3
    """Unit."""
    y: wp.vec3
    """Conjugate half axis of the section that is square to the axis; so too ``z``."""
    z: wp.vec3
    half: wp.float32
    """Half its length."""
    middle: wp.float32
    """Where its middle is along the axis, but for ``lean``."""
    lean: wp.vec2
    """By how much a line's middle moves along the axis with its place in the section: 0 but under a shear."""
    center: wp.vec2
    """Its axis, in the space where the section is a unit circle and the point is the origin."""
    first: wp.vec3
    """Unit direction, square to the axis, of the first line that is seen; ``side`` is square to both."""
    side: wp.vec3
    turn: wp.float32
    """Angle from the first line to the last [rad]; 0: the point is inside, where no light is."""


@wp.func
def view_cylinder(center: wp.vec3, x: wp.vec3, y: wp.vec3, z: wp.vec3) -> CylinderView:
    """Return a cylinder as the origin sees it.

    Args:
        center: As seen from the point.
        x: Half the cylinder, along its axis.
        y: Conjugate half axis of its section; so too ``z``.
        z: Conjugate half axis of its section.
    """
    view = CylinderView()
    local = solve_axes(x, y, z, center)
    d2 = local[1] * local[1] + local[2] * local[2]
    if d2 <= 1.0:
        return view
    view.half = wp.length(x)
    view.axis = x / view.half
    view.lean = wp.vec2(wp.dot(y, view.axis), wp.dot(z, view.axis))
    view.y = y - view.axis * view.lean[0]
    view.z = z - view.axis * view.lean[1]
    view.middle = local[0] * view.half
    view.center = wp.vec2(local[1], local[2])
    # The tangents of the circle: at a sine of 1 / d to its middle.
    sine2 = 1.0 / d2
    cosine = wp.sqrt(1.0 - sine2)
    forth = view.y * local[1] + view.z * local[2]
    across = view.z * local[1] - view.y * local[2]
    sine = wp.sqrt(sine2)
    first = forth * cosine - across * sine
    last = forth * cosine + across * sine
    normal = wp.cross(forth, across)
    # |first x last|, which keeps its digits from afar.
    area = 2.0 * sine * cosine * wp.length(normal)
    view.turn = wp.atan2(area, wp.dot(first, last))
    view.first = wp.normalize(first)
    view.side = wp.cross(view.axis, view.first) * wp.sign(wp.dot(normal, view.axis))
    return view


@wp.struct
class CylinderLine:
    """One of a cylinder's lines along its axis, and the density with which its points are sampled."""

    h: wp.float32
    """Its distance."""
    middle: wp.float32
    """Where its middle is along the axis."""
    low: wp.float32
    """Sine of the angle from square to the axis at which it begins."""
    sines: wp.float32
    """By how much that at which it ends is more; small ones in full digits."""
    pdf: wp.float32
    """Density of a direction to one of its points [1/sr]."""
    is_met: wp.int32
    """0: the direction passes all lines."""


@wp.func
def line_of_cylinder(view: wp.ref[CylinderView], v: wp.vec3) -> CylinderLine:
    """Return the line that is seen in a unit direction square to the axis, or that which passes it.

    A solid angle is the product of the angle about an axis and the sine along it.
    """
    line = CylinderLine()
    area = wp.dot(wp.cross(view.y, view.z), view.axis)
    w = wp.vec2(wp.dot(wp.cross(v, view.z), view.axis), wp.dot(wp.cross(view.y, v), view.axis)) / area
    rate = wp.length(w)
    w = w / rate
    along = wp.dot(view.center, w)
    off = view.center - w * along
    inside = 1.0 - wp.dot(off, off)
    line.is_met = 1 if along > 0.0 and inside >= 0.0 else 0
    reach = along - wp.sqrt(wp.max(inside, 0.0))
    line.h = wp.max(reach / rate, LEAST_DIVISOR)
    line.middle = view.middle + wp.dot(view.lean, w) * reach
    begin = line.middle - view.half
    end = line.middle + view.half
    h2 = line.h * line.h
    to_begin = wp.sqrt(h2 + begin * begin)
    to_end = wp.sqrt(h2 + end * end)
    line.low = begin / to_begin
    line.sines = end / to_end - line.low
    if begin * end > 0.0:
        line.sines = 4.0 * view.half * line.middle * h2 / ((end * to_begin + begin * to_end) * to_begin * to_end)
    line.pdf = 1.0 / (view.turn * line.sines)
    return line


@wp.func
def sample_cylinder(center: wp.vec3, x: wp.vec3, y: wp.vec3, z: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction to the lateral surface of a cylinder; none from within, where no light is.

    Lines along the axis are taken in proportion to how wide they look, by the angle about it; points on a line in
    proportion to the solid angle that they cover, by the sine of the angle along it. So the density is uniform in solid
    angle but for how long the lines look.

    Args:
        center: As seen from the point.
        x: Half the cylinder, along its axis.
        y: Conjugate half axis of its section; so too ``z``.
        z: Conjugate half axis of its section.
        u: Point of the unit square.
    """
    s = LightDirection()
    view = view_cylinder(center, x, y, z)
    if view.turn == 0.0:
        return s
    turn = u[1] * view.turn
    v = view.first * wp.cos(turn) + view.side * wp.sin(turn)
    line = line_of_cylinder(view, v)
    sine = line.low + u[0] * line.sines
    place = line.h * sine / wp.sqrt(wp.max(1.0 - sine * sine, LEAST_SINE))
    p = v * line.h + view.axis * wp.clamp(place, line.middle - view.half, line.middle + view.half)
    s.distance = wp.length(p)
    s.wi = p / s.distance
    s.pdf = line.pdf
    return s


@wp.func
def meet_cylinder(center: wp.vec3, x: wp.vec3, y: wp.vec3, z: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_cylinder` makes of a unit direction that comes from elsewhere."""
    s = LightDirection()
    s.wi = wi
    view = view_cylinder(center, x, y, z)
    if view.turn == 0.0:
        return s
    along = wp.dot(wi, view.axis)
    square = wi - view.axis * along
    rate = wp.length(square)
    if rate <= 0.0:
        return s
    line = line_of_cylinder(view, square / rate)
    if line.is_met == 0 or wp.abs(line.h * along / rate - line.middle) > view.half:
        return s
    s.distance = line.h / rate
    s.pdf = line.pdf
    return s
