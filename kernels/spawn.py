# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where rays that leave a surface start."""

import warp as wp

from .bounds import widest_axis
from .constants import RIM, SPAWN_OFFSET, TRIANGLES
from .scene_structs import SceneData
from .surface import Surface
from .transform import transform_vector
from .triangle import triangle_corners
from .vector import face_forward


@wp.func
def is_at_rim(scene: wp.ref[SceneData], surface: wp.ref[Surface]) -> bool:
    """Return whether a surface point lies at the rim of its triangle."""
    is_rim = wp.min(wp.min(surface.u, surface.v), 1.0 - surface.u - surface.v) < RIM
    return is_rim and scene.meshes[surface.mesh].kind == TRIANGLES


@wp.func
def spawn_origin(scene: wp.ref[SceneData], surface: wp.ref[Surface], direction: wp.vec3) -> wp.vec3:
    """Return where a ray that leaves the surface along ``direction`` starts, so that it does not meet it again.

    The position is moved along the geometric normal, to the side of the direction, by ``Surface.clearance``. The
    triangle itself is skipped by the ray; a convex shape is met again only where the ray leaves it. At its rim, a
    triangle's neighbour can be as near, and is not: there the error of the test's t counts too, which is a mean of the
    corners along the ray's main axis, by how steeply the ray leaves.

    Reference: Pharr, Jakob and Humphreys (2023), Physically Based Rendering, sections 6.8.5 and 6.8.6; Wächter and
    Binder (2019), A Fast and Robust Method for Avoiding Self-Intersection, Ray Tracing Gems, chapter 6. Differs: bounds
    of both errors together, in the mesh's space, so that instance transforms and triangles of any size are covered.
    """
    offset = surface.clearance
    if is_at_rim(scene, surface):
        placed = scene.instances[surface.instance]
        p0, p1, p2 = triangle_corners(scene, surface.mesh, surface.triangle)
        local = transform_vector(placed.local_from_world, direction)
        axis = widest_axis(wp.abs(local))
        reach = wp.max(wp.abs(p1[axis] - p0[axis]), wp.abs(p2[axis] - p0[axis]))
        # Along the ray, t is off by this; across the plane, by that times the cosine to the normal.
        offset += reach / wp.abs(local[axis]) * wp.abs(wp.dot(surface.n_geometric, direction)) * SPAWN_OFFSET
    return surface.position + face_forward(surface.n_geometric, direction) * offset
