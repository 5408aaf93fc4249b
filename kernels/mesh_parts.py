# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a triangle, or a cluster of triangles that acts as one patch, of a mesh light sends to a surface.

Reference: Lambert (1760), Photometria; Barnes and Hut (1986), A Hierarchical O(N log N) Force-Calculation Algorithm,
Nature 324: what is small as seen from a point acts as if all of it were at its middle.
"""

import warp as wp

from .codes import VARIED
from .constants import CLUSTER_SIZE, MESH_LIGHT_EXACT, SPAWN_OFFSET
from .light import patch_irradiance
from .light_structs import LightCluster, LightData, LightMeshData, LightTriangle
from .light_triangle import VisiblePart, middle_of, triangle_irradiance
from .light_variation import CUT, DARK
from .mesh_visibility import ball_around, front_of_ball
from .scene_structs import SceneData
from .shaped_mesh import patch_view, shade_patch, shaped_triangle
from .triangle_pieces import Grain
from .vector import max_magnitude

OUT_OF_SIGHT = wp.constant(0)
"""What :func:`cluster_view` says of a cluster: nothing of it shines on the surface,"""
ONE_PATCH = wp.constant(1)
"""all of it does, from so far that it acts as one patch,"""
CUT_UP = wp.constant(2)
"""or neither."""


@wp.func
def cluster_view(cluster: LightCluster, is_double_sided: int, position: wp.vec3, n: wp.vec3, far: float) -> int:
    """Return how a cluster of triangles lies to a surface.

    Args:
        cluster: The cluster.
        is_double_sided: 1: triangles shine to both sides.
        position: Of the surface.
        n: Its unit normal.
        far: Its radius, by its distance, up to which it may act as one patch.
    """
    if cluster.cos_spread > 1.0:
        return OUT_OF_SIGHT
    center = cluster.center - position
    height = wp.dot(n, center)
    if height <= -cluster.radius:
        return OUT_OF_SIGHT
    distance = wp.length(center)
    if distance <= cluster.radius:
        return CUT_UP
    if cluster.balls > 0:
        # One acts from any distance as if it were at its centre.
        is_patch = height >= cluster.radius and (cluster.balls == 1 or cluster.radius < far * distance)
        return ONE_PATCH if is_patch else CUT_UP
    # Directions to its points are within an angle b of that to its centre, its normals within a of its own: all of it
    # faces the surface where the angle between these two is below 90 degrees - (a + b), or none from 90 + (a + b) on.
    sin_b = cluster.radius / distance
    cos_b = wp.sqrt(1.0 - sin_b * sin_b)
    cos_a = cluster.cos_spread
    sin_a = wp.sqrt(wp.max(1.0 - cos_a * cos_a, 0.0))
    if cos_a <= 0.0 or cos_a * cos_b <= sin_a * sin_b:
        return CUT_UP
    margin = sin_a * cos_b + cos_a * sin_b
    facing = -wp.dot(wp.normalize(cluster.area), center) / distance
    if facing <= -margin and is_double_sided == 0:
        return OUT_OF_SIGHT
    if sin_b < far and height >= cluster.radius and wp.abs(facing) >= margin:
        return ONE_PATCH
    return CUT_UP


@wp.func
def cluster_irradiance(cluster: LightCluster, center: wp.vec3) -> wp.vec3:
    """Return a cluster's vector irradiance for radiance 1, right to first order in its radius by its distance.

    What a triangle of area vector a at c + p sends is -(c + p) (a . (c + p)) / |c + p|^4. Summed up over its triangles
    the terms without p are those of one patch at the centre; those linear in p need the sum of the products of a and p.
    A ball shows a quarter of its surface to all sides.

    Args:
        cluster: One that faces the surface as a whole, by either side, or that consists of balls.
        center: Its centre, from the surface.
    """
    d2 = wp.length_sq(center)
    if cluster.balls > 0:
        return center * (0.25 * cluster.size / (d2 * wp.sqrt(d2)))
    m = cluster.moment
    seen = wp.dot(cluster.area, center)
    along = wp.dot(m * center, center)
    flux = center * (seen + wp.trace(m) - 4.0 * along / d2) + wp.transpose(m) * center
    return flux * (wp.sign(seen) / (d2 * d2))


@wp.func
def triangle_part(mesh: LightMeshData, triangle: LightTriangle, n: wp.vec3, far: float) -> VisiblePart:
    """Return what a triangle of a mesh light of even radiance sends to a surface.

    Args:
        mesh: The light's.
        triangle: Its origin as seen from the surface.
        n: The surface's unit normal.
        far: As in :func:`cluster_view`.
    """
    part = VisiblePart()
    center = middle_of(triangle)
    area = 0.5 * wp.cross(triangle.side_x, triangle.side_y)
    outwards = wp.dot(area, center)
    if outwards >= 0.0 and mesh.is_double_sided == 0:
        return part
    size2 = wp.max(wp.length_sq(triangle.side_x), wp.length_sq(triangle.side_y))
    size2 = wp.max(size2, wp.length_sq(triangle.side_y - triangle.side_x))
    height = wp.dot(n, center)
    if size2 < far * far * wp.length_sq(center) and height * height >= size2:
        if height > 0.0:
            part.irradiance = patch_irradiance(center, area)
            part.center = center
        return part
    part = triangle_irradiance(triangle, n)
    if outwards < 0.0:
        part.irradiance = -part.irradiance
    return part


@wp.func
def whole_triangle(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    mesh: wp.ref[LightMeshData],
    row: int,
    position: wp.vec3,
    n: wp.vec3,
    grain: wp.ref[Grain],
) -> VisiblePart:
    """Return what a triangle of a mesh light sends to a surface, nothing in between.

    To a surface in its own plane, as the light's own is, it sends nothing; to which side of it rounding puts that does
    not tell.

    Args:
        scene: Lights' triangles and clusters, profiles.
        light: The light.
        mesh: Its triangles.
        row: Of the triangle, of the light's.
        position: Of the surface.
        n: Its unit normal.
        grain: How small pieces get, of a light whose radiance varies.
    """
    triangle = scene.light_triangles[mesh.offset + row]
    reach = wp.max(max_magnitude(triangle.origin), max_magnitude(position))
    triangle.origin = triangle.origin - position
    part = VisiblePart()
    normal = wp.cross(triangle.side_x, triangle.side_y)
    if wp.abs(wp.dot(normal, triangle.origin)) <= SPAWN_OFFSET * reach * wp.length(normal):
        return part
    if (light.varies & VARIED) == 0:
        part = triangle_part(mesh, triangle, n, smallness(mesh))
    else:
        part = shaped_triangle(scene, light, mesh, triangle, n, grain)
    part.normal = normal
    part.free_sides = triangle.free_sides
    return part


@wp.func
def whole_cluster(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    mesh: wp.ref[LightMeshData],
    node: int,
    position: wp.vec3,
    n: wp.vec3,
) -> VisiblePart:
    """Return what a cluster that acts as one patch sends to a surface, nothing in between.

    Args:
        scene: Lights' triangles and clusters, profiles.
        light: The light.
        mesh: Its triangles.
        node: Row of the cluster, of the light's.
        position: Of the surface.
        n: Its unit normal.
    """
    cluster = scene.light_clusters[mesh.clusters + node]
    center = cluster.center - position
    part = VisiblePart()
    part.irradiance = cluster_irradiance(cluster, center)
    if cluster.balls > 0:
        part.center = front_of_ball(scene.light_clusters[ball_around(mesh, cluster.middle)], position)
        part.normal = -part.center
    else:
        part.center = middle_of(scene.light_triangles[mesh.offset + cluster.middle]) - position
        part.normal = cluster.area
    if (light.varies & VARIED) != 0:
        shade_patch(scene, light, n, center, part)
    part.free_sides = cluster.free_sides
    return part


@wp.func
def smallness(mesh: wp.ref[LightMeshData]) -> float:
    """Return the radius of a part of a mesh light, by its distance, up to which it may act as one patch."""
    return CLUSTER_SIZE if mesh.count > MESH_LIGHT_EXACT else 0.0


@wp.func
def part_of_mesh(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    mesh: wp.ref[LightMeshData],
    node: int,
    position: wp.vec3,
    n: wp.vec3,
    grain: wp.ref[Grain],
) -> VisiblePart:
    """Return what a cluster or a triangle of a mesh light sends to a surface, nothing in between.

    Args:
        scene: Lights' triangles and clusters, profiles.
        light: The light.
        mesh: Its triangles.
        node: Row of the cluster or the triangle, as in ``LightMeshData.clusters``.
        position: Of the surface.
        n: Its unit normal.
        grain: How small pieces get, of a light whose radiance varies.
    """
    part = VisiblePart()
    if node >= mesh.leaves:
        if node - mesh.leaves < mesh.count:
            part = whole_triangle(scene, light, mesh, node - mesh.leaves, position, n, grain)
        return part
    cluster = scene.light_clusters[mesh.clusters + node]
    view = cluster_view(cluster, mesh.is_double_sided, position, n, smallness(mesh))
    if view != OUT_OF_SIGHT and (light.varies & VARIED) != 0:
        shape = patch_view(scene, light, cluster.center - position, cluster.radius * cluster.radius)
        if shape == DARK:
            view = int(OUT_OF_SIGHT)
        elif shape == CUT:
            view = int(CUT_UP)
    if view == ONE_PATCH:
        part = whole_cluster(scene, light, mesh, node, position, n)
    part.is_cut = 1 if view == CUT_UP else 0
    return part
