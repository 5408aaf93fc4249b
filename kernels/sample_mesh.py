# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Mesh lights: their triangles, sampled by area, and as a whole."""

import warp as wp

from .constants import MESH_LIGHT_PATCHES, SHADOW_END
from .light import LightSample, cone_factor, edge_irradiance
from .light_direction import LightDirection
from .structs import LightData, LightMeshData, LightTriangle, SceneData


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
    s = LightDirection()
    s.distance = wp.length(p)
    s.wi = p / wp.max(s.distance, 1.0e-30)
    normal = wp.cross(triangle.side_x, triangle.side_y)
    seen = -wp.dot(wp.normalize(normal), s.wi)
    if mesh.is_double_sided != 0:
        seen = wp.abs(seen)
    if seen > 0.0:
        s.pdf = s.distance * s.distance / (seen * mesh.area)
    return s


@wp.func
def triangle_irradiance(triangle: LightTriangle, position: wp.vec3) -> wp.vec3:
    """Return the vector irradiance at a point from a triangle of radiance 1, by Lambert's formula; either sign."""
    a = wp.normalize(triangle.origin - position)
    b = wp.normalize(triangle.origin + triangle.side_x - position)
    c = wp.normalize(triangle.origin + triangle.side_y - position)
    return 0.5 * (edge_irradiance(a, b) + edge_irradiance(b, c) + edge_irradiance(c, a))


@wp.func(inline=False)
def mesh_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3) -> LightSample:
    """Return how a mesh light reaches a point as a whole, what of it faces the point, and nothing in between.

    Up to ``MESH_LIGHT_PATCHES`` triangles are summed by Lambert's formula. Of more, that number of equal shares of the
    area stands for them, each as a patch where its middle triangle is. The shadow ray goes to what adds most.
    """
    mesh = scene.light_meshes[light.mesh]
    flux = wp.vec3(0.0, 0.0, 0.0)
    target = position
    most = float(0.0)
    count = wp.min(mesh.count, MESH_LIGHT_PATCHES)
    for k in range(count):
        row = mesh.offset + k
        if mesh.count > count:
            row = find_triangle(scene, mesh, (float(k) + 0.5) / float(count))
        triangle = scene.light_triangles[row]
        center = triangle.origin + (triangle.side_x + triangle.side_y) / 3.0
        to_center = center - position
        normal = wp.cross(triangle.side_x, triangle.side_y)
        if mesh.is_double_sided != 0 or wp.dot(normal, to_center) < 0.0:
            part = wp.vec3(0.0, 0.0, 0.0)
            if mesh.count > count:
                d2 = wp.max(wp.length_sq(to_center), 1.0e-30)
                seen = wp.abs(wp.dot(wp.normalize(normal), to_center))
                part = to_center * (seen * mesh.area / (float(count) * d2 * d2))
            else:
                part = triangle_irradiance(triangle, position)
                if wp.dot(part, to_center) < 0.0:
                    part = -part
            flux += part
            amount = wp.length(part)
            if amount > most:
                most = amount
                target = center
    s = LightSample()
    total = wp.length(flux)
    if total == 0.0:
        return s
    to_target = target - position
    distance = wp.length(to_target)
    s.wi = flux / total
    s.to_shadow = to_target / distance
    s.distance = distance * SHADOW_END
    s.irradiance = wp.cw_mul(light.emission * total, cone_factor(light, wp.dot(s.to_shadow, light.axis_z)))
    return s
