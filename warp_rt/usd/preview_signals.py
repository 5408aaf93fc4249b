# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A UsdPreviewSurface before its inputs are made textures and primvars, so that two of them can be mixed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from pxr import Sdf

from warp_rt.scene import MATERIAL_DEFAULTS, Input, Material, MaterialModel, NormalFrame, OpacityMode
from warp_rt.usd.signals import DoesNotFold, Signal, add, apply, blend, multiply, steps_of
from warp_rt.usd.surface_inputs import InputReader

_DEFAULTS = MATERIAL_DEFAULTS[MaterialModel.PREVIEW]
PREVIEW_SIZES = {name: len(default) for name, default in _DEFAULTS.items()}
"""Components of each input."""
ONE = Signal.constant((1.0,))

_SHARES = ("metallic", "roughness", "clearcoat", "clearcoatRoughness", "opacity", "occlusion")  # from 0 to 1


@dataclass(frozen=True)
class PreviewSignals:
    """What the inputs of a UsdPreviewSurface say."""

    inputs: Mapping[str, Signal]
    """Those that say anything."""
    paths: Mapping[str, Sdf.Path] = field(default_factory=dict)
    """Of the ports on which they say it."""
    use_specular_workflow: bool = False
    opacity_mode: OpacityMode = OpacityMode.TRANSPARENT
    opacity_threshold: float = 0.0
    normal_frame: NormalFrame = NormalFrame.IMAGE
    """Of the input ``normal``."""

    def get(self, name: str) -> Signal:
        """Return an input, or its default."""
        return self.inputs.get(name) or Signal.constant(_DEFAULTS[name])

    def lowered(self, path: str, inputs: InputReader, surface: Sdf.Path) -> Material:
        """Return the material; what does not come down to one texture or primvar is told, and has its default.

        Args:
            path: Of the material.
            inputs: Keeps its textures.
            surface: What diagnostics about inputs are about that have no port of their own.
        """
        lowered: dict[str, Input] = {}
        for name, signal in self.inputs.items():
            port = self.paths.get(name, surface)
            value = inputs.lower(signal, PREVIEW_SIZES[name], port)
            if name == "ior":
                value = inputs.check_ior(port, value)
            elif name in _SHARES:
                value = inputs.check_share(port, value)
            elif name == "normal" and value is not None:
                value = replace(value, normal_frame=self.normal_frame)
            if value is not None:
                lowered[name] = value
        return Material(
            path,
            MaterialModel.PREVIEW,
            lowered,
            use_specular_workflow=self.use_specular_workflow,
            opacity_mode=self.opacity_mode,
            opacity_threshold=self.opacity_threshold,
        )


def mixed(foreground: PreviewSignals, background: PreviewSignals, share: Signal) -> tuple[PreviewSignals, list[str]]:
    """Return the surface that comes nearest to a mixture of two, and the names of what of it is not mixed.

    The light that two surfaces reflect diffusely, send out and let through is mixed exactly where lobes are alike; the
    reflectance head on likewise, and of the width of lobes the mean is taken. Surfaces that are not both of the
    specular workflow, nor metals to the same constant degree, are told in the specular workflow.

    Args:
        foreground: Of which there is so much as ``share`` says.
        background: The rest.
        share: From 0 to 1.
    """
    metallic = foreground.get("metallic").value
    are_specular = foreground.use_specular_workflow and background.use_specular_workflow
    are_metals = not (foreground.use_specular_workflow or background.use_specular_workflow)
    lost: list[str] = []
    if not are_specular and not (are_metals and metallic is not None and metallic == background.get("metallic").value):
        foreground, background = in_specular_workflow(foreground, lost), in_specular_workflow(background, lost)
    inputs: dict[str, Signal] = {}
    for name in [name for name in PREVIEW_SIZES if name in {*foreground.inputs, *background.inputs}]:
        first, second = foreground.get(name), background.get(name)
        if first.key == second.key:
            inputs[name] = first
            continue
        if name == "normal" and foreground.normal_frame != background.normal_frame:
            lost.append(name)
            inputs[name] = second
            continue
        try:
            inputs[name] = blend(second, first, share)
        except DoesNotFold:
            lost.append(name)
            inputs[name] = second
    if foreground.use_specular_workflow:
        _mix_what_lobes_leave(foreground, background, share, inputs)
    of_opacity = [one for one in (foreground, background) if one.get("opacity").value != (1.0,)] or [background]
    if len({(one.opacity_mode, one.opacity_threshold) for one in of_opacity}) > 1:
        lost.append("opacityMode and opacityThreshold")
    chosen = of_opacity[-1]
    return (
        PreviewSignals(
            inputs,
            use_specular_workflow=foreground.use_specular_workflow,
            opacity_mode=chosen.opacity_mode,
            opacity_threshold=chosen.opacity_threshold,
            normal_frame=background.normal_frame,
        ),
        list(dict.fromkeys(lost)),
    )


def _mix_what_lobes_leave(
    foreground: PreviewSignals, background: PreviewSignals, share: Signal, inputs: dict[str, Signal]
) -> None:
    """Have the diffuse layer of a mixture reflect what those of both surfaces do under their own lobes, seen head on.

    The specification scales each by what its own lobe leaves: the mean of the colours alone would be dimmed by the
    mean of both lobes, a plastic by the metal that it is mixed with.
    """
    first, second = foreground.get("specularColor"), background.get("specularColor")
    if first.key == second.key:
        return
    white = Signal.constant((1.0, 1.0, 1.0))
    left, right = add(white, first, -1.0), add(white, second, -1.0)
    try:
        under = blend(
            multiply(background.get("diffuseColor"), right), multiply(foreground.get("diffuseColor"), left), share
        )
        inputs["diffuseColor"] = apply(_share_of, under, blend(right, left, share))
    except DoesNotFold:
        return  # the mean of the colours comes near


def _share_of(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Return part / whole, from 0 to 1; 0 of nothing."""
    return np.clip(np.divide(part, whole, out=np.zeros(np.shape(whole)), where=np.asarray(whole) > 1e-6), 0.0, 1.0)


def in_specular_workflow(surface: PreviewSignals, lost: list[str], weight: float = 1.0) -> PreviewSignals:
    """Return a surface in the specular workflow, by the specification's own formulas.

    Args:
        surface: In either workflow.
        lost: Gets the names of inputs that cannot be told so.
        weight: Of what is no metal's reflectance head on, that of the clearcoat apart.

    Reference: UsdPreviewSurface Specification 2.6, useSpecularWorkflow.
    """
    if surface.use_specular_workflow:
        return surface
    diffuse, metallic = surface.get("diffuseColor"), surface.get("metallic").resized(1)
    inputs = {name: signal for name, signal in surface.inputs.items() if name != "metallic"}
    try:
        rest = add(ONE, metallic, -1.0)
        head_on = multiply(apply(_reflectance, surface.get("ior").resized(1)), Signal.constant((weight,)))
        inputs["diffuseColor"] = multiply(diffuse, rest)
        inputs["specularColor"] = multiply(
            add(rest, multiply(diffuse, metallic)), add(multiply(head_on, rest), metallic)
        )
    except DoesNotFold:
        lost.append("metallic")
        inputs["diffuseColor"], inputs["specularColor"] = diffuse, Signal.constant((0.04, 0.04, 0.04))
    return PreviewSignals(
        inputs,
        surface.paths,
        use_specular_workflow=True,
        opacity_mode=surface.opacity_mode,
        opacity_threshold=surface.opacity_threshold,
        normal_frame=surface.normal_frame,
    )


def _reflectance(ior: np.ndarray) -> np.ndarray:
    """Return the reflectance head on of a medium in vacuum."""
    return np.asarray(np.square((1.0 - ior) / (1.0 + ior)))


@steps_of(_reflectance)
def _reflectance_steps(ior: Signal) -> Signal:
    share = multiply(add(ONE, ior, -1.0), apply(np.reciprocal, add(ONE, ior)))
    return multiply(share, share)
