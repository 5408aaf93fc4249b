# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Mesh lights: points of triangles that are taken by what they send, and those that other directions meet."""

import warp as wp

from .cluster_walk import nearest_triangle
from .constants import LEAST_DIVISOR
from .light_direction import LightDirection
from .light_structs import LightData, LightMeshData, LightTriangle
from .pick_triangle import pick_triangle
from .scene_structs import SceneData


@wp.func
def seen_triangle(
    mesh: wp.ref[LightMeshData], triangle: LightTriangle, wi: wp.vec3, distance: float, chance: float
) -> LightDirection:
    """Return a point of a triangle, taken uniformly, with its density; 0 on a side that is dark.

    Args:
        mesh: The light's.
        triangle: World space.
        wi: Unit direction to the point.
        distance: To the point.
        chance: With which the triangle is taken.
    """
    s = LightDirection()
    s.distance = distance
    s.wi = wi
    seen = -0.5 * wp.dot(wp.cross(triangle.side_x, triangle.side_y), wi)
    if mesh.is_double_sided != 0:
        seen = wp.abs(seen)
    if seen > 0.0:
        s.pdf = chance * distance * distance / seen
    return s


@wp.func(inline=False)
def sample_mesh(
    scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3, u: wp.vec2
) -> LightDirection:
    """Return a direction to a mesh light; of density 0 to what faces away.

    Args:
        scene: Lights' triangles and clusters.
        light: A mesh light.
        position: Whence.
        n: Unit normal of the surface there.
        u: Point of the unit square.

    Reference: Turk (1990), Generating Random Points in Triangles, Graphics Gems, method 2.
    """
    mesh = scene.light_meshes[light.mesh]
    picked = pick_triangle(scene, light, mesh, position, n, u[0], -1)
    if picked.chance == 0.0:
        return LightDirection()
    triangle = scene.light_triangles[mesh.offset + picked.row]
    root = wp.sqrt(wp.clamp(picked.rest, 0.0, 1.0))
    p = triangle.origin + triangle.side_x * (1.0 - root) + triangle.side_y * (u[1] * root) - position
    distance = wp.length(p)
    return seen_triangle(mesh, triangle, p / wp.max(distance, LEAST_DIVISOR), distance, picked.chance)


@wp.func(inline=False)
def meet_mesh(
    scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3, wi: wp.vec3
) -> LightDirection:
    """Return what :func:`sample_mesh` makes of a direction from elsewhere: of the nearest point that it meets.

    Args:
        scene: Lights' triangles and clusters.
        light: A mesh light.
        position: Whence.
        n: Unit normal of the surface there.
        wi: Unit direction.
    """
    mesh = scene.light_meshes[light.mesh]
    met = nearest_triangle(scene, mesh, position, wi)
    if met.row < 0:
        return LightDirection()
    picked = pick_triangle(scene, light, mesh, position, n, 0.0, met.row)
    return seen_triangle(mesh, scene.light_triangles[mesh.offset + met.row], wi, met.distance, picked.chance)
