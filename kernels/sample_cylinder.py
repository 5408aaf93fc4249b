# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Cylinder lights, without caps, circular or not: the part of the lateral surface that faces the point."""

import warp as wp

from .light_direction import LightDirection, solve_axes


@wp.struct
class CylinderView:
    """A cylinder as a point outside sees it, in the space where its section is the unit circle."""

    toward: wp.vec2
    """Unit direction in the section, from the axis to the point."""
    sine: wp.float32
    """Of half the arc that faces the point; 0: the point is inside, where no light is."""


@wp.func
def view_cylinder(center: wp.vec3, x: wp.vec3, y: wp.vec3, z: wp.vec3) -> CylinderView:
    """Return the arc of a cylinder's section that faces the origin: acos(1 / d) either way, at d radii."""
    local = solve_axes(x, y, z, center)
    d2 = local[1] * local[1] + local[2] * local[2]
    view = CylinderView()
    if d2 > 1.0:
        view.toward = -wp.vec2(local[1], local[2]) / wp.sqrt(d2)
        view.sine = wp.sqrt(1.0 - 1.0 / d2)
    return view


@wp.func
def line_pdf(sine: float, cosine: float, tangent: wp.vec3, axis: wp.vec3, wi: wp.vec3, reach: float) -> float:
    """Return the density in solid angle of a direction to a point of one of the cylinder's lines.

    That of the line is cos / (2 sin of half the arc) in its angle, that of the point h / (angle d^2) in its place.

    Args:
        sine: Of half the arc that faces the point.
        cosine: Of the line's angle from the direction towards the point.
        tangent: Derivative of the line by its angle.
        axis: Unit, of the cylinder.
        wi: Unit direction to the point of the line.
        reach: Distance of the line by the angle that it covers.
    """
    seen = wp.abs(wp.dot(wp.cross(tangent, axis), wi))
    if seen <= 0.0:
        return 0.0
    return cosine / (2.0 * sine) * reach / seen


@wp.func
def sample_cylinder(center: wp.vec3, x: wp.vec3, y: wp.vec3, z: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction to the lateral surface of a cylinder; none from within, where no light is.

    Lines along the axis are taken in proportion to how wide they look from far away, points on a line all angles along
    it being as likely.

    Args:
        center: As seen from the point.
        x: Half the cylinder, along its axis.
        y: Conjugate half axis of its section; so too ``z``.
        z: Conjugate half axis of its section.
        u: Point of the unit square.

    Reference: Kulla and Fajardo (2012), Importance Sampling Techniques for Path Tracing in Participating Media, CGF
    31(4), section 4.1, for the line.
    """
    s = LightDirection()
    view = view_cylinder(center, x, y, z)
    if view.sine == 0.0:
        return s
    sine = (2.0 * u[1] - 1.0) * view.sine
    cosine = wp.sqrt(1.0 - sine * sine)
    on_y = view.toward[0] * cosine - view.toward[1] * sine
    on_z = view.toward[1] * cosine + view.toward[0] * sine
    half = wp.length(x)
    axis = x / half
    line = center + y * on_y + z * on_z
    middle = wp.dot(line, axis)
    across = line - axis * middle
    h = wp.max(wp.length(across), 1.0e-30)
    angle = angle_of_line(h, middle, half)
    place = h * wp.tan(wp.atan2(middle - half, h) + u[0] * angle)
    p = across + axis * wp.clamp(place, middle - half, middle + half)
    s.distance = wp.length(p)
    s.wi = p / s.distance
    s.pdf = line_pdf(view.sine, cosine, z * on_y - y * on_z, axis, s.wi, h / angle)
    return s


@wp.func
def angle_of_line(h: float, middle: float, half: float) -> float:
    """Return the angle that a line segment covers, as seen from distance ``h`` of its line; small ones in full."""
    return wp.atan2(2.0 * half * h, h * h + (middle - half) * (middle + half))


@wp.func
def meet_cylinder(center: wp.vec3, x: wp.vec3, y: wp.vec3, z: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_cylinder` makes of a unit direction that comes from elsewhere."""
    s = LightDirection()
    s.wi = wi
    view = view_cylinder(center, x, y, z)
    if view.sine == 0.0:
        return s
    # In the section, the line from the point goes along (b, c); nearest to the axis it is ``off`` from it.
    image = solve_axes(x, y, z, wi)
    local = solve_axes(x, y, z, center)
    rate = wp.sqrt(image[1] * image[1] + image[2] * image[2])
    if rate <= 0.0:
        return s
    b = image[1] / rate
    c = image[2] / rate
    along = local[1] * b + local[2] * c
    off_y = along * b - local[1]
    off_z = along * c - local[2]
    inside = 1.0 - off_y * off_y - off_z * off_z
    if along <= 0.0 or inside < 0.0:
        return s
    back = wp.sqrt(inside)
    distance = (along - back) / rate
    if wp.abs(distance * image[0] - local[0]) > 1.0:
        return s
    on_y = off_y - back * b
    on_z = off_z - back * c
    cosine = view.toward[0] * on_y + view.toward[1] * on_z
    half = wp.length(x)
    axis = x / half
    line = center + y * on_y + z * on_z
    middle = wp.dot(line, axis)
    h = wp.max(wp.length(line - axis * middle), 1.0e-30)
    s.distance = distance
    s.pdf = line_pdf(view.sine, cosine, z * on_y - y * on_z, axis, wi, h / angle_of_line(h, middle, half))
    return s
