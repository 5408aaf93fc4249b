# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Depth of field and clipping planes against closed forms; coverage (alpha) is what is measured."""

from __future__ import annotations

import numpy as np
import pytest

import warp_rt
from warp_rt.scene import Camera, Scene, Settings

FACES = [[0, 1, 2], [0, 2, 3]]


def rectangle(x: tuple[float, float], y: tuple[float, float], z: float) -> list[list[float]]:
    return [[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]]


def alpha(points: list[list[float]], camera: Camera, spp: int, settings: Settings | None = None, **size: int):
    scene = Scene.from_arrays(points, FACES, cameras=[camera], settings=settings)
    renderer = warp_rt.Renderer(scene, warp_rt.RenderOptions(spp=spp, **size), device="cpu")
    return renderer.render().alpha, [note.code for note in renderer.diagnostics]


def lens(radius: float, focus: float, **fields: object) -> Camera:
    return Camera("/c", np.eye(4), (-1, 1, -1, 1), lens_radius=radius, focus_distance=focus, **fields)  # type: ignore[arg-type]


def disk_share(s: np.ndarray) -> np.ndarray:
    """Return how much of the unit disk lies left of s."""
    s = np.clip(s, -1, 1)
    return 0.5 + (s * np.sqrt(1 - s**2) + np.arcsin(s)) / np.pi


def integral_of_share(s: np.ndarray) -> np.ndarray:
    """Return the integral of ``disk_share`` from -1 to s."""
    inside = np.clip(s, -1, 1)
    root = np.sqrt(1 - inside**2)
    value = inside / 2 + (inside * np.arcsin(inside) + root - root**3 / 3) / np.pi
    return value + np.maximum(s - 1, 0)


@pytest.mark.parametrize(("depth", "focus"), [(2.0, 4.0), (6.0, 4.0)])
@pytest.mark.parametrize("is_perspective", [True, False])
def test_an_edge_out_of_focus_fades_over_its_circle_of_confusion(depth, focus, is_perspective) -> None:
    """In the plane in focus f the edge of a half plane at distance z is spread over a disk of radius R |z - f| / z.

    Seen by parallel projection, where each image point has its own lens, its radius is R |z - f| / f. The pixel's value
    is that edge profile, the disk's share on one side of a line, integrated over the pixel.
    """
    radius, width = 0.3, 32
    camera = lens(radius, focus, is_perspective=is_perspective)
    covered, codes = alpha(rectangle((-100, 0), (-100, 100), -depth), camera, 256, width=width, height=width)
    half_window = focus if is_perspective else 1.0  # of the picture, in the plane in focus
    pixel = 2 * half_window / width
    confusion = radius * abs(depth - focus) / (depth if is_perspective else focus)
    edges = (np.linspace(-half_window, half_window, width + 1)) / confusion
    expected = 1 - np.diff(integral_of_share(edges)) / (pixel / confusion)
    # Four standard deviations of 256 independent samples, of one pixel and of a column of 32.
    np.testing.assert_allclose(covered, np.tile(expected, (32, 1)), atol=0.125)
    np.testing.assert_allclose(covered.mean(axis=0), expected, atol=0.022)
    assert ((expected > 0.01) & (expected < 0.99)).sum() >= 2  # there was something to see
    assert "N930" not in codes


@pytest.mark.parametrize("is_perspective", [True, False])
def test_a_lens_spreads_light_and_loses_none(is_perspective) -> None:
    """Through every point of a lens a square that faces it has the same size in the picture."""
    camera = lens(0.4, 4.0, is_perspective=is_perspective)
    points = rectangle((-0.3, 0.25), (-0.2, 0.3), -3.0)
    sharp_area = 0.55 * 0.5 / (9 if is_perspective else 1) / 4  # share of the window of side 2
    covered, _ = alpha(points, camera, 64, width=48, height=48)
    assert covered.mean() == pytest.approx(sharp_area, rel=2e-3)
    assert (covered > 0).mean() > 1.5 * sharp_area


def test_the_plane_in_focus_is_sharp() -> None:
    camera = lens(0.5, 3.0)
    points = rectangle((-1.5, 1.5), (-1.5, 1.5), -3.0)  # its edges on borders of pixels
    covered, _ = alpha(points, camera, 16, width=16, height=16)
    expected = np.zeros((16, 16))
    expected[4:12, 4:12] = 1
    np.testing.assert_array_equal(covered, expected)


def test_one_sample_goes_through_the_centre() -> None:
    points = rectangle((-0.7, 0.3), (-0.4, 0.9), -2.0)
    pinhole, codes = alpha(points, lens(0.0, 0.0), 1, width=32, height=32)
    assert "N930" not in codes
    sharp, codes = alpha(points, lens(0.5, 5.0), 1, width=32, height=32)
    assert "N930" in codes
    np.testing.assert_array_equal(sharp, pinhole)


def test_settings_can_switch_the_lens_off() -> None:
    points = rectangle((-0.7, 0.3), (-0.4, 0.9), -2.0)
    pinhole, _ = alpha(points, lens(0.0, 0.0), 4, width=32, height=32)
    off, codes = alpha(points, lens(0.5, 5.0), 4, Settings(disables_depth_of_field=True), width=32, height=32)
    np.testing.assert_array_equal(off, pinhole)
    assert "N930" not in codes


# --- clipping planes


def hidden_by(plane: tuple[float, float, float, float], matrix: np.ndarray | None = None, **fields: object):
    """Return the coverage of a wall at z = -4 behind one at z = -2, and the depth of what is seen."""
    camera = Camera("/c", np.eye(4) if matrix is None else matrix, (-1, 1, -1, 1), clipping_planes=(plane,), **fields)  # type: ignore[arg-type]
    points = [*rectangle((-9, 9), (-9, 9), -2.0), *rectangle((-9, 9), (-9, 9), -4.0)]
    scene = Scene.from_arrays(points, [*FACES, [4, 5, 6], [4, 6, 7]], cameras=[camera])
    options = warp_rt.RenderOptions(width=16, height=16, aovs=("color", "depth"))
    return warp_rt.Renderer(scene, options, device="cpu").render()


def test_a_clipping_plane_hides_what_lies_before_it() -> None:
    """x >= 0.5 is seen: of a wall at distance z the pixels whose ray has x / z above 0.5 / z."""
    film = hidden_by((1, 0, 0, -0.5))
    x = (np.arange(16) + 0.5) / 8 - 1
    expected = np.where(2 * x >= 0.5, 2.0, np.where(4 * x >= 0.5, 4.0, np.inf))
    np.testing.assert_allclose(film.aovs["depth"], np.tile(expected, (16, 1)), rtol=1e-6)


def test_a_clipping_plane_ends_the_view() -> None:
    film = hidden_by((0, 0, 1, 3.0))  # z >= -3
    np.testing.assert_allclose(film.aovs["depth"], 2.0, rtol=1e-6)
    film = hidden_by((0, 0, -1, -3.0))  # z <= -3
    np.testing.assert_allclose(film.aovs["depth"], 4.0, rtol=1e-6)


def test_clipping_planes_are_in_the_cameras_own_space() -> None:
    """The camera stands at (1, 0, 1), is turned by 180 degrees about its view and magnifies its space by 2."""
    matrix = np.diag([-2.0, -2.0, 2.0, 1.0])
    matrix[:3, 3] = 1, 0, 1
    film = hidden_by((1, 0, 0, -0.5), matrix)  # its x >= 0.5: its right half and beyond, one unit of the world
    x = (np.arange(16) + 0.5) / 8 - 1
    expected = np.where(3 * x >= 1, 3.0, np.where(5 * x >= 1, 5.0, np.inf))
    np.testing.assert_allclose(film.aovs["depth"], np.tile(expected, (16, 1)), rtol=1e-6)


def test_clipping_planes_of_an_orthographic_camera_and_of_nothing() -> None:
    film = hidden_by((1, 0, 0, -0.5), is_perspective=False)
    x = (np.arange(16) + 0.5) / 8 - 1
    np.testing.assert_array_equal(np.isfinite(film.aovs["depth"]), np.tile(x >= 0.5, (16, 1)))
    assert np.isinf(hidden_by((0, 0, 0, -1)).aovs["depth"]).all()
    assert np.isfinite(hidden_by((0, 0, 0, 1)).aovs["depth"]).all()
