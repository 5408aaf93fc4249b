# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Meshes and shapes to a device: points, corners and primvars, in arrays that all of them share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.arrays import Joined, Packer
from warp_rt.kernels import scene_structs
from warp_rt.kernels.constants import PARAMETRIC
from warp_rt.scene import Mesh, Primvar, Scene, Shapes
from warp_rt.scene.placement import Placement, relative_points

_NORMALS = ""  # name of slot 0, which no primvar can have


def slot_name(primvar: str) -> str:
    """Return the name of the slot that has a primvar; only that of normals is another."""
    return _NORMALS if primvar == "normals" else primvar


def primvar_size(scene: Scene, name: str) -> int:
    """Return the most components that a primvar has on anything in the scene; 0: nothing has it."""
    key = slot_name(name)
    found = (_primvar_of(mesh, key) for mesh in scene.meshes)
    sizes = [primvar.values.reshape(len(primvar.values), -1).shape[1] for primvar in found if primvar is not None]
    if name == "st" and any(isinstance(mesh, Shapes) and mesh.has_st for mesh in scene.meshes):
        sizes.append(2)
    values = scene.instances.primvars.get(name)
    if values is not None and len(values):
        sizes.append(values.reshape(len(values), -1).shape[1])
    return max(sizes, default=0)


def primvar_slots(scene: Scene, shown: Iterable[str]) -> dict[str, int]:
    """Return the slot of each primvar that is read; slot 0 is the normals', slot 1 that of ``st``.

    Args:
        scene: Whose materials read them.
        shown: AOVs that are primvars.
    """
    used = [texture.primvar for texture in scene.textures]
    for source in (source for material in scene.materials for source in material.inputs.values()):
        used += [source.primvar] if source.primvar else []
        used += source.program.primvars if source.program else ()
    names = dict.fromkeys((_NORMALS, "st", *used, *map(slot_name, shown)))
    return {name: slot for slot, name in enumerate(names)}


def pack_meshes(
    data: Any, pack: Packer, meshes: Sequence[Mesh | Shapes], placement: Placement, slots: Mapping[str, int]
) -> None:
    """Write meshes and shapes to ``SceneData``.

    Args:
        data: Takes them.
        pack: Uploads them.
        meshes: All of the scene.
        placement: Where their coordinates begin.
        slots: Slot of each primvar that is read.
    """
    tables = _MeshTables()
    mesh_table = np.zeros(len(meshes), scene_structs.MeshData.numpy_dtype())
    primvar_table = np.zeros((len(meshes), len(slots)), scene_structs.PrimvarData.numpy_dtype())
    for record, primvars, mesh, origin in zip(mesh_table, primvar_table, meshes, placement.mesh_origins, strict=True):
        tables.add_mesh(record, mesh, origin)
        for name, slot in slots.items():
            tables.add_primvar(primvars[slot], mesh, name, triangle_offset=record["triangle_offset"])
    data.points = pack.chunks(tables.points.parts, wp.vec3, (3,), np.float32)
    data.controls = pack.chunks(tables.controls.parts, wp.vec4, (4,), np.float32)
    data.corners = pack.chunks(tables.corners.parts, wp.vec3i, (3,), np.int32)
    data.primvar_values = pack.chunks(tables.values.parts, wp.float32, (), np.float32)
    data.material_slots = pack.chunks(tables.material_slots.parts, wp.int32, (), np.int32)
    data.face_ids = pack.chunks(tables.face_ids.parts, wp.int32, (), np.int32)
    data.meshes = pack.array(mesh_table, scene_structs.MeshData)
    data.primvars = pack.array(primvar_table.reshape(-1), scene_structs.PrimvarData)
    data.primvar_count = len(slots)


class _MeshTables:
    """The arrays that meshes and shapes share."""

    def __init__(self) -> None:
        self.points, self.controls, self.corners = Joined(), Joined(), Joined()
        self.values, self.material_slots, self.face_ids = Joined(), Joined(), Joined()

    def add_mesh(self, record: Any, mesh: Mesh | Shapes, origin: np.ndarray) -> None:
        """Add all but primvars, and write where they are to a record of ``MeshData``.

        Args:
            record: Changed in place.
            mesh: In its own space.
            origin: Point of that space that its coordinates on the device are relative to, shape [3].
        """
        record["is_closed"] = mesh.is_closed
        record["outward"] = 1.0
        if isinstance(mesh, Shapes):
            record["kind"] = mesh.kind
            record["outward"] = -1.0 if mesh.is_inside_out else 1.0
            record["caps"] = mesh.cap_bits
            balls = np.concatenate([relative_points(mesh.points, origin), mesh.radii[:, :, None]], axis=2)
            record["point_offset"] = self.controls.append(balls.reshape(-1, 4))
        else:
            record["point_offset"] = self.points.append(relative_points(mesh.points, origin))
            record["triangle_offset"] = self.corners.append(mesh.triangles)
        record["slot_offset"] = record["face_offset"] = -1
        if isinstance(mesh, Mesh) and mesh.material_slots is not None:
            record["slot_offset"] = self.material_slots.append(mesh.material_slots)
        if mesh.face_ids is not None:
            record["face_offset"] = self.face_ids.append(mesh.face_ids)

    def add_primvar(self, record: Any, mesh: Mesh | Shapes, name: str, *, triangle_offset: int) -> None:
        """Add a primvar if the mesh has it, and write where it is to a record of ``PrimvarData``."""
        primvar = _primvar_of(mesh, name)
        if primvar is None:
            if name == "st" and isinstance(mesh, Shapes) and mesh.has_st:
                record["component_count"], record["value_offset"] = 2, self.values.count
                record["corner_offset"], record["row_count"] = -1, int(PARAMETRIC)
            return
        rows = primvar.values.reshape(len(primvar.values), -1)
        record["component_count"], record["corner_offset"] = rows.shape[1], -1
        if isinstance(mesh, Shapes) and primvar.indices is not None:
            record["row_count"] = primvar.indices.shape[1]
            rows = rows[primvar.indices.reshape(-1)]
        record["value_offset"] = self.values.append(rows.reshape(-1))
        if isinstance(mesh, Shapes):
            return
        if primvar.indices is mesh.triangles:
            record["corner_offset"] = triangle_offset
        elif primvar.indices is not None:
            record["corner_offset"] = self.corners.append(primvar.indices)


def _primvar_of(mesh: Mesh | Shapes, name: str) -> Primvar | None:
    if name != _NORMALS:
        return mesh.primvars.get(name)
    return mesh.normals if isinstance(mesh, Mesh) else None
