# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Material bindings and surface shaders to Material rows.

A material's surface is, in this order: a supported shader on ``outputs:warp_rt:surface``; one on the universal
``outputs:surface``; one on any other renderer's output; then, in the same order, a shader of another renderer that
UsdPreviewSurface can stand for. A material with none of these, and a prim without a material, shows displayColor.

Reference: UsdPreviewSurface Specification; UsdShadeMaterialBindingAPI.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pxr import Sdf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import MATERIAL_DEFAULTS, Image, Input, Material, MaterialModel, OpacityMode, Texture
from warp_rt.scene.displacement import Displacement
from warp_rt.usd.bindings import BINDING_PURPOSES, Bindings, bound_material, is_shared, read_bindings
from warp_rt.usd.dome_layouts import Stretch
from warp_rt.usd.foreign_shaders import is_preview_surface
from warp_rt.usd.image_cache import ImageCache, KeptImages
from warp_rt.usd.input_rows import Unknown
from warp_rt.usd.preview_signals import PreviewSignals
from warp_rt.usd.shading_network import Node, find_source, read_numbers
from warp_rt.usd.stage import OUTSIDE_MASK, is_outside_mask
from warp_rt.usd.surface_inputs import InputReader
from warp_rt.usd.surfaces import UNKNOWN_SURFACE, SurfaceReader

DISPLACEMENT = "W305"
NO_SURFACE = "W307"
NORMAL_MAP = "W309"
DANGLING_BINDING = "W310"
UNKNOWN_INPUT = "W311"

DISPLAY_COLOR_MATERIAL = "/__displayColor"
"""Path of the material of prims that have none."""

_WHITTED_INPUTS = {name: len(default) for name, default in MATERIAL_DEFAULTS[MaterialModel.WHITTED].items()}
"""Components of each input."""
_RENDER_CONTEXT = "warp_rt"
_MATERIAL = "material:"
_NO_PATH = Sdf.Path.emptyPath  # of the material of prims that have none


class MaterialReader:
    """Reads each bound material once, with its textures and images.

    Args:
        stage: Of the materials.
        time: When they are read.
        report: Takes the diagnostics.
        purposes: Material purposes of the bindings that count, the first one that there is: see ``bound_material``.
        images: What scenes before have read.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        time: Usd.TimeCode,
        report: Report,
        purposes: Sequence[str] = BINDING_PURPOSES,
        images: KeptImages | None = None,
    ) -> None:
        self.materials: list[Material] = []
        """Rows of ``Scene.materials``."""
        self._images = ImageCache(report, images)
        self._inputs = InputReader(self._images, time, report)
        self._surface_reader = SurfaceReader(self._inputs, time, report)
        self._rows: dict[Sdf.Path, int] = {}
        self._bound: dict[Bindings, int] = {}
        """Row of the material of all prims with certain bindings."""
        self._displacements: dict[int, Displacement] = {}
        self._stage = stage
        self._time = time
        self._report = report
        self._purposes = purposes

    @property
    def textures(self) -> list[Texture]:
        """Rows of ``Scene.textures``."""
        return self._inputs.textures

    @property
    def images(self) -> list[Image]:
        """Rows of ``Scene.images``."""
        return self._images.images

    @property
    def unknown_beyond(self) -> dict[int, Unknown]:
        """Textures whose images are not all that they were made of: see ``InputRows``."""
        return self._inputs.unknown_beyond

    def image(self, asset: Sdf.AssetPath, prim: Usd.Prim) -> int:
        """Return the row of an image; -1, with a diagnostic about ``prim``, where it cannot be read."""
        return self._images.load(asset, prim.GetPath())

    def decoded(self, row: int, attribute: Usd.Attribute, prim: object) -> tuple[int, bool]:
        """Return the row to read of the image that an attribute names, and whether to decode it by the sRGB curve."""
        return self._images.decoded(row, attribute, prim)

    def mixed(self, row: int, is_srgb: bool, matrix: np.ndarray) -> int:
        """Return the row of an image whose channels are sums over another's, by a matrix: see ``ImageCache.mixed``."""
        return self._images.mixed(row, is_srgb, matrix)

    def latlong(self, row: int, layout: str, *, is_srgb: bool, stretch: Stretch | None = None) -> tuple[int, bool]:
        """Return the row of an environment by latitude and longitude, and whether to decode it; -1 if it cannot be."""
        return self._images.latlong(row, layout, is_srgb=is_srgb, stretch=stretch)

    def bind(self, prim: Usd.Prim, bindings: Bindings | None = None) -> int:
        """Return the row of the material that is bound to a gprim or GeomSubset.

        Args:
            prim: Whose binding counts, inherited and collection-based bindings included.
            bindings: What they say; None: they are read.
        """
        said = read_bindings(prim) if bindings is None else bindings
        row = self._bound.get(said)
        if row is not None:
            return row
        if not said:
            row = self._bound[said] = self.display_color()
            return row
        self._warn_malformed(prim, said)
        material, relationship = bound_material(prim, self._purposes)
        if not material:
            if relationship:
                self._warn_dangling(relationship)
            return self.display_color()
        path = material.GetPath()
        if path not in self._rows:
            row = self._add(material)
            displacement = self._read_displacement(material)
            if displacement is not None:
                if row == self._rows.get(_NO_PATH):  # of prims that have none, which do not move
                    row = self.add(_display_color_material())
                self._displacements[row] = displacement
            self._rows[path] = row
        if is_shared(said):
            self._bound[said] = self._rows[path]
        return self._rows[path]

    def displacement(self, row: int) -> Displacement | None:
        """Return how a material moves the surfaces that it is bound to; None: not at all."""
        return self._displacements.get(row)

    def display_color(self) -> int:
        """Return the row of the material of prims that have none."""
        row = self._rows.get(_NO_PATH)
        if row is None:
            row = self._rows[_NO_PATH] = self.add(_display_color_material())
        return row

    def add_texture(self, texture: Texture) -> int:
        """Return the row of a new texture."""
        return self._inputs.add(texture)

    def add(self, material: Material) -> int:
        """Return the row of a new material."""
        self.materials.append(material)
        return len(self.materials) - 1

    def _add(self, material: UsdShade.Material) -> int:
        path = str(material.GetPath())
        surfaces = self._surfaces(material)
        for surface in surfaces:
            if surface.id == "WhittedSurface":
                inputs = self._whitted_inputs(surface.shader, material.GetPrim())
                self._warn_unknown_inputs(surface.shader)
                return self.add(Material(path, MaterialModel.WHITTED, inputs))
            if is_preview_surface(surface.id):
                said = self._surface_reader.preview(surface.shader, material.GetPrim())
                return self._add_preview(path, said, surface.shader)
        for surface in surfaces:
            found = self._surface_reader.approximated(surface, material.GetPrim())
            if found is not None:
                return self._add_preview(path, found, surface.shader)
        for surface in surfaces:
            kind = f"the surface {surface.id!r}" if surface.id else "a surface without info:id"
            message = f"{kind} is not supported; displayColor is shown"
            self._report.warn(UNKNOWN_SURFACE, surface.shader.GetPath(), message)
        if not surfaces:
            self._report.warn(NO_SURFACE, path, "has no surface; displayColor is shown")
        return self.display_color()

    def _surfaces(self, material: UsdShade.Material) -> list[Node]:
        """Return the shaders on a material's surface outputs, those that are preferred first."""
        return self._terminals(material.GetSurfaceOutputs(), material.GetSurfaceOutput)

    def _terminals(self, outputs: list[UsdShade.Output], find: Callable[[str], UsdShade.Output]) -> list[Node]:
        """Return the shaders on a material's outputs of one kind: our own, the universal one's, then the others."""
        contexts = [_RENDER_CONTEXT, UsdShade.Tokens.universalRenderContext]
        for output in outputs:
            context = output.GetBaseName().rpartition(":")[0]
            if context not in contexts:
                contexts.append(context)
        nodes = []
        for context in contexts:
            output = find(context)
            source = find_source(output, self._report) if output else None
            if isinstance(source, Node):
                nodes.append(source)
        return nodes

    def _whitted_inputs(self, shader: UsdShade.Shader, material: Usd.Prim) -> dict[str, Input]:
        inputs = {}
        for name, size in _WHITTED_INPUTS.items():
            port = shader.GetInput(name)
            value = self._inputs.read(port, size, material) if port else None
            if name == "ior":
                value = self._inputs.check_ior(port.GetAttr().GetPath(), value)
            elif name == "shininess":
                value = self._inputs.check_exponent(port.GetAttr().GetPath(), value)
            if value is not None:
                inputs[name] = value
        return inputs

    def _warn_unknown_inputs(self, shader: UsdShade.Shader) -> None:
        """Report misspelt inputs of our own surface."""
        for port in shader.GetInputs():
            if port.GetBaseName() not in _WHITTED_INPUTS:
                self._report.warn(UNKNOWN_INPUT, port.GetAttr().GetPath(), "WhittedSurface has no such input; ignored")

    def _add_preview(self, path: str, said: PreviewSignals, shader: UsdShade.Shader) -> int:
        row = self.add(said.lowered(path, self._inputs, shader.GetPath()))
        self._check_normal_map(self.materials[row].inputs.get("normal"), shader)
        return row

    def _check_normal_map(self, normal: Input | None, shader: UsdShade.Shader) -> None:
        """Report a normal map whose texels are not taken from 0..1 to -1..1, or are decoded as colours."""
        if normal is None or normal.texture < 0:
            return
        texture = self.textures[normal.texture]
        if texture.image < 0:
            return
        if texture.is_srgb:
            self._report.warn(
                NORMAL_MAP, shader.GetPath(), "the normal map is decoded as sRGB colours, not as raw data"
            )
        # Of x and y any scale will do, which makes bumps flatter or steeper, as long as texels of 0.5 give 0.
        is_placed = all(b == -0.5 * a for a, b in zip(texture.scale, texture.bias[:3], strict=False))
        if (texture.scale[2] != 2.0 or not is_placed) and _is_of_shares(self.images[texture.image].pixels):
            message = "the normal map has not the scale 2 and bias -1 that texels from 0 to 1 need; used as it is"
            self._report.warn(NORMAL_MAP, shader.GetPath(), message)

    def _read_displacement(self, material: UsdShade.Material) -> Displacement | None:
        """Return what ``outputs:displacement`` says, our own, the universal or the first other that is supported."""
        sources = self._terminals(material.GetDisplacementOutputs(), material.GetDisplacementOutput)
        for source in sources:
            if is_preview_surface(source.id) or source.id == "ND_displacement_float":
                height = self._displacement_input(source.shader, material)
                if height is None or is_preview_surface(source.id):
                    return Displacement(height) if height else None
                scale = read_numbers(source.shader, "scale", (1,), self._time, self._report) or (1.0,)
                return Displacement(height, scale[0])
        for source in sources[:1]:
            kind = f"of the node {source.id!r}" if source.id else "of a node without info:id"
            self._report.warn(DISPLACEMENT, material.GetPath(), f"displacement {kind} is not supported; left out")
        for surface in [] if sources else self._surfaces(material)[:1]:
            if is_preview_surface(surface.id) and self._displacement_input(surface.shader, material):
                message = "its displacement does nothing: the material's outputs:displacement is not connected"
                self._report.warn(DISPLACEMENT, surface.shader.GetPath(), message)
        return None

    def _displacement_input(self, shader: UsdShade.Shader, material: UsdShade.Material) -> Input | None:
        """Return the height that a shader gives; None where it is 0 everywhere."""
        port = shader.GetInput("displacement")
        height = self._inputs.read(port, 1, material.GetPrim()) if port else None
        if height is not None and height.program is not None:
            message = "displacement that is computed of the place is not supported; left out"
            self._report.warn(DISPLACEMENT, port.GetAttr().GetPath(), message)
            return None
        return None if height == Input() else height

    def _warn_dangling(self, relationship: Usd.Relationship) -> None:
        """Report the binding that counts, and leads to no material."""
        for target in relationship.GetForwardedTargets():
            if target.IsPrimPath() and not UsdShade.Material(self._stage.GetPrimAtPath(target)):
                is_left_out = is_outside_mask(self._stage, target)
                code = OUTSIDE_MASK if is_left_out else DANGLING_BINDING
                why = "which the mask leaves out" if is_left_out else _why_no_material(self._stage, target)
                message = f"is bound to {target}, {why}; displayColor is shown"
                self._report.warn(code, relationship.GetPrim().GetPath(), message)

    def _warn_malformed(self, prim: Usd.Prim, bindings: Bindings) -> None:
        """Report the bindings to several materials, or without a collection, which UsdShade passes over."""
        for binding in bindings:
            collections = [target for target in binding.targets if Usd.CollectionAPI.IsCollectionAPIPath(target)]
            if binding.holder is None:
                if binding.name.startswith(_MATERIAL) and len(binding.targets) > 1:
                    message = f"{binding.name} names {len(binding.targets)} materials and not one: it does not count"
                    self._report.warn(DANGLING_BINDING, prim.GetPath(), message)
                elif binding.name.startswith(_MATERIAL) and not all(map(Sdf.Path.IsPrimPath, binding.targets)):
                    message = f"{binding.name} names {binding.targets[0]}, which is no prim: it does not count"
                    self._report.warn(DANGLING_BINDING, prim.GetPath(), message)
            elif len(binding.targets) != 2 or len(collections) != 1:
                message = f"{binding.name} does not name one collection and one material: it does not count"
                self._report.warn(DANGLING_BINDING, binding.holder, message)
            elif not Usd.CollectionAPI.Get(self._stage, collections[0]):
                message = f"{binding.name} names {collections[0]}, which is no collection: it does not count"
                self._report.warn(DANGLING_BINDING, binding.holder, message)


def _why_no_material(stage: Usd.Stage, target: Sdf.Path) -> str:
    prim = stage.GetPrimAtPath(target)
    if not prim:
        return "where there is no prim"
    return f"which is {prim.GetTypeName() or 'a prim without a type'} and no material"


def _is_of_shares(pixels: np.ndarray) -> bool:
    """Return whether texels of a normal map go from 0 to 1: of those from -1 to 1 some lean back, or none at all."""
    across = pixels[..., :2]
    return pixels.dtype.kind == "u" or bool(across.min() >= 0.0 and across.max() > 0.0)


def _display_color_material() -> Material:
    """Return the surface of prims without material: diffuse displayColor, grey 0.5 where there is none.

    OpenUSD's renderers do so. The specular workflow with black specular and an index of refraction of 1 has no
    Fresnel reflection, and displayOpacity is coverage, not transmission.
    """
    return Material(
        DISPLAY_COLOR_MATERIAL,
        MaterialModel.PREVIEW,
        {
            "diffuseColor": Input(value=(0.5, 0.5, 0.5, 0.0), primvar="displayColor"),
            "specularColor": Input(),
            "roughness": Input(value=(1.0, 0.0, 0.0, 0.0)),
            "opacity": Input(value=(1.0, 0.0, 0.0, 0.0), primvar="displayOpacity", channel=0),
            "ior": Input(value=(1.0, 0.0, 0.0, 0.0)),
        },
        use_specular_workflow=True,
        opacity_mode=OpacityMode.PRESENCE,
    )
