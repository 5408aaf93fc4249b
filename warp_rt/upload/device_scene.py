# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scene to DeviceScene: every array that shading reads, packed into one struct on one device."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.arrays import Packer
from warp_rt.device.host_memory import LARGE, give_back_freed
from warp_rt.kernels import scene_structs
from warp_rt.kernels.codes import HOLDS_OUT
from warp_rt.options import SHADOWS, TEXTURE_FILTERS, is_primvar_aov
from warp_rt.scene import Light, RayMask, Scene
from warp_rt.scene.placement import Placement, blocks, inverses, place_scene
from warp_rt.scene.rows import check_materials
from warp_rt.upload.device_images import DeviceImages
from warp_rt.upload.lights import pack_lights, with_hiding_bodies
from warp_rt.upload.materials import pack_materials
from warp_rt.upload.meshes import pack_meshes, primvar_size, primvar_slots, slot_name
from warp_rt.upload.programs import pack_spaces
from warp_rt.upload.specular_albedo import specular_albedo


@dataclass(frozen=True)
class AovPrimvar:
    """A primvar that is an AOV."""

    slot: int
    """Where ``SceneData.primvars`` has it."""
    size: int
    """Its components, 1 to 4: the most that anything drawn has; 0: nothing drawn has it."""


@dataclass(frozen=True)
class DeviceScene:
    """A scene's shading data on a device; holding this object keeps its memory alive."""

    data: Any
    """``kernels.scene_structs.SceneData``."""
    device: str
    origin: np.ndarray
    """World point that its coordinates are relative to: float64, shape [3]."""
    bytes: int
    """Device memory that its arrays take [byte]."""
    images: DeviceImages
    """Shared by the scenes of a sequence."""
    aov_primvars: Mapping[str, AovPrimvar]
    """By AOV, ``primvars:NAME``."""


def upload_scene(
    scene: Scene,
    *,
    device: str,
    placement: Placement | None = None,
    texture_filter: str = TEXTURE_FILTERS[0],
    samples_domes: bool = False,
    shadows: str = SHADOWS[0],
    aovs: Sequence[str] = (),
    previous: DeviceScene | None = None,
) -> DeviceScene:
    """Return ``scene`` on a device.

    Args:
        scene: What to upload.
        device: Resolved device.
        placement: Coordinates that its hierarchies were built in; None: as ``place_scene`` gives them.
        texture_filter: One of ``TEXTURE_FILTERS``: whether images get pyramids.
        samples_domes: Whether domes are sampled, for which the brightness of their images is summed up.
        shadows: One of ``SHADOWS``: where materials let no light through, parts of mesh lights hide each other.
        aovs: What is wanted of it; the primvars among them are uploaded.
        previous: Whose images are used again where those of ``scene`` are the same objects and read alike.

    Raises:
        SceneError: Something that is placed has no material.
    """
    check_materials(scene.instances, scene.meshes, len(scene.materials))
    placement = placement or place_scene(scene)
    shown = {aov: aov.partition(":")[2] for aov in aovs if is_primvar_aov(aov)}
    slots = primvar_slots(scene, shown.values())
    pack = Packer(device)
    data = scene_structs.SceneData()
    pack_meshes(data, pack, scene.meshes, placement, slots)
    _pack_instances(data, pack, scene, placement, slots)
    images = DeviceImages.of(
        scene,
        pack,
        has_pyramids=texture_filter == "anisotropic",
        previous=None if previous is None else previous.images,
    )
    pack_materials(data, pack, scene, slots, images)
    pack_spaces(data, pack, scene, placement)
    data.albedo = pack.array(specular_albedo().reshape(-1, 2), wp.vec2)
    lights = with_hiding_bodies(scene, shadows)
    pack_lights(data, pack, lights, scene.domes, placement.origin, images, samples_domes=samples_domes)
    images.put(data)
    aov_primvars = {aov: AovPrimvar(slots[slot_name(name)], primvar_size(scene, name)) for aov, name in shown.items()}
    return DeviceScene(data, device, placement.origin, pack.bytes, images, aov_primvars)


def with_lights(device_scene: DeviceScene, lights: Sequence[Light]) -> DeviceScene:
    """Return the same scene under other lights, without textures or domes; everything else is shared."""
    data = scene_structs.SceneData()
    for name in scene_structs.SceneData.vars:
        setattr(data, name, getattr(device_scene.data, name))
    pack_lights(data, Packer(device_scene.device), lights, (), device_scene.origin, device_scene.images)
    return replace(device_scene, data=data)


def _pack_instances(data: Any, pack: Packer, scene: Scene, placement: Placement, slots: Mapping[str, int]) -> None:
    instances = scene.instances
    layout = scene_structs.InstanceData.numpy_dtype()
    if len(instances) * np.dtype(layout).itemsize > LARGE:
        give_back_freed()
    table = np.zeros(len(instances), layout)
    for block in blocks(len(instances)):
        transforms = placement.world_from_local(block)
        table["world_from_local"][block] = transforms
        table["local_from_world"][block] = inverses(transforms)
    table["mesh"] = instances.mesh
    table["material_offset"] = instances.material_offset
    table["prim"] = instances.prim
    table["id"] = instances.instance_id
    table["flags"] = RayMask.ALL if instances.seen_by is None else instances.seen_by
    if instances.is_matte is not None:
        table["flags"] |= np.where(instances.is_matte, int(HOLDS_OUT), 0)
    data.has_hidden = bool((table["flags"] != RayMask.ALL).any())
    data.instances = pack.adopt(table, scene_structs.InstanceData)
    data.material_table = pack.array(instances.material_table.astype(np.int32), wp.int32)
    overrides = {name: rows for name, rows in instances.primvars.items() if name in slots}
    values = np.full((len(slots), len(instances) if overrides else 0, 4), np.nan, np.float32)
    for name, rows in overrides.items():
        rows = rows.reshape(len(rows), math.prod(rows.shape[1:]))
        values[slots[name], :, : rows.shape[1]] = rows
    data.instance_primvars = pack.array(values, wp.vec4, ndim=2)
