# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights as kernels read them, and what kernels see of them by their outline."""

from __future__ import annotations

import numpy as np
import warp as wp

from warp_rt.kernels.light_structs import LightData
from warp_rt.kernels.outline import SeenPart, outlined_light
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.scene import Light
from warp_rt.upload.device_lights import light_record
from warp_rt.upload.light_tables import LightTables

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def upload_light(light: Light, tables: LightTables | None = None) -> wp.array:
    """Return a light as a kernel reads it: shape [1].

    Args:
        light: The light.
        tables: Take what is beside its record.
    """
    record = np.zeros(1, LightData.numpy_dtype())
    for name, value in light_record(light, np.zeros(3), tables if tables is not None else no_tables()).items():
        record[0][name] = value
    return wp.array(record, dtype=LightData, device="cpu")


def no_tables() -> LightTables:
    """Return tables that hold nothing yet, of lights without textures."""
    return LightTables(lambda light: (-1, np.ones(3)))


@wp.kernel
def see_all(
    scene: SceneData,
    lights: wp.array[LightData],
    positions: wp.array[wp.vec3],
    normals: wp.array[wp.vec3],
    seen: wp.array[SeenPart],
):
    """See a light from places of a surface."""
    i = wp.tid()
    seen[i] = outlined_light(scene, lights[0], positions[i], normals[i])


def see_outline(scene: SceneData, light: wp.array, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return what is seen of a light from places of a surface.

    Args:
        scene: Holds the light's tables.
        light: As ``upload_light`` returns it.
        positions: Shape [n, 3].
        normals: Unit, shape [n, 3].

    Returns:
        Records of ``SeenPart``, shape [n].
    """
    seen = wp.zeros(len(positions), dtype=SeenPart, device="cpu")
    inputs = [wp.array(np.float32(rows), dtype=wp.vec3, device="cpu") for rows in (positions, normals)]
    wp.launch(see_all, len(positions), [scene, light, *inputs, seen], device="cpu")
    return seen.numpy()
