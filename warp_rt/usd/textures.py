# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What feeds the inputs of surfaces: UsdUVTexture, UsdPrimvarReader_* and UsdTransform2d to Input and Texture.

MaterialX's nodes of the same purpose, written as UsdShade, are read alike: ND_UsdUVTexture, ND_UsdPrimvarReader_*,
ND_UsdTransform2d, ND_image_*, ND_geompropvalue_*, ND_texcoord_* and ND_constant_*.

Reference: UsdPreviewSurface Specification, sections on UsdUVTexture, UsdPrimvarReader and UsdTransform2d.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from warp_rt.report import Report
from warp_rt.scene import Input, Texture, Wrap
from warp_rt.usd.attribute_values import numbers
from warp_rt.usd.color_spaces import color_space_of
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.shading_network import (
    WRONG_TYPE,
    Node,
    find_source,
    read_constant,
    read_numbers,
    read_token,
    shader_id,
)

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
_CHANNELS = {"r": 0, "g": 1, "b": 2, "a": 3}
_READER = re.compile(r"(?:ND_)?(?:UsdPrimvarReader|geompropvalue)_([a-z]+)(\d?)")
# Components of readers whose name does not end with the number; the kinds left out give no colour.
_READER_SIZES = {"float": 1, "int": 1, "integer": 1, "color": 3, "vector": 3, "normal": 3, "point": 3}
_PASSING_ON = re.compile(r"ND_(convert|dot)_")  # nodes that give what comes in, at most in another type
_MAX_CHAIN = 64  # UsdTransform2d or such nodes in a row; what goes on after that many is a cycle


@dataclass(frozen=True)
class Coordinates:
    """Where texture coordinates come from."""

    primvar: str = "st"
    fallback: tuple[float, float] = (0.0, 0.0)
    transform: np.ndarray = field(default_factory=lambda: np.eye(3))
    """Affine map of (u, v, 1), shape [3, 3]."""

    @staticmethod
    def constant(u: float, v: float, transform: np.ndarray) -> Coordinates:
        """Return the same coordinates everywhere: a map that lets no primvar through."""
        u, v, _ = transform @ (u, v, 1.0)
        return Coordinates(fallback=(u, v), transform=np.array([[0.0, 0.0, u], [0.0, 0.0, v], [0.0, 0.0, 1.0]]))


class InputReader:
    """Reads inputs of surfaces, and keeps the textures that they use."""

    def __init__(self, images: ImageCache, time: Usd.TimeCode, report: Report) -> None:
        self.textures: list[Texture] = []
        """Rows of ``Scene.textures``."""
        self._images = images
        self._time = time
        self._report = report
        self._rows: dict[Sdf.Path, int] = {}

    def read(self, port: UsdShade.Input, count: int, material: Usd.Prim) -> Input | None:
        """Return what an input says.

        Args:
            port: The input of a surface shader.
            count: Components that the surface expects: 1 or 3.
            material: The material's prim; its primvars serve where a mesh lacks them.

        Returns:
            None where nothing is said, so that the specification's default holds.
        """
        source = find_source(port, self._report)
        for _ in range(_MAX_CHAIN):
            if not isinstance(source, Node) or not _PASSING_ON.match(source.id):
                break
            port = source.shader.GetInput("in")
            source = find_source(port, self._report) if port else None
        if source is None:
            return None
        if isinstance(source, Node):
            return self._read_node(source, count, material)
        found = numbers(source.Get(self._time))
        if found is None or len(found) not in (1, 3, 4):
            self._report.warn(WRONG_TYPE, source.GetPath(), f"not {count} finite numbers; the default is used")
            return None
        space = color_space_of(source, self._report)
        if space and len(found) >= 3:
            found = (*space.to_linear(np.array(found[:3])).tolist(), *found[3:])
        return Input(value=_components(found, count))

    def add(self, texture: Texture) -> int:
        """Return the row of a new texture."""
        self.textures.append(texture)
        return len(self.textures) - 1

    def _read_node(self, node: Node, count: int, material: Usd.Prim) -> Input | None:
        name = node.id.removeprefix("ND_")
        if name.startswith("UsdUVTexture"):
            return _pick(Input(texture=self._texture(node.shader)), node.output, count)
        if name.startswith("image_"):
            is_scalar = name.startswith("image_float")
            row = self._image_node(node.shader, is_color=name.startswith("image_color"))
            return Input(texture=row, channel=0 if is_scalar or count == 1 else -1)
        reader = _READER.fullmatch(node.id)
        if reader and reader[1] in _READER_SIZES:
            return self._primvar(node.shader, int(reader[2] or _READER_SIZES[reader[1]]), count, material)
        if name.startswith("constant_"):
            found = read_numbers(node.shader, "value", (1, 2, 3, 4), self._time, self._report)
            return Input(value=_components(found, count)) if found else None
        self._warn_unknown(node)
        return None

    def _warn_unknown(self, node: Node) -> None:
        kind = f"the node {node.id!r}" if node.id else "a node without info:id"
        self._report.warn(UNKNOWN_NODE, node.shader.GetPath(), f"{kind} is not supported; the default is used")

    # --- primvars

    def _primvar(self, shader: UsdShade.Shader, size: int, count: int, material: Usd.Prim) -> Input | None:
        name = self._varname(shader)
        fallback = self._fallback(shader, name, material) or (0.0,) * size
        if not name:
            self._report.warn(NO_COORDINATES, shader.GetPath(), "names no primvar; its fallback is used")
            return Input(value=_components(fallback, count))
        return Input(value=_components(fallback, count), primvar=name, channel=0 if min(size, count) == 1 else -1)

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

    def _texture(self, shader: UsdShade.Shader) -> int:
        path = shader.GetPath()
        if path not in self._rows:
            is_materialx = (shader.GetShaderId() or "").startswith("ND_")
            wraps = [
                self._wrap(shader, name, "periodic" if is_materialx else "useMetadata") for name in ("wrapS", "wrapT")
            ]
            self._rows[path] = self._add_texture(
                shader,
                file=shader.GetInput("file"),
                coordinates=self._coordinates(shader.GetInput("st"), shader),
                wraps=wraps,
                scale=self._vector4(shader, "scale", (1.0, 1.0, 1.0, 1.0)),
                bias=self._vector4(shader, "bias", (0.0, 0.0, 0.0, 0.0)),
                fallback=self._vector4(shader, "fallback", (0.0, 0.0, 0.0, 1.0)),
                color_space=self._token(shader, "sourceColorSpace", "auto"),
            )
        return self._rows[path]

    def _image_node(self, shader: UsdShade.Shader, is_color: bool) -> int:
        path = shader.GetPath()
        if path not in self._rows:
            texcoord = shader.GetInput("texcoord")
            self._rows[path] = self._add_texture(
                shader,
                file=shader.GetInput("file"),
                coordinates=self._coordinates(texcoord, shader) if texcoord else Coordinates(),
                wraps=[self._wrap(shader, name, "periodic") for name in ("uaddressmode", "vaddressmode")],
                scale=(1.0, 1.0, 1.0, 1.0),
                bias=(0.0, 0.0, 0.0, 0.0),
                fallback=self._vector4(shader, "default", (0.0, 0.0, 0.0, 1.0)),
                color_space="auto" if is_color else "raw",
            )
        return self._rows[path]

    def _add_texture(
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
    ) -> int:
        prim = shader.GetPath()
        attribute = find_source(file, self._report) if file else None
        asset = attribute.Get(self._time) if isinstance(attribute, Usd.Attribute) else None
        transform = coordinates.transform
        if isinstance(asset, Sdf.AssetPath) and UsdShade.UdimUtils.IsUdimIdentifier(asset.path):
            image, tiling = self._images.load_tiles(attribute, asset, prim)
            transform = np.vstack([tiling, [0, 0, 1]]) @ transform
            wraps = [Wrap.CLAMP, Wrap.CLAMP]  # seams often end on the outermost tiles, which black would bleed into
        else:
            image = self._images.load(asset if isinstance(asset, Sdf.AssetPath) else Sdf.AssetPath(), prim)
        if color_space == "auto":
            image, is_srgb = self._images.decoded(image, attribute, prim) if image >= 0 else (image, False)
        else:
            is_srgb = color_space == "sRGB"
            if color_space not in ("sRGB", "raw"):
                self._report.warn(UNKNOWN_TOKEN, prim, f"the sourceColorSpace {color_space!r} is unknown; read as raw")
        return self.add(
            Texture(
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
        )

    def _coordinates(self, port: UsdShade.Input, shader: UsdShade.Shader) -> Coordinates:
        """Return where an ``st`` input leads to, through any UsdTransform2d nodes."""
        transform = np.eye(3)
        last = shader
        for _ in range(_MAX_CHAIN):
            source = find_source(port, self._report) if port else None
            if not isinstance(source, Node):
                constant = numbers(source.Get(self._time)) if source else None
                u, v = constant if constant and len(constant) == 2 else (0.0, 0.0)
                self._report.warn(
                    NO_COORDINATES, shader.GetPath(), f"has no texture coordinates; ({u:g}, {v:g}) is used"
                )
                return Coordinates.constant(u, v, transform)
            last = source.shader
            name = source.id.removeprefix("ND_")
            if name.startswith("UsdTransform2d"):
                transform = transform @ self._transform(source.shader)
                port = source.shader.GetInput("in")
                continue
            if name.startswith("texcoord_"):
                return Coordinates(transform=transform)
            if _READER.fullmatch(source.id):
                varname = self._varname(source.shader)
                found = self._fallback(source.shader, varname, Usd.Prim())
                u, v = found[:2] if found and len(found) > 1 else (0.0, 0.0)
                if varname:
                    return Coordinates(varname, (u, v), transform)
                self._report.warn(NO_COORDINATES, source.shader.GetPath(), "names no primvar; its fallback is used")
                return Coordinates.constant(u, v, transform)
            break
        kind = f"the node {shader_id(last)!r}" if shader_id(last) else "a node without info:id"
        self._report.warn(UNKNOWN_NODE, last.GetPath(), f"{kind} gives no texture coordinates here; st is used")
        return Coordinates(transform=transform)

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


def _pick(value: Input, output: str, count: int) -> Input:
    channel = _CHANNELS.get(output, 0 if count == 1 else -1)
    return Input(value.value, value.texture, value.primvar, channel)
