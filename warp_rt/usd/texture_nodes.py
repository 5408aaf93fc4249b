# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Nodes that read images: UsdUVTexture, and MaterialX's image and tiledimage.

Reference: UsdPreviewSurface Specification, UsdUVTexture; MaterialX Specification 1.39, Texture Nodes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pxr import Sdf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import MagFilter, Texture, Tiles, Wrap
from warp_rt.scene.texture_values import decoded_texels
from warp_rt.usd.color_spaces import color_space as find_color_space
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.image_files import NO_WRAPS
from warp_rt.usd.shading_network import Node, find_source, read_numbers, read_token, warn_connected, warn_type
from warp_rt.usd.signals import Source
from warp_rt.usd.texture_coordinates import Coordinates, tiling

UNKNOWN_TOKEN = "W204"

_WRAPS = {
    "black": Wrap.BLACK,
    "constant": Wrap.BLACK,
    "clamp": Wrap.CLAMP,
    "repeat": Wrap.REPEAT,
    "periodic": Wrap.REPEAT,
    "mirror": Wrap.MIRROR,
}
_MAG_FILTERS = {"closest": MagFilter.NEAREST, "linear": MagFilter.LINEAR, "cubic": MagFilter.CUBIC}
_OF_FILE = "useMetadata"
Vector4 = tuple[float, float, float, float]


class TextureNodes:
    """Makes sources of the nodes that read images.

    Args:
        images: Reads the files.
        time: When inputs are read.
        report: Takes the diagnostics.
    """

    def __init__(self, images: ImageCache, time: Usd.TimeCode, report: Report) -> None:
        self._images = images
        self._time = time
        self._report = report

    def uv_texture(self, shader: UsdShade.Shader, coordinates: Coordinates) -> Source:
        """Return what a UsdUVTexture gives at texture coordinates."""
        is_materialx = (shader.GetShaderId() or "").startswith("ND_")
        default = "periodic" if is_materialx else _OF_FILE
        return self._source(
            shader,
            coordinates=coordinates,
            wraps=[self._token(shader, name, default) for name in ("wrapS", "wrapT")],
            scale=self._vector4(shader, "scale", (1.0, 1.0, 1.0, 1.0)),
            bias=self._vector4(shader, "bias", (0.0, 0.0, 0.0, 0.0)),
            fallback=self._vector4(shader, "fallback", (0.0, 0.0, 0.0, 1.0)),
            color_space=self._token(shader, "sourceColorSpace", "auto"),
        )

    def image(self, shader: UsdShade.Shader, coordinates: Coordinates, *, is_color: bool, is_tiled: bool) -> Source:
        """Return what an image node gives at texture coordinates.

        Args:
            shader: The node.
            coordinates: What it is given.
            is_color: Whether it gives a colour, so that the file says how texels are decoded.
            is_tiled: Whether it is a tiledimage, which repeats the image.
        """
        if is_tiled:
            moved = tiling(shader, self._time, self._report) @ coordinates.transform
            coordinates = replace(coordinates, transform=moved)
        wraps = [self._token(shader, name, "periodic") for name in ("uaddressmode", "vaddressmode")]
        source = self._source(
            shader,
            coordinates=coordinates,
            wraps=["periodic", "periodic"] if is_tiled else wraps,
            scale=(1.0, 1.0, 1.0, 1.0),
            bias=(0.0, 0.0, 0.0, 0.0),
            fallback=self._vector4(shader, "default", (0.0, 0.0, 0.0, 1.0)),
            color_space="auto" if is_color else "raw",
        )
        is_bordered = "constant" in wraps and not is_tiled
        return self._with_border(source) if is_bordered else source

    def _with_border(self, source: Source) -> Source:
        """Return a texture whose default lies beyond its image, as MaterialX's address mode ``constant`` asks for.

        What lies beyond an image is black: so the default is taken from its texels, and added to all.
        """
        texture = source.texture
        if texture is None or texture.image < 0 or texture.tiles is not None or not any(texture.fallback[:3]):
            return source
        default = texture.fallback
        pixels = self._images.images[texture.image].pixels
        image = self._images.computed(
            f"less {default} {texture.is_srgb}",
            (texture.image,),
            lambda: (decoded_texels(pixels, is_srgb=texture.is_srgb) - default, 0),
        )
        return _texture_source(replace(texture, image=image, is_srgb=False, bias=default))

    def part(self, shader: UsdShade.Shader, file: str, wraps: tuple[str, str], *, is_color: bool) -> Source:
        """Return one of the images that a node is made of, before its coordinates are moved.

        Args:
            shader: The node.
            file: Its input that names the image.
            wraps: What the node has beyond it, across and upwards.
            is_color: As of ``image``.
        """
        return self._source(
            shader,
            coordinates=Coordinates(),
            wraps=list(wraps),
            scale=(1.0, 1.0, 1.0, 1.0),
            bias=(0.0, 0.0, 0.0, 0.0),
            fallback=self._vector4(shader, "default", (0.0, 0.0, 0.0, 0.0)),
            color_space="auto" if is_color else "raw",
            file=file,
        )

    def _source(
        self,
        shader: UsdShade.Shader,
        *,
        coordinates: Coordinates,
        wraps: list[str],
        scale: Vector4,
        bias: Vector4,
        fallback: Vector4,
        color_space: str,
        file: str = "file",
    ) -> Source:
        prim = shader.GetPath()
        asset, attribute = self._file(shader, file)
        tiles, of_file = None, NO_WRAPS
        if asset is not None and UsdShade.UdimUtils.IsUdimIdentifier(asset.path):
            rows = self._images.load_tiles(attribute, asset, prim)
            decoded = {place: self._decoded(row, color_space, attribute, prim) for place, row in rows.items()}
            image, tiles, is_srgb = self._lay_out(decoded)
        else:
            row = -1 if asset is None else self._images.load(asset, prim)
            of_file = self._images.wraps(row)
            image, is_srgb = self._decoded(row, color_space, attribute, prim)
        wrap_s, wrap_t = (self._wrap(shader, *tokens) for tokens in zip(wraps, of_file, strict=True))
        texture = Texture(
            image,
            tiles=tiles,
            primvar=coordinates.primvar,
            uv_fallback=coordinates.fallback,
            uv_transform=coordinates.transform[:2].astype(np.float32),
            wrap_s=wrap_s,
            wrap_t=wrap_t,
            scale=scale,
            bias=bias,
            fallback=fallback,
            mag_filter=self._mag_filter(shader),
            is_srgb=is_srgb,
        )
        return _texture_source(texture)

    def _file(self, shader: UsdShade.Shader, name: str) -> tuple[Sdf.AssetPath | None, Usd.Attribute | None]:
        """Return which image a node names, and where; no asset, told, for what is none."""
        port = shader.GetInput(name)
        attribute = find_source(port, self._report) if port else None
        if isinstance(attribute, Node):
            warn_connected(port, self._report)
            return None, None
        value = attribute.Get(self._time) if attribute else None
        if value is None or isinstance(value, Sdf.AssetPath):
            return value or Sdf.AssetPath(), attribute
        warn_type(shader.GetInput(name).GetAttr(), value, "no asset path", self._report)
        return None, None

    def _decoded(self, row: int, color_space: str, attribute: Usd.Attribute, prim: Sdf.Path) -> tuple[int, bool]:
        """Return the row to read of an image, and whether to decode it by the sRGB curve, as the node says."""
        if color_space == "auto":
            return self._images.decoded(row, attribute, prim)
        named = find_color_space(color_space)  # the tokens raw and sRGB are such names, too
        if named is None:
            self._report.warn(UNKNOWN_TOKEN, prim, f"the sourceColorSpace {color_space!r} is unknown; read as raw")
            return row, False
        return self._images.in_space(row, named)

    def _lay_out(self, decoded: dict[tuple[int, int], tuple[int, bool]]) -> tuple[int, Tiles | None, bool]:
        """Return one of the images of tiles, their grid, and whether to decode them by the sRGB curve.

        Args:
            decoded: By column and row, the row of an image, and whether to decode it by the sRGB curve. Where some are
                to be, and others, of more than 8 bits, are not, those are decoded here.
        """
        if not decoded:
            return -1, None, False
        is_srgb = all(is_encoded for _, is_encoded in decoded.values())
        rows = {
            place: self._images.mixed(row, True, np.eye(4)) if is_encoded and not is_srgb else row
            for place, (row, is_encoded) in decoded.items()
        }
        (left, bottom), (right, top) = np.min(list(rows), axis=0).tolist(), np.max(list(rows), axis=0).tolist()
        grid = tuple(tuple(rows.get((u, v), -1) for u in range(left, right + 1)) for v in range(bottom, top + 1))
        return next(iter(rows.values())), Tiles(left, bottom, grid), is_srgb

    def _wrap(self, shader: UsdShade.Shader, token: str, of_file: str) -> Wrap:
        """Return a wrap mode by its token, or that of the file."""
        if token == _OF_FILE:
            return _WRAPS.get(of_file, Wrap.BLACK)
        if token not in _WRAPS:
            self._report.warn(UNKNOWN_TOKEN, shader.GetPath(), f"the wrap mode {token!r} is unknown; read as black")
        return _WRAPS.get(token, Wrap.BLACK)

    def _mag_filter(self, shader: UsdShade.Shader) -> MagFilter:
        """Return how an image node of MaterialX is read between texels; those of USD are, linearly."""
        if not (shader.GetShaderId() or "").startswith("ND_"):
            return MagFilter.LINEAR
        token = self._token(shader, "filtertype", "linear")
        if token not in _MAG_FILTERS:
            message = f"the filtertype {token!r} is unknown; read as linear"
            self._report.warn(UNKNOWN_TOKEN, shader.GetPath(), message)
        return _MAG_FILTERS.get(token, MagFilter.LINEAR)

    def _token(self, shader: UsdShade.Shader, name: str, default: str) -> str:
        value = read_token(shader, name, self._time, self._report)
        return default if value is None else value

    def _vector4(self, shader: UsdShade.Shader, name: str, default: Vector4) -> Vector4:
        found = read_numbers(shader, name, (1, 3, 4), self._time, self._report)
        if found is None:
            return default
        red, green, blue = found[:3] if len(found) >= 3 else (found[0],) * 3
        return (red, green, blue, found[3] if len(found) == 4 else default[3])


def _texture_source(texture: Texture) -> Source:
    values = (
        texture.image,
        texture.tiles,
        texture.primvar,
        texture.uv_fallback,
        texture.uv_transform.tolist(),
        texture.is_srgb,
        texture.mag_filter,
    )
    return Source(
        f"{values} {texture.wrap_s} {texture.wrap_t} {texture.scale} {texture.bias} {texture.fallback}", texture
    )
