# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""IES profiles of lights above a floor, against the profile's own values and quadrature in float64."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt.scene import Light, LightKind, Profile

from .scenes import lamp, parallel, radiance, scene_of, square, whitted

HEIGHT = 2.0
# No two halves, no two quadrants are alike.
VERTICAL = np.radians([0, 20, 50, 90, 140, 180]).astype(np.float32)
HORIZONTAL = np.radians([0, 90, 135, 270, 360]).astype(np.float32)
VALUES = np.float32(
    [
        [3.0, 2.5, 1.0, 0.5, 0.2, 0.1],
        [3.0, 1.0, 0.5, 0.4, 0.3, 0.1],
        [3.0, 4.0, 2.0, 0.2, 0.1, 0.1],
        [3.0, 0.5, 3.0, 1.0, 0.6, 0.1],
        [3.0, 2.5, 1.0, 0.5, 0.2, 0.1],
    ]
)
PROFILE = Profile(VERTICAL, HORIZONTAL, VALUES)
PLACES = [(0.3, 0.1), (1.0, 0.2), (-1.0, 0.4), (0.2, 1.5), (-0.6, -2.0), (2.0, -2.5)]


def expected_factor(emitted: np.ndarray, scale: float = 0.0) -> np.ndarray:
    """Return the profile in directions that light leaves in, shape [n, 3], the light's own space.

    The schema: theta from -Z; hdEmbree, which reads the direction to the light instead: phi is atan2(-y, -x).
    """
    emitted = emitted / np.linalg.norm(emitted, axis=-1, keepdims=True)
    theta = np.arccos(-emitted[..., 2])
    if scale > 0:
        theta = theta / scale
    elif scale < 0:
        theta = (theta - np.pi) / -scale + np.pi
    phi = np.arctan2(-emitted[..., 1], -emitted[..., 0]) % (2 * np.pi)
    vertical, horizontal = VERTICAL.astype(float), HORIZONTAL.astype(float)
    i = np.clip(np.searchsorted(vertical, theta, side="right") - 1, 0, len(vertical) - 2)
    j = np.clip(np.searchsorted(horizontal, phi, side="right") - 1, 0, len(horizontal) - 2)
    v = (theta - vertical[i]) / (vertical[i + 1] - vertical[i])
    h = (phi - horizontal[j]) / (horizontal[j + 1] - horizontal[j])
    low = VALUES[j, i] * (1 - v) + VALUES[j, i + 1] * v
    high = VALUES[j + 1, i] * (1 - v) + VALUES[j + 1, i + 1] * v
    return np.where((theta >= 0) & (theta <= np.pi), low * (1 - h) + high * h, 0.0)


def lit(light: Light, place: tuple[float, float], **options: object) -> float:
    scene = scene_of(square(whitted(diffuse=1.0), half=20), lights=[light])
    return float(radiance(scene, parallel((*place, 10.0)), **options)[0])


def turned(degrees: float) -> np.ndarray:
    """Return a light's frame above the floor, turned about its own axes."""
    a = np.radians(degrees)
    about_z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(a / 2), -np.sin(a / 2)], [0, np.sin(a / 2), np.cos(a / 2)]])
    matrix = np.eye(4)
    matrix[:3, :3] = about_x @ about_z
    matrix[:3, 3] = (0, 0, HEIGHT)
    return matrix


@pytest.mark.parametrize("scale", [0.0, 0.5, 1.5, -0.5, -1.5])
@pytest.mark.parametrize("place", PLACES)
def test_a_point_sends_what_its_profile_says(place: tuple[float, float], scale: float) -> None:
    light = lamp(LightKind.POINT, (0, 0, HEIGHT), radius=1.0, profile=PROFILE, profile_angle_scale=scale)
    emitted = np.array([*place, -HEIGHT])
    d2 = float((emitted**2).sum())
    expected = expected_factor(emitted, scale) / d2 * HEIGHT / np.sqrt(d2)
    np.testing.assert_allclose(lit(light, place), expected, rtol=2e-5, atol=1e-7)


@pytest.mark.parametrize("stretch", [(1, 1, 1), (2, 1, 1), (-1, 1, 1), (1, 0.5, 3)])
@pytest.mark.parametrize("place", PLACES)
def test_directions_are_the_lights_own(place: tuple[float, float], stretch: tuple) -> None:
    """Turned, mirrored and stretched: the direction is taken to the light's space by its inverse transform."""
    matrix = turned(70) @ np.diag([*stretch, 1.0])
    light = Light("/lamp", LightKind.POINT, matrix, (1.0, 1.0, 1.0), has_falloff=False, profile=PROFILE)
    emitted = np.array([*place, -HEIGHT])
    local = np.linalg.inv(matrix[:3, :3]) @ emitted
    expected = expected_factor(local) * HEIGHT / np.linalg.norm(emitted)
    np.testing.assert_allclose(lit(light, place), expected, rtol=2e-5)


@pytest.mark.parametrize("place", PLACES[:4])
def test_a_sampled_disk_sends_it_from_every_point(place: tuple[float, float]) -> None:
    light = lamp(LightKind.DISK, (0, 0, HEIGHT), radius=0.8, profile=PROFILE)
    n = 300
    radius, angle = (q.reshape(-1) for q in np.meshgrid((np.arange(n) + 0.5) / n * 0.8, np.arange(n) / n * 2 * np.pi))
    frame = light.world_from_light
    points = frame[:3, 3] + (radius * np.cos(angle))[:, None] * frame[:3, 0]
    points += (radius * np.sin(angle))[:, None] * frame[:3, 1]
    emitted = np.array([*place, 0.0]) - points
    d2 = (emitted**2).sum(axis=1)
    cosine2 = emitted[:, 2] ** 2 / d2  # floor and disk are parallel
    area = radius * (0.8 / n) * (2 * np.pi / n)
    expected = float((expected_factor(emitted @ frame[:3, :3]) * cosine2 / d2 * area).sum()) / np.pi
    np.testing.assert_allclose(lit(light, place, light_samples=4096), expected, rtol=3e-3)


def test_beyond_the_profiles_angles_is_no_light() -> None:
    down = Profile(VERTICAL[:3], HORIZONTAL[:2], VALUES[:2, :3])
    light = lamp(LightKind.POINT, (0, 0, HEIGHT), radius=1.0, profile=down)
    assert lit(light, (-1.0, -0.3)) > 0
    assert lit(light, (-9.0, -0.3)) == 0  # theta 77 degrees
    assert lit(light, (1.0, -0.3)) == 0  # phi 163 degrees
