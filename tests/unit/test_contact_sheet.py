# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Contact sheets: every picture is there, in order, none covers another, and captions stay in their columns."""

import numpy as np
import pytest

from warp_rt.image.contact_sheet import LARGEST, Caption, Cell, contact_sheet
from warp_rt.image.lettering import INK, PAPER, legible, shortened, typeface

COLORS = [(200, 30, 30), (30, 200, 30), (30, 30, 200), (200, 200, 30), (30, 200, 200), (200, 30, 200), (90, 150, 60)]


def flat(color, width=330, height=200):
    return np.full((height, width, 3), color, np.uint8)


def place_of(sheet, color):
    """Return left, top, right, bottom of the pixels of a colour, which have to fill that rectangle."""
    here = (sheet == np.uint8(color)).all(axis=-1)
    rows, columns = np.flatnonzero(here.any(axis=1)), np.flatnonzero(here.any(axis=0))
    box = columns[0], rows[0], columns[-1] + 1, rows[-1] + 1
    assert here.sum() == (box[2] - box[0]) * (box[3] - box[1])
    return box


@pytest.mark.parametrize("count", range(1, 8))
def test_pictures_follow_each_other_line_by_line(count):
    columns = [[Cell(flat(color), Caption(f"Depth {i}", "1 ray", "words"))] for i, color in enumerate(COLORS[:count])]
    sheet = contact_sheet("scene.usda", "facts", columns)
    boxes = [place_of(sheet, color) for color in COLORS[:count]]
    assert all((right - left, bottom - top) == (330, 200) for left, top, right, bottom in boxes)
    assert sorted(boxes, key=lambda box: (box[1], box[0])) == boxes
    assert len(set(boxes)) == count


@pytest.mark.parametrize(
    ("size", "shown"),
    [((960, 540), (480, 270)), ((100, 60), (400, 240)), ((200, 1000), (96, 480)), ((1, 1), (320, 320))],
)
def test_size_of_pictures(size, shown):
    sheet = contact_sheet("", "", [[Cell(flat(COLORS[0], *size), Caption())]])
    left, top, right, bottom = place_of(sheet, COLORS[0])
    assert (right - left, bottom - top) == shown
    assert max(shown) <= LARGEST


def test_cells_of_a_column_stand_below_each_other():
    upper, lower = Cell(flat(COLORS[0]), Caption("A", "1")), Cell(flat(COLORS[1]), Caption("B"))
    other, none = Cell(flat(COLORS[2]), Caption("C")), Cell(None, Caption(body="D"))
    sheet = contact_sheet("", "", [[upper, lower], [other, none]])
    above, below = place_of(sheet, COLORS[0]), place_of(sheet, COLORS[1])
    assert (above[0], above[2]) == (below[0], below[2])
    assert above[3] < below[1]


def test_long_words_stay_in_their_column():
    """Two pictures apart, between them nothing but paper."""
    endless = Caption("depth " * 50, "123,456 rays", "words " * 100)
    sheet = contact_sheet("name " * 500, "facts " * 500, [[Cell(flat(color), endless)] for color in COLORS[:2]])
    first, second = (place_of(sheet, color) for color in COLORS[:2])
    assert first[1] == second[1]
    assert (sheet[first[1] :, first[2] : second[0]] == PAPER).all()
    assert (sheet[:, second[2] :] == PAPER).all()


def test_captions_are_written():
    sheet = contact_sheet("", "", [[Cell(flat(COLORS[0]), Caption("Depth 1", "7 rays"))]])
    left, _, right, bottom = place_of(sheet, COLORS[0])
    inked = (sheet[bottom:] == np.uint8(INK)).all(axis=-1).any(axis=0)
    assert inked[left : left + 40].any()  # the title begins with the picture
    assert inked[right - 10 : right].any()  # the figure ends with it
    assert not inked[:left].any()
    assert not inked[right:].any()


def test_ink_can_be_read_on_the_paper():
    """WCAG 2.2, success criterion 1.4.6: a contrast of 7 : 1."""
    from warp_rt.image.lettering import FAINT_INK
    from warp_rt.srgb import linear_from_srgb

    def luminance(tone):
        return linear_from_srgb(np.array(tone) / 255) @ (0.2126, 0.7152, 0.0722) + 0.05

    assert luminance(FAINT_INK) / luminance(PAPER) >= 7


def test_letters_that_are_not_there_are_asked_about():
    assert legible("Küche-雪 1") == "K?che-? 1"


def test_shortened_text_fits():
    assert shortened("short", 20, 1000) == "short"
    text = "a long line of words"
    kept = shortened(text, 20, 80).removesuffix("...")
    assert text.startswith(kept)
    assert typeface(20).getlength(kept + "...") <= 80 < typeface(20).getlength(text[: len(kept) + 1] + "...")
    assert shortened(text, 20, 1) == "..."
