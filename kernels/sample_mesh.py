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


@wp.func(inline=False)
def mesh_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return how a mesh light reaches a surface as a whole: what of it faces the surface, and nothing in between.

    Up to ``MESH_LIGHT_PATCHES`` triangles are summed by Lambert's formula, clipped at the horizon. Of more, that number
    of equal shares of the area stands for them, each as a patch where its middle triangle is, left out where that is
    below the horizon. The shadow ray goes to what adds most.

    Args:
        scene: Lights' triangles.
        light: The light.
        position: Of the surface.
        n: Its unit normal.
    """
    mesh = scene.light_meshes[light.mesh]
    flux = wp.vec3(0.0, 0.0, 0.0)
    to_target = wp.vec3(0.0, 0.0, 0.0)
    most = float(0.0)
    count = wp.min(mesh.count, MESH_LIGHT_PATCHES)
    for k in range(count):
        row = mesh.offset + k
        if mesh.count > count:
            row = find_triangle(scene, mesh, (float(k) + 0.5) / float(count))
        triangle = scene.light_triangles[row]
        center = triangle.origin + (triangle.side_x + triangle.side_y) / 3.0 - position
        normal = wp.cross(triangle.side_x, triangle.side_y)
        outwards = wp.dot(normal, center)
        if mesh.is_double_sided != 0 or outwards < 0.0:
            part = VisiblePart()
            if mesh.count == count:
                part = triangle_irradiance(triangle, position, n)
                if outwards < 0.0:
                    part.irradiance = -part.irradiance
            elif wp.dot(n, center) > 0.0:
                d2 = wp.max(wp.length_sq(center), 1.0e-30)
                seen = wp.abs(wp.dot(wp.normalize(normal), center))
                part.irradiance = center * (seen * mesh.area / (float(count) * d2 * d2))
                part.center = center
            flux += part.irradiance
            amount = wp.length(part.irradiance)
            if amount > most:
                most = amount
                to_target = part.center
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
