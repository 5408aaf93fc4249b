# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Costs as pictures: colours, and a bar that says what they mean."""

from __future__ import annotations

import math

import numpy as np
from PIL import Image as PillowImage
from PIL import ImageDraw

from warp_rt.image.color_map import cubehelix
from warp_rt.image.lettering import FAINT_INK, INK, PAPER, shortened, typeface

TITLES = {
    "nodesVisited": "Nodes visited a pixel",
    "triangleTests": "Triangle tests a pixel",
    "treeSize": "Nodes of a pixel's ray tree",
    "deepest": "Deepest level of a pixel's ray tree",
    "rays": "Rays a pixel",
}

_WITHIN = 99.5  # percentile that the bar covers at least, of the pixels that cost more than the cheapest, often the sky
_OUTLIER = 2.0  # times that percentile: more would leave the rest dark
_MOST_STEPS = 8
_LEAST_SIDE = 320  # smaller pictures are enlarged, by whole pixels
_LEAST_BAR = 200
_MARGIN, _GAP, _LEADING = 28, 20, 8
_BAR, _TICK = 22, 6  # width of the bar, length of its ticks
_TITLE, _BODY = 22, 16  # sizes of type


def scale_of(values: np.ndarray) -> tuple[int, int]:
    """Return where a bar for counts, any shape, ends and the step between its ticks: 1, 2 or 5 times a power of ten."""
    largest = int(values.max())
    dear = values[values > values.min()]
    usual = math.ceil(np.percentile(dear, _WITHIN)) if dear.size else largest
    high = max(1, largest if largest <= _OUTLIER * usual else usual)
    steps = (factor * 10**power for power in range(10) for factor in (1, 2, 5))
    step = next(step for step in steps if high <= _MOST_STEPS * step)
    return step * math.ceil(high / step), step


def cost_map(aov: str, values: np.ndarray, *, samples: int = 1) -> np.ndarray:
    """Return a picture of costs with its colour bar: display values, uint8, shape [height, width, 3].

    The bar begins at 0. Where it ends below the largest cost, its last number has a plus sign.

    Args:
        aov: A key of ``TITLES``.
        values: Counts, shape [height, width], row 0 on top.
        samples: Samples a pixel that were taken.
    """
    top, step = scale_of(values)
    factor = max(1, math.ceil(_LEAST_SIDE / max(values.shape)))
    picture = PillowImage.fromarray(cubehelix(values / top).repeat(factor, axis=0).repeat(factor, axis=1), "RGB")
    largest = int(values.max())
    ticks = {value: f"{value:,}{'+' * (value == top < largest)}" for value in range(0, top + 1, step)}
    bar = max(picture.height, _LEAST_BAR)
    label = math.ceil(max(typeface(_BODY).getlength(text) for text in ticks.values()))
    width = max(picture.width, _LEAST_SIDE) + _GAP + _BAR + 2 * _TICK + label
    head = _TITLE + _LEADING + _BODY + _GAP
    sheet = PillowImage.new("RGB", (width + 2 * _MARGIN, head + bar + 2 * _MARGIN), PAPER)
    draw = ImageDraw.Draw(sheet)
    told = f"mean {values.mean():,.4g}, largest {largest:,}" + (f", {samples:,} samples a pixel" if samples > 1 else "")
    draw.text((_MARGIN, _MARGIN), shortened(TITLES[aov], _TITLE, width), font=typeface(_TITLE), fill=INK)
    draw.text(
        (_MARGIN, _MARGIN + _TITLE + _LEADING), shortened(told, _BODY, width), font=typeface(_BODY), fill=FAINT_INK
    )
    y = _MARGIN + head
    sheet.paste(picture, (_MARGIN, y))
    _draw_bar(sheet, draw, (_MARGIN + width - label - 2 * _TICK - _BAR, y), bar, ticks, top)
    return np.asarray(sheet)


def _draw_bar(
    sheet: PillowImage.Image,
    draw: ImageDraw.ImageDraw,
    at: tuple[int, int],
    height: int,
    ticks: dict[int, str],
    top: int,
) -> None:
    """Draw the bar, its greatest value on top, with its ticks and their numbers at its right."""
    x, y = at
    ramp = cubehelix(np.linspace(1.0, 0.0, height))
    sheet.paste(PillowImage.fromarray(ramp[:, None].repeat(_BAR, axis=1), "RGB"), at)
    for value, text in ticks.items():
        level = y + round((1.0 - value / top) * (height - 1))
        draw.line([(x + _BAR, level), (x + _BAR + _TICK - 1, level)], fill=INK)
        draw.text((x + _BAR + 2 * _TICK, level), text, font=typeface(_BODY), fill=INK, anchor="lm")
