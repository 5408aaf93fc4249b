# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Numbers as people read them: four digits that count, a grey as one number."""

from __future__ import annotations

import math
from collections.abc import Sequence

DIGITS = 4


def number(value: float, digits: int = DIGITS) -> str:
    """Return a number with so many significant digits."""
    if value == 0:
        return "0"
    if math.isinf(value):
        return "-inf" if value < 0 else "inf"
    return f"{value:.{digits}g}"


def color(values: Sequence[float], digits: int = DIGITS) -> str:
    """Return a colour's three numbers, or one where they read the same."""
    texts = [number(value, digits) for value in values]
    return texts[0] if len(set(texts)) == 1 else " ".join(texts)


def point(values: Sequence[float]) -> str:
    """Return a point or a direction."""
    return "(" + ", ".join(number(value) for value in values) + ")"


def percent(share: float | None) -> str:
    """Return a share as ``12 %``, or nothing where there is none to tell."""
    if share is None:
        return ""
    if share != 0 and abs(share) < 0.0005:
        return "< 0.1 %"
    return f"{100 * share:.1f} %" if abs(share) < 0.1 else f"{100 * share:.0f} %"
