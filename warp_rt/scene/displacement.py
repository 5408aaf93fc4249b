# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Displacement: points of a mesh moved along its smooth normal, and normals made anew from where they come to lie.

What lies at one place stays together: points there move alike, by the mean of what their corners say, so that no seam
of texture coordinates, normals or materials opens into a crack.

Reference: UsdPreviewSurface Specification 2.6, displacement; Cook (1984), Shade Trees, section 6.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from warp_rt.scene import Image, Input, Mesh, Primvar, Texture
from warp_rt.scene.equal_rows import number_rows
from warp_rt.scene.input_values import input_values

MAX_HEIGHT = 1e12  # the reach of a mesh's coordinates

# Components of the normals of a sheet's two sides cancel to this: they are of the same points, but for their order.
_OPPOSITE = 1e-9


@dataclass(frozen=True)
class Displacement:
    """How far a material moves its surface along the normal: ``scale`` times a scalar input, in the mesh's units."""

    height: Input
    scale: float = 1.0


def displaced(
    mesh: Mesh,
    displacements: Sequence[Displacement | None],
    constants: Mapping[str, np.ndarray],
    textures: Sequence[Texture],
    images: Sequence[Image],
) -> Mesh:
    """Return a mesh whose points are moved by the displacement of its materials.

    Corners that shared a normal at a place share one afterwards: the mean of the faces there, weighted by angle. So
    creases stay creases, and a mesh without normals stays flat.

    Args:
        mesh: The mesh; its vertices alone move, however coarse they are.
        displacements: Of each material slot; None: the surface stays.
        constants: Primvars that the mesh inherits, float32, shape [c], by name.
        textures: Rows that ``Input.texture`` counts.
        images: Rows that ``Texture.image`` counts.

    Reference: Thuermer and Wuethrich (1998), Computing Vertex Normals from Polygonal Facets (weights).
    """
    triangles = mesh.triangles.astype(np.int64)
    points = mesh.points.astype(np.float64)
    heights = _heights(mesh, displacements, constants, textures, images)
    weighted = _weighted_normals(points, triangles)
    place = _places(mesh, triangles, weighted)
    at = place[triangles]
    directions = _corner_normals(mesh, weighted)
    along = _sums(at, directions, int(place.max(initial=-1)) + 1)  # points of no triangle have a place, too, and stay
    total = np.bincount(at.reshape(-1), np.linalg.norm(directions, axis=2).reshape(-1), len(along))
    along[np.abs(along).max(axis=1) <= _OPPOSITE * total] = 0  # what is left where all cancel is rounding
    along = _unit(along)
    corners = np.bincount(at.reshape(-1), minlength=len(along))
    height = np.bincount(at.reshape(-1), heights.reshape(-1), len(along)) / np.maximum(corners, 1)
    moved = points + (height[:, None] * along)[place]
    normals = None
    if mesh.normals is not None:
        normals = _new_normals(mesh.normals, place, triangles, _weighted_normals(moved, triangles))
    return replace(mesh, points=moved.astype(np.float32), normals=normals)


def _heights(
    mesh: Mesh,
    displacements: Sequence[Displacement | None],
    constants: Mapping[str, np.ndarray],
    textures: Sequence[Texture],
    images: Sequence[Image],
) -> np.ndarray:
    """Return how far each corner of each triangle is to move: float64, shape [m, 3]."""
    heights = np.zeros(mesh.triangles.shape)
    for slot, displacement in enumerate(displacements):
        if displacement is None:
            continue
        chosen = slice(None) if mesh.material_slots is None else np.flatnonzero(mesh.material_slots == slot)
        values = input_values(displacement.height, mesh, constants, textures, images)
        rows = values.values[:, 0].astype(np.float64) * displacement.scale
        rows = np.clip(np.nan_to_num(rows), -MAX_HEIGHT, MAX_HEIGHT)
        heights[chosen] = rows[0] if values.indices is None else rows[values.indices[chosen]]
    return heights


def _places(mesh: Mesh, triangles: np.ndarray, weighted: np.ndarray) -> np.ndarray:
    """Return which points move as one, int64, shape [n]: those at one place, but for the two sides of a sheet.

    Sheets that lie back to back share places and no normal, and each goes its own way. What meets at a place at any
    other angle, be it the edge of a blade, stays together.
    """
    place = number_rows(mesh.points)
    own = _unit(_sums(triangles, weighted, len(mesh.points)))
    front = np.zeros_like(own)
    used = np.flatnonzero(own.any(axis=1))
    front[place[used]] = own[used]
    is_front = np.abs(own - front[place]).max(axis=1) <= _OPPOSITE
    is_back = np.abs(own + front[place]).max(axis=1) <= _OPPOSITE
    is_aslant = np.zeros(len(own), bool)
    is_aslant[place[used[~(is_front | is_back)[used]]]] = True
    back = np.flatnonzero(is_back & ~is_front & ~is_aslant[place])
    place[back] += len(place)
    return place


def _corner_normals(mesh: Mesh, weighted: np.ndarray) -> np.ndarray:
    """Return the normal at each corner, with the corner's weight as its length: float64, shape [m, 3, 3]."""
    if mesh.normals is None or mesh.normals.indices is None:
        return weighted
    normals = _unit(mesh.normals.values.astype(np.float64))[mesh.normals.indices]
    return normals * np.linalg.norm(weighted, axis=2, keepdims=True)


def _new_normals(old: Primvar, place: np.ndarray, triangles: np.ndarray, weighted: np.ndarray) -> Primvar:
    """Return a normal for each set of corners that had the same one at the same place."""
    rows = np.zeros_like(triangles) if old.indices is None else old.indices
    keys = place[triangles] * np.int64(len(old.values)) + number_rows(old.values)[rows]
    used, corner = np.unique(keys, return_inverse=True)
    corner = corner.reshape(triangles.shape)
    sums = _sums(corner, weighted, len(used))
    normals = _unit(sums)
    # Where faces have collapsed, the old normal is as good as any.
    lost = np.flatnonzero(~(np.abs(sums).sum(axis=1) > 0))
    if len(lost):
        previous = np.zeros((len(used), 3))
        previous[corner] = old.values[rows]
        normals[lost] = previous[lost]
    return Primvar(normals.astype(np.float32), corner.astype(np.int32))


def _weighted_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the unit normal of each triangle times its angle, for each corner: float64, shape [m, 3, 3]."""
    corner = points[triangles]
    onward = _unit(np.roll(corner, -1, axis=1) - corner)
    backward = _unit(np.roll(corner, 1, axis=1) - corner)
    normal = _unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    angle = np.arctan2(np.linalg.norm(np.cross(onward, backward), axis=2), (onward * backward).sum(axis=2))
    return normal[:, None] * angle[..., None]


def _sums(rows: np.ndarray, vectors: np.ndarray, count: int = 0) -> np.ndarray:
    """Return the sum of vectors by row: float64, shape [count or more, 3]."""
    flat = vectors.reshape(-1, 3)
    return np.stack([np.bincount(rows.reshape(-1), flat[:, axis], count) for axis in range(3)], axis=1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors of length 1; those of length 0 as they are."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
