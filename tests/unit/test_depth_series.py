# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A series' figures, on films whose differences are known, and from Python on a scene."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image as PillowImage

import warp_rt
from warp_rt.errors import OptionError, OutputError
from warp_rt.image.depth_series import make_series, percent
from warp_rt.image.outputs import series_files
from warp_rt.options import check_depths
from warp_rt.scene import Camera

from ..analytic.scenes import box, looking, scene_of, whitted


class Rays:
    total = 1234


def film(color, **facts):
    color = np.float32(color)
    return SimpleNamespace(
        aovs={"color": color, "alpha": np.ones(color.shape[:2], np.float32)},
        prims=(),
        instance_paths=(),
        labels={},
        facts=facts,
        data_window=None,
        pixel_aspect_ratio=1.0,
        rays=Rays(),
    )


def test_first_step_has_no_change():
    (step,) = make_series([3], [film(np.zeros((2, 2, 3)))]).steps
    assert (step.depth, step.change, step.rays.total) == (3, None, 1234)


def test_change_is_counted_by_pixels_and_measured_by_channels():
    before = np.zeros((4, 5, 3))
    after = before.copy()
    after[0, 0] = (0.25, 0, 0)
    after[1, 2] = (0, -0.5, 0.125)
    after[3, 4] = (0, 0, 1e-30)
    change = make_series([1, 2], [film(before), film(after)]).steps[1].change
    assert change.share == 3 / 20
    assert change.largest == 0.5
    np.testing.assert_array_equal(change.image.linear, np.abs(np.float32(after)))


@pytest.mark.parametrize(
    ("value", "scale"), [(1.0, 1), (0.5, 2), (0.4, 2), (0.26, 2), (0.2, 4), (3.0, 0.25), (1e-38, 2**100)]
)
def test_scale_is_the_largest_power_of_two_that_stays_below_white(value, scale):
    change = make_series([1, 2], [film(np.zeros((1, 1, 3))), film([[[0, value, 0]]])]).steps[1].change
    assert change.scale == scale


def test_a_glint_does_not_darken_the_rest():
    after = np.full((10, 10, 3), 0.1)
    after[0, 0] = 50.0
    change = make_series([1, 2], [film(np.zeros((10, 10, 3))), film(after)]).steps[1].change
    assert change.scale == 8
    assert change.largest == 50.0


@pytest.mark.parametrize("color", [0.0, np.inf])
def test_changes_without_a_scale(color):
    before, after = film(np.zeros((2, 2, 3))), film(np.full((2, 2, 3), color))
    change = make_series([1, 2], [before, after]).steps[1].change
    assert (change.scale, change.largest, change.share) == (1.0, color, float(color > 0))


def test_sheet_says_where_nothing_changes(monkeypatch):
    from warp_rt.image import depth_series

    told = []
    monkeypatch.setattr(depth_series, "contact_sheet", lambda *words: told.append(words))
    same = film(np.zeros((2, 2, 3)), source="/a/scene.usda", camera="/c", spp=1, threshold=0.5)
    make_series([1, 2], [same, same]).sheet()
    headline, subline, (_, (picture, _)) = told[0]
    assert (headline, subline) == ("scene.usda", "2 x 2 pixels, 1 sample a pixel, threshold 0.5, /c")
    assert picture.caption.body == "no pixel changes"


@pytest.mark.parametrize(
    ("share", "text"),
    [
        *((0, "0.0 %"), (1, "100.0 %"), (0.4724, "47.2 %"), (0.001, "0.1 %")),
        *((0.00054, "0.054 %"), (1 / 691200, "0.00014 %")),
    ],
)
def test_shares_for_people(share, text):
    assert percent(share) == text


# --- from Python


@pytest.fixture(scope="module")
def mirrors():
    """Return a box of mirrors, seen from inside."""
    camera = Camera("/eye", looking((0.3, 0.2, -1.0)), (-1.0, 1.0, -1.0, 1.0), is_perspective=True)
    scene = scene_of(box(whitted(ambient=0.25, reflection=0.5), (-3, -2, -4), (3, 2, 4)), ambient=(1, 1, 1))
    return dataclasses.replace(scene, cameras=(camera,))


def test_series_of_a_scene(mirrors, tmp_path):
    """Depth d adds ambient Kr^(d - 1) = 2^(-1 - d), everywhere."""
    series = warp_rt.render_series(mirrors, [1, 2, 4], width=24, height=16, threshold=0.0)
    assert [step.depth for step in series.steps] == [1, 2, 4]
    assert [step.rays.total for step in series.steps] == [24 * 16 * depth for depth in (1, 2, 4)]
    assert [step.change.share for step in series.steps[1:]] == [1.0, 1.0]
    added = [step.change.largest for step in series.steps[1:]]
    assert added == pytest.approx([2.0**-3, 2.0**-4 + 2.0**-5], rel=1e-5)
    assert repr(series) == "<warp_rt.DepthSeries 24 x 16: depth 1, 2, 4>"

    files = series.save(tmp_path)
    assert sorted(path.name for path in files) == sorted(path.name for path in tmp_path.iterdir())
    assert {path.name for path in files} == {
        *("series.png", "depth_1.png", "depth_2.png", "depth_4.png", "change_2.png", "change_4.png")
    }
    with PillowImage.open(tmp_path / "series.png") as sheet:
        assert sheet.text["warp_rt:depth"] == "1, 2, 4"
        assert np.array_equal(np.asarray(sheet)[..., :3], series.sheet())
    with PillowImage.open(tmp_path / "change_4.png") as change:
        assert change.text["warp_rt:difference_from_depth"] == "2"


def test_each_picture_is_what_render_gives(mirrors):
    series = warp_rt.render_series(mirrors, [2, 3], width=8, height=8, exposure=1.0, spp=2)
    for step in series.steps:
        alone = warp_rt.render(mirrors, depth=step.depth, width=8, height=8, exposure=1.0, spp=2)
        np.testing.assert_array_equal(step.image.linear, alone.linear)
        np.testing.assert_array_equal(np.asarray(step.image), np.asarray(alone))
        assert step.image.film.facts == alone.film.facts


@pytest.mark.parametrize("depths", [[], [0, 1], [2, 1], [1, 1], [1.5], ["1"], [True], range(1, 102), [1025]])
def test_what_is_no_series(depths):
    with pytest.raises(OptionError, match=r"^depths: "):
        check_depths(list(depths))


def test_one_depth_too_many(mirrors):
    with pytest.raises(OptionError, match=r"^depth: a series has many"):
        warp_rt.render_series(mirrors, depth=3)
    with pytest.raises(OptionError, match=r"^tonemap: "):
        warp_rt.render_series(mirrors, tonemap="film")


def test_files_sort_by_depth(tmp_path):
    files = series_files(tmp_path, [1, 2, 10], "jpg")
    assert [path.name for path in files.pictures] == ["depth_01.jpg", "depth_02.jpg", "depth_10.jpg"]
    assert [path.name for path in files.changes] == ["change_02.jpg", "change_10.jpg"]
    with pytest.raises(OptionError, match="extension"):
        series_files(tmp_path, [1], "gif")


def test_a_missing_folder_is_not_made(tmp_path):
    series = make_series([1], [film(np.zeros((2, 2, 3)))])
    with pytest.raises(OutputError, match="does not exist"):
        series.save(tmp_path / "none")
