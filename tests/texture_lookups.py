# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Textures as kernels evaluate them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from warp_rt.kernels.scene_structs import SceneData
from warp_rt.kernels.texture_node import eval_texture
from warp_rt.scene import Image, Instances, Scene, Texture
from warp_rt.upload.device_scene import upload_scene

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def look_up(
    scene: SceneData, uv: wp.array[wp.vec2], across: wp.array[wp.vec2], down: wp.array[wp.vec2], out: wp.array[wp.vec4]
):
    i = wp.tid()
    out[i] = eval_texture(scene, scene.textures[0], uv[i], across[i], down[i])


def look_up_texture(
    texture: Texture,
    images: Sequence[Image],
    uv: np.ndarray,
    across: object = (0.0, 0.0),
    down: object = (0.0, 0.0),
    texture_filter: str = "anisotropic",
) -> np.ndarray:
    """Return what the kernel makes of texture coordinates: float32, shape [n, 4].

    Args:
        texture: The texture.
        images: Of the scene.
        uv: Texture coordinates, shape [n, 2].
        across: Their change from pixel to pixel, along a row: shape [2], or [n, 2].
        down: Likewise along a column.
        texture_filter: As ``RenderOptions`` has it.
    """
    none = np.zeros(0, np.int32)
    scene = Scene(
        meshes=(),
        instances=Instances(none, np.zeros((0, 4, 4)), none, none, none, none),
        textures=(texture,),
        images=tuple(images),
    )
    device_scene = upload_scene(scene, device="cpu", texture_filter=texture_filter)
    out = wp.zeros(len(uv), dtype=wp.vec4, device="cpu")
    rows = [np.broadcast_to(np.asarray(pairs, np.float32), (len(uv), 2)).copy() for pairs in (uv, across, down)]
    pairs = [wp.array(row, dtype=wp.vec2, device="cpu") for row in rows]
    wp.launch(look_up, dim=len(uv), inputs=[device_scene.data, *pairs, out], device="cpu")
    return out.numpy()
