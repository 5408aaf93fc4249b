# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A triangle of a mesh light, taken by chance in about the proportion in which triangles light a surface.

From the root of its clusters down one of two parts is taken by what either can send: by its area and its distance, by
how it faces the surface and that it, and by what cone and focus leave of it. A part that sends nothing, for it faces
away, is below the horizon or outside of the cone, is not taken.

Reference: Conty Estevez and Kulla (2018), Importance Sampling of Many Lights with Adaptive Tree Splitting, section 4.
"""

import warp as wp

from .codes import VARIED
from .constants import LEAST_DIVISOR
from .light_structs import LightData, LightMeshData
from .light_triangle import middle_of
from .scene_structs import SceneData
from .triangle_pieces import ball_square
from .vector import max_component


@wp.struct
class PickedTriangle:
    """A triangle of a mesh light."""

    row: wp.int32
    """Of the light's."""
    chance: wp.float32
    """With which it is taken; 0: none is, for nothing of the light shines on the surface."""
    rest: wp.float32
    """What is left of the number that chose it, in [0, 1] again."""


@wp.func
def cosine_within(cosine: float, cos_reach: float, sin_reach: float) -> float:
    """Return the greatest cosine, if that is positive, of angles that differ from one by up to a reach below 180."""
    if cosine >= cos_reach:
        return 1.0
    return wp.max(cosine * cos_reach + wp.sqrt(wp.max(1.0 - cosine * cosine, 0.0)) * sin_reach, 0.0)


@wp.func
def shape_within(light: wp.ref[LightData], wi: wp.vec3, reach: float) -> float:
    """Return about what cone and focus leave of a light in directions up to an angle from one; 0 only for nothing.

    Args:
        light: The light.
        wi: Unit direction to it.
        reach: The angle [rad].
    """
    if (light.varies & VARIED) == 0:
        return 1.0
    cosine = wp.dot(wi, light.axis_z)
    inside = light.cone_angle + reach - wp.acos(wp.clamp(cosine, -1.0, 1.0))
    if inside <= 0.0:
        return 0.0
    cone = wp.min(0.5 * inside / wp.max(reach, 1.0e-6), 1.0) if light.cone_angle < wp.pi else float(1.0)
    if light.focus <= 0.0:
        return cone
    focused = wp.pow(cosine_within(wp.abs(cosine), wp.cos(reach), wp.sin(reach)), light.focus)
    return cone * (focused + wp.max(max_component(light.focus_tint), 0.0) * (1.0 - focused))


@wp.func
def part_weight(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    mesh: wp.ref[LightMeshData],
    node: int,
    position: wp.vec3,
    n: wp.vec3,
) -> float:
    """Return about what a cluster or a triangle of a mesh light sends to a surface; 0 only where that is nothing.

    Args:
        scene: Lights' triangles and clusters.
        light: The light.
        mesh: Its triangles.
        node: Row of the cluster or the triangle, as in ``LightMeshData.clusters``.
        position: Of the surface.
        n: Its unit normal.
    """
    center = wp.vec3(0.0, 0.0, 0.0)
    area = wp.vec3(0.0, 0.0, 0.0)
    size = float(0.0)
    size2 = float(0.0)
    cos_spread = float(1.0)
    if node >= mesh.leaves:
        if node - mesh.leaves >= mesh.count:
            return 0.0
        triangle = scene.light_triangles[mesh.offset + node - mesh.leaves]
        center = middle_of(triangle) - position
        area = 0.5 * wp.cross(triangle.side_x, triangle.side_y)
        size = wp.length(area)
        size2 = ball_square(triangle)
        if wp.dot(area, center) >= 0.0 and mesh.is_double_sided == 0:
            return 0.0
    else:
        cluster = scene.light_clusters[mesh.clusters + node]
        if cluster.cos_spread > 1.0:
            return 0.0
        center = cluster.center - position
        area = cluster.area
        size = cluster.size
        size2 = cluster.radius * cluster.radius
        cos_spread = cluster.cos_spread
    d2 = wp.length_sq(center)
    if d2 <= size2:
        return size / size2
    wi = center / wp.sqrt(d2)
    sin2 = size2 / d2
    height = wp.dot(n, wi)
    if height <= 0.0 and height * height >= sin2:
        return 0.0
    outwards = wp.dot(area, wi)
    # As in mesh_parts.cluster_view: within an angle b of the direction to its centre are those to its points, and
    # within a of the axis its normals.
    if mesh.is_double_sided == 0 and cos_spread > 0.0 and outwards > 0.0:
        sin_b = wp.sqrt(sin2)
        cos_b = wp.sqrt(1.0 - sin2)
        sin_a = wp.sqrt(1.0 - cos_spread * cos_spread)
        margin = sin_a * cos_b + cos_spread * sin_b
        if cos_spread * cos_b > sin_a * sin_b and outwards >= margin * wp.length(area):
            return 0.0
    # What faces the surface: of what is flat its area as seen, of a ball a quarter of its area, and something of all
    # that is near enough to do so at its edges.
    seen = wp.sqrt(outwards * outwards + 0.25 * wp.max(size * size - wp.length_sq(area), 0.0) + size * size * sin2)
    if mesh.is_double_sided == 0:
        seen = 0.5 * (seen - outwards)
    above = 0.5 * (height + wp.sqrt(height * height + sin2))
    return seen * above / d2 * shape_within(light, wi, wp.asin(wp.sqrt(sin2)))


@wp.func(inline=False)
def pick_triangle(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    mesh: wp.ref[LightMeshData],
    position: wp.vec3,
    n: wp.vec3,
    u: float,
    known: int,
) -> PickedTriangle:
    """Return a triangle of a mesh light, taken by chance, or how likely it is that one is taken.

    Args:
        scene: Lights' triangles and clusters.
        light: The light.
        mesh: Its triangles.
        position: Of the surface.
        n: Its unit normal.
        u: Number in [0, 1) that chooses.
        known: Row of one of the light's; -1: ``u`` chooses.
    """
    picked = PickedTriangle()
    picked.chance = 1.0
    picked.rest = u
    node = int(1)
    span = mesh.leaves
    while node < mesh.leaves:
        span = span / 2
        node = 2 * node
        first = part_weight(scene, light, mesh, node, position, n)
        second = part_weight(scene, light, mesh, node + 1, position, n)
        share = first / wp.max(first + second, 1.0e-37)
        is_second = picked.rest >= share
        if known >= 0:
            is_second = (known / span) % 2 == 1
        if is_second:
            picked.rest = (picked.rest - share) / wp.max(1.0 - share, LEAST_DIVISOR)
            picked.chance = picked.chance * (1.0 - share) if second > 0.0 else 0.0
            node += 1
        else:
            picked.rest = picked.rest / wp.max(share, LEAST_DIVISOR)
            picked.chance = picked.chance * share
        if picked.chance == 0.0:
            break
    picked.row = node - mesh.leaves
    return picked
