# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Typed, finite values of USD attributes: a value of another kind is told, and the schema's fallback used."""

from __future__ import annotations

import math
import reprlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from pxr import Sdf, Usd

from warp_rt.report import Report
from warp_rt.usd.color_spaces import color_space_of

# A matrix, the largest value that any input holds, has 16 numbers; arrays are never read through here.
_MAX_NUMBERS = 16


def numbers(value: Any) -> tuple[float, ...] | None:
    """Return a scalar, vector or matrix as a flat tuple; None if it is anything else or not finite."""
    rows = value if _is_sequence(value) else (value,)
    flat: list[float] = []
    for row in rows:
        if isinstance(row, str):  # which float() would parse
            return None
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


def how_many(counts: Sequence[int]) -> str:
    """Return what a diagnostic calls so many finite numbers, or as many as one of the counts."""
    return "a finite number" if list(counts) == [1] else f"{' or '.join(map(str, counts))} finite numbers"


def shown(value: Any) -> str:
    """Return a value of any type as a diagnostic names it: one short line."""
    return " ".join(reprlib.repr(value).split())


class AttributeReader:
    """Reads one prim's attributes.

    A value of the wrong kind, or a number that is not finite, gives a diagnostic, and counts as the schema's fallback.

    Args:
        prim: Whose attributes.
        time: When.
        code: Of the diagnostics.
        report: Takes them.
    """

    def __init__(self, prim: Usd.Prim, time: Usd.TimeCode, code: str, report: Report) -> None:
        self._prim = prim
        self._time = time
        self._code = code
        self._report = report

    def value(self, name: str) -> Any:
        """Return the value of any type, the schema's fallback included; None where there is none."""
        attribute = self._prim.GetAttribute(name)
        return attribute.Get(self._time) if attribute else None

    def number(self, name: str, default: float) -> float:
        """Return a number; ``default`` where neither stage nor schema has one."""
        return self.vector(name, (default,))[0]

    def within(self, name: str, default: float, low: float, high: float, code: str) -> float:
        """Return a number from ``low`` to ``high``: the nearest one, with a diagnostic, for one out of that range."""
        number = self.number(name, default)
        nearest = min(max(number, low), high)
        if nearest != number:
            message = f"{name} is {number:g}, out of its range; taken as {nearest:g}"
            self._report.warn(code, self._prim.GetPath(), message)
        return nearest

    def truth(self, name: str, default: bool) -> bool:
        """Return a truth value, for which a number may stand; ``default`` where neither stage nor schema has one."""
        return bool(self.number(name, float(default)))

    def vector(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return as many numbers as ``default`` has; that itself where neither stage nor schema has a value."""
        value = self.value(name)
        found = numbers(value)
        if found is not None and len(found) == len(default):
            return found
        fallback = numbers(self._fallback(name)) or default
        if value is None:
            return fallback
        instead = ", ".join(f"{number:g}" for number in fallback)
        self._replace(name, value, f"not {how_many([len(default)])}", instead)
        return fallback

    def color(self, name: str, default: tuple[float, float, float]) -> tuple[float, ...]:
        """Return a colour as linear Rec. 709; ``default`` where neither stage nor schema has a value."""
        found = self.vector(name, default)
        attribute = self._prim.GetAttribute(name)
        space = color_space_of(attribute, self._report) if attribute and attribute.HasAuthoredValue() else None
        return tuple(space.to_linear(np.array(found)).tolist()) if space else found

    def token(self, name: str, default: str, allowed: Sequence[str] = ()) -> str:
        """Return a token or string.

        Args:
            name: The attribute.
            default: What holds where neither stage nor schema has a value.
            allowed: The tokens that have a meaning; empty: any has.
        """
        value = self.value(name)
        if isinstance(value, str) and (not allowed or value in allowed):
            return value
        fallback = str(self._fallback(name) or default)
        if value is None:
            return fallback
        self._replace(name, value, f"none of {', '.join(allowed)}" if allowed else "not a token", fallback)
        return fallback

    def asset(self, name: str) -> Sdf.AssetPath | None:
        """Return an asset path; None where none is named."""
        value = self.value(name)
        if value is None or isinstance(value, Sdf.AssetPath):
            return value if value and value.path else None
        self._replace(name, value, "not an asset path", "no file")
        return None

    def _fallback(self, name: str) -> Any:
        return self._prim.GetPrimDefinition().GetAttributeFallbackValue(name)

    def _replace(self, name: str, value: Any, why: str, instead: str) -> None:
        self._report.warn(self._code, self._prim.GetPath(), f"{name} is {shown(value)}, {why}; {instead} is used")
