# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sphere lights, and the ellipsoids that uneven scales make of them: the cone of directions that meet one."""

import warp as wp

from .light_direction import LightDirection, cone_cap, direction_in_cone, solve_axes
from .vector import perpendicular_frame


@wp.func
def sample_sphere(center: wp.vec3, x: wp.vec3, y: wp.vec3, z: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction to an ellipsoid, of a sphere uniform in solid angle; none from within, where no light is.

    In the space where the ellipsoid is the unit sphere its directions are a cone, sampled uniformly. A linear map M
    makes of a solid angle dw' about the unit direction w' the solid angle |det M| / |M w'|^3 dw'; of a rotation and an
    even scale, dw' itself.

    Args:
        center: Of the ellipsoid, as seen from the point.
        x: Half axis, which may lean against the others under a shear; so too y and z.
        y: Half axis.
        z: Half axis.
        u: Point of the unit square.

    Reference: Shirley, Wang and Zimmerman (1996), Monte Carlo Techniques for Direct Lighting Calculations, ACM TOG
    15(1), section 3.2.2; Pharr, Jakob and Humphreys (2023), Physically Based Rendering, section 6.2.4.
    """
    s = LightDirection()
    local = solve_axes(x, y, z, center)
    d2 = wp.length_sq(local)
    if d2 <= 1.0:
        return s
    d = wp.sqrt(d2)
    axis = local / d
    cap = cone_cap(1.0 / d2)
    w = direction_in_cone(cap, u)
    tx, ty = perpendicular_frame(axis)
    w_local = tx * w[0] + ty * w[1] + axis * w[2]
    t = d * w[2] - wp.sqrt(wp.max(1.0 - d2 * (w[0] * w[0] + w[1] * w[1]), 0.0))
    world = x * w_local[0] + y * w_local[1] + z * w_local[2]
    stretch = wp.length(world)
    s.wi = world / stretch
    s.distance = t * stretch
    s.pdf = sphere_pdf(x, y, z, cap, stretch)
    return s


@wp.func
def sphere_pdf(x: wp.vec3, y: wp.vec3, z: wp.vec3, cap: float, stretch: float) -> float:
    """Return the density of a direction that meets an ellipsoid.

    Args:
        x: Half axis, like y and z.
        y: Half axis.
        z: Half axis.
        cap: 1 - cos of the cone in the space of the unit sphere.
        stretch: Length of the world's image of the direction that has length 1 there.
    """
    size = wp.length(x)
    # Relative to the size, that its cube may be too small for a float32.
    volume = wp.abs(wp.dot(x / size, wp.cross(y / size, z / size)))
    relative = stretch / size
    return relative * relative * relative / (2.0 * wp.pi * cap * volume)


@wp.func
def meet_sphere(center: wp.vec3, x: wp.vec3, y: wp.vec3, z: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_sphere` makes of a unit direction that comes from elsewhere."""
    s = LightDirection()
    s.wi = wi
    local = solve_axes(x, y, z, center)
    d2 = wp.length_sq(local)
    if d2 <= 1.0:
        return s
    image = solve_axes(x, y, z, wi)
    shrink = wp.length(image)
    w = image / shrink
    along = wp.dot(local, w)
    off = local - w * along
    inside = 1.0 - wp.length_sq(off)
    if along <= 0.0 or inside < 0.0:
        return s
    s.distance = (along - wp.sqrt(inside)) / shrink
    s.pdf = sphere_pdf(x, y, z, cone_cap(1.0 / d2), 1.0 / shrink)
    return s
