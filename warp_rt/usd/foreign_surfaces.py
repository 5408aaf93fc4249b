# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Surfaces of other renderers as UsdPreviewSurfaces: ``foreign_shaders`` says what inputs become, this reads them."""

from __future__ import annotations

import math

import numpy as np
from pxr import Sdf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import MATERIAL_DEFAULTS, MaterialModel, OpacityMode
from warp_rt.usd.attribute_values import numbers, shown
from warp_rt.usd.foreign_shaders import Color, ForeignSurface, Term
from warp_rt.usd.normal_networks import is_of_world
from warp_rt.usd.preview_signals import ONE, PreviewSignals
from warp_rt.usd.shading_network import WRONG_TYPE, Node, find_source, read_numbers
from warp_rt.usd.signal_reader import UNKNOWN_NODE
from warp_rt.usd.signals import DoesNotFold, Signal, add, multiply
from warp_rt.usd.surface_inputs import InputReader

APPROXIMATED_SURFACE = "W302"

_DEFAULT_IOR = Signal.constant(MATERIAL_DEFAULTS[MaterialModel.PREVIEW]["ior"])
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
        lost = [name for name, neutral in surface.lacks.items() if self._is_used(shader, name, neutral)]
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
        if surface.reflectance:
            is_bent = mode == OpacityMode.TRANSPARENT and inputs.get("opacity", ONE).value != ONE.value
            if not is_bent:
                self._scale_reflectance(shader, surface.reflectance, inputs)
        has_world_normal = False
        if surface.normal and self._is_bent(shader, surface.normal):
            normal = self._inputs.signal(shader.GetInput(surface.normal), material, (1, 3, 4))
            if normal is not None:
                inputs["normal"] = normal
                has_world_normal = is_of_world(shader.GetInput(surface.normal), self._report)
                paths["normal"] = shader.GetInput(surface.normal).GetAttr().GetPath()
        without = f", without {', '.join(lost)}" if lost else ""
        message = f"the surface {shader.GetShaderId()!r} is approximated by a UsdPreviewSurface{without}"
        self._report.warn(APPROXIMATED_SURFACE, shader.GetPath(), message)
        return PreviewSignals(
            inputs, paths, opacity_mode=mode, opacity_threshold=threshold, has_world_normal=has_world_normal
        )

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
        found = self._inputs.signal(shader.GetInput(name), material, (1, 3, 4))
        return found or Signal.constant(default if isinstance(default, tuple) else (default,))

    def _coverage(self, shader: UsdShade.Shader, surface: ForeignSurface, material: Usd.Prim) -> Signal | None:
        """Return the share of the surface that is there; None where that is all of it."""
        port = shader.GetInput(surface.coverage)
        if not port or (surface.coverage_mode and self._number(shader, surface.coverage_mode, 0.0) == 0.0):
            return None
        found = self._inputs.signal(port, material, (1, 3, 4))
        return None if found is None or set(found.value or ()) == {1.0} else found

    def _threshold(self, shader: UsdShade.Shader, surface: ForeignSurface) -> float:
        if not surface.coverage_mode or self._number(shader, surface.coverage_mode, 0.0) != _GLTF_MASK:
            return 0.0
        return max(self._number(shader, "alpha_cutoff", 0.5), float(np.finfo(np.float32).tiny))

    def _scale_reflectance(self, shader: UsdShade.Shader, name: str, inputs: dict[str, Signal]) -> None:
        """Scale the reflectance at normal incidence, ((1 - ior) / (1 + ior))^2, of what bends no rays by that ior."""
        weight = self._number(shader, name, 1.0)
        ior = inputs.get("ior", _DEFAULT_IOR).value
        if weight == 1.0 or weight < 0.0 or ior is None:
            return
        r = min(math.sqrt(weight) * abs((1.0 - ior[0]) / (1.0 + ior[0])), 0.999)
        inputs["ior"] = Signal.constant(((1.0 + r) / (1.0 - r),))

    def _number(self, shader: UsdShade.Shader, name: str, default: float) -> float:
        found = read_numbers(shader, name, (1,), self._time, self._report)
        return found[0] if found else default

    def _is_used(self, shader: UsdShade.Shader, name: str, neutral: float) -> bool:
        """Return whether an input says anything but its neutral value."""
        port = shader.GetInput(name)
        source = find_source(port, self._report) if port else None
        if source is None or isinstance(source, Node):
            return source is not None
        value = source.Get(self._time)
        found = numbers(value)
        if value is not None and found is None:
            self._report.warn(
                WRONG_TYPE, source.GetPath(), f"is {shown(value)}, not finite numbers; the default is used"
            )
        return any(number != neutral for number in found or ())

    def _is_bent(self, shader: UsdShade.Shader, name: str) -> bool:
        """Return whether a normal comes from anything but the surface itself."""
        port = shader.GetInput(name)
        source = find_source(port, self._report) if port else None
        return isinstance(source, Node) and not source.id.startswith("ND_normal_")
