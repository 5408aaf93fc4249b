# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Colour spaces by name, and the colours in them as linear Rec. 709.

A name is one of USD's (``Gf.ColorSpaceNames``), one of MaterialX's, one of those that OpenColorIO's ACES and studio
configurations have for the same spaces, or one that a ColorSpaceDefinitionAPI defines. The primaries are brought to
Rec. 709's, and whites to its white, as ``Gf.ColorSpace.Convert`` does it.

Reference: Color Interop Forum, Color Space Encodings for Texture Assets and CG Rendering (2024); UsdColorSpaceAPI.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Sdf, Usd

from warp_rt.report import Report
from warp_rt.srgb import linear_from_srgb
from warp_rt.usd.questions import get_value_type

UNKNOWN_COLOR_SPACE = "W205"

_LINEAR = Gf.ColorSpace(Gf.ColorSpaceNames.LinearRec709)
_SRGB_CURVE = (2.4, 0.055)
_SRGB_FOOT = (0.04045, 1 / 12.92)  # IEC 61966-2-1
_COLOR = Sdf.ValueRoleNames.Color

# Names that others have for the spaces of Gf, in lower case; those of Gf are their own.
_ALIASES = {
    **dict.fromkeys(("lin_rec709", "lin_srgb", "linear", "linear rec.709 (srgb)"), "lin_rec709_scene"),
    **dict.fromkeys(("srgb", "srgb_texture", "srgb_rec709_display", "srgb - texture"), "srgb_rec709_scene"),
    **dict.fromkeys(("srgb encoded rec.709 (srgb)", "utility - srgb - texture"), "srgb_rec709_scene"),
    **dict.fromkeys(("g18_rec709", "gamma18"), "g18_rec709_scene"),
    **dict.fromkeys(("g22_rec709", "gamma22", "gamma 2.2 rec.709 - texture"), "g22_rec709_scene"),
    **dict.fromkeys(("g24_rec709", "gamma24", "gamma 2.4 rec.709 - texture"), "g24_rec709_scene"),
    **dict.fromkeys(("acescg", "lin_ap1", "aces - acescg"), "lin_ap1_scene"),
    **dict.fromkeys(("aces2065-1", "lin_ap0", "aces - aces2065-1"), "lin_ap0_scene"),
    **dict.fromkeys(("g22_ap1", "gamma 2.2 ap1 - texture"), "g22_ap1_scene"),
    **dict.fromkeys(("srgb_ap1", "srgb encoded ap1 - texture"), "srgb_ap1_scene"),
    **dict.fromkeys(("lin_rec2020", "linear rec.2020"), "lin_rec2020_scene"),
    **dict.fromkeys(("lin_displayp3", "lin_p3d65", "linear p3-d65"), "lin_p3d65_scene"),
    **dict.fromkeys(("srgb_displayp3", "srgb_p3d65", "srgb encoded p3-d65 - texture"), "srgb_p3d65_scene"),
    **dict.fromkeys(("adobergb", "g22_adobergb"), "g22_adobergb_scene"),
    **dict.fromkeys(("lin_adobergb", "linear adobergb"), "lin_adobergb_scene"),
    "lin_ciexyzd65": "lin_ciexyzd65_scene",
    **dict.fromkeys(("none", "utility - raw"), "raw"),
}


@dataclass(frozen=True)
class ColorSpace:
    """How the numbers of a colour become linear Rec. 709."""

    gamma: float
    bias: float
    """Of the curve ((v + bias) / (1 + bias))^gamma; near 0, where bias is above 0, its tangent through the origin."""
    matrix: tuple[tuple[float, float, float], ...]
    """From linear light to linear Rec. 709, acting on columns."""

    @property
    def is_linear_rec709(self) -> bool:
        """Whether nothing has to be done."""
        return self.gamma == 1.0 and self.has_rec709_primaries

    @property
    def is_srgb(self) -> bool:
        """Whether it is Rec. 709 by the sRGB curve, which textures are decoded by as they are read."""
        return (self.gamma, self.bias) == _SRGB_CURVE and self.has_rec709_primaries

    @property
    def has_rec709_primaries(self) -> bool:
        """Whether its primaries and its white are Rec. 709's."""
        return np.allclose(self.matrix, np.eye(3), atol=1e-6)

    def to_linear(self, colors: np.ndarray) -> np.ndarray:
        """Return colours, shape [..., 3], as linear Rec. 709; negative values are decoded as their opposites."""
        light = np.sign(colors) * self._decode(np.abs(np.asarray(colors, np.float64)))
        return light if self.has_rec709_primaries else light @ np.array(self.matrix).T

    def _decode(self, values: np.ndarray) -> np.ndarray:
        if (self.gamma, self.bias) == _SRGB_CURVE:
            return linear_from_srgb(values)
        if self.gamma == 1.0:
            return values
        power = ((values + self.bias) / (1 + self.bias)) ** self.gamma
        knee, slope = self.foot
        return np.where(values < knee, values * slope, power) if knee > 0.0 else power

    @property
    def foot(self) -> tuple[float, float]:
        """The value below which the curve is a straight line through the origin, and its slope; 0, 0: none."""
        if (self.gamma, self.bias) == _SRGB_CURVE:
            return _SRGB_FOOT
        if self.bias <= 0.0 or self.gamma == 1.0:
            return 0.0, 0.0
        knee = self.bias / (self.gamma - 1)
        return knee, self.gamma / (1 + self.bias) * ((knee + self.bias) / (1 + self.bias)) ** (self.gamma - 1)


@functools.cache
def color_space(name: str) -> ColorSpace | None:
    """Return the colour space of a name; None where nobody knows it."""
    key = _ALIASES.get(name.strip().lower(), name.strip().lower())
    is_known = key != Gf.ColorSpaceNames.Unknown and Gf.ColorSpace.IsValid(key)
    return _described(Gf.ColorSpace(key)) if is_known else None


def color_space_of(attribute: Usd.Attribute, report: Report) -> ColorSpace | None:
    """Return the space of a colour: what its ``colorSpace`` says, else the nearest ColorSpaceAPI above.

    None where it is linear Rec. 709, where nobody says, where it is no colour, or, with a diagnostic, where the space
    is not known.
    """
    name = ""
    if get_value_type(attribute).role == _COLOR:
        name = str(Usd.ColorSpaceAPI.ComputeColorSpaceName(attribute, None))
    if not name or name == "auto":
        return None
    space = color_space(name)
    if space is None:
        defined = Usd.ColorSpaceAPI.ComputeColorSpace(attribute, None)
        space = _described(defined) if str(defined.GetName()) == name else None
    if space is None:
        message = f"the colour space {name!r} of a colour is not known; read as linear Rec. 709"
        report.warn(UNKNOWN_COLOR_SPACE, attribute.GetPath(), message)
        return None
    return None if space.is_linear_rec709 else space


def _described(space: Gf.ColorSpace) -> ColorSpace:
    identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    if space.IsData():
        return ColorSpace(1.0, 0.0, identity)
    # Curves leave 0 and 1 where they are, so that these are the columns of the matrix.
    columns = [_LINEAR.Convert(space, Gf.Vec3f(*unit)).GetRGB() for unit in identity]
    rows = tuple((float(a), float(b), float(c)) for a, b, c in zip(*columns, strict=True))
    return ColorSpace(round(float(space.GetGamma()), 6), round(float(space.GetLinearBias()), 6), rows)
