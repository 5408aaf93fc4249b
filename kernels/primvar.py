# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Primvars as their arrays hold them: rows of values, and which of them belongs to a triangle's corner."""

import warp as wp

from .scene_structs import SceneData

NORMALS_SLOT = wp.constant(0)
"""Slot of the shading normals among the primvars of each mesh."""


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
