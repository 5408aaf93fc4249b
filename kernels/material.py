# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Materials at a surface point: the inputs of WhittedSurface and UsdPreviewSurface, evaluated into one struct."""

import warp as wp

from .albedo import diffuse_albedo, specular_albedo
from .codes import INPUT_COUNT
from .constants import GRAZING_FADE, HORIZON, IOR_MIN, JUST_SEEN, MIRROR_FADE_END, MIRROR_FADE_START, ROUGHNESS_MIN
from .features import Features, PlainScene
from .per_type import per_type
from .ray_differential import coordinate_differential
from .sample_gloss import ggx_distribution
from .structs import MaterialData, SceneData
from .surface import NORMALS_SLOT, Surface, eval_primvar, surface_tangents
from .texture_node import eval_texture
from .vector import face_forward, fresnel_schlick, max_component, refraction_discriminant

MODEL_WHITTED = wp.constant(0)
MODEL_PREVIEW = wp.constant(1)
OPACITY_TRANSPARENT = wp.constant(0)
OPACITY_PRESENCE = wp.constant(1)
NO_LEAK = wp.constant(wp.vec4i(-1, -1, -1, -1))
"""``RayTask.leaked`` of a ray that is on no wrong side."""


_AMBIENT, _DIFFUSE, _SPECULAR, _SHININESS = wp.constant(0), wp.constant(1), wp.constant(2), wp.constant(3)
_REFLECTION, _TRANSMISSION, _IOR = wp.constant(4), wp.constant(5), wp.constant(6)
_DIFFUSE_COLOR, _EMISSIVE, _SPECULAR_COLOR, _METALLIC = wp.constant(0), wp.constant(1), wp.constant(2), wp.constant(3)
_ROUGHNESS, _COAT, _COAT_ROUGHNESS, _OPACITY = wp.constant(4), wp.constant(5), wp.constant(6), wp.constant(7)
_PREVIEW_IOR, _NORMAL, _OCCLUSION = wp.constant(8), wp.constant(9), wp.constant(10)


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
def pick_channel(value: wp.vec4, channel: int) -> wp.vec4:
    """Return one channel of a value four times; the value itself for -1."""
    if channel >= 0:
        c = value[channel]
        return wp.vec4(c, c, c, c)
    return value


# Out of line, like the next one: constants, by far the most inputs, are then read without it.
@wp.func(inline=False)
def eval_primvar_input(scene: wp.ref[SceneData], surface: wp.ref[Surface], row: int) -> wp.vec4:
    """Return an input that is a primvar, at a surface point; ``row`` is that of ``SceneData.inputs``."""
    data = scene.inputs[row]
    value = eval_primvar(scene, surface, data.primvar, scene.input_values[row])
    return pick_channel(wp.cw_mul(value, data.scale) + data.bias, data.channel)


@wp.func(inline=False)
def eval_varying_input(scene: wp.ref[SceneData], surface: wp.ref[Surface], row: int, is_averaged: bool) -> wp.vec4:
    """Return an input that is a texture or a primvar, at a surface point; arguments as for the functions around."""
    data = scene.inputs[row]
    if data.texture < 0:
        return eval_primvar_input(scene, surface, row)
    texture = scene.textures[data.texture]
    fallback = wp.vec4(texture.uv_fallback[0], texture.uv_fallback[1], 0.0, 0.0)
    st = eval_primvar(scene, surface, texture.primvar, fallback)
    across = wp.vec2(0.0, 0.0)
    down = wp.vec2(0.0, 0.0)
    if scene.is_filtered != 0 and is_averaged:
        across = coordinate_differential(scene, surface, texture.primvar, surface.dpdx)
        down = coordinate_differential(scene, surface, texture.primvar, surface.dpdy)
    return pick_channel(eval_texture(scene, texture, wp.vec2(st[0], st[1]), across, down), data.channel)


@per_type
def eval_input(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    varying: int,
    index: int,
    is_averaged: bool,
    features: Features,
) -> wp.vec4:
    """Return one input of the surface's material.

    Args:
        scene: Shading data.
        surface: Where.
        varying: ``MaterialData.varying``.
        index: Of the input.
        is_averaged: Whether a texture gives its mean over the ray's footprint.
        features: What the kernel can render.
    """
    row = surface.material * INPUT_COUNT + index
    if varying & (1 << index) != 0:
        return eval_varying_input(scene, surface, row, is_averaged)
    return scene.input_values[row]


@wp.func
def eval_input(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    varying: int,
    index: int,
    is_averaged: bool,
    features: wp.ref[PlainScene],
) -> wp.vec4:
    """Return it: no texture."""
    row = surface.material * INPUT_COUNT + index
    if varying & (1 << index) != 0:
        return eval_primvar_input(scene, surface, row)
    return scene.input_values[row]


@per_type
def input_vec3(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], varying: int, index: int, features: Features
) -> wp.vec3:
    """Return a colour input of the surface's material."""
    value = eval_input(scene, surface, varying, index, True, features)
    return wp.vec3(value[0], value[1], value[2])


@per_type
def input_float(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], varying: int, index: int, features: Features
) -> float:
    """Return a scalar input of the surface's material."""
    return eval_input(scene, surface, varying, index, True, features)[0]


@wp.func
def mirror_share(roughness: float) -> float:
    """Return how much of a rough surface's reflectance a single mirror ray stands for, from 1 down to 0.

    1 up to roughness 0.1, 0 from 0.4 on, a smooth step between: a lobe wider than that is not a mirror's.
    """
    x = wp.clamp((roughness - MIRROR_FADE_START) / (MIRROR_FADE_END - MIRROR_FADE_START), 0.0, 1.0)
    return 1.0 - x * x * (3.0 - 2.0 * x)


@per_type
def shading_normal(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], material: MaterialData, wo: wp.vec3, features: Features
) -> wp.vec3:
    """Return the unit shading normal, on the viewer's side, bent by the input ``normal`` if there is one.

    The unbent normal tells the side: from behind a bump is a dent. Bent away from the viewer, it is brought back to
    where it is just seen, so that nothing jumps; turned round it would face what is behind the surface.
    """
    n = face_forward(surface.n_shading, wo)
    if material.has_normal_map != 0:
        data = scene.inputs[surface.material * INPUT_COUNT + _NORMAL]
        slot = int(wp.static(int(NORMALS_SLOT) + 1))  # that of st: the frame of what is no texture
        if data.texture >= 0:
            slot = scene.textures[data.texture].primvar
        tangent, bitangent = surface_tangents(scene, surface, slot)
        # An orthonormal frame about the interpolated normal; mirrored texture coordinates keep their handedness.
        t = tangent - n * wp.dot(n, tangent)
        b = bitangent - n * wp.dot(n, bitangent) - t * (wp.dot(t, bitangent) / wp.max(wp.dot(t, t), 1.0e-30))
        if wp.length_sq(t) > 0.0 and wp.length_sq(b) > 0.0:
            m = input_vec3(scene, surface, material.varying, _NORMAL, features)
            side = wp.sign(wp.dot(n, surface.n_shading))
            bent = (wp.normalize(t) * m[0] + wp.normalize(b) * m[1]) * side + n * m[2]
            if wp.length_sq(bent) > 0.0:
                bent = wp.normalize(bent)
                n = wp.normalize(bent + wo * wp.max(JUST_SEEN - wp.dot(bent, wo), 0.0))
    return n


@wp.func
def shading_normal(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    material: MaterialData,
    wo: wp.vec3,
    features: wp.ref[PlainScene],
) -> wp.vec3:
    """Return the interpolated normal on the viewer's side."""
    return face_forward(surface.n_shading, wo)


@per_type
def facing(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], shading: wp.ref[Shading], wi: wp.vec3, features: Features
) -> float:
    """Return N.L; of a bent normal that of the surface itself where it is less, so that no light leaks through a sheet.

    Args:
        scene: Shading data.
        surface: Where.
        shading: Of the surface.
        wi: Unit direction to the light.
        features: What the kernel can render.
    """
    cosine = wp.dot(shading.n, wi)
    if scene.materials[surface.material].has_normal_map != 0:
        return wp.min(cosine, wp.dot(face_forward(surface.n_shading, shading.wo), wi))
    return cosine


@wp.func
def facing(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    wi: wp.vec3,
    features: wp.ref[PlainScene],
) -> float:
    """Return it: N.L."""
    return wp.dot(shading.n, wi)


@per_type
def mirror_normal(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], shading: wp.ref[Shading], features: Features
) -> wp.vec3:
    """Return the normal that rays are mirrored and bent about: N, unless a bent one mirrors to beneath the surface.

    There the mirrored ray is lifted to the horizon, and the normal is between it and the viewer.

    Reference: the aim is that of Cycles' ensure_valid_specular_reflection (Blender 2.8), which turns the normal in
    another plane.
    """
    n = shading.n
    if scene.materials[surface.material].has_normal_map != 0:
        above = face_forward(surface.n_shading, shading.wo)
        mirrored = 2.0 * wp.dot(n, shading.wo) * n - shading.wo
        lowest = wp.min(0.5 * wp.dot(above, shading.wo), HORIZON)
        height = wp.dot(above, mirrored)
        if height < lowest:
            n = wp.normalize(wp.normalize(mirrored + above * (lowest - height)) + shading.wo)
    return n


@wp.func
def mirror_normal(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], shading: wp.ref[Shading], features: wp.ref[PlainScene]
) -> wp.vec3:
    """Return N."""
    return shading.n


@wp.func
def passage_eta(is_closed: int, side: float, ior: float) -> float:
    """Return n_incoming / n_outgoing, vacuum being outside; 1 for a surface that bounds no volume.

    Args:
        is_closed: Whether the mesh bounds a volume.
        side: Positive where the ray enters, negative where it leaves.
        ior: Index of refraction inside; what is not above 0 is none, and bends no ray.
    """
    if is_closed == 0 or ior <= 0.0:
        return 1.0
    if side > 0.0:
        return 1.0 / ior
    return ior


@per_type
def eval_whitted(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    material: MaterialData,
    wo: wp.vec3,
    side: float,
    features: Features,
) -> Shading:
    """Return the lecture's material at a surface point."""
    s = Shading()
    s.model = MODEL_WHITTED
    s.n = shading_normal(scene, surface, material, wo, features)
    s.wo = wo
    s.presence = 1.0
    s.ambient = input_vec3(scene, surface, material.varying, _AMBIENT, features)
    s.diffuse = input_vec3(scene, surface, material.varying, _DIFFUSE, features)
    s.specular = input_vec3(scene, surface, material.varying, _SPECULAR, features)
    s.exponent = wp.max(input_float(scene, surface, material.varying, _SHININESS, features), 0.0)
    s.kr = input_vec3(scene, surface, material.varying, _REFLECTION, features)
    s.kt = input_vec3(scene, surface, material.varying, _TRANSMISSION, features)
    is_closed = scene.meshes[surface.mesh].is_closed
    s.eta = passage_eta(is_closed, side, input_float(scene, surface, material.varying, _IOR, features))
    local = s.diffuse + s.specular
    s.has_local = 1 if wp.max(local[0], wp.max(local[1], local[2])) > 0.0 else 0
    return s


@wp.func
def dielectric_f0(ior: float) -> float:
    """Return the reflectance at normal incidence in vacuum, ((1 - ior) / (1 + ior))^2.

    Textures hold any number: what is not above 0 counts as an index next to it.
    """
    n = wp.max(ior, IOR_MIN)
    r = (1.0 - n) / (1.0 + n)
    return r * r


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

    Kr is Schlick's Fresnel reflectance of base and clearcoat, each times ``mirror_share`` of its roughness;
    Kt is (1 - opacity) (1 - Fresnel) in opacityMode transparent.

    The specification adds its lobes up, and seen at a grazing angle they can send out more than arrives. Where they do,
    and only there, a lower one gets what those above leave: the base by the coat, the diffuse layer by both.

    Reference: UsdPreviewSurface Specification 2.6.
    """
    s = Shading()
    s.model = MODEL_PREVIEW
    s.n = shading_normal(scene, surface, material, wo, features)
    s.wo = wo
    # A cut-out's edge is where opacity crosses the threshold: the mean of what lies about it says nothing of that.
    is_averaged = material.opacity_threshold <= 0.0
    opacity = wp.clamp(eval_input(scene, surface, material.varying, _OPACITY, is_averaged, features)[0], 0.0, 1.0)
    if material.opacity_threshold > 0.0:
        opacity = 1.0 if opacity >= material.opacity_threshold else 0.0
    s.presence = 1.0
    if material.opacity_threshold > 0.0 or material.opacity_mode == OPACITY_PRESENCE:
        s.presence = opacity
        opacity = 1.0
    if material.is_single_sided != 0 and side < 0.0:
        s.presence = 0.0

    color = input_vec3(scene, surface, material.varying, _DIFFUSE_COLOR, features)
    metallic = wp.clamp(input_float(scene, surface, material.varying, _METALLIC, features), 0.0, 1.0)
    roughness = wp.max(input_float(scene, surface, material.varying, _ROUGHNESS, features), ROUGHNESS_MIN)
    ior = input_float(scene, surface, material.varying, _PREVIEW_IOR, features)
    one = wp.vec3(1.0, 1.0, 1.0)
    s.specular = preview_f0(
        color,
        input_vec3(scene, surface, material.varying, _SPECULAR_COLOR, features),
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
    s.ambient = s.diffuse * input_float(scene, surface, material.varying, _OCCLUSION, features)
    s.emission = input_vec3(scene, surface, material.varying, _EMISSIVE, features)
    s.alpha = roughness * roughness
    s.coat_f0 = dielectric_f0(ior)
    s.coat = wp.clamp(input_float(scene, surface, material.varying, _COAT, features), 0.0, 1.0) * wp.min(
        GRAZING_FADE * s.coat_f0, 1.0
    )
    coat_roughness = wp.max(input_float(scene, surface, material.varying, _COAT_ROUGHNESS, features), ROUGHNESS_MIN)
    s.coat_alpha = coat_roughness * coat_roughness
    s.has_local = 1

    is_closed = scene.meshes[surface.mesh].is_closed
    s.eta = passage_eta(is_closed, side, ior)
    cos_n = wp.abs(wp.dot(s.n, wo))
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
    return s


@wp.func
def at_most(amount: wp.vec3, limit: wp.vec3) -> wp.vec3:
    """Return the factors, up to 1, that bring an amount down to a limit."""
    factor = wp.vec3(1.0, 1.0, 1.0)
    for channel in range(3):
        if amount[channel] > limit[channel]:
            factor[channel] = limit[channel] / amount[channel]
    return factor


@per_type
def eval_material(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], wo: wp.vec3, leaked: wp.vec4i, features: Features
) -> Shading:
    """Return the surface's material as seen from the unit direction ``wo``.

    Entering or leaving is told by the side of the geometric normal that the ray is on; at instances that the ray has
    ``leaked`` through, it is on the wrong one.
    """
    side = wp.dot(surface.n_geometric, wo)
    for k in range(4):
        if leaked[k] == surface.instance:
            side = -side
    material = scene.materials[surface.material]
    if material.model == MODEL_WHITTED:
        return eval_whitted(scene, surface, material, wo, side, features)
    return eval_preview(scene, surface, material, wo, side, features)


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
