# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Images are read and uploaded once for all scenes of a stage in which they are the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PilImage

import warp_rt
from warp_rt.api import open_scene
from warp_rt.rendering.shutter import render_frame
from warp_rt.upload import device_images
from warp_rt.usd import image_cache

STAGE = """#usda 1.0
(
    startTimeCode = 0
    timeCodesPerSecond = 24
)
def Camera "c" {
    token projection = "orthographic"
    float horizontalAperture = 80
    float verticalAperture = 80
    double shutter:open = -0.5
    double shutter:close = 0.5
}
def DomeLight "sky" {
    asset inputs:texture:file = @sky.png@
}
def RectLight "lamp" {
    float inputs:width = 8
    float inputs:height = 8
    asset inputs:texture:file = @a.png@
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Material "mat" {
    token outputs:surface.connect = </mat/surface.outputs:surface>
    def Shader "surface" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </mat/texture.outputs:rgb>
        token outputs:surface
    }
    def Shader "texture" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @a.png@
        asset inputs:file.timeSamples = { 0: @a.png@, 8: @b.png@ }
        float2 inputs:st.connect = </mat/reader.outputs:result>
        float3 outputs:rgb
    }
    def Shader "reader" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }
}
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    point3f[] points = [(-2, -3, -5), (2, -3, -5), (2, 3, -5), (-2, 3, -5)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
    rel material:binding = </mat>
    double3 xformOp:translate.timeSamples = { -1: (-2, 0, 0), 1: (2, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


def write_png(path: Path, seed: int) -> None:
    texels = np.random.default_rng(seed).integers(0, 256, (8, 16, 3), np.uint8)
    PilImage.fromarray(texels).save(path)


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    for seed, name in enumerate(("a", "b", "sky")):
        write_png(tmp_path / f"{name}.png", seed)
    (tmp_path / "stage.usda").write_text(STAGE)
    return tmp_path / "stage.usda"


@pytest.fixture
def read(monkeypatch) -> list[str]:
    """Return the names of the files that are read from now on."""
    names: list[str] = []
    reader = image_cache.read_image_file

    def counting(path: str):
        names.append(Path(path).name)
        return reader(path)

    monkeypatch.setattr(image_cache, "read_image_file", counting)
    return names


def blurred(stage: Path, *, is_shared: bool, **options: object) -> tuple[warp_rt.Film, int]:
    """Return a picture, and how many moments it shows; every scene is of a source of its own, or all are of one."""
    source = open_scene(stage)
    chosen = warp_rt.RenderOptions(width=8, height=8, spp=4, **options)
    renderer = warp_rt.Renderer(source.scene(), chosen, device="cpu")

    def view(time: float):
        return (source if is_shared else open_scene(stage)).scene(time, base_time=0.0), None

    return render_frame(renderer, view)


def test_a_blurred_picture_reads_and_reduces_each_image_once(stage, read, monkeypatch) -> None:
    made = []
    levels = device_images.coarser_levels
    monkeypatch.setattr(device_images, "coarser_levels", lambda *args, **how: made.append(1) or levels(*args, **how))
    _, moments = blurred(stage, is_shared=True)
    assert moments == 4
    assert sorted(read) == ["a.png", "sky.png"]
    assert len(made) == 2


@pytest.mark.parametrize("light_samples", [0, 1])
def test_a_blurred_picture_is_that_of_images_read_anew(stage, read, light_samples) -> None:
    shared, _ = blurred(stage, is_shared=True, light_samples=light_samples)
    read.clear()
    anew, _ = blurred(stage, is_shared=False, light_samples=light_samples)
    assert len(read) == 2 * 5
    np.testing.assert_array_equal(shared.color, anew.color)
    assert np.ptp(shared.color) > 0


def test_frames_share_images_until_another_file_is_named(stage, read) -> None:
    source = open_scene(stage)
    first, second, third = (source.scene(time) for time in (0.0, 4.0, 8.0))
    assert [id(image) for image in first.images] == [id(image) for image in second.images]
    names = sorted(Path(image.path).name for image in third.images)
    assert names == ["a.png", "b.png", "sky.png"]  # the lamp's is the same as before
    assert sorted(read) == names
    assert {id(image) for image in first.images} < {id(image) for image in third.images}


def test_pictures_of_successive_frames_are_those_of_single_ones(stage) -> None:
    source, options = open_scene(stage), warp_rt.RenderOptions(width=8, height=8)
    renderer = None
    for time in (0.0, 4.0, 8.0):
        scene = source.scene(time)
        renderer = warp_rt.Renderer(scene, options, device="cpu", previous=renderer)
        alone = warp_rt.Renderer(scene, options, device="cpu")
        np.testing.assert_array_equal(renderer.render().color, alone.render().color)
        assert renderer.device_bytes == alone.device_bytes


def test_only_what_the_latest_scene_has_used_is_kept(stage, read) -> None:
    source = open_scene(stage)
    for time in (0.0, 8.0, 0.0, 8.0):
        source.scene(time)
    assert sorted(read) == ["a.png", "b.png", "b.png", "sky.png"]


def test_a_file_that_is_written_again_is_read_again(stage, read) -> None:
    source = open_scene(stage)
    source.scene(0.0)
    write_png(stage.parent / "sky.png", 7)
    read.clear()
    source.scene(4.0)
    assert read == ["sky.png"]


def test_tiles_that_cannot_be_used_are_told_of_every_scene(stage, read) -> None:
    write_png(stage.parent / "t.1001.png", 3)
    (stage.parent / "t.1002.png").write_bytes(b"damaged")
    stage.write_text(stage.read_text().replace("{ 0: @a.png@, 8: @b.png@ }", "{ 0: @t.<UDIM>.png@ }"))
    source = open_scene(stage)
    first, second = (source.scene(time) for time in (0.0, 4.0))
    told = [d for d in first.diagnostics if d.code == "W202"]
    assert len(told) == 1
    assert told == [d for d in second.diagnostics if d.code == "W202"]
    assert [id(image) for image in first.images] == [id(image) for image in second.images]
    assert len(read) == 4
