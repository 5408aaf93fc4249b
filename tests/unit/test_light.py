# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Closed forms of area lights, against brute-force integration over their surfaces in float64."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.light import cylinder_irradiance, disk_irradiance, rect_irradiance, sample_light, sphere_irradiance
from warp_rt.kernels.light_structs import LightData
from warp_rt.warp_setup import init_warp

init_warp()


def integrate(points: np.ndarray, normals: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Vector irradiance at the origin of patches of radiance 1: direction, cosine at the light, area / distance^2."""
    d2 = (points**2).sum(-1)
    wi = points / np.sqrt(d2)[:, None]
    cosine = np.maximum(-(wi * normals).sum(-1), 0)
    return (wi * (cosine * areas / d2)[:, None]).sum(0)


def rect_patches(center: np.ndarray, half_x: np.ndarray, half_y: np.ndarray, n: int = 400) -> tuple:
    s = (np.arange(n) + 0.5) / n * 2 - 1
    x, y = (q.reshape(-1, 1) for q in np.meshgrid(s, s))
    normal = -np.cross(half_x, half_y)
    area = 4 * np.linalg.norm(normal) / n**2
    points = center + x * half_x + y * half_y
    return points, np.broadcast_to(normal / np.linalg.norm(normal), points.shape), np.full(len(points), area)


@pytest.mark.parametrize(
    ("center", "half_x", "half_y"),
    [
        ((0, 0, 2), (1, 0, 0), (0, 1, 0)),
        ((0.5, -0.3, 1), (0.7, 0, 0), (0, 0.2, 0)),
        ((3, 1, 0.6), (0.9, 0, 0.1), (0, 0.5, 0)),
        ((0, 0, 50), (0.5, 0, 0), (0, 0.5, 0)),
    ],
)
def test_rect(center: tuple, half_x: tuple, half_y: tuple) -> None:
    expected = integrate(*rect_patches(*(np.array(v, float) for v in (center, half_x, half_y))))
    got = np.array(rect_irradiance(wp.vec3(*center), wp.vec3(*half_x), wp.vec3(*half_y)))
    np.testing.assert_allclose(got, expected, rtol=2e-3, atol=2e-4 * np.linalg.norm(expected))


@pytest.mark.parametrize(
    ("to_center", "radius"),
    [((0, 0, 1), 0.5), ((0.3, 0, 1), 0.5), ((2, 1, 0.5), 1.0), ((4, -3, 200), 1.0), ((0.3, 0.2, 0.5), 1.0)],
)
def test_disk(to_center: tuple, radius: float) -> None:
    n = 600
    r = np.sqrt((np.arange(n) + 0.5) / n) * radius
    a = (np.arange(720) + 0.5) / 720 * 2 * np.pi
    r, a = (q.reshape(-1) for q in np.meshgrid(r, a))
    points = np.array(to_center, float) + np.stack([r * np.cos(a), r * np.sin(a), 0 * r], -1)
    normals = np.broadcast_to([0.0, 0.0, -1.0], points.shape)
    expected = integrate(points, normals, np.full(len(points), np.pi * radius**2 / len(points)))
    got = np.array(disk_irradiance(wp.vec3(*to_center), wp.vec3(0.0, 0.0, -1.0), radius))
    np.testing.assert_allclose(got, expected, rtol=2e-3, atol=2e-4 * np.linalg.norm(expected))


def test_disk_from_behind_is_dark() -> None:
    assert not np.any(disk_irradiance(wp.vec3(0.0, 0.0, 1.0), wp.vec3(0.0, 0.0, 1.0), 1.0))


@pytest.mark.parametrize(
    ("center", "length", "radius"), [((0, 0, 3), 4, 0.5), ((1, 0.5, 2), 2, 0.1), ((0, 0, 1), 60, 0.4)]
)
def test_cylinder(center: tuple, length: float, radius: float) -> None:
    m, k = 1600, 240
    x = ((np.arange(m) + 0.5) / m - 0.5) * length
    a = (np.arange(k) + 0.5) / k * 2 * np.pi
    x, a = (q.reshape(-1) for q in np.meshgrid(x, a))
    normals = np.stack([0 * a, np.cos(a), np.sin(a)], -1)
    points = np.array(center, float) + np.stack([x, 0 * x, 0 * x], -1) + radius * normals
    expected = integrate(points, normals, np.full(len(points), 2 * np.pi * radius * length / len(points)))
    light = LightData()
    light.half_x, light.radius = wp.vec3(length / 2.0, 0.0, 0.0), radius
    got = np.array(cylinder_irradiance(light, wp.vec3(*center)))
    # What CYLINDER_FACETS promises, and the error of the quadrature that it is compared with.
    np.testing.assert_allclose(got, expected, rtol=6e-3, atol=6e-3 * np.linalg.norm(expected))


def test_long_cylinder_is_the_two_dimensional_closed_form() -> None:
    light = LightData()
    light.half_x, light.radius = wp.vec3(1e4, 0.0, 0.0), 0.25
    got = np.linalg.norm(np.array(cylinder_irradiance(light, wp.vec3(0.0, 0.0, 2.0))))
    assert got == pytest.approx(np.pi * 0.25 / 2.0, rel=1e-4)  # E = pi L r / d


def test_sphere() -> None:
    assert sphere_irradiance(4.0, 0.5) == pytest.approx(np.pi * 0.25 / 16, rel=1e-6)
    assert sphere_irradiance(0.1, 0.5) == 0.0  # it shines outwards


def point_light(**fields: float) -> LightData:
    light = LightData()
    light.kind, light.radius, light.has_falloff = 0, 0.5, 1
    light.emission, light.position = wp.vec3(2.0, 1.0, 0.5), wp.vec3(0.0, 0.0, 3.0)
    light.axis_z = wp.vec3(0.0, 0.0, 1.0)
    light.cone_angle = float(np.pi)
    for name, value in fields.items():
        setattr(light, name, value)
    return light


def test_point_light_falls_off_with_the_square_or_not_at_all() -> None:
    at_three = sample_light(point_light(), wp.vec3(0.0, 0.0, 0.0))
    np.testing.assert_allclose(at_three.irradiance, np.array([2, 1, 0.5]) * np.pi * 0.25 / 9, rtol=1e-6)
    assert at_three.distance == 3.0
    constant = sample_light(point_light(has_falloff=0), wp.vec3(0.0, 5.0, 0.0))
    np.testing.assert_allclose(constant.irradiance, [2, 1, 0.5], rtol=1e-6)


@pytest.mark.parametrize("degrees", [0, 20, 39, 44, 46, 80, 120])
def test_cone_and_focus_follow_usdlux(degrees: float) -> None:
    """Cone 45 degrees with softness 0.2, focus 3: 1 - smoothstep between 36 and 45 degrees, times |cos|^3."""
    angle = np.radians(degrees)
    light = point_light(cone_angle=float(np.radians(45)), cone_softness=0.2, focus=3.0, has_falloff=0)
    position = np.array([0, 0, 3]) + 2 * np.array([np.sin(angle), 0, -np.cos(angle)])
    got = np.array(sample_light(light, wp.vec3(*position)).irradiance)
    x = np.clip((degrees - 36) / 9, 0, 1)
    expected = (1 - x * x * (3 - 2 * x)) * abs(np.cos(angle)) ** 3 if degrees <= 45 else 0.0
    np.testing.assert_allclose(got, np.array([2, 1, 0.5]) * expected, atol=2e-5)
