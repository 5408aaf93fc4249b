# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The images of a scene on a device, with their pyramids; those of the frame before are used again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.arrays import Joined, Packer
from warp_rt.kernels import scene_structs
from warp_rt.scene import Dome, Light, Scene, Texture, Tiles
from warp_rt.srgb import linear_from_srgb
from warp_rt.upload.dome import mean_color
from warp_rt.upload.image_pyramid import coarser_levels, decode
from warp_rt.upload.tile_grid import grid_levels


class DeviceImages:
    """The images that textures, lights and domes read, each by the curve it is decoded by, with its pyramid.

    Args:
        scene: Whose images.
        pack: Uploads them.
        has_pyramids: Whether they get pyramids.
    """

    def __init__(self, scene: Scene, pack: Packer, *, has_pyramids: bool) -> None:
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
    def of(scene: Scene, pack: Packer, *, has_pyramids: bool, previous: DeviceImages | None) -> DeviceImages:
        """Return the images of a scene on a device: those that are there already, where they are the very same."""
        if (
            previous is None
            or (previous._device, previous._has_pyramids) != (pack.device, has_pyramids)
            or (tuple(previous._rows), tuple(previous._grids)) != (_image_reads(scene), _grid_reads(scene))
            or [id(image) for image in previous._images] != [id(image) for image in scene.images]
        ):
            return DeviceImages(scene, pack, has_pyramids=has_pyramids)
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

    def _upload(self, reads: Sequence[tuple[int, bool]], grids: Sequence[tuple[Tiles, bool]], pack: Packer) -> None:
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
        self._records = pack.records(scene_structs.ImageData, self._table)
        self._texels_byte = pack.chunks(texels.bytes.parts, wp.uint32, (), np.uint32)
        self._texels_float = pack.chunks(texels.floats.parts, wp.vec4, (4,), np.float32)
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
        self.bytes = Joined()
        self.floats = Joined()

    def append(self, pixels: np.ndarray) -> int:
        """Add those of an image, shape [height, width, 4], and return where they begin among their kind."""
        if pixels.dtype != np.uint8:
            return self.floats.append(pixels.reshape(-1, 4))
        return self.bytes.append(np.ascontiguousarray(pixels).view("<u4").reshape(-1))


def _image_reads(scene: Scene) -> tuple[tuple[int, bool], ...]:
    """Return the images that are read, each with whether as sRGB."""
    readers: list[Texture | Light | Dome] = [*scene.textures, *scene.lights, *scene.domes]
    reads = [(reader.image, reader.is_srgb) for reader in readers if reader.image >= 0]
    reads += [(image, is_srgb) for tiles, is_srgb in _grid_reads(scene) for image in tiles.present]
    return tuple(dict.fromkeys(reads))


def _grid_reads(scene: Scene) -> tuple[tuple[Tiles, bool], ...]:
    """Return the UDIM tiles that are read, each with whether as sRGB."""
    return tuple(dict.fromkeys((texture.tiles, texture.is_srgb) for texture in scene.textures if texture.tiles))
