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
from warp_rt.usd.image_files import MAX_TEXELS, ImageFile, read_image_file

MISSING_FILE = "W201"
UNREADABLE_FILE = "W202"
UDIM_TILES = "W203"
UNKNOWN_COLOR_SPACE = "W205"

_SRGB_SPACES = frozenset({"srgb", "srgb_texture", "srgb_rec709_scene", "srgb_rec709_display", "srgb - texture"})
_LINEAR_SPACES = frozenset(
    {"raw", "data", "linear", "lin_rec709", "lin_rec709_scene", "lin_srgb", "linear rec.709 (srgb)", "identity"}
)


class ImageCache:
    """Reads images and keeps them by path."""

    def __init__(self, report: Report) -> None:
        self.images: list[Image] = []
        """Rows of ``Scene.images``."""
        self._is_srgb: list[bool] = []
        self._rows: dict[str, int | str] = {}
        self._atlases: dict[str, tuple[int, np.ndarray]] = {}
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

    def is_srgb_by_default(self, row: int) -> bool:
        """Return what ``sourceColorSpace = "auto"`` says for a row; -1 is not sRGB."""
        return row >= 0 and self._is_srgb[row]

    def is_srgb(self, row: int, attribute: Usd.Attribute | None, prim: object) -> bool:
        """Return whether an image is sRGB: by its attribute's ``colorSpace`` where it has one, else by default."""
        name = str(attribute.GetColorSpace()) if attribute and attribute.HasColorSpace() else ""
        if name.lower() in _SRGB_SPACES:
            return True
        if name.lower() in _LINEAR_SPACES:
            return False
        if name and name != "auto":
            message = f"the colour space {name!r} is not supported; read as if none was named"
            self._report.warn(UNKNOWN_COLOR_SPACE, prim, message)
        return self.is_srgb_by_default(row)

    def check_constant(self, attribute: Usd.Attribute) -> None:
        """Report a colour that is authored in another space than the one it is read in."""
        name = str(attribute.GetColorSpace()) if attribute.HasColorSpace() else ""
        if name and name.lower() not in (*_LINEAR_SPACES, "auto"):
            message = f"the colour space {name!r} of a value is not supported; read as linear Rec. 709"
            self._report.warn(UNKNOWN_COLOR_SPACE, attribute.GetPath(), message)

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
