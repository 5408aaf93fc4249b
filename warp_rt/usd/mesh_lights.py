# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Meshes that shine: their triangles, and how their material's glow tints the light.

Reference: UsdLux MeshLightAPI, and LightAPI's ``light:materialSyncMode``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd

from warp_rt.scene import Image, Input, Instances, Material, MaterialModel, Mesh, Shapes, Texture
from warp_rt.srgb import linear_from_srgb

# All that a WhittedSurface answers with.
_TERMS = ("ambient", "diffuse", "specular", "reflection", "transmission")


@dataclass(frozen=True)
class ShiningMesh:
    """What a mesh gives the light that is applied to it."""

    triangles: np.ndarray
    """float32, shape [n, 3, 3], local space, wound as seen from outside."""
    glow: np.ndarray
    """Emission of its materials, the mean over its area: float64, shape [3]."""
    has_glow_texture: bool
    """Whether a texture is part of that emission: of its image the mean is taken, wherever the mesh shows it."""


class MeshLightReader:
    """Finds the meshes of mesh lights among those that are drawn.

    Args:
        meshes: All of the scene.
        instances: Where they are placed.
        prims: Path of each of their ``prim``.
        materials: Rows of the instances' materials.
        textures: Of the materials.
        images: Of the textures.
    """

    def __init__(
        self,
        meshes: Sequence[Mesh | Shapes],
        instances: Instances,
        prims: Sequence[str],
        materials: Sequence[Material],
        textures: Sequence[Texture],
        images: Sequence[Image],
    ) -> None:
        self._meshes = meshes
        self._instances = instances
        self._prims = prims
        self._materials = materials
        self._textures = textures
        self._images = images
        self._black: list[np.ndarray] = []

    def _rows(self, prim: Usd.Prim) -> np.ndarray:
        """Return the instances that draw a prim."""
        path = str(prim.GetPath())
        return np.flatnonzero(np.isin(self._instances.prim, [k for k, name in enumerate(self._prims) if name == path]))

    def blacken(self, prim: Usd.Prim) -> None:
        """Have a mesh that shines answer to no light: ``light:materialSyncMode`` is noMaterialResponse."""
        self._black.append(self._rows(prim))

    def blackened(self) -> tuple[Instances, tuple[Material, ...]]:
        """Return the scene's instances and materials, those that are to be black with a black one."""
        if not self._black:
            return self._instances, tuple(self._materials)
        rows = np.concatenate(self._black)
        slots = 1 + max(int(self._slots(row).max(initial=0)) for row in rows)
        table, offset = self._instances.material_table, self._instances.material_offset.copy()
        offset[rows] = len(table)
        table = np.concatenate([table, np.full(slots, len(self._materials), table.dtype)])
        materials = (*self._materials, Material("", MaterialModel.WHITTED, dict.fromkeys(_TERMS, Input())))
        return replace(self._instances, material_offset=offset, material_table=table), materials

    def _slots(self, row: int) -> np.ndarray:
        """Return the material slot of each triangle of an instance's mesh: nothing where all have the first."""
        slots = self._meshes[self._instances.mesh[row]].material_slots
        return np.zeros(0, int) if slots is None else slots

    def read(self, prim: Usd.Prim) -> ShiningMesh | None:
        """Return what shines of a mesh; None where it is not drawn."""
        rows = self._rows(prim)
        if not len(rows):
            return None
        mesh = self._meshes[self._instances.mesh[rows[0]]]
        if not isinstance(mesh, Mesh):
            return None
        triangles = mesh.points[mesh.triangles]
        area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
        slots = np.zeros(len(triangles), int) if mesh.material_slots is None else mesh.material_slots
        table = self._instances.material_table[self._instances.material_offset[rows[0]] :]
        share = np.bincount(slots, weights=area.astype(float))
        materials = [self._materials[table[slot]] for slot in range(len(share))]
        glow = np.array([self._emission(material) for material in materials])
        has_texture = any(
            material.model == MaterialModel.PREVIEW and material.inputs["emissiveColor"].texture >= 0
            for material in materials
            if "emissiveColor" in material.inputs
        )
        return ShiningMesh(triangles, share @ glow / max(share.sum(), 1e-300), has_texture)

    def _emission(self, material: Material) -> np.ndarray:
        source = material.inputs.get("emissiveColor")
        if material.model != MaterialModel.PREVIEW or source is None:
            return np.zeros(3)
        return self._mean(source) if source.texture >= 0 else np.array(source.value[:3], float)

    def _mean(self, source: Input) -> np.ndarray:
        texture = self._textures[source.texture]
        if texture.image < 0:
            return np.array(texture.fallback[:3])
        rows = (texture.image,) if texture.tiles is None else texture.tiles.present
        colors = np.mean([_mean_color(self._images[row].pixels, texture.is_srgb) for row in rows], axis=0)
        mean: np.ndarray = colors * texture.scale[:3] + texture.bias[:3]
        return np.repeat(mean[source.channel], 3) if 0 <= source.channel < 3 else mean


def _mean_color(pixels: np.ndarray, is_srgb: bool) -> np.ndarray:
    color = pixels.reshape(-1, 4)[:, :3].astype(float) / (255.0 if pixels.dtype == np.uint8 else 1.0)
    return np.asarray((linear_from_srgb(color) if is_srgb else color).mean(axis=0))
