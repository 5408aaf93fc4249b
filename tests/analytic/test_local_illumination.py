# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""One node of the ray tree: ambient, Lambert's cosine, Phong's highlight, the background."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warp_rt import Scene
from warp_rt.scene import Camera, Input, LightKind

from .scenes import Body, distant, lamp, looking, parallel, radiance, render, scene_of, square, whitted

DOWN = parallel((0, 0, 5))
RTOL = 2e-6  # a dozen float32 roundings


def tilted(degrees: float) -> tuple[float, float, float]:
    """Return the direction of light that falls at an angle to the z axis."""
    return (np.sin(np.radians(degrees)), 0.0, -np.cos(np.radians(degrees)))


@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0, 89.0])
def test_lambert(degrees: float) -> None:
    kd, color = np.array([0.2, 0.5, 0.8]), np.array([1.0, 0.5, 0.25])
    scene = scene_of(square(whitted(diffuse=kd)), lights=[distant(tilted(degrees), color)])
    np.testing.assert_allclose(radiance(scene, DOWN), kd * color * np.cos(np.radians(degrees)), rtol=RTOL)


def test_distant_light_of_irradiance_pi_shows_kd() -> None:
    scene = Scene.from_arrays(
        [(-1, -1, 0), (1, -1, 0), (0, 1, 0)],
        [(0, 1, 2)],
        material=whitted(diffuse=(0.1, 0.4, 0.9)),
        lights=[distant((0, 0, -1))],
        cameras=[DOWN],
    )
    np.testing.assert_allclose(radiance(scene, scene.cameras[0]), (0.1, 0.4, 0.9), rtol=RTOL)


def test_lights_add_up() -> None:
    scene = scene_of(square(whitted(diffuse=0.5)), lights=[distant((0, 0, -1), 0.25), distant(tilted(60), 1.0)])
    np.testing.assert_allclose(radiance(scene, DOWN), 0.5 * (0.25 + 0.5), rtol=RTOL)


@pytest.mark.parametrize("height", [0.5, 2.0, 30.0])
def test_point_light_falls_off_with_the_square(height: float) -> None:
    """Radiant intensity pi r^2 L at distance d gives the irradiance pi r^2 L / d^2, so I_l = r^2 L / d^2."""
    light = lamp(LightKind.POINT, (0, 0, height), (3.0, 2.0, 1.0), radius=0.25)
    scene = scene_of(square(whitted(diffuse=1.0)), lights=[light])
    expected = np.array([3.0, 2.0, 1.0]) * 0.25**2 / height**2
    np.testing.assert_allclose(radiance(scene, parallel((0, 0, 40))), expected, rtol=RTOL)


@pytest.mark.parametrize("height", [0.5, 2.0, 30.0])
def test_the_lectures_point_light_does_not_fall_off(height: float) -> None:
    light = lamp(LightKind.POINT, (3 * height, 0, 4 * height), (0.9, 0.6, 0.3), has_falloff=False)
    scene = scene_of(square(whitted(diffuse=0.5), half=100), lights=[light])
    expected = 0.5 * np.array([0.9, 0.6, 0.3]) * 0.8  # cos of the 3-4-5 triangle
    np.testing.assert_allclose(radiance(scene, parallel((0, 0, 150))), expected, rtol=RTOL)


@pytest.mark.parametrize("exponent", [1.0, 10.0, 80.0])
def test_phong_highlight(exponent: float) -> None:
    """Light at 40 degrees, eye at 25 degrees on the other side: R.V = cos 15 degrees."""
    ks = np.array([0.7, 0.5, 0.2])
    scene = scene_of(
        square(whitted(diffuse=0.3, specular=ks, shininess=exponent)), lights=[distant(tilted(40), (1.0, 0.5, 2.0))]
    )
    view = np.array([-np.sin(np.radians(25)), 0, -np.cos(np.radians(25))])
    expected = np.array([1.0, 0.5, 2.0]) * (0.3 * np.cos(np.radians(40)) + ks * np.cos(np.radians(15)) ** exponent)
    np.testing.assert_allclose(radiance(scene, parallel(-5 * view, view)), expected, rtol=RTOL * (1 + exponent))


def test_no_highlight_from_behind_the_mirror_direction() -> None:
    """Light and eye on the same side, both at 60 degrees: R.V = cos 120 degrees, which counts 0."""
    scene = scene_of(square(whitted(specular=1.0, shininess=1.0)), lights=[distant(tilted(60))])
    direction = tilted(60)
    assert radiance(scene, parallel(-5 * np.array(direction), direction)).max() == 0.0


def test_ambient_is_the_only_light_without_lights() -> None:
    scene = scene_of(square(whitted(ambient=(0.1, 0.2, 0.3), diffuse=1.0)), ambient=(1.0, 0.5, 2.0))
    np.testing.assert_allclose(radiance(scene, DOWN), (0.1, 0.1, 0.6), rtol=RTOL)


def test_options_override_ambient_and_background() -> None:
    scene = scene_of(square(whitted(ambient=0.5), half=1.0), ambient=(1, 1, 1), background=(0.5, 0.5, 0.5))
    color = render(scene, parallel((0, 0, 5)), ambient=(0.2, 0.4, 0.6), background=(1.0, 2.0, 3.0))
    np.testing.assert_allclose(color.color[0, 0], (0.1, 0.2, 0.3), rtol=RTOL)
    miss = radiance(scene, parallel((9, 0, 5)), background=(1.0, 2.0, 3.0))
    np.testing.assert_array_equal(miss, np.float32([1.0, 2.0, 3.0]))


def test_background_is_not_clamped() -> None:
    scene = scene_of(square(whitted(), half=1.0), background=(0.25, 4.0, 0.0))
    np.testing.assert_array_equal(radiance(scene, parallel((9, 0, 5))), np.float32([0.25, 4.0, 0.0]))


def test_both_sides_are_shaded() -> None:
    """Seen from below, the sheet is lit by the light below and not by the one above."""
    scene = scene_of(
        square(whitted(ambient=0.1, diffuse=1.0)),
        lights=[distant((0, 0, 1), 0.25), distant((0, 0, -1), 0.5)],
        ambient=(1, 1, 1),
    )
    np.testing.assert_allclose(radiance(scene, parallel((0, 0, -5), (0, 0, 1))), 0.1 + 0.25, rtol=RTOL)
    np.testing.assert_allclose(radiance(scene, DOWN), 0.1 + 0.5, rtol=RTOL)


def test_interpolated_normals() -> None:
    """N = (1 - a - b) N0 + a N1 + b N2, normalised, at the pixels of a triangle seen from above."""
    corners = np.array([(0.0, 0, 0), (4.0, 0, 0), (0, 4.0, 0)])
    normals = np.array([(0, 0, 1.0), (0.6, 0, 0.8), (0, 0.6, 0.8)])
    body = Body(corners, np.array([(0, 1, 2)]), whitted(diffuse=1.0), normals=normals)
    camera = Camera("/camera", looking((0, 0, -1), (0, 0, 5)), (0.0, 2.0, 0.0, 2.0), is_perspective=False)
    color = render(scene_of(body, lights=[distant((0, 0, -1))]), camera, width=8, height=8).color

    x, y = np.meshgrid((np.arange(8) + 0.5) / 4, 2 - (np.arange(8) + 0.5) / 4)
    a, b = x / 4, y / 4
    n = (1 - a - b)[..., None] * normals[0] + a[..., None] * normals[1] + b[..., None] * normals[2]
    expected = n[..., 2] / np.linalg.norm(n, axis=-1)
    np.testing.assert_allclose(color, np.repeat(expected[..., None], 3, axis=-1), rtol=4 * RTOL)


def test_nonuniform_scale_turns_normals_by_the_inverse_transpose() -> None:
    """A plane at 45 degrees stretched threefold along z has the normal (-3, 0, 1) / sqrt(10)."""
    corners = np.array([(-1.0, -1, -1), (1.0, -1, 1), (1.0, 1, 1), (-1.0, 1, -1)])
    body = Body(
        corners,
        np.array([(0, 1, 2), (0, 2, 3)]),
        whitted(diffuse=1.0),
        normals=np.tile(np.array([-1.0, 0, 1.0]) / np.sqrt(2), (4, 1)),
        world_from_local=np.diag([1.0, 1.0, 3.0, 1.0]),
    )
    scene = scene_of(body, lights=[distant((0, 0, -1))])
    np.testing.assert_allclose(radiance(scene, DOWN), 1 / np.sqrt(10), rtol=RTOL)


def test_a_primvar_is_scaled_and_shifted() -> None:
    """Where the mesh has it, and where its fallback stands in."""
    place = Input((0.5, 0.25, 1.0, 0.0), primvar="place", scale=(2.0, 3.0, 0.5, 1.0), bias=(0.25, -0.5, 1.0, 0.0))
    floor = square(whitted(ambient=place))
    for primvars, value in (({}, (0.5, 0.25, 1.0)), ({"place": floor.points * 0 + (1, 2, 4)}, (1, 2, 4))):
        scene = scene_of(replace(floor, primvars=primvars), ambient=(1, 1, 1))
        expected = np.array(value) * (2.0, 3.0, 0.5) + (0.25, -0.5, 1.0)
        np.testing.assert_allclose(radiance(scene, parallel((0.3, 0.2, 1.0))), expected, rtol=1e-6)
