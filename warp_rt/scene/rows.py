# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Whether the parts of a scene that name each other by row name rows that exist: kernels look no further."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warp_rt.errors import SceneError
from warp_rt.scene.geometry import Instances, Mesh, Shapes


def check_rows(instances: Instances, mesh_count: int, material_count: int, prim_count: int) -> None:
    """Refuse rows that do not exist.

    A scene that is never shaded needs neither materials nor the paths of prims: where there are none, nothing is said
    of rows of them.

    Raises:
        SceneError: A row is out of range.
    """
    _check("mesh", instances.mesh, mesh_count, "meshes")
    _check("material_offset", instances.material_offset, len(instances.material_table), "material_table")
    if material_count:
        _check("material_table", instances.material_table, material_count, "materials")
    if prim_count:
        _check("prim", instances.prim, prim_count, "prims")


def check_materials(instances: Instances, meshes: Sequence[Mesh | Shapes], material_count: int) -> None:
    """Refuse what is to be shaded, unless all its triangles and shapes have a material.

    Raises:
        SceneError: There are no materials, or a slot lies beyond the materials' table.
    """
    if not len(instances):
        return
    if not material_count:
        raise SceneError("materials: a scene that is rendered needs at least one")
    highest = np.zeros(len(meshes), np.int64)
    for row, mesh in enumerate(meshes):
        slots = mesh.material_slots if isinstance(mesh, Mesh) else None
        if slots is not None and len(slots):
            highest[row] = slots.max()
            if slots.min() < 0:
                raise SceneError(f"material_slots: {slots.min()} of mesh {row} is below 0")
    if highest.any():
        rows = instances.material_offset + highest[instances.mesh]
        _check("material_slots", rows, len(instances.material_table), "material_table")


def _check(name: str, rows: np.ndarray, count: int, what: str) -> None:
    """Raise SceneError unless all of ``rows`` are below ``count`` and none is negative."""
    if not len(rows):
        return
    low, high = int(rows.min()), int(rows.max())
    if low < 0 or high >= count:
        raise SceneError(f"instances: {name} {low if low < 0 else high} is no row of {count} {what}")
