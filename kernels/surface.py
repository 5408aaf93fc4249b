# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The point that a ray hits: position, normals, primvars."""

import warp as wp

from .bounds import widest_axis
from .bvh_structs import Hit
from .constants import CUBIC_TUBE, GREAT_TRIANGLE, PARAMETRIC, RIM, SPAWN_OFFSET, SPAWN_OFFSET_MIN, SPHERE, TRIANGLES
from .shape_surface import point_on_shape, shape_axis, shape_st
from .structs import InstanceData, MeshData, PrimvarData, SceneData, mat34
from .vector import face_forward

NORMALS_SLOT = wp.constant(0)


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


@wp.struct
class Triangle:
    """A triangle in its mesh's space, of any size or none."""

    p0: wp.vec3
    p1: wp.vec3
    p2: wp.vec3
    size: wp.float32
    """Largest coordinate of its edges, at least 1e-30."""
    e1: wp.vec3
    """From ``p0`` to ``p1``, over ``size``; so too ``e2``, to ``p2``."""
    e2: wp.vec3
    across: wp.vec3
    """Their cross product: a normal, zero if the triangle has no area."""


@wp.func
def transform_point(m: mat34, p: wp.vec3) -> wp.vec3:
    """Return a point under an affine transform."""
    return wp.vec3(
        m[0, 0] * p[0] + m[0, 1] * p[1] + m[0, 2] * p[2] + m[0, 3],
        m[1, 0] * p[0] + m[1, 1] * p[1] + m[1, 2] * p[2] + m[1, 3],
        m[2, 0] * p[0] + m[2, 1] * p[1] + m[2, 2] * p[2] + m[2, 3],
    )


@wp.func
def transform_vector(m: mat34, v: wp.vec3) -> wp.vec3:
    """Return a vector under the linear part of an affine transform."""
    return wp.vec3(
        m[0, 0] * v[0] + m[0, 1] * v[1] + m[0, 2] * v[2],
        m[1, 0] * v[0] + m[1, 1] * v[1] + m[1, 2] * v[2],
        m[2, 0] * v[0] + m[2, 1] * v[1] + m[2, 2] * v[2],
    )


@wp.func
def transform_normal(inverse: mat34, n: wp.vec3) -> wp.vec3:
    """Return a normal under the transform whose inverse is given: by the inverse's transpose, not unit."""
    return wp.vec3(
        inverse[0, 0] * n[0] + inverse[1, 0] * n[1] + inverse[2, 0] * n[2],
        inverse[0, 1] * n[0] + inverse[1, 1] * n[1] + inverse[2, 1] * n[2],
        inverse[0, 2] * n[0] + inverse[1, 2] * n[1] + inverse[2, 2] * n[2],
    )


@wp.func
def interpolate_normal(n0: wp.vec3, n1: wp.vec3, n2: wp.vec3, alpha: float, beta: float) -> wp.vec3:
    """Return the lecture's N_P = (1 - (alpha + beta)) N0 + alpha N1 + beta N2, not unit."""
    return (1.0 - (alpha + beta)) * n0 + alpha * n1 + beta * n2


@wp.func
def transform_magnitudes(m: mat34, v: wp.vec3) -> wp.vec3:
    """Return the sums of the magnitudes that make up a transformed vector of non-negative components."""
    return wp.vec3(
        wp.abs(m[0, 0]) * v[0] + wp.abs(m[0, 1]) * v[1] + wp.abs(m[0, 2]) * v[2],
        wp.abs(m[1, 0]) * v[0] + wp.abs(m[1, 1]) * v[1] + wp.abs(m[1, 2]) * v[2],
        wp.abs(m[2, 0]) * v[0] + wp.abs(m[2, 1]) * v[1] + wp.abs(m[2, 2]) * v[2],
    )


@wp.func
def max_abs(v: wp.vec3) -> float:
    """Return the largest magnitude of three components."""
    return wp.max(wp.abs(v[0]), wp.max(wp.abs(v[1]), wp.abs(v[2])))


@wp.func
def primvar_row(scene: wp.ref[SceneData], offset: int, component_count: int, row: int) -> wp.vec4:
    """Return one row of a primvar's values, padded with zeros to four components."""
    k = offset + row * component_count
    value = wp.vec4(scene.primvar_values[k], 0.0, 0.0, 0.0)
    if component_count > 1:
        value[1] = scene.primvar_values[k + 1]
    if component_count > 2:
        value[2] = scene.primvar_values[k + 2]
    if component_count > 3:
        value[3] = scene.primvar_values[k + 3]
    return value


@wp.func
def primvar_corner(scene: wp.ref[SceneData], mesh: int, slot: int, triangle: int, corner: int) -> wp.vec4:
    """Return a primvar that the mesh has, at one corner of a triangle."""
    primvar = scene.primvars[mesh * scene.primvar_count + slot]
    row = int(0)
    if primvar.corner_offset >= 0:
        row = scene.corners[primvar.corner_offset + triangle][corner]
    return primvar_row(scene, primvar.value_offset, primvar.component_count, row)


@wp.func
def eval_along_shape(scene: wp.ref[SceneData], surface: wp.ref[Surface], primvar: PrimvarData) -> wp.vec4:
    """Return a primvar that varies over a set of shapes: its Bernstein polynomial at the surface's u."""
    mesh = scene.meshes[surface.mesh]
    count = primvar.row_count
    if count == PARAMETRIC:
        placed = scene.instances[surface.instance]
        p = transform_point(placed.local_from_world, surface.position)
        st = shape_st(scene.controls, first_control(mesh, surface.triangle), mesh.kind, p)
        return wp.vec4(st[0], st[1], 0.0, 0.0)
    first = surface.triangle * count
    v0 = primvar_row(scene, primvar.value_offset, primvar.component_count, first)
    if count == 1:
        return v0
    u = surface.u
    w = 1.0 - u
    v1 = primvar_row(scene, primvar.value_offset, primvar.component_count, first + 1)
    if count == 2:
        return v0 * w + v1 * u
    v2 = primvar_row(scene, primvar.value_offset, primvar.component_count, first + 2)
    v3 = primvar_row(scene, primvar.value_offset, primvar.component_count, first + 3)
    return v0 * (w * w * w) + v1 * (3.0 * w * w * u) + v2 * (3.0 * w * u * u) + v3 * (u * u * u)


@wp.func
def eval_primvar(scene: wp.ref[SceneData], surface: wp.ref[Surface], slot: int, fallback: wp.vec4) -> wp.vec4:
    """Return a primvar at a surface point: the instance's value, else the mesh's, else ``fallback``."""
    if scene.instance_primvars.shape[1] > 0:
        value = scene.instance_primvars[slot, surface.instance]
        if not wp.isnan(value[0]):
            return value
    primvar = scene.primvars[surface.mesh * scene.primvar_count + slot]
    if primvar.component_count == 0:
        return fallback
    if primvar.corner_offset < 0:
        if primvar.row_count != 0:
            return eval_along_shape(scene, surface, primvar)
        return primvar_row(scene, primvar.value_offset, primvar.component_count, 0)
    rows = scene.corners[primvar.corner_offset + surface.triangle]
    v0 = primvar_row(scene, primvar.value_offset, primvar.component_count, rows[0])
    v1 = primvar_row(scene, primvar.value_offset, primvar.component_count, rows[1])
    v2 = primvar_row(scene, primvar.value_offset, primvar.component_count, rows[2])
    return v0 * (1.0 - surface.u - surface.v) + v1 * surface.u + v2 * surface.v


@wp.func
def element_of(scene: wp.ref[SceneData], surface: wp.ref[Surface]) -> int:
    """Return the elementId of a surface point: the face of the source mesh."""
    face_offset = scene.meshes[surface.mesh].face_offset
    if face_offset >= 0:
        return scene.face_ids[face_offset + surface.triangle]
    return surface.triangle


@wp.func
def first_control(mesh: MeshData, shape: int) -> int:
    """Return where the control points of a shape begin in ``SceneData.controls``."""
    count = int(2)
    if mesh.kind == SPHERE:
        count = 1
    if mesh.kind == CUBIC_TUBE:
        count = 4
    return mesh.point_offset + shape * count


@wp.func
def triangle_corners(scene: wp.ref[SceneData], mesh: int, triangle: int):
    """Return the three corners of a triangle, in its mesh's space."""
    data = scene.meshes[mesh]
    corner = scene.corners[data.triangle_offset + triangle]
    p0 = scene.points[data.point_offset + corner[0]]
    p1 = scene.points[data.point_offset + corner[1]]
    p2 = scene.points[data.point_offset + corner[2]]
    return p0, p1, p2


@wp.func
def load_triangle(scene: wp.ref[SceneData], mesh: int, triangle: int) -> Triangle:
    """Return a triangle of a mesh."""
    result = Triangle()
    p0, p1, p2 = triangle_corners(scene, mesh, triangle)
    result.p0 = p0
    result.p1 = p1
    result.p2 = p2
    e1 = p1 - p0
    e2 = p2 - p0
    result.size = wp.max(wp.max(max_abs(e1), max_abs(e2)), 1.0e-30)
    result.e1 = e1 / result.size
    result.e2 = e2 / result.size
    result.across = wp.cross(result.e1, result.e2)
    return result


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
    plane_scale = 1.0 / wp.max(wp.length(n_world), 1.0e-30)
    s.n_geometric = n_world * plane_scale

    # The point by barycentrics is on the triangle to within roundings of its corners; that along the ray, of the ray.
    # Of a great ground plane only the second is any good, once t comes from the plane's equation.
    w = 1.0 - u - v
    local = w * p0 + u * p1 + v * p2
    sums = wp.abs(p0) * w + wp.abs(p1) * u + wp.abs(p2) * v
    corners = wp.max(wp.max(max_abs(p0), max_abs(p1)), max_abs(p2))
    if max_abs(local) < GREAT_TRIANGLE * corners:
        origin = transform_point(placed.local_from_world, ray_origin)
        along_ray = wp.abs(origin) + wp.abs(direction) * t
        slope = wp.dot(n_local, direction)
        if max_abs(along_ray) < GREAT_TRIANGLE * corners and slope != 0.0:
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
    point = point_on_shape(scene.controls, first, mesh.kind, int(s.v), s.u, along_ray)
    # A step along the ray to the surface, where t is of a ray that was searched from beside this one, or rounded. It is
    # left out where it is no small part of the way: surfaces touch there, or the ray grazes.
    facing = wp.dot(point.normal, direction)
    off = wp.dot(point.normal, point.position - along_ray)
    if wp.abs(off) < 0.5 * t * wp.abs(facing):
        along_ray += direction * (off / facing)
        point = point_on_shape(scene.controls, first, mesh.kind, int(s.v), point.u, along_ray)
    s.u = point.u
    s.position = transform_point(placed.world_from_local, point.position)
    n_world = transform_normal(placed.local_from_world, point.normal)
    # Planes that are 1 apart in the shape's space are this far apart in the world.
    plane_scale = 1.0 / wp.max(wp.length(n_world), 1.0e-30)
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


@wp.func
def surface_tangents(scene: wp.ref[SceneData], surface: wp.ref[Surface], slot: int):
    """Return the two world directions in which the texture coordinates of a primvar grow; zero where it has none.

    Reference: Lengyel (2001), Computing Tangent Space Basis Vectors for an Arbitrary Mesh; per triangle here.
    """
    zero = wp.vec3(0.0, 0.0, 0.0)
    mesh = scene.meshes[surface.mesh]
    primvar = scene.primvars[surface.mesh * scene.primvar_count + slot]
    placed = scene.instances[surface.instance]
    if primvar.row_count == PARAMETRIC:
        first = first_control(mesh, surface.triangle)
        axis = shape_axis(scene.controls, first, mesh.kind)
        start = scene.controls[first]
        p = transform_point(placed.local_from_world, surface.position) - wp.vec3(start[0], start[1], start[2])
        turning = wp.cross(axis, p)
        rising = wp.cross(transform_normal(placed.world_from_local, surface.n_geometric) * mesh.outward, turning)
        return transform_vector(placed.world_from_local, turning), transform_vector(placed.world_from_local, rising)
    if primvar.component_count < 2 or primvar.corner_offset < 0:
        return zero, zero
    p0, p1, p2 = triangle_corners(scene, surface.mesh, surface.triangle)
    e1 = transform_vector(placed.world_from_local, p1 - p0)
    e2 = transform_vector(placed.world_from_local, p2 - p0)
    uv0 = primvar_corner(scene, surface.mesh, slot, surface.triangle, 0)
    uv1 = primvar_corner(scene, surface.mesh, slot, surface.triangle, 1) - uv0
    uv2 = primvar_corner(scene, surface.mesh, slot, surface.triangle, 2) - uv0
    det = uv1[0] * uv2[1] - uv2[0] * uv1[1]
    if det == 0.0:
        return zero, zero
    return (e1 * uv2[1] - e2 * uv1[1]) / det, (e2 * uv1[0] - e1 * uv2[0]) / det


@wp.func
def is_at_rim(scene: wp.ref[SceneData], surface: wp.ref[Surface]) -> bool:
    """Return whether a surface point lies at the rim of its triangle."""
    is_rim = wp.min(wp.min(surface.u, surface.v), 1.0 - surface.u - surface.v) < RIM
    return is_rim and scene.meshes[surface.mesh].kind == TRIANGLES


@wp.func
def spawn_origin(scene: wp.ref[SceneData], surface: wp.ref[Surface], direction: wp.vec3) -> wp.vec3:
    """Return where a ray that leaves the surface along ``direction`` starts, so that it does not meet it again.

    The position is moved along the geometric normal, to the side of the direction, by ``Surface.clearance``. The
    triangle itself is skipped by the ray; a convex shape is met again only where the ray leaves it. At its rim, a
    triangle's neighbour can be as near, and is not: there the error of the test's t counts too, which is a mean of the
    corners along the ray's main axis, by how steeply the ray leaves.

    Reference: Pharr, Jakob and Humphreys (2023), Physically Based Rendering, sections 6.8.5 and 6.8.6; Wächter and
    Binder (2019), A Fast and Robust Method for Avoiding Self-Intersection, Ray Tracing Gems, chapter 6. Differs: bounds
    of both errors together, in the mesh's space, so that instance transforms and triangles of any size are covered.
    """
    offset = surface.clearance
    if is_at_rim(scene, surface):
        placed = scene.instances[surface.instance]
        p0, p1, p2 = triangle_corners(scene, surface.mesh, surface.triangle)
        local = transform_vector(placed.local_from_world, direction)
        axis = widest_axis(wp.abs(local))
        reach = wp.max(wp.abs(p1[axis] - p0[axis]), wp.abs(p2[axis] - p0[axis]))
        # Along the ray, t is off by this; across the plane, by that times the cosine to the normal.
        offset += reach / wp.abs(local[axis]) * wp.abs(wp.dot(surface.n_geometric, direction)) * SPAWN_OFFSET
    return surface.position + face_forward(surface.n_geometric, direction) * offset
