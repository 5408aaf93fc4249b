# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rect lights: a rectangle's solid angle sampled uniformly, its area where that would lose digits."""

import warp as wp

from .constants import LEAST_DIVISOR, RIGHT_ANGLE, SOLID_ANGLE_MIN
from .light_direction import LightDirection


@wp.struct
class SphericalRect:
    """A rectangle seen from a point, in a frame along its sides."""

    x: wp.vec3
    """Unit, along one side; so too ``y``."""
    y: wp.vec3
    z: wp.vec3
    """Unit, out of its plane, away from the light's plane on the point's side."""
    x0: wp.float32
    """Coordinates of its sides, the point being the origin."""
    x1: wp.float32
    y0: wp.float32
    y1: wp.float32
    z0: wp.float32
    """Of its plane, not positive."""
    b0: wp.float32
    """z of the unit normals of the planes through the point and the side y0, and y1."""
    b1: wp.float32
    k: wp.float32
    """2 pi less the angles at the corners of the side x0."""
    solid_angle: wp.float32
    """0 where its area is to be sampled."""


@wp.func
def safe_asin(x: float) -> float:
    """Return the arcsine of what rounding may have moved out of [-1, 1]."""
    return wp.asin(wp.clamp(x, -1.0, 1.0))


@wp.func
def spherical_rect(center: wp.vec3, half_x: wp.vec3, half_y: wp.vec3) -> SphericalRect:
    """Return a rectangle as its solid angle is sampled; what is no rectangle, or looks small, has none.

    Args:
        center: As seen from the point.
        half_x: From the centre to the middle of one side.
        half_y: From the centre to the middle of the next.

    Reference: Urena, Fajardo and King (2013), An Area-Preserving Parametrization for Spherical Rectangles, CGF 32(4),
    section 4. The angle between two of its planes is pi / 2 + asin(b b'), which loses fewer digits than an arccosine.
    """
    r = SphericalRect()
    w = wp.length(half_x)
    h = wp.length(half_y)
    if wp.abs(wp.dot(half_x, half_y)) > RIGHT_ANGLE * w * h:
        return r
    r.x = half_x / w
    r.y = half_y / h
    r.z = wp.cross(r.x, r.y)
    z0 = wp.dot(center, r.z)
    if z0 > 0.0:
        r.z = -r.z
        z0 = -z0
    x = wp.dot(center, r.x)
    y = wp.dot(center, r.y)
    r.x0 = x - w
    r.x1 = x + w
    r.y0 = y - h
    r.y1 = y + h
    r.z0 = z0
    r.b0 = -r.y0 / wp.max(wp.sqrt(z0 * z0 + r.y0 * r.y0), LEAST_DIVISOR)
    r.b1 = r.y1 / wp.max(wp.sqrt(z0 * z0 + r.y1 * r.y1), LEAST_DIVISOR)
    a0 = -r.x0 / wp.max(wp.sqrt(z0 * z0 + r.x0 * r.x0), LEAST_DIVISOR)
    a1 = r.x1 / wp.max(wp.sqrt(z0 * z0 + r.x1 * r.x1), LEAST_DIVISOR)
    beyond = safe_asin(r.b1 * a0) + safe_asin(a0 * r.b0)
    r.k = wp.pi - beyond
    solid_angle = safe_asin(r.b0 * a1) + safe_asin(a1 * r.b1) + beyond
    if solid_angle >= SOLID_ANGLE_MIN:
        r.solid_angle = solid_angle
    return r


@wp.func
def sample_rect(center: wp.vec3, half_x: wp.vec3, half_y: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction to a rectangle, or to a parallelogram, from a point in front of it.

    Args:
        center: As seen from the point.
        half_x: From the centre to the middle of one side.
        half_y: From the centre to the middle of the next.
        u: Point of the unit square.

    Reference: Urena, Fajardo and King (2013), section 4.
    """
    r = spherical_rect(center, half_x, half_y)
    s = LightDirection()
    if r.solid_angle == 0.0:
        p = center + half_x * (2.0 * u[0] - 1.0) + half_y * (2.0 * u[1] - 1.0)
        s.distance = wp.length(p)
        s.wi = p / s.distance
        s.pdf = area_pdf(4.0 * wp.cross(half_x, half_y), s.wi, s.distance)
        return s
    angle = u[0] * r.solid_angle + r.k
    f = (wp.cos(angle) * r.b0 - r.b1) / wp.sin(angle)
    c = wp.clamp(1.0 / wp.sqrt(f * f + r.b0 * r.b0), 0.0, 1.0)
    if f < 0.0:
        c = -c
    x = wp.clamp(-c * r.z0 / wp.max(wp.sqrt(1.0 - c * c), LEAST_DIVISOR), r.x0, r.x1)
    d = wp.sqrt(x * x + r.z0 * r.z0)
    h0 = r.y0 / wp.sqrt(d * d + r.y0 * r.y0)
    h1 = r.y1 / wp.sqrt(d * d + r.y1 * r.y1)
    h = h0 + u[1] * (h1 - h0)
    y = wp.clamp(h * d / wp.max(wp.sqrt(1.0 - h * h), LEAST_DIVISOR), r.y0, r.y1)
    p = r.x * x + r.y * y + r.z * r.z0
    s.distance = wp.length(p)
    s.wi = p / s.distance
    s.pdf = 1.0 / r.solid_angle
    return s


@wp.func
def area_pdf(area: wp.vec3, wi: wp.vec3, distance: float) -> float:
    """Return the density in solid angle of a point taken uniformly from a flat shape; 0 where that is seen edge-on.

    Args:
        area: Normal of the shape, either side, its length being the area.
        wi: Unit direction to the point.
        distance: To the point.
    """
    seen = wp.abs(wp.dot(area, wi))
    if seen <= 0.0:
        return 0.0
    return distance * distance / seen


@wp.func
def meet_rect(center: wp.vec3, half_x: wp.vec3, half_y: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_rect` makes of a unit direction that comes from elsewhere."""
    s = LightDirection()
    s.wi = wi
    normal = wp.cross(half_x, half_y)
    p = plane_point(center, normal, wi)
    if wp.max(wp.abs(wp.dot(wp.cross(p, half_y), normal)), wp.abs(wp.dot(wp.cross(half_x, p), normal))) > wp.length_sq(
        normal
    ):
        return s
    distance = wp.dot(p + center, wi)
    if distance <= 0.0:
        return s
    s.distance = distance
    r = spherical_rect(center, half_x, half_y)
    s.pdf = 1.0 / r.solid_angle if r.solid_angle > 0.0 else area_pdf(4.0 * normal, wi, distance)
    return s


@wp.func
def plane_point(center: wp.vec3, normal: wp.vec3, wi: wp.vec3) -> wp.vec3:
    """Return where the line along ``wi`` meets the plane through a centre, from the centre; far off if it does not."""
    slope = wp.dot(normal, wi)
    if wp.abs(slope) < LEAST_DIVISOR:
        return wi * 1.0e18
    return wi * (wp.dot(normal, center) / slope) - center
