# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which camera, which size, which window."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warp_rt.errors import SceneError
from warp_rt.options import RenderOptions
from warp_rt.rendering.film_camera import camera_data, choose_camera, conform_window, image_size
from warp_rt.report import Report
from warp_rt.scene import Camera, Scene, Settings
from warp_rt.usd.cameras import read_camera

TRIANGLE = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def camera(path: str = "/cam", window: tuple = (-0.2, 0.2, -0.1, 0.1), **fields: object) -> Camera:
    return Camera(path, np.eye(4), window, **fields)  # type: ignore[arg-type]


def scene(*paths: str, settings: Settings | None = None) -> Scene:
    return Scene.from_arrays(*TRIANGLE, cameras=[camera(p) for p in paths], settings=settings)


def test_choice_of_camera() -> None:
    assert choose_camera(scene(), None) is None
    assert choose_camera(scene("/a", "/b"), None).path == "/a"
    assert choose_camera(scene("/a", "/x/main_cam"), None).path == "/x/main_cam"
    assert choose_camera(scene("/a", "/main_cam", settings=Settings(camera="/a")), None).path == "/a"
    assert choose_camera(scene("/a", "/x/b"), "b").path == "/x/b"
    assert choose_camera(scene("/a", "/b"), None, as_usdrecord=True) is None
    assert choose_camera(scene("/a", "/x/main_cam"), None, as_usdrecord=True).path == "/x/main_cam"
    assert choose_camera(scene("/a", "/b"), "b", as_usdrecord=True).path == "/b"
    assert choose_camera(scene("/a", settings=Settings(camera="/a")), None, as_usdrecord=True).path == "/a"
    assert choose_camera(scene("/a", "/x/b"), "/x/b").path == "/x/b"
    with pytest.raises(SceneError, match="did you mean /x/shotcam"):
        choose_camera(scene("/a", "/x/shotcam"), "/x/shotcan")


@pytest.mark.parametrize(
    ("options", "settings", "size"),
    [
        ({}, {}, (960, 480)),  # usdrecord's width; the camera's aspect is 2
        ({}, {"resolution": (320, 240)}, (320, 240)),
        ({"width": 101}, {}, (101, 50)),  # truncated
        ({"height": 50}, {}, (100, 50)),
        ({"width": 64, "height": 64}, {"resolution": (320, 240)}, (64, 64)),
        ({"width": 64}, {"resolution": (320, 240)}, (64, 48)),
        ({"height": 48}, {"resolution": (320, 240)}, (64, 48)),
    ],
)
def test_size(options: dict, settings: dict, size: tuple) -> None:
    assert image_size(camera(), RenderOptions(**options), Settings(**settings)) == size


@pytest.mark.parametrize("focal_length", [12.7, 18.147, 24.0, 35.0, 50.0, 85.0, 100.3])
@pytest.mark.parametrize(
    ("apertures", "height"), [((21.946, 16.4595), 720), ((36.0, 24.0), 640), ((10.0, 10.0), 960), ((32.0, 18.0), 540)]
)
def test_no_lens_costs_a_row(apertures: tuple, height: int, focal_length: float) -> None:
    """OpenUSD's GfCamera has aspect ratios in single precision: 4 : 3 is 960 by 720, at each length of a zoom."""
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.Camera.Define(stage, "/C")
    prim.CreateHorizontalApertureAttr(apertures[0])
    prim.CreateVerticalApertureAttr(apertures[1])
    prim.CreateFocalLengthAttr(focal_length)
    prim.CreateHorizontalApertureOffsetAttr(1.7)
    assert int(np.float32(960) / np.float32(prim.GetCamera(0).aspectRatio)) == height
    read = read_camera(prim.GetPrim(), np.eye(4), Usd.TimeCode(0), Report())
    assert image_size(read, RenderOptions(width=960), Settings()) == (960, height)


def test_aspect_ratios_without_measure() -> None:
    """Near to 0 they count as 1, as in usdrecord; a side that would be too long is named with the camera."""
    for window, size in (((0, 1e-6, 0, 1), (960, 960)), ((0, 1e30, 0, 1e-30), (960, 1)), ((0, 0, 0, 0), (960, 960))):
        assert image_size(camera(window=window), RenderOptions(), Settings()) == size
    narrow = camera(window=(0, 0.01, 0, 1))
    with pytest.raises(SceneError, match=r"/cam: its aspect ratio, 0\.01, makes a picture of 960 x 96000 pixels"):
        image_size(narrow, RenderOptions(), Settings())
    with pytest.raises(SceneError, match=r"/S: its aspect ratio, 2, makes a picture of 120000 x 60000 pixels"):
        image_size(narrow, RenderOptions(height=60000), Settings(path="/S", resolution=(20, 10)))


@pytest.mark.parametrize("resolution", [(2048, 1080), (1998, 1080), (4096, 1716)])
def test_parts_of_a_resolution_are_exact(resolution: tuple) -> None:
    for part in (1, 2, 3, 4, 6, 12):
        size = tuple(side // part for side in resolution)
        if size[0] * part == resolution[0] and size[1] * part == resolution[1]:
            assert image_size(camera(), RenderOptions(width=size[0]), Settings(resolution=resolution)) == size
            assert image_size(camera(), RenderOptions(height=size[1]), Settings(resolution=resolution)) == size


@pytest.mark.parametrize(
    ("policy", "aspect", "expected"),
    [
        ("expandAperture", 4.0, (-0.4, 0.4, -0.1, 0.1)),
        ("expandAperture", 1.0, (-0.2, 0.2, -0.2, 0.2)),
        ("cropAperture", 4.0, (-0.2, 0.2, -0.05, 0.05)),
        ("cropAperture", 1.0, (-0.1, 0.1, -0.1, 0.1)),
        ("adjustApertureWidth", 1.0, (-0.1, 0.1, -0.1, 0.1)),
        ("adjustApertureHeight", 4.0, (-0.2, 0.2, -0.05, 0.05)),
        ("adjustPixelAspectRatio", 4.0, (-0.2, 0.2, -0.1, 0.1)),
    ],
)
def test_conform_policies_of_usdrender(policy: str, aspect: float, expected: tuple) -> None:
    assert conform_window((-0.2, 0.2, -0.1, 0.1), aspect, policy) == pytest.approx(expected)


def test_the_window_keeps_its_offset() -> None:
    left, right, bottom, top = conform_window((0.0, 0.4, -0.1, 0.1), 4.0, "expandAperture")
    assert (left + right, bottom + top) == pytest.approx((0.4, 0.0))


def test_eye_rays_of_a_camera_struct() -> None:
    data = camera_data(camera(), 200, 100, Settings(), np.zeros(3))
    np.testing.assert_allclose(data.corner, [-0.2, 0.1, -1], atol=1e-7)
    np.testing.assert_allclose(data.right, [0.4, 0, 0], atol=1e-7)
    np.testing.assert_allclose(data.down, [0, -0.2, 0], atol=1e-7)
    np.testing.assert_allclose(data.forward, [0, 0, -1], atol=1e-7)


def test_a_mirroring_camera_still_looks_forward() -> None:
    matrix = np.diag([-1.0, 1, 1, 1])
    data = camera_data(Camera("/c", matrix, (-1, 1, -1, 1)), 10, 10, Settings(), np.zeros(3))
    np.testing.assert_allclose(data.forward, [0, 0, -1], atol=1e-7)


def test_a_flat_camera_is_refused() -> None:
    with pytest.raises(SceneError, match="/c"):
        camera_data(Camera("/c", np.diag([0.0, 1, 1, 1]), (-1, 1, -1, 1)), 10, 10, Settings(), np.zeros(3))
