# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""WhittedSurface at a surface point: the lecture's material."""

import warp as wp

from .codes import WHITTED_INPUTS
from .dielectric import passage_eta
from .features import Features
from .material_input import input_float, input_vec3
from .per_type import per_type
from .response import MODEL_WHITTED, Shading
from .scene_structs import MaterialData, SceneData
from .shading_normal import shading_normal
from .surface import Surface

_AMBIENT = wp.constant(WHITTED_INPUTS.index("ambient"))
_DIFFUSE = wp.constant(WHITTED_INPUTS.index("diffuse"))
_SPECULAR = wp.constant(WHITTED_INPUTS.index("specular"))
_SHININESS = wp.constant(WHITTED_INPUTS.index("shininess"))
_REFLECTION = wp.constant(WHITTED_INPUTS.index("reflection"))
_TRANSMISSION = wp.constant(WHITTED_INPUTS.index("transmission"))
_IOR = wp.constant(WHITTED_INPUTS.index("ior"))


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
    s.ambient = input_vec3(scene, surface, material.varying, _AMBIENT, wo, features)
    s.diffuse = input_vec3(scene, surface, material.varying, _DIFFUSE, wo, features)
    s.specular = input_vec3(scene, surface, material.varying, _SPECULAR, wo, features)
    s.exponent = wp.max(input_float(scene, surface, material.varying, _SHININESS, wo, features), 0.0)
    s.kr = input_vec3(scene, surface, material.varying, _REFLECTION, wo, features)
    s.kt = input_vec3(scene, surface, material.varying, _TRANSMISSION, wo, features)
    is_closed = scene.meshes[surface.mesh].is_closed
    s.eta = passage_eta(is_closed, side, input_float(scene, surface, material.varying, _IOR, wo, features))
    local = s.diffuse + s.specular
    s.has_local = 1 if wp.max(local[0], wp.max(local[1], local[2])) > 0.0 else 0
    return s
