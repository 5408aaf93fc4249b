# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Complexity auto: refinements follow from the length of edges in the picture, in closed form."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pxr import Usd

import warp_rt
from warp_rt.api import open_scene
from warp_rt.options import RenderOptions
from warp_rt.rendering.adaptive import EDGE_PIXELS, MAX_LEVEL, AdaptiveSource, refinement_levels
from warp_rt.scene import Scene, Settings

# A square of side 1 that faces an orthographic camera 10 units wide, or a perspective one from DISTANCE.
STAGE = """
def Mesh "m" {{
    point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    {more}
}}
def Camera "flat" {{
    float horizontalAperture = 100
    float verticalAperture = 100
    token projection = "orthographic"
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def Camera "eye" {{
    float horizontalAperture = 20
    float verticalAperture = 20
    float focalLength = 10
    double3 xformOp:translate = (0.5, 0.5, {distance})
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
{others}
"""


def stage_of(more: str = "", distance: float = 10.0, others: str = "") -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString("#usda 1.0\n" + STAGE.format(more=more, distance=distance, others=others))
    return stage


def levels(camera: str, width: int, **fields: object) -> dict[str, int]:
    scene = warp_rt.load_scene(stage_of(**fields))
    return refinement_levels(scene, camera, RenderOptions(width=width))


@pytest.mark.parametrize("width", [10, 20, 40, 100, 200, 1000, 100_00])
def test_edges_are_halved_until_they_are_short_enough(width: int) -> None:
    """The diagonal is sqrt(2) of 10 units that are ``width`` pixels wide."""
    found = levels("flat", width).get("/m", 0)
    longest = np.sqrt(2) * width / 10
    assert found <= MAX_LEVEL
    assert longest / 2**found <= EDGE_PIXELS or found == MAX_LEVEL
    assert found == 0 or longest / 2 ** (found - 1) > EDGE_PIXELS


@pytest.mark.parametrize(("distance", "level"), [(200.0, 0), (20.0, 2), (10.0, 3), (5.0, 4), (0.001, MAX_LEVEL)])
def test_what_is_nearer_is_finer(distance: float, level: int) -> None:
    """A window 2 wide at distance 1, 400 pixels: the diagonal has 400 sqrt(2) / (2 distance) of them."""
    assert levels("eye", 400, distance=distance).get("/m", 0) == level
    if 1 < distance < 200:
        assert level == np.ceil(np.log2(400 * np.sqrt(2) / (2 * distance) / EDGE_PIXELS))


@pytest.mark.parametrize("scale", [(8.0, 8.0, 8.0), (0.125, 0.125, 0.125), (1.0, 1.0, 8.0)])
@pytest.mark.parametrize("name", ["flat", "eye"])
def test_a_scale_of_the_camera_counts_as_it_shows(name: str, scale: tuple[float, float, float]) -> None:
    """Scales stretch an orthographic window, and move a perspective one away; as much of all axes changes nothing."""
    scene = warp_rt.load_scene(stage_of())
    seen = next(camera for camera in scene.cameras if camera.path == f"/{name}")
    scaled = dataclasses.replace(seen, world_from_camera=seen.world_from_camera @ np.diag([*scale, 1.0]))
    # A unit of the world at the square, in pixels of the picture: between the projections of two points.
    ends = np.linalg.inv(scaled.world_from_camera) @ np.array([[0, 1], [0, 0], [0, 0], [1, 1]], float)
    x = ends[0] / -ends[2] if scaled.is_perspective else ends[0]
    left, right, _, _ = scaled.window
    longest = np.sqrt(2) * abs(x[1] - x[0]) / (right - left) * 400
    expected = min(max(int(np.ceil(np.log2(longest / EDGE_PIXELS))), 0), MAX_LEVEL)
    assert refinement_levels(scene, scaled, RenderOptions(width=400)).get("/m", 0) == expected


def test_a_window_beyond_all_bounds_does_no_harm() -> None:
    far = """def Camera "far" {
        float horizontalAperture = 20
        float verticalAperture = 20
        float verticalApertureOffset = -1e38
        double3 xformOp:translate = (0.5, 0.5, 10)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }"""
    assert levels("far", 400, others=far).get("/m", 0) <= MAX_LEVEL


def test_pixels_that_are_not_square_count_by_their_short_side() -> None:
    scene = warp_rt.load_scene(stage_of())
    sizes = {"width": 100, "height": 400}
    for aspect in (1.0, 4.0):  # with the latter, they are 4 times as wide as high
        settings = Settings(pixel_aspect_ratio=aspect, aspect_policy="adjustApertureWidth")
        wide = dataclasses.replace(scene, settings=settings)
        # 10 units high, 400 pixels: the diagonal has 40 sqrt(2) of them.
        assert refinement_levels(wide, "flat", RenderOptions(**sizes)).get("/m", 0) == 4


def test_the_nearest_copy_counts() -> None:
    copies = """
    def "near" (references = </m>) {
        double3 xformOp:translate = (0, 0, 9)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def PointInstancer "i" {
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (0, 0, 9)]
        rel prototypes = </i/p>
        def Mesh "p" (references = </m>) {}
    }
    """
    found = levels("eye", 400, others=copies)
    assert found["/i/p"] == found["/near"] == MAX_LEVEL
    assert found["/m"] == 3


def test_surfaces_are_not_refined_beyond_what_fits() -> None:
    from warp_rt.scene import Instances, Mesh

    n = 1500
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    low = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1)
    triangles = np.stack([low, low + 1, low + n + 2], axis=1).astype(np.int32)
    mesh = Mesh(np.stack([x, y, 0 * x], -1).reshape(-1, 3).astype(np.float32), triangles)
    row = np.zeros(1, np.int32)
    scene = Scene((mesh,), Instances(row, np.eye(4)[None], row, row, row, row - 1), prims=("/m",))
    assert refinement_levels(scene, None, RenderOptions(width=16000)) == {}


def test_scenes_are_refined_by_prim_and_moments_as_their_frame() -> None:
    other = 'def "n" (references = </m>) {\ntoken warp_rt:complexity = ""\n}'
    stage = stage_of('token warp_rt:complexity = "medium"', others=other)
    source = AdaptiveSource(open_scene(stage), RenderOptions(width=200), lambda scene: (scene, "flat"))
    scene = source.scene()
    counts = {
        scene.prims[p]: len(scene.meshes[m].triangles)
        for p, m in zip(scene.instances.prim, scene.instances.mesh, strict=True)
    }
    assert counts == {"/m": 8, "/n": 2 * 4**3}
    moment = source.scene(0.5, base_time=scene.time)
    assert [len(mesh.triangles) for mesh in moment.meshes] == [len(mesh.triangles) for mesh in scene.meshes]


def test_a_picture_is_refined_for_its_camera() -> None:
    """The outline of a refined quad comes near to a circle's: fewer pixels than the cage's square."""
    stage = stage_of()
    options = {"width": 64, "camera": "flat"}
    square, round_one = (warp_rt.render(stage, complexity=name, **options).film.alpha.sum() for name in ("low", "auto"))
    assert 0 < round_one <= square
    refined = warp_rt.load_scene(stage, complexity="high")
    assert warp_rt.render(refined, **options).film.alpha.sum() == pytest.approx(round_one, abs=2)


def test_auto_needs_a_camera() -> None:
    with pytest.raises(warp_rt.errors.OptionError, match="complexity"):
        warp_rt.load_scene(stage_of(), complexity="auto")
