# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UDIM tiles near and far: against the same tiles in float64, each filtered by itself."""

import numpy as np
import pytest

from warp_rt.scene import Image, MagFilter, Texture, Tiles
from warp_rt.scene.texture_values import texture_values
from warp_rt.upload.tile_grid import grid_levels
from warp_rt.warp_setup import init_warp

from ..texture_lookups import look_up_texture

init_warp()


def noise(size: tuple[int, int], seed: int, base: float = 0.0) -> Image:
    pixels = base + np.random.default_rng(seed).uniform(0, 1, (*size, 4))
    return Image(f"tile {seed}", pixels.astype(np.float32))


# Two rows and three columns from (2, 1) on; neighbours differ in brightness and size, two are absent.
IMAGES = (noise((16, 16), 1), noise((16, 16), 2, 10.0), noise((64, 32), 3, 20.0), noise((5, 7), 4, 30.0))
TILES = Tiles(2, 1, ((0, 1, -1), (-1, 2, 3)))
TEXTURE = Texture(0, tiles=TILES)
PLACES = {0: (2, 1), 1: (3, 1), 2: (3, 2), 3: (4, 2)}


def test_the_host_evaluates_as_the_kernel_does():
    rng = np.random.default_rng(5)
    uv = rng.uniform((0.5, 0.0), (6.5, 4.5), (600, 2)).astype(np.float32)
    uv[:4] = [[np.inf, 2.5], [3.5, np.nan], [3e38, -3e38], [-1e30, 2.0]]
    fields = {"scale": (2.0, 1.0, 0.5, 1.0), "bias": (0.5, 0.0, 0.0, 0.0)}
    texture = Texture(0, tiles=TILES, **fields)
    np.testing.assert_allclose(look_up_texture(texture, IMAGES, uv), texture_values(texture, IMAGES, uv), atol=2e-3)


def test_the_nearest_texel_is_one_of_its_own_tile():
    texture = Texture(0, tiles=TILES, mag_filter=MagFilter.NEAREST)
    uv = np.random.default_rng(6).uniform((1.5, 0.5), (5.5, 3.5), (600, 2)).astype(np.float32)
    expected = np.zeros((600, 4))
    for image, place in PLACES.items():
        pixels = IMAGES[image].pixels
        column, row = np.floor((uv.astype(float) - place) * pixels.shape[1::-1]).astype(int).T
        is_here = (np.floor(uv) == place).all(axis=1)
        expected[is_here] = pixels[row[is_here], column[is_here]]
    assert 0.2 < expected.any(axis=1).mean() < 0.8
    np.testing.assert_array_equal(look_up_texture(texture, IMAGES, uv), expected.astype(np.float32))
    np.testing.assert_array_equal(texture_values(texture, IMAGES, uv), expected)
    far = {"across": (0.7, 0.0), "down": (0.0, 0.7)}
    np.testing.assert_array_equal(
        look_up_texture(texture, IMAGES, uv, **far), look_up_texture(TEXTURE, IMAGES, uv, **far)
    )


@pytest.mark.parametrize(("row", "place"), PLACES.items())
def test_each_tile_covers_its_own_square_and_no_texel_of_another_shows(row, place):
    pixels = IMAGES[row].pixels.astype(float)
    height, width = pixels.shape[:2]
    y, x = np.mgrid[:height, :width]
    centers = np.stack([place[0] + (x + 0.5) / width, place[1] + (y + 0.5) / height], -1).reshape(-1, 2)
    np.testing.assert_allclose(look_up_texture(TEXTURE, IMAGES, centers), pixels.reshape(-1, 4), atol=2e-4)
    # Half a texel from every edge a tile is its outermost texels: nothing is interpolated across the border.
    edges = np.array([place, (place[0] + 0.9999, place[1] + 0.9999)])
    np.testing.assert_allclose(look_up_texture(TEXTURE, IMAGES, edges), [pixels[0, 0], pixels[-1, -1]], atol=2e-3)


def test_where_no_tile_is_there_is_nothing_but_for_seams_on_the_edges_of_tiles():
    inside = np.array([(4.5, 1.5), (2.5, 2.5), (1.5, 1.5), (5.5, 2.5), (3.5, 0.5), (3.5, 3.5)])
    np.testing.assert_array_equal(look_up_texture(TEXTURE, IMAGES, inside), 0.0)
    # Tile 0 ends at v = 2, tile 1 at u = 4, tile 3 at u = 5, where no tile follows.
    seams = np.array([(2.5, 2.0), (4.0, 1.5), (5.0, 2.5), (5.0, 3.0)])
    expected = [IMAGES[k].pixels[..., 0] for k in (0, 1, 3, 3)]
    got = look_up_texture(TEXTURE, IMAGES, seams)[:, 0]
    assert all(pixels.min() <= value <= pixels.max() for value, pixels in zip(got, expected, strict=True))


def test_tiles_end_at_their_edges_where_none_follows():
    """A tenth of a texel beyond them, and at a thousandth, an absent tile is transparent black; inside it is not."""
    texel = np.array([1 / 16, 1 / 16, 1 / 7, 1 / 5])  # of tiles 0, 1, and 3 across and up
    out = np.array([(0.0, 1.0), (1.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    edges = np.array([(2.5, 2.0), (4.0, 1.5), (5.0, 2.5), (4.5, 3.0)])
    for part in (0.4, 0.1, 1e-3):
        step = part * texel[:, None] * out
        for found in (look_up_texture(TEXTURE, IMAGES, edges + step), texture_values(TEXTURE, IMAGES, edges + step)):
            np.testing.assert_array_equal(found, 0.0)
        for found in (look_up_texture(TEXTURE, IMAGES, edges - step), texture_values(TEXTURE, IMAGES, edges - step)):
            assert (found[:, 3] > 0).all()


def test_what_rounding_puts_beyond_a_tile_is_on_its_edge():
    """In the kernel and on the host, up to the same distance, which grows with the coordinate as rounding does."""
    beyond = np.array([(4.0 + 1.5e-5, 1.5), (2.5, 2.0 + 0.8e-5), (4.0 + 2.5e-5, 1.5), (2.5, 2.0 + 1.3e-5)])
    is_there = [True, True, False, False]  # tile 1 ends at 2 across the grid, tile 0 at 1 up
    assert (look_up_texture(TEXTURE, IMAGES, beyond)[:, 3] > 0).tolist() == is_there
    assert (texture_values(TEXTURE, IMAGES, beyond)[:, 3] > 0).tolist() == is_there


@pytest.mark.parametrize("size", [1 / 8, 1 / 4, 1 / 2, 1.0])
@pytest.mark.parametrize(("row", "place"), PLACES.items())
def test_a_footprint_within_a_tile_is_its_mean_there(row, place, size):
    """Against a float64 box over the tile."""
    pixels = IMAGES[row].pixels.astype(float)
    rng = np.random.default_rng(6)
    local = rng.uniform(size / 2, 1 - size / 2, (60, 2))
    got = look_up_texture(TEXTURE, IMAGES, local + place, across=(size, 0), down=(0, size))
    spots = (np.arange(64) + 0.5) / 64 * size - size / 2
    truth = []
    for u, v in local:
        x, y = ((u + spots) * pixels.shape[1]).astype(int), ((v + spots) * pixels.shape[0]).astype(int)
        truth.append(pixels[np.ix_(y, x)].mean(axis=(0, 1)))
    # Under a box of n texels lies noise of 1 / sqrt(12 n); the filter's own window, not a box, sees about as much.
    texels = max(size * size * pixels.shape[0] * pixels.shape[1], 1)
    assert np.sqrt(np.mean((got - truth) ** 2)) < 0.8 / np.sqrt(12 * texels) + 1e-3


@pytest.mark.parametrize("footprint", [((1 / 4, 0), (0, 1 / 4)), ((1.0, 0), (0, 1 / 64)), ((1.0, 0), (0, 1.0))])
@pytest.mark.parametrize(("row", "place"), PLACES.items())
def test_nothing_of_its_neighbours_gets_into_a_tile(row, place, footprint):
    """They are 10 brighter or darker, or black: a tenth of one would show."""
    pixels = IMAGES[row].pixels
    spots = np.array([(u, v) for u in (0.01, 0.5, 0.99) for v in (0.01, 0.5, 0.99)])
    got = look_up_texture(TEXTURE, IMAGES, spots + place, across=footprint[0], down=footprint[1])
    assert (np.abs(got - pixels.mean(axis=(0, 1))) < 0.5).all()


def test_a_plane_over_many_tiles_keeps_its_mean_at_every_distance():
    """Borders are not mixed, so that a footprint on one shows one side; but all of them together show both alike."""
    images = [noise((8, 8), k, 5.0 * k) for k in range(6)]
    texture = Texture(0, tiles=Tiles(0, 0, ((0, 1, 2), (3, 4, 5))))
    mean = np.mean([image.pixels.mean(axis=(0, 1)) for image in images], axis=0)
    y, x = np.mgrid[:96, :144]
    uv = np.stack([(x + 0.5) / 48, (y + 0.5) / 48], -1).reshape(-1, 2)
    for size in (1 / 16, 1 / 4, 1.0):
        got = look_up_texture(texture, images, uv, across=(size, 0), down=(0, size))
        np.testing.assert_allclose(got.mean(axis=0), mean, rtol=0.01)


@pytest.mark.parametrize("size", [16.0, 1e30, np.inf])
def test_from_afar_all_tiles_are_seen_and_absent_ones_do_not_darken_them(size):
    uv = np.array([[2.5, 1.5], [4.2, 2.7]])
    got = look_up_texture(TEXTURE, IMAGES, uv, across=(size, 0), down=(0, size))
    # Means of the columns and rows there are, halved as texels are: 3 columns become 2, 1.5 of a column each.
    expected = next(level for level in grid_levels(*_means()) if level.shape[:2] == (1, 1))[0, 0]
    np.testing.assert_allclose(got, [expected] * 2, rtol=1e-4)
    assert got[0, 0] > 14  # (0.5 + 10.5 + 20.5 + 30.5) / 4 is 15.5; with two black ones it were 10.3


def _means():
    means = np.zeros((2, 3, 4), np.float32)
    is_there = np.zeros((2, 3), bool)
    for row, (u, v) in PLACES.items():
        means[v - 1, u - 2] = IMAGES[row].pixels.mean(axis=(0, 1))
        is_there[v - 1, u - 2] = True
    return means, is_there


def test_levels_of_a_grid_are_means_of_the_tiles_there_are():
    means, is_there = _means()
    levels = list(grid_levels(means, is_there))
    assert [level.shape[:2] for level in levels] == [(2, 3), (1, 2), (1, 1)]
    # Each texel of (1, 2) covers one and a half columns of both rows.
    left = (means[0, 0] + 0.5 * (means[0, 1] + means[1, 1])) / 2
    right = (0.5 * (means[0, 1] + means[1, 1]) + means[1, 2]) / 2
    np.testing.assert_allclose(levels[1], [[left, right]], rtol=1e-6)
    np.testing.assert_allclose(levels[2][0, 0], means[is_there].mean(axis=0), rtol=1e-6)


def test_holes_of_a_grid_take_what_is_about_them():
    means = np.zeros((1, 8, 4), np.float32)
    means[0, 0], means[0, 7] = 1.0, 3.0
    is_there = np.zeros((1, 8), bool)
    is_there[0, [0, 7]] = True
    levels = list(grid_levels(means, is_there))
    np.testing.assert_allclose(levels[0][0, :, 0], [1, 1, 1, 1, 3, 3, 3, 3])
    np.testing.assert_allclose(levels[3][0, 0], 2.0)


def test_without_filtering_tiles_are_read_as_they_are():
    uv = np.array([[3.3, 2.6], [2.2, 1.9]])
    plain = look_up_texture(TEXTURE, IMAGES, uv, texture_filter="bilinear")
    np.testing.assert_array_equal(plain, look_up_texture(TEXTURE, IMAGES, uv))
