# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Irradiance of area lights and domes on a diffuse floor, against closed forms and quadrature in float64."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warp_rt.scene import Dome, Image, Light, LightKind

from .scenes import distant, lamp, latlong_directions, looking, parallel, radiance, scene_of, square, whitted

L = np.array([2.0, 1.0, 0.5])
# On the floor: below the lights, and aside; every light is wholly above the horizon there.
PLACES = [(0.0, 0.0), (1.5, 0.0), (-2.0, 1.0), (4.0, -3.0)]
HEIGHT = 2.0


def floor_radiance(light: Light | None, place: tuple[float, float], domes: tuple[Dome, ...] = ()) -> np.ndarray:
    """Return what a white diffuse floor sends up, E / pi."""
    scene = scene_of(square(whitted(diffuse=1.0), half=20), lights=[light] if light else [], domes=domes)
    x, y = place
    return radiance(scene, parallel((x, y, 10.0)))


def quadrature(points: np.ndarray, normals: np.ndarray, areas: np.ndarray, place: tuple[float, float]) -> float:
    """Return the irradiance on the floor at ``place`` from small patches of radiance 1: cos cos / d^2 dA."""
    to_light = points - np.array([*place, 0.0])
    d2 = (to_light**2).sum(axis=1)
    emitted = np.maximum(-(to_light * normals).sum(axis=1), 0.0)
    return float((to_light[:, 2] * emitted / d2**2 * areas).sum())


def midpoints(low: float, high: float, count: int) -> np.ndarray:
    return low + (high - low) * (np.arange(count) + 0.5) / count


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("degrees", [0.0, 35.0])
def test_rect(place: tuple[float, float], degrees: float) -> None:
    direction = (np.sin(np.radians(degrees)), 0.0, -np.cos(np.radians(degrees)))
    light = lamp(LightKind.RECT, (0, 0, HEIGHT), L, direction=direction, width=1.5, height=0.8)
    u, v = (q.reshape(-1) for q in np.meshgrid(midpoints(-0.75, 0.75, 400), midpoints(-0.4, 0.4, 400)))
    frame = light.world_from_light
    points = frame[:3, 3] + u[:, None] * frame[:3, 0] + v[:, None] * frame[:3, 1]
    area = 1.5 * 0.8 / len(u)
    expected = quadrature(points, np.tile(-frame[:3, 2], (len(u), 1)), np.full(len(u), area), place)
    np.testing.assert_allclose(floor_radiance(light, place), L * expected / np.pi, rtol=1e-5)


def test_rect_below_its_corner() -> None:
    """Lambert's formula: a parallel rectangle a x b at distance c, above the corner of which the point lies."""
    a, b, c = 3.0, 2.0, 2.0
    light = lamp(LightKind.RECT, (a / 2, b / 2, c), L, width=a, height=b)
    along_a, along_b = np.hypot(a, c), np.hypot(b, c)
    expected = 0.5 * (a / along_a * np.arctan(b / along_a) + b / along_b * np.arctan(a / along_b))
    np.testing.assert_allclose(floor_radiance(light, (0.0, 0.0)), L * expected / np.pi, rtol=1e-5)


@pytest.mark.parametrize("kind", [LightKind.RECT, LightKind.DISK])
def test_rect_and_disk_shine_to_one_side(kind: LightKind) -> None:
    assert floor_radiance(lamp(kind, (0, 0, HEIGHT), L, direction=(0, 0, 1)), (0.3, 0.2)).max() == 0.0


def test_disk_overhead() -> None:
    """E = pi L sin^2 of the half angle: r = 1 at height 2."""
    light = lamp(LightKind.DISK, (0, 0, HEIGHT), L, radius=1.0)
    np.testing.assert_allclose(floor_radiance(light, (0.0, 0.0)), L / 5, rtol=1e-5)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("degrees", [0.0, 35.0])
def test_disk(place: tuple[float, float], degrees: float) -> None:
    direction = (np.sin(np.radians(degrees)), 0.0, -np.cos(np.radians(degrees)))
    light = lamp(LightKind.DISK, (0, 0, HEIGHT), L, direction=direction, radius=0.8)
    radius, angle = (q.reshape(-1) for q in np.meshgrid(midpoints(0, 0.8, 400), midpoints(0, 2 * np.pi, 400)))
    frame = light.world_from_light
    points = frame[:3, 3] + (radius * np.cos(angle))[:, None] * frame[:3, 0]
    points += (radius * np.sin(angle))[:, None] * frame[:3, 1]
    areas = radius * (0.8 / 400) * (2 * np.pi / 400)
    expected = quadrature(points, np.tile(-frame[:3, 2], (len(points), 1)), areas, place)
    np.testing.assert_allclose(floor_radiance(light, place), L * expected / np.pi, rtol=2e-5)


@pytest.mark.parametrize("place", PLACES)
def test_sphere(place: tuple[float, float]) -> None:
    """E = pi L r^2 / d^2 times the cosine: exact, by the projected solid angle, wherever the sphere is all visible."""
    light = lamp(LightKind.SPHERE, (0, 0, HEIGHT), L, radius=0.7)
    d = np.linalg.norm([*place, HEIGHT])
    np.testing.assert_allclose(floor_radiance(light, place), L * 0.7**2 / d**2 * HEIGHT / d, rtol=1e-5)


@pytest.mark.parametrize("place", PLACES)
def test_cylinder(place: tuple[float, float]) -> None:
    """The ends of its silhouette are made of a few straight pieces, which costs up to a thousandth."""
    light = lamp(LightKind.CYLINDER, (0, 0, HEIGHT), L, radius=0.3, length=2.0)
    frame = light.world_from_light
    x, angle = (q.reshape(-1) for q in np.meshgrid(midpoints(-1, 1, 400), midpoints(0, 2 * np.pi, 800)))
    out = np.cos(angle)[:, None] * frame[:3, 1] + np.sin(angle)[:, None] * frame[:3, 2]
    points = frame[:3, 3] + x[:, None] * frame[:3, 0] + 0.3 * out
    areas = np.full(len(x), 2.0 * 0.3 * 2 * np.pi / len(x))
    expected = quadrature(points, out, areas, place)
    np.testing.assert_allclose(floor_radiance(light, place), L * expected / np.pi, rtol=1e-3)


@pytest.mark.parametrize("degrees", [0.53, 20.0, 90.0])
def test_distant_disk(degrees: float) -> None:
    """Radiance L over a cone of full angle a, overhead: E = pi L sin^2(a / 2)."""
    light = Light("/sun", LightKind.DISTANT, looking((0, 0, -1)), tuple(L.tolist()), angle=np.radians(degrees))
    expected = L * np.sin(np.radians(degrees) / 2) ** 2
    np.testing.assert_allclose(floor_radiance(light, (0.5, 0.5)), expected, rtol=1e-5)


def test_distant_light_of_angle_zero_gives_its_irradiance() -> None:
    np.testing.assert_allclose(floor_radiance(distant((0, 0, -1), L), (0.5, 0.5)), L, rtol=2e-6)


def test_even_dome() -> None:
    """E = pi L from the whole upper half."""
    dome = Dome("/dome", np.eye(4), tuple(L.tolist()))
    np.testing.assert_allclose(floor_radiance(None, (0.5, 0.5), (dome,)), L, rtol=1e-5)


@pytest.mark.parametrize("normal", [(0, 1, 0), (0, -1, 0), (1, 0, 0), (0, 0, -1), (0.05, 1, -0.02), (-0.3, 0.5, 0.8)])
def test_floors_and_walls_under_an_uneven_dome(normal: tuple[float, float, float]) -> None:
    """Radiance 1 + a.w gives E = pi + (2 pi / 3) a.n (Ramamoorthi and Hanrahan 2001), at the dome's poles too."""
    slope = np.array([[0.9, 0.2, -0.1], [0.0, 0.9, 0.3], [-0.3, 0.0, 0.7]])
    pixels = np.ones((256, 512, 4), np.float32)
    pixels[..., :3] += latlong_directions(256) @ slope
    n = np.array(normal) / np.linalg.norm(normal)
    body = square(whitted(diffuse=1.0), world_from_local=looking(-n))
    scene = scene_of(body, domes=[Dome("/dome", np.eye(4), (1.0, 1.0, 1.0), image=0)])
    scene = replace(scene, images=(Image("/sky", pixels),))
    got = radiance(scene, parallel(5 * n, -n))
    np.testing.assert_allclose(got, 1 + 2 / 3 * n @ slope, rtol=2e-3)


def test_a_dome_is_seen_directly_and_in_mirrors() -> None:
    dome = Dome("/dome", np.eye(4), tuple(L.tolist()))
    scene = scene_of(square(whitted(reflection=0.5), half=1.0), domes=[dome], background=(9.0, 9.0, 9.0))
    np.testing.assert_allclose(radiance(scene, parallel((0, 0, 5))), 0.5 * L, rtol=2e-6)
    np.testing.assert_allclose(radiance(scene, parallel((5, 0, 5))), L, rtol=2e-6)
