# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The point that a ray hits: its position, its normals, and how far rounding can have moved it."""

import warp as wp

from .bvh_structs import Hit
from .constants import GREAT_TRIANGLE, LEAST_DIVISOR, SPAWN_OFFSET, SPAWN_OFFSET_MIN, TRIANGLES
from .primvar import NORMALS_SLOT, primvar_corner
from .scene_structs import InstanceData, MeshData, SceneData
from .shape_surface import first_control, point_on_shape, way_to_solid
from .transform import transform_magnitudes, transform_normal, transform_point, transform_vector
from .triangle import Triangle, load_triangle
from .vector import max_magnitude


@wp.struct
class Surface:
    """A hit, made ready for shading, in world space."""

    position: wp.vec3
    n_geometric: wp.vec3
    """Unit, outward: the side that counter-clockwise triangles face, under mirroring transforms too; of shapes, the
    outside, or the inside of those that are inside out."""
    n_shading: wp.vec3
    """Unit, interpolated, on whichever side the mesh's normals are."""
    clearance: wp.float32
    """Distance from the surface at which spawned rays start, but for those at the triangle's rim."""
    u: wp.float32
    """As in ``Hit``."""
    v: wp.float32
    triangle: wp.int32
    """Index within the mesh or the set of shapes."""
    instance: wp.int32
    mesh: wp.int32
    material: wp.int32
    dpdx: wp.vec3
    """Displacements in the surface's plane to where the rays of the next samples across and down meet it; zero where
    they do not matter: texels are then not averaged."""
    dpdy: wp.vec3


@wp.func
def interpolate_normal(n0: wp.vec3, n1: wp.vec3, n2: wp.vec3, alpha: float, beta: float) -> wp.vec3:
    """Return the lecture's N_P = (1 - (alpha + beta)) N0 + alpha N1 + beta N2, not unit."""
    return (1.0 - (alpha + beta)) * n0 + alpha * n1 + beta * n2


@wp.func
def element_of(scene: wp.ref[SceneData], surface: wp.ref[Surface]) -> int:
    """Return the elementId of a surface point: the face of the source mesh."""
    face_offset = scene.meshes[surface.mesh].face_offset
    if face_offset >= 0:
        return scene.face_ids[face_offset + surface.triangle]
    return surface.triangle


@wp.func
def spawn_clearance(
    placed: wp.ref[InstanceData], n_local: wp.vec3, sums: wp.vec3, position: wp.vec3, corners: float
) -> float:
    """Return a bound of how far rounding can have moved a position off its triangle's plane, in the mesh's space.

    That is, of the sums for it, of its transform, and of the way back, per axis, weighted with the normal: from a
    ground plane of any size, whose axis has small numbers, rays start very near.

    Args:
        placed: The instance.
        n_local: Unit normal of the triangle, in the mesh's space.
        sums: Magnitudes that were added up for the position, per axis of the mesh's space.
        position: In world space.
        corners: Largest coordinate of the triangle.
    """
    translation = wp.vec3(placed.world_from_local[0, 3], placed.world_from_local[1, 3], placed.world_from_local[2, 3])
    world = transform_magnitudes(placed.local_from_world, wp.abs(position) + wp.abs(translation))
    return wp.dot(wp.abs(n_local), sums + world) * SPAWN_OFFSET + corners * SPAWN_OFFSET_MIN


@wp.func
def make_surface(scene: wp.ref[SceneData], hit: wp.ref[Hit], ray_origin: wp.vec3, ray_direction: wp.vec3) -> Surface:
    """Return the surface point where a ray, in world space, hits a triangle, or a shape, of an instance."""
    placed = scene.instances[hit.instance]
    mesh = scene.meshes[placed.mesh]
    s = Surface()
    begin_surface(scene, placed, mesh, hit, s)
    if mesh.kind != TRIANGLES:
        place_on_shape(scene, placed, mesh, hit.t, ray_origin, ray_direction, s)
        return s
    triangle = load_triangle(scene, placed.mesh, hit.triangle)
    direction = transform_vector(placed.local_from_world, ray_direction)
    place_on_triangle(scene, placed, triangle, hit.t, ray_origin, direction, s)
    return s


@wp.func
def begin_surface(
    scene: wp.ref[SceneData],
    placed: wp.ref[InstanceData],
    mesh: wp.ref[MeshData],
    hit: wp.ref[Hit],
    s: wp.ref[Surface],
):
    """Write of a surface point what a hit says by itself."""
    s.instance = hit.instance
    s.triangle = hit.triangle
    s.mesh = placed.mesh
    s.u = hit.u
    s.v = hit.v
    slot = int(0)
    if mesh.slot_offset >= 0:
        slot = scene.material_slots[mesh.slot_offset + hit.triangle]
    s.material = scene.material_table[placed.material_offset + slot]


@wp.func
def place_on_triangle(
    scene: wp.ref[SceneData],
    placed: wp.ref[InstanceData],
    triangle: wp.ref[Triangle],
    t: float,
    ray_origin: wp.vec3,
    direction: wp.vec3,
    s: wp.ref[Surface],
):
    """Complete a surface point that lies on a triangle: its position, normals and clearance.

    Args:
        scene: Shading data.
        placed: The instance.
        triangle: Of its mesh.
        t: Distance along the ray, in world space.
        ray_origin: World space.
        direction: Of the ray, unit in world space, under the transform to the mesh's.
        s: Changed in place.
    """
    u = s.u
    v = s.v
    p0 = triangle.p0
    p1 = triangle.p1
    p2 = triangle.p2
    n_local = wp.normalize(triangle.across)
    n_world = transform_normal(placed.local_from_world, n_local)
    # Planes that are 1 apart in the mesh's space are this far apart in the world.
    plane_scale = 1.0 / wp.max(wp.length(n_world), LEAST_DIVISOR)
    s.n_geometric = n_world * plane_scale

    # The point by barycentrics is on the triangle to within roundings of its corners; that along the ray, of the ray.
    # Of a great ground plane only the second is any good, once t comes from the plane's equation.
    w = 1.0 - u - v
    local = w * p0 + u * p1 + v * p2
    sums = wp.abs(p0) * w + wp.abs(p1) * u + wp.abs(p2) * v
    corners = wp.max(wp.max(max_magnitude(p0), max_magnitude(p1)), max_magnitude(p2))
    if max_magnitude(local) < GREAT_TRIANGLE * corners:
        origin = transform_point(placed.local_from_world, ray_origin)
        along_ray = wp.abs(origin) + wp.abs(direction) * t
        slope = wp.dot(n_local, direction)
        if max_magnitude(along_ray) < GREAT_TRIANGLE * corners and slope != 0.0:
            local = origin + direction * (wp.dot(n_local, p0 - origin) / slope)
            sums = along_ray + wp.abs(p0)
    s.position = transform_point(placed.world_from_local, local)
    s.clearance = plane_scale * spawn_clearance(placed, n_local, sums, s.position, corners)
    s.n_shading = s.n_geometric
    normals = scene.primvars[s.mesh * scene.primvar_count + NORMALS_SLOT]
    if normals.component_count > 0:
        n = transform_normal(placed.local_from_world, eval_normals(scene, s.mesh, s.triangle, u, v))
        n_length = wp.length(n)
        if n_length > 0.0:
            s.n_shading = n / n_length


@wp.func
def place_on_shape(
    scene: wp.ref[SceneData],
    placed: wp.ref[InstanceData],
    mesh: wp.ref[MeshData],
    t: float,
    ray_origin: wp.vec3,
    ray_direction: wp.vec3,
    s: wp.ref[Surface],
):
    """Complete a surface point that lies on a shape: its position, normals, clearance and u."""
    origin = transform_point(placed.local_from_world, ray_origin)
    direction = transform_vector(placed.local_from_world, ray_direction)
    along_ray = origin + t * direction
    first = first_control(mesh, s.triangle)
    # Along the ray to the surface, where t is of a ray that was searched from beside this one, or rounded. A step of
    # Newton's is left out where it is no small part of the way: surfaces touch there, or the ray grazes.
    way = way_to_solid(scene.controls, first, mesh.kind, mesh.caps, t, along_ray, direction)
    if wp.isfinite(way[0]):
        along_ray += way[0] * direction
        s.v = way[1]
    point = point_on_shape(scene.controls, first, mesh.kind, int(s.v), s.u, along_ray)
    if not wp.isfinite(way[0]):
        facing = wp.dot(point.normal, direction)
        off = wp.dot(point.normal, point.position - along_ray)
        if wp.abs(off) < 0.5 * t * wp.abs(facing):
            along_ray += direction * (off / facing)
            point = point_on_shape(scene.controls, first, mesh.kind, int(s.v), point.u, along_ray)
    s.u = point.u
    s.position = transform_point(placed.world_from_local, point.position)
    n_world = transform_normal(placed.local_from_world, point.normal)
    # Planes that are 1 apart in the shape's space are this far apart in the world.
    plane_scale = 1.0 / wp.max(wp.length(n_world), LEAST_DIVISOR)
    s.n_geometric = n_world * (plane_scale * mesh.outward)
    s.n_shading = s.n_geometric
    sums = wp.vec3(point.magnitude, point.magnitude, point.magnitude)
    s.clearance = plane_scale * spawn_clearance(placed, point.normal, sums, s.position, point.magnitude)


@wp.func
def eval_normals(scene: wp.ref[SceneData], mesh: int, triangle: int, u: float, v: float) -> wp.vec3:
    """Return the interpolated normal of a mesh that has normals, local space, not unit."""
    n0 = primvar_corner(scene, mesh, NORMALS_SLOT, triangle, 0)
    n1 = primvar_corner(scene, mesh, NORMALS_SLOT, triangle, 1)
    n2 = primvar_corner(scene, mesh, NORMALS_SLOT, triangle, 2)
    return interpolate_normal(
        wp.vec3(n0[0], n0[1], n0[2]), wp.vec3(n1[0], n1[1], n1[2]), wp.vec3(n2[0], n2[1], n2[2]), u, v
    )
