# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdRenderSettings, and the first raster UsdRenderProduct's overrides, to Settings.

Reference: UsdRender schema documentation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdRender, Vt

from warp_rt.errors import SceneError
from warp_rt.options import MAX_DEPTH, MAX_LIGHT_SAMPLES, MAX_SIZE, PURPOSES
from warp_rt.report import Report
from warp_rt.scene import Camera, Product, Settings
from warp_rt.usd.attribute_values import numbers, shown
from warp_rt.usd.bindings import BINDING_PURPOSES
from warp_rt.usd.color_spaces import color_space
from warp_rt.usd.questions import get_type_name
from warp_rt.usd.render_vars import read_render_var
from warp_rt.usd.stage import OUTSIDE_MASK, is_outside_mask, stage_name

MISSING_SETTINGS = "W521"
IGNORED_SETTING = "W522"
INVALID_SETTING = "W523"
IGNORED_PRODUCT = "W524"
UNUSED_RENDER_PRIM = "N903"

_METADATA = "renderSettingsPrimPath"
_OWN_TERMS = ("warp_rt:ambient", "warp_rt:background", "warp_rt:depth", "warp_rt:lightSamples", "warp_rt:threshold")
_POLICIES = (
    "expandAperture",
    "cropAperture",
    "adjustApertureWidth",
    "adjustApertureHeight",
    "adjustPixelAspectRatio",
)
_WHOLE_WINDOW = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True)
class RenderTerms:
    """What a stage's render settings ask for."""

    settings: Settings = field(default_factory=Settings)
    """With what the first product overrides."""
    purposes: tuple[str, ...] | None = None
    """Those that are included; None: they are not named."""
    binding_purposes: tuple[str, ...] = BINDING_PURPOSES
    """Material purposes of the bindings that count, the first one that there is; empty: of those without a purpose."""
    products: tuple[Product, ...] = ()
    """Raster products."""
    rendering_from_rec709: np.ndarray | None = None
    """Matrix from linear Rec. 709 to the primaries that are rendered in, shape [3, 3]; None: those."""


def read_settings(stage: Usd.Stage, report: Report, path: str | None = None) -> RenderTerms:
    """Return what the stage's render settings ask for.

    Render settings hold for all frames, so they are read at the default time, or the earliest.

    Args:
        stage: The stage.
        report: Takes diagnostics about what is ignored.
        path: Prim path of the RenderSettings; None: as the stage's metadata say, else there are none.

    Raises:
        SceneError: ``path`` is not that of a RenderSettings prim.
    """
    prim = _settings_prim(stage, report, path)
    if prim is None:
        return RenderTerms()
    products = []
    for product in _raster_products(prim, report):
        reader = _Reader([product, prim], report)
        reader.report_unknown()
        targets = UsdRender.Product(product).GetOrderedVarsRel().GetForwardedTargets()
        variables = (read_render_var(stage.GetPrimAtPath(target), target, report) for target in targets)
        products.append(
            Product(
                str(product.GetPath()),
                str(product.GetAttribute("productName").Get() or ""),
                _settings_of(reader, prim),
                tuple(variable for variable in variables if variable is not None),
            )
        )
    reader = _Reader([prim], report)
    reader.report_unknown()
    return RenderTerms(
        products[0].settings if products else _settings_of(reader, prim),
        reader.purposes(),
        reader.binding_purposes(),
        tuple(products),
        reader.rendering_from_rec709(),
    )


def _raster_products(settings: Usd.Prim, report: Report) -> list[Usd.Prim]:
    """Return the products that pictures can be made of; the others are reported."""
    found = []
    for path in UsdRender.Settings(settings).GetProductsRel().GetForwardedTargets():
        product = UsdRender.Product(settings.GetStage().GetPrimAtPath(path))
        kind = product.GetProductTypeAttr().Get() if product else ""
        if not product:
            report.warn(IGNORED_PRODUCT, path, "is named as a product, but is no RenderProduct")
        elif str(kind) != "raster":
            report.warn(IGNORED_PRODUCT, path, f"the product type {shown(kind)} is not supported; ignored")
        else:
            found.append(product.GetPrim())
    return found


def _settings_of(reader: _Reader, prim: Usd.Prim) -> Settings:
    return Settings(
        path=str(prim.GetPath()),
        resolution=reader.resolution(),
        data_window=reader.data_window(),
        pixel_aspect_ratio=reader.pixel_aspect_ratio(),
        aspect_policy=reader.aspect_policy(),
        camera=reader.camera(),
        ambient=reader.color("warp_rt:ambient"),
        background=reader.color("warp_rt:background"),
        depth=reader.depth(),
        threshold=reader.threshold(),
        disables_depth_of_field=reader.truth("disableDepthOfField"),
        light_samples=reader.light_samples(),
        disables_motion_blur=reader.truth("disableMotionBlur"),
        has_instantaneous_shutter=reader.truth("instantaneousShutter"),
    )


def settings_of_pass(stage: Usd.Stage, path: str, report: Report) -> str:
    """Return the path of the RenderSettings that a RenderPass names as its ``renderSource``.

    Raises:
        SceneError: There is no such pass, or it names none.
    """
    prim = stage.GetPrimAtPath(path) if Sdf.Path.IsValidPathString(path) else None
    source = stage_name(stage)
    if not prim or not prim.IsA(UsdRender.Pass):
        raise SceneError(f"{source}: {path} is no RenderPass")
    targets = UsdRender.Pass(prim).GetRenderSourceRel().GetForwardedTargets()
    if not targets:
        raise SceneError(f"{source}: the render pass {path} names no renderSource")
    if len(targets) > 1:
        report.warn(IGNORED_SETTING, path, f"renderSource has {len(targets)} targets: the first counts")
    return str(targets[0])


def _settings_prim(stage: Usd.Stage, report: Report, path: str | None) -> Usd.Prim | None:
    name = path
    if name is None:
        name = stage.GetMetadata(_METADATA)
        if not isinstance(name, str) or not name:
            return None
    prim = stage.GetPrimAtPath(name) if name.startswith("/") else Usd.Prim()
    if prim and prim.IsA(UsdRender.Settings):
        return prim
    if path is not None:
        raise SceneError(f"{stage_name(stage)}: {name} is no RenderSettings prim")
    if name.startswith("/") and Sdf.Path.IsValidPathString(name) and is_outside_mask(stage, name):
        report.warn(OUTSIDE_MASK, name, f"is named by {_METADATA}, but the mask leaves it out: no settings count")
        return None
    report.warn(MISSING_SETTINGS, name, f"is named by {_METADATA}, but is no RenderSettings prim; ignored")
    return None


def report_missing_camera(settings: Settings, cameras: Sequence[Camera], stage: Usd.Stage, report: Report) -> None:
    """Report a camera that is named, and that the stage does not have."""
    if settings.camera is None or settings.camera in {camera.path for camera in cameras}:
        return
    if is_outside_mask(stage, settings.camera):
        report.warn(OUTSIDE_MASK, settings.path, f"camera: {settings.camera} is left out by the mask")
    else:
        report.warn(INVALID_SETTING, settings.path, f"camera: {settings.camera} is no camera of the stage; ignored")


def report_unused(
    settings: Settings, render_prims: Sequence[str], stage: Usd.Stage, report: Report, pass_path: str | None = None
) -> None:
    """Note the render settings and passes that nothing names; ``pass_path`` is the pass that is rendered.

    Where settings are in force, others beside them are alternatives, which is what they are for.
    """
    for path in render_prims:
        kind = get_type_name(stage.GetPrimAtPath(path))
        if kind == "RenderPass" and path != pass_path:
            report.warn(UNUSED_RENDER_PRIM, path, "counts where it is asked for (--render-pass) only")
        elif kind != "RenderPass" and not settings.path:
            report.warn(UNUSED_RENDER_PRIM, path, f"does not count: the stage's {_METADATA} does not name it")


class _Reader:
    """Looks up the settings on the product, where authored there, then on the RenderSettings."""

    def __init__(self, prims: Sequence[Usd.Prim], report: Report) -> None:
        self._prims = prims
        self._report = report

    def report_unknown(self) -> None:
        """Report settings of ours that there are not."""
        for attribute in self._prims[0].GetAuthoredPropertiesInNamespace("warp_rt"):
            if attribute.GetName() not in _OWN_TERMS:
                self._report.warn(IGNORED_SETTING, attribute.GetPath(), "there is no such setting; ignored")

    def resolution(self) -> tuple[int, int] | None:
        """Return width and height where authored."""
        found = self._numbers("resolution", 2)
        if found is None:
            return None
        width, height = (int(side) for side in found)
        if min(width, height) >= 1 and max(width, height) <= MAX_SIZE:
            return width, height
        self._invalid("resolution", f"{width} x {height} is outside 1..{MAX_SIZE}")
        return None

    def pixel_aspect_ratio(self) -> float:
        """Return width by height of a pixel."""
        found = self._numbers("pixelAspectRatio", 1)
        if found is None or found[0] > 0:
            return found[0] if found else 1.0
        self._invalid("pixelAspectRatio", f"{found[0]:g} is not above 0")
        return 1.0

    def aspect_policy(self) -> str:
        """Return what gives way where image and camera differ in aspect."""
        policy = self._value("aspectRatioConformPolicy")
        if policy is None or policy in _POLICIES:
            return policy or _POLICIES[0]
        self._invalid("aspectRatioConformPolicy", f"{shown(policy)} is unknown")
        return _POLICIES[0]

    def camera(self) -> str | None:
        """Return the camera's path."""
        for prim in self._prims:
            targets = prim.GetRelationship("camera").GetForwardedTargets()
            if len(targets) > 1:
                self._report.warn(INVALID_SETTING, prim.GetPath(), "names several cameras; the first is used")
            if targets:
                return str(targets[0])
        return None

    def color(self, name: str) -> tuple[float, float, float] | None:
        """Return a colour attribute of our own."""
        found = self._numbers(name, 3)
        return None if found is None else (found[0], found[1], found[2])

    def depth(self) -> int | None:
        """Return the levels of the ray tree."""
        return self._whole_number("warp_rt:depth", 1, MAX_DEPTH)

    def light_samples(self) -> int | None:
        """Return the samples of area lights and domes."""
        return self._whole_number("warp_rt:lightSamples", 0, MAX_LIGHT_SAMPLES)

    def threshold(self) -> float | None:
        """Return the weight below which the ray tree ends."""
        found = self._numbers("warp_rt:threshold", 1)
        if found is None or found[0] >= 0:
            return found[0] if found else None
        self._invalid("warp_rt:threshold", f"{found[0]:g} is below 0")
        return None

    def truth(self, name: str) -> bool:
        """Return a truth value, false where nothing is authored."""
        found = self._numbers(name, 1)
        return found is not None and bool(found[0])

    def data_window(self) -> tuple[float, float, float, float]:
        """Return left, bottom, right and top of what is made, as shares of the picture's sides."""
        found = self._numbers("dataWindowNDC", 4)
        if found is None:
            return _WHOLE_WINDOW
        left, bottom, right, top = found
        if left < right and bottom < top:
            return left, bottom, right, top
        self._invalid("dataWindowNDC", "a window without area")
        return _WHOLE_WINDOW

    def purposes(self) -> tuple[str, ...] | None:
        """Return includedPurposes where authored."""
        purposes = self._tokens("includedPurposes")
        if purposes is None:
            return None
        if not purposes:
            self._invalid("includedPurposes", "names no purpose")
        unknown = [purpose for purpose in purposes if purpose not in PURPOSES]
        if unknown:
            self._invalid("includedPurposes", f"{', '.join(map(shown, unknown))}: no purpose of {', '.join(PURPOSES)}")
        return tuple(purpose for purpose in purposes if purpose in PURPOSES) or None

    def rendering_from_rec709(self) -> np.ndarray | None:
        """Return the matrix to the primaries that are rendered in; None of Rec. 709's, or, told, of what are none."""
        name = str(self._value("renderingColorSpace") or "")
        space = color_space(name) if name else None
        matrix = np.linalg.inv(space.matrix) if space and space.gamma == 1.0 else None
        if name and (matrix is None or not np.allclose(matrix.sum(axis=1), 1.0, atol=1e-3)):
            self._ignored(f"renderingColorSpace {name!r}", "linear Rec. 709 is rendered in")
            return None
        return None if space is None or space.has_rec709_primaries else matrix

    def binding_purposes(self) -> tuple[str, ...]:
        """Return the material purposes of the bindings that count."""
        purposes = self._tokens("materialBindingPurposes")
        if purposes is not None and not purposes:
            self._invalid("materialBindingPurposes", "names no purpose")
        return tuple(dict.fromkeys(purposes)) if purposes else BINDING_PURPOSES

    def _tokens(self, name: str) -> tuple[str, ...] | None:
        """Return an array of tokens where authored."""
        value = self._value(name)
        if value is None or isinstance(value, Vt.TokenArray | Vt.StringArray):
            return None if value is None else tuple(str(token) for token in value)
        self._invalid(name, f"{shown(value)} is no array of tokens")
        return None

    def _value(self, name: str) -> Any:
        """Return the strongest authored value; None where nothing is authored."""
        prim = self._author(name)
        if prim is None:
            return None
        attribute = prim.GetAttribute(name)
        # Where only samples are authored, Get() returns the schema's fallback.
        is_default = attribute.GetResolveInfo(Usd.TimeCode.Default()).GetSource() == Usd.ResolveInfoSourceDefault
        return attribute.Get(Usd.TimeCode.Default() if is_default else Usd.TimeCode.EarliestTime())

    def _author(self, name: str) -> Usd.Prim | None:
        """Return the prim whose value counts; None where nothing is authored."""
        return next((prim for prim in self._prims if prim.GetAttribute(name).HasAuthoredValue()), None)

    def _whole_number(self, name: str, low: int, high: int) -> int | None:
        found = self._numbers(name, 1)
        if found is None:
            return None
        if low <= found[0] <= high and found[0] == int(found[0]):
            return int(found[0])
        self._invalid(name, f"{found[0]:g} is no whole number from {low} to {high}")
        return None

    def _numbers(self, name: str, count: int) -> tuple[float, ...] | None:
        value = self._value(name)
        found = numbers(value)
        if value is not None and (found is None or len(found) != count):
            self._invalid(name, f"not {count} finite number{'s' if count > 1 else ''}")
            return None
        return found

    def _invalid(self, name: str, why: str) -> None:
        prim = self._author(name) or self._prims[-1]
        self._report.warn(INVALID_SETTING, prim.GetPath(), f"{name}: {why}; ignored")

    def _ignored(self, name: str, instead: str) -> None:
        self._report.warn(IGNORED_SETTING, self._prims[-1].GetPath(), f"{name} is not supported; {instead}")
