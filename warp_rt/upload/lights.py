# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights and domes to a device, with the tables of what few of them have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.arrays import Joined, Packer
from warp_rt.kernels import light_structs
from warp_rt.kernels.codes import IRRADIANCE_HEIGHT, IRRADIANCE_WIDTH
from warp_rt.scene import Dome, Light, RayMask, Scene
from warp_rt.upload.device_images import DeviceImages
from warp_rt.upload.device_lights import light_record, unit_axes
from warp_rt.upload.dome import bright_cells, irradiance_map
from warp_rt.upload.light_tables import LightTables

_MOST_CELLS = (512, 1024)
"""Rows and columns by which domes are sampled: a third of a degree, smaller than the sun; 2 MB."""


def with_hiding_bodies(scene: Scene, shadows: str) -> list[Light]:
    """Return a scene's lights, ``Light.drawn_by`` being left only to those whose parts hide each other.

    They do not where the light casts no shadows, where some of what draws it casts none of it, or lets light through.

    Args:
        scene: Has the lights, and what draws them.
        shadows: One of ``warp_rt.options.SHADOWS``: what lets light through.
    """
    instances = scene.instances
    ends = np.append(np.unique(instances.material_offset), len(instances.material_table))
    return [
        light if _hides_itself(light, scene, shadows, ends) else replace(light, drawn_by=None) for light in scene.lights
    ]


def _hides_itself(light: Light, scene: Scene, shadows: str, ends: np.ndarray) -> bool:
    """Return whether parts of a light hide each other; ``ends`` are where instances' rows of materials may end."""
    rows, instances = light.drawn_by, scene.instances
    if rows is None or not light.casts_shadow:
        return False
    if light.shadow.casters is not None and not light.shadow.casters[rows].all():
        return False
    if instances.seen_by is not None and not (instances.seen_by[rows] & RayMask.SHADOWS).all():
        return False
    if shadows == "opaque":
        return True
    with_whitted = shadows == "transmit"
    for first in np.unique(instances.material_offset[rows]):
        slots = instances.material_table[first : ends[np.searchsorted(ends, first, side="right")]]
        if any(scene.materials[slot].lets_light_through(with_whitted=with_whitted) for slot in np.unique(slots)):
            return False
    return True


def pack_lights(
    data: Any,
    pack: Packer,
    lights: Sequence[Light],
    domes: Sequence[Dome],
    origin: np.ndarray,
    images: DeviceImages,
    *,
    samples_domes: bool = False,
) -> None:
    """Write lights, domes and what few of them have to ``SceneData``.

    Args:
        data: Takes them.
        pack: Uploads them.
        lights: All but domes.
        domes: Likewise.
        origin: World point that device coordinates are relative to, shape [3].
        images: What they show.
        samples_domes: Whether domes are sampled, for which the brightness of their images is summed up.
    """
    tables = LightTables(images.of_light)
    data.lights = pack.records(light_structs.LightData, [light_record(light, origin, tables) for light in lights])
    data.light_count = len(lights)
    maps = Joined()
    cells = Joined() if samples_domes else None
    data.domes = pack.records(
        light_structs.DomeData, [_dome_record(dome, images, tables, maps, cells) for dome in domes]
    )
    data.dome_count = len(domes)
    data.irradiance = pack.chunks(maps.parts, wp.vec3, (3,), np.float32)
    data.dome_cells = pack.chunks(cells.parts if cells else [], wp.float32, (), np.float32)
    data.links = pack.array(tables.links.words(), wp.uint32)
    data.shadows = pack.records(light_structs.ShadowData, tables.shadows)
    data.profiles = pack.records(light_structs.ProfileData, tables.profiles)
    data.light_meshes = pack.records(light_structs.LightMeshData, tables.meshes)
    triangles = [np.zeros(0, light_structs.LightTriangle.numpy_dtype()), *tables.triangles]
    data.light_triangles = pack.array(np.concatenate(triangles), light_structs.LightTriangle)
    clusters = [np.zeros(0, light_structs.LightCluster.numpy_dtype()), *tables.clusters]
    data.light_clusters = pack.array(np.concatenate(clusters), light_structs.LightCluster)
    data.light_textures = pack.records(light_structs.LightTextureData, tables.textures)
    data.profile_numbers = pack.array(tables.profile_numbers(), wp.float32)
    data.meridians = pack.records(light_structs.MeridianData, tables.meridians)
    data.meridian_sums = pack.array(tables.meridian_sums(), wp.vec4)


def _dome_record(
    dome: Dome, images: DeviceImages, tables: LightTables, maps: Joined, cells: Joined | None
) -> dict[str, Any]:
    axes, _ = unit_axes(dome.world_from_light)
    offset = cells_offset = -1
    rows = columns = 0
    if dome.image >= 0:
        irradiance = images.derived(_irradiance, dome.image, is_srgb=dome.is_srgb)
        offset = maps.append((irradiance * dome.radiance).reshape(-1, 3))
        if cells is not None:
            sums, rows, columns = images.derived(_bright_cells, dome.image, is_srgb=dome.is_srgb)
            cells_offset = cells.append(sums)
    return {
        "axis_x": axes[0],
        "axis_y": axes[1],
        "axis_z": axes[2],
        "radiance": dome.radiance,
        "image": images.row(dome.image, is_srgb=dome.is_srgb),
        "is_visible": dome.is_visible,
        "irradiance_offset": offset,
        "cells_offset": cells_offset,
        "cell_rows": rows,
        "cell_columns": columns,
        "diffuse": dome.diffuse,
        "specular": dome.specular,
        "receivers": tables.links.add(dome.receivers),
        "casts_shadow": dome.casts_shadow,
        "shadow": tables.add_shadow(dome.shadow),
    }


def _irradiance(pixels: np.ndarray, *, is_srgb: bool) -> np.ndarray:
    return irradiance_map(pixels, is_srgb=is_srgb, size=(int(IRRADIANCE_HEIGHT), int(IRRADIANCE_WIDTH)))


def _bright_cells(pixels: np.ndarray, *, is_srgb: bool) -> tuple[np.ndarray, int, int]:
    return bright_cells(pixels, is_srgb=is_srgb, size=_MOST_CELLS)
