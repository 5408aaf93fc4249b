# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The material of a surface point, whichever surface shader it has."""

import warp as wp

from .features import Features
from .per_type import per_type
from .preview_surface import eval_preview
from .response import MODEL_WHITTED, Shading
from .scene_structs import SceneData
from .surface import Surface
from .whitted_surface import eval_whitted

NO_LEAK = wp.constant(wp.vec4i(-1, -1, -1, -1))
"""``RayTask.leaked`` of a ray that is on no wrong side."""


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
