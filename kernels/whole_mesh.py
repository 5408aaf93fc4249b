# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A mesh light as a whole: the irradiance from its triangles, far ones in clusters.

Reference: Lambert (1760), Photometria; Barnes and Hut (1986), A Hierarchical O(N log N) Force-Calculation Algorithm,
Nature 324: what is small as seen from a point acts as if all of it were at its middle.
"""

import warp as wp

from .constants import CLUSTER_SIZE, MESH_LIGHT_EXACT, SHADOW_END
from .light import LightSample, cone_factor, edge_irradiance, patch_irradiance
from .sample_mesh import next_cluster
from .structs import LightCluster, LightData, LightMeshData, LightTriangle, SceneData

OUT_OF_SIGHT = wp.constant(0)
"""What :func:`cluster_view` says of a cluster: nothing of it shines on the surface,"""
ONE_PATCH = wp.constant(1)
"""all of it does, from so far that it acts as one patch,"""
CUT_UP = wp.constant(2)
"""or neither."""


@wp.struct
class VisiblePart:
    """What of a triangle is above a surface's horizon."""

    irradiance: wp.vec3
    """Vector irradiance from it for radiance 1, either sign."""
    center: wp.vec3
    """Mean of its corners, from the surface."""


@wp.func
def add_edge(part: wp.ref[VisiblePart], a: wp.vec3, b: wp.vec3):
    """Add an edge of the visible polygon, from a corner to the next one, as seen from the surface."""
    part.irradiance += 0.5 * edge_irradiance(wp.normalize(a), wp.normalize(b))
    part.center += a


@wp.func
def triangle_irradiance(triangle: LightTriangle, position: wp.vec3, n: wp.vec3) -> VisiblePart:
    """Return the vector irradiance at a surface from what is above its horizon of a triangle of radiance 1.

    The triangle is clipped at the horizon, then its edges are summed by Lambert's formula.

    Args:
        triangle: World space.
        position: Of the surface.
        n: Its unit normal.

    Reference: Sutherland and Hodgman (1974), Reentrant Polygon Clipping, CACM 17(1), against one plane.
    """
    part = VisiblePart()
    a = triangle.origin - position
    leaves = wp.vec3(0.0, 0.0, 0.0)
    enters = wp.vec3(0.0, 0.0, 0.0)
    corners = float(0.0)
    is_cut = int(0)
    for k in range(3):
        b = triangle.origin - position
        if k == 0:
            b = b + triangle.side_x
        elif k == 1:
            b = b + triangle.side_y
        height_a = wp.dot(n, a)
        height_b = wp.dot(n, b)
        if height_a > 0.0 and height_b > 0.0:
            add_edge(part, a, b)
            corners += 1.0
        elif height_a > 0.0 or height_b > 0.0:
            is_cut = 1
            crossing = a + (b - a) * (height_a / (height_a - height_b))
            corners += 1.0
            if height_a > 0.0:
                leaves = crossing
                add_edge(part, a, crossing)
            else:
                enters = crossing
                add_edge(part, crossing, b)
        a = b
    if is_cut != 0:
        add_edge(part, leaves, enters)
        corners += 1.0
    part.center = part.center / wp.max(corners, 1.0)
    return part


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
def triangle_part(
    mesh: LightMeshData, triangle: LightTriangle, position: wp.vec3, n: wp.vec3, far: float
) -> VisiblePart:
    """Return what a triangle of a mesh light sends to a surface: exact but where, far away, it is one patch.

    Args:
        mesh: The light's.
        triangle: World space.
        position: Of the surface.
        n: Its unit normal.
        far: As in :func:`cluster_view`.
    """
    part = VisiblePart()
    center = triangle.origin + (triangle.side_x + triangle.side_y) / 3.0 - position
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
    part = triangle_irradiance(triangle, position, n)
    if outwards < 0.0:
        part.irradiance = -part.irradiance
    return part


@wp.func(inline=False)
def mesh_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return how a mesh light reaches a surface as a whole: what of it faces the surface, and nothing in between.

    Triangles are summed by Lambert's formula, clipped at the horizon. Of more than ``MESH_LIGHT_EXACT``, clusters that
    face the surface as a whole, above its horizon, and whose radius is below ``CLUSTER_SIZE`` of their distance, count
    as one patch. The shadow ray goes to what adds most.

    Args:
        scene: Lights' triangles and clusters.
        light: The light.
        position: Of the surface.
        n: Its unit normal.
    """
    mesh = scene.light_meshes[light.mesh]
    far = CLUSTER_SIZE if mesh.count > MESH_LIGHT_EXACT else 0.0
    flux = wp.vec3(0.0, 0.0, 0.0)
    to_target = wp.vec3(0.0, 0.0, 0.0)
    most = float(0.0)
    node = int(1)
    while True:
        view = int(ONE_PATCH)
        part = VisiblePart()
        if node >= mesh.leaves:
            row = node - mesh.leaves
            if row < mesh.count:
                part = triangle_part(mesh, scene.light_triangles[mesh.offset + row], position, n, far)
        else:
            cluster = scene.light_clusters[mesh.clusters + node]
            view = cluster_view(cluster, mesh.is_double_sided, position, n, far)
            if view == ONE_PATCH:
                part.irradiance = patch_irradiance(cluster.center - position, cluster.area)
                triangle = scene.light_triangles[mesh.offset + cluster.middle]
                part.center = triangle.origin + (triangle.side_x + triangle.side_y) / 3.0 - position
        flux += part.irradiance
        amount = wp.length(part.irradiance)
        if amount > most:
            most = amount
            to_target = part.center
        node = next_cluster(node, view == CUT_UP)
        if node == 1:
            break
    s = LightSample()
    total = wp.length(flux)
    if total == 0.0:
        return s
    distance = wp.length(to_target)
    s.wi = flux / total
    s.to_shadow = to_target / distance
    s.distance = distance * SHADOW_END
    s.irradiance = wp.cw_mul(light.emission * total, cone_factor(light, wp.dot(s.to_shadow, light.axis_z), 0.0))
    return s
