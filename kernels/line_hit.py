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
from .structs import SceneData
from .surface import max_abs, transform_vector, triangle_corners


@wp.func
def correct_hit(scene: wp.ref[SceneData], hit: wp.ref[Hit], offset: wp.vec3, direction: wp.vec3):
    """Move a hit along its triangle to where the ray's line meets it without the offset of the ray's origin.

    The ray o + t d hits the plane of normal n; from o - offset it does so at t + (n . offset) / (n . d). What would
    leave the triangle is stopped at its rim: the search has decided which one it is. Where the shift is no small part
    of the way, surfaces touch or the ray grazes, and the search is believed. On shapes ``make_surface`` does the same.

    Args:
        scene: Shading data.
        hit: Found from the shifted origin; changed in place.
        offset: From the point that the ray leaves to where its search began, world space.
        direction: Of the ray, unit, world space.
    """
    placed = scene.instances[hit.instance]
    if scene.meshes[placed.mesh].kind != TRIANGLES:
        return
    p0, p1, p2 = triangle_corners(scene, placed.mesh, hit.triangle)
    e1 = p1 - p0
    e2 = p2 - p0
    size = wp.max(wp.max(max_abs(e1), max_abs(e2)), 1.0e-30)
    e1 = e1 / size
    e2 = e2 / size
    n = wp.cross(e1, e2)
    local_offset = transform_vector(placed.local_from_world, offset)
    local_direction = transform_vector(placed.local_from_world, direction)
    facing = wp.dot(n, local_direction)
    shift = wp.dot(n, local_offset)
    if wp.abs(shift) < 0.5 * hit.t * wp.abs(facing):
        dt = shift / facing
        moved = (local_direction * dt - local_offset) / size
        scale = 1.0 / wp.dot(n, n)
        hit.u = wp.clamp(hit.u + wp.dot(wp.cross(moved, e2), n) * scale, 0.0, 1.0)
        hit.v = wp.clamp(hit.v + wp.dot(wp.cross(e1, moved), n) * scale, 0.0, 1.0 - hit.u)
        hit.t += dt
