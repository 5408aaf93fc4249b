# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A triangle of a mesh, as its arrays hold it."""

import warp as wp

from .constants import LEAST_DIVISOR
from .scene_structs import SceneData
from .vector import max_magnitude


@wp.struct
class Triangle:
    """A triangle in its mesh's space, of any size or none."""

    p0: wp.vec3
    p1: wp.vec3
    p2: wp.vec3
    size: wp.float32
    """Largest coordinate of its edges, at least LEAST_DIVISOR."""
    e1: wp.vec3
    """From ``p0`` to ``p1``, over ``size``; so too ``e2``, to ``p2``."""
    e2: wp.vec3
    across: wp.vec3
    """Their cross product: a normal, zero if the triangle has no area."""


@wp.func
def triangle_corners(scene: wp.ref[SceneData], mesh: int, triangle: int):
    """Return the three corners of a triangle, in its mesh's space."""
    data = scene.meshes[mesh]
    corner = scene.corners[data.triangle_offset + triangle]
    p0 = scene.points[data.point_offset + corner[0]]
    p1 = scene.points[data.point_offset + corner[1]]
    p2 = scene.points[data.point_offset + corner[2]]
    return p0, p1, p2


@wp.func
def load_triangle(scene: wp.ref[SceneData], mesh: int, triangle: int) -> Triangle:
    """Return a triangle of a mesh."""
    result = Triangle()
    p0, p1, p2 = triangle_corners(scene, mesh, triangle)
    result.p0 = p0
    result.p1 = p1
    result.p2 = p2
    e1 = p1 - p0
    e2 = p2 - p0
    result.size = wp.max(wp.max(max_magnitude(e1), max_magnitude(e2)), LEAST_DIVISOR)
    result.e1 = e1 / result.size
    result.e2 = e2 / result.size
    result.across = wp.cross(result.e1, result.e2)
    return result
