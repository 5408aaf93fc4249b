# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Inputs of materials that read a primvar which nothing in the scene has: constants, and drawn as fast as these."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warp_rt.scene import Input, Mesh, Scene


def with_constant_inputs(scene: Scene) -> Scene:
    """Return the scene with such inputs as the constants that kernels would find them to be, to the last bit."""
    names = {source.primvar for material in scene.materials for source in material.inputs.values() if source.primvar}
    missing = {name for name in names if not _is_there(scene, name)}
    if not missing:
        return scene
    materials = [
        replace(
            material,
            inputs={
                name: _constant(source) if source.primvar in missing else source
                for name, source in material.inputs.items()
            },
        )
        for material in scene.materials
    ]
    return replace(scene, materials=tuple(materials))


def _is_there(scene: Scene, name: str) -> bool:
    """Return whether any mesh, set of shapes or instance has a primvar."""
    if name in scene.instances.primvars:
        return True
    if name == "normals":
        return any(isinstance(mesh, Mesh) and mesh.normals is not None for mesh in scene.meshes)
    return any(name in mesh.primvars or (name == "st" and getattr(mesh, "has_st", False)) for mesh in scene.meshes)


def _constant(source: Input) -> Input:
    if source.texture >= 0 or source.program is not None:
        return source
    value = np.asarray(source.value, np.float32) * np.asarray(source.scale, np.float32)
    value += np.asarray(source.bias, np.float32)
    if source.channel >= 0:
        value[:] = value[source.channel]
    return Input((float(value[0]), float(value[1]), float(value[2]), float(value[3])))
