# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Textures: orientation, wrap modes, filtering and decoding, against the definitions in float64."""

from itertools import product

import numpy as np
import pytest
import warp as wp

from warp_rt.device_scene import upload_scene
from warp_rt.kernels.structs import SceneData
from warp_rt.kernels.texture import eval_texture
from warp_rt.scene import Image, Instances, Scene, Texture, Wrap
from warp_rt.texture_values import texture_values
from warp_rt.warp_setup import init_warp

init_warp()


@wp.kernel
def look_up(scene: SceneData, uv: wp.array[wp.vec2], out: wp.array[wp.vec4]):
    i = wp.tid()
    out[i] = eval_texture(scene, scene.textures[0], uv[i])


def evaluate(pixels: np.ndarray, uv: np.ndarray, **fields: object) -> np.ndarray:
    none = np.zeros(0, np.int32)
    scene = Scene(
        meshes=(),
        instances=Instances(none, np.zeros((0, 4, 4)), none, none, none, none),
        textures=(Texture(0, **fields),),  # type: ignore[arg-type]
        images=(Image("test", pixels),),
    )
    device_scene = upload_scene(scene, device="cpu")
    out = wp.zeros(len(uv), dtype=wp.vec4, device="cpu")
    st = wp.array(np.asarray(uv, np.float32), dtype=wp.vec2, device="cpu")
    wp.launch(look_up, dim=len(uv), inputs=[device_scene.data, st, out], device="cpu")
    return out.numpy()


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
