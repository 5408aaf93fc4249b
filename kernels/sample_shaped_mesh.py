# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Mesh lights that are shaped: sampled where their triangles are, and where cone and focus leave most of them."""

import warp as wp

from .cluster_walk import nearest_triangle
from .codes import VARIED
from .constants import AIMED_MESH_CONE, AIMED_MESH_FOCUS, AIMED_MOST, LEAST_DIVISOR, SHADOW_END
from .light_direction import LightDirection, cone_cap
from .light_structs import LightData
from .sample_aimed import Aim, aim_at, aimed_direction, aimed_pdf
from .sample_mesh import meet_mesh, sample_mesh
from .scene_structs import SceneData
from .triangle_pieces import ball_of_mesh


@wp.func
def aim_of_mesh(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3) -> Aim:
    """Return where a mesh light is sampled for its cone and focus, if these leave far less of it than is seen."""
    if (light.varies & VARIED) == 0:
        return Aim()
    mesh = scene.light_meshes[light.mesh]
    ball = ball_of_mesh(scene, mesh)
    center = wp.vec3(ball[0], ball[1], ball[2]) - position
    d2 = wp.max(wp.length_sq(center), LEAST_DIVISOR)
    seen = 2.0 * wp.pi
    if d2 > ball[3]:
        # About half of a surface's area is seen in the mean over all directions.
        seen *= cone_cap(wp.min(ball[3], 0.5 * mesh.area / wp.pi) / d2)
    least = AIMED_MESH_FOCUS if light.focus > 0.0 else AIMED_MESH_CONE
    return aim_at(light, center, ball[3], seen, least, AIMED_MOST)


@wp.func
def is_nearest(
    scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, d: wp.ref[LightDirection]
) -> bool:
    """Return whether nothing of a mesh light that shines on a point is before a sampled point of it."""
    mesh = scene.light_meshes[light.mesh]
    return nearest_triangle(scene, mesh, position, d.wi).distance >= d.distance * SHADOW_END


@wp.func(inline=False)
def sample_shaped_mesh(
    scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3, u: wp.vec2
) -> LightDirection:
    """Return what :func:`sample_mesh` does; of shaped lights, some directions are where that leaves most of them.

    Args:
        scene: Lights' triangles and clusters.
        light: A mesh light.
        position: Whence.
        n: Unit normal of the surface there.
        u: Point of the unit square.
    """
    aim = aim_of_mesh(scene, light, position)
    if u[0] < aim.share:
        wi = aimed_direction(aim, wp.vec2(u[0] / aim.share, u[1]))
        d = meet_mesh(scene, light, position, n, wi)
        if d.pdf > 0.0:
            d.pdf = (1.0 - aim.share) * d.pdf + aim.share * aimed_pdf(aim, wi)
        return d
    d = sample_mesh(scene, light, position, n, wp.vec2((u[0] - aim.share) / (1.0 - aim.share), u[1]))
    if aim.share > 0.0 and d.pdf > 0.0:
        d.pdf = (1.0 - aim.share) * d.pdf
        aimed = aimed_pdf(aim, d.wi)
        # Where a mesh is behind itself, aimed directions meet what is nearest alone.
        if aimed > 0.0 and is_nearest(scene, light, position, d):
            d.pdf += aim.share * aimed
    return d


@wp.func(inline=False)
def meet_shaped_mesh(
    scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3, wi: wp.vec3
) -> LightDirection:
    """Return what :func:`sample_shaped_mesh` makes of a direction from elsewhere: of the nearest point it meets."""
    d = meet_mesh(scene, light, position, n, wi)
    aim = aim_of_mesh(scene, light, position)
    if aim.share > 0.0 and d.pdf > 0.0:
        d.pdf = (1.0 - aim.share) * d.pdf + aim.share * aimed_pdf(aim, wi)
    return d
