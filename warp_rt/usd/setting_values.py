# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What values of render settings mean; a ValueError says why one means nothing."""

from __future__ import annotations

from typing import Any

from pxr import Usd, Vt

from warp_rt.options import MAX_SIZE
from warp_rt.usd.attribute_values import numbers, shown

POLICIES = (
    "expandAperture",
    "cropAperture",
    "adjustApertureWidth",
    "adjustApertureHeight",
    "adjustPixelAspectRatio",
)
"""What gives way where image and camera differ in aspect; the first unless it is said."""

_LEAST_RATIO = 1e-6  # of a pixel's sides, and the inverse of the greatest: what OpenEXR's headers take


def steady_value(attribute: Usd.Attribute) -> Any:
    """Return the value at the default time, or the earliest."""
    # Where only samples are authored, Get() returns the schema's fallback.
    is_default = attribute.GetResolveInfo(Usd.TimeCode.Default()).GetSource() == Usd.ResolveInfoSourceDefault
    return attribute.Get(Usd.TimeCode.Default() if is_default else Usd.TimeCode.EarliestTime())


def numbers_of(value: Any, count: int) -> tuple[float, ...]:
    """Return so many finite numbers."""
    found = numbers(value)
    if found is None or len(found) != count:
        raise ValueError(f"not {count} finite number{'s' if count > 1 else ''}")
    return found


def whole_number_of(value: Any, low: int, high: int) -> int:
    """Return a whole number within bounds."""
    (found,) = numbers_of(value, 1)
    if low <= found <= high and found == int(found):
        return int(found)
    raise ValueError(f"{found:g} is no whole number from {low} to {high}")


def resolution_of(value: Any) -> tuple[int, int]:
    """Return width and height [pixel]."""
    width, height = numbers_of(value, 2)
    if all(1 <= side <= MAX_SIZE and side == int(side) for side in (width, height)):
        return int(width), int(height)
    raise ValueError(f"{width:g} x {height:g} are no whole numbers from 1 to {MAX_SIZE}")


def pixel_aspect_ratio_of(value: Any) -> float:
    """Return width by height of a pixel."""
    (found,) = numbers_of(value, 1)
    if _LEAST_RATIO <= found <= 1 / _LEAST_RATIO:
        return found
    raise ValueError(f"{found:g} is not from {_LEAST_RATIO:g} to {1 / _LEAST_RATIO:g}")


def policy_of(value: Any) -> str:
    """Return UsdRender's aspectRatioConformPolicy."""
    if value in POLICIES:
        return str(value)
    raise ValueError(f"{shown(value)} is unknown")


def color_of(value: Any) -> tuple[float, float, float]:
    """Return a colour."""
    red, green, blue = numbers_of(value, 3)
    return red, green, blue


def threshold_of(value: Any) -> float:
    """Return the weight below which the ray tree ends."""
    (found,) = numbers_of(value, 1)
    if found >= 0:
        return found
    raise ValueError(f"{found:g} is below 0")


def data_window_of(value: Any) -> tuple[float, float, float, float]:
    """Return left, bottom, right and top, as shares of the picture's sides."""
    left, bottom, right, top = numbers_of(value, 4)
    if left < right and bottom < top:
        return left, bottom, right, top
    raise ValueError("a window without area")


def purposes_of(value: Any) -> tuple[str, ...]:
    """Return the tokens of an array that has some."""
    if not isinstance(value, Vt.TokenArray | Vt.StringArray):
        raise ValueError(f"{shown(value)} is no array of tokens")
    if not value:
        raise ValueError("names no purpose")
    return tuple(str(token) for token in value)
