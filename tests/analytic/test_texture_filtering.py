# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Textures far away, and in curved mirrors and glass: against means over pixels that no filter of ours computes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from warp_rt import Scene
from warp_rt.scene import Camera, Dome, Image, Input, Instances, ShapeKind, Shapes, Texture, Wrap

from .scenes import Body, latlong_directions, looking, render, scene_of, square, whitted

WIDTH, HEIGHT = 120, 90
CELL = 4  # texels along a square of the board
UPRIGHT = np.array([(1.0, 0, 0, 0), (0, 0, -1.0, 0), (0, 1.0, 0, 1.0), (0, 0, 0, 1)])  # at (0, 0, 1), looking along +Y
LEVEL = Camera("/camera", UPRIGHT, (-0.5, 0.5, -0.375, 0.375))


def board() -> np.ndarray:
    """Return a checkerboard of 8 x 8 squares."""
    y, x = np.mgrid[: 8 * CELL, : 8 * CELL] // CELL
    pixels = np.zeros((8 * CELL, 8 * CELL, 4), np.uint8)
    pixels[...] = ((x + y) % 2 * 255)[..., None]
    return pixels


def floor(scale: float = 1.0) -> Body:
    """Return a floor on which the board repeats every 1 / scale units."""
    body = square(whitted(ambient=Input(texture=0)), half=400.0)
    return dataclasses.replace(body, primvars={"st": body.points[:, :2] * scale})


def textured(scene: Scene, *images: np.ndarray) -> Scene:
    return dataclasses.replace(
        scene,
        textures=(Texture(0, wrap_s=Wrap.REPEAT, wrap_t=Wrap.REPEAT),),
        images=tuple(Image(f"image{row}", pixels) for row, pixels in enumerate(images)),
    )


def seen_floor(samples: int) -> np.ndarray:
    """Return the mean of the board, its texels flat, over each pixel below the horizon: float64."""
    rows = np.arange(HEIGHT // 2, HEIGHT)
    place = (np.arange(samples) + 0.5) / samples
    x = ((np.arange(WIDTH)[:, None] + place) / WIDTH - 0.5).reshape(-1)
    y = (0.375 - (rows[:, None] + place) / HEIGHT * 0.75).reshape(-1)
    distance = -1.0 / y[:, None]
    cell = np.floor(x * distance * 8) + np.floor(distance * 8)
    seen = np.where(np.abs(distance) < 400, cell % 2, 0.0)
    return seen.reshape(len(rows), samples, WIDTH, samples).mean(axis=(1, 3))


def test_a_checkerboard_to_the_horizon_is_its_mean_over_each_pixel() -> None:
    scene = textured(scene_of(floor(), ambient=(1, 1, 1)), board())
    truth = seen_floor(40)
    filtered, plain = (
        render(scene, LEVEL, width=WIDTH, height=HEIGHT, texture_filter=name).color[HEIGHT // 2 :, :, 0]
        for name in ("anisotropic", "bilinear")
    )
    away = slice(1, None)  # the first row has the far edge of the floor
    error, plain_error = (np.abs(picture - truth)[away] for picture in (filtered, plain))
    assert error.mean() < 0.02
    assert error.mean() < plain_error.mean() / 10
    far = slice(1, 12)  # squares are smaller than pixels: what remains of them is what shimmers
    assert np.abs(filtered - truth)[far].max() < 0.1
    assert np.abs(plain - truth)[far].max() > 0.4


def test_near_the_eye_nothing_is_filtered() -> None:
    """Where a pixel's footprint is within a texel the picture has the same bits."""
    scene = textured(scene_of(floor(0.01), ambient=(1, 1, 1)), board())
    filtered, plain = (
        render(scene, LEVEL, width=WIDTH, height=HEIGHT, texture_filter=name).color
        for name in ("anisotropic", "bilinear")
    )
    # A row of pixels at d below the horizon lies 1 / d away and is as deep as 1 / d^2 pixels.
    depth = 1.0 / ((np.arange(HEIGHT // 2, HEIGHT) + 0.5) / HEIGHT * 0.75 - 0.375)
    footprint = depth**2 * 0.75 / HEIGHT * 0.01 * 8 * CELL
    is_near = np.r_[np.zeros(HEIGHT // 2, bool), footprint < 0.9]
    assert 10 < is_near.sum() < HEIGHT // 2
    np.testing.assert_array_equal(filtered[is_near], plain[is_near])


def ball_scene(**material: object) -> Scene:
    """Return a ball above the board, under a sky of noise."""
    scene = textured(
        scene_of(floor(), ambient=(1, 1, 1), domes=[Dome("/sky", np.eye(4), (1.0, 1.0, 1.0), image=1)]),
        board(),
        np.random.default_rng(8).uniform(0, 1, (64, 128, 4)).astype(np.float32),
    )
    ball = Shapes(ShapeKind.SPHERE, np.array([[(0.0, 6.0, 1.2)]], np.float32), np.ones((1, 1), np.float32))
    two = np.arange(2, dtype=np.int32)
    instances = Instances(two, np.stack([np.eye(4)] * 2), two, two, two, np.full_like(two, -1))
    return dataclasses.replace(
        scene,
        meshes=(*scene.meshes, ball),
        instances=instances,
        prims=("/floor", "/ball"),
        materials=(*scene.materials, whitted(**material)),
    )


def check_ball(scene: Scene, gain: float) -> None:
    eye = dataclasses.replace(LEVEL, window=(-0.17, 0.17, -0.14, 0.2))
    options = {"width": 48, "height": 48, "depth": 4}
    truth = render(scene, eye, **options, spp=1024, texture_filter="bilinear").color
    filtered, plain = (render(scene, eye, **options, texture_filter=name).color for name in ("anisotropic", "bilinear"))
    x, y = ((np.arange(48) + 0.5) / 48 - 0.5)[None], ((np.arange(48) + 0.5) / 48 - 0.5)[:, None]
    inside = np.hypot(x, y) < 0.45  # the silhouette itself is no texture
    error, plain_error = (np.abs(picture - truth).mean(axis=-1)[inside].mean() for picture in (filtered, plain))
    assert error < plain_error / gain


def test_floor_and_sky_in_a_mirror_ball() -> None:
    check_ball(ball_scene(reflection=0.9), gain=5)


def test_floor_and_sky_through_a_glass_ball() -> None:
    check_ball(ball_scene(transmission=0.9), gain=3)


def test_more_samples_have_smaller_footprints() -> None:
    """With many samples a pixel the filter fades out: what remains is the unfiltered picture's own mean."""
    scene = textured(scene_of(floor(), ambient=(1, 1, 1)), board())
    filtered, plain = (
        render(scene, LEVEL, width=40, height=30, spp=256, texture_filter=name).color[16:]
        for name in ("anisotropic", "bilinear")
    )
    assert np.abs(filtered - plain).mean() < 0.01


@pytest.mark.parametrize("pole", [1.0, -1.0])
def test_a_domes_poles_are_as_sharp_as_the_rest(pole: float) -> None:
    """Each pixel about a pole is what the sky is there: smooth, but steep enough for a blur over rows to show."""
    width = 32

    def sky(direction: np.ndarray) -> np.ndarray:
        slope = np.array([[0.9, 0.2, 0.0], [-0.4, 0.5, 0.8], [0.0, -0.6, 0.3]])
        return np.exp(2.0 * (direction @ slope))

    pixels = np.ones((512, 1024, 4), np.float32)
    pixels[..., :3] = sky(latlong_directions(512))
    scene = scene_of(square(whitted(), z=-100.0), domes=[Dome("/sky", np.eye(4), (1.0, 1.0, 1.0), image=0)])
    scene = dataclasses.replace(scene, images=(Image("/sky", pixels),))
    camera = Camera("/camera", looking((0, pole, 0)), (-0.2, 0.2, -0.2, 0.2))
    found = render(scene, camera, width=width, height=width).color
    side = 0.2 * (2 * (np.arange(width) + 0.5) / width - 1)
    x, y = np.meshgrid(side, -side)
    seen = np.stack([x, y, -np.ones_like(x)], -1) @ camera.world_from_camera[:3, :3].T
    expected = sky(seen / np.linalg.norm(seen, axis=-1, keepdims=True))
    np.testing.assert_allclose(found, expected, rtol=4e-3)
