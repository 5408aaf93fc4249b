# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How a surface point answers to light: its material there as one struct, and what it sends to the viewer."""

import warp as wp

from .brdf import ggx_specular, phong
from .constants import MIRROR_FADE_END, MIRROR_FADE_START
from .vector import fresnel_schlick

MODEL_WHITTED = wp.constant(0)
MODEL_PREVIEW = wp.constant(1)


@wp.struct
class Shading:
    """A surface point and its material, as one side of it answers to light: all that the ray tree asks for."""

    model: wp.int32
    n: wp.vec3
    """Unit shading normal on the side that the ray came from."""
    wo: wp.vec3
    """Unit, towards the viewer: the lecture's V."""
    presence: wp.float32
    """Share of the surface that is there; the rest lets rays pass straight on, uncounted."""
    ambient: wp.vec3
    """ka; for UsdPreviewSurface occlusion times diffuse."""
    emission: wp.vec3
    diffuse: wp.vec3
    """kd; for UsdPreviewSurface the albedo before the Fresnel factor."""
    specular: wp.vec3
    """ks; for UsdPreviewSurface the reflectance at normal incidence F0."""
    specular_grazing: wp.vec3
    """F90."""
    exponent: wp.float32
    """The lecture's n."""
    alpha: wp.float32
    """GGX width, roughness squared."""
    coat: wp.float32
    coat_f0: wp.float32
    coat_alpha: wp.float32
    has_local: wp.int32
    """1 where any light could add to I_local: without it no shadow ray is cast."""
    kr: wp.vec3
    kt: wp.vec3
    gloss: wp.vec3
    """Share of light from all around that specular lobes reflect and mirror rays do not carry, the surface being too
    rough: what a dome adds by its blur."""
    eta: wp.float32
    """n_incoming / n_outgoing for a ray that goes on through the surface; 1: straight."""


@wp.func
def mirror_share(roughness: float) -> float:
    """Return how much of a rough surface's reflectance a single mirror ray stands for, from 1 down to 0.

    1 up to roughness 0.1, 0 from 0.4 on, a smooth step between: a lobe wider than that is not a mirror's.
    """
    x = wp.clamp((roughness - MIRROR_FADE_START) / (MIRROR_FADE_END - MIRROR_FADE_START), 0.0, 1.0)
    return 1.0 - x * x * (3.0 - 2.0 * x)


@wp.func
def eval_response(s: wp.ref[Shading], wi: wp.vec3, scales: wp.vec3) -> wp.vec3:
    """Return the radiance towards the viewer for a light of colour I_l = 1 in unit direction ``wi``, where N.L > 0.

    Args:
        s: The surface.
        wi: Unit direction to the light: the lecture's L.
        scales: Factors of diffuse reflection, of specular reflection, and of that of a UsdPreviewSurface's coat.
    """
    if s.model == MODEL_WHITTED:
        return phong(s.diffuse * scales[0], s.specular * scales[1], s.exponent, s.n, s.wo, wi)
    return eval_lobes(s, wi, scales[0], scales[1], scales[2])


@wp.func
def unmirrored_scales(s: wp.ref[Shading], diffuse: float, specular: float) -> wp.vec3:
    """Return the factors of ``eval_response`` for a light that mirror rays see: specular is what they leave of it."""
    if s.model == MODEL_WHITTED:
        return wp.vec3(diffuse, specular, specular)
    base = specular * (1.0 - mirror_share(wp.sqrt(s.alpha)))
    return wp.vec3(diffuse, base, specular * (1.0 - mirror_share(wp.sqrt(s.coat_alpha))))


@wp.func
def eval_lobes(s: wp.ref[Shading], wi: wp.vec3, diffuse_scale: float, base_scale: float, coat_scale: float) -> wp.vec3:
    """Return a UsdPreviewSurface's response as :func:`eval_response` does, each lobe with a factor of its own."""
    n_wi = wp.dot(s.n, wi)
    h = wp.normalize(s.wo + wi)
    one = wp.vec3(1.0, 1.0, 1.0)
    transmitted = one - fresnel_schlick(s.specular, s.specular_grazing, wp.dot(s.wo, h))
    brdf = wp.cw_mul(s.diffuse, transmitted) * (diffuse_scale / wp.pi)
    brdf += ggx_specular(s.specular, s.specular_grazing, s.alpha, s.n, s.wo, wi) * base_scale
    if s.coat > 0.0:
        coat = ggx_specular(one * s.coat_f0, one, s.coat_alpha, s.n, s.wo, wi)
        brdf += coat * (s.coat * coat_scale)
    return brdf * (wp.pi * n_wi)
