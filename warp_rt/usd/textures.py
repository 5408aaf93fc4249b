# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What feeds the inputs of surfaces: UsdUVTexture, UsdPrimvarReader_* and UsdTransform2d to Input and Texture.

MaterialX's nodes of the same purpose, written as UsdShade, are read alike: ND_UsdUVTexture, ND_UsdPrimvarReader_*,
ND_UsdTransform2d, ND_image_*, ND_tiledimage_*, ND_geompropvalue_* and ND_texcoord_*; what its arithmetic does to them
is folded (``materialx_nodes``).

Reference: UsdPreviewSurface Specification, sections on UsdUVTexture, UsdPrimvarReader and UsdTransform2d.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from warp_rt.report import Report
from warp_rt.scene import Input, Texture, Wrap
from warp_rt.usd.attribute_values import numbers
from warp_rt.usd.color_spaces import color_space as find_color_space
from warp_rt.usd.color_spaces import color_space_of
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.materialx_nodes import fold, is_known_node
from warp_rt.usd.shading_network import (
    WRONG_TYPE,
    Node,
    find_source,
    read_constant,
    read_numbers,
    read_token,
)
from warp_rt.usd.signals import CHANNELS, DoesNotFold, Signal, Source

UNKNOWN_TOKEN = "W204"
NO_COORDINATES = "W206"
UNKNOWN_NODE = "W303"

_WRAPS = {
    "useMetadata": Wrap.BLACK,  # no format read here carries wrap modes, and without them the mode is black
    "black": Wrap.BLACK,
    "constant": Wrap.BLACK,
    "clamp": Wrap.CLAMP,
    "repeat": Wrap.REPEAT,
    "periodic": Wrap.REPEAT,
    "mirror": Wrap.MIRROR,
}
Vector4 = tuple[float, float, float, float]
# Nodes that give what comes in by the input of this name.
_PASSING_ON = {"MayaND_fileTexture_color3": "inColor", "MayaND_fileTexture_color4": "inColor"}
_READER = re.compile(r"(?:ND_)?(?:UsdPrimvarReader|geompropvalue)_([a-z]+)(\d?)")
# Components of readers whose name does not end with the number; the kinds left out give no colour.
_READER_SIZES = {"float": 1, "int": 1, "integer": 1, "color": 3, "vector": 3, "normal": 3, "point": 3}
_IMAGE = re.compile(r"ND_(tiled)?image_(float|color3|color4|vector2|vector3|vector4)")
_IMAGE_SIZES = {"float": 1, "color3": 3, "color4": 4, "vector2": 2, "vector3": 3, "vector4": 4}
_OUTPUTS = {"r": (0,), "g": (1,), "b": (2,), "a": (3,), "rgba": (0, 1, 2, 3)}
_MAX_CHAIN = 64  # nodes in a row


@dataclass(frozen=True)
class Coordinates:
    """Where texture coordinates come from."""

    primvar: str = "st"
    fallback: tuple[float, float] = (0.0, 0.0)
    transform: np.ndarray = field(default_factory=lambda: np.eye(3))
    """Affine map of (u, v, 1), shape [3, 3]."""

    @staticmethod
    def constant(u: float, v: float) -> Coordinates:
        """Return the same coordinates everywhere: a map that lets no primvar through."""
        return Coordinates(fallback=(u, v), transform=np.array([[0.0, 0.0, u], [0.0, 0.0, v], [0.0, 0.0, 1.0]]))


class _Unfolded(Exception):
    """A node that has no place in what a kernel reads."""

    def __init__(self, node: Node, *, is_known: bool = False) -> None:
        super().__init__(node.id)
        self.node = node
        self.is_known = is_known


class InputReader:
    """Reads inputs of surfaces, and keeps the textures that they use."""

    def __init__(self, images: ImageCache, time: Usd.TimeCode, report: Report) -> None:
        self.textures: list[Texture] = []
        """Rows of ``Scene.textures``."""
        self._images = images
        self._time = time
        self._report = report
        self._sources: dict[Sdf.Path, Source] = {}
        self._rows: dict[tuple[str, bytes], int] = {}
        self._chain: list[Sdf.Path] = []

    def read(self, port: UsdShade.Input, count: int, material: Usd.Prim) -> Input | None:
        """Return what an input says.

        Args:
            port: The input of a surface shader.
            count: Components that the surface expects: 1 or 3.
            material: The material's prim; its primvars serve where a mesh lacks them.

        Returns:
            None where nothing is said, so that the specification's default holds.
        """
        found = self.signal(port, material, (1, 3, 4))
        return self.lower(found, count, port) if found else None

    def signal(self, port: UsdShade.Input, material: Usd.Prim, sizes: Sequence[int]) -> Signal | None:
        """Return what an input says, as a signal; None where it says nothing, or, told, nothing that folds.

        Args:
            port: The input.
            material: The material's prim.
            sizes: Components that a value authored on it may have.
        """
        try:
            return self._follow(port, material, sizes)
        except _Unfolded as error:
            self._warn_unknown(error.node, error.is_known)
            return None

    def lower(self, found: Signal, count: int, port: UsdShade.Input) -> Input | None:
        """Return a signal as an input of ``count`` components; None, told, where no texture or primvar gives it."""
        value = found.value
        if value is not None:
            return Input(value=_components(value, count))
        matrix = found.resized(count if found.size != 4 else 4).matrix[:count]
        linear, offset, source = matrix[:, :-1], matrix[:, -1], found.source
        if source is None:
            return None
        channel = _common_channel(matrix)
        diagonal = np.zeros((count, CHANNELS))
        np.fill_diagonal(diagonal, linear.diagonal())
        is_plain = channel >= 0 or np.array_equal(linear, diagonal)
        if source.texture is None:
            if not is_plain:
                message = "mixes the components of a primvar, which is not supported; the default is used"
                self._report.warn(UNKNOWN_NODE, port.GetAttr().GetPath(), message)
                return None
            scale, bias = _scale_and_bias(matrix, channel)
            fallback = _components(source.fallback, count) if channel <= 0 else _components(source.fallback, CHANNELS)
            return Input(value=fallback, primvar=source.primvar, channel=channel, scale=scale, bias=bias)
        if is_plain:
            scale, bias = _scale_and_bias(matrix, channel)
            row = self._row(source, scale, bias)
        else:
            row, channel = self._mixed_row(source, linear, offset), 0 if count == 1 else -1
        return Input(texture=row, channel=channel)

    def check_ior(self, port: UsdShade.Input, found: Input | None) -> Input | None:
        """Return an index of refraction; None, told, of a constant that is not above 0, for the default to hold."""
        if found is None or found.texture >= 0 or found.primvar or found.value[0] > 0.0:
            return found
        message = f"is {found.value[0]:g}, an index of refraction not above 0; the default is used"
        self._report.warn(WRONG_TYPE, port.GetAttr().GetPath(), message)
        return None

    def add(self, texture: Texture) -> int:
        """Return the row of a new texture."""
        self.textures.append(texture)
        return len(self.textures) - 1

    def _row(self, source: Source, scale: Vector4, bias: Vector4) -> int:
        """Return the row of a texture whose value, and fallback, is scaled and shifted."""
        key = (source.key, np.array((scale, bias)).tobytes())
        if key not in self._rows and source.texture:
            texture = source.texture
            self._rows[key] = self.add(
                replace(
                    texture,
                    scale=_vector4(np.multiply(texture.scale, scale)),
                    bias=_vector4(np.multiply(texture.bias, scale) + bias),
                    fallback=_vector4(np.multiply(texture.fallback, scale) + bias),
                )
            )
        return self._rows[key]

    def _mixed_row(self, source: Source, linear: np.ndarray, offset: np.ndarray) -> int:
        """Return the row of a texture whose channels are sums over those of a source.

        Filtering, and what lies outside a black border, are the same before the channels are mixed and after.
        """
        key = (source.key, np.column_stack([linear, offset]).tobytes())
        if key not in self._rows and source.texture:
            texture = source.texture
            matrix, shift = np.zeros((CHANNELS, CHANNELS)), np.zeros(CHANNELS)
            matrix[: len(linear)], shift[: len(linear)] = linear, offset
            image = texture.image
            if image >= 0:
                image = self._images.mixed(image, texture.is_srgb, matrix * texture.scale)
            self._rows[key] = self.add(
                replace(
                    texture,
                    image=image,
                    is_srgb=False,
                    scale=(1.0, 1.0, 1.0, 1.0),
                    bias=_vector4(matrix @ texture.bias + shift),
                    fallback=_vector4(matrix @ texture.fallback + shift),
                )
            )
        return self._rows[key]

    # --- nodes

    def _follow(self, port: UsdShade.Input | None, material: Usd.Prim, sizes: Sequence[int]) -> Signal | None:
        """Return what an input says; None: nothing.

        Raises:
            _Unfolded: A node on the way does not fold.
        """
        source = find_source(port, self._report) if port else None
        if source is None:
            return None
        if isinstance(source, Node):
            path = source.shader.GetPath()
            if path in self._chain or len(self._chain) >= _MAX_CHAIN:
                raise _Unfolded(source)
            self._chain.append(path)
            try:
                return self._node(source, material)
            except DoesNotFold:
                raise _Unfolded(source, is_known=is_known_node(source.id)) from None
            finally:
                self._chain.pop()
        found = numbers(source.Get(self._time))
        if found is None or len(found) not in sizes:
            wanted = " or ".join(map(str, sizes))
            self._report.warn(WRONG_TYPE, source.GetPath(), f"not {wanted} finite numbers; the default is used")
            return None
        space = color_space_of(source, self._report)
        if space and len(found) >= 3:
            found = (*space.to_linear(np.array(found[:3])).tolist(), *found[3:])
        return Signal.constant(found)

    def _node(self, node: Node, material: Usd.Prim) -> Signal | None:
        """Return what a node gives.

        Raises:
            DoesNotFold: It is no node that folds.
        """
        name, shader = node.id.removeprefix("ND_"), node.shader
        if name.startswith("UsdUVTexture"):
            return Signal.of(self._texture(shader, material), CHANNELS).pick(_OUTPUTS.get(node.output, (0, 1, 2)))
        image = _IMAGE.fullmatch(node.id)
        if image:
            source = self._image_node(shader, material, is_color="color" in image[2], is_tiled=bool(image[1]))
            return Signal.of(source, _IMAGE_SIZES[image[2]])
        reader = _READER.fullmatch(node.id)
        if reader and reader[1] in _READER_SIZES:
            return self._primvar(shader, int(reader[2] or _READER_SIZES[reader[1]]), material)
        if name.startswith("texcoord_"):
            index = read_constant(shader, "index", self._time, self._report)
            return Signal.of(_primvar_source(_coordinate_name(index), (0.0, 0.0)), 2)
        if name.startswith("UsdTransform2d"):
            given = self._follow(shader.GetInput("in"), material, (2,)) or Signal.constant((0.0, 0.0))
            matrix = self._transform(shader)
            return given.resized(2).map(matrix[:2, :2], matrix[:2, 2])
        if node.id in _PASSING_ON:
            return self._follow(shader.GetInput(_PASSING_ON[node.id]), material, (1, 2, 3, 4))

        def read_input(given: str) -> Signal | None:
            found = self._follow(shader.GetInput(given), material, (1, 2, 3, 4))
            if found is None and given == "texcoord":
                return Signal.of(_primvar_source("st", (0.0, 0.0)), 2)
            return found

        return fold(node.id, node.output, read_input, lambda given: self._token(shader, given, ""))

    def _warn_unknown(self, node: Node, is_known: bool) -> None:
        kind = f"the node {node.id!r}" if node.id else "a node without info:id"
        why = "does not come down to one texture or primvar, scaled" if is_known else "is not supported"
        self._report.warn(UNKNOWN_NODE, node.shader.GetPath(), f"{kind} {why}; the default is used")

    # --- primvars

    def _primvar(self, shader: UsdShade.Shader, size: int, material: Usd.Prim) -> Signal:
        name = self._varname(shader)
        fallback = self._fallback(shader, name, material) or (0.0,) * size
        if not name:
            self._report.warn(NO_COORDINATES, shader.GetPath(), "names no primvar; its fallback is used")
            return Signal.constant(fallback)
        return Signal.of(_primvar_source(name, fallback), size)

    def _varname(self, shader: UsdShade.Shader) -> str:
        for name in ("varname", "geomprop"):
            value = read_constant(shader, name, self._time, self._report)
            if isinstance(value, str):
                return value.removeprefix("primvars:")
        return ""

    def _fallback(self, shader: UsdShade.Shader, name: str, material: Usd.Prim) -> tuple[float, ...] | None:
        """Return the value where a mesh has no such primvar: the material's own primvar, else the reader's."""
        if name and material:
            primvar = UsdGeom.PrimvarsAPI(material).GetPrimvar(name)
            found = numbers(primvar.Get(self._time)) if primvar else None
            if found:
                return found
        for port in ("fallback", "default"):
            found = read_numbers(shader, port, (1, 2, 3, 4), self._time, self._report)
            if found:
                return found
        return None

    # --- textures

    def _texture(self, shader: UsdShade.Shader, material: Usd.Prim) -> Source:
        path = shader.GetPath()
        if path not in self._sources:
            is_materialx = (shader.GetShaderId() or "").startswith("ND_")
            wraps = [
                self._wrap(shader, name, "periodic" if is_materialx else "useMetadata") for name in ("wrapS", "wrapT")
            ]
            self._sources[path] = self._make_source(
                shader,
                file=shader.GetInput("file"),
                coordinates=self._coordinates(shader.GetInput("st"), shader, material),
                wraps=wraps,
                scale=self._vector4(shader, "scale", (1.0, 1.0, 1.0, 1.0)),
                bias=self._vector4(shader, "bias", (0.0, 0.0, 0.0, 0.0)),
                fallback=self._vector4(shader, "fallback", (0.0, 0.0, 0.0, 1.0)),
                color_space=self._token(shader, "sourceColorSpace", "auto"),
            )
        return self._sources[path]

    def _image_node(self, shader: UsdShade.Shader, material: Usd.Prim, *, is_color: bool, is_tiled: bool) -> Source:
        path = shader.GetPath()
        if path not in self._sources:
            texcoord = shader.GetInput("texcoord")
            coordinates = self._coordinates(texcoord, shader, material) if texcoord else Coordinates()
            if is_tiled:
                coordinates = replace(coordinates, transform=self._tiling(shader) @ coordinates.transform)
            wraps = (self._wrap(shader, name, "periodic") for name in ("uaddressmode", "vaddressmode"))
            self._sources[path] = self._make_source(
                shader,
                file=shader.GetInput("file"),
                coordinates=coordinates,
                wraps=[Wrap.REPEAT, Wrap.REPEAT] if is_tiled else list(wraps),
                scale=(1.0, 1.0, 1.0, 1.0),
                bias=(0.0, 0.0, 0.0, 0.0),
                fallback=self._vector4(shader, "default", (0.0, 0.0, 0.0, 1.0)),
                color_space="auto" if is_color else "raw",
            )
        return self._sources[path]

    def _tiling(self, shader: UsdShade.Shader) -> np.ndarray:
        """Return what a tiledimage makes of coordinates: (st uvtiling - uvoffset) / realworldimagesize * tile size."""
        tiling, offset, image, tile = (
            np.resize(read_numbers(shader, name, (1, 2), self._time, self._report) or (default,), 2)
            for name, default in (
                *(("uvtiling", 1.0), ("uvoffset", 0.0)),
                *(("realworldimagesize", 1.0), ("realworldtilesize", 1.0)),
            )
        )
        stretch = tile / np.where(image == 0, 1.0, image)
        return np.array(
            [
                [*(stretch * tiling * (1, 0)), -stretch[0] * offset[0]],
                [*(stretch * tiling * (0, 1)), -stretch[1] * offset[1]],
                [0, 0, 1],
            ]
        )

    def _make_source(
        self,
        shader: UsdShade.Shader,
        *,
        file: UsdShade.Input,
        coordinates: Coordinates,
        wraps: list[Wrap],
        scale: tuple[float, float, float, float],
        bias: tuple[float, float, float, float],
        fallback: tuple[float, float, float, float],
        color_space: str,
    ) -> Source:
        prim = shader.GetPath()
        attribute = find_source(file, self._report) if file else None
        asset = attribute.Get(self._time) if isinstance(attribute, Usd.Attribute) else None
        transform = coordinates.transform
        if isinstance(asset, Sdf.AssetPath) and UsdShade.UdimUtils.IsUdimIdentifier(asset.path):
            image, tiling = self._images.load_tiles(attribute, asset, prim)
            transform = np.vstack([tiling, [0, 0, 1]]) @ transform
            wraps = [Wrap.TILES, Wrap.TILES]
        else:
            image = self._images.load(asset if isinstance(asset, Sdf.AssetPath) else Sdf.AssetPath(), prim)
        is_srgb = False
        if color_space == "auto" and image >= 0:
            image, is_srgb = self._images.decoded(image, attribute, prim)
        elif color_space != "auto":
            named = find_color_space(color_space)  # the tokens raw and sRGB are such names, too
            if named is not None:
                image, is_srgb = self._images.in_space(image, named)
            else:
                self._report.warn(UNKNOWN_TOKEN, prim, f"the sourceColorSpace {color_space!r} is unknown; read as raw")
        texture = Texture(
            image,
            primvar=coordinates.primvar,
            uv_fallback=coordinates.fallback,
            uv_transform=transform[:2].astype(np.float32),
            wrap_s=wraps[0],
            wrap_t=wraps[1],
            scale=scale,
            bias=bias,
            fallback=fallback,
            is_srgb=is_srgb,
        )
        return _texture_source(texture)

    def _coordinates(self, port: UsdShade.Input | None, shader: UsdShade.Shader, material: Usd.Prim) -> Coordinates:
        """Return where an ``st`` input leads to, through whatever moves it about."""
        try:
            found = self._follow(port, material, (2,))
        except _Unfolded as error:
            self._warn_coordinates(error.node)
            return Coordinates()
        value = Signal.constant((0.0, 0.0)).value if found is None else found.value
        if found is None or value is not None:
            u, v = value[:2] if value and len(value) > 1 else (0.0, 0.0)
            self._report.warn(NO_COORDINATES, shader.GetPath(), f"has no texture coordinates; ({u:g}, {v:g}) is used")
            return Coordinates.constant(u, v)
        source = found.source
        if source is None or source.texture is not None:
            at = find_source(port, self._report) if port else None
            if isinstance(at, Node):
                self._warn_coordinates(at)
            return Coordinates()
        u, v = source.fallback[:2] if len(source.fallback) > 1 else (0.0, 0.0)
        rows = found.resized(2).matrix[:, [0, 1, -1]]
        return Coordinates(source.primvar, (u, v), np.vstack([rows, [0.0, 0.0, 1.0]]))

    def _warn_coordinates(self, node: Node) -> None:
        kind = f"the node {node.id!r}" if node.id else "a node without info:id"
        message = f"{kind} gives no texture coordinates here; st is used"
        self._report.warn(UNKNOWN_NODE, node.shader.GetPath(), message)

    def _transform(self, shader: UsdShade.Shader) -> np.ndarray:
        """Return scale, then counter-clockwise rotation, then translation as one matrix, shape [3, 3]."""
        angle = read_numbers(shader, "rotation", (1,), self._time, self._report) or (0.0,)
        scale = read_numbers(shader, "scale", (1, 2), self._time, self._report) or (1.0, 1.0)
        translation = read_numbers(shader, "translation", (1, 2), self._time, self._report) or (0.0, 0.0)
        cosine, sine = np.cos(np.radians(angle[0])), np.sin(np.radians(angle[0]))
        linear = np.array([[cosine, -sine], [sine, cosine]]) * np.resize(scale, 2)
        return np.vstack([np.column_stack([linear, np.resize(translation, 2)]), [0.0, 0.0, 1.0]])

    def _wrap(self, shader: UsdShade.Shader, name: str, default: str) -> Wrap:
        token = self._token(shader, name, default)
        if token not in _WRAPS:
            self._report.warn(UNKNOWN_TOKEN, shader.GetPath(), f"the wrap mode {token!r} is unknown; read as black")
        return _WRAPS.get(token, Wrap.BLACK)

    def _token(self, shader: UsdShade.Shader, name: str, default: str) -> str:
        value = read_token(shader, name, self._time, self._report)
        return default if value is None else value

    def _vector4(
        self, shader: UsdShade.Shader, name: str, default: tuple[float, float, float, float]
    ) -> tuple[float, float, float, float]:
        found = read_numbers(shader, name, (1, 3, 4), self._time, self._report)
        if found is None:
            return default
        red, green, blue = found[:3] if len(found) >= 3 else (found[0],) * 3
        return (red, green, blue, found[3] if len(found) == 4 else default[3])


def _components(found: tuple[float, ...], count: int) -> tuple[float, float, float, float]:
    """Return numbers as an Input's value: scalars fill a colour, a colour gives a scalar its first component."""
    if count == 1:
        return (found[0], 0.0, 0.0, 0.0)
    red, green, blue, alpha = (*((found * 3) if len(found) == 1 else found), 0.0, 0.0)[:4]
    return (red, green, blue, alpha)


def _vector4(values: np.ndarray) -> Vector4:
    x, y, z, w = (float(value) for value in values)
    return (x, y, z, w)


def _common_channel(matrix: np.ndarray) -> int:
    """Return the one channel that all rows take alike; -1 where they do not, or are the first channels in order."""
    used = np.flatnonzero(matrix[0, :-1])
    if len(used) == 1 and (matrix == matrix[0]).all():
        return int(used[0])
    return -1


def _scale_and_bias(matrix: np.ndarray, channel: int) -> tuple[Vector4, Vector4]:
    """Return what the channels of a source are multiplied by and shifted by; those that nobody asks for stay."""
    scale, bias = np.ones(CHANNELS), np.zeros(CHANNELS)
    if channel >= 0:
        scale[channel], bias[channel] = matrix[0, channel], matrix[0, -1]
    else:
        scale[: len(matrix)], bias[: len(matrix)] = matrix[:, :-1].diagonal(), matrix[:, -1]
    return _vector4(scale), _vector4(bias)


def _coordinate_name(index: Any) -> str:
    """Return the primvar that a texcoord node with an index reads."""
    return f"st{index}" if isinstance(index, int) and index > 0 else "st"


def _primvar_source(name: str, fallback: tuple[float, ...]) -> Source:
    return Source(f"primvar {name} {fallback}", primvar=name, fallback=fallback)


def _texture_source(texture: Texture) -> Source:
    values = (texture.image, texture.primvar, texture.uv_fallback, texture.uv_transform.tolist(), texture.is_srgb)
    return Source(
        f"{values} {texture.wrap_s} {texture.wrap_t} {texture.scale} {texture.bias} {texture.fallback}", texture
    )
