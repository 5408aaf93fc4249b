# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What shading networks compute: from an input through all nodes before it to a signal.

Read are UsdUVTexture, UsdPrimvarReader_* and UsdTransform2d, and MaterialX's nodes of the same purpose, written as
UsdShade: ND_UsdUVTexture, ND_UsdPrimvarReader_*, ND_UsdTransform2d, ND_image_*, ND_tiledimage_*, ND_gltf_image_*,
ND_geompropvalue_* and ND_texcoord_*; what its arithmetic does to them is folded (``materialx_nodes``).

Reference: UsdPreviewSurface Specification, sections on UsdUVTexture, UsdPrimvarReader and UsdTransform2d.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from warp_rt.report import Report
from warp_rt.usd.attribute_values import how_many, numbers
from warp_rt.usd.color_spaces import color_space, color_space_of
from warp_rt.usd.decoding import linear
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.left_out import note_left_out
from warp_rt.usd.materialx_nodes import fold, is_known_node
from warp_rt.usd.matrix_nodes import MATRIX_NODE, MatrixNodes
from warp_rt.usd.node_inputs import NodeInputs
from warp_rt.usd.projected_images import on_sky, projected
from warp_rt.usd.shading_network import (
    Node,
    find_source,
    note_unknown_inputs,
    read_constant,
    read_numbers,
    read_token,
    warn_type,
)
from warp_rt.usd.signals import CHANNELS, DoesNotFold, Signal, Source, join, look_up, multiply
from warp_rt.usd.texture_coordinates import Coordinates, coordinate_name, gltf_placement, transform_2d
from warp_rt.usd.texture_nodes import TextureNodes

NO_COORDINATES = "W206"
UNKNOWN_NODE = "W303"

# Nodes that give what comes in by the input of this name.
_PASSING_ON = {"MayaND_fileTexture_color3": "inColor", "MayaND_fileTexture_color4": "inColor"}
# What USD's own nodes have.
_INPUTS = {
    "UsdUVTexture": ("file", "st", "wrapS", "wrapT", "fallback", "scale", "bias", "sourceColorSpace"),
    "UsdPrimvarReader": ("varname", "fallback"),
    "UsdTransform2d": ("in", "rotation", "scale", "translation"),
}
_READER = re.compile(r"(?:ND_)?(?:UsdPrimvarReader|geompropvalue)_([a-z]+)(\d?)")
# Components of readers whose name does not end with the number; the kinds left out give no colour.
_READER_SIZES = {"float": 1, "int": 1, "integer": 1, "color": 3, "vector": 3, "normal": 3, "point": 3}
_IMAGE = re.compile(r"ND_(tiled)?image_(float|color3|color4|vector2|vector3|vector4)")
_IMAGE_SIZES = {"float": 1, "color3": 3, "color4": 4, "vector2": 2, "vector3": 3, "vector4": 4}
_AROUND = re.compile(r"ND_(triplanarprojection|latlongimage)(?:_(float|color3|color4|vector2|vector3|vector4))?")
_GLTF_IMAGE = re.compile(r"ND_gltf_(image|colorimage|normalmap)(?:_(float|color3|color4|vector3))?(?:_.*)?")
_OUTPUTS = {"r": (0,), "g": (1,), "b": (2,), "a": (3,), "rgba": (0, 1, 2, 3)}
_COLOR_SETS = {"geomcolor_float": 1, "geomcolor_color3": 3, "geomcolor_color4": 4}
_DECODING = re.compile(r"ND_([a-z0-9_]+)_to_lin_rec709_color[34]")
_DISPLAYS = {"rec709_display": "g24_rec709"}
_ONE = Signal.constant((1.0,))
_MAX_CHAIN = 64  # nodes in a row


class _Unfolded(Exception):
    """A node that has no place in what a kernel reads."""

    def __init__(self, node: Node, *, is_known: bool = False) -> None:
        super().__init__(node.id)
        self.node = node
        self.is_known = is_known


class SignalReader:
    """Follows networks from inputs to what feeds them.

    Args:
        images: Reads the files.
        time: When inputs are read.
        report: Takes the diagnostics.
    """

    def __init__(self, images: ImageCache, time: Usd.TimeCode, report: Report) -> None:
        self._textures = TextureNodes(images, time, report)
        self._time = time
        self._report = report
        self._textures_of: dict[Sdf.Path, Signal] = {}
        self._nodes: dict[tuple[Sdf.Path, str, Sdf.Path], Signal | None] = {}
        """What nodes give, by output and material: those that several lead to are read once."""
        self._chain: list[Sdf.Path] = []

    def read(self, port: UsdShade.Input, material: Usd.Prim, sizes: Sequence[int]) -> Signal | None:
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
            key = (path, source.output, material.GetPath())
            if key in self._nodes:
                return self._nodes[key]
            if path in self._chain or len(self._chain) >= _MAX_CHAIN:
                raise _Unfolded(source)
            self._chain.append(path)
            try:
                return self._nodes.setdefault(key, self._defined(source, self._node(source, material)))
            except DoesNotFold:
                raise _Unfolded(source, is_known=is_known_node(source.id)) from None
            finally:
                self._chain.pop()
        value = source.Get(self._time)
        found = numbers(value)
        if found is None or len(found) not in sizes:
            warn_type(source, value, f"not {how_many(sizes)}", self._report)
            return None
        space = color_space_of(source, self._report)
        if space and len(found) >= 3:
            found = (*space.to_linear(np.array(found[:3])).tolist(), *found[3:])
        return Signal.constant(found)

    def _defined(self, node: Node, found: Signal | None) -> Signal | None:
        """Return what a node gives; what is no number, or none of float32, is told and replaced."""
        if found is None:
            return None
        if not found.is_defined:
            message = f"the node {node.id!r} gives what is no number, as of a division by 0: 0 counts"
            self._report.warn(UNKNOWN_NODE, node.shader.GetPath(), message)
            found = found.defined()
        if not found.is_in_range:
            message = f"the node {node.id!r} gives a number beyond 3.4e38, float32's largest, which counts"
            self._report.warn(UNKNOWN_NODE, node.shader.GetPath(), message)
            found = found.in_range()
        return found

    def _node(self, node: Node, material: Usd.Prim) -> Signal | None:
        """Return what a node gives.

        Raises:
            DoesNotFold: It is no node that folds.
        """
        name, shader = node.id.removeprefix("ND_"), node.shader
        own = node.id.split("_")[0]
        if own in _INPUTS:
            note_unknown_inputs(shader, own, _INPUTS[own], self._report)
        note_left_out(node, self._time, self._report)
        if name.startswith("UsdUVTexture"):
            return self._uv_texture(shader, material).pick(_OUTPUTS.get(node.output, (0, 1, 2)))
        image = _IMAGE.fullmatch(node.id)
        if image:
            found = self._image(shader, material, is_color="color" in image[2], is_tiled=bool(image[1]))
            return found.pick(range(_IMAGE_SIZES[image[2]]))
        image = _GLTF_IMAGE.fullmatch(node.id)
        if image:
            return self._gltf_image(node, image[1], image[2] or "color4", material)
        reader = _READER.fullmatch(node.id)
        if reader and reader[1] in _READER_SIZES:
            return self._primvar(shader, int(reader[2] or _READER_SIZES[reader[1]]), material)
        if name.startswith("texcoord_"):
            index = read_constant(shader, "index", self._time, self._report)
            return Signal.of(_primvar_source(coordinate_name(index), (0.0, 0.0)), 2)
        if name.startswith("UsdTransform2d"):
            given = self._follow(shader.GetInput("in"), material, (2,)) or self._no_coordinates(shader)
            matrix = transform_2d(shader, self._time, self._report)
            return given.resized(2).map(matrix[:2, :2], matrix[:2, 2])
        if node.id in ("ND_hextiledimage_color3", "ND_hextiledimage_color4"):
            return self._scattered(shader, material).pick(range(_IMAGE_SIZES[node.id.rpartition("_")[2]]))
        if name.startswith("blur_"):
            message = f"the node {node.id!r} is left out: what comes in is not blurred"
            self._report.warn(UNKNOWN_NODE, shader.GetPath(), message)
            sharp = self._follow(shader.GetInput("in"), material, (1, 2, 3, 4))
            return sharp or Signal.constant((0.0,) * _IMAGE_SIZES.get(name.removeprefix("blur_"), 1))
        if name in _COLOR_SETS and not read_constant(shader, "index", self._time, self._report):
            return self._color_set(_COLOR_SETS[name])
        if name in ("frame_float", "time_float"):
            return self._when(shader, is_frame=name == "frame_float")
        decoded = _DECODING.fullmatch(node.id)
        space = color_space(_DISPLAYS.get(decoded[1], decoded[1])) if decoded else None
        if space is not None:
            given = self._follow(shader.GetInput("in"), material, (1, 3, 4)) or Signal.constant((0.0, 0.0, 0.0))
            return linear(given, space)
        if node.id in _PASSING_ON:
            return self._follow(shader.GetInput(_PASSING_ON[node.id]), material, (1, 2, 3, 4))

        if MATRIX_NODE.fullmatch(node.id):

            def read_of(holder: UsdShade.Shader, given: str) -> Signal | None:
                return self._follow(holder.GetInput(given), material, (1, 2, 3, 4))

            return MatrixNodes(read_of, self._time, self._report).compute(node)

        def read_input(given: str) -> Signal | None:
            found = self._follow(shader.GetInput(given), material, (1, 2, 3, 4))
            if found is None and given == "texcoord":
                return Signal.of(_primvar_source("st", (0.0, 0.0)), 2)
            return found

        def read_text(given: str) -> str:
            return read_token(shader, given, self._time, self._report) or ""

        around = _AROUND.fullmatch(node.id)
        if around:
            inputs = NodeInputs(node.output, (around[2] or "color3",), read_input, read_text)
            make = projected if around[1] == "triplanarprojection" else on_sky
            return make(inputs, lambda file, wraps: self._part(shader, file, wraps, inputs.kinds[0]))
        return fold(node.id, node.output, read_input, read_text)

    def _part(self, shader: UsdShade.Shader, file: str, wraps: tuple[str, str], kind: str) -> Source:
        return self._textures.part(shader, file, wraps, is_color="color" in kind)

    def _when(self, shader: UsdShade.Shader, *, is_frame: bool) -> Signal:
        """Return the frame that is read, or its time; 0 at no time."""
        frame = 0.0 if self._time.IsDefault() else self._time.GetValue()
        rate = (read_numbers(shader, "fps", (1,), self._time, self._report) or (24.0,))[0]
        return Signal.constant((frame if is_frame or rate == 0.0 else frame / rate,))

    # --- primvars

    def _color_set(self, size: int) -> Signal:
        """Return displayColor, which is the first set of colours of a mesh; of four components with an alpha of 1."""
        found = Signal.of(_primvar_source("displayColor", (0.0, 0.0, 0.0)), min(size, 3))
        return join([found, _ONE]) if size == 4 else found

    def _primvar(self, shader: UsdShade.Shader, size: int, material: Usd.Prim) -> Signal:
        name = self._varname(shader)
        fallback = self._fallback(shader, name, size, material) or (0.0,) * size
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

    def _fallback(self, shader: UsdShade.Shader, name: str, size: int, material: Usd.Prim) -> tuple[float, ...] | None:
        """Return the value where a mesh has no such primvar: the material's own primvar, else the reader's."""
        if name and material:
            primvar = UsdGeom.PrimvarsAPI(material).GetPrimvar(name)
            found = numbers(primvar.Get(self._time)) if primvar else None
            if found:
                return found
        for port in ("fallback", "default"):
            found = read_numbers(shader, port, (size,), self._time, self._report)
            if found:
                return found
        return None

    # --- textures

    def _texture(
        self, shader: UsdShade.Shader, port: UsdShade.Input, material: Usd.Prim, make: Callable[[Coordinates], Source]
    ) -> Signal:
        """Return all four components that a node gives which reads an image.

        Args:
            shader: The node.
            port: Its texture coordinates; MaterialX's nodes have ``st`` without.
            material: The material's prim.
            make: Gives the texture at texture coordinates.
        """
        path = shader.GetPath()
        if path not in self._textures_of:
            is_given = port or not (shader.GetShaderId() or "").startswith("ND_")
            place = self._coordinates(port, shader, material) if is_given else Coordinates()
            self._textures_of[path] = (
                look_up(make(Coordinates()), place) if isinstance(place, Signal) else Signal.of(make(place), CHANNELS)
            )
        return self._textures_of[path]

    def _uv_texture(self, shader: UsdShade.Shader, material: Usd.Prim) -> Signal:
        return self._texture(
            shader, shader.GetInput("st"), material, lambda place: self._textures.uv_texture(shader, place)
        )

    def _image(self, shader: UsdShade.Shader, material: Usd.Prim, *, is_color: bool, is_tiled: bool) -> Signal:
        def make(place: Coordinates) -> Source:
            return self._textures.image(shader, place, is_color=is_color, is_tiled=is_tiled)

        return self._texture(shader, shader.GetInput("texcoord"), material, make)

    def _scattered(self, shader: UsdShade.Shader, material: Usd.Prim) -> Signal:
        """Return the image of a hextiledimage, repeated; that its hexagons are not scattered is told."""

        def make(place: Coordinates) -> Source:
            repeats = np.resize(read_numbers(shader, "tiling", (1, 2), self._time, self._report) or (1.0,), 2)
            moved = replace(place, transform=np.diag((*repeats, 1.0)) @ place.transform)
            return self._textures.image(shader, moved, is_color=True, is_tiled=False)

        message = f"the node {shader.GetShaderId()!r} is approximated by the image, repeated"
        self._report.warn(UNKNOWN_NODE, shader.GetPath(), message)
        return self._texture(shader, shader.GetInput("texcoord"), material, make)

    def _gltf_image(self, node: Node, role: str, kind: str, material: Usd.Prim) -> Signal:
        """Return what an image node of glTF gives: an image, moved, times factors; or a normal of one."""
        shader = node.shader
        index = read_constant(shader, "uvindex", self._time, self._report)

        def make(place: Coordinates) -> Source:
            if not shader.GetInput("texcoord"):
                place = Coordinates(coordinate_name(index))
            moved = gltf_placement(shader, self._time, self._report) @ place.transform
            placed = replace(place, transform=moved)
            return self._textures.image(shader, placed, is_color="color" in kind, is_tiled=False)

        found = self._texture(shader, shader.GetInput("texcoord"), material, make).pick(range(_IMAGE_SIZES[kind]))
        if role == "normalmap":
            return found.map(2 * np.eye(3), -1.0)
        for name in ("factor",) if role == "image" else ("color", "geomcolor"):
            factor = self._follow(shader.GetInput(name), material, (1, 3, 4))
            found = multiply(found, factor) if factor else found
        parts = {"outcolor": (0, 1, 2), "outa": (3,)}.get(node.output)
        return found.pick(parts) if parts else found

    def _coordinates(
        self, port: UsdShade.Input | None, shader: UsdShade.Shader, material: Usd.Prim
    ) -> Coordinates | Signal:
        """Return where an ``st`` input leads to, through whatever moves it about; a signal where that is computed."""
        try:
            found = self._follow(port, material, (2,))
        except _Unfolded as error:
            self._warn_coordinates(error.node)
            return Coordinates()
        if found is None:
            found = self._no_coordinates(shader)
        value, source = found.value, found.source
        if source is None or value is not None:
            u, v = value[:2] if value and len(value) > 1 else (0.0, 0.0)
            return Coordinates.constant(u, v)
        if source.texture is not None or source.computed is not None:
            return found.resized(2)
        u, v = source.fallback[:2] if len(source.fallback) > 1 else (0.0, 0.0)
        rows = found.resized(2).matrix[:, [0, 1, -1]]
        return Coordinates(source.primvar, (u, v), np.vstack([rows, [0.0, 0.0, 1.0]]))

    def _no_coordinates(self, shader: UsdShade.Shader) -> Signal:
        """Return what USD's own nodes have for coordinates that nothing gives, which is told."""
        self._report.warn(NO_COORDINATES, shader.GetPath(), "has no texture coordinates; (0, 0) is used")
        return Signal.constant((0.0, 0.0))

    def _warn_unknown(self, node: Node, is_known: bool) -> None:
        kind = f"the node {node.id!r}" if node.id else "a node without info:id"
        why = "cannot be computed of what it is given" if is_known else "is not supported"
        self._report.warn(UNKNOWN_NODE, node.shader.GetPath(), f"{kind} {why}; the default is used")

    def _warn_coordinates(self, node: Node) -> None:
        kind = f"the node {node.id!r}" if node.id else "a node without info:id"
        message = f"{kind} gives no texture coordinates here; st is used"
        self._report.warn(UNKNOWN_NODE, node.shader.GetPath(), message)


def _primvar_source(name: str, fallback: tuple[float, ...]) -> Source:
    return Source(f"primvar {name} {fallback}", primvar=name, fallback=fallback)
