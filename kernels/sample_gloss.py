# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Directions of a GGX lobe, by the normals of its facets that the viewer sees."""

import warp as wp

from .constants import LEAST_SINE
from .vector import perpendicular_frame


@wp.func
def sample_ggx(n: wp.vec3, wo: wp.vec3, alpha: float, u: wp.vec2) -> wp.vec3:
    """Return a unit direction in which GGX facets mirror the viewer; below the surface it counts for nothing.

    Args:
        n: Unit normal on the viewer's side.
        wo: Unit, towards the viewer.
        alpha: Width of the lobe.
        u: Point of the unit square.

    Reference: Heitz (2018), Sampling the GGX Distribution of Visible Normals, JCGT 7(4), section 3.
    """
    x, y = perpendicular_frame(n)
    v = wp.normalize(wp.vec3(alpha * wp.dot(wo, x), alpha * wp.dot(wo, y), wp.dot(wo, n)))
    tx, ty = perpendicular_frame(v)
    r = wp.sqrt(u[0])
    turn = 2.0 * wp.pi * u[1]
    a = r * wp.cos(turn)
    s = 0.5 * (1.0 + v[2])
    # The half disk that the hemisphere's lower part would cover is squeezed onto its rim, along the second axis.
    toward = wp.vec3(-v[2] * v[0], -v[2] * v[1], 1.0 - v[2] * v[2])
    if wp.length_sq(toward) > LEAST_SINE:
        ty = wp.normalize(toward)
        tx = wp.cross(ty, v)
    b = (1.0 - s) * wp.sqrt(wp.max(1.0 - a * a, 0.0)) + s * r * wp.sin(turn)
    m = tx * a + ty * b + v * wp.sqrt(wp.max(1.0 - a * a - b * b, 0.0))
    h = wp.normalize(x * (alpha * m[0]) + y * (alpha * m[1]) + n * wp.max(m[2], 0.0))
    return wp.normalize(2.0 * wp.dot(wo, h) * h - wo)


@wp.func
def ggx_distribution(n: wp.vec3, h: wp.vec3, alpha: float) -> float:
    """Return the GGX density of facet normals, per solid angle of the normal and area of the surface.

    Reference: Walter et al. (2007), Microfacet Models for Refraction through Rough Surfaces, equation 33.
    """
    n_h = wp.dot(n, h)
    a2 = alpha * alpha
    # 1 - n_h^2 from the cross product: the subtraction would lose every digit of a narrow lobe.
    q = a2 * n_h * n_h + wp.length_sq(wp.cross(n, h))
    return a2 / (wp.pi * q * q)


@wp.func
def ggx_pdf(n: wp.vec3, wo: wp.vec3, alpha: float, wi: wp.vec3) -> float:
    """Return the density with which :func:`sample_ggx` gives a unit direction [1/sr]: G1(wo) D(h) / (4 N.V).

    Reference: Heitz (2018), equations 3 and 17.
    """
    h = wp.normalize(wo + wi)
    n_wo = wp.dot(n, wo)
    if wp.dot(n, h) <= 0.0 or n_wo <= 0.0:
        return 0.0
    a2 = alpha * alpha
    # G1 / N.V, with 1 - (N.V)^2 for the squared sine.
    g1_by_cosine = 2.0 / (n_wo + wp.sqrt(a2 + (1.0 - a2) * n_wo * n_wo))
    return 0.25 * g1_by_cosine * ggx_distribution(n, h, alpha)
