# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Directions at a surface: reflection, refraction, Fresnel reflectance."""

import warp as wp


@wp.func
def max_component(v: wp.vec3) -> float:
    """Return the largest of three components, the scalar that Hall and Greenberg's threshold looks at."""
    return wp.max(v[0], wp.max(v[1], v[2]))


@wp.func
def max_magnitude(v: wp.vec3) -> float:
    """Return the largest of three components regardless of sign: 0 where there is no light, neither negative."""
    return wp.max(wp.abs(v[0]), wp.max(wp.abs(v[1]), wp.abs(v[2])))


@wp.func
def face_forward(normal: wp.vec3, toward: wp.vec3) -> wp.vec3:
    """Return ``normal`` or its opposite, whichever lies on the side of ``toward``."""
    if wp.dot(normal, toward) < 0.0:
        return -normal
    return normal


@wp.func
def perpendicular_frame(z: wp.vec3):
    """Return two unit vectors, x and y of a right-handed frame whose z is given, unit; x and y themselves for +z.

    Reference: Duff et al. (2017), Building an Orthonormal Basis, Revisited, JCGT 6(1).
    """
    sign = 1.0 if z[2] >= 0.0 else -1.0
    a = -1.0 / (sign + z[2])
    b = z[0] * z[1] * a
    return wp.vec3(1.0 + sign * z[0] * z[0] * a, sign * b, -sign * z[0]), wp.vec3(b, sign + z[1] * z[1] * a, -z[1])


@wp.func
def reflect(direction: wp.vec3, normal: wp.vec3) -> wp.vec3:
    """Return the mirror direction of unit ``direction``, travelling towards the surface, about unit ``normal``.

    Reference: Whitted (1980), An Improved Illumination Model for Shaded Display, CACM 23(6), section 2.
    """
    return direction - normal * (2.0 * wp.dot(direction, normal))


@wp.func
def refraction_discriminant(cos_in: float, eta: float) -> float:
    """Return the squared cosine of the refracted angle, by Snell's law; negative: total internal reflection.

    Args:
        cos_in: Cosine between the normal and the way back along the incoming ray.
        eta: n_incoming / n_outgoing.
    """
    return 1.0 - eta * eta * (1.0 - cos_in * cos_in)


@wp.func
def refract(direction: wp.vec3, normal: wp.vec3, eta: float) -> wp.vec3:
    """Return the unit direction that unit ``direction`` takes behind the surface; the zero vector if it cannot.

    Args:
        direction: Unit, travelling towards the surface.
        normal: Unit, on the side that the ray comes from.
        eta: n_incoming / n_outgoing.

    Reference: Heckbert (1989), Derivation of Refraction Formulas, in Glassner, An Introduction to Ray Tracing.
    """
    cos_in = -wp.dot(direction, normal)
    cos2_out = refraction_discriminant(cos_in, eta)
    if cos2_out < 0.0:
        return wp.vec3(0.0, 0.0, 0.0)
    return wp.normalize(eta * direction + (eta * cos_in - wp.sqrt(cos2_out)) * normal)


@wp.func
def fresnel_schlick(f0: wp.vec3, f90: wp.vec3, cos_in: float) -> wp.vec3:
    """Return the reflectance between ``f0`` (head on) and ``f90`` (grazing).

    Reference: Schlick (1994), An Inexpensive BRDF Model for Physically-Based Rendering, equation 15.
    """
    c = wp.clamp(1.0 - cos_in, 0.0, 1.0)
    c2 = c * c
    return f0 + (f90 - f0) * (c2 * c2 * c)


@wp.func
def relative(point: wp.vec3, base: wp.vec3d) -> wp.vec3:
    """Return where a point is seen from another one: their difference in float64, rounded."""
    return wp.vec3(
        float(wp.float64(point[0]) - base[0]),
        float(wp.float64(point[1]) - base[1]),
        float(wp.float64(point[2]) - base[2]),
    )
