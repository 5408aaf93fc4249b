# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Reflection models: what share of the light from one direction a surface sends into another."""

import warp as wp

from .sample_gloss import ggx_distribution
from .vector import fresnel_schlick


@wp.func
def phong(diffuse: wp.vec3, specular: wp.vec3, exponent: float, n: wp.vec3, wo: wp.vec3, wi: wp.vec3) -> wp.vec3:
    """Return the lecture's local Phong term, kd (N.L) + ks max(R.V, 0)^n with R = 2 (N.L) N - L.

    Reference: Phong (1975), Illumination for Computer Generated Pictures, CACM 18(6).
    """
    n_wi = wp.dot(n, wi)
    r_wo = wp.max(wp.dot(2.0 * n_wi * n - wi, wo), 0.0)
    highlight = float(0.0)
    if r_wo > 0.0:
        highlight = wp.pow(r_wo, exponent)
    return diffuse * n_wi + specular * highlight


@wp.func
def ggx_specular(f0: wp.vec3, f90: wp.vec3, alpha: float, n: wp.vec3, wo: wp.vec3, wi: wp.vec3) -> wp.vec3:
    """Return the Cook-Torrance BRDF with the GGX distribution, Schlick's Fresnel and Smith's shadowing (k = alpha / 2).

    Reference: Walter et al. (2007), Microfacet Models for Refraction through Rough Surfaces, equation 33; Karis (2013),
    Real Shading in Unreal Engine 4; UsdPreviewSurface Specification 2.6.
    """
    n_wi = wp.dot(n, wi)
    n_wo = wp.abs(wp.dot(n, wo)) + 1.0e-6
    h = wp.normalize(wo + wi)
    d = ggx_distribution(n, h, alpha)
    k = 0.5 * alpha
    g = (n_wi / (n_wi * (1.0 - k) + k)) * (n_wo / (n_wo * (1.0 - k) + k))
    return fresnel_schlick(f0, f90, wp.dot(wo, h)) * (d * g / (4.0 * n_wi * n_wo))
