# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Mesh lights: their triangles sampled by area, and met by directions that come from elsewhere."""

import warp as wp

from .light_direction import LightDirection
from .structs import LightMeshData, LightTriangle, SceneData


@wp.func
def find_triangle(scene: wp.ref[SceneData], mesh: LightMeshData, u: float) -> int:
    """Return the triangle, of a light's, that holds a share ``u`` of its area, counted from the first one."""
    low = int(0)
    high = mesh.count - 1
    while low < high:
        middle = (low + high) / 2
        if scene.light_triangles[mesh.offset + middle].share <= u:
            low = middle + 1
        else:
            high = middle
    return mesh.offset + low


@wp.func
def seen_triangle(mesh: LightMeshData, triangle: LightTriangle, wi: wp.vec3, distance: float) -> LightDirection:
    """Return a point of a triangle with the density that sampling the light's area has; 0 on a side that is dark."""
    s = LightDirection()
    s.distance = distance
    s.wi = wi
    seen = -wp.dot(wp.normalize(wp.cross(triangle.side_x, triangle.side_y)), wi)
    if mesh.is_double_sided != 0:
        seen = wp.abs(seen)
    if seen > 0.0:
        s.pdf = distance * distance / (seen * mesh.area)
    return s


@wp.func
def sample_mesh(scene: wp.ref[SceneData], row: int, position: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction to a mesh light, its area being sampled uniformly; of density 0 to what faces away.

    Args:
        scene: Lights' triangles.
        row: Of ``SceneData.light_meshes``.
        position: Whence.
        u: Point of the unit square.

    Reference: Turk (1990), Generating Random Points in Triangles, Graphics Gems, method 2.
    """
    mesh = scene.light_meshes[row]
    k = find_triangle(scene, mesh, u[0])
    triangle = scene.light_triangles[k]
    before = float(0.0)
    if k > mesh.offset:
        before = scene.light_triangles[k - 1].share
    root = wp.sqrt(wp.clamp((u[0] - before) / wp.max(triangle.share - before, 1.0e-30), 0.0, 1.0))
    p = triangle.origin + triangle.side_x * (1.0 - root) + triangle.side_y * (u[1] * root) - position
    distance = wp.length(p)
    return seen_triangle(mesh, triangle, p / wp.max(distance, 1.0e-30), distance)


@wp.func
def next_cluster(node: int, is_entered: bool) -> int:
    """Return the row of the cluster of a mesh light that comes next, depth first; 1, the root, after the last.

    Args:
        node: Row of the one before, of the heap of ``LightMeshData.clusters``, where 2 k and 2 k + 1 are in k.
        is_entered: Whether the two that are in it are next.
    """
    if is_entered:
        return 2 * node
    following = node + 1
    while following % 2 == 0:
        following = following / 2
    return following


@wp.func
def meet_triangle(triangle: LightTriangle, position: wp.vec3, wi: wp.vec3) -> float:
    """Return how far away a ray meets a triangle, from either side; 0 where it does not.

    Args:
        triangle: World space.
        position: Where the ray begins.
        wi: Unit direction.

    Reference: Moeller and Trumbore (1997), Fast, Minimum Storage Ray/Triangle Intersection, JGT 2(1).
    """
    across = wp.cross(wi, triangle.side_y)
    determinant = wp.dot(triangle.side_x, across)
    if determinant == 0.0:
        return 0.0
    start = position - triangle.origin
    u = wp.dot(start, across) / determinant
    down = wp.cross(start, triangle.side_x)
    v = wp.dot(wi, down) / determinant
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        return 0.0
    return wp.max(wp.dot(triangle.side_y, down) / determinant, 0.0)


@wp.func
def is_ball_met(center: wp.vec3, radius: float, wi: wp.vec3, end: float) -> bool:
    """Return whether a ray may meet what is in a ball before its end.

    Args:
        center: Of the ball, from where the ray begins.
        radius: Of the ball.
        wi: Unit direction.
        end: Length of the ray.
    """
    along = wp.dot(center, wi)
    return along > -radius and along - radius < end and wp.length_sq(center - wi * along) <= radius * radius


@wp.func(inline=False)
def meet_mesh(scene: wp.ref[SceneData], row: int, position: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return the nearest point of a mesh light that shines on a point from a unit direction, as if it were sampled.

    Args:
        scene: Lights' triangles and clusters.
        row: Of ``SceneData.light_meshes``.
        position: Of the point.
        wi: The direction.
    """
    mesh = scene.light_meshes[row]
    nearest = LightDirection()
    nearest.distance = wp.inf
    nearest.wi = wi
    node = int(1)
    while True:
        is_entered = bool(False)
        if node >= mesh.leaves:
            if node - mesh.leaves < mesh.count:
                triangle = scene.light_triangles[mesh.offset + node - mesh.leaves]
                distance = meet_triangle(triangle, position, wi)
                if distance > 0.0 and distance < nearest.distance:
                    met = seen_triangle(mesh, triangle, wi, distance)
                    if met.pdf > 0.0:
                        nearest = met
        else:
            cluster = scene.light_clusters[mesh.clusters + node]
            is_entered = is_ball_met(cluster.center - position, cluster.radius, wi, nearest.distance)
        node = next_cluster(node, is_entered)
        if node == 1:
            break
    return nearest
