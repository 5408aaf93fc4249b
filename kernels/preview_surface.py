# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdPreviewSurface at a surface point, its mirror and glass rays included."""

import warp as wp

from .albedo import diffuse_albedo, specular_albedo
from .codes import PREVIEW_INPUTS
from .constants import GRAZING_FADE, ROUGHNESS_MIN
from .dielectric import dielectric_f0, passage_eta
from .features import Features
from .material_input import eval_input, input_float, input_vec3
from .per_type import per_type
from .response import MODEL_PREVIEW, Shading, mirror_share
from .scene_structs import MaterialData, SceneData
from .shading_normal import shading_normal
from .surface import Surface
from .vector import fresnel_schlick, max_component, refraction_discriminant

_DIFFUSE_COLOR = wp.constant(PREVIEW_INPUTS.index("diffuseColor"))
_EMISSIVE_COLOR = wp.constant(PREVIEW_INPUTS.index("emissiveColor"))
_SPECULAR_COLOR = wp.constant(PREVIEW_INPUTS.index("specularColor"))
_METALLIC = wp.constant(PREVIEW_INPUTS.index("metallic"))
_ROUGHNESS = wp.constant(PREVIEW_INPUTS.index("roughness"))
_COAT = wp.constant(PREVIEW_INPUTS.index("clearcoat"))
_COAT_ROUGHNESS = wp.constant(PREVIEW_INPUTS.index("clearcoatRoughness"))
_OPACITY = wp.constant(PREVIEW_INPUTS.index("opacity"))
_IOR = wp.constant(PREVIEW_INPUTS.index("ior"))
_OCCLUSION = wp.constant(PREVIEW_INPUTS.index("occlusion"))

OPACITY_PRESENCE = wp.constant(1)
"""``MaterialData.opacity_mode`` of a surface that is not there where it is not opaque."""


@wp.func
def preview_f0(diffuse: wp.vec3, specular: wp.vec3, metallic: float, ior: float, use_specular_workflow: int) -> wp.vec3:
    """Return UsdPreviewSurface's reflectance at normal incidence.

    Reference: UsdPreviewSurface Specification 2.6, section Core Nodes, useSpecularWorkflow and ior.
    """
    if use_specular_workflow != 0:
        return specular
    one = wp.vec3(1.0, 1.0, 1.0)
    color = one + (diffuse - one) * metallic
    return (color * dielectric_f0(ior)) * (1.0 - metallic) + color * metallic


@wp.func
def at_most(amount: wp.vec3, limit: wp.vec3) -> wp.vec3:
    """Return the factors, up to 1, that bring an amount down to a limit."""
    factor = wp.vec3(1.0, 1.0, 1.0)
    for channel in range(3):
        if amount[channel] > limit[channel]:
            factor[channel] = limit[channel] / amount[channel]
    return factor


@per_type
def eval_opacity(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    material: MaterialData,
    side: float,
    s: wp.ref[Shading],
    features: Features,
) -> float:
    """Return the opacity of what is there of the surface, and write how much that is to ``Shading.presence``."""
    # A cut-out's edge is where opacity crosses the threshold: the mean of what lies about it says nothing of that.
    is_averaged = material.opacity_threshold <= 0.0
    opacity = wp.clamp(eval_input(scene, surface, material.varying, _OPACITY, s.wo, is_averaged, features)[0], 0.0, 1.0)
    if material.opacity_threshold > 0.0:
        opacity = 1.0 if opacity >= material.opacity_threshold else 0.0
    s.presence = 1.0
    if material.opacity_threshold > 0.0 or material.opacity_mode == OPACITY_PRESENCE:
        s.presence = opacity
        opacity = 1.0
    if material.is_single_sided != 0 and side < 0.0:
        s.presence = 0.0
    return opacity


@wp.func
def share_out(scene: wp.ref[SceneData], opacity: float, roughness: float, coat_roughness: float, s: wp.ref[Shading]):
    """Share out the light from all around to mirror rays, glass rays and what is left of the lobes.

    Kr is Schlick's Fresnel reflectance of base and clearcoat, each times ``mirror_share`` of its roughness;
    Kt is (1 - opacity) (1 - Fresnel) in opacityMode transparent.

    The specification adds its lobes up, and seen at a grazing angle they can send out more than arrives. Where they do,
    and only there, a lower one gets what those above leave: the base by the coat, the diffuse layer by both.

    Args:
        scene: Shading data.
        opacity: As ``eval_opacity`` returns it.
        roughness: Of the base.
        coat_roughness: Of the clearcoat.
        s: Changed in place; its lobes are those of the specification, and its eta is known.
    """
    one = wp.vec3(1.0, 1.0, 1.0)
    cos_n = wp.abs(wp.dot(s.n, s.wo))
    cos_o = float(cos_n)
    if s.eta > 1.0 and opacity < 1.0:
        # From inside, Schlick's formula takes the angle on the thin side; beyond the critical angle it gives F90.
        cos_o = wp.sqrt(wp.max(refraction_discriminant(cos_o, s.eta), 0.0))
    share = mirror_share(roughness)
    coat_share = mirror_share(coat_roughness)
    coat_fresnel = float(0.0)
    coat_gloss = float(0.0)
    if s.coat > 0.0:
        coat_fresnel = s.coat * fresnel_schlick(one * s.coat_f0, one, cos_o)[0]
        whole = s.coat * specular_albedo(scene.albedo, one * s.coat_f0, one, coat_roughness, cos_n)[0]
        coat_gloss = whole * (1.0 - coat_share)
    fresnel = fresnel_schlick(s.specular, s.specular_grazing, cos_o)
    gloss = specular_albedo(scene.albedo, s.specular, s.specular_grazing, roughness, cos_n) * (1.0 - share)
    coat_part = coat_fresnel * coat_share + coat_gloss
    below_coat = at_most(fresnel * share + gloss, one * (1.0 - coat_part))
    s.specular = wp.cw_mul(s.specular, below_coat)
    s.specular_grazing = wp.cw_mul(s.specular_grazing, below_coat)
    fresnel = wp.cw_mul(fresnel, below_coat)
    gloss = wp.cw_mul(gloss, below_coat)
    s.kr = fresnel * share + one * (coat_fresnel * coat_share)
    s.gloss = gloss + one * coat_gloss
    s.kt = wp.max(one * (1.0 - coat_fresnel) - fresnel, one * 0.0) * (1.0 - opacity)
    diffuse = wp.cw_mul(s.diffuse, diffuse_albedo(s.specular, s.specular_grazing, cos_n))
    left = wp.max(one - s.kr - s.gloss, one * 0.0) * opacity
    s.diffuse = wp.cw_mul(s.diffuse, at_most(diffuse, left))


@per_type
def eval_preview(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    material: MaterialData,
    wo: wp.vec3,
    side: float,
    features: Features,
) -> Shading:
    """Return a UsdPreviewSurface at a surface point, its mirror and glass rays included.

    Reference: UsdPreviewSurface Specification 2.6.
    """
    s = Shading()
    s.model = MODEL_PREVIEW
    s.n = shading_normal(scene, surface, material, wo, features)
    s.wo = wo
    opacity = eval_opacity(scene, surface, material, side, s, features)
    color = input_vec3(scene, surface, material.varying, _DIFFUSE_COLOR, wo, features)
    metallic = wp.clamp(input_float(scene, surface, material.varying, _METALLIC, wo, features), 0.0, 1.0)
    roughness = input_float(scene, surface, material.varying, _ROUGHNESS, wo, features)
    roughness = wp.clamp(roughness, ROUGHNESS_MIN, 1.0)
    ior = input_float(scene, surface, material.varying, _IOR, wo, features)
    one = wp.vec3(1.0, 1.0, 1.0)
    s.specular = preview_f0(
        color,
        input_vec3(scene, surface, material.varying, _SPECULAR_COLOR, wo, features),
        metallic,
        ior,
        material.use_specular_workflow,
    )
    s.specular_grazing = one
    s.diffuse = color * opacity
    if material.use_specular_workflow == 0:
        s.specular_grazing = one + (color - one) * metallic
        s.diffuse = s.diffuse * (1.0 - metallic)
    # Exact Fresnel reflectance is 0 at all angles where it is 0 head on; Schlick's would still be 1 at grazing ones.
    s.specular_grazing = s.specular_grazing * wp.min(GRAZING_FADE * max_component(s.specular), 1.0)
    s.ambient = s.diffuse * wp.clamp(input_float(scene, surface, material.varying, _OCCLUSION, wo, features), 0.0, 1.0)
    s.emission = input_vec3(scene, surface, material.varying, _EMISSIVE_COLOR, wo, features)
    s.alpha = roughness * roughness
    s.coat_f0 = dielectric_f0(ior)
    s.coat = wp.clamp(input_float(scene, surface, material.varying, _COAT, wo, features), 0.0, 1.0) * wp.min(
        GRAZING_FADE * s.coat_f0, 1.0
    )
    coat_roughness = input_float(scene, surface, material.varying, _COAT_ROUGHNESS, wo, features)
    coat_roughness = wp.clamp(coat_roughness, ROUGHNESS_MIN, 1.0)
    s.coat_alpha = coat_roughness * coat_roughness
    s.has_local = 1
    is_closed = scene.meshes[surface.mesh].is_closed
    s.eta = passage_eta(is_closed, side, ior)
    share_out(scene, opacity, roughness, coat_roughness, s)
    return s
