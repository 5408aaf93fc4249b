# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The space of the object, which is that of the prim that a surface belongs to, and the world's.

Points of the world are relative to ``SceneData.origin``, but those that programs hold.
"""

import warp as wp

from .op_codes import (
    OP_NORMAL_TO_WORLD,
    OP_POINT_TO_OBJECT,
    OP_POINT_TO_WORLD,
    OP_VECTOR_TO_OBJECT,
    OP_VECTOR_TO_WORLD,
)
from .scene_structs import SceneData
from .surface import Surface
from .transform import transform_normal, transform_point, transform_vector


@wp.func
def padded(v: wp.vec3) -> wp.vec4:
    """Return a vector with a fourth component of 0."""
    return wp.vec4(v[0], v[1], v[2], 0.0)


@wp.func
def point_to_object(scene: wp.ref[SceneData], surface: wp.ref[Surface], p: wp.vec3) -> wp.vec3:
    """Return a point of the world in the space of the surface's prim."""
    placed = scene.instances[surface.instance]
    local = transform_point(placed.local_from_world, p) + scene.mesh_origins[surface.mesh]
    return transform_point(scene.object_spaces[placed.prim].object_from_mesh, local)


@wp.func
def point_to_world(scene: wp.ref[SceneData], surface: wp.ref[Surface], p: wp.vec3) -> wp.vec3:
    """Return a point of the surface's prim's space in the world."""
    placed = scene.instances[surface.instance]
    local = transform_point(scene.object_spaces[placed.prim].mesh_from_object, p) - scene.mesh_origins[surface.mesh]
    return transform_point(placed.world_from_local, local)


@wp.func
def vector_to_object(scene: wp.ref[SceneData], surface: wp.ref[Surface], v: wp.vec3) -> wp.vec3:
    """Return a vector of the world in the space of the surface's prim."""
    placed = scene.instances[surface.instance]
    local = transform_vector(placed.local_from_world, v)
    return transform_vector(scene.object_spaces[placed.prim].object_from_mesh, local)


@wp.func
def vector_to_world(scene: wp.ref[SceneData], surface: wp.ref[Surface], v: wp.vec3) -> wp.vec3:
    """Return a vector of the surface's prim's space in the world."""
    placed = scene.instances[surface.instance]
    local = transform_vector(scene.object_spaces[placed.prim].mesh_from_object, v)
    return transform_vector(placed.world_from_local, local)


@wp.func
def normal_to_object(scene: wp.ref[SceneData], surface: wp.ref[Surface], n: wp.vec3) -> wp.vec3:
    """Return a normal of the world in the space of the surface's prim, unit."""
    placed = scene.instances[surface.instance]
    local = transform_normal(placed.world_from_local, n)
    return wp.normalize(transform_normal(scene.object_spaces[placed.prim].mesh_from_object, local))


@wp.func
def normal_to_world(scene: wp.ref[SceneData], surface: wp.ref[Surface], n: wp.vec3) -> wp.vec3:
    """Return a normal of the surface's prim's space in the world, unit."""
    placed = scene.instances[surface.instance]
    local = transform_normal(scene.object_spaces[placed.prim].object_from_mesh, n)
    return wp.normalize(transform_normal(placed.local_from_world, local))


@wp.func(inline=False)
def between_spaces(scene: wp.ref[SceneData], surface: wp.ref[Surface], op: int, given: wp.vec4) -> wp.vec4:
    """Return a point, vector or normal taken from one space to the other."""
    v = wp.vec3(given[0], given[1], given[2])
    if op == OP_POINT_TO_WORLD:
        v = point_to_world(scene, surface, v) + scene.origin
    elif op == OP_POINT_TO_OBJECT:
        v = point_to_object(scene, surface, v - scene.origin)
    elif op == OP_VECTOR_TO_WORLD:
        v = vector_to_world(scene, surface, v)
    elif op == OP_VECTOR_TO_OBJECT:
        v = vector_to_object(scene, surface, v)
    elif op == OP_NORMAL_TO_WORLD:
        v = normal_to_world(scene, surface, v)
    else:
        v = normal_to_object(scene, surface, v)
    return padded(v)
