# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the materials of geometry that shines emit, part by part: the colours that tint its light.

Reference: UsdLux LightAPI, ``light:materialSyncMode``, materialGlowTintsLight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from warp_rt.scene import Image, Input, Material, MaterialModel, Mesh, Shapes, Texture
from warp_rt.scene.input_values import values_within
from warp_rt.scene.texture_values import decoded_texels

MOST_PARTS = 16
"""Colours of one geometry that are kept apart: each is a light of its own."""
_PLACES = 4096  # that the triangles of a material are asked at, together
_FEWEST = 4  # and each of them
_BLOCK = 1 << 15  # triangles that are asked at a time
_ALIKE = 1e-4  # of the greatest component


@dataclass(frozen=True)
class Glow:
    """Emission, one row for each triangle that stands for the geometry."""

    colors: np.ndarray
    """float64, shape [n, 3], of no more than ``MOST_PARTS`` colours beside black."""
    is_mean: bool
    """Whether the geometry emits unevenly where these have one colour."""
    is_computed: bool = False
    """Whether a program computes part of it where rays hit, for which white stands here."""

    def parts(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return each colour but black, shape [3], and the rows that have it."""
        colors, part = np.unique(self.colors, axis=0, return_inverse=True)
        found = [(color, np.flatnonzero(part.reshape(-1) == k)) for k, color in enumerate(colors)]
        return [(color, rows) for color, rows in found if color.any()]


def glow_of(
    mesh: Mesh | Shapes,
    materials: Sequence[Material],
    constants: Mapping[str, np.ndarray],
    textures: Sequence[Texture],
    images: Sequence[Image],
    areas: np.ndarray,
) -> Glow:
    """Return what geometry emits.

    Of a mesh, each triangle has its own colour where there are few of them, each the same all over its triangles. Else
    what a material emits is the mean over the triangles that have it and are not black; of shapes, over all of them.

    Args:
        mesh: The geometry.
        materials: Of its slots.
        constants: Primvars that it inherits, or has as a copy, float32, shape [c], by name.
        textures: Rows that ``Input.texture`` counts.
        images: Rows that ``Texture.image`` counts.
        areas: Of the triangles that stand for it, shape [n]: a mesh's own, or those about shapes.
    """
    found = _glow(mesh, materials, constants, textures, images, areas)
    return replace(found, is_computed=any(_is_computed(material) for material in materials))


def _glow(
    mesh: Mesh | Shapes,
    materials: Sequence[Material],
    constants: Mapping[str, np.ndarray],
    textures: Sequence[Texture],
    images: Sequence[Image],
    areas: np.ndarray,
) -> Glow:
    if isinstance(mesh, Shapes):
        color, is_mean = _mean_of_shapes(mesh, _emission(materials[0]), constants, textures, images)
        return Glow(np.tile(color, (len(areas), 1)), is_mean)
    if any(name in mesh.primvars for name in constants):
        own = {name: primvar for name, primvar in mesh.primvars.items() if name not in constants}
        mesh = replace(mesh, primvars=own)
    slots = np.zeros(len(areas), int) if mesh.material_slots is None else mesh.material_slots
    colors, is_mean = np.zeros((len(areas), 3)), False
    for slot in np.unique(slots):
        rows = np.flatnonzero(slots == slot)
        source = _emission(materials[slot])
        if not source.varies:
            colors[rows] = source.value[:3]
            continue
        count = max(_PLACES // len(rows), _FEWEST)
        blocks = [rows[start : start + _BLOCK] for start in range(0, len(rows), _BLOCK)]
        found = [values_within(source, mesh, constants, textures, images, block, count)[..., :3] for block in blocks]
        own_colors = np.concatenate([values.mean(axis=1) for values in found])
        scale = float(np.abs(own_colors).max(initial=0.0))
        is_even = all((np.ptp(values, axis=1) <= _ALIKE * scale).all() for values in found)
        alike, group = np.unique(np.round(own_colors / max(_ALIKE * scale, 1e-300)), axis=0, return_inverse=True)
        if is_even and len(alike) <= MOST_PARTS:
            first = np.unique(group.reshape(-1), return_index=True)[1]
            colors[rows] = own_colors[first[group.reshape(-1)]]
        else:
            colors[rows], is_mean = _with_mean(own_colors, areas[rows]), True
    if len(np.unique(colors, axis=0)) > MOST_PARTS + 1:
        return Glow(_with_mean(colors, areas), True)
    return Glow(colors, is_mean)


def _emission(material: Material) -> Input:
    found = material.inputs.get("emissiveColor")
    if found is None or material.model != MaterialModel.PREVIEW:
        return Input()
    return found if found.program is None else Input((1.0, 1.0, 1.0, 1.0))


def _is_computed(material: Material) -> bool:
    return material.model == MaterialModel.PREVIEW and any(
        source.program is not None for name, source in material.inputs.items() if name == "emissiveColor"
    )


def _with_mean(colors: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Return colours of triangles, shape [n, 3], with the mean over those that are not black in place of these."""
    shines = np.asarray(colors.any(axis=1))
    mean = areas[shines] @ colors[shines] / max(float(areas[shines].sum()), 1e-300)
    return np.where(shines[:, None], mean, 0.0)


def _mean_of_shapes(
    shapes: Shapes,
    source: Input,
    constants: Mapping[str, np.ndarray],
    textures: Sequence[Texture],
    images: Sequence[Image],
) -> tuple[np.ndarray, bool]:
    """Return the mean emission of shapes, shape [3], and whether it is not the same everywhere.

    Of a texture it is the mean of its image, wherever the shapes show it.
    """
    if source.texture >= 0:
        texture = textures[source.texture]
        if texture.image < 0:
            values, is_mean = np.array(texture.fallback), False
        else:
            rows = (texture.image,) if texture.tiles is None else texture.tiles.present
            texels = [decoded_texels(images[row].pixels, is_srgb=texture.is_srgb) for row in rows]
            values = np.mean([of_image.mean(axis=(0, 1)) for of_image in texels], axis=0)
            values, is_mean = values * texture.scale + texture.bias, True
    elif source.primvar in constants:
        values, is_mean = _padded(constants[source.primvar]), False
    elif source.primvar in shapes.primvars:
        primvar = shapes.primvars[source.primvar]
        indices = np.zeros((1, 1), int) if primvar.indices is None else primvar.indices
        found = primvar.values[indices]
        weights = np.square(shapes.radii).mean(axis=1) if len(indices) == len(shapes.radii) else np.ones(len(indices))
        values = _padded(np.average(found.mean(axis=1), axis=0, weights=weights if weights.any() else None))
        is_mean = bool(np.ptp(found, axis=(0, 1)).any())
    else:
        values, is_mean = np.array(source.value), False
    if source.texture < 0:
        values = values * source.scale + source.bias
    color = values[:3] if source.channel < 0 else np.repeat(values[source.channel], 3)
    return color, is_mean


def _padded(values: np.ndarray) -> np.ndarray:
    return np.pad(np.asarray(values, float), (0, 4 - len(values)))
