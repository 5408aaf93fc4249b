# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdRenderSettings, and the first raster UsdRenderProduct's overrides, to Settings.

Reference: UsdRender schema documentation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdRender

from warp_rt.errors import SceneError
from warp_rt.options import MAX_DEPTH, MAX_LIGHT_SAMPLES, PURPOSES
from warp_rt.report import Report
from warp_rt.scene import Camera, Product, Settings
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.bindings import BINDING_PURPOSES
from warp_rt.usd.color_spaces import color_space
from warp_rt.usd.context import SHOWN
from warp_rt.usd.questions import get_type_name
from warp_rt.usd.render_vars import read_render_var
from warp_rt.usd.setting_values import (
    POLICIES,
    color_of,
    data_window_of,
    numbers_of,
    pixel_aspect_ratio_of,
    policy_of,
    purposes_of,
    resolution_of,
    steady_value,
    threshold_of,
    whole_number_of,
)
from warp_rt.usd.stage import OUTSIDE_MASK, is_outside_mask, stage_name

MISSING_SETTINGS = "W521"
IGNORED_SETTING = "W522"
INVALID_SETTING = "W523"
IGNORED_PRODUCT = "W524"
UNUSED_RENDER_PRIM = "N903"

_METADATA = "renderSettingsPrimPath"
_NAME = "productName"  # which, unlike the rest, is not uniform
_OWN_TERMS = ("warp_rt:ambient", "warp_rt:background", "warp_rt:depth", "warp_rt:lightSamples", "warp_rt:threshold")
_RESOLUTION = (2048, 1080)  # the schema's, of products; pictures that the command asks for have its width
_WHOLE_WINDOW = (0.0, 0.0, 1.0, 1.0)
_ALL_PURPOSE = "allPurpose"  # what UsdShade calls the token "", and Houdini writes for it
_Meaning = TypeVar("_Meaning")


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
    reader = _Reader([prim], report)
    settings: Settings | None = None
    products = []
    for product in _raster_products(prim, report):
        own = _Reader([product, prim], report)
        own.report_unknown()
        said = _settings_of(own, prim)
        settings = settings or said
        targets = _targets(product, "orderedVars", report)
        variables = (read_render_var(stage.GetPrimAtPath(target), target, report) for target in targets)
        products.append(
            Product(
                str(product.GetPath()),
                _name_at(product, Usd.TimeCode.Default(), report),
                replace(said, path=str(product.GetPath()), resolution=said.resolution or _RESOLUTION),
                tuple(variable for variable in variables if variable is not None),
                tuple((time, _name_at(product, time, report)) for time in product.GetAttribute(_NAME).GetTimeSamples()),
            )
        )
    reader.report_unknown()
    return RenderTerms(
        settings or _settings_of(reader, prim),
        reader.purposes(),
        reader.binding_purposes(),
        tuple(products),
        reader.rendering_from_rec709(),
    )


def _raster_products(settings: Usd.Prim, report: Report) -> list[Usd.Prim]:
    """Return the products that pictures can be made of; the others are reported."""
    found = []
    for path in _targets(settings, "products", report):
        product = UsdRender.Product(settings.GetStage().GetPrimAtPath(path))
        kind = steady_value(product.GetProductTypeAttr()) if product else ""
        if not product or not SHOWN(product.GetPrim()):
            report.warn(IGNORED_PRODUCT, path, "is named as a product, but is no RenderProduct that is active")
        elif str(kind) != "raster":
            report.warn(IGNORED_PRODUCT, path, f"the product type {shown(kind)} is not supported; ignored")
        else:
            found.append(product.GetPrim())
    return found


def _targets(prim: Usd.Prim, name: str, report: Report) -> Sequence[Sdf.Path]:
    """Return what a relationship leads to; nothing, with a diagnostic, where it is an attribute."""
    try:
        return prim.GetRelationship(name).GetForwardedTargets()
    except Tf.ErrorException:
        report.warn(INVALID_SETTING, prim.GetPath(), f"{name} is no relationship; ignored")
        return ()


def _name_at(product: Usd.Prim, time: Usd.TimeCode | float, report: Report) -> str:
    value = product.GetAttribute(_NAME).Get(time)
    if not isinstance(value, str | None):
        report.warn(INVALID_SETTING, product.GetPath(), f"{_NAME} is {shown(value)}, no text; ignored")
        return ""
    return str(value or "")


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
    targets = _targets(prim, "renderSource", report)
    if not targets:
        raise SceneError(f"{source}: the render pass {path} names no renderSource")
    file = steady_value(UsdRender.Pass(prim).GetFileNameAttr())
    if file:
        message = f"fileName {shown(str(file))} is not opened: renderSource is taken of this stage"
        report.warn(IGNORED_SETTING, path, message)
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
    if prim and prim.IsA(UsdRender.Settings) and SHOWN(prim):
        return prim
    if path is not None:
        raise SceneError(f"{stage_name(stage)}: {name} is no RenderSettings prim")
    if name.startswith("/") and Sdf.Path.IsValidPathString(name) and is_outside_mask(stage, name):
        report.warn(OUTSIDE_MASK, name, f"is named by {_METADATA}, but the mask leaves it out: no settings count")
        return None
    report.warn(MISSING_SETTINGS, name, f"is named by {_METADATA}, but is no RenderSettings prim; ignored")
    return None


def report_missing_camera(settings: Settings, cameras: Sequence[Camera], report: Report) -> None:
    """Report a camera that is named and there, but that nobody can look through, such as one of a prototype."""
    if settings.camera is not None and settings.camera not in {camera.path for camera in cameras}:
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
    """Looks up the settings on the product, where authored there, then on the RenderSettings.

    A value that makes no sense is told, and counts as one that is not authored.
    """

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
        return self._strongest("resolution", resolution_of)

    def pixel_aspect_ratio(self) -> float:
        """Return width by height of a pixel."""
        found = self._strongest("pixelAspectRatio", pixel_aspect_ratio_of)
        return 1.0 if found is None else found

    def aspect_policy(self) -> str:
        """Return what gives way where image and camera differ in aspect."""
        return self._strongest("aspectRatioConformPolicy", policy_of) or POLICIES[0]

    def camera(self) -> str | None:
        """Return the camera's path."""
        for prim in self._prims:
            targets = _targets(prim, "camera", self._report)
            if len(targets) > 1:
                self._report.warn(INVALID_SETTING, prim.GetPath(), "names several cameras; the first is used")
            if targets and self._is_camera(prim, targets[0]):
                return str(targets[0])
        return None

    def _is_camera(self, prim: Usd.Prim, path: Sdf.Path) -> bool:
        """Return whether there is a camera where a prim says; tell where there is none."""
        stage = prim.GetStage()
        found = stage.GetPrimAtPath(path)
        if found and found.IsA(UsdGeom.Camera) and SHOWN(found):
            return True
        if is_outside_mask(stage, path):
            self._report.warn(OUTSIDE_MASK, prim.GetPath(), f"camera: {path} is left out by the mask")
        else:
            self._report.warn(INVALID_SETTING, prim.GetPath(), f"camera: {path} is no camera of the stage; ignored")
        return False

    def color(self, name: str) -> tuple[float, float, float] | None:
        """Return a colour attribute of our own."""
        return self._strongest(name, color_of)

    def depth(self) -> int | None:
        """Return the levels of the ray tree."""
        return self._whole_number("warp_rt:depth", 1, MAX_DEPTH)

    def light_samples(self) -> int | None:
        """Return the samples of area lights and domes."""
        return self._whole_number("warp_rt:lightSamples", 0, MAX_LIGHT_SAMPLES)

    def threshold(self) -> float | None:
        """Return the weight below which the ray tree ends."""
        return self._strongest("warp_rt:threshold", threshold_of)

    def truth(self, name: str) -> bool:
        """Return a truth value, false where nothing is authored."""
        found = self._strongest(name, lambda value: numbers_of(value, 1))
        return found is not None and bool(found[0])

    def data_window(self) -> tuple[float, float, float, float]:
        """Return left, bottom, right and top of what is made, as shares of the picture's sides."""
        return self._strongest("dataWindowNDC", data_window_of) or _WHOLE_WINDOW

    def purposes(self) -> tuple[str, ...] | None:
        """Return includedPurposes where authored."""
        purposes = self._strongest("includedPurposes", purposes_of)
        if purposes is None:
            return None
        unknown = [purpose for purpose in purposes if purpose not in PURPOSES]
        if unknown:
            self._invalid("includedPurposes", f"{', '.join(map(shown, unknown))}: no purpose of {', '.join(PURPOSES)}")
        return tuple(purpose for purpose in purposes if purpose in PURPOSES) or None

    def rendering_from_rec709(self) -> np.ndarray | None:
        """Return the matrix to the primaries that are rendered in; None of Rec. 709's, or, told, of what are none."""
        name = str(self._strongest("renderingColorSpace", lambda value: value) or "")
        space = color_space(name) if name else None
        matrix = np.linalg.inv(space.matrix) if space and space.gamma == 1.0 else None
        if name and (matrix is None or not np.allclose(matrix.sum(axis=1), 1.0, atol=1e-3)):
            self._ignored(f"renderingColorSpace {name!r}", "linear Rec. 709 is rendered in")
            return None
        return None if space is None or space.has_rec709_primaries else matrix

    def binding_purposes(self) -> tuple[str, ...]:
        """Return the material purposes of the bindings that count."""
        purposes = self._strongest("materialBindingPurposes", purposes_of) or BINDING_PURPOSES
        return tuple(dict.fromkeys("" if purpose == _ALL_PURPOSE else purpose for purpose in purposes))

    def _strongest(self, name: str, meaning: Callable[[Any], _Meaning]) -> _Meaning | None:
        """Return what the strongest value that makes sense means; None where there is none. The others are told.

        Args:
            name: Of the attribute.
            meaning: Of a value; raises a ValueError that says why it has none.
        """
        for prim in self._prims:
            attribute = prim.GetAttribute(name)
            value = steady_value(attribute) if attribute.HasAuthoredValue() else None
            if value is None:
                continue
            if attribute.ValueMightBeTimeVarying():
                message = f"{name}: has time samples, but settings hold for all frames; {shown(value)} counts"
                self._report.warn(INVALID_SETTING, prim.GetPath(), message)
            try:
                return meaning(value)
            except ValueError as error:
                self._report.warn(INVALID_SETTING, prim.GetPath(), f"{name}: {error}; ignored")
        return None

    def _whole_number(self, name: str, low: int, high: int) -> int | None:
        return self._strongest(name, lambda value: whole_number_of(value, low, high))

    def _invalid(self, name: str, why: str) -> None:
        self._report.warn(INVALID_SETTING, self._prims[-1].GetPath(), f"{name}: {why}; ignored")

    def _ignored(self, name: str, instead: str) -> None:
        self._report.warn(IGNORED_SETTING, self._prims[-1].GetPath(), f"{name} is not supported; {instead}")
