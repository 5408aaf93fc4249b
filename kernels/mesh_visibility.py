# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What of a mesh light is hidden from a surface by other parts of it: of balls side by side, of a bowl, of a ring.

Lambert's sums over triangles know nothing of what stands before them. So some points of the light, each of which stands
for as much of what it sends, are looked for along straight lines that may meet the light's own triangles; nothing else
of the scene counts.
"""

import warp as wp

from .cluster_walk import is_ball_met, meet_triangle, next_cluster
from .constants import LEAST_DIVISOR, POINTS_ACROSS, SHADOW_END
from .light_structs import LightCluster, LightMeshData
from .light_triangle import VisiblePart
from .scene_structs import SceneData

OUTSIDE = wp.constant(1)
"""Bit of ``LightTriangle.free_sides``: from its outside nothing of the light can be before it,"""
INSIDE = wp.constant(2)
"""or from its inside."""


@wp.struct
class SeenPoints:
    """Points of a part of a mesh light that a surface sees past the rest."""

    share: wp.float32
    """Of those that were looked for."""
    center: wp.vec3
    """One that is seen, from the surface; zero where none is."""
    normal: wp.vec3
    """There, of either sign and any length."""


@wp.func
def is_free(part: wp.ref[VisiblePart]) -> bool:
    """Return whether nothing of a mesh light can be before a part of it, from the side that is seen."""
    is_outside = wp.dot(part.normal, part.center) < 0.0
    return (part.free_sides & (OUTSIDE if is_outside else INSIDE)) != 0


@wp.func
def ball_around(mesh: wp.ref[LightMeshData], row: int) -> int:
    """Return the row in ``SceneData.light_clusters`` of the ball that a triangle of a mesh light stands for.

    Args:
        mesh: One that consists of balls.
        row: Of the triangle, of the light's.
    """
    return mesh.clusters + ((mesh.leaves + row) >> mesh.ball_bits)


@wp.func
def front_of_ball(ball: LightCluster, position: wp.vec3) -> wp.vec3:
    """Return what of a ball is nearest to a surface outside of it, from there.

    Args:
        ball: The ball.
        position: Of the surface.
    """
    center = ball.center - position
    return center * (1.0 - ball.radius / wp.max(wp.length(center), ball.radius))


@wp.func(inline=False)
def is_hidden(scene: wp.ref[SceneData], mesh: wp.ref[LightMeshData], position: wp.vec3, p: wp.vec3, body: int) -> bool:
    """Return whether a mesh light's own triangles are between a surface and a point of the light.

    Args:
        scene: Lights' triangles and clusters.
        mesh: The light's.
        position: Of the surface.
        p: The point, from the surface.
        body: Convex body whose outside it is on, which does not hide it; -1: of none.
    """
    distance = wp.length(p)
    wi = p / wp.max(distance, LEAST_DIVISOR)
    # The surface may be the light's own, as the point is.
    end = distance * SHADOW_END
    begin = distance - end
    node = int(1)
    while True:
        is_entered = bool(False)
        if node >= mesh.leaves:
            k = mesh.offset + node - mesh.leaves
            if node - mesh.leaves < mesh.count and (body < 0 or scene.light_triangles[k].body != body):
                t = meet_triangle(scene.light_triangles[k], position, wi)
                if t > begin and t < end:
                    return True
        else:
            k = mesh.clusters + node
            if body < 0 or scene.light_clusters[k].body != body:
                center = scene.light_clusters[k].center - position
                is_entered = is_ball_met(center, scene.light_clusters[k].radius, wi, end)
        node = next_cluster(node, is_entered)
        if node == 1:
            break
    return False


@wp.func
def look_for_point(
    scene: wp.ref[SceneData],
    mesh: wp.ref[LightMeshData],
    row: int,
    place: wp.vec2,
    position: wp.vec3,
    n: wp.vec3,
    seen: wp.ref[SeenPoints],
) -> float:
    """Look for a point of a mesh light past the rest of it; return what it counts: nothing below the horizon.

    Args:
        scene: Lights' triangles and clusters.
        mesh: The light's.
        row: Of the triangle that it is on, of the light's.
        place: Of the point, by the triangle's sides.
        position: Of the surface.
        n: Its unit normal.
        seen: Takes it, its share being the sum of what counts.
    """
    triangle = scene.light_triangles[mesh.offset + row]
    p = triangle.origin - position + triangle.side_x * place[0] + triangle.side_y * place[1]
    normal = wp.cross(triangle.side_x, triangle.side_y)
    d2 = wp.max(wp.length_sq(p), LEAST_DIVISOR)
    outwards = wp.dot(normal, p)
    weight = (wp.abs(outwards) / d2) * (wp.max(wp.dot(n, p), 0.0) / d2)  # d2 squared may be too small a number
    if weight > 0.0:
        body = triangle.body if outwards < 0.0 else int(-1)
        if not is_hidden(scene, mesh, position, p, body):
            seen.share += weight
            seen.center = p
            seen.normal = normal
    return weight


@wp.func
def look_for_ball(
    scene: wp.ref[SceneData],
    mesh: wp.ref[LightMeshData],
    row: int,
    position: wp.vec3,
    n: wp.vec3,
    seen: wp.ref[SeenPoints],
) -> float:
    """Look for the front of a ball past the rest of a mesh light; return what the ball counts.

    Args:
        scene: Lights' triangles and clusters.
        mesh: The light's.
        row: Of one of the ball's triangles, of the light's.
        position: Of the surface.
        n: Its unit normal.
        seen: Takes it, its share being the sum of what counts.
    """
    ball = scene.light_clusters[ball_around(mesh, row)]
    center = ball.center - position
    d2 = wp.max(wp.length_sq(center), LEAST_DIVISOR)
    weight = ball.size * wp.max(wp.dot(n, center), 0.0) / (d2 * wp.sqrt(d2))
    if weight > 0.0:
        p = front_of_ball(ball, position)
        if not is_hidden(scene, mesh, position, p, ball.body):
            seen.share += weight
            seen.center = p
            seen.normal = -p
    return weight


@wp.func(inline=False)
def look_past_rest(
    scene: wp.ref[SceneData], mesh: wp.ref[LightMeshData], node: int, count: int, position: wp.vec3, n: wp.vec3
) -> SeenPoints:
    """Return what of a part of a mesh light a surface sees past the rest of it.

    Args:
        scene: Lights' triangles and clusters.
        mesh: The light's.
        node: Row of a cluster, or of a triangle, that faces the surface; as in ``LightMeshData.clusters``.
        count: How many points are looked for, about.
        position: Of the surface.
        n: Its unit normal.
    """
    seen = SeenPoints()
    whole = float(0.0)
    if node < mesh.leaves:
        first = node
        span = int(1)
        while first < mesh.leaves:
            first = 2 * first
            span = 2 * span
        first -= mesh.leaves
        span = wp.min(span, mesh.count - first)
        points = wp.min(wp.min(count, span), POINTS_ACROSS)
        middle = wp.vec2(1.0 / 3.0, 1.0 / 3.0)
        for k in range(points):
            row = first + ((2 * k + 1) * span) / (2 * points)
            if scene.light_clusters[mesh.clusters + node].balls > 0:
                whole += look_for_ball(scene, mesh, row, position, n, seen)
            else:
                whole += look_for_point(scene, mesh, row, middle, position, n, seen)
    else:
        rows = wp.min(int(wp.ceil(wp.sqrt(float(count)))), POINTS_ACROSS)
        step = 1.0 / float(rows)
        for row in range(rows):
            for column in range(2 * row + 1):
                # The middles of pieces that stand as the triangle does, and between them of those upside down.
                third = 1.0 + float(column % 2)
                down = (float(row) + 1.0 - third / 3.0) * step
                across = (float(column / 2) + third / 3.0) * step
                place = wp.vec2(down - across, across)
                whole += look_for_point(scene, mesh, node - mesh.leaves, place, position, n, seen)
    seen.share = seen.share / wp.max(whole, LEAST_DIVISOR)
    return seen
