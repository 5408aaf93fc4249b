# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Inputs of surface shaders to Input: the constant, texture or primvar that a network comes down to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pxr import Sdf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import Input, Texture
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.input_rows import OUT_OF_RANGE, InputRows, Unknown
from warp_rt.usd.shading_network import WRONG_TYPE
from warp_rt.usd.signal_reader import SignalReader
from warp_rt.usd.signals import Signal


class InputReader:
    """Reads inputs of surfaces, and keeps the textures that they use.

    Args:
        images: Reads the files.
        time: When inputs are read.
        report: Takes the diagnostics.
    """

    def __init__(self, images: ImageCache, time: Usd.TimeCode, report: Report) -> None:
        self._signals = SignalReader(images, time, report)
        self._rows = InputRows(images, report)
        self._report = report

    @property
    def textures(self) -> list[Texture]:
        """Rows of ``Scene.textures``."""
        return self._rows.textures

    @property
    def unknown_beyond(self) -> dict[int, Unknown]:
        """Textures whose images are not all that they were made of: see ``InputRows``."""
        return self._rows.unknown_beyond

    def read(self, port: UsdShade.Input, count: int, material: Usd.Prim) -> Input | None:
        """Return what an input says.

        Args:
            port: The input of a surface shader.
            count: Components that the surface expects: 1 or 3.
            material: The material's prim; its primvars serve where a mesh lacks them.

        Returns:
            None where nothing is said, so that the specification's default holds.
        """
        found = self.signal(port, material, (count,))
        return self.lower(found, count, port.GetAttr().GetPath()) if found else None

    def signal(self, port: UsdShade.Input | None, material: Usd.Prim, sizes: Sequence[int]) -> Signal | None:
        """Return what an input says before it is made an Input: see ``SignalReader.read``; None if it is not there."""
        return self._signals.read(port, material, sizes) if port else None

    def lower(self, found: Signal, count: int, path: Sdf.Path) -> Input | None:
        """Return a signal as an input: see ``InputRows.lower``."""
        return self._rows.lower(found, count, path)

    def check_ior(self, path: Sdf.Path, found: Input | None) -> Input | None:
        """Return an index of refraction; None, told, of a constant that is not above 0, for the default to hold."""
        if found is None or found.varies or found.value[0] > 0.0:
            return found
        message = f"is {found.value[0]:g}, an index of refraction not above 0; the default is used"
        self._report.warn(WRONG_TYPE, path, message)
        return None

    def check_share(self, path: Sdf.Path, found: Input | None) -> Input | None:
        """Return an input that goes from 0 to 1; of a constant beyond, told, the nearest of the two."""
        if found is None or found.varies or 0.0 <= found.value[0] <= 1.0:
            return found
        nearest = min(max(found.value[0], 0.0), 1.0)
        message = f"is {found.value[0]:g}, not from 0 to 1; {nearest:g} is used"
        self._report.warn(OUT_OF_RANGE, path, message)
        return replace(found, value=(nearest, *found.value[1:]))

    def check_exponent(self, path: Sdf.Path, found: Input | None) -> Input | None:
        """Return an exponent of highlights; 0, told, for a constant below it."""
        if found is None or found.varies or found.value[0] >= 0.0:
            return found
        message = f"is {found.value[0]:g}, an exponent below 0; 0 is used"
        self._report.warn(OUT_OF_RANGE, path, message)
        return replace(found, value=(0.0, *found.value[1:]))

    def add(self, texture: Texture) -> int:
        """Return the row of a new texture."""
        return self._rows.add(texture)
