# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Surface shaders as UsdPreviewSurfaces: their own, those of other renderers, graphs of BSDFs, and mixtures of all."""

from __future__ import annotations

import re

from pxr import Sdf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import NormalFrame, OpacityMode
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.bsdf_graphs import SURFACE as SURFACE_OF_BSDFS
from warp_rt.usd.bsdf_graphs import BsdfReader
from warp_rt.usd.foreign_shaders import foreign_surface, is_preview_surface
from warp_rt.usd.foreign_surfaces import APPROXIMATED_SURFACE, ForeignReader
from warp_rt.usd.preview_signals import PREVIEW_SIZES, PreviewSignals, mixed
from warp_rt.usd.shading_network import (
    WRONG_TYPE,
    Node,
    find_source,
    note_unknown_inputs,
    read_constant,
    read_numbers,
)
from warp_rt.usd.signals import CHANNELS, Signal
from warp_rt.usd.surface_inputs import InputReader

UNKNOWN_SURFACE = "W301"
MIXTURE = "ND_mix_surfaceshader"

_HOLDER = "ND_surfacematerial"  # which passes its surfaceshader on
_COLOR = re.compile(r"ND_convert_\w+_surfaceshader")
_NAMES = {*PREVIEW_SIZES, "displacement", "opacityMode", "opacityThreshold", "useSpecularWorkflow"}
_MAX_MIXTURES = 64  # surfaces in one, those that several lead to as often; a circle ends there, too
_BLACK = {"diffuseColor": (0.0, 0.0, 0.0), "roughness": (1.0,), "ior": (1.0,)}


class SurfaceReader:
    """Reads surfaces as UsdPreviewSurfaces.

    Args:
        inputs: Reads their inputs.
        time: When.
        report: Takes the diagnostics.
    """

    def __init__(self, inputs: InputReader, time: Usd.TimeCode, report: Report) -> None:
        self._inputs = inputs
        self._time = time
        self._report = report
        self._visited = 0

    def preview(self, shader: UsdShade.Shader, material: Usd.Prim) -> PreviewSignals:
        """Return what a UsdPreviewSurface, or its twin in MaterialX, says."""
        inputs: dict[str, Signal] = {}
        paths: dict[str, Sdf.Path] = {}
        for name, size in PREVIEW_SIZES.items():
            port = shader.GetInput(name)
            found = self._inputs.signal(port, material, (size,))
            if found is not None:
                inputs[name], paths[name] = found, port.GetAttr().GetPath()
        note_unknown_inputs(shader, "UsdPreviewSurface", _NAMES, self._report)
        workflow = read_numbers(shader, "useSpecularWorkflow", (1,), self._time, self._report) or (0.0,)
        threshold = read_numbers(shader, "opacityThreshold", (1,), self._time, self._report) or (0.0,)
        is_materialx = (shader.GetShaderId() or "").startswith("ND_")  # whose library has the tangents of the primvar
        return PreviewSignals(
            inputs,
            paths,
            use_specular_workflow=workflow[0] != 0,
            opacity_mode=self._opacity_mode(shader),
            opacity_threshold=threshold[0],
            normal_frame=NormalFrame.PRIMVAR if is_materialx else NormalFrame.IMAGE,
        )

    def approximated(self, surface: Node, material: Usd.Prim) -> PreviewSignals | None:
        """Return the UsdPreviewSurface that comes nearest to another surface, told; None where it is not known."""
        self._visited = 0
        return self._approximated(surface, material)

    def _approximated(self, surface: Node, material: Usd.Prim) -> PreviewSignals | None:
        self._visited += 1
        if self._visited > _MAX_MIXTURES:
            return None
        if surface.id == SURFACE_OF_BSDFS:
            return BsdfReader(self._inputs, self._time, self._report).read(surface.shader, material)
        if surface.id == MIXTURE:
            return self._mixture(surface.shader, material)
        if surface.id == _HOLDER:
            source = self._source(surface.shader, "surfaceshader")
            return self._any(source, material) if source else None
        if _COLOR.fullmatch(surface.id):
            return self._shining(surface.shader, material)
        foreign = foreign_surface(surface.id)
        if foreign is None:
            return None
        return ForeignReader(self._inputs, self._time, self._report).read(surface.shader, foreign, material)

    def _any(self, surface: Node, material: Usd.Prim) -> PreviewSignals | None:
        if is_preview_surface(surface.id):
            return self.preview(surface.shader, material)
        return self._approximated(surface, material)

    def _mixture(self, shader: UsdShade.Shader, material: Usd.Prim) -> PreviewSignals | None:
        """Return a mixture of two surfaces; of one, told, where the other is not known."""
        found: list[PreviewSignals | None] = []
        for name in ("fg", "bg"):
            source = self._source(shader, name)
            if source is None:  # nothing, which MaterialX holds to be black
                found.append(PreviewSignals({key: Signal.constant(value) for key, value in _BLACK.items()}))
                continue
            found.append(self._any(source, material))
            if found[-1] is None:
                message = f"the surface {source.id!r} is not supported: the other of the mixture counts"
                self._report.warn(UNKNOWN_SURFACE, source.shader.GetPath(), message)
        foreground, background = found
        if foreground is None or background is None:
            return foreground or background
        share = self._inputs.signal(shader.GetInput("mix"), material, (1,))
        result, lost = mixed(foreground, background, share or Signal.constant((0.0,)))
        without = f"; of {', '.join(lost)} the background's" if lost else ""
        message = f"the surface {MIXTURE!r} is approximated by a UsdPreviewSurface of mixed inputs{without}"
        self._report.warn(APPROXIMATED_SURFACE, shader.GetPath(), message)
        return result

    def _shining(self, shader: UsdShade.Shader, material: Usd.Prim) -> PreviewSignals:
        """Return a colour that is made a surface: one that sends it out, and reflects nothing."""
        port = shader.GetInput("in")
        found = self._inputs.signal(port, material, (1, 2, 3, 4))
        inputs = {key: Signal.constant(value) for key, value in _BLACK.items()}
        self._report.warn(
            APPROXIMATED_SURFACE,
            shader.GetPath(),
            f"the surface {shader.GetShaderId()!r} is approximated by a UsdPreviewSurface that shines",
        )
        if found is None:
            return PreviewSignals(inputs)
        inputs["emissiveColor"] = found
        if found.size == CHANNELS:
            inputs["opacity"] = found.pick([CHANNELS - 1])
        paths = {"emissiveColor": port.GetAttr().GetPath()}
        return PreviewSignals(inputs, paths, opacity_mode=OpacityMode.PRESENCE)

    def _source(self, shader: UsdShade.Shader, name: str) -> Node | None:
        port = shader.GetInput(name)
        source = find_source(port, self._report) if port else None
        return source if isinstance(source, Node) else None

    def _opacity_mode(self, shader: UsdShade.Shader) -> OpacityMode:
        value = read_constant(shader, "opacityMode", self._time, self._report)
        if value is None:
            return OpacityMode.TRANSPARENT
        if isinstance(value, str | int):
            # MaterialX's twin has the numbers 0 and 1.
            if value in ("transparent", 0):
                return OpacityMode.TRANSPARENT
            if value in ("presence", 1):
                return OpacityMode.PRESENCE
        path = shader.GetInput("opacityMode").GetAttr().GetPath()
        self._report.warn(WRONG_TYPE, path, f"is {shown(value)}, no mode; transparent is used")
        return OpacityMode.TRANSPARENT
