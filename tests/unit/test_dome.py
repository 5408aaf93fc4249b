# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Irradiance maps of domes, against closed forms; and where directions fall in a latitude-longitude image."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.environment import latlong_from_direction
from warp_rt.kernels.light_structs import DomeData
from warp_rt.upload.dome import irradiance_map
from warp_rt.warp_setup import init_warp

init_warp()

SIZE = (33, 64)


def environment(height: int = 256, width: int = 512) -> tuple[np.ndarray, np.ndarray]:
    """Texel directions by UsdLux's latlong rule: the centre is +Z, the top +Y, longitude pi / 2 is +X."""
    lat = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    lon = (0.5 - (np.arange(width) + 0.5) / width) * 2 * np.pi
    x, z = np.cos(lat)[:, None] * np.sin(lon), np.cos(lat)[:, None] * np.cos(lon)
    y = np.broadcast_to(np.sin(lat)[:, None], x.shape)
    return np.stack([x, y, z], -1), np.ones((height, width, 4), np.float32)


def normals() -> np.ndarray:
    """Rows from pole to pole, both among them; columns as those of an image."""
    lat = np.linspace(-np.pi / 2, np.pi / 2, SIZE[0])[:, None]
    lon = (0.5 - (np.arange(SIZE[1]) + 0.5) / SIZE[1]) * 2 * np.pi
    return np.stack([np.cos(lat) * np.sin(lon), np.sin(lat) + 0 * lon, np.cos(lat) * np.cos(lon)], -1)


def test_constant_environment_gives_pi() -> None:
    pixels = environment()[1]
    np.testing.assert_allclose(irradiance_map(pixels, is_srgb=False, size=SIZE), np.pi, rtol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_linear_environment_gives_two_thirds_pi(axis: int) -> None:
    """Radiance 1 + w.a has irradiance pi + (2 pi / 3) n.a (Ramamoorthi and Hanrahan 2001: A_0 = pi, A_1 = 2 pi / 3)."""
    directions, pixels = environment()
    pixels[..., :3] = 1 + directions[..., axis : axis + 1]
    expected = np.pi + 2 * np.pi / 3 * normals()[..., axis]
    got = irradiance_map(pixels, is_srgb=False, size=SIZE)
    np.testing.assert_allclose(got[..., 0], expected, atol=0.01)


@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (2, 3), (8, 19), (100, 131)])
def test_coarse_images_are_interpolated(shape: tuple[int, int]) -> None:
    """As rays see them: beside the sum over directions that a cosine gives."""
    height, width = shape
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = np.random.default_rng(3).uniform(0.1, 1, (height, width, 1))
    u, v = (a.reshape(-1) for a in np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(400) + 0.5) / 400))
    up, turn = np.sqrt(1 - u), 2 * np.pi * v
    around = np.stack([np.sqrt(u) * np.cos(turn), np.sqrt(u) * np.sin(turn), up], axis=1)
    got = irradiance_map(pixels, is_srgb=False, size=SIZE)
    for place in ((32, 0), (7, 11), (20, 40)):
        normal = normals()[place]
        x = np.cross(normal, (0.6, 0.0, 0.8))
        x /= np.linalg.norm(x)
        direction = around @ np.stack([x, np.cross(normal, x), normal])
        column = (0.5 - np.arctan2(direction[:, 0], direction[:, 2]) / (2 * np.pi)) * width - 0.5
        row = (0.5 + np.arcsin(np.clip(direction[:, 1], -1, 1)) / np.pi) * height - 0.5
        i, j = np.floor(row).astype(int), np.floor(column).astype(int)
        low, high = (
            (1 - column + j) * pixels[k, j % width, 0] + (column - j) * pixels[k, (j + 1) % width, 0]
            for k in (np.clip(i, 0, height - 1), np.clip(i + 1, 0, height - 1))
        )
        expected = np.pi * ((1 - row + i) * low + (row - i) * high).mean()
        np.testing.assert_allclose(got[place], expected, rtol=2e-3)


@pytest.mark.parametrize("degrees", [20.0, 45.0, 61.0])
def test_small_suns_are_where_they_are(degrees: float) -> None:
    """A texel of 0.35 degrees that is as bright as the rest of the sky together many times over; E = L cos w."""
    directions, pixels = environment(512, 1024)
    pixels[..., :3] = 0.0
    row = int((90 - degrees) / 180 * 512) + 256
    pixels[row, 300, :3] = 1.0e6
    edges = (np.array([row, row + 1]) / 512 - 0.5) * np.pi
    solid_angle = 2 * np.pi / 1024 * (np.sin(edges[1]) - np.sin(edges[0]))
    expected = 1.0e6 * directions[row, 300, 1] * solid_angle
    np.testing.assert_allclose(irradiance_map(pixels, is_srgb=False, size=SIZE)[-1], expected, rtol=1e-4)


def test_srgb_bytes_are_decoded() -> None:
    pixels = np.full((8, 16, 4), 128, np.uint8)
    expected = np.pi * ((128 / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(irradiance_map(pixels, is_srgb=True, size=SIZE), expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("direction", "uv"),
    [((0, 0, 1), (0.5, 0.5)), ((1, 0, 0), (0.25, 0.5)), ((-1, 0, 0), (0.75, 0.5)), ((0, 1, 0), (None, 1.0))],
)
def test_directions_fall_where_usdlux_says(direction: tuple, uv: tuple) -> None:
    dome = DomeData()
    dome.axis_x, dome.axis_y, dome.axis_z = wp.vec3(1.0, 0.0, 0.0), wp.vec3(0.0, 1.0, 0.0), wp.vec3(0.0, 0.0, 1.0)
    u, v = latlong_from_direction(dome, wp.vec3(*direction))
    assert v == pytest.approx(uv[1], abs=1e-6)
    if uv[0] is not None:
        assert u == pytest.approx(uv[0], abs=1e-6)
