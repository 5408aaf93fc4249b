# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How linear values are to be shown: the choices there are, known without loading NumPy."""

from __future__ import annotations

from numbers import Real

from warp_rt.errors import OptionError

TONE_MAPS = ("srgb", "raw")
"""``srgb``: the sRGB curve. ``raw``: linear values as they are, for data and for measuring."""

MAX_EXPOSURE = 100.0
"""Stops up and down; float32 itself spans 253."""


def check_display(exposure: float, tonemap: str) -> None:
    """Return if pictures can be shown so.

    Raises:
        OptionError: The exposure is no number or out of range, or the tone map unknown.
    """
    if not isinstance(exposure, Real) or isinstance(exposure, bool):
        raise OptionError(f"exposure: a number expected, got {exposure!r}")
    if not -MAX_EXPOSURE <= exposure <= MAX_EXPOSURE:
        raise OptionError(f"exposure: {exposure} is outside -{MAX_EXPOSURE:g}..{MAX_EXPOSURE:g} stops")
    if tonemap not in TONE_MAPS:
        raise OptionError(f"tonemap: {tonemap!r} is none of {', '.join(TONE_MAPS)}")
