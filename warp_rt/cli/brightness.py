# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Whether a picture for display is mostly white or black all over, being too bright or too dark for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from warp_rt.image.color import unpremultiply
from warp_rt.report import Diagnostic

if TYPE_CHECKING:
    from warp_rt.image.image import Image

_MOST_WHITE = 0.5  # share of the covered pixels above which it is told that they are white
_MOST_BLACK = 0.99  # likewise; a lamp that is seen in the dark is not enough
_ROUNDING = 1e-3  # above white, where what is white under a light of 1 may come out in float32
_DARK = 0.005  # of white, 16 of 255 by the sRGB curve: in a lit room a screen shows little of it
_KEPT = 95  # per cent of the covered pixels that the proposed exposure brings to white or below


def brightness_note(image: Image) -> tuple[Diagnostic, ...]:
    """Return the note that a picture is mostly clipped to white or black all over, and what would show it.

    None is returned as an empty tuple.

    Args:
        image: As it is exposed for display; a pixel is clipped to white where all its channels are above 1, and black
            where none is above 16 of 255.
    """
    is_covered = image.alpha > 0
    light = unpremultiply(image.linear, image.alpha)[is_covered].astype(np.float64) * 2.0**image.exposure
    is_white = (light > 1 + _ROUNDING).all(axis=1)
    is_dark = (light <= _DARK).all(axis=1)
    if is_white.sum() > _MOST_WHITE * len(light):
        code, share, what = "N940", is_white.mean(), "is brighter than white and clipped"
    elif is_dark.sum() > _MOST_BLACK * len(light):
        code, share, what = "N945", is_dark.mean(), "is black, or nearly so"
    else:
        return ()
    level = float(np.nanpercentile(light.max(axis=1), _KEPT))
    if not math.isfinite(level):
        return ()
    stops = image.exposure - math.ceil(math.log2(level)) if level > 0 else None
    advice = "no light reaches it" if stops is None else f"--exposure {stops:g} would show it"
    seen = str(image.film.facts.get("source", "scene"))
    return (Diagnostic(code, seen, f"{100 * share:.0f} % of what the picture covers {what}; {advice}"),)
