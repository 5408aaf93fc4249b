# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Motion blur against closed forms; coverage (alpha) is what is measured, unless lights move."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd

import warp_rt
from warp_rt.api import open_scene
from warp_rt.rendering.shutter import Moment, plan_moments, render_frame

SIZE = 24  # pixels a side; the window is one unit for each
SPP = 64

HEADER = """#usda 1.0
(
    startTimeCode = 10
    timeCodesPerSecond = 24
    renderSettingsPrimPath = "/Settings"
)
def RenderSettings "Settings"
{
    %s
}
def Camera "c"
{
    token projection = "orthographic"
    float horizontalAperture = 240
    float verticalAperture = 240
    double shutter:open = %g
    double shutter:close = %g
    %s
}
"""
SQUARE = """
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
"""
POINTS = "point3f[] points = [(-2, -8, -5), (2, -8, -5), (2, 8, -5), (-2, 8, -5)]"  # 4 wide, 16 high
# At 9.5 at x = -6, at 10.5 at x = 6: 12 units a frame.
SLIDE = """
    double3 xformOp:translate.timeSamples = { 9.5: (-6, 0, 0), 10.5: (6, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
"""


def stage(body: str, shutter=(-0.5, 0.5), camera: str = "", settings: str = "") -> Usd.Stage:
    made = Usd.Stage.CreateInMemory()
    assert made.GetRootLayer().ImportFromString(HEADER % (settings, *shutter, camera) + body)
    return made


def mesh(points: str = POINTS, more: str = "", name: str = "m") -> str:
    return f'def Mesh "{name}"\n{{\n{points}\n{SQUARE}\n{more}\n}}\n'


def picture(made: Usd.Stage, **options: object) -> tuple[warp_rt.Film, int]:
    """Return the film of the stage's first frame, and how many moments it shows."""
    source = open_scene(made)
    frame = source.scene()
    chosen = warp_rt.RenderOptions(width=SIZE, height=SIZE, **{"spp": SPP, **options})
    renderer = warp_rt.Renderer(frame, chosen, device="cpu")
    return render_frame(renderer, lambda time: (source.scene(time, base_time=frame.time), None))


def trapezoid(width: float, way: float, height: int = 16) -> np.ndarray:
    """Return the coverage of a square that slides along x about the middle of the picture, integrated over pixels."""
    x = np.linspace(-SIZE / 2, SIZE / 2, SIZE * 400 + 1)
    # The share of time that x is covered: the distance, over the way, between the positions that cover it.
    covered = np.clip(x + width / 2, -way / 2, way / 2) - np.clip(x - width / 2, -way / 2, way / 2)
    profile = ((covered[:-1] + covered[1:]) / 2 / way).reshape(SIZE, 400).mean(axis=1)
    rows = np.zeros((SIZE, 1))
    rows[(SIZE - height) // 2 : (SIZE + height) // 2] = 1
    return rows * profile


# Times and places of a pixel's samples are a (0, m, 3)-net in base 2. For boxes in two of its dimensions the number of
# points is off by at most m / 2 + 3 / 2 (Niederreiter 1987); here there are two oblique edges instead.
TOLERANCE = (6 / 2 + 3 / 2) / SPP


@pytest.mark.parametrize(
    "body",
    [
        mesh(more=SLIDE),
        mesh(
            "point3f[] points.timeSamples = { 9.5: [(-8, -8, -5), (-4, -8, -5), (-4, 8, -5), (-8, 8, -5)], "
            "10.5: [(4, -8, -5), (8, -8, -5), (8, 8, -5), (4, 8, -5)] }"
        ),
        # 12 units a frame are 288 a second.
        mesh(
            "point3f[] points.timeSamples = { 10: [(-2, -8, -5), (2, -8, -5), (2, 8, -5), (-2, 8, -5)] }\n"
            "vector3f[] velocities.timeSamples = { 10: [(288, 0, 0), (288, 0, 0), (288, 0, 0), (288, 0, 0)] }"
        ),
        f"""def PointInstancer "i"
        {{
            int[] protoIndices.timeSamples = {{ 10: [0] }}
            point3f[] positions.timeSamples = {{ 10: [(0, 0, 0)] }}
            vector3f[] velocities.timeSamples = {{ 10: [(288, 0, 0)] }}
            rel prototypes = </i/m>
            {mesh()}
        }}""",
    ],
    ids=["transform", "points", "velocities", "instancer"],
)
def test_a_sliding_square_covers_a_trapezoid(body) -> None:
    film, moments = picture(stage(body))
    assert moments == SPP
    expected = trapezoid(4, 12)
    np.testing.assert_allclose(film.alpha, expected, atol=TOLERANCE)
    np.testing.assert_allclose(film.alpha[4:20].mean(axis=0), expected[4], atol=0.01)  # over 16 rows, errors even out
    assert film.alpha.mean() == pytest.approx(expected.mean(), rel=2e-3)  # nothing gets lost
    assert film.rays.primary == SIZE * SIZE * SPP


def test_a_sliding_camera_sees_the_same_from_the_other_side() -> None:
    film, _ = picture(stage(mesh(), camera=SLIDE))
    np.testing.assert_allclose(film.alpha, trapezoid(4, 12), atol=TOLERANCE)


def test_the_shutter_is_about_the_frame_and_in_time_codes() -> None:
    """From the frame on: the square goes from the middle to the right."""
    film, _ = picture(stage(mesh(more=SLIDE), shutter=(0.0, 0.5)))
    np.testing.assert_allclose(film.alpha, np.roll(trapezoid(4, 6), 3, axis=1), atol=TOLERANCE)


def test_a_turning_half_plane() -> None:
    """Turned by 90 degrees about the view, evenly: at angle a within the turn it covers a / 90 degrees of the time."""
    half = "point3f[] points = [(0, -99, -5), (99, -99, -5), (99, 99, -5), (0, 99, -5)]"  # x > 0
    turn = """
        double xformOp:rotateZ.timeSamples = { 9.5: 0, 10.5: 90 }
        uniform token[] xformOpOrder = ["xformOp:rotateZ"]
    """
    film, _ = picture(stage(mesh(half, turn)))
    x = np.arange(SIZE) + 0.5 - SIZE / 2
    angle = np.degrees(np.arctan2(-x[:, None], x[None, :]))  # counter-clockwise from +x, rows from the top
    since = np.abs((angle - 45 + 180) % 360 - 180)  # from the middle of what is covered in the middle of the turn
    expected = np.clip((135 - since) / 90, 0, 1)
    is_far = np.hypot(x[:, None], x[None, :]) > 6  # nearer, a pixel is as wide as the edge's way through it
    assert np.abs(film.alpha - expected)[is_far].max() < 0.08
    assert np.abs(film.alpha - expected)[is_far].mean() < 0.01


def test_accelerations_bend_the_way() -> None:
    """x = v t + a t^2 / 2, so that the mean of x is a T^2 / 24 over a shutter of T about the frame."""
    body = mesh(
        "point3f[] points.timeSamples = { 10: [(-2, -8, -5), (2, -8, -5), (2, 8, -5), (-2, 8, -5)] }\n"
        "vector3f[] velocities.timeSamples = { 10: [(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)] }\n"
        f"vector3f[] accelerations.timeSamples = {{ 10: [{', '.join(['(13824, 0, 0)'] * 4)}] }}"  # 24 units a frame^2
    )
    film, _ = picture(stage(body))
    x = np.arange(SIZE) + 0.5 - SIZE / 2
    assert (film.alpha * x).sum() / film.alpha.sum() == pytest.approx(24 / 24, abs=0.02)


WHITE = 'color3f[] primvars:displayColor = [(1, 1, 1)] (interpolation = "constant")'


def test_a_turning_light_is_the_mean_of_its_directions() -> None:
    """Turned about X from -60 to 60 degrees it gives a wall the mean of cos: sin(60 degrees) over 60 degrees."""
    light = """def DistantLight "l"
        {
            float inputs:intensity = 1
            float inputs:angle = 0
            float xformOp:rotateX.timeSamples = { 9.5: -60, 10.5: 60 }
            uniform token[] xformOpOrder = ["xformOp:rotateX"]
        }
        """
    film, _ = picture(stage(mesh(more=WHITE) + light), spp=32)
    expected = np.sin(np.pi / 3) / (np.pi / 3) / np.pi
    np.testing.assert_allclose(film.color[SIZE // 2, SIZE // 2], expected, rtol=1e-3)  # 32 midpoints: 2e-4


def test_what_lights_and_materials_are_counts_at_the_frame() -> None:
    """As in Hydra: exporters sweep a parameter from frame to frame, where nothing would stand still to be seen."""
    light = """def DistantLight "l"
        {
            float inputs:intensity.timeSamples = { 9.5: 1, 10: 1, 10.5: 3 }
            float inputs:angle = 0
        }
        """
    still, moments = picture(stage(mesh(more=WHITE) + light), spp=4)
    assert moments == 1
    np.testing.assert_allclose(still.color[SIZE // 2, SIZE // 2], 1 / np.pi, rtol=1e-5)
    film, moments = picture(stage(mesh(more=WHITE) + light + mesh(more=SLIDE, name="moving")), spp=4)
    assert moments == 4
    np.testing.assert_allclose(film.color[SIZE // 2, SIZE // 2], 1 / np.pi, rtol=1e-5)


def test_a_light_that_is_switched_off_by_its_visibility_shines_for_a_while() -> None:
    """Visibility is no input: it counts at each time, of a light as of a mesh."""
    lamp = """def DistantLight "%s"
        {
            float inputs:intensity = %s
            float inputs:angle = 0
            token visibility.timeSamples = { %s }
        }
        """
    lit = lamp % ("l", 1, '9: "inherited"')
    for times in ('9: "invisible", 10.25: "inherited"', '9: "inherited", 9.75: "invisible"'):
        film, _ = picture(stage(mesh(more=WHITE) + lit + lamp % ("some", 4, times)), spp=4)
        np.testing.assert_allclose(film.color[SIZE // 2, SIZE // 2], (1 + 4 / 4) / np.pi, rtol=1e-5)


def test_topology_may_change() -> None:
    """Half of the time there is a square on the left, half of the time a triangle on the right."""
    body = """def Mesh "m"
        {
            point3f[] points.timeSamples = {
                9.5: [(-8, -8, -5), (-4, -8, -5), (-4, 8, -5), (-8, 8, -5)],
                10: [(0, -12, -5), (12, -12, -5), (12, 0, -5)] }
            int[] faceVertexCounts.timeSamples = { 9.5: [4], 10: [3] }
            int[] faceVertexIndices.timeSamples = { 9.5: [0, 1, 2, 3], 10: [0, 1, 2] }
            uniform token subdivisionScheme = "none"
        }"""
    film, _ = picture(stage(body), spp=8)
    assert (film.alpha[12, 4:8] == 0.5).all()
    assert (film.alpha[20, 18:23] == 0.5).all()
    assert film.alpha[12, 9] == 0


# --- what does not blur


def test_what_stands_still_is_drawn_once_and_the_same() -> None:
    still, moments = picture(stage(mesh()), spp=4)
    assert moments == 1
    closed, _ = picture(stage(mesh(), shutter=(0, 0)), spp=4)
    np.testing.assert_array_equal(still.color, closed.color)
    np.testing.assert_array_equal(still.alpha, closed.alpha)
    # Motion before and after the shutter is open counts no more than none.
    before = SLIDE.replace("9.5", "8").replace("10.5", "9")
    assert picture(stage(mesh(more=before)), spp=4)[1] == 1


def test_samples_have_the_places_of_the_whole_picture() -> None:
    """What something unseen moves, the still rest of the picture is the one that is drawn in one go, bit for bit."""
    unseen = mesh("point3f[] points = [(90, 0, -5), (91, 0, -5), (91, 1, -5), (90, 1, -5)]", SLIDE, "unseen")
    blurred, moments = picture(stage(mesh() + unseen), spp=8)
    sharp, _ = picture(stage(mesh() + unseen, shutter=(0, 0)), spp=8)
    assert moments == 8
    np.testing.assert_array_equal(blurred.alpha, sharp.alpha)


@pytest.mark.parametrize(
    ("settings", "shutter", "shift"),
    [
        ("uniform bool disableMotionBlur = 1", (-0.5, 0.5), 0),
        ("uniform bool instantaneousShutter = 1", (-0.5, 0.5), -6),  # the shutter closes as it opens
        ("", (0.25, 0.25), 3),  # likewise
        ("", (0.5, -0.5), 0),  # which exposes nothing
        ("uniform bool disableMotionBlur = 1", (0.5, -0.5), 0),  # "setting the shutter interval [...] to [0,0]"
        ("uniform bool instantaneousShutter = 1", (0.5, -0.5), 6),
    ],
)
def test_an_instant_is_sharp(settings, shutter, shift) -> None:
    """A shutter that closes before it opens makes a black picture (UsdGeomCamera), unless the settings mend it."""
    film, _ = picture(stage(mesh(more=SLIDE), shutter=shutter, settings=settings), spp=4)
    expected = np.zeros((SIZE, SIZE))
    expected[4:20, 10 + shift : 14 + shift] = 1
    np.testing.assert_array_equal(film.alpha, expected)
    is_exposed = shutter[0] <= shutter[1] or settings != ""
    np.testing.assert_array_equal(film.color.any(axis=2), expected * is_exposed)


@pytest.mark.parametrize(
    ("settings", "codes"),
    [
        ("", ["W424"]),
        ("uniform bool disableMotionBlur = 1", []),
        ("uniform bool instantaneousShutter = 1", []),
    ],
)
def test_a_shutter_that_exposes_nothing_is_told_unless_the_settings_mend_it(settings, codes) -> None:
    scene = warp_rt.load_scene(stage(mesh(), shutter=(0.5, -0.5), settings=settings))
    assert [record.code for record in scene.diagnostics] == codes


def test_one_sample_shows_the_frames_time_and_says_so() -> None:
    made = stage(mesh(more=SLIDE))
    renderer = warp_rt.Renderer(warp_rt.load_scene(made), warp_rt.RenderOptions(width=SIZE, height=SIZE), device="cpu")
    film = renderer.render()
    assert [note.code for note in renderer.diagnostics] == ["N902", "N931"]
    assert film.alpha[12].tolist() == [0.0] * 10 + [1.0] * 4 + [0.0] * 10
    assert picture(made, spp=1)[1] == 1


def test_other_aovs_are_of_the_frames_own_time() -> None:
    options = {"aovs": ("color", "depth", "primId", "treeSize"), "spp": 16}
    film, _ = picture(stage(mesh(more=SLIDE)), **options)
    assert list(film.aovs) == ["color", "treeSize", "alpha", "depth", "primId"]
    assert np.isfinite(film.aovs["depth"][12]).sum() == 4
    assert (film.aovs["primId"][12] == 0).sum() == 4
    np.testing.assert_array_equal(film.aovs["treeSize"], 16)  # sums over the samples: each pixel has 16 eye rays
    assert film.rays.primary == 16 * SIZE * SIZE


def test_the_default_time_does_not_move() -> None:
    scene = warp_rt.load_scene(stage(mesh(more=SLIDE)), default_time=True)
    assert scene.cameras[0].shutter == (0, 0)
    assert warp_rt.load_scene(stage(mesh(more=SLIDE))).cameras[0].shutter == (-0.5, 0.5)


# --- moments


def test_moments_are_stratified() -> None:
    assert plan_moments(10.0, (-0.25, 0.75), 4) == (
        Moment(9.875, range(1)),
        Moment(10.125, range(1, 2)),
        Moment(10.375, range(2, 3)),
        Moment(10.625, range(3, 4)),
    )
    assert plan_moments(10.0, (0.25, 0.25), 4) == (Moment(10.25, range(4)),)
    for frame, shutter, spp in ((None, (0.0, 1.0), 4), (10.0, (0.0, 0.0), 4), (10.0, (0.0, 1.0), 1)):
        assert plan_moments(frame, shutter, spp) == ()
