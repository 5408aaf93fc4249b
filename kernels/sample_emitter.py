# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A light or a dome at a surface point, sampled by where it is and by what the surface mirrors.

Neither alone will do: a narrow lobe rarely points where a large light is sampled, and a small light is rarely met by
the directions of a wide lobe. Each sample takes one of the techniques by chance, and counts by the density of all of
them together: Veach's balance heuristic for one sample.

Reference: Veach (1997), Robust Monte Carlo Methods for Light Transport Simulation, section 9.2.4.
"""

import warp as wp

from .constants import GLOSS_SHARE
from .environment import dome_radiance
from .light_direction import LightDirection
from .material import MODEL_PREVIEW, Shading, eval_lobes, mirror_share, phong
from .profile import profile_factor
from .sample_dome import sample_cosine
from .sample_gloss import ggx_pdf, sample_ggx
from .sample_light import light_radiance, meet_extent, sample_extent
from .structs import SceneData
from .vector import fresnel_schlick, max_component


@wp.struct
class Emitter:
    """A light or a dome, and how a surface answers to it."""

    row: wp.int32
    """Of ``SceneData.lights``; the domes' rows follow, from ``light_count`` on."""
    casts_shadow: wp.int32
    shadow: wp.int32
    """As in ``LightData``."""
    diffuse: wp.float32
    """Factor of the surface's diffuse response; so too of its base's and its coat's specular ones."""
    base: wp.float32
    coat: wp.float32
    base_share: wp.float32
    """Part of the samples that goes where the base mirrors the viewer; so too the coat."""
    coat_share: wp.float32


@wp.struct
class EmitterSample:
    """One sample of an emitter."""

    wi: wp.vec3
    """Unit, towards it."""
    distance: wp.float32
    irradiance: wp.vec3
    """Its radiance by the density of the direction: what it adds to the irradiance of a surface that faces it."""


@wp.func
def light_at(scene: wp.ref[SceneData], shading: wp.ref[Shading], row: int) -> Emitter:
    """Return a light with an extent as an emitter."""
    light = scene.lights[row]
    e = Emitter()
    e.row = row
    e.casts_shadow = light.casts_shadow
    e.shadow = light.shadow
    e.diffuse = light.diffuse
    e.base = light.specular
    e.coat = light.specular
    share_samples(e, shading, GLOSS_SHARE)
    return e


@wp.func
def dome_at(scene: wp.ref[SceneData], shading: wp.ref[Shading], number: int) -> Emitter:
    """Return a dome as an emitter, specular only for what mirror rays, which see the dome themselves, do not carry."""
    dome = scene.domes[number]
    e = Emitter()
    e.row = scene.light_count + number
    e.casts_shadow = 1
    e.shadow = -1
    e.diffuse = dome.diffuse
    if shading.model == MODEL_PREVIEW:
        e.base = dome.specular * (1.0 - mirror_share(wp.sqrt(shading.alpha)))
        e.coat = dome.specular * (1.0 - mirror_share(wp.sqrt(shading.coat_alpha)))
    share_samples(e, shading, 1.0)
    return e


@wp.func
def share_samples(e: wp.ref[Emitter], shading: wp.ref[Shading], gloss_share: float):
    """Give the lobes of a UsdPreviewSurface their part of an emitter's samples, by what they reflect.

    Args:
        e: The emitter.
        shading: The surface.
        gloss_share: Part that specular lobes get where nothing is diffuse.
    """
    if shading.model != MODEL_PREVIEW:
        return
    cosine = wp.dot(shading.n, shading.wo)
    base = e.base * max_component(fresnel_schlick(shading.specular, shading.specular_grazing, cosine))
    grazing = wp.vec3(1.0, 1.0, 1.0)
    coat = e.coat * shading.coat * fresnel_schlick(grazing * shading.coat_f0, grazing, cosine)[0]
    whole = base + coat + e.diffuse * max_component(shading.diffuse)
    if base + coat > 0.0:
        e.base_share = gloss_share * base / whole
        e.coat_share = gloss_share * coat / whole


@wp.func
def sample_emitter(
    scene: wp.ref[SceneData], shading: wp.ref[Shading], position: wp.vec3, e: wp.ref[Emitter], u: wp.vec2
) -> EmitterSample:
    """Return one sample of an emitter; of irradiance 0 where nothing arrives.

    Args:
        scene: Lights and domes.
        shading: The surface.
        position: On it.
        e: The emitter.
        u: Point of the unit square.
    """
    s = EmitterSample()
    is_dome = e.row >= scene.light_count
    gloss = e.base_share + e.coat_share
    d = LightDirection()
    if u[0] < 1.0 - gloss:
        v = wp.vec2(u[0] / (1.0 - gloss), u[1])
        if is_dome:
            d = sample_cosine(shading.n, v)
        else:
            d = sample_extent(scene.lights[e.row], position, v)
    else:
        rest = u[0] - (1.0 - gloss)
        is_coat = rest >= e.base_share
        rest = (rest - e.base_share) / e.coat_share if is_coat else rest / e.base_share
        alpha = shading.coat_alpha if is_coat else shading.alpha
        wi = sample_ggx(shading.n, shading.wo, alpha, wp.vec2(wp.min(rest, 1.0), u[1]))
        if is_dome:
            d.wi = wi
            d.distance = wp.inf
            d.pdf = wp.max(wp.dot(shading.n, wi), 0.0) / wp.pi
        else:
            d = meet_extent(scene.lights[e.row], position, wi)
    if d.pdf <= 0.0 or wp.dot(shading.n, d.wi) <= 0.0:
        return s
    pdf = d.pdf * (1.0 - gloss)
    if e.base_share > 0.0:
        pdf += e.base_share * ggx_pdf(shading.n, shading.wo, shading.alpha, d.wi)
    if e.coat_share > 0.0:
        pdf += e.coat_share * ggx_pdf(shading.n, shading.wo, shading.coat_alpha, d.wi)
    s.wi = d.wi
    s.distance = d.distance
    if is_dome:
        s.irradiance = dome_radiance(scene, scene.domes[e.row - scene.light_count], d.wi) / pdf
    else:
        s.irradiance = light_radiance(scene.lights[e.row], d.wi) / pdf
        profile = scene.lights[e.row].profile
        if profile >= 0:
            s.irradiance = s.irradiance * profile_factor(scene, profile, d.wi)
    return s


@wp.func
def emitter_response(e: wp.ref[Emitter], shading: wp.ref[Shading], wi: wp.vec3) -> wp.vec3:
    """Return a surface's response to light of colour I_l = 1 from an emitter, in a unit direction where N.L > 0."""
    if shading.model == MODEL_PREVIEW:
        return eval_lobes(shading, wi, e.diffuse, e.base, e.coat)
    return phong(shading.diffuse * e.diffuse, shading.specular * e.base, shading.exponent, shading.n, shading.wo, wi)
