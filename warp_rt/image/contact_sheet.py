# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Contact sheets: pictures side by side with their captions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image as PillowImage
from PIL import ImageDraw

from warp_rt.image.lettering import FAINT_INK, INK, PAPER, Tone, legible, shortened, typeface

LARGEST = 480
"""Longest side of a picture on the sheet [pixel]; larger ones are reduced."""
_SMALLEST = 320  # shorter ones are enlarged, by whole pixels
_LEAST_COLUMN = 320  # room for a caption
_ASPECT = 4 / 3  # of the sheet, as near as may be
_MARGIN, _GAP, _LEADING = 40, 28, 9
_HEADLINE, _TITLE, _BODY = 34, 22, 16  # sizes of type


@dataclass(frozen=True)
class Caption:
    """What stands below a picture."""

    title: str = ""
    figure: str = ""
    """On the title's line, at the right."""
    body: str = ""
    """On the next line; so too ``body_figure``, at the right."""
    body_figure: str = ""


@dataclass(frozen=True)
class Cell:
    """A picture with its caption."""

    picture: np.ndarray | None
    """Display values, uint8, shape [height, width, 3], all of one size; None: the caption's body takes its place."""
    caption: Caption


def contact_sheet(headline: str, subline: str, columns: Sequence[Sequence[Cell]]) -> np.ndarray:
    """Return a sheet as display values: uint8, shape [height, width, 3].

    Args:
        headline: On top.
        subline: Below it.
        columns: Cells that belong one below the other. The columns follow each other from left to right, in as many
            lines as make the sheet about 4 : 3.
    """
    size = _size_on_sheet(next(cell.picture.shape for column in columns for cell in column if cell.picture is not None))
    width = max(size[0], _LEAST_COLUMN)
    heights = [size[1] + _caption_height([column[row] for column in columns]) for row in range(len(columns[0]))]
    band = sum(heights) + _GAP * (len(heights) + 1)  # cells of a column stand nearer to each other than columns
    head = _HEADLINE + _BODY + 2 * _LEADING + _GAP
    across = _columns_across(len(columns), width + _GAP, band, head)
    down = math.ceil(len(columns) / across)
    sheet = PillowImage.new(
        "RGB", (across * (width + _GAP) - _GAP + 2 * _MARGIN, head + down * band - 2 * _GAP + 2 * _MARGIN), PAPER
    )
    draw = ImageDraw.Draw(sheet)
    inner = sheet.width - 2 * _MARGIN
    _write(draw, (_MARGIN, _MARGIN), headline, _HEADLINE, inner)
    _write(draw, (_MARGIN, _MARGIN + _HEADLINE + _LEADING), subline, _BODY, inner, FAINT_INK)
    for index, column in enumerate(columns):
        x = _MARGIN + index % across * (width + _GAP)
        y = _MARGIN + head + index // across * band
        for cell, height in zip(column, heights, strict=True):
            if cell.picture is not None:
                sheet.paste(_resized(cell.picture, size), (x, y))
                _caption(draw, (x, y + size[1] + _LEADING), width, cell.caption)
            else:
                _paragraph(draw, (x, y), width, cell.caption.body)
            y += height + _GAP
    return np.asarray(sheet)


def _size_on_sheet(shape: tuple[int, ...]) -> tuple[int, int]:
    """Return the width and height [pixel] that a picture gets."""
    height, width = shape[:2]
    longest = max(width, height)
    if longest > LARGEST:
        return max(1, round(width * LARGEST / longest)), max(1, round(height * LARGEST / longest))
    factor = max(1, math.ceil(_SMALLEST / longest))
    return width * factor, height * factor


def _resized(picture: np.ndarray, size: tuple[int, int]) -> PillowImage.Image:
    is_smaller = size[0] < picture.shape[1]
    method = PillowImage.Resampling.LANCZOS if is_smaller else PillowImage.Resampling.NEAREST
    return PillowImage.fromarray(np.ascontiguousarray(picture), "RGB").resize(size, method)


def _columns_across(count: int, width: float, height: float, head: float) -> int:
    """Return how many columns stand side by side; among equally good shapes, that with the fewest empty places."""

    def cost(across: int) -> float:
        down = math.ceil(count / across)
        misshape = abs(math.log(across * width / (down * height + head) / _ASPECT))
        return misshape + (across * down - count) / count

    return min(range(1, count + 1), key=cost)


def _caption_height(cells: Sequence[Cell]) -> int:
    captions = [cell.caption for cell in cells if cell.picture is not None]
    has_body = any(caption.body for caption in captions)
    return _LEADING + _TITLE + has_body * (_LEADING + _BODY)


def _caption(draw: ImageDraw.ImageDraw, at: tuple[int, int], width: int, caption: Caption) -> None:
    x, y = at
    _two_sides(draw, (x, y), width, (caption.title, caption.figure), _TITLE, INK)
    _two_sides(draw, (x, y + _TITLE + _LEADING), width, (caption.body, caption.body_figure), _BODY, FAINT_INK)


def _two_sides(
    draw: ImageDraw.ImageDraw, at: tuple[int, int], width: int, texts: tuple[str, str], size: int, ink: Tone
) -> None:
    """Write a text flush left, shortened as need be, and another flush right."""
    left, right = texts
    taken = typeface(size).getlength(right)
    _write(draw, at, left, size, width - taken - _LEADING, ink)
    draw.text((at[0] + width - taken, at[1]), right, font=typeface(size), fill=ink)


def _paragraph(draw: ImageDraw.ImageDraw, at: tuple[int, int], width: int, text: str) -> None:
    """Write a text on as many lines as it takes."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".lstrip()
        if typeface(_BODY).getlength(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    for index, line in enumerate(lines):
        _write(draw, (at[0], at[1] + index * (_BODY + _LEADING)), line, _BODY, width, FAINT_INK)


def _write(
    draw: ImageDraw.ImageDraw,
    at: tuple[float, float],
    text: str,
    size: int,
    width: float,
    ink: Tone = INK,
) -> None:
    draw.text(at, shortened(legible(text), size, width), font=typeface(size), fill=ink)
