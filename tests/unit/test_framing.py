# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The framing camera against usdrecord's arithmetic, and the headlight."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from warp_rt import Renderer, RenderOptions
from warp_rt.rendering.film_camera import share_of_picture
from warp_rt.rendering.framing import frame_scene
from warp_rt.rendering.headlight import headlight
from warp_rt.scene import Camera, Input, LightKind, Material, MaterialModel, OpacityMode, RayMask, Scene, Settings

TANGENT = 20.955 / 2 / 50  # of half the horizontal field of view of GfCamera
FACES = [[0, 1, 2]]


def _scene(low, high, up_axis="Y"):
    """Return a scene whose bounds are low and high."""
    low, high = np.array(low, float), np.array(high, float)
    scene = Scene.from_arrays([low, high, (low + high) / 2], FACES)
    return Scene(scene.meshes, scene.instances, up_axis=up_axis)


def test_cube_is_seen_from_usdrecords_distance():
    camera = frame_scene(_scene([-1, -1, -1], [1, 1, 1]))
    # 7.7488: what usdrecord prints for this cube
    np.testing.assert_allclose(camera.world_from_camera[:3, 3], [0, 0, 7.7488], atol=5e-5)
    np.testing.assert_array_equal(camera.world_from_camera[:3, :3], np.eye(3))
    assert camera.window == pytest.approx((-TANGENT, TANGENT, -0.152908, 0.152908))
    assert camera.is_perspective
    assert camera.clipping_range == (0, math.inf)


def test_z_up_is_seen_along_plus_y():
    camera = frame_scene(_scene([0, 0, 0], [2, 4, 6], "Z"))
    distance = 3 / 0.152908 + 2
    np.testing.assert_allclose(camera.world_from_camera[:3, 3], [1, 2 - distance, 3], rtol=1e-12)
    right, up, back = camera.world_from_camera[:3, :3].T
    np.testing.assert_array_equal([right, up, back], [[1, 0, 0], [0, 0, 1], [0, -1, 0]])


def test_a_small_scene_fills_the_picture_but_for_usdrecord_whose_near_plane_is_one_unit_away():
    half = 0.005
    box = _scene([-half] * 3, [half] * 3)
    distance = math.hypot(half, half) / TANGENT + half
    assert frame_scene(box).world_from_camera[2, 3] == pytest.approx(distance)
    assert frame_scene(box, as_usdrecord=True).world_from_camera[2, 3] == pytest.approx(distance + 1)


@pytest.mark.parametrize(("aspect", "width", "height"), [(2, 2 * 0.152908, 0.152908), (0.5, TANGENT, 2 * TANGENT)])
def test_window_grows_to_the_images_aspect(aspect, width, height):
    camera = frame_scene(_scene([-1, -1, -1], [1, 1, 1]), aspect=aspect)
    assert camera.window == pytest.approx((-width, width, -height, height))


@pytest.mark.parametrize("aspect", [0, 0.5, 1, 3])
@pytest.mark.parametrize("high", [(5, 4, 4), (1.5, 20, 4), (1.5, 4, 20), (50, 4, 4), (40, 2.5, 40), (1.1, 4, 40)])
@pytest.mark.parametrize("up_axis", ["Y", "Z"])
def test_every_corner_of_the_box_is_in_the_picture(up_axis, high, aspect):
    low = (1, 2, 3)
    camera = frame_scene(_scene(low, high, up_axis), aspect=aspect)
    corners = np.array([[*corner, 1] for corner in itertools.product(*zip(low, high, strict=True))], float)
    local = corners @ np.linalg.inv(camera.world_from_camera).T
    projected = local[:, :2] / -local[:, 2:3]
    assert (local[:, 2] < 0).all()
    assert (np.abs(projected) <= np.array([camera.window[1], camera.window[3]]) * (1 + 1e-12)).all()


def test_a_high_scene_is_cut_off_where_usdrecord_does():
    box = _scene([-1, -5, -1], [1, 5, 1])
    camera = frame_scene(box, as_usdrecord=True)
    assert camera.world_from_camera[2, 3] == pytest.approx(math.hypot(1, 5) / TANGENT + 1)
    assert frame_scene(box).world_from_camera[2, 3] == pytest.approx(5 / 0.152908 + 1)


def test_an_empty_picture_of_a_scene_is_told():
    box = Scene.from_arrays([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], FACES)
    away = np.diag([-1.0, 1, -1, 1])
    away[2, 3] = 5
    for matrix, codes in ((away, ["N902", "N932"]), (frame_scene(box).world_from_camera, ["N902"])):
        renderer = Renderer(box, RenderOptions(width=8, height=8), device="cpu")
        renderer.render(camera=Camera("/c", matrix, (-0.2, 0.2, -0.2, 0.2)))
        assert [note.code for note in renderer.diagnostics] == codes


def test_what_is_in_view_but_does_not_show_is_not_said_to_lie_elsewhere():
    """Transparent, held out, hidden from eye rays, or cut off by the clipping range: the camera looks at it."""
    clear = Material("/m", MaterialModel.PREVIEW, {"opacity": Input((0.0,))}, opacity_mode=OpacityMode.PRESENCE)
    box = Scene.from_arrays([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], FACES, material=clear)
    opaque = Scene.from_arrays([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], FACES)
    hidden = dataclasses.replace(opaque.instances, seen_by=np.array([RayMask.ALL & ~RayMask.EYE], np.uint8))
    matte = dataclasses.replace(opaque.instances, is_matte=np.array([True]))
    camera = frame_scene(opaque)
    clipped = dataclasses.replace(camera, clipping_range=(0.0, 0.5))
    scenes = [(box, camera), (opaque, clipped)]
    scenes += [(dataclasses.replace(opaque, instances=instances), camera) for instances in (hidden, matte)]
    for scene, view in scenes:
        renderer = Renderer(scene, RenderOptions(width=8, height=8), device="cpu")
        assert not renderer.render(camera=view).alpha.any()
        assert [note.code for note in renderer.diagnostics] == ["N902"]


def _moved(*to):
    matrix = np.eye(4)
    matrix[:3, 3] = to
    return matrix


@pytest.mark.parametrize(
    ("low", "high", "eye", "share"),
    [
        ((-1, -1, -3), (1, 1, -2), (0, 0, 0), 0.25),  # its front face, of half side 1 / 2
        ((-1, -1, -2), (1, 1, -2), (0, 0, 0), 0.25),  # flat
        ((0, 0, -3), (9, 9, -2), (0, 0, 0), 0.25),  # a quarter of the window, the rest beyond it
        ((-1, -1, -1), (1, 1, 1), (0, 0, 0), 1.0),  # from inside
        ((-1, -1, 2), (1, 1, 3), (0, 0, 0), 0.0),  # behind
        ((-1, -1, 0), (1, 1, 0), (0, 0, 0), 0.0),  # flat, and the eye in it
        ((5, -1, -3), (7, 1, -2), (0, 0, 0), 0.0),  # beside
        ((1, -1, -4), (2, 1, 4), (0, 0, 0), 15 / 64),  # from beside it: |y| < x between x = 1 / 4 and 1
    ],
)
def test_the_share_of_a_box_in_the_picture(low, high, eye, share):
    camera = Camera("/c", _moved(*eye), (-1, 1, -1, 1))
    assert share_of_picture(np.array([low, high], float), camera, 8, 8, Settings()) == pytest.approx(share)


@pytest.mark.parametrize("side", [1e-200, 1e-30, 1.0, 1e30])
def test_the_share_of_a_box_in_pictures_of_any_size(side):
    camera = Camera("/c", np.eye(4), (-side, side, -side, side), is_perspective=False)
    box = np.array([[0, -side, -3], [9 * side, 9 * side, -2]])  # its right half, and beyond
    assert share_of_picture(box, camera, 8, 8, Settings()) == pytest.approx(0.5)
    flat = Camera("/c", np.eye(4), (0, 0, -side, side), is_conformed=True)
    assert share_of_picture(box, flat, 8, 8, Settings()) == 0


@pytest.mark.parametrize(("near", "share"), [(0.0, 0.0), (-9.0, 0.25)])
def test_an_orthographic_camera_sees_what_is_behind_it_from_its_near_distance_on(near, share):
    camera = Camera("/c", np.eye(4), (-1, 1, -1, 1), is_perspective=False, clipping_range=(near, 9.0))
    box = np.array([[-0.5, -0.5, 2], [0.5, 0.5, 3]])
    assert share_of_picture(box, camera, 8, 8, Settings()) == pytest.approx(share)
    assert share_of_picture(box - (0, 0, 5), camera, 16, 8, Settings()) == pytest.approx(
        0.125
    )  # a window twice as wide


@pytest.mark.parametrize(
    ("up_axis", "high", "view"),
    [("Y", [4, 0, 4], [0, -1, 0]), ("Z", [4, 4, 0], [0, 0, -1]), ("Z", [4, 4, 0.003], [0, 0, -1])],
)
def test_a_floor_is_looked_at_from_above(up_axis, high, view):
    camera = frame_scene(_scene([0, 0, 0], high, up_axis))
    np.testing.assert_array_equal(-camera.world_from_camera[:3, 2], view)
    assert np.linalg.det(camera.world_from_camera[:3, :3]) == pytest.approx(1)
    np.testing.assert_array_equal(camera.world_from_camera[:3, 0], [1, 0, 0])


@pytest.mark.parametrize(("up_axis", "high"), [("Y", [4, 9, 0]), ("Y", [4, 3, 4]), ("Z", [4, 0, 4]), ("Z", [4, 4, 3])])
def test_a_wall_or_a_body_is_looked_at_from_the_front(up_axis, high):
    camera = frame_scene(_scene([0, 0, 0], high, up_axis))
    np.testing.assert_array_equal(-camera.world_from_camera[:3, 2], [0, 0, -1] if up_axis == "Y" else [0, 1, 0])


@pytest.mark.parametrize(
    ("up_axis", "high", "azimuth"),
    [
        ("Y", [10, 1, 10], 30),  # things on a floor
        ("Z", [10, 10, 1], 30),
        ("Y", [12, 2, 8], 30),  # a ball on a floor
        ("Y", [1, 1.5, 10], 60),  # a train
        ("Z", [1, 10, 1.5], 60),
        ("Y", [1.5, 1, 10], 30),
    ],
)
def test_a_low_or_long_scene_is_looked_at_from_a_corner(up_axis, high, azimuth):
    box = _scene([0, 0, 0], high, up_axis)
    matrix = frame_scene(box).world_from_camera
    angle, elevation = math.radians(azimuth), math.radians(35)
    to_eye = [math.sin(angle) * math.cos(elevation), math.sin(elevation), math.cos(angle) * math.cos(elevation)]
    if up_axis == "Z":
        to_eye = [to_eye[0], -to_eye[2], to_eye[1]]
    np.testing.assert_allclose(matrix[:3, 2], to_eye, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(matrix[:3, :3]), 1)
    up = [0, 1, 0] if up_axis == "Y" else [0, 0, 1]
    assert matrix[:3, 1] @ up > 0.7
    assert matrix[:3, 0] @ up == pytest.approx(0)
    # usdrecord looks at its front
    np.testing.assert_array_equal(
        -frame_scene(box, as_usdrecord=True).world_from_camera[:3, 2], [0, 0, -1] if up_axis == "Y" else [0, 1, 0]
    )


@pytest.mark.parametrize("aspect", [0, 0.5, 1, 2, 5])
@pytest.mark.parametrize(
    ("up_axis", "high"), [("Y", (12, 2, 8)), ("Y", (1, 1.5, 10)), ("Z", (10, 10, 1)), ("Z", (1, 10, 1.5))]
)
def test_a_box_seen_from_a_corner_reaches_across_the_picture_or_up_it(up_axis, high, aspect):
    """From one edge to the other, but for a margin of a twentieth: no eye that looks this way may be nearer."""
    camera = frame_scene(_scene([0, 0, 0], high, up_axis), aspect=aspect)
    corners = np.array([[*corner, 1] for corner in itertools.product(*zip((0, 0, 0), high, strict=True))], float)
    local = corners @ np.linalg.inv(camera.world_from_camera).T
    reach = local[:, :2] / -local[:, 2:3] / np.array([camera.window[1], camera.window[3]])
    least, most = reach.min(axis=0), reach.max(axis=0)
    full = np.argmax(most - least)
    assert (-least[full], most[full]) == pytest.approx((1 / 1.05, 1 / 1.05))
    assert (-least[1 - full], most[1 - full]) < (1 / 1.05, 1 / 1.05)


def test_what_stands_on_a_floor_is_told_from_it():
    """The headlight gives the faces of a box that it shows different values."""
    back = frame_scene(_scene([0, 0, 0], [30, 2, 30])).world_from_camera[:3, 2]
    assert np.diff(np.sort(back)).min() > 0.1


@pytest.mark.parametrize(("up_axis", "high"), [("Y", [0, 4, 4]), ("Z", [0, 4, 4])])
def test_a_wall_that_stands_edge_on_is_looked_at_from_its_right(up_axis, high):
    camera = frame_scene(_scene([0, 0, 0], high, up_axis))
    np.testing.assert_array_equal(-camera.world_from_camera[:3, 2], [-1, 0, 0])
    np.testing.assert_array_equal(camera.world_from_camera[:3, 1], [0, 1, 0] if up_axis == "Y" else [0, 0, 1])


def test_scenes_without_extent_have_a_camera():
    empty = Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int))
    camera = frame_scene(empty)
    np.testing.assert_allclose(camera.world_from_camera[:3, 3], [0, 0, 7.7488], atol=5e-5)
    point = frame_scene(_scene([3, 4, 5], [3, 4, 5]))
    np.testing.assert_array_equal(point.world_from_camera[:3, 3], [3, 4, 6])


@pytest.mark.parametrize("view", [[0, 0, -1], [0, -1, 0], [1, 0, 0], [1, -2, 3]])
def test_headlight_of_an_orthographic_camera_shines_along_the_view(view):
    direction = np.array(view, float) / np.linalg.norm(view)
    back = -direction
    right = np.cross([0.3, 0.5, 0.7], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right * 2, np.cross(back, right) * 3, back * 5])
    matrix[:3, 3] = 7, 8, 9
    light = headlight(Camera("/c", matrix, (-1, 1, -1, 1), is_perspective=False))
    np.testing.assert_allclose(-light.world_from_light[:3, 2], direction, atol=1e-12)
    np.testing.assert_allclose(light.world_from_light[:3, :3].T @ light.world_from_light[:3, :3], np.eye(3), atol=1e-12)


def test_white_facing_the_headlight_has_value_one():
    light = headlight(Camera("/c", np.eye(4), (-1, 1, -1, 1), is_perspective=False))
    assert (light.kind, light.angle, light.casts_shadow) == (LightKind.DISTANT, 0, False)
    assert np.array(light.radiance) / math.pi == pytest.approx([1, 1, 1])


def test_headlight_of_a_perspective_camera_sits_in_the_eye_and_does_not_weaken():
    matrix = np.eye(4)
    matrix[:3, 3] = 4, 5, 6
    light = headlight(Camera("/c", matrix, (-1, 1, -1, 1)))
    assert (light.kind, light.has_falloff, light.casts_shadow) == (LightKind.POINT, False, False)
    assert light.world_from_light[:3, 3].tolist() == [4, 5, 6]
    assert light.radiance == (1.0, 1.0, 1.0)
