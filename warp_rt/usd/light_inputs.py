# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The inputs that UsdLux lights of several types share, with the schema's units resolved.

Reference: UsdLux schema documentation, "Quantities and Units".
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from pxr import Sdf, Usd, UsdLux

from warp_rt.report import Report
from warp_rt.scene import Shadow
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.dome_layouts import Stretch
from warp_rt.usd.rendering_space import product

INVALID_LIGHT = "W409"
OUT_OF_RANGE = "W415"

LARGEST_RADIANCE = 2.0**80
"""Of a light or a dome: with multiplier, texel and solid angle its sums stay far below float32's largest number."""
_LARGEST_MULTIPLIER = 2.0**20

# What UsdLux.BlackbodyTemperatureAsRgb knows [K]; others count as the nearer end.
_TEMPERATURES = 1000.0, 10000.0


class Images(Protocol):
    """What a textured light needs of the images: ``warp_rt.usd.materials.MaterialReader`` has it."""

    def image(self, asset: Sdf.AssetPath, prim: Usd.Prim) -> int:
        """Return the row of an image, or -1."""

    def decoded(self, row: int, attribute: Usd.Attribute, prim: object) -> tuple[int, bool]:
        """Return the row to read of the image of an attribute, and whether to decode it by the sRGB curve."""

    def latlong(self, row: int, layout: str, *, is_srgb: bool, stretch: Stretch | None = None) -> tuple[int, bool]:
        """Return the row of an environment by latitude and longitude, and whether to decode it; -1 if it cannot be."""


def emission(attributes: AttributeReader, from_rec709: np.ndarray | None) -> np.ndarray:
    """Return intensity * 2^exposure * color * temperature, before normalisation: shape [3]."""
    intensity = attributes.number("inputs:intensity", 1.0)
    exposure = attributes.number("inputs:exposure", 0.0)
    color = np.array(attributes.color("inputs:color", (1.0, 1.0, 1.0)))
    if attributes.truth("inputs:enableColorTemperature", False):
        temperature = attributes.within("inputs:colorTemperature", 6500.0, *_TEMPERATURES, OUT_OF_RANGE)
        color = product(from_rec709, color, np.array(UsdLux.BlackbodyTemperatureAsRgb(temperature)))
    with np.errstate(over="ignore"):
        return intensity * np.exp2(exposure) * color


def shines(radiance: np.ndarray, path: Sdf.Path, report: Report) -> bool:
    """Return whether a radiance, shape [3], can be computed with; else it is told that the light is left out."""
    if (np.abs(radiance) <= LARGEST_RADIANCE).all():
        return True
    report.warn(INVALID_LIGHT, path, f"the radiance is not finite, or beyond {LARGEST_RADIANCE:.2g}; left out")
    return False


def multipliers(attributes: AttributeReader) -> tuple[float, float]:
    """Return by how much diffuse and specular reflection are multiplied."""
    low, high = -_LARGEST_MULTIPLIER, _LARGEST_MULTIPLIER
    diffuse = attributes.within("inputs:diffuse", 1.0, low, high, OUT_OF_RANGE)
    return diffuse, attributes.within("inputs:specular", 1.0, low, high, OUT_OF_RANGE)


def read_shadow(attributes: AttributeReader) -> Shadow:
    """Return what ShadowAPI says, where it is applied or authored; a distance below 0 and a falloff of 0 are none."""
    red, green, blue = attributes.color("inputs:shadow:color", (0.0, 0.0, 0.0))
    distance = attributes.number("inputs:shadow:distance", -1.0)
    falloff = attributes.number("inputs:shadow:falloff", -1.0)
    gamma = attributes.within("inputs:shadow:falloffGamma", 1.0, 0.0, math.inf, OUT_OF_RANGE)
    if distance < 0:
        return Shadow((red, green, blue))
    return Shadow((red, green, blue), distance, min(max(falloff, 0.0), distance), gamma)


def has_shaping(prim: Usd.Prim) -> bool:
    """Return whether ShapingAPI is applied to a light, or something of it authored."""
    return prim.HasAPI(UsdLux.ShapingAPI) or bool(prim.GetAuthoredPropertiesInNamespace("inputs:shaping"))


def read_shaping(attributes: AttributeReader) -> tuple[float, tuple[float, float, float], float, float]:
    """Return focus, tint, half cone angle [rad] and softness; those of ShapingAPI where it is applied or authored."""
    red, green, blue = attributes.vector("inputs:shaping:focusTint", (0.0, 0.0, 0.0))
    return (
        attributes.within("inputs:shaping:focus", 0.0, 0.0, math.inf, OUT_OF_RANGE),
        (red, green, blue),
        math.radians(attributes.within("inputs:shaping:cone:angle", 180.0, 0.0, 180.0, OUT_OF_RANGE)),
        attributes.within("inputs:shaping:cone:softness", 0.0, 0.0, 1.0, OUT_OF_RANGE),
    )
