# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The inputs of WhittedSurface at many hits at once, in float64: constants, textures, primvars.

Written from docs/whitted.md, docs/usd.md and the UsdPreviewSurface specification's UsdUVTexture, with NumPy alone.
"""

from __future__ import annotations

import numpy as np

from warp_rt import Scene
from warp_rt.scene import MATERIAL_DEFAULTS, Image, Input, MaterialModel, Texture, Wrap

DEFAULTS = MATERIAL_DEFAULTS[MaterialModel.WHITTED]


class Hits:
    """Where rays met triangles.

    Args:
        scene: The scene.
        body: Row of the instance at each hit, shape [n].
        triangle: Index within that instance's mesh, shape [n].
        material: Row of ``Scene.materials``, shape [n].
        alpha: Barycentric coordinate of the triangle's second corner, shape [n].
        beta: Of its third.
    """

    def __init__(
        self,
        scene: Scene,
        body: np.ndarray,
        triangle: np.ndarray,
        material: np.ndarray,
        alpha: np.ndarray,
        beta: np.ndarray,
    ) -> None:
        self.scene, self.body, self.triangle, self.material = scene, body, triangle, material
        self.weights = np.stack([1 - alpha - beta, alpha, beta], axis=1)

    def term(self, name: str) -> np.ndarray:
        """Return an input of the material at each hit: shape [n, 3] for colours, [n] for scalars."""
        default = DEFAULTS[name]
        result = np.zeros((len(self.material), len(default)))
        for row in np.unique(self.material):
            material = self.scene.materials[row]
            if material.model != MaterialModel.WHITTED:
                raise NotImplementedError(f"{material.path}: the reference knows WhittedSurface alone")
            here = np.flatnonzero(self.material == row)
            if name in material.inputs:
                result[here] = self._input(material.inputs[name], here)[:, : len(default)]
            else:
                result[here] = default
        return result if len(default) == 3 else result[:, 0]

    def _input(self, given: Input, here: np.ndarray) -> np.ndarray:
        """Return an input at some hits: shape [k, 4]."""
        value = np.tile(np.array(given.value, float), (len(here), 1))
        if given.texture >= 0:
            texture = self.scene.textures[given.texture]
            st = self._primvar(texture.primvar, here, np.tile(texture.uv_fallback, (len(here), 1)))[:, :2]
            value = look_up(texture, self.scene.images, st)
        elif given.primvar:
            value = self._primvar(given.primvar, here, value)
        return np.repeat(value[:, given.channel, None], 4, axis=1) if given.channel >= 0 else value

    def _primvar(self, name: str, here: np.ndarray, fallback: np.ndarray) -> np.ndarray:
        """Return a primvar at some hits, padded with zeros: shape [k, 4]."""
        if name in self.scene.instances.primvars:
            raise NotImplementedError(f"{name}: the reference knows no primvars of instances")
        result = np.zeros((len(here), 4))
        result[:, : fallback.shape[1]] = fallback
        for body in np.unique(self.body[here]):
            primvar = self.scene.meshes[self.scene.instances.mesh[body]].primvars.get(name)
            if primvar is None:
                continue
            rows = np.flatnonzero(self.body[here] == body)
            corners = np.zeros((len(rows), 3), int)
            if primvar.indices is not None:
                corners = primvar.indices[self.triangle[here[rows]]]
            values = np.einsum("nk,nkc->nc", self.weights[here[rows]], primvar.values.astype(float)[corners])
            result[rows] = 0.0
            result[rows, : values.shape[1]] = values
        return result


def look_up(texture: Texture, images: tuple[Image, ...], st: np.ndarray) -> np.ndarray:
    """Return a texture's bilinearly filtered value at coordinates, shape [n, 2]: shape [n, 4]."""
    if texture.image < 0:
        return np.tile(np.array(texture.fallback, float), (len(st), 1))
    texels = images[texture.image].pixels
    texels = texels / 255.0 if texels.dtype == np.uint8 else texels.astype(float)
    if texture.is_srgb:
        c = texels[..., :3]
        linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)  # IEC 61966-2-1
        texels = np.concatenate([linear, texels[..., 3:]], axis=-1)
    height, width = texels.shape[:2]
    place = np.c_[st, np.ones(len(st))] @ texture.uv_transform.astype(float).T * (width, height) - 0.5
    first = np.floor(place).astype(int)
    result = np.zeros((len(st), 4))
    for dx in (0, 1):
        for dy in (0, 1):
            near = 1 - np.abs(first + np.array((dx, dy)) - place)
            x, has_x = _wrap(first[:, 0] + dx, width, texture.wrap_s)
            y, has_y = _wrap(first[:, 1] + dy, height, texture.wrap_t)
            result += (near[:, 0] * near[:, 1] * (has_x & has_y))[:, None] * texels[y, x]
    return result * texture.scale + texture.bias


def _wrap(index: np.ndarray, size: int, mode: Wrap) -> tuple[np.ndarray, np.ndarray]:
    """Return the texel that stands for each index, and whether there is one."""
    if mode == Wrap.REPEAT:
        return index % size, np.ones(len(index), bool)
    if mode == Wrap.MIRROR:
        index = index % (2 * size)
        return np.minimum(index, 2 * size - 1 - index), np.ones(len(index), bool)
    inside = (index >= 0) & (index < size)
    return np.clip(index, 0, size - 1), inside | (mode == Wrap.CLAMP)
