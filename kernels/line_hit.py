# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The hit of the line that a spawned ray is meant to follow.

A spawned ray is searched from a point off its surface (``spawn_origin``), which keeps it from meeting that surface
again, and moves its whole line by as much. Curved mirrors and glass magnify the shift from bounce to bounce, to well
above what float32 rounds. So the search says which triangle is hit, and where on it is corrected here.
"""

import warp as wp

from .bvh_structs import Hit
from .constants import TRIANGLES
from .scene_structs import SceneData
from .surface import Surface, begin_surface, place_on_shape, place_on_triangle
from .transform import transform_vector
from .triangle import Triangle, load_triangle


@wp.func
def correct_hit(hit: wp.ref[Hit], triangle: wp.ref[Triangle], offset: wp.vec3, direction: wp.vec3):
    """Move a hit along its triangle to where the ray's line meets it without the offset of the ray's origin.

    The ray o + t d hits the plane of normal n; from o - offset it does so at t + (n . offset) / (n . d). What would
    leave the triangle is stopped at its rim: the search has decided which one it is. Where the shift is no small part
    of the way, surfaces touch or the ray grazes, and the search is believed.

    Args:
        hit: Found from the shifted origin; changed in place.
        triangle: That was hit.
        offset: From the point that the ray leaves to where its search began, under the transform to the mesh's space.
        direction: Of the ray, unit in world space, under the same.
    """
    n = triangle.across
    facing = wp.dot(n, direction)
    shift = wp.dot(n, offset)
    if wp.abs(shift) < 0.5 * hit.t * wp.abs(facing):
        dt = shift / facing
        moved = (direction * dt - offset) / triangle.size
        scale = 1.0 / wp.dot(n, n)
        hit.u = wp.clamp(hit.u + wp.dot(wp.cross(moved, triangle.e2), n) * scale, 0.0, 1.0)
        hit.v = wp.clamp(hit.v + wp.dot(wp.cross(triangle.e1, moved), n) * scale, 0.0, 1.0 - hit.u)
        hit.t += dt


@wp.func
def surface_on_line(
    scene: wp.ref[SceneData],
    found: wp.ref[Hit],
    origin: wp.vec3,
    offset: wp.vec3,
    direction: wp.vec3,
    s: wp.ref[Surface],
) -> float:
    """Write the surface point where the line that a ray is meant to follow meets what its search has found.

    Returns the distance to it along that line. On shapes ``place_on_shape`` finds it by itself.

    Args:
        scene: Shading data.
        found: The hit.
        origin: Where the search began, world space.
        offset: From the point that the ray leaves to there.
        direction: Of the ray, unit, world space.
        s: Output.
    """
    hit = found
    placed = scene.instances[hit.instance]
    mesh = scene.meshes[placed.mesh]
    left = origin - offset
    if mesh.kind != TRIANGLES:
        begin_surface(scene, placed, mesh, hit, s)
        place_on_shape(scene, placed, mesh, hit.t, left, direction, s)
        return hit.t
    triangle = load_triangle(scene, placed.mesh, hit.triangle)
    local_direction = transform_vector(placed.local_from_world, direction)
    correct_hit(hit, triangle, transform_vector(placed.local_from_world, offset), local_direction)
    begin_surface(scene, placed, mesh, hit, s)
    place_on_triangle(scene, placed, triangle, hit.t, left, local_direction, s)
    return hit.t
