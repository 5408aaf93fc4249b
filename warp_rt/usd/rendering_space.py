# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The renderingColorSpace of render settings: a scene whose colours are in the primaries that are rendered in.

Colours are read as linear Rec. 709 and taken to those primaries before anything is multiplied by them; films are taken
back. White stays white, so that a scene without hues is the same in all of them.

Reference: UsdRenderSettingsBase, renderingColorSpace.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from warp_rt.scene import (
    MATERIAL_DEFAULTS,
    Dome,
    Input,
    Instances,
    Light,
    Material,
    Mesh,
    Primvar,
    Scene,
    Shapes,
    Texture,
)
from warp_rt.usd.mixed_texture import Mix, mixed_texture

_COLORS = {
    name
    for defaults in MATERIAL_DEFAULTS.values()
    for name, default in defaults.items()
    if len(default) == 3 and name != "normal"
}


def product(from_rec709: np.ndarray | None, *colors: np.ndarray) -> np.ndarray:
    """Return the colour that is, in the primaries that are rendered in, the product of some: shape [3].

    Args:
        from_rec709: To these, shape [3, 3]; None: they are Rec. 709's.
        colors: Linear Rec. 709, as the result is, shape [3].
    """
    if from_rec709 is None:
        return np.asarray(np.prod(colors, axis=0))
    rendered = np.prod([from_rec709 @ color for color in colors], axis=0)
    return np.asarray(np.linalg.solve(from_rec709, rendered))


class RenderingSpace:
    """Takes scenes from linear Rec. 709 to other primaries.

    Args:
        from_rec709: Matrix, shape [3, 3], that leaves white as it is.
        mix: Makes images.
    """

    def __init__(self, from_rec709: np.ndarray, mix: Mix) -> None:
        self._matrix = from_rec709
        self._mix = mix
        self._textures: list[Texture] = []
        self._rows: dict[int, int] = {}  # of textures, by that of the one in Rec. 709
        self._primvars: dict[tuple[str, tuple[float, ...], tuple[float, ...]], str] = {}

    def scene(self, scene: Scene) -> Scene:
        """Return a scene with its colours in these primaries, but for its ``images``, which ``mix`` adds to."""
        self._textures = list(scene.textures)
        materials = tuple(self._material(material) for material in scene.materials)
        return replace(
            scene,
            meshes=tuple(map(self._mesh, scene.meshes)),
            instances=self._instances(scene.instances),
            materials=materials,
            textures=tuple(self._textures),
            lights=tuple(map(self._light, scene.lights)),
            domes=tuple(map(self._dome, scene.domes)),
            rendering_from_rec709=self._matrix,
        )

    def _color(self, color: tuple[float, ...]) -> tuple[float, float, float]:
        red, green, blue = (self._matrix @ np.array(color[:3])).tolist()
        return red, green, blue

    # --- materials

    def _material(self, material: Material) -> Material:
        inputs = {name: self._input(source) if name in _COLORS else source for name, source in material.inputs.items()}
        return replace(material, inputs=inputs)

    def _input(self, source: Input) -> Input:
        if (source.texture >= 0 or source.primvar) and source.channel >= 0:
            return source  # grey
        if source.program is not None:
            return replace(source, program=source.program.then(self._matrix))
        if source.texture >= 0:
            return replace(source, texture=self._texture(source.texture))
        value = np.multiply(source.value, source.scale) + source.bias if source.primvar else np.array(source.value)
        converted = (*self._color(tuple(value)), source.value[3])
        if not source.primvar:
            return replace(source, value=converted)
        key = (source.primvar, source.scale, source.bias)
        name = self._primvars.setdefault(key, f"rendering:{len(self._primvars)}:{source.primvar}")
        return replace(source, primvar=name, value=converted, scale=(1.0,) * 4, bias=(0.0,) * 4)

    def _texture(self, row: int) -> int:
        if row not in self._rows:
            linear = np.eye(4)
            linear[:3, :3] = self._matrix
            self._rows[row] = len(self._textures)
            self._textures.append(mixed_texture(self._textures[row], linear, np.zeros(4), self._mix))
        return self._rows[row]

    # --- primvars

    def _values(self, values: np.ndarray, scale: tuple[float, ...], bias: tuple[float, ...]) -> np.ndarray:
        rows = values.reshape(len(values), -1)[:, :3]
        rows = np.pad(rows, ((0, 0), (0, 3 - rows.shape[1])))
        return ((rows * scale[:3] + bias[:3]) @ self._matrix.T).astype(np.float32)

    def _mesh(self, mesh: Mesh | Shapes) -> Mesh | Shapes:
        added = {
            name: Primvar(self._values(mesh.primvars[primvar].values, scale, bias), mesh.primvars[primvar].indices)
            for (primvar, scale, bias), name in self._primvars.items()
            if primvar in mesh.primvars
        }
        return replace(mesh, primvars={**mesh.primvars, **added}) if added else mesh

    def _instances(self, instances: Instances) -> Instances:
        added: Mapping[str, np.ndarray] = {
            name: self._values(instances.primvars[primvar], scale, bias)
            for (primvar, scale, bias), name in self._primvars.items()
            if primvar in instances.primvars
        }
        return replace(instances, primvars={**instances.primvars, **added}) if added else instances

    # --- lights

    def _image(self, image: int, is_srgb: bool) -> int:
        matrix = np.eye(4)
        matrix[:3, :3] = self._matrix
        return image if image < 0 else self._mix(image, is_srgb, matrix)

    def _light(self, light: Light) -> Light:
        return replace(
            light,
            radiance=self._color(light.radiance),
            focus_tint=self._color(light.focus_tint),
            shadow=replace(light.shadow, color=self._color(light.shadow.color)),
            image=self._image(light.image, light.is_srgb),
            is_srgb=False,
        )

    def _dome(self, dome: Dome) -> Dome:
        return replace(
            dome,
            radiance=self._color(dome.radiance),
            shadow=replace(dome.shadow, color=self._color(dome.shadow.color)),
            image=self._image(dome.image, dome.is_srgb),
            is_srgb=False,
        )
