# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sizes of what uneven scales make of round lights."""

from __future__ import annotations

import math

# Thomsen's exponent for the area of an ellipsoid, within 1.2 % of the true area; UsdLux's reference has it, too.
_THOMSEN = 1.6


def ellipsoid_area(a: float, b: float, c: float) -> float:
    """Return the area of an ellipsoid of half axes a, b, c, by Thomsen's formula."""
    mean = ((a * b) ** _THOMSEN + (a * c) ** _THOMSEN + (b * c) ** _THOMSEN) / 3
    return 4 * math.pi * mean ** (1 / _THOMSEN)


def ellipse_circumference(a: float, b: float) -> float:
    """Return the circumference of an ellipse of half axes a, b.

    Reference: Ramanujan (1914), Modular Equations and Approximations to pi, the first of two formulas.
    """
    return math.pi * (3 * (a + b) - math.sqrt((3 * a + b) * (a + 3 * b)))
