# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Cameras made in Python: what they are calibrated by is what their pictures show."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import warp_rt
from warp_rt.errors import SceneError
from warp_rt.scene import Camera, Settings, look_at

K = np.array([[50.0, 0.0, 21.0], [0.0, 40.0, 13.0], [0.0, 0.0, 1.0]])  # no square pixels, nothing in the middle
WIDTH, HEIGHT = 48, 32
POSE = look_at((1.0, -6.0, 2.0), (0.2, 0.0, 0.4), (0.0, 0.0, 1.0))
AOVS = ("color", "depth", "position", "primId")


def scene() -> warp_rt.Scene:
    """A pyramid."""
    points = [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), (0, 0, 2)]
    return warp_rt.Scene.from_arrays(points, [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])


def render(
    camera: Camera, width: int = WIDTH, height: int = HEIGHT, of: warp_rt.Scene | None = None, **options: object
) -> warp_rt.Film:
    chosen = warp_rt.RenderOptions(width=width, height=height, aovs=AOVS, **options)  # type: ignore[arg-type]
    return warp_rt.Renderer(of or scene(), chosen, device="cpu").render(camera=camera)


def distance_from_projection(film: warp_rt.Film, intrinsics: np.ndarray) -> float:
    """Return how far pixels' centres lie from where K and the pose put what the pixels show [pixel]."""
    seen = film.aovs["primId"] >= 0
    assert 0.1 < seen.mean() < 0.95
    y, x = np.nonzero(seen)
    world = np.c_[film.aovs["position"][seen], np.ones(len(x))]
    local = (np.linalg.inv(POSE) @ world.T)[:3] * [[1], [-1], [-1]]  # Y down, Z forward
    projected = intrinsics @ local / local[2]
    return float(np.abs(projected[:2] - np.stack([x + 0.5, y + 0.5])).max())


def test_points_project_to_the_pixels_that_show_them() -> None:
    film = render(Camera.from_intrinsics(K, WIDTH, HEIGHT, POSE))
    assert distance_from_projection(film, K) < 1e-3  # float32 positions some units away
    assert film.camera is not None
    np.testing.assert_allclose(film.camera.intrinsics(WIDTH, HEIGHT), K, rtol=1e-12)
    assert film.pixel_aspect_ratio == pytest.approx(40 / 50)  # what is 1 wide and high on a plane takes 50 by 40 pixels


def test_a_crop_has_the_principal_point_moved() -> None:
    film = render(Camera.from_intrinsics(K, WIDTH, HEIGHT, POSE), crop=(10, 6, 24, 20))
    assert film.camera is not None
    moved = K - [[0, 0, 10], [0, 0, 6], [0, 0, 0]]
    np.testing.assert_allclose(film.camera.intrinsics(film.width, film.height), moved, rtol=1e-12)
    assert distance_from_projection(film, moved) < 1e-3


def test_a_camera_that_the_settings_fit_has_the_intrinsics_of_its_film() -> None:
    """A square window in a wide picture: expandAperture shows more at the sides."""
    film = render(Camera("/square", POSE, (-0.3, 0.3, -0.3, 0.3)))
    assert film.camera is not None
    k = film.camera.intrinsics(WIDTH, HEIGHT)
    np.testing.assert_allclose(k, [[HEIGHT / 0.6, 0, WIDTH / 2], [0, HEIGHT / 0.6, HEIGHT / 2], [0, 0, 1]], rtol=1e-12)
    assert distance_from_projection(film, k) < 1e-3
    again = render(film.camera)
    np.testing.assert_allclose(again.aovs["depth"], film.aovs["depth"], rtol=1e-5)


@pytest.mark.parametrize("policy", ["expandAperture", "adjustPixelAspectRatio"])
@pytest.mark.parametrize("window", [(0.25, 0.1, 0.8, 0.9), (-0.2, 0.5, 0.6, 1.3)])
def test_the_camera_of_a_film_gives_that_film_again(window: tuple[float, ...], policy: str) -> None:
    """Also where it is the data window of the picture: that is in the camera, and must not be cut out of it again."""
    settings = Settings(data_window=window, pixel_aspect_ratio=1.5, aspect_policy=policy)
    seen = dataclasses.replace(scene(), settings=settings)
    film = render(Camera("/square", POSE, (-0.3, 0.3, -0.2, 0.3)), of=seen)
    assert film.data_window is not None
    assert film.camera is not None
    again = render(film.camera, film.width, film.height, of=seen)
    assert (again.width, again.height, again.data_window) == (film.width, film.height, None)
    assert again.pixel_aspect_ratio == pytest.approx(film.pixel_aspect_ratio)
    is_same = np.isclose(again.aovs["depth"], film.aovs["depth"], rtol=1e-4)
    assert is_same.mean() > 0.99  # but for edges
    np.testing.assert_allclose(again.aovs["position"][is_same], film.aovs["position"][is_same], atol=1e-4)


def test_look_at_is_a_right_handed_frame_with_the_target_ahead() -> None:
    eye, target = np.array([3.0, -2.0, 5.0]), np.array([1.0, 1.0, 1.0])
    matrix = look_at(eye, target, (0.0, 0.0, 1.0))
    np.testing.assert_allclose(matrix[:3, :3].T @ matrix[:3, :3], np.eye(3), atol=1e-15)
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1)
    ahead = np.linalg.inv(matrix) @ [*target, 1.0]
    np.testing.assert_allclose(ahead, [0, 0, -np.linalg.norm(target - eye), 1], atol=1e-12)
    assert matrix[2, 1] > 0  # up is up
    assert matrix[2, 0] == pytest.approx(0)  # right is level


@pytest.mark.parametrize(
    ("intrinsics", "message"),
    [
        (np.eye(2), "intrinsics: a matrix fx, 0, cx"),
        (np.diag([1.0, 0.0, 1.0]), "intrinsics: a matrix fx, 0, cx"),
        (np.diag([1.0, np.nan, 1.0]), "intrinsics: a matrix fx, 0, cx"),
        ([[1, 0.1, 0], [0, 1, 0], [0, 0, 1]], "pixels at right angles"),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 2]], "pixels at right angles"),
    ],
)
def test_what_is_no_calibration_is_refused(intrinsics: object, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Camera.from_intrinsics(intrinsics, 4, 4, np.eye(4))


def test_other_refusals() -> None:
    with pytest.raises(SceneError, match="world_from_camera: a matrix of 4 x 4"):
        Camera.from_intrinsics(np.eye(3), 4, 4, np.eye(3))
    with pytest.raises(SceneError, match="an orthographic camera has no intrinsics"):
        Camera("/flat", np.eye(4), (-1, 1, -1, 1), is_perspective=False).intrinsics(4, 4)
    for eye, target in [((0, 0, 0), (0, 0, 0)), ((0, 0, 5), (0, 0, 0)), ((np.inf, 0, 0), (0, 0, 0))]:
        with pytest.raises(SceneError, match="look_at: "):
            look_at(eye, target, (0, 0, 1))
