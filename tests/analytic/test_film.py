# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Cameras, AOVs and the film: what each pixel sees, and that neither tiles nor threads change a bit of it."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import Film, OptionError, Renderer, RenderOptions
from warp_rt.scene import Camera

from .scenes import Body, Scene, box, chart, distant, lamp, looking, parallel, render, scene_of, square, whitted

WIDTH, HEIGHT = 45, 31  # odd, and no multiple of any tile size
AOVS = ("color", "depth", "distance", "normal", "position", "primId", "instanceId", "elementId")


def perspective(position: tuple[float, float, float], direction: tuple[float, float, float]) -> Camera:
    return Camera("/camera", looking(direction, position), (-0.75, 0.75, -0.5, 0.5))


def pixel_centers(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of the pixel centres in units of the image, (0, 0) left and top: shape [height, width]."""
    return np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)


def test_orthographic_pixels_lie_on_a_grid() -> None:
    camera = Camera("/camera", looking((0, 0, -1), (1.0, 2.0, 9.0)), (-3.0, 1.0, -1.0, 2.0), is_perspective=False)
    color = render(scene_of(chart(), ambient=(1, 1, 1)), camera, width=8, height=6).color
    x, y = pixel_centers(8, 6)
    np.testing.assert_allclose(color[..., 0], 1.0 - 3.0 + 4.0 * x, atol=5e-6)
    np.testing.assert_allclose(color[..., 1], 2.0 + 2.0 - 3.0 * y, atol=5e-6)


def test_a_sheared_orthographic_camera_looks_along_its_own_z() -> None:
    """An oblique projection: rays reach the chart, 9 lower, half as far to the left."""
    matrix = looking((0, 0, -1), (1.0, 2.0, 9.0))
    matrix[:3, 2] = (0.5, 0.0, 1.0)
    camera = Camera("/camera", matrix, (-3.0, 1.0, -1.0, 2.0), is_perspective=False)
    film = render(scene_of(chart(), ambient=(1, 1, 1)), camera, width=8, height=6, aovs=("position", "depth"))
    x, y = pixel_centers(8, 6)
    expected = np.stack([1.0 - 3.0 + 4.0 * x - 9 * 0.5, 2.0 + 2.0 - 3.0 * y, np.zeros_like(x)], axis=-1)
    np.testing.assert_allclose(film.aovs["position"], expected, atol=5e-6)
    np.testing.assert_allclose(film.aovs["depth"], 9.0, rtol=1e-6)


@pytest.mark.parametrize("is_perspective", [True, False])
def test_normals_of_a_sheared_eye_are_upright_on_its_points(is_perspective: bool) -> None:
    """A plane of the world is one of the sheared space, too: Neye is unit, and upright on all that Peye has of it."""
    matrix = looking((0.3, 0.2, -1), (1.0, 2.0, 9.0)) @ np.diag([1.5, -0.7, 1.2, 1.0])
    matrix[:3, 2] += 0.6 * matrix[:3, 0] - 0.3 * matrix[:3, 1]
    camera = Camera("/camera", matrix, (-0.5, 0.4, -0.3, 0.5), is_perspective=is_perspective)
    film = render(scene_of(chart(), ambient=(1, 1, 1)), camera, width=8, height=6, aovs=("normal", "Neye", "Peye"))
    np.testing.assert_allclose(film.aovs["normal"], np.broadcast_to([0, 0, 1], (6, 8, 3)), atol=1e-6)
    normal, points = film.aovs["Neye"], film.aovs["Peye"].reshape(-1, 3).astype(float)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1, rtol=1e-6)
    np.testing.assert_allclose((points - points[0]) @ normal[0, 0], 0, atol=1e-4)
    assert normal[0, 0] @ points[0] < 0  # towards the eye


def test_perspective_pixels_diverge_from_the_eye() -> None:
    """The window lies at distance 1, the chart at distance 4; what is up in the world is up in the picture."""
    color = render(scene_of(chart(), ambient=(1, 1, 1)), perspective((0, 0, 4), (0, 0, -1)), width=9, height=6).color
    x, y = pixel_centers(9, 6)
    np.testing.assert_allclose(color[..., 0], 4 * (1.5 * x - 0.75), atol=5e-6)
    np.testing.assert_allclose(color[..., 1], 4 * (0.5 - y), atol=5e-6)


def test_aovs_of_a_cube() -> None:
    """A cube of side 2 about the origin, seen along -X from x = 5 with Y up; behind it, nothing."""
    scene = scene_of(square(whitted(), half=0.01, z=-40), box(whitted(), (-1, -1, -1), (1, 1, 1)), background=None)
    film = render(scene, perspective((5, 0, 0), (-1, 0, 0)), width=60, height=40, aovs=AOVS)
    x, y = pixel_centers(60, 40)
    s, t = 1.5 * x - 0.75, 0.5 - y  # the window's coordinates; the near face spans |s|, |t| < 1/4
    front = (np.abs(s) < 0.25) & (np.abs(t) < 0.25)
    length = np.sqrt(1 + s**2 + t**2)
    np.testing.assert_array_equal(film.alpha, front.astype(np.float32))
    np.testing.assert_allclose(film.aovs["depth"][front], 4.0, rtol=1e-6)
    np.testing.assert_allclose(film.aovs["distance"][front], 4.0 * length[front], rtol=1e-6)
    np.testing.assert_allclose(film.aovs["normal"][front], np.tile([1.0, 0, 0], (front.sum(), 1)), atol=1e-6)
    expected = np.stack([np.ones_like(s), 4 * t, -4 * s], axis=-1)
    np.testing.assert_allclose(film.aovs["position"][front], expected[front], atol=2e-6)
    assert (film.aovs["primId"] == np.where(front, 1, -1)).all()
    assert (film.aovs["instanceId"] == -1).all()
    assert set(np.unique(film.aovs["elementId"][front])) == {10, 11}  # the +X side of ``box``
    assert (film.aovs["elementId"][~front] == -1).all()
    for name in ("depth", "distance"):
        assert np.isinf(film.aovs[name][~front]).all()
    for name in ("normal", "position"):
        assert (film.aovs[name][~front] == 0).all()
    assert film.prims[1] == "/body1"


def test_normal_aov_is_the_interpolated_normal_in_world_space() -> None:
    body = Body(
        np.array([(-1.0, -1, 0), (1, -1, 0), (0, 1, 0)]),
        np.array([(0, 1, 2)]),
        whitted(),
        normals=np.tile([0.0, 0.6, 0.8], (3, 1)),
        world_from_local=looking((0, 0, -1)) @ np.diag([2.0, 2.0, 0.5, 1.0]),
    )
    normal = render(scene_of(body), parallel((0, 0, 5)), aovs=("normal",)).aovs["normal"][0, 0]
    expected = np.array([0.0, 0.6 / 2.0, 0.8 / 0.5])
    np.testing.assert_allclose(normal, expected / np.linalg.norm(expected), atol=1e-6)


@pytest.mark.parametrize(("near", "far", "seen"), [(0.0, np.inf, 3), (1.5, np.inf, 2), (3.5, np.inf, 1), (0.0, 2.5, 3)])
def test_clipping_range(near: float, far: float, seen: int) -> None:
    """Sheets at depths 1, 2 and 3 whose ambient is 3, 2 and 1; behind them a wall at depth 4 of 1."""
    sheets = [square(whitted(ambient=float(4 - depth)), z=-depth) for depth in (1, 2, 3)]
    scene = scene_of(*sheets, square(whitted(ambient=1.0), z=-4), ambient=(1, 1, 1))
    camera = parallel((0, 0, 0), clipping_range=(near, far))
    assert render(scene, camera).color[0, 0, 0] == seen
    beyond = render(scene, parallel((0, 0, 0), clipping_range=(2.25, 2.75)), background=(0.5, 0.5, 0.5))
    assert beyond.color[0, 0, 0] == 0.5


def test_alpha_over_nothing_and_over_a_background() -> None:
    camera = Camera("/camera", looking((0, 0, -1), (0, 0, 5)), (0.0, 2.0, -1.0, 1.0), is_perspective=False)
    clear = render(scene_of(square(whitted(), half=1.0), background=None), camera, width=2, height=1)
    np.testing.assert_array_equal(clear.alpha, [[1.0, 0.0]])
    assert (clear.color[0, 1] == 0).all()


# --- a scene with everything in it, for what must not change a bit


def busy_scene() -> Scene:
    glass = whitted(specular=0.5, reflection=0.1, transmission=(0.8, 0.9, 0.7), ior=1.5)
    tilt = looking((0.3, -0.2, -1.0), (1.2, 0.3, 1.0))
    return scene_of(
        square(whitted(ambient=0.1, diffuse=(0.7, 0.5, 0.3), reflection=0.2), half=6),
        box(glass, (-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), world_from_local=tilt),
        box(whitted(diffuse=0.3, reflection=(0.7, 0.6, 0.5)), (-2, -1, 0.01), (-0.5, 1, 1.8)),
        lights=[distant((0.5, 0.3, -1.0), 0.5), lamp(2, (2, -3, 4), 8.0, radius=0.3)],
        ambient=(1, 1, 1),
        background=(0.2, 0.3, 0.5),
    )


BUSY_CAMERA = perspective((1.0, -6.0, 3.5), (-0.1, 1.0, -0.5))


def busy(**options: object) -> Film:
    chosen = RenderOptions(**({"width": WIDTH, "height": HEIGHT, "aovs": AOVS, "threads": 2} | options))
    return Renderer(busy_scene(), chosen, device="cpu").render(camera=BUSY_CAMERA)


def assert_identical(film: Film, other: Film) -> None:
    for name, values in other.aovs.items():
        np.testing.assert_array_equal(film.aovs[name], values, err_msg=name)
    assert film.rays == other.rays


@pytest.mark.parametrize("spp", [1, 3])
@pytest.mark.parametrize("tile_size", [8, 32, 64])
@pytest.mark.parametrize("threads", [1, 2, 4])
def test_tiles_and_threads_change_nothing(tile_size: int, threads: int, spp: int) -> None:
    assert_identical(busy(tile_size=tile_size, threads=threads, spp=spp), busy(tile_size=WIDTH, threads=1, spp=spp))


@pytest.mark.parametrize("crop", [(0, 0, 7, 5), (13, 4, 20, 20), (40, 25, 100, 100), (44, 30, 1, 1)])
@pytest.mark.parametrize("spp", [1, 4])
def test_a_crop_is_the_part_of_the_whole(crop: tuple[int, int, int, int], spp: int) -> None:
    x, y, width, height = crop
    part, whole = busy(crop=crop, spp=spp), busy(spp=spp)
    assert (part.width, part.height) == (min(width, WIDTH - x), min(height, HEIGHT - y))
    for name, values in whole.aovs.items():
        np.testing.assert_array_equal(part.aovs[name], values[y : y + height, x : x + width], err_msg=name)


def test_a_crop_outside_is_refused() -> None:
    with pytest.raises(OptionError):
        busy(crop=(WIDTH, 0, 4, 4))


def test_samples_follow_the_seed_alone() -> None:
    assert_identical(busy(spp=4, seed=5), busy(spp=4, seed=5))
    assert (busy(spp=4, seed=5).color != busy(spp=4, seed=6).color).any()


def test_one_sample_ignores_the_seed() -> None:
    assert_identical(busy(seed=5), busy(seed=6))


def test_samples_average_to_the_coverage() -> None:
    """An edge through a pixel at 30 % of its width: 64 low-discrepancy samples come within 2 of 64."""
    camera = Camera("/camera", looking((0, 0, -1), (0, 0, 5)), (-0.3, 0.7, -0.5, 0.5), is_perspective=False)
    corner = np.array([(-5.0, -5, 0), (0, -5, 0), (0, 5, 0), (-5, 5, 0)])
    body = Body(corner, np.array([(0, 1, 2), (0, 2, 3)]), whitted(ambient=1.0))
    film = render(scene_of(body, ambient=(1, 1, 1)), camera, spp=64)
    assert abs(film.color[0, 0, 0] - 0.3) <= 2 / 64
    assert film.rays.primary == 64


@pytest.mark.parametrize("aov", ["color", "alpha", "depth", "normal", "uv", "primId"])
def test_aovs_are_warp_arrays_without_a_copy(aov: str) -> None:
    scene = scene_of(square(whitted(diffuse=1.0)))
    film = render(scene, parallel((0, 0, 1)), width=3, height=2, aovs=("color", "depth", "normal", "uv", "primId"))
    array = film.as_warp(aov)
    np.testing.assert_array_equal(array.numpy(), film.aovs[aov])
    assert array.shape == (2, 3)
    assert array.ptr == film.aovs[aov].ctypes.data
