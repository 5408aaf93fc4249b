# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Shading normals, bent by normal maps, and what keeps light and rays on the right side of the surface below them."""

import warp as wp

from .codes import IMAGE_FRAME, INPUT_COUNT, PREVIEW_INPUTS, WORLD_FRAME
from .constants import HORIZON, JUST_SEEN, LEAST_DIVISOR
from .features import Features, PlainScene
from .material_input import input_vec3
from .per_type import per_type
from .primvar import NORMALS_SLOT
from .response import Shading
from .scene_structs import MaterialData, SceneData
from .surface import Surface
from .surface_primvar import surface_tangents
from .vector import face_forward

_NORMAL = wp.constant(PREVIEW_INPUTS.index("normal"))


@wp.func
def just_seen(bent: wp.vec3, n: wp.vec3, wo: wp.vec3) -> wp.vec3:
    """Return a bent normal, unit, and brought back to where it is just seen; ``n`` where it is none."""
    if wp.length_sq(bent) > 0.0:
        unit = wp.normalize(bent)
        return wp.normalize(unit + wo * wp.max(JUST_SEEN - wp.dot(unit, wo), 0.0))
    return n


@wp.func
def map_tangents(scene: wp.ref[SceneData], surface: wp.ref[Surface], row: int, frame: int):
    """Return the world directions of x and y of a normal map, of any length: zero where its coordinates have none.

    In IMAGE_FRAME they are those in which the coordinates grow as the image is read: a transform that turns or mirrors
    it on the surface turns and mirrors its bumps.

    Args:
        scene: Shading data.
        surface: Where.
        row: Of ``SceneData.textures``; -1: what is no texture is in the frame of st.
        frame: ``MaterialData.normal_frame``.
    """
    if row < 0:
        return surface_tangents(scene, surface, int(wp.static(int(NORMALS_SLOT) + 1)))
    texture = scene.textures[row]
    along_u, along_v = surface_tangents(scene, surface, texture.primvar)
    if frame != IMAGE_FRAME:
        return along_u, along_v
    # The inverse of the transform, up to its size.
    u = texture.row_u
    v = texture.row_v
    side = wp.sign(u[0] * v[1] - u[1] * v[0])
    return (along_u * v[1] - along_v * v[0]) * side, (along_v * u[0] - along_u * u[1]) * side


@per_type
def shading_normal(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], material: MaterialData, wo: wp.vec3, features: Features
) -> wp.vec3:
    """Return the unit shading normal, on the viewer's side, bent by the input ``normal`` if there is one.

    The unbent normal tells the side: from behind a bump is a dent. Bent away from the viewer, it is brought back to
    where it is just seen, so that nothing jumps; turned round it would face what is behind the surface.
    """
    n = face_forward(surface.n_shading, wo)
    if material.normal_frame == WORLD_FRAME:
        m = input_vec3(scene, surface, material.varying, _NORMAL, wo, features)
        return just_seen(m * wp.sign(wp.dot(n, surface.n_shading)), n, wo)
    if material.normal_frame != 0:
        data = scene.inputs[surface.material * INPUT_COUNT + _NORMAL]
        tangent, bitangent = map_tangents(scene, surface, data.texture, material.normal_frame)
        # An orthonormal frame about the interpolated normal; mirrored texture coordinates keep their handedness.
        t = tangent - n * wp.dot(n, tangent)
        b = bitangent - n * wp.dot(n, bitangent) - t * (wp.dot(t, bitangent) / wp.max(wp.dot(t, t), LEAST_DIVISOR))
        if wp.length_sq(t) > 0.0 and wp.length_sq(b) > 0.0:
            m = input_vec3(scene, surface, material.varying, _NORMAL, wo, features)
            side = wp.sign(wp.dot(n, surface.n_shading))
            bent = (wp.normalize(t) * m[0] + wp.normalize(b) * m[1]) * side + n * m[2]
            return just_seen(bent, n, wo)
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
    if scene.materials[surface.material].normal_frame != 0:
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
    if scene.materials[surface.material].normal_frame != 0:
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
