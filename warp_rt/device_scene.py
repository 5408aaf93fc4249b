# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scene to DeviceScene: every array that shading reads, packed into one struct on one device."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device_lights import light_record, unit_axes
from warp_rt.dome import bright_cells, irradiance_map, mean_color
from warp_rt.image_pyramid import coarser_levels, decode
from warp_rt.kernels import structs
from warp_rt.kernels.codes import (
    HOLDS_OUT,
    INPUT_COUNT,
    IRRADIANCE_HEIGHT,
    IRRADIANCE_WIDTH,
    PREVIEW_INPUTS,
    WHITTED_INPUTS,
)
from warp_rt.kernels.constants import PARAMETRIC
from warp_rt.light_tables import LightTables
from warp_rt.options import TEXTURE_FILTERS, is_primvar_aov
from warp_rt.placement import Placement, blocks, place_scene, relative_points
from warp_rt.scene import (
    MATERIAL_DEFAULTS,
    Dome,
    Input,
    Light,
    Material,
    MaterialModel,
    Mesh,
    Primvar,
    RayMask,
    Scene,
    Shapes,
    Texture,
    Tiles,
)
from warp_rt.scene.rows import check_materials
from warp_rt.specular_albedo import specular_albedo
from warp_rt.srgb import linear_from_srgb
from warp_rt.tile_grid import grid_levels

_INPUT_ROWS = {MaterialModel.WHITTED: WHITTED_INPUTS, MaterialModel.PREVIEW: PREVIEW_INPUTS}
"""Order of a material's inputs on the device."""
_MOST_CELLS = (512, 1024)
"""Rows and columns by which domes are sampled: a third of a degree, smaller than the sun; 2 MB."""
_NORMALS = ""  # name of slot 0, which no primvar can have


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
    """``kernels.structs.SceneData``."""
    device: str
    origin: np.ndarray
    """World point that its coordinates are relative to: float64, shape [3]."""
    bytes: int
    """Device memory that its arrays take [byte]."""
    images: _Images
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
        aovs: What is wanted of it; the primvars among them are uploaded.
        previous: Whose images are used again where those of ``scene`` are the same objects and read alike.

    Raises:
        SceneError: Something that is placed has no material.
    """
    check_materials(scene.instances, scene.meshes, len(scene.materials))
    placement = placement or place_scene(scene)
    shown = {aov: aov.partition(":")[2] for aov in aovs if is_primvar_aov(aov)}
    slots = _primvar_slots(scene, shown.values())
    pack = _Packer(device)
    data = structs.SceneData()
    _pack_meshes(data, pack, scene.meshes, placement, slots)
    _pack_instances(data, pack, scene, placement, slots)
    images = _Images.of(
        scene,
        pack,
        has_pyramids=texture_filter == "anisotropic",
        previous=None if previous is None else previous.images,
    )
    _pack_materials(data, pack, scene, slots, images)
    data.albedo = pack.array(specular_albedo().reshape(-1, 2), wp.vec2)
    _pack_lights(data, pack, scene.lights, scene.domes, placement.origin, images, samples_domes=samples_domes)
    images.put(data)
    aov_primvars = {aov: AovPrimvar(slots[_slot_name(name)], _primvar_size(scene, name)) for aov, name in shown.items()}
    return DeviceScene(data, device, placement.origin, pack.bytes, images, aov_primvars)


def with_lights(device_scene: DeviceScene, lights: Sequence[Light]) -> DeviceScene:
    """Return the same scene under other lights, without textures or domes; everything else is shared."""
    data = structs.SceneData()
    for name in structs.SceneData.vars:
        setattr(data, name, getattr(device_scene.data, name))
    _pack_lights(data, _Packer(device_scene.device), lights, (), device_scene.origin, device_scene.images)
    return replace(device_scene, data=data)


class _Packer:
    """Makes device arrays and keeps count of their bytes."""

    def __init__(self, device: str) -> None:
        self.device = device
        self.bytes = 0

    def array(self, values: np.ndarray, dtype: Any, ndim: int = 1) -> wp.array:
        values = np.ascontiguousarray(values)
        self.bytes += values.nbytes
        if values.size == 0:
            return wp.zeros(shape=values.shape[:ndim], dtype=dtype, device=self.device)
        return wp.array(values, dtype=dtype, ndim=ndim, device=self.device)

    def chunks(self, parts: Sequence[np.ndarray], dtype: Any, row: tuple[int, ...], scalar: type) -> wp.array:
        joined = np.concatenate(parts) if parts else np.zeros((0, *row), scalar)
        return self.array(np.ascontiguousarray(joined, scalar).reshape(-1, *row), dtype)

    def records(self, struct: Any, rows: Sequence[dict[str, Any]]) -> wp.array:
        table = np.zeros(len(rows), struct.numpy_dtype())
        for record, row in zip(table, rows, strict=True):
            for name, value in row.items():
                record[name] = value
        return self.array(table, struct)


def _slot_name(primvar: str) -> str:
    return _NORMALS if primvar == "normals" else primvar


def _primvar_size(scene: Scene, name: str) -> int:
    """Return the most components that a primvar has on anything in the scene; 0: nothing has it."""
    key = _slot_name(name)
    found = (_primvar_of(mesh, key) for mesh in scene.meshes)
    sizes = [primvar.values.reshape(len(primvar.values), -1).shape[1] for primvar in found if primvar is not None]
    if name == "st" and any(isinstance(mesh, Shapes) and mesh.has_st for mesh in scene.meshes):
        sizes.append(2)
    values = scene.instances.primvars.get(name)
    if values is not None and len(values):
        sizes.append(values.reshape(len(values), -1).shape[1])
    return max(sizes, default=0)


def _primvar_slots(scene: Scene, shown: Iterable[str]) -> dict[str, int]:
    """Return the slot of each primvar that is read; slot 0 is the normals', slot 1 that of ``st``.

    Args:
        scene: Whose materials read them.
        shown: AOVs that are primvars.
    """
    used = [texture.primvar for texture in scene.textures]
    used += [source.primvar for m in scene.materials for source in m.inputs.values() if source.primvar]
    names = dict.fromkeys((_NORMALS, "st", *used, *map(_slot_name, shown)))
    return {name: slot for slot, name in enumerate(names)}


def _pack_meshes(
    data: Any, pack: _Packer, meshes: Sequence[Mesh | Shapes], placement: Placement, slots: dict[str, int]
) -> None:
    points, controls, corners, values, material_slots, face_ids = [], [], [], [], [], []
    mesh_table = np.zeros(len(meshes), structs.MeshData.numpy_dtype())
    primvar_table = np.zeros((len(meshes), len(slots)), structs.PrimvarData.numpy_dtype())
    point_count = control_count = corner_count = value_count = slot_count = face_count = 0
    for record, primvars, mesh, origin in zip(mesh_table, primvar_table, meshes, placement.mesh_origins, strict=True):
        triangle_offset = corner_count
        record["is_closed"] = mesh.is_closed
        record["outward"] = 1.0
        if isinstance(mesh, Shapes):
            record["kind"] = mesh.kind
            record["outward"] = -1.0 if mesh.is_inside_out else 1.0
            record["point_offset"] = control_count
            balls = np.concatenate([relative_points(mesh.points, origin), mesh.radii[:, :, None]], axis=2)
            controls.append(balls.reshape(-1, 4))
            control_count += len(controls[-1])
        else:
            record["point_offset"] = point_count
            record["triangle_offset"] = triangle_offset
            points.append(relative_points(mesh.points, origin))
            corners.append(mesh.triangles)
            point_count += len(mesh.points)
            corner_count += len(mesh.triangles)
        record["slot_offset"] = record["face_offset"] = -1
        if isinstance(mesh, Mesh) and mesh.material_slots is not None:
            record["slot_offset"] = slot_count
            material_slots.append(mesh.material_slots)
            slot_count += len(mesh.material_slots)
        if mesh.face_ids is not None:
            record["face_offset"] = face_count
            face_ids.append(mesh.face_ids)
            face_count += len(mesh.face_ids)
        for name, slot in slots.items():
            primvar = _primvar_of(mesh, name)
            if primvar is None:
                if name == "st" and isinstance(mesh, Shapes) and mesh.has_st:
                    primvars[slot] = (2, value_count, -1, int(PARAMETRIC))
                continue
            rows = primvar.values.reshape(len(primvar.values), -1)
            primvars[slot] = (rows.shape[1], value_count, -1, 0)
            if isinstance(mesh, Shapes) and primvar.indices is not None:
                primvars[slot]["row_count"] = primvar.indices.shape[1]
                rows = rows[primvar.indices.reshape(-1)]
            values.append(rows.reshape(-1))
            value_count += rows.size
            if isinstance(mesh, Shapes):
                continue
            if primvar.indices is mesh.triangles:
                primvars[slot]["corner_offset"] = triangle_offset
            elif primvar.indices is not None:
                primvars[slot]["corner_offset"] = corner_count
                corners.append(primvar.indices)
                corner_count += len(primvar.indices)
    data.points = pack.chunks(points, wp.vec3, (3,), np.float32)
    data.controls = pack.chunks(controls, wp.vec4, (4,), np.float32)
    data.corners = pack.chunks(corners, wp.vec3i, (3,), np.int32)
    data.primvar_values = pack.chunks(values, wp.float32, (), np.float32)
    data.material_slots = pack.chunks(material_slots, wp.int32, (), np.int32)
    data.face_ids = pack.chunks(face_ids, wp.int32, (), np.int32)
    data.meshes = pack.array(mesh_table, structs.MeshData)
    data.primvars = pack.array(primvar_table.reshape(-1), structs.PrimvarData)
    data.primvar_count = len(slots)


def _primvar_of(mesh: Mesh | Shapes, name: str) -> Primvar | None:
    if name != _NORMALS:
        return mesh.primvars.get(name)
    return mesh.normals if isinstance(mesh, Mesh) else None


def _pack_instances(data: Any, pack: _Packer, scene: Scene, placement: Placement, slots: dict[str, int]) -> None:
    instances = scene.instances
    table = np.zeros(len(instances), structs.InstanceData.numpy_dtype())
    for block in blocks(len(instances)):
        table["world_from_local"][block] = placement.world_from_local(block)
        table["local_from_world"][block] = placement.local_from_world(block)
    table["mesh"] = instances.mesh
    table["material_offset"] = instances.material_offset
    table["prim"] = instances.prim
    table["id"] = instances.instance_id
    table["flags"] = RayMask.ALL if instances.seen_by is None else instances.seen_by
    if instances.is_matte is not None:
        table["flags"] |= np.where(instances.is_matte, int(HOLDS_OUT), 0)
    data.has_hidden = bool((table["flags"] != RayMask.ALL).any())
    data.instances = pack.array(table, structs.InstanceData)
    data.material_table = pack.array(instances.material_table.astype(np.int32), wp.int32)
    overrides = {name: rows for name, rows in instances.primvars.items() if name in slots}
    values = np.full((len(slots), len(instances) if overrides else 0, 4), np.nan, np.float32)
    for name, rows in overrides.items():
        rows = rows.reshape(len(rows), -1)
        values[slots[name], :, : rows.shape[1]] = rows
    data.instance_primvars = pack.array(values, wp.vec4, ndim=2)


def _pack_materials(data: Any, pack: _Packer, scene: Scene, slots: dict[str, int], images: _Images) -> None:
    data.materials = pack.records(structs.MaterialData, [_material_record(m) for m in scene.materials])
    inputs = np.zeros((len(scene.materials), int(INPUT_COUNT)), structs.InputData.numpy_dtype())
    values = np.zeros((*inputs.shape, 4), np.float32)
    for row, value, material in zip(inputs, values, scene.materials, strict=True):
        for k, name in enumerate(_INPUT_ROWS[material.model]):
            source = material.inputs.get(name)
            if source is None:
                x, y, z = (*MATERIAL_DEFAULTS[material.model][name], 0.0, 0.0)[:3]
                source = Input((x, y, z, 0.0))
            primvar = slots[source.primvar] if source.primvar else -1
            row[k] = (source.texture, primvar, source.channel, source.scale, source.bias)
            takes_channel = source.channel >= 0 and not source.varies
            value[k] = source.value[source.channel] if takes_channel else source.value
    data.inputs = pack.array(inputs.reshape(-1), structs.InputData)
    data.input_values = pack.array(values.reshape(-1, 4), wp.vec4)
    textures = [
        {
            **images.of_texture(t),
            "primvar": slots[t.primvar],
            "uv_fallback": t.uv_fallback,
            "wrap_s": int(t.wrap_s),
            "wrap_t": int(t.wrap_t),
            "scale": t.scale,
            "bias": t.bias,
            "fallback": t.fallback,
        }
        for t in scene.textures
    ]
    data.textures = pack.records(structs.TextureData, textures)


def _material_record(material: Material) -> dict[str, Any]:
    normal = material.inputs.get("normal")
    return {
        "model": int(material.model),
        "use_specular_workflow": material.use_specular_workflow,
        "opacity_mode": int(material.opacity_mode),
        "opacity_threshold": material.opacity_threshold,
        "is_single_sided": material.is_single_sided,
        "has_normal_map": normal is not None and (normal.varies or tuple(normal.value[:3]) != (0.0, 0.0, 1.0)),
        "varying": sum(
            1 << k
            for k, name in enumerate(_INPUT_ROWS[material.model])
            if name in material.inputs and material.inputs[name].varies
        ),
    }


class _Images:
    """The images that textures, lights and domes read, each by the curve it is decoded by, with its pyramid.

    Args:
        scene: Whose images.
        pack: Uploads them.
        has_pyramids: Whether they get pyramids.
    """

    def __init__(self, scene: Scene, pack: _Packer, *, has_pyramids: bool) -> None:
        self._images = scene.images
        self._has_pyramids = has_pyramids
        self._device = pack.device
        self._rows: dict[tuple[int, bool], int] = {}
        self._grids: dict[tuple[Tiles, bool], tuple[int, int]] = {}  # row of the means, first entry of the tiles
        self._derived: dict[tuple[Callable[..., Any], int, bool], Any] = {}
        self._table: list[dict[str, Any]] = []
        before = pack.bytes
        self._upload(_image_reads(scene), _grid_reads(scene), pack)
        self._bytes = pack.bytes - before

    @staticmethod
    def of(scene: Scene, pack: _Packer, *, has_pyramids: bool, previous: _Images | None) -> _Images:
        """Return the images of a scene on a device: those that are there already, where they are the very same."""
        if (
            previous is None
            or (previous._device, previous._has_pyramids) != (pack.device, has_pyramids)
            or (tuple(previous._rows), tuple(previous._grids)) != (_image_reads(scene), _grid_reads(scene))
            or [id(image) for image in previous._images] != [id(image) for image in scene.images]
        ):
            return _Images(scene, pack, has_pyramids=has_pyramids)
        pack.bytes += previous._bytes
        return previous

    def row(self, image: int, *, is_srgb: bool) -> int:
        """Return the device's row of an image of the scene, read as sRGB or not; -1 of no image."""
        return -1 if image < 0 else self._rows[image, is_srgb]

    def of_texture(self, texture: Texture) -> dict[str, Any]:
        """Return what a texture's record says about its image or its tiles, and where it is read."""
        row_u, row_v = texture.uv_transform
        if texture.tiles is None:
            image, tiles = self.row(texture.image, is_srgb=texture.is_srgb), -1
        else:
            image, tiles = self._grids[texture.tiles, texture.is_srgb]
            row_u, row_v = row_u - (0, 0, texture.tiles.left), row_v - (0, 0, texture.tiles.bottom)
        return {"image": image, "tiles": tiles, "row_u": row_u, "row_v": row_v}

    def derived(self, function: Callable[..., Any], image: int, *, is_srgb: bool) -> Any:
        """Return what a function makes of an image of the scene, computed once.

        Args:
            function: Takes the texels, and ``is_srgb`` by name.
            image: Row of ``Scene.images``.
            is_srgb: Whether the texels are sRGB encoded.
        """
        key = (function, image, is_srgb)
        if key not in self._derived:
            self._derived[key] = function(self._images[image].pixels, is_srgb=is_srgb)
        return self._derived[key]

    def of_light(self, light: Light) -> tuple[int, np.ndarray]:
        """Return the device's row of a light's image, and its mean colour, shape [3]."""
        mean = self.derived(mean_color, light.image, is_srgb=light.is_srgb)
        return self.row(light.image, is_srgb=light.is_srgb), mean

    def put(self, data: Any) -> None:
        """Write all of it."""
        data.images = self._records
        data.tiles = self._tiles
        data.is_filtered = any(record["level_count"] > 1 for record in self._table)
        data.texels_byte = self._texels_byte
        data.texels_float = self._texels_float
        data.srgb_decode = self._srgb_decode

    def _upload(self, reads: Sequence[tuple[int, bool]], grids: Sequence[tuple[Tiles, bool]], pack: _Packer) -> None:
        texels = _Texels()
        offsets: dict[int, int] = {}
        means: dict[tuple[int, bool], np.ndarray] = {}
        tiled = {(image, is_srgb) for tiles, is_srgb in grids for image in tiles.present}
        for image, is_srgb in reads:
            pixels = self._images[image].pixels
            row = self._rows[image, is_srgb] = len(self._table)
            if image not in offsets:  # the image itself is the same by either curve
                offsets[image] = texels.append(pixels)
            self._describe(pixels, offsets[image], is_srgb)
            level = pixels
            if self._has_pyramids:
                for level in coarser_levels(pixels, is_srgb=is_srgb):
                    self._describe(level, texels.append(level), is_srgb)
            self._table[row]["level_count"] = len(self._table) - row
            if (image, is_srgb) in tiled:
                means[image, is_srgb] = decode(level[:1, :1], is_srgb)[0, 0]
        entries: list[int] = []
        for tiles, is_srgb in grids:
            row = len(self._table)
            self._grids[tiles, is_srgb] = row, len(entries)
            nothing = np.zeros(4, np.float32)
            colors = np.array([[means.get((image, is_srgb), nothing) for image in line] for line in tiles.images])
            for level in grid_levels(colors, np.array(tiles.images) >= 0):
                if row == len(self._table) or self._has_pyramids:
                    self._describe(level, texels.append(level), False)
            self._table[row]["level_count"] = len(self._table) - row
            entries += [self.row(image, is_srgb=is_srgb) for line in tiles.images for image in line]
        self._tiles = pack.array(np.array(entries, np.int32), wp.int32)
        self._records = pack.records(structs.ImageData, self._table)
        self._texels_byte = pack.chunks(texels.bytes, wp.uint32, (), np.uint32)
        self._texels_float = pack.chunks(texels.floats, wp.vec4, (4,), np.float32)
        codes = linear_from_srgb(np.arange(256) / 255.0).astype(np.float32)
        self._srgb_decode = pack.array(codes, wp.float32)

    def _describe(self, pixels: np.ndarray, offset: int, is_srgb: bool) -> None:
        height, width = pixels.shape[:2]
        is_float = pixels.dtype != np.uint8
        record = {"offset": offset, "width": width, "height": height, "is_float": is_float, "is_srgb": is_srgb}
        self._table.append({**record, "level_count": 0})


class _Texels:
    """Texels of images, one after the other: those of 8 bits and those in float32."""

    def __init__(self) -> None:
        self.bytes: list[np.ndarray] = []
        self.floats: list[np.ndarray] = []
        self._byte_count = self._float_count = 0

    def append(self, pixels: np.ndarray) -> int:
        """Add those of an image, shape [height, width, 4], and return where they begin among their kind."""
        count = pixels.shape[0] * pixels.shape[1]
        if pixels.dtype != np.uint8:
            self.floats.append(pixels.reshape(-1, 4))
            self._float_count += count
            return self._float_count - count
        self.bytes.append(np.ascontiguousarray(pixels).view("<u4").reshape(-1))
        self._byte_count += count
        return self._byte_count - count


def _image_reads(scene: Scene) -> tuple[tuple[int, bool], ...]:
    """Return the images that are read, each with whether as sRGB."""
    readers: list[Texture | Light | Dome] = [*scene.textures, *scene.lights, *scene.domes]
    reads = [(reader.image, reader.is_srgb) for reader in readers if reader.image >= 0]
    reads += [(image, is_srgb) for tiles, is_srgb in _grid_reads(scene) for image in tiles.present]
    return tuple(dict.fromkeys(reads))


def _grid_reads(scene: Scene) -> tuple[tuple[Tiles, bool], ...]:
    """Return the UDIM tiles that are read, each with whether as sRGB."""
    return tuple(dict.fromkeys((texture.tiles, texture.is_srgb) for texture in scene.textures if texture.tiles))


def _irradiance(pixels: np.ndarray, *, is_srgb: bool) -> np.ndarray:
    return irradiance_map(pixels, is_srgb=is_srgb, size=(int(IRRADIANCE_HEIGHT), int(IRRADIANCE_WIDTH)))


def _bright_cells(pixels: np.ndarray, *, is_srgb: bool) -> tuple[np.ndarray, int, int]:
    return bright_cells(pixels, is_srgb=is_srgb, size=_MOST_CELLS)


def _pack_lights(
    data: Any,
    pack: _Packer,
    lights: Sequence[Light],
    domes: Sequence[Dome],
    origin: np.ndarray,
    images: _Images,
    *,
    samples_domes: bool = False,
) -> None:
    tables = LightTables(images.of_light)
    data.lights = pack.records(structs.LightData, [light_record(light, origin, tables) for light in lights])
    data.light_count = len(lights)
    maps: list[np.ndarray] = []
    cells: list[np.ndarray] | None = [] if samples_domes else None
    data.domes = pack.records(structs.DomeData, [_dome_record(dome, images, tables, maps, cells) for dome in domes])
    data.dome_count = len(domes)
    data.irradiance = pack.chunks(maps, wp.vec3, (3,), np.float32)
    data.dome_cells = pack.chunks(cells or [], wp.float32, (), np.float32)
    data.links = pack.array(tables.links.words(), wp.uint32)
    data.shadows = pack.records(structs.ShadowData, tables.shadows)
    data.profiles = pack.records(structs.ProfileData, tables.profiles)
    data.light_meshes = pack.records(structs.LightMeshData, tables.meshes)
    triangles = [np.zeros(0, structs.LightTriangle.numpy_dtype()), *tables.triangles]
    data.light_triangles = pack.array(np.concatenate(triangles), structs.LightTriangle)
    clusters = [np.zeros(0, structs.LightCluster.numpy_dtype()), *tables.clusters]
    data.light_clusters = pack.array(np.concatenate(clusters), structs.LightCluster)
    data.light_textures = pack.records(structs.LightTextureData, tables.textures)
    data.profile_numbers = pack.array(tables.profile_numbers(), wp.float32)


def _dome_record(
    dome: Dome, images: _Images, tables: LightTables, maps: list[np.ndarray], cells: list[np.ndarray] | None
) -> dict[str, Any]:
    axes, _ = unit_axes(dome.world_from_light)
    offset = cells_offset = -1
    rows = columns = 0
    if dome.image >= 0:
        offset = sum(len(m) for m in maps)
        irradiance = images.derived(_irradiance, dome.image, is_srgb=dome.is_srgb)
        maps.append((irradiance * dome.radiance).reshape(-1, 3))
        if cells is not None:
            cells_offset = sum(len(c) for c in cells)
            sums, rows, columns = images.derived(_bright_cells, dome.image, is_srgb=dome.is_srgb)
            cells.append(sums)
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
