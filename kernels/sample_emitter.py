# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A light or a dome at a surface point, sampled by where it is and by what the surface mirrors.

Neither alone will do: a narrow lobe rarely points where a large light is sampled, and a small light is rarely met by
the directions of a wide lobe. Each sample takes one of the techniques by chance, and counts by the density of all of
them together: Veach's balance heuristic for one sample.

Reference: Veach (1997), Robust Monte Carlo Methods for Light Transport Simulation, section 9.2.4.
"""

import warp as wp

from .brdf import phong
from .constants import GLOSS_SHARE, IMAGE_SHARE
from .emission import is_mirrored, light_emission
from .environment import dome_radiance
from .light import KIND_MESH
from .light_direction import LightDirection
from .response import MODEL_PREVIEW, Shading, eval_lobes, mirror_share, unmirrored_scales
from .sample_dome import cosine_pdf, dome_image_pdf, sample_cosine, sample_dome_image
from .sample_gloss import ggx_pdf, sample_ggx
from .sample_light import meet_shaped, sample_shaped
from .sample_shaped_mesh import is_nearest, meet_shaped_mesh, sample_shaped_mesh
from .scene_structs import SceneData
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
    reflected: wp.float32
    """About what the surface reflects of it; 0: nothing, so that it need not be sampled."""


@wp.struct
class EmitterSample:
    """One sample of an emitter."""

    wi: wp.vec3
    """Unit, towards it."""
    distance: wp.float32
    irradiance: wp.vec3
    """Its radiance by the density of the direction: what it adds to the irradiance of a surface that faces it."""


@wp.func
def light_at(scene: wp.ref[SceneData], shading: wp.ref[Shading], row: int, lights_visible: int) -> Emitter:
    """Return a light with an extent as an emitter, specular only for what mirror rays that see it leave."""
    light = scene.lights[row]
    e = Emitter()
    e.row = row
    e.casts_shadow = light.casts_shadow
    e.shadow = light.shadow
    e.diffuse = light.diffuse
    e.base = light.specular
    e.coat = light.specular
    if is_mirrored(light, lights_visible):
        scales = unmirrored_scales(shading, light.diffuse, light.specular)
        e.base = scales[1]
        e.coat = scales[2]
    share_samples(e, shading, GLOSS_SHARE)
    return e


@wp.func
def dome_at(scene: wp.ref[SceneData], shading: wp.ref[Shading], number: int) -> Emitter:
    """Return a dome as an emitter, specular only for what mirror rays, which see the dome themselves, do not carry."""
    dome = scene.domes[number]
    e = Emitter()
    e.row = scene.light_count + number
    e.casts_shadow = dome.casts_shadow
    e.shadow = dome.shadow
    e.diffuse = dome.diffuse
    if shading.model == MODEL_PREVIEW:
        e.base = dome.specular * (1.0 - mirror_share(wp.sqrt(shading.alpha)))
        e.coat = dome.specular * (1.0 - mirror_share(wp.sqrt(shading.coat_alpha)))
    share_samples(e, shading, 1.0)
    return e


@wp.func
def share_samples(e: wp.ref[Emitter], shading: wp.ref[Shading], gloss_share: float):
    """Give a surface's lobes their part of an emitter's samples, by what they reflect.

    Args:
        e: The emitter.
        shading: The surface.
        gloss_share: Part that specular lobes get where nothing is diffuse.
    """
    diffuse = e.diffuse * max_component(shading.diffuse)
    if shading.model != MODEL_PREVIEW:
        e.reflected = diffuse + e.base * max_component(shading.specular)
        return
    cosine = wp.dot(shading.n, shading.wo)
    base = e.base * max_component(fresnel_schlick(shading.specular, shading.specular_grazing, cosine))
    grazing = wp.vec3(1.0, 1.0, 1.0)
    coat = e.coat * shading.coat * fresnel_schlick(grazing * shading.coat_f0, grazing, cosine)[0]
    e.reflected = base + coat + diffuse
    if base + coat > 0.0:
        e.base_share = gloss_share * base / e.reflected
        e.coat_share = gloss_share * coat / e.reflected


@wp.func
def sample_where_it_is(scene: wp.ref[SceneData], n: wp.vec3, position: wp.vec3, row: int, u: wp.vec2) -> LightDirection:
    """Return a direction to a light, or to a dome: that by the cosine, or by where its image is bright.

    Args:
        scene: Lights and domes.
        n: Unit normal of the surface.
        position: On it.
        row: Of the emitter.
        u: Point of the unit square.
    """
    if row < scene.light_count:
        if scene.lights[row].kind == KIND_MESH:
            return sample_shaped_mesh(scene, scene.lights[row], position, n, u)
        return sample_shaped(scene.lights[row], position, u)
    dome = scene.domes[row - scene.light_count]
    if dome.cells_offset < 0:
        return sample_cosine(n, u)
    if u[0] < IMAGE_SHARE:
        s = sample_dome_image(scene, dome, wp.vec2(u[0] / IMAGE_SHARE, u[1]))
        s.pdf = IMAGE_SHARE * s.pdf + (1.0 - IMAGE_SHARE) * cosine_pdf(n, s.wi)
        return s
    s = sample_cosine(n, wp.vec2((u[0] - IMAGE_SHARE) / (1.0 - IMAGE_SHARE), u[1]))
    s.pdf = (1.0 - IMAGE_SHARE) * s.pdf + IMAGE_SHARE * dome_image_pdf(scene, dome, s.wi)
    return s


@wp.func
def meet_emitter(scene: wp.ref[SceneData], n: wp.vec3, position: wp.vec3, row: int, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_where_it_is` makes of a direction from elsewhere: of a mesh, of its nearest point."""
    if row < scene.light_count:
        if scene.lights[row].kind == KIND_MESH:
            return meet_shaped_mesh(scene, scene.lights[row], position, n, wi)
        return meet_shaped(scene.lights[row], position, wi)
    dome = scene.domes[row - scene.light_count]
    s = LightDirection()
    s.wi = wi
    s.distance = wp.inf
    s.pdf = cosine_pdf(n, wi)
    if dome.cells_offset >= 0:
        s.pdf = (1.0 - IMAGE_SHARE) * s.pdf + IMAGE_SHARE * dome_image_pdf(scene, dome, wi)
    return s


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
    own = 1.0 - e.base_share - e.coat_share
    d = LightDirection()
    if u[0] < own:
        d = sample_where_it_is(scene, shading.n, position, e.row, wp.vec2(u[0] / own, u[1]))
    else:
        rest = u[0] - own
        is_coat = rest >= e.base_share
        rest = (rest - e.base_share) / e.coat_share if is_coat else rest / e.base_share
        alpha = shading.coat_alpha if is_coat else shading.alpha
        wi = sample_ggx(shading.n, shading.wo, alpha, wp.vec2(wp.min(rest, 1.0), u[1]))
        d = meet_emitter(scene, shading.n, position, e.row, wi)
    if d.pdf <= 0.0 or wp.dot(shading.n, d.wi) <= 0.0:
        return s
    pdf = d.pdf * own
    met = float(1.0)
    if u[0] < own and own < 1.0 and e.row < scene.light_count and scene.lights[e.row].kind == KIND_MESH:
        # Where a mesh is behind itself, lobes sample what is nearest alone.
        met = 1.0 if is_nearest(scene, scene.lights[e.row], position, d) else 0.0
    if e.base_share > 0.0:
        pdf += met * e.base_share * ggx_pdf(shading.n, shading.wo, shading.alpha, d.wi)
    if e.coat_share > 0.0:
        pdf += met * e.coat_share * ggx_pdf(shading.n, shading.wo, shading.coat_alpha, d.wi)
    if pdf <= 0.0:
        return s  # a viewer in the very plane of a surface sees no facets
    s.wi = d.wi
    s.distance = d.distance
    if e.row < scene.light_count:
        s.irradiance = light_emission(scene, scene.lights[e.row], position, d.wi, d.distance) / pdf
    else:
        s.irradiance = dome_radiance(scene, scene.domes[e.row - scene.light_count], d.wi) / pdf
    return s


@wp.func
def emitter_response(e: wp.ref[Emitter], shading: wp.ref[Shading], wi: wp.vec3) -> wp.vec3:
    """Return a surface's response to light of colour I_l = 1 from an emitter, in a unit direction where N.L > 0."""
    if shading.model == MODEL_PREVIEW:
        return eval_lobes(shading, wi, e.diffuse, e.base, e.coat)
    return phong(shading.diffuse * e.diffuse, shading.specular * e.base, shading.exponent, shading.n, shading.wo, wi)
