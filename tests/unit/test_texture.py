# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Textures: orientation, wrap modes, filtering and decoding, against the definitions in float64."""

from itertools import product

import numpy as np
import pytest

from warp_rt.scene import Image, Instances, MagFilter, Scene, Texture, Wrap
from warp_rt.scene.texture_values import grid_values, texture_values
from warp_rt.upload.device_scene import upload_scene
from warp_rt.warp_setup import init_warp

from ..texture_lookups import look_up_texture

init_warp()


def evaluate(
    pixels: np.ndarray, uv: np.ndarray, *, across: object = (0, 0), down: object = (0, 0), **fields: object
) -> np.ndarray:
    texture = Texture(0, **fields)  # type: ignore[arg-type]
    return look_up_texture(texture, [Image("test", pixels)], uv, across, down)


def wrapped(index: int, size: int, wrap: Wrap) -> int | None:
    if wrap == Wrap.REPEAT:
        return index % size
    if wrap == Wrap.CLAMP:
        return min(max(index, 0), size - 1)
    if wrap == Wrap.MIRROR:
        k = index % (2 * size)
        return k if k < size else 2 * size - 1 - k
    return index if 0 <= index < size else None


def bilinear(pixels: np.ndarray, uv: np.ndarray, wrap_s: Wrap, wrap_t: Wrap) -> np.ndarray:
    height, width = pixels.shape[:2]
    result = []
    for u, v in np.asarray(uv, float):
        x, y = u * width - 0.5, v * height - 0.5
        value = np.zeros(4)
        for dy, dx in product((0, 1), (0, 1)):
            column = wrapped(int(np.floor(x)) + dx, width, wrap_s)
            row = wrapped(int(np.floor(y)) + dy, height, wrap_t)
            weight = (1 - abs(x - np.floor(x) - dx)) * (1 - abs(y - np.floor(y) - dy))
            if row is not None and column is not None:
                value += weight * pixels[row, column]
        result.append(value)
    return np.array(result)


@pytest.mark.parametrize("wrap", list(Wrap))
@pytest.mark.parametrize("is_float", [False, True])
def test_bilinear_with_every_wrap_mode(wrap: Wrap, is_float: bool) -> None:
    rng = np.random.default_rng(3)
    pixels = rng.integers(0, 256, size=(5, 7, 4)).astype(np.uint8)
    source = (pixels / 255).astype(np.float32) if is_float else pixels
    uv = rng.uniform(-2.5, 3.5, size=(400, 2)).astype(np.float32)
    got = evaluate(source, uv, wrap_s=wrap, wrap_t=wrap)
    np.testing.assert_allclose(got, bilinear(pixels / 255.0, uv, wrap, wrap), atol=1e-5)


@pytest.mark.parametrize("wrap", list(Wrap))
def test_coordinates_that_are_no_numbers_do_no_harm(wrap: Wrap) -> None:
    pixels = np.full((2, 2, 4), 255, np.uint8)
    uv = np.array([[np.inf, 0.5], [np.nan, np.nan], [-np.inf, 1e38], [3e38, -3e38]], np.float32)
    assert np.isfinite(evaluate(pixels, uv, wrap_s=wrap, wrap_t=wrap)).all()


def test_lower_left_is_row_zero_and_column_zero() -> None:
    pixels = np.zeros((4, 4, 4), np.uint8)
    pixels[0, 0] = 255  # row 0 is the bottom
    centers = (np.array([[0.5, 0.5], [3.5, 0.5], [0.5, 3.5]]) / 4).astype(np.float32)
    assert evaluate(pixels, centers)[:, 0].tolist() == [1.0, 0.0, 0.0]


def test_srgb_is_decoded_before_filtering_and_alpha_is_not() -> None:
    pixels = np.array([[[0, 255, 128, 0], [255, 255, 128, 255]]], np.uint8)
    r, g, b, a = evaluate(pixels, np.array([[0.5, 0.5]]), wrap_s=Wrap.CLAMP, wrap_t=Wrap.CLAMP, is_srgb=True)[0]
    assert (r, g, a) == (0.5, 1.0, 0.5)
    assert b == pytest.approx(((128 / 255 + 0.055) / 1.055) ** 2.4, rel=1e-5)


def test_scale_bias_transform_and_fallback() -> None:
    pixels = np.full((2, 2, 4), 128, np.uint8)
    got = evaluate(pixels, np.array([[0.5, 0.5]]), scale=(2.0, 2, 2, 1), bias=(-1.0, -1, -1, 0))[0]
    np.testing.assert_allclose(got, [256 / 255 - 1] * 3 + [128 / 255], atol=1e-6)
    pixels = np.zeros((1, 4, 4), np.uint8)
    pixels[0, 3] = 255
    turned = np.array([[0.0, 0.0, 7 / 8], [1.0, 0.0, 0.0]], np.float32)  # u' = 7/8, v' = u
    assert evaluate(pixels, np.array([[0.5, 0.1]]), uv_transform=turned)[0, 0] == 1.0


@pytest.mark.parametrize("wrap", list(Wrap))
@pytest.mark.parametrize("is_float", [False, True])
def test_the_nearest_texel_with_every_wrap_mode(wrap: Wrap, is_float: bool) -> None:
    rng = np.random.default_rng(3)
    pixels = rng.integers(0, 256, size=(5, 7, 4)).astype(np.uint8)
    source = (pixels / 255).astype(np.float32) if is_float else pixels
    uv = rng.uniform(-2.5, 3.5, size=(400, 2)).astype(np.float32)
    places = np.floor(uv.astype(float) * (7, 5)).astype(int)
    expected = np.zeros((400, 4))
    for k, (x, y) in enumerate(places.tolist()):
        column, row = wrapped(x, 7, wrap), wrapped(y, 5, wrap)
        if column is not None and row is not None:
            expected[k] = pixels[row, column] / 255
    texture = Texture(0, wrap_s=wrap, wrap_t=wrap, mag_filter=MagFilter.NEAREST)
    found = evaluate(source, uv, wrap_s=wrap, wrap_t=wrap, mag_filter=MagFilter.NEAREST)
    np.testing.assert_allclose(found, expected, atol=1e-7)
    np.testing.assert_allclose(texture_values(texture, [Image("test", source)], uv), expected, atol=1e-7)


def test_cubic_is_the_b_spline_of_the_texels() -> None:
    rng = np.random.default_rng(4)
    pixels = rng.uniform(size=(6, 7, 4)).astype(np.float32)
    uv = rng.uniform(-0.5, 1.5, size=(200, 2)).astype(np.float32)

    def spline(x: float) -> float:  # the uniform cubic B-spline about 0
        x = abs(x)
        return 2 / 3 - x**2 + x**3 / 2 if x < 1 else max(2 - x, 0) ** 3 / 6

    expected = np.zeros((200, 4))
    for k, (u, v) in enumerate(uv.astype(float)):
        for row in range(-10, 20):
            for column in range(-10, 20):
                weight = spline(u * 7 - 0.5 - column) * spline(v * 6 - 0.5 - row)
                expected[k] += weight * pixels[row % 6, min(max(column, 0), 6)]
    fields = {"wrap_s": Wrap.CLAMP, "wrap_t": Wrap.REPEAT, "mag_filter": MagFilter.CUBIC}
    np.testing.assert_allclose(evaluate(pixels, uv, **fields), expected, atol=2e-6)
    np.testing.assert_allclose(texture_values(Texture(0, **fields), [Image("", pixels)], uv), expected, atol=1e-9)


@pytest.mark.parametrize("mag_filter", [MagFilter.NEAREST, MagFilter.CUBIC])
def test_a_footprint_of_several_texels_is_averaged_by_every_filter(mag_filter: MagFilter) -> None:
    pixels = np.random.default_rng(5).uniform(size=(16, 16, 4)).astype(np.float32)
    uv = np.array([[0.3, 0.6]])
    far = {"across": (0.25, 0.0), "down": (0.0, 0.25), "wrap_s": Wrap.REPEAT, "wrap_t": Wrap.REPEAT}
    np.testing.assert_array_equal(evaluate(pixels, uv, mag_filter=mag_filter, **far), evaluate(pixels, uv, **far))


@pytest.mark.parametrize(("wrap_s", "wrap_t"), list(product(Wrap, Wrap)))
@pytest.mark.parametrize("is_float", [False, True])
def test_the_host_evaluates_as_the_kernels_do(wrap_s: Wrap, wrap_t: Wrap, is_float: bool) -> None:
    rng = np.random.default_rng(11)
    pixels = rng.integers(0, 256, size=(5, 7, 4)).astype(np.uint8)
    source = (pixels / 255).astype(np.float32) if is_float else pixels
    uv = rng.uniform(-2.5, 3.5, size=(300, 2)).astype(np.float32)
    uv[:4] = [[0, 0], [1, 1], [np.inf, 0.5], [0.3, np.nan]]
    fields = {
        "wrap_s": wrap_s,
        "wrap_t": wrap_t,
        "scale": (2.0, -1.0, 0.5, 1.0),
        "bias": (-1.0, 0.25, 0.0, 0.1),
        "uv_transform": np.array([[0.5, 0.25, 0.1], [-0.25, 1.5, 0.2]], np.float32),
        "is_srgb": True,
    }
    found = texture_values(Texture(0, **fields), [Image("test", source)], uv)
    np.testing.assert_allclose(found, evaluate(source, uv, **fields), atol=3e-5)


def test_the_host_shows_the_fallback_unscaled() -> None:
    missing = Texture(-1, fallback=(0.1, 0.2, 0.3, 0.4), scale=(2.0, 2.0, 2.0, 2.0))
    np.testing.assert_allclose(texture_values(missing, [], np.zeros((2, 2))), [(0.1, 0.2, 0.3, 0.4)] * 2)


# --- footprints


def noise(size: tuple[int, int], seed: int = 7) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0, 1, (*size, 4)).astype(np.float32)


@pytest.mark.parametrize("wrap", list(Wrap))
def test_a_footprint_within_a_texel_changes_nothing(wrap: Wrap) -> None:
    rng = np.random.default_rng(4)
    pixels, uv = noise((5, 7)), rng.uniform(-2, 3, (300, 2))
    angle, size = rng.uniform(0, 6.3, 300), rng.uniform(0, 0.99, 300)
    across = np.stack([np.cos(angle) / 7, np.sin(angle) / 5], -1) * size[:, None]
    plain = evaluate(pixels, uv, wrap_s=wrap, wrap_t=wrap)
    np.testing.assert_array_equal(evaluate(pixels, uv, across=across, wrap_s=wrap, wrap_t=wrap), plain)


@pytest.mark.parametrize("wrap", [Wrap.CLAMP, Wrap.REPEAT, Wrap.MIRROR])
@pytest.mark.parametrize("size", [(16, 16), (13, 6), (1, 5)])
def test_a_footprint_much_larger_than_the_image_gives_its_mean(wrap: Wrap, size: tuple) -> None:
    pixels = noise(size)
    for scale in (16.0, 1e30, np.inf):
        got = evaluate(pixels, [[0.3, 0.8]], across=(scale, 0), down=(0, scale), wrap_s=wrap, wrap_t=wrap)
        np.testing.assert_allclose(got[0], pixels.mean(axis=(0, 1)), rtol=2e-5)


def box_mean(pixels: np.ndarray, uv: np.ndarray, across: np.ndarray, down: np.ndarray) -> np.ndarray:
    """Return the mean of the repeated image, its texels being flat squares, over a parallelogram in float64."""
    height, width = pixels.shape[:2]
    s, t = ((q.reshape(-1) + 0.5) / 300 - 0.5 for q in np.meshgrid(np.arange(300), np.arange(300)))
    place = uv + s[:, None] * across + t[:, None] * down
    x, y = (np.floor(place * (width, height)).astype(int) % (width, height)).T
    return pixels[y, x].astype(float).mean(axis=0)


@pytest.mark.parametrize(("length", "breadth"), [(2, 2), (4, 4), (8, 2), (12, 1), (16, 1), (24, 3), (5, 0.3)])
def test_footprints_give_about_the_mean_over_them(length: float, breadth: float) -> None:
    """Long ones too, in any direction: the error is a small part of what the texels under the ray alone would make."""
    rng = np.random.default_rng(11)
    pixels = noise((64, 32))
    filtered, plain = [], []
    for _ in range(40):
        angle = rng.uniform(0, 2 * np.pi)
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        across, down = turn * np.array([[length], [breadth]]) / (32, 64)
        uv = rng.uniform(0, 1, 2)
        truth = box_mean(pixels, uv, across, down)
        for error, footprint in ((filtered, (across, down)), (plain, ((0, 0), (0, 0)))):
            got = evaluate(
                pixels, uv[None], across=footprint[0], down=footprint[1], wrap_s=Wrap.REPEAT, wrap_t=Wrap.REPEAT
            )
            error.append(got[0, :3] - truth[:3])
    filtered_rms, plain_rms = (np.sqrt(np.mean(np.square(error))) for error in (filtered, plain))
    # Under a box of n texels lies noise of 1 / sqrt(12 n); the filter's own window, not a box, sees about as much.
    assert filtered_rms < 0.7 / np.sqrt(12 * max(length, 1) * max(breadth, 1))
    assert filtered_rms < 0.7 * plain_rms


def test_a_footprint_does_not_depend_on_how_it_is_told() -> None:
    """A circle's two derivatives may be any two at right angles; sheared ones, any two that span the ellipse."""
    rng = np.random.default_rng(12)
    pixels, uv = noise((32, 32)), rng.uniform(0, 1, (50, 2))
    across, down = np.array([0.21, 0.05]), np.array([-0.02, 0.11])
    first = evaluate(pixels, uv, across=across, down=down, wrap_s=Wrap.REPEAT, wrap_t=Wrap.REPEAT)
    c, s = np.cos(0.9), np.sin(0.9)
    turned = evaluate(
        pixels, uv, across=c * across + s * down, down=c * down - s * across, wrap_s=Wrap.REPEAT, wrap_t=Wrap.REPEAT
    )
    np.testing.assert_allclose(first, turned, atol=1e-4)


def test_black_borders_are_not_mixed_with_the_opposite_side() -> None:
    pixels = np.zeros((32, 32, 4), np.float32)
    pixels[:, 16:] = 1.0
    got = evaluate(pixels, [[0.02, 0.5], [0.98, 0.5], [-0.2, 0.5], [1.2, 0.5]], across=(4 / 32, 0), down=(0, 4 / 32))
    assert got[0, 0] == 0.0
    assert 0.4 < got[1, 0] < 0.8  # half of the footprint lies outside
    assert (got[2:] == 0.0).all()


def test_repeated_borders_are_mixed_with_the_opposite_side() -> None:
    pixels = np.zeros((32, 32, 4), np.float32)
    pixels[:, 16:] = 1.0
    got = evaluate(
        pixels, [[0.0, 0.5], [1.0, 0.5]], across=(4 / 32, 0), down=(0, 4 / 32), wrap_s=Wrap.REPEAT, wrap_t=Wrap.REPEAT
    )
    np.testing.assert_allclose(got, 0.5, atol=1e-6)


def test_srgb_texels_are_averaged_in_linear_light() -> None:
    pixels = np.zeros((16, 16, 4), np.uint8)
    pixels[::2] = 255
    got = evaluate(
        pixels, [[0.5, 0.5]], across=(1, 0), down=(0, 1), is_srgb=True, wrap_s=Wrap.REPEAT, wrap_t=Wrap.REPEAT
    )
    np.testing.assert_allclose(got[0], 0.5, atol=0.003)  # half a code of 8 bits


def test_one_image_by_two_curves_has_two_pyramids_and_one_base() -> None:
    pixels = np.zeros((16, 16, 4), np.uint8)
    pixels[::2] = 255
    none = np.zeros(0, np.int32)
    scene = Scene(
        meshes=(),
        instances=Instances(none, np.zeros((0, 4, 4)), none, none, none, none),
        textures=(Texture(0, is_srgb=True), Texture(0), Texture(0)),
        images=(Image("test", pixels),),
    )
    data = upload_scene(scene, device="cpu").data
    assert len(data.images) == 10
    assert len(data.texels_byte) == 256 + 2 * 85
    plain = upload_scene(scene, device="cpu", texture_filter="bilinear").data
    assert (len(plain.images), len(plain.texels_byte)) == (2, 256)
    assert (data.is_filtered, plain.is_filtered) == (1, 0)


@pytest.mark.parametrize("wrap_s", Wrap)
@pytest.mark.parametrize("wrap_t", Wrap)
@pytest.mark.parametrize("mag_filter", MagFilter)
def test_grids_of_places_are_read_as_single_ones_are(wrap_s, wrap_t, mag_filter):
    rng = np.random.default_rng(5)
    image = Image("noise", rng.uniform(size=(3, 5, 4)).astype(np.float32))
    s, t = rng.uniform(-2, 3, 20), rng.uniform(-2, 3, 15)
    texture = Texture(0, wrap_s=wrap_s, wrap_t=wrap_t, mag_filter=mag_filter)
    expected = texture_values(texture, [image], np.stack([np.tile(s, 15), np.repeat(t, 20)], axis=1))
    found = grid_values(image.pixels.astype(np.float64), s, t, texture)
    np.testing.assert_allclose(found.reshape(-1, 4), expected, atol=1e-12)
