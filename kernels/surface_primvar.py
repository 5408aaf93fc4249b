# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Primvars at a surface point, and the directions in which texture coordinates grow there."""

import warp as wp

from .constants import PARAMETRIC
from .primvar import primvar_corner, primvar_row
from .scene_structs import PrimvarData, SceneData
from .shape_surface import first_control, shape_axis, shape_st
from .surface import Surface
from .transform import transform_normal, transform_point, transform_vector
from .triangle import triangle_corners


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
