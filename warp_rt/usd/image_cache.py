# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The images of a scene: each file is read once, and a file that cannot be read is reported once a prim."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from pxr import Ar, Sdf, Usd, UsdShade

from warp_rt.errors import SceneError
from warp_rt.report import Report
from warp_rt.scene import Image
from warp_rt.srgb import linear_from_srgb
from warp_rt.usd.color_spaces import UNKNOWN_COLOR_SPACE, ColorSpace, color_space
from warp_rt.usd.dome_layouts import LATLONG, Stretch, guess_layout, has_proportions, to_latlong
from warp_rt.usd.image_files import NO_WRAPS, read_image_file

MISSING_FILE = "W201"
UNREADABLE_FILE = "W202"


Kept = TypeVar("Kept")


class KeptImages:
    """What was made of image files for the scenes of one source, so that scenes share it: what the latest one used."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, Any] = {}
        self._used: dict[Hashable, Any] = {}

    def get(self, recipe: Hashable, make: Callable[[], Kept]) -> Kept:
        """Return what ``make`` returns, or has returned for this scene or the one before.

        Args:
            recipe: From which files, in which state, and how it is made.
            make: Makes it.
        """
        if recipe not in self._used:
            self._used[recipe] = self._kept[recipe] if recipe in self._kept else make()
        made: Kept = self._used[recipe]
        return made

    def end_scene(self) -> None:
        """Drop all that was not asked for since the last call."""
        self._kept, self._used = self._used, {}


class ImageCache:
    """Reads the images of one scene.

    Args:
        report: Takes the diagnostics.
        kept: What scenes before have read.
    """

    def __init__(self, report: Report, kept: KeptImages | None = None) -> None:
        self.images: list[Image] = []
        """Rows of ``Scene.images``."""
        self._is_srgb: list[bool] = []
        self._wraps: list[tuple[str, str]] = []
        self._undefined: list[int] = []
        self._recipes: list[Hashable] = []  # of each row
        self._rows: dict[Hashable, int] = {}  # of each recipe
        self._files: dict[str, int | str] = {}  # row by path, or why there is none
        self._kept = kept or KeptImages()
        self._report = report

    def load(self, asset: Sdf.AssetPath, prim: object) -> int:
        """Return the row of an image; -1, with a diagnostic about ``prim``, where the file cannot be used."""
        path = asset.resolvedPath
        if not path:
            name = asset.path
            message = f"the image @{name}@ is not found" if name else "no image file is named"
            self._report.warn(MISSING_FILE, prim, message)
            return -1
        row = self._read(path)
        if isinstance(row, str):
            self._report.warn(UNREADABLE_FILE, prim, f"the image @{asset.path}@ cannot be used: {row}")
            return -1
        return row

    def _read(self, path: str) -> int | str:
        """Return the row of a file's image, or why there is none."""
        if path not in self._files:
            recipe = _state(path)
            made = self._kept.get(recipe, lambda: _decode(path))
            self._files[path] = made if isinstance(made, str) else self._row(recipe, lambda: made)
        return self._files[path]

    def wraps(self, row: int) -> tuple[str, str]:
        """Return what a file says of what lies beyond its image, as ``ImageFile.wraps``; black without a file."""
        return NO_WRAPS if row < 0 else self._wraps[row]

    def load_tiles(self, attribute: Usd.Attribute, asset: Sdf.AssetPath, prim: object) -> dict[tuple[int, int], int]:
        """Return the rows of the images of a ``<UDIM>`` path, by column and row of the tiles; none, told, without any.

        Tile 1001 + u + 10 v covers [u, u + 1] x [v, v + 1].

        Args:
            attribute: Where the path is authored; relative paths start from its layer.
            asset: Its value.
            prim: Whom diagnostics are about.
        """
        specs = attribute.GetPropertyStack(Usd.TimeCode.Default())
        paths = UsdShade.UdimUtils.ResolveUdimTilePaths(asset.path, specs[0].layer) if specs else []
        if not paths:
            self._report.warn(MISSING_FILE, prim, f"the image @{asset.path}@ is not found, not one tile of it")
        tiles = {}
        for path, number in paths:
            row = self._read(path)
            if isinstance(row, str):
                self._report.warn(UNREADABLE_FILE, prim, f"tile {number} of @{asset.path}@ cannot be used: {row}")
                continue
            v, u = divmod(int(number) - 1001, 10)
            tiles[u, v] = row
        return tiles

    def latlong(self, row: int, layout: str, *, is_srgb: bool, stretch: Stretch | None = None) -> tuple[int, bool]:
        """Return the row of an environment by latitude and longitude, and whether to decode it; -1 if it cannot be one.

        Args:
            row: Of the image, in that layout already or in another.
            layout: A token of UsdLux's ``texture:format``.
            is_srgb: Whether the image is sRGB encoded.
            stretch: Of the space that the environment is in, None for none.
        """
        if row < 0:
            return row, False
        pixels = self.images[row].pixels
        height, width = pixels.shape[:2]
        if layout == "automatic":
            layout = guess_layout(width, height)
        if layout == LATLONG and stretch is None:
            return row, is_srgb
        if not has_proportions(layout, width, height):
            return -1, False
        path = self.images[row].path
        recipe = ("latlong", self._recipes[row], layout, is_srgb, stretch)

        def make() -> _Decoded:
            return _Decoded(Image(path, to_latlong(pixels, layout, is_srgb=is_srgb, stretch=stretch)), False)

        return self._row(recipe, make), False

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
        image = self.images[row]

        def converted() -> _Decoded:
            pixels = image.pixels.astype(np.float32) / (255 if image.pixels.dtype == np.uint8 else 1)
            pixels[..., :3] = space.to_linear(pixels[..., :3])
            return _Decoded(Image(image.path, pixels), False)

        return self._row(("in space", self._recipes[row], space), converted), False

    def mixed(self, row: int, is_srgb: bool, matrix: np.ndarray) -> int:
        """Return the row of an image whose channels are others of, or sums over, those of an image.

        Args:
            row: Of the image.
            is_srgb: Whether it is decoded by the sRGB curve.
            matrix: Acts on decoded texels, shape [4, 4].
        """
        image = self.images[row]

        def mixed() -> _Decoded:
            pixels = image.pixels.astype(np.float32) / (255 if image.pixels.dtype == np.uint8 else 1)
            if is_srgb:
                pixels[..., :3] = linear_from_srgb(pixels[..., :3])
            return _Decoded(Image(image.path, pixels @ matrix.T.astype(np.float32)), False)

        return self._row(("mixed", self._recipes[row], is_srgb, matrix.tobytes()), mixed)

    def computed(self, key: str, rows: Sequence[int], compute: Callable[[], tuple[np.ndarray, int]]) -> int:
        """Return the row of an image that is computed of others.

        Args:
            key: Tells what is computed.
            rows: Of the images that it is computed of.
            compute: Gives linear texels, shape [height, width, 4], and how many of them are no numbers by themselves.
        """

        def made() -> _Decoded:
            path = self.images[rows[0]].path if rows else ""
            texels, undefined = compute()
            return _Decoded(Image(path, texels.astype(np.float32)), False, undefined=undefined)

        return self._row(("computed", key, *(self._recipes[row] for row in rows)), made)

    def undefined(self, row: int) -> int:
        """Return how many texels of an image that is computed are no numbers by themselves."""
        return self._undefined[row]

    def _row(self, recipe: Hashable, make: Callable[[], _Decoded]) -> int:
        """Return the row of an image, which is made where neither this scene nor the one before has it."""
        if recipe not in self._rows:
            self._rows[recipe] = self._add(recipe, self._kept.get(recipe, make))
        return self._rows[recipe]

    def _add(self, recipe: Hashable, decoded: _Decoded) -> int:
        self.images.append(decoded.image)
        self._is_srgb.append(decoded.is_srgb)
        self._wraps.append(decoded.wraps)
        self._undefined.append(decoded.undefined)
        self._recipes.append(recipe)
        return len(self.images) - 1


@dataclass(frozen=True)
class _Decoded:
    """An image, whether its texels are sRGB encoded where nothing is said, and what lies beyond it by its file."""

    image: Image
    is_srgb: bool
    wraps: tuple[str, str] = NO_WRAPS
    undefined: int = 0
    """Texels of one that is computed which are no numbers by themselves."""


def _decode(path: str) -> _Decoded | str:
    """Return the image of a file, or why there is none."""
    try:
        file = read_image_file(path)
    except SceneError as error:
        return str(error)
    return _Decoded(Image(path, file.pixels), file.is_srgb_by_default, file.wraps)


def _state(path: str) -> tuple[str, float]:
    """Return a resolved path, and when the file that is there has been written."""
    written = Ar.GetResolver().GetModificationTimestamp(path, Ar.ResolvedPath(path))
    return path, written.GetTime() if written.IsValid() else 0.0
