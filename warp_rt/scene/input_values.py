# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the inputs of materials are over a mesh, on the host: for displacement, and for geometry that shines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from warp_rt.scene import Image, Input, Mesh, Primvar, Texture
from warp_rt.scene.texture_values import texture_values


def input_values(
    port: Input,
    mesh: Mesh,
    constants: Mapping[str, np.ndarray],
    textures: Sequence[Texture],
    images: Sequence[Image],
) -> Primvar:
    """Return a material's input over a mesh, by corner as its primvars: float64 values, shape [k, 4].

    Args:
        port: The input.
        mesh: The mesh. A primvar of its own precedes an inherited one, and that the fallback.
        constants: Primvars that the mesh inherits, float32, shape [c], by name.
        textures: Rows that ``Input.texture`` counts.
        images: Rows that ``Texture.image`` counts.
    """
    if port.texture >= 0:
        texture = textures[port.texture]
        st = _primvar(texture.primvar, mesh, constants, (*texture.uv_fallback, 0.0, 0.0))
        return _picked(Primvar(texture_values(texture, images, st.values[:, :2]), st.indices), port)
    given = _primvar(port.primvar, mesh, constants, port.value)
    return _picked(Primvar(given.values * port.scale + port.bias, given.indices), port)


def values_within(
    port: Input,
    mesh: Mesh,
    constants: Mapping[str, np.ndarray],
    textures: Sequence[Texture],
    images: Sequence[Image],
    triangles: np.ndarray,
    count: int,
) -> np.ndarray:
    """Return a material's input at places that stand for equal parts of each of some triangles.

    Arguments are those of ``input_values``, and

    Args:
        triangles: Their rows, shape [k].
        count: How many places a triangle, about; the corners of what is linear between them are as good.

    Returns:
        float64, shape [k, n, 4]; k is 1 where all triangles have the same.
    """
    if port.texture < 0:
        return _at_corners(input_values(port, mesh, constants, textures, images), triangles)
    texture = textures[port.texture]
    st = _at_corners(_primvar(texture.primvar, mesh, constants, (*texture.uv_fallback, 0.0, 0.0)), triangles)
    places = np.einsum("pc,kcx->kpx", _equal_parts(count), st[..., :2])
    found = texture_values(texture, images, places.reshape(-1, 2))
    return _picked(Primvar(found), port).values.reshape(*places.shape[:2], 4)


def _at_corners(primvar: Primvar, triangles: np.ndarray) -> np.ndarray:
    if primvar.indices is None:
        return np.repeat(primvar.values[None, :1], 3, axis=1)
    return np.asarray(primvar.values[primvar.indices[triangles]])


def _equal_parts(count: int) -> np.ndarray:
    """Return the middles of the like triangles that lines along its sides cut a triangle into: shape [n, 3]."""
    rows = max(int(np.sqrt(count)), 1)
    i, j = (axis.reshape(-1) for axis in np.mgrid[:rows, :rows])
    upright = np.stack([i, j], axis=1)[i + j < rows] + 1 / 3
    inverted = np.stack([i, j], axis=1)[i + j < rows - 1] + 2 / 3
    places = np.concatenate([upright, inverted]) / rows
    return np.column_stack([1 - places.sum(axis=1), places])


def _picked(found: Primvar, port: Input) -> Primvar:
    """Return the one channel that an input takes, in place of all four; all of them where it takes a vector."""
    if port.channel < 0:
        return found
    return Primvar(np.repeat(found.values[:, port.channel, None], 4, axis=1), found.indices)


def _primvar(
    name: str, mesh: Mesh, constants: Mapping[str, np.ndarray], fallback: tuple[float, float, float, float]
) -> Primvar:
    """Return a primvar padded to four components with zeros."""
    if name and name in mesh.primvars:
        values, indices = mesh.primvars[name].values, mesh.primvars[name].indices
    elif name and name in constants:
        values, indices = constants[name][None], None
    else:
        values, indices = np.array([fallback]), None
    padded = np.zeros((len(values), 4))
    padded[:, : values.shape[1]] = values
    return Primvar(padded, indices)
