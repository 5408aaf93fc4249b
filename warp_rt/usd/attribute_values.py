# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Typed, finite values of USD attributes: a wrong type or a number that is not finite counts as absent."""

from __future__ import annotations

import math
from typing import Any

from pxr import Usd

# A matrix, the largest value that any input holds, has 16 numbers; arrays are never read through here.
_MAX_NUMBERS = 16


def numbers(value: Any) -> tuple[float, ...] | None:
    """Return a scalar, vector or matrix as a flat tuple; None if it is anything else or not finite."""
    rows = value if _is_sequence(value) else (value,)
    flat: list[float] = []
    for row in rows:
        try:
            flat.extend(float(number) for number in (row if _is_sequence(row) else (row,)))
        except (TypeError, ValueError):
            return None
        if len(flat) > _MAX_NUMBERS:
            return None
    return tuple(flat) if flat and all(map(math.isfinite, flat)) else None


def _is_sequence(value: Any) -> bool:
    # Gf's vectors and matrices are not Iterable; a string's characters are no numbers.
    return hasattr(value, "__len__") and not isinstance(value, str)


def read_value(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> Any:
    """Return the value of an attribute, the schema's fallback included; None where there is none."""
    attribute = prim.GetAttribute(name)
    return attribute.Get(time) if attribute else None


def read_float(prim: Usd.Prim, name: str, time: Usd.TimeCode, default: float) -> float:
    """Return a finite number, or ``default``."""
    found = numbers(read_value(prim, name, time))
    return found[0] if found is not None and len(found) == 1 else default


def read_vector(prim: Usd.Prim, name: str, time: Usd.TimeCode, count: int) -> tuple[float, ...] | None:
    """Return ``count`` finite numbers, or None."""
    found = numbers(read_value(prim, name, time))
    return found if found is not None and len(found) == count else None


def read_bool(prim: Usd.Prim, name: str, time: Usd.TimeCode, default: bool) -> bool:
    """Return a truth value (numbers count), or ``default``."""
    found = numbers(read_value(prim, name, time))
    return default if found is None else bool(found[0])


def read_token(prim: Usd.Prim, name: str, time: Usd.TimeCode, default: str) -> str:
    """Return a token or string, or ``default``."""
    value = read_value(prim, name, time)
    return value if isinstance(value, str) else default
