# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Materials and textures to a device: a row of inputs each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.arrays import Packer
from warp_rt.kernels import scene_structs
from warp_rt.kernels.codes import INPUT_COUNT, PREVIEW_INPUTS, WHITTED_INPUTS
from warp_rt.scene import MATERIAL_DEFAULTS, Input, Material, MaterialModel, Scene, Texture
from warp_rt.upload.device_images import DeviceImages
from warp_rt.upload.programs import ProgramTable

_INPUT_ROWS = {MaterialModel.WHITTED: WHITTED_INPUTS, MaterialModel.PREVIEW: PREVIEW_INPUTS}
"""Order of a material's inputs on the device."""


def pack_materials(data: Any, pack: Packer, scene: Scene, slots: Mapping[str, int], images: DeviceImages) -> None:
    """Write materials, their inputs and textures to ``SceneData``.

    Args:
        data: Takes them.
        pack: Uploads them.
        scene: Whose.
        slots: Slot of each primvar that is read.
        images: What textures show.
    """
    data.materials = pack.records(
        scene_structs.MaterialData, [_material_record(material) for material in scene.materials]
    )
    programs = ProgramTable(slots)
    inputs = np.zeros((len(scene.materials), int(INPUT_COUNT)), scene_structs.InputData.numpy_dtype())
    values = np.zeros((*inputs.shape, 4), np.float32)
    for row, value, material in zip(inputs, values, scene.materials, strict=True):
        for k, name in enumerate(_INPUT_ROWS[material.model]):
            source = material.inputs.get(name) or _default(material.model, name)
            primvar = slots[source.primvar] if source.primvar else -1
            program = -1 if source.program is None else programs.row(source.program)
            row[k] = (source.texture, primvar, source.channel, source.scale, source.bias, program)
            takes_channel = source.channel >= 0 and not source.varies
            value[k] = source.value[source.channel] if takes_channel else source.value
    data.inputs = pack.array(inputs.reshape(-1), scene_structs.InputData)
    data.input_values = pack.array(values.reshape(-1, 4), wp.vec4)
    programs.pack(data, pack)
    textures = [_texture_record(texture, slots, images) for texture in scene.textures]
    data.textures = pack.records(scene_structs.TextureData, textures)


def _default(model: MaterialModel, name: str) -> Input:
    x, y, z = (*MATERIAL_DEFAULTS[model][name], 0.0, 0.0)[:3]
    return Input((x, y, z, 0.0))


def _texture_record(texture: Texture, slots: Mapping[str, int], images: DeviceImages) -> dict[str, Any]:
    return {
        **images.of_texture(texture),
        "primvar": slots[texture.primvar],
        "uv_fallback": texture.uv_fallback,
        "wrap_s": int(texture.wrap_s),
        "wrap_t": int(texture.wrap_t),
        "mag_filter": int(texture.mag_filter),
        "scale": texture.scale,
        "bias": texture.bias,
        "fallback": texture.fallback,
    }


def _normal_frame(normal: Input | None) -> int:
    """Return ``kernels.scene_structs.MaterialData.normal_frame``."""
    if normal is None or not (normal.varies or tuple(normal.value[:3]) != (0.0, 0.0, 1.0)):
        return 0
    return int(normal.normal_frame)


def _material_record(material: Material) -> dict[str, Any]:
    normal = material.inputs.get("normal")
    return {
        "model": int(material.model),
        "use_specular_workflow": material.use_specular_workflow,
        "opacity_mode": int(material.opacity_mode),
        "opacity_threshold": material.opacity_threshold,
        "is_single_sided": material.is_single_sided,
        "normal_frame": _normal_frame(normal),
        "varying": sum(
            1 << k
            for k, name in enumerate(_INPUT_ROWS[material.model])
            if name in material.inputs and material.inputs[name].varies
        ),
    }
