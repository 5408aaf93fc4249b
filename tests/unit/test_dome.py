# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Irradiance maps of domes, against closed forms; and where directions fall in a latitude-longitude image."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.environment import latlong_from_direction
from warp_rt.kernels.structs import DomeData
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
