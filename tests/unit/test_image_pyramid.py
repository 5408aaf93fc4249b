# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Image pyramids, against means over exactly covered areas in float64."""

import numpy as np
import pytest

from warp_rt.srgb import linear_from_srgb
from warp_rt.upload.image_pyramid import coarser_levels


def covering(count: int) -> np.ndarray:
    """Return the share that each texel of a side has in each of the next level, shape [(count + 1) // 2, count]."""
    half = (count + 1) // 2
    edges = np.arange(half + 1) * count / half
    texel = np.arange(count)
    covered = np.minimum(edges[1:, None], texel + 1) - np.maximum(edges[:-1, None], texel)
    return np.maximum(covered, 0) * half / count


def expected_levels(linear: np.ndarray) -> list[np.ndarray]:
    """Return the levels of an image in linear light, float64."""
    levels = []
    while linear.shape[:2] != (1, 1):
        height, width = linear.shape[:2]
        linear = np.einsum("ri,cj,ijk->rck", covering(height), covering(width), linear)
        levels.append(linear)
    return levels


@pytest.mark.parametrize("size", [(8, 8), (5, 7), (1, 6), (9, 1), (33, 64)])
def test_every_texel_is_the_mean_of_what_it_covers(size: tuple) -> None:
    pixels = np.random.default_rng(1).uniform(0, 5, (*size, 4)).astype(np.float32)
    levels = list(coarser_levels(pixels, is_srgb=False))
    expected = expected_levels(pixels.astype(float))
    assert [level.shape for level in levels] == [level.shape for level in expected]
    for level, truth in zip(levels, expected, strict=True):
        assert level.dtype == np.float32
        np.testing.assert_allclose(level, truth, rtol=1e-5)
    np.testing.assert_allclose(levels[-1][0, 0], pixels.mean(axis=(0, 1)), rtol=1e-5)


@pytest.mark.parametrize("is_srgb", [False, True])
@pytest.mark.parametrize("size", [(16, 16), (11, 6)])
def test_bytes_are_averaged_in_linear_light_and_stay_bytes(size: tuple, is_srgb: bool) -> None:
    pixels = np.random.default_rng(2).integers(0, 256, (*size, 4)).astype(np.uint8)
    linear = pixels / 255.0
    if is_srgb:
        linear[..., :3] = linear_from_srgb(linear[..., :3])
    for level, truth in zip(coarser_levels(pixels, is_srgb=is_srgb), expected_levels(linear), strict=True):
        assert level.dtype == np.uint8
        # Rounded to the nearest code, no more; the error does not grow from level to level.
        for code_step in (-0.51, 0.51):
            bound = (level + code_step) / 255.0
            if is_srgb:
                bound[..., :3] = linear_from_srgb(bound[..., :3])
            assert ((bound - truth) * code_step >= 0).all()


def test_floats_are_averaged_in_linear_light_where_they_are_srgb() -> None:
    pixels = np.zeros((2, 2, 4), np.float32)
    pixels[0] = 1.0
    (level,) = coarser_levels(pixels, is_srgb=True)
    np.testing.assert_allclose(linear_from_srgb(level[0, 0, :3]), 0.5, rtol=1e-5)
    assert level[0, 0, 3] == 0.5


def test_a_single_texel_has_no_coarser_level() -> None:
    assert list(coarser_levels(np.ones((1, 1, 4), np.float32), is_srgb=False)) == []


def test_large_images_are_read_some_rows_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    pixels = np.random.default_rng(3).integers(0, 256, (37, 10, 4)).astype(np.uint8)
    whole = list(coarser_levels(pixels, is_srgb=True))
    monkeypatch.setattr("warp_rt.upload.image_pyramid._BLOCK", 60)
    for level, other in zip(whole, coarser_levels(pixels, is_srgb=True), strict=True):
        np.testing.assert_array_equal(level, other)
