# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pictures that are mostly brighter than white, or all dark, are told, with the exposure that shows them."""

from types import SimpleNamespace

import numpy as np
import pytest

from warp_rt.cli.brightness import brightness_note
from warp_rt.image.image import Image


def _image(light, *, alpha=1.0, exposure=0.0):
    """One row: each pixel of a grey light, before a column that nothing covers."""
    color = alpha * np.repeat(np.array([*light, 0.0])[:, None], 3, axis=1)[None].astype(np.float32)
    covered = np.array([[*(alpha for _ in light), 0.0]], np.float32)
    film = SimpleNamespace(aovs={"color": color, "alpha": covered}, facts={"source": "lit.usda"})
    return Image(film, exposure=exposure)


@pytest.mark.parametrize("alpha", [1.0, 0.25])
def test_a_picture_that_is_white_all_over_is_told_once_exposed(alpha):
    light = [600.0, 2000.0, 1500.0]
    (note,) = brightness_note(_image(light, alpha=alpha))
    assert (note.code, note.prim) == ("N940", "lit.usda")
    assert "100 % of" in note.message
    assert "--exposure -11 " in note.message
    assert 2000.0 * 2.0**-11 <= 1.0 < 2000.0 * 2.0**-10
    assert brightness_note(_image(light, alpha=alpha, exposure=-11.0)) == ()


def test_half_of_a_picture_white_itself_and_one_colour_too_bright_are_no_clipping():
    assert brightness_note(_image([5.0, 0.5])) == ()
    assert brightness_note(_image([1.0, 1.0])) == ()
    assert brightness_note(_image([])) == ()
    red = _image([5.0, 5.0])
    red.film.aovs["color"][..., 1:] = 0.1
    assert brightness_note(red) == ()


def test_what_is_exposed_beyond_white_is_told_too():
    (note,) = brightness_note(_image([0.5, 0.5], exposure=3.0))
    assert "--exposure 1 " in note.message


def test_a_picture_that_is_dark_all_over_is_told():
    light = [0.002, 0.002, 0.002]
    (note,) = brightness_note(_image(light, alpha=0.5))
    assert (note.code, note.prim) == ("N945", "lit.usda")
    assert "100 % of" in note.message
    assert "--exposure 8 " in note.message
    assert 0.002 * 2.0**8 <= 1.0 < 0.002 * 2.0**9
    assert brightness_note(_image(light, exposure=8.0)) == ()
    (note,) = brightness_note(_image([0.5, 0.5], exposure=-8.0))
    assert "--exposure 1 would" in note.message


def test_black_that_no_exposure_shows_is_told_as_such():
    (note,) = brightness_note(_image([0.0, 0.0]))
    assert (note.code, "no light reaches it" in note.message) == ("N945", True)


def test_one_pixel_in_fifty_that_is_seen_is_enough():
    assert brightness_note(_image([0.0] * 49 + [0.2])) == ()
    assert brightness_note(_image([0.006, 0.006])) == ()  # 17 of 255
