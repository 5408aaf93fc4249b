# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The images of a scene: each file is read once, and a file that cannot be read is reported once a prim."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pxr import Sdf, Usd, UsdShade

from warp_rt.errors import SceneError
from warp_rt.report import Report
from warp_rt.scene import Image
from warp_rt.srgb import linear_from_srgb
from warp_rt.usd.color_spaces import UNKNOWN_COLOR_SPACE, ColorSpace, color_space
from warp_rt.usd.dome_layouts import LATLONG, guess_layout, has_proportions, to_latlong
from warp_rt.usd.image_files import MAX_TEXELS, ImageFile, read_image_file

MISSING_FILE = "W201"
UNREADABLE_FILE = "W202"
UDIM_TILES = "W203"


class ImageCache:
    """Reads images and keeps them by path."""

    def __init__(self, report: Report) -> None:
        self.images: list[Image] = []
        """Rows of ``Scene.images``."""
        self._is_srgb: list[bool] = []
        self._rows: dict[str, int | str] = {}
        self._converted: dict[tuple[int, ColorSpace], int] = {}
        self._mixed: dict[tuple[int, bool, bytes], int] = {}
        self._atlases: dict[str, tuple[int, np.ndarray]] = {}
        self._environments: dict[tuple[int, str, bool], int] = {}
        self._report = report

    def load(self, asset: Sdf.AssetPath, prim: object) -> int:
        """Return the row of an image; -1, with a diagnostic about ``prim``, where the file cannot be used."""
        path = asset.resolvedPath
        if not path:
            name = asset.path
            message = f"the image @{name}@ is not found" if name else "no image file is named"
            self._report.warn(MISSING_FILE, prim, message)
            return -1
        if path not in self._rows:
            try:
                self._rows[path] = self._add(path, read_image_file(path))
            except SceneError as error:
                self._rows[path] = str(error)
        row = self._rows[path]
        if isinstance(row, str):
            self._report.warn(UNREADABLE_FILE, prim, f"the image @{asset.path}@ cannot be used: {row}")
            return -1
        return row

    def load_tiles(self, attribute: Usd.Attribute, asset: Sdf.AssetPath, prim: object) -> tuple[int, np.ndarray]:
        """Return the row of an image that holds all tiles of a ``<UDIM>`` path side by side.

        Tile 1001 + u + 10 v covers [u, u + 1] x [v, v + 1]; absent tiles are transparent black.

        Args:
            attribute: Where the path is authored; relative paths start from its layer.
            asset: Its value.
            prim: Whom diagnostics are about.

        Returns:
            The row or -1, and the map from texture coordinates to those of the joint image: shape [2, 3].
        """
        specs = attribute.GetPropertyStack(Usd.TimeCode.Default())
        paths = UsdShade.UdimUtils.ResolveUdimTilePaths(asset.path, specs[0].layer) if specs else []
        if not paths:
            self._report.warn(MISSING_FILE, prim, f"the image @{asset.path}@ is not found, not one tile of it")
            return -1, np.eye(2, 3)
        if paths[0][0] not in self._atlases:
            self._atlases[paths[0][0]] = self._join_tiles(paths, asset, prim)
        return self._atlases[paths[0][0]]

    def latlong(self, row: int, layout: str, *, is_srgb: bool) -> tuple[int, bool]:
        """Return the row of an environment by latitude and longitude, and whether to decode it; -1 if it cannot be one.

        Args:
            row: Of the image, in that layout already or in another.
            layout: A token of UsdLux's ``texture:format``.
            is_srgb: Whether the image is sRGB encoded.
        """
        if row < 0:
            return row, False
        pixels = self.images[row].pixels
        height, width = pixels.shape[:2]
        if layout == "automatic":
            layout = guess_layout(width, height)
        if layout == LATLONG:
            return row, is_srgb
        if not has_proportions(layout, width, height):
            return -1, False
        key = (row, layout, is_srgb)
        if key not in self._environments:
            self.images.append(Image(self.images[row].path, to_latlong(pixels, layout, is_srgb=is_srgb)))
            self._is_srgb.append(False)
            self._environments[key] = len(self.images) - 1
        return self._environments[key], False

    def decoded(self, row: int, attribute: Usd.Attribute, prim: object) -> tuple[int, bool]:
        """Return the row of an image to read, and whether to decode it by the sRGB curve.

        That is said by the ``colorSpace`` of the attribute that names the image, else by the file: 8 bits a channel and
        at least three channels are sRGB. An image in a space of other primaries, or another curve, gets a row of its
        own in linear Rec. 709.

        Args:
            row: As ``load`` gives it.
            attribute: Where the image is named.
            prim: Whom diagnostics are about.
        """
        if row < 0:
            return row, False
        name = str(attribute.GetColorSpace()) if attribute.HasColorSpace() else ""
        if not name or name == "auto":
            return row, self._is_srgb[row]
        space = color_space(name)
        if space is None:
            message = f"the colour space {name!r} of an image is not known; read as if none was named"
            self._report.warn(UNKNOWN_COLOR_SPACE, prim, message)
            return row, self._is_srgb[row]
        return self.in_space(row, space)

    def in_space(self, row: int, space: ColorSpace) -> tuple[int, bool]:
        """Return the row of an image to read, and whether to decode it by the sRGB curve, where its space is known."""
        if row < 0:
            return row, False
        if space.is_linear_rec709 or space.is_srgb:
            return row, space.is_srgb
        if (row, space) not in self._converted:
            image = self.images[row]
            pixels = image.pixels.astype(np.float32) / (255 if image.pixels.dtype == np.uint8 else 1)
            pixels[..., :3] = space.to_linear(pixels[..., :3])
            self._converted[row, space] = self._add(image.path, ImageFile(pixels, 4))
        return self._converted[row, space], False

    def mixed(self, row: int, is_srgb: bool, matrix: np.ndarray) -> int:
        """Return the row of an image whose channels are others of, or sums over, those of an image.

        Args:
            row: Of the image.
            is_srgb: Whether it is decoded by the sRGB curve.
            matrix: Acts on decoded texels, shape [4, 4].
        """
        key = (row, is_srgb, matrix.tobytes())
        if key not in self._mixed:
            image = self.images[row]
            pixels = image.pixels.astype(np.float32) / (255 if image.pixels.dtype == np.uint8 else 1)
            if is_srgb:
                pixels[..., :3] = linear_from_srgb(pixels[..., :3])
            self._mixed[key] = self._add(image.path, ImageFile(pixels @ matrix.T.astype(np.float32), 4))
        return self._mixed[key]

    def _add(self, path: str, file: ImageFile) -> int:
        self.images.append(Image(path, file.pixels))
        self._is_srgb.append(file.is_srgb_by_default)
        return len(self.images) - 1

    def _join_tiles(
        self, paths: Sequence[tuple[str, str]], asset: Sdf.AssetPath, prim: object
    ) -> tuple[int, np.ndarray]:
        tiles: dict[tuple[int, int], ImageFile] = {}
        for path, number in paths:
            try:
                tiles[divmod(int(number) - 1001, 10)] = read_image_file(path)
            except SceneError as error:
                self._report.warn(UNREADABLE_FILE, prim, f"tile {number} of @{asset.path}@ cannot be used: {error}")
        if not tiles:
            return -1, np.eye(2, 3)
        first = next(iter(tiles.values()))
        for key in [key for key, tile in tiles.items() if tile.pixels.dtype != first.pixels.dtype]:
            del tiles[key]
            message = f"tile {1001 + key[1] + 10 * key[0]} of @{asset.path}@ is of another type than the rest; left out"
            self._report.warn(UDIM_TILES, prim, message)
        bottom, left = np.min(list(tiles), axis=0)
        rows, columns = np.max(list(tiles), axis=0) - (bottom, left) + 1
        height, width = np.max([tile.pixels.shape[:2] for tile in tiles.values()], axis=0)
        if rows * height * columns * width > MAX_TEXELS:
            message = f"the tiles of @{asset.path}@ have more than {MAX_TEXELS} texels together; the fallback is used"
            self._report.warn(UDIM_TILES, prim, message)
            return -1, np.eye(2, 3)
        joint = np.zeros((rows, height, columns, width, 4), first.pixels.dtype)
        for (row, column), tile in tiles.items():
            # Smaller tiles are enlarged texel by texel.
            y, x = (np.arange(n) * have // n for n, have in zip((height, width), tile.pixels.shape, strict=False))
            joint[row - bottom, :, column - left] = tile.pixels[np.ix_(y, x)]
        file = ImageFile(joint.reshape(rows * height, columns * width, 4), first.channel_count)
        transform = np.array([[1 / columns, 0, -left / columns], [0, 1 / rows, -bottom / rows]])
        return self._add(asset.path, file), transform
