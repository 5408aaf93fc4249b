# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Surfaces of other renderers as UsdPreviewSurfaces: ``foreign_shaders`` says what inputs become, this reads them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from pxr import Sdf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import NormalFrame, OpacityMode
from warp_rt.usd.attribute_values import numbers
from warp_rt.usd.foreign_shaders import CUTOFF, Color, ForeignSurface, Loss, Term
from warp_rt.usd.normal_networks import frame_of
from warp_rt.usd.preview_signals import ONE, PreviewSignals, in_specular_workflow
from warp_rt.usd.shading_network import Node, find_source, note_unknown_inputs, read_numbers, warn_type
from warp_rt.usd.signal_reader import UNKNOWN_NODE
from warp_rt.usd.signals import DoesNotFold, Signal, add, multiply
from warp_rt.usd.surface_inputs import InputReader

APPROXIMATED_SURFACE = "W302"

_MEAN = np.full((1, 3), 1 / 3)  # of a colour, as MaterialX's own translation to UsdPreviewSurface takes opacity
_OWN_NORMAL = "ND_normal_"
_GLTF_MASK = 1.0  # of alpha_mode


class ForeignReader:
    """Tells other renderers' surfaces as UsdPreviewSurfaces."""

    def __init__(self, inputs: InputReader, time: Usd.TimeCode, report: Report) -> None:
        self._inputs = inputs
        self._time = time
        self._report = report

    def read(self, shader: UsdShade.Shader, surface: ForeignSurface, material: Usd.Prim) -> PreviewSignals:
        """Return the UsdPreviewSurface that comes nearest, and report that it is not the same.

        Args:
            shader: The surface.
            surface: What its inputs mean.
            material: The material's prim.
        """
        note_unknown_inputs(shader, "the approximation", surface.names, self._report)
        lost = [name for name, loss in surface.lacks.items() if self._is_used(shader, surface, name, loss)]
        inputs: dict[str, Signal] = {}
        paths: dict[str, Sdf.Path] = {}
        for name, term in surface.terms.items():
            value = self._term(shader, term, material)
            if value is None:
                continue
            port = shader.GetInput(term.name) or shader.GetInput(term.weight)
            path = port.GetAttr().GetPath() if port else shader.GetPath()
            if name == "ior" and self._inputs.check_ior(path, self._inputs.lower(value, 1, path)) is None:
                continue
            inputs[name], paths[name] = value, path
        mode, threshold = OpacityMode.TRANSPARENT, 0.0
        if surface.coverage:
            coverage = self._coverage(shader, surface, material)
            if coverage is not None and inputs.get("opacity", ONE).value == ONE.value:
                inputs["opacity"], mode = coverage, OpacityMode.PRESENCE
                paths["opacity"] = shader.GetInput(surface.coverage).GetAttr().GetPath()
                threshold = self._threshold(shader, surface)
            elif coverage is not None:
                lost.append(surface.coverage)
        frame = NormalFrame.PRIMVAR
        if surface.normal and self._is_bent(shader, surface.normal):
            normal = self._inputs.signal(shader.GetInput(surface.normal), material, (3,))
            if normal is not None:
                inputs["normal"] = normal
                frame = frame_of(shader.GetInput(surface.normal), self._report)
                paths["normal"] = shader.GetInput(surface.normal).GetAttr().GetPath()
        found = PreviewSignals(inputs, paths, opacity_mode=mode, opacity_threshold=threshold, normal_frame=frame)
        weight = self._number(shader, surface.reflectance, 1.0) if surface.reflectance else 1.0
        coat_ior = self._coat_ior(shader, surface, found, lost)
        found = _with_reflectance(found, weight if weight >= 0.0 else 1.0, coat_ior, lost)
        without = f", without {', '.join(lost)}" if lost else ""
        message = f"the surface {shader.GetShaderId()!r} is approximated by a UsdPreviewSurface{without}"
        self._report.warn(APPROXIMATED_SURFACE, shader.GetPath(), message)
        return found

    def _term(self, shader: UsdShade.Shader, term: Term, material: Usd.Prim) -> Signal | None:
        """Return an input of UsdPreviewSurface; None, told, where its factors vary by different coordinates."""
        found = self._signal(shader, term.name, term.default, material)
        try:
            if term.weight:
                found = multiply(found, self._signal(shader, term.weight, term.weight_default, material))
            if term.is_complement:
                found = add(ONE, found.resized(1), -1.0)
        except DoesNotFold:
            message = f"{term.name} and {term.weight} vary, and not by one set of coordinates; the default is used"
            self._report.warn(UNKNOWN_NODE, shader.GetPath(), message)
            return None
        return found

    def _signal(self, shader: UsdShade.Shader, name: str, default: Color | float, material: Usd.Prim) -> Signal:
        components = default if isinstance(default, tuple) else (default,)
        return self._inputs.signal(shader.GetInput(name), material, (len(components),)) or Signal.constant(components)

    def _coverage(self, shader: UsdShade.Shader, surface: ForeignSurface, material: Usd.Prim) -> Signal | None:
        """Return the share of the surface that is there; None where that is all of it."""
        port = shader.GetInput(surface.coverage)
        if not port or (surface.coverage_mode and self._number(shader, surface.coverage_mode, 0.0) == 0.0):
            return None
        found = self._inputs.signal(port, material, (1, 3))
        if found is None or set(found.value or ()) == {1.0}:
            return None
        return found.map(_MEAN) if found.size == len(_MEAN[0]) else found

    def _threshold(self, shader: UsdShade.Shader, surface: ForeignSurface) -> float:
        if not surface.coverage_mode or self._number(shader, surface.coverage_mode, 0.0) != _GLTF_MASK:
            return 0.0
        return max(self._number(shader, CUTOFF, 0.5), float(np.finfo(np.float32).tiny))

    def _coat_ior(
        self, shader: UsdShade.Shader, surface: ForeignSurface, found: PreviewSignals, lost: list[str]
    ) -> float | None:
        """Return a coat's index of refraction; None where it has none but the surface's, or, told, it is lost."""
        index, ior = surface.coat_ior_default, found.get("ior").value
        if index is None or found.get("clearcoat").value == (0.0,):
            return None
        if surface.coat_ior:
            index = self._number(shader, surface.coat_ior, index)
        if index <= 0.0 or (ior is not None and math.isclose(index, ior[0], rel_tol=1e-6)):
            return None
        if _transmits(found) or found.get("metallic").value is None:
            lost.append(surface.coat_ior or "the coat's index of refraction")
            return None
        return index

    def _number(self, shader: UsdShade.Shader, name: str, default: float) -> float:
        found = read_numbers(shader, name, (1,), self._time, self._report)
        return found[0] if found else default

    def _is_used(self, shader: UsdShade.Shader, surface: ForeignSurface, name: str, loss: Loss) -> bool:
        """Return whether an input does anything that is lost."""
        if loss.of and self._said(shader, loss.of, surface.default_of(loss.of, 1.0)) == (0.0,):
            return False
        said = self._said(shader, name, loss.neutral if loss.default is None else loss.default, is_told=True)
        if loss.same_as:
            return said != self._said(shader, loss.same_as, surface.default_of(loss.same_as, loss.neutral))
        return isinstance(said, Sdf.Path) or any(number != loss.neutral for number in said)

    def _said(
        self, shader: UsdShade.Shader, name: str, default: Color | float, *, is_told: bool = False
    ) -> Sdf.Path | tuple[float, ...]:
        """Return the output that an input is connected to, or its numbers; the surface's own normal says nothing.

        Args:
            shader: The surface.
            name: Of the input.
            default: What counts where it says nothing.
            is_told: Whether what is no number is told here: of inputs that count it is told where they are read.
        """
        port = shader.GetInput(name)
        source = find_source(port, self._report) if port else None
        if isinstance(source, Node):
            if not source.id.startswith(_OWN_NORMAL):
                return source.path
            source = None
        value = source.Get(self._time) if source else None
        found = numbers(value)
        if is_told and source and value is not None and found is None:
            warn_type(source, value, "not finite numbers", self._report)
        return found or (default if isinstance(default, tuple) else (default,))

    def _is_bent(self, shader: UsdShade.Shader, name: str) -> bool:
        """Return whether a normal comes from anything but the surface itself."""
        return isinstance(self._said(shader, name, 0.0), Sdf.Path)


def _transmits(surface: PreviewSignals) -> bool:
    return surface.opacity_mode == OpacityMode.TRANSPARENT and surface.get("opacity").value != ONE.value


def _with_reflectance(
    surface: PreviewSignals, weight: float, coat_ior: float | None, lost: list[str]
) -> PreviewSignals:
    """Return a surface whose reflectance head on, ((1 - ior) / (1 + ior))^2, is scaled; metals have another.

    Another index of refraction does it, unless a coat has that one too, or rays are bent by it: then the specular
    workflow, in which it is the coat's alone where nothing is transmitted.

    Args:
        surface: The surface.
        weight: At least 0.
        coat_ior: Index of refraction of the coat; None: the surface's.
        lost: Gets the names of inputs that cannot be told so.
    """
    if weight == 1.0 and coat_ior is None:
        return surface
    ior = surface.get("ior").value
    if ior is not None and not _transmits(surface) and surface.get("clearcoat").value == (0.0,):
        r = min(math.sqrt(weight) * abs((1.0 - ior[0]) / (1.0 + ior[0])), 0.999)
        return replace(surface, inputs={**surface.inputs, "ior": Signal.constant(((1.0 + r) / (1.0 - r),))})
    if surface.get("metallic").value != ONE.value:
        surface = in_specular_workflow(surface, lost, weight)
    if coat_ior is None:
        return surface
    return replace(surface, inputs={**surface.inputs, "ior": Signal.constant((coat_ior,))})
