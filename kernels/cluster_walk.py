# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Through the clusters of a mesh light, and what rays meet of its triangles."""

import warp as wp

from .light_structs import LightMeshData, LightTriangle
from .light_triangle import faces_away
from .scene_structs import SceneData


@wp.struct
class MetTriangle:
    """The triangle of a mesh light that a ray meets first, of those that shine on where it begins."""

    row: wp.int32
    """Of the light's; -1: it meets none."""
    distance: wp.float32


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
def nearest_triangle(
    scene: wp.ref[SceneData], mesh: wp.ref[LightMeshData], position: wp.vec3, wi: wp.vec3
) -> MetTriangle:
    """Return the nearest triangle of a mesh light that shines on a point from a unit direction.

    Args:
        scene: Lights' triangles and clusters.
        mesh: The light's.
        position: Of the point.
        wi: The direction.
    """
    nearest = MetTriangle()
    nearest.row = -1
    nearest.distance = wp.inf
    node = int(1)
    while True:
        is_entered = bool(False)
        if node >= mesh.leaves:
            if node - mesh.leaves < mesh.count:
                triangle = scene.light_triangles[mesh.offset + node - mesh.leaves]
                distance = meet_triangle(triangle, position, wi)
                if distance > 0.0 and distance < nearest.distance and not faces_away(mesh, triangle, wi):
                    nearest.row = node - mesh.leaves
                    nearest.distance = distance
        else:
            cluster = scene.light_clusters[mesh.clusters + node]
            is_entered = is_ball_met(cluster.center - position, cluster.radius, wi, nearest.distance)
        node = next_cluster(node, is_entered)
        if node == 1:
            break
    return nearest
