# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Whether a picture for display is mostly white because what it shows is brighter than white."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from warp_rt.image.color import unpremultiply
from warp_rt.report import Diagnostic

if TYPE_CHECKING:
    from warp_rt.image.image import Image

_MOST = 0.5  # share of the covered pixels above which it is told that they are white
_ROUNDING = 1e-3  # above white, where what is white under a light of 1 may come out in float32
_KEPT = 95  # per cent of the covered pixels that the proposed exposure brings to white or below


def clipping_note(image: Image) -> tuple[Diagnostic, ...]:
    """Return the note that more than half of what a picture covers is clipped to white, and what would show it.

    None is returned as an empty tuple.

    Args:
        image: As it is exposed for display; a pixel is clipped to white where all its channels are above 1.
    """
    is_covered = image.alpha > 0
    light = unpremultiply(image.linear, image.alpha)[is_covered].astype(np.float64) * 2.0**image.exposure
    is_white = (light > 1 + _ROUNDING).all(axis=1)
    if not is_white.sum() > _MOST * len(light):
        return ()
    level = float(np.nanpercentile(light.max(axis=1), _KEPT))
    if not math.isfinite(level):
        return ()
    stops = image.exposure - math.ceil(math.log2(level))
    seen = str(image.film.facts.get("source", "scene"))
    share = f"{100 * is_white.mean():.0f} % of what the picture covers"
    message = f"{share} is brighter than white and clipped; --exposure {stops:g} would show it"
    return (Diagnostic("N940", seen, message),)
