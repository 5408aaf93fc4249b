# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Words in pictures: the typeface that Pillow brings along, and the neutral tones that captions stand in."""

from __future__ import annotations

import bisect
import functools

from PIL import ImageFont
from PIL.ImageFont import FreeTypeFont

Tone = tuple[int, int, int]

PAPER: Tone = (30, 30, 30)
"""Behind everything: dark enough for pictures to glow, a neutral grey, so that it tints none of them."""
INK: Tone = (236, 236, 236)
FAINT_INK: Tone = (168, 168, 168)
"""For what is read second; 7 : 1 against the paper."""


@functools.cache
def typeface(size: int) -> FreeTypeFont:
    """Return the typeface, which is always there, at a size [pixel]."""
    font = ImageFont.load_default(size)
    assert isinstance(font, FreeTypeFont)  # whenever a size is given
    return font


def legible(text: str) -> str:
    """Return a text with a question mark for every letter that the typeface lacks: it has ASCII."""
    return "".join(letter if " " <= letter <= "~" else "?" for letter in text)


def shortened(text: str, size: int, width: float) -> str:
    """Return a text, or its beginning and three dots where it is wider than ``width`` pixels."""
    font = typeface(size)
    if font.getlength(text) <= width:
        return text
    too_many = bisect.bisect_right(range(len(text)), width, key=lambda count: font.getlength(text[:count] + "..."))
    return text[: max(too_many - 1, 0)] + "..."
