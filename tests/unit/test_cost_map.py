# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pictures of costs: colours as published, a bar that tells the truth, files with and without the colour."""

import json
from types import SimpleNamespace

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PillowImage

from warp_rt.cli.main import main
from warp_rt.errors import OptionError
from warp_rt.image.color_map import cubehelix
from warp_rt.image.cost_map import TITLES, cost_map, scale_of
from warp_rt.image.image import Image
from warp_rt.image.lettering import INK, PAPER
from warp_rt.image.outputs import planned_files
from warp_rt.options import AOVS, COSTS

LEVELS = np.linspace(0.0, 1.0, 256)


def film(**costs):
    shape = next(iter(costs.values())).shape
    color, alpha = np.full((*shape, 3), 0.5, np.float32), np.ones(shape, np.float32)
    return SimpleNamespace(
        aovs={"color": color, "alpha": alpha, **costs},
        prims=(),
        instance_paths=(),
        labels={},
        facts={"spp": 4},
        data_window=None,
        pixel_aspect_ratio=1.0,
    )


# --- colours


def test_brightness_is_the_value():
    """Green (2011), section 2: perceived intensity 0.30 R + 0.59 G + 0.11 B is lambda; ends are black and white."""
    colors = cubehelix(LEVELS)
    inside = ((colors > 0) & (colors < 255)).all(axis=1)  # where no channel was cut off
    assert inside.mean() > 0.9
    np.testing.assert_allclose((colors @ [0.30, 0.59, 0.11] / 255)[inside], LEVELS[inside], atol=0.004)
    assert colors[0].tolist() == [0, 0, 0]
    assert colors[-1].tolist() == [255, 255, 255]


def test_colors_follow_the_helix():
    """The published equation, in other words: a point at angle 2 pi (0.5 / 3 - 1.5 lambda) about the grey axis."""
    level = 0.4
    angle, amplitude = 2 * np.pi * (0.5 / 3 - 1.5 * level), level * (1 - level) / 2
    cos, sin = np.cos(angle), np.sin(angle)
    expected = [
        level + amplitude * (-0.14861 * cos + 1.78277 * sin),
        level + amplitude * (-0.29227 * cos - 0.90649 * sin),
        level + amplitude * 1.97294 * cos,
    ]
    assert cubehelix(level).tolist() == [round(255 * value) for value in expected]


def test_what_lies_outside_has_the_colour_of_the_end():
    assert cubehelix([-1.0, 2.0]).tolist() == [[0, 0, 0], [255, 255, 255]]


# --- the bar


@pytest.mark.parametrize(
    ("largest", "expected"),
    [
        *((0, (1, 1)), (1, (1, 1)), (7, (7, 1)), (8, (8, 1)), (9, (10, 2))),
        *((39, (40, 5)), (100, (100, 20)), (123456, (140000, 20000))),
    ],
)
def test_steps_are_round_numbers(largest, expected):
    assert scale_of(np.full((4, 4), largest)) == expected


def test_a_few_outliers_do_not_set_the_scale():
    values = np.full((100, 100), 60)
    values[:10] = 1
    values[20, :10] = 10_000
    assert scale_of(values)[0] == 60
    values[20, :10] = 110  # not far out
    assert scale_of(values)[0] == 120


def test_a_wide_sky_does_not_set_the_scale():
    values = np.ones((100, 100), int)
    values[50, 50:60] = np.arange(31, 41)
    assert scale_of(values) == (40, 5)


def picture_of(sheet, shape):
    """Return the part of a sheet that shows the film: it begins at the left margin, below the title."""
    return sheet[28 + 22 + 8 + 16 + 20 :][: shape[0], 28 : 28 + shape[1]]


def test_pixels_have_the_colours_of_their_counts():
    values = np.arange(400 * 330).reshape(330, 400) % 97
    sheet = cost_map("rays", values)
    top, _ = scale_of(values)
    np.testing.assert_array_equal(picture_of(sheet, values.shape), cubehelix(values / top))


def test_small_pictures_are_enlarged_by_whole_pixels():
    values = np.array([[0, 1], [2, 3], [4, 5]])
    sheet = cost_map("deepest", values)
    factor = 107  # 3 rows, at least 320 pixels
    shown = picture_of(sheet, (3 * factor, 2 * factor))
    np.testing.assert_array_equal(shown[factor // 2 :: factor, factor // 2 :: factor], cubehelix(values / 5))


def test_bar_grows_upwards_and_has_its_ticks():
    values = np.tile(np.arange(8), (400, 50))
    sheet = cost_map("deepest", values)
    first = 28 + 400 + 20  # column of the bar
    bar = sheet[28 + 22 + 8 + 16 + 20 :, first + 3][:400]
    np.testing.assert_array_equal(bar, cubehelix(np.linspace(1, 0, 400)))
    ticks = (sheet[:, first + 22 + 2] == np.uint8(INK)).all(axis=-1)
    rows = np.flatnonzero(ticks)
    assert len(rows) == 8  # 0 to 7
    assert np.ptp(np.diff(rows)) <= 1
    assert (sheet[0] == PAPER).all()


@pytest.mark.parametrize("shape", [(1, 1), (3, 900), (900, 3), (240, 320)])
@pytest.mark.parametrize("aov", TITLES)
def test_nothing_is_written_over_the_edge(shape, aov):
    sheet = cost_map(aov, np.full(shape, 2_147_483_647), samples=1_000_000)
    for edge in (sheet[:8], sheet[-8:], sheet[:, :8], sheet[:, -8:]):
        assert (edge == PAPER).all()


# --- files


def test_every_cost_has_a_title():
    assert tuple(TITLES) == COSTS
    assert AOVS[-len(COSTS) :] == COSTS


def test_costs_lie_beside_a_png_as_counts_and_as_pictures(tmp_path):
    counts = np.arange(12, dtype=np.int32).reshape(3, 4)
    image = Image(film(rays=counts))
    files = image.save(tmp_path / "a.png")
    assert [file.name for file in files] == ["a.png", "a.rays.npy", "a.rays.png"]
    np.testing.assert_array_equal(np.load(tmp_path / "a.rays.npy"), counts)
    with PillowImage.open(tmp_path / "a.rays.png") as picture:
        np.testing.assert_array_equal(np.asarray(picture)[..., :3], image.cost_map("rays"))
        assert picture.text["warp_rt:aov"] == "rays"
    with PillowImage.open(tmp_path / "a.png") as picture:
        assert picture.size == (4, 3)


@pytest.mark.parametrize("extension", ["png", "jpg"])
def test_a_cost_alone_is_the_picture(tmp_path, extension):
    counts = np.arange(12, dtype=np.int32).reshape(3, 4)
    image = Image(film(rays=counts))
    files = image.save(tmp_path / f"a.{extension}", aovs=("rays",))
    assert [file.name for file in files] == [f"a.{extension}", "a.rays.npy"]
    with PillowImage.open(files[0]) as picture:
        shown = np.asarray(picture.convert("RGB")).astype(int)
    assert np.abs(shown - image.cost_map("rays")).mean() < 2  # what JPEG loses


@pytest.mark.parametrize("aovs", [("depth",), ("rays", "deepest"), ("rays", "depth"), ()])
def test_a_png_has_to_show_something(tmp_path, aovs):
    with pytest.raises(OptionError, match="holds color or one cost"):
        planned_files(tmp_path / "a.png", aovs)


def test_only_costs_have_maps():
    image = Image(film(rays=np.ones((2, 2), np.int32)))
    for aov in ("color", "depth", "beauty"):
        with pytest.raises(OptionError, match="is none of nodesVisited"):
            image.cost_map(aov)
    with pytest.raises(OptionError, match="was not rendered"):
        image.cost_map("deepest")


def test_from_the_command_line(tmp_path, monkeypatch, capfd):
    """A square of two triangles that fills half the picture: in the EXR, counts; as PNG, the map."""
    from .test_cli_render import STAGE

    monkeypatch.chdir(tmp_path)
    (tmp_path / "wall.usda").write_text(STAGE)
    common = ["render", "wall.usda", "--width", "16", "--device", "cpu"]
    assert main([*common, "--aov", "rays,triangleTests", "-o", "a.exr", "--json"]) == 0
    told = json.loads(capfd.readouterr().out)
    with OpenEXR.File("a.exr", separate_channels=True) as file:
        rays = file.channels()["rays.X"].pixels
        tests = file.channels()["triangleTests.X"].pixels
    assert rays.dtype == np.uint32
    assert rays.sum() == told["rays"]["primary"] + told["rays"]["shadow"]
    np.testing.assert_array_equal(rays, np.where(np.abs(np.arange(16) - 7.5) < 4, 2, 1)[None].repeat(8, axis=0))
    assert tests.max() <= 2 * 2
    assert main([*common, "--aov", "rays", "-o", "b.png"]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"wall.usda", "a.exr", "b.png", "b.rays.npy"}
    with PillowImage.open("b.png") as picture:
        assert picture.text["warp_rt:aov"] == "rays"
        assert min(picture.size) > 160
