# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The tree of a pixel sums to the pixel of the picture: a thousand random pixels, on our stages and on others'."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import warp_rt
from warp_rt.tree.nodes import LightTerm, TreeNode

from ..data import ROOT, find_test_data

STAGES = sorted((ROOT / "scenes").glob("*.usda"))
_OPENUSD = "OpenUSD/pxr/usdImaging/usdImagingGL/testenv"
CORPORA = (  # glass, cut-outs, domes, clearcoat, normal maps, instances, area lights
    f"{_OPENUSD}/testUsdImagingGLBasicDrawing/basicDrawing/transparentGrayscale.usda",
    f"{_OPENUSD}/testUsdImagingGLPreviewSurface/testPreviewSurfaceTextureOpacity.usda",
    f"{_OPENUSD}/testUsdImagingGLPreviewSurface/testPreviewSurfaceOpacityThreshold.usda",
    "arnold-usd/testsuite/test_0243/data/test.usda",
    "arnold-usd/testsuite/test_1524/data/test.usd",
    "hdmitsuba/hdmitsuba/test_assets/materials/materials.usda",
    "kaolin/tests/samples/rocket_hetero_subsets_materials.usd",
    "materialxusd/tests/resources/Materials/Examples/UsdPreviewSurface/USD_Car_Paint.usda",
)
PIXELS = 80  # a stage; on our thirteen stages alone they are more than a thousand
ROUNDING = 2.0**-21  # of the sum of magnitudes: float32 sums of trees of some ten nodes, held against float64


def check_pixels(
    path: Path, spp: int, shadows: str, pixels: int = PIXELS, device: str = "cpu", light_samples: int = 0
) -> None:
    """Hold the trees of random pixels of a stage against its picture."""
    options = warp_rt.RenderOptions(
        width=160, spp=spp, light_samples=light_samples, shadows=shadows, ambient=(0.2, 0.3, 0.4), depth=6
    )
    renderer = warp_rt.Renderer(warp_rt.load_scene(path), options, device=device)
    film = renderer.render()
    generator = np.random.default_rng(len(path.name))
    for x, y in zip(
        generator.integers(film.width, size=pixels), generator.integers(film.height, size=pixels), strict=True
    ):
        tree = renderer.trace_tree(int(x), int(y))
        assert len(tree.roots) == spp
        assert np.float32(tree.value).tobytes() == film.color[y, x].tobytes()
        assert tree.alpha == film.alpha[y, x]
        scale = np.abs([node.contribution for node in tree]).sum() + 1e-30
        nested = np.mean([root.value for root in tree.roots], axis=0) * tree.exposure_scale
        np.testing.assert_allclose(nested, film.color[y, x], rtol=0, atol=ROUNDING * scale * tree.exposure_scale)
        np.testing.assert_array_equal(np.float32(tree.value), _sum_as_traced(tree) * np.float32(tree.exposure_scale))
        for node in tree:
            _check_node(node)


def _sum_as_traced(tree: warp_rt.RayTree) -> np.ndarray:
    """Return the mean of the samples' sums of nodes, in float32 and in the order of tracing."""
    total = np.zeros(3, np.float32)
    for root in tree.roots:
        sample = np.zeros(3, np.float32)
        for node in root.walk():
            sample += np.float32(node.coefficient) * np.float32(node.presence) * np.float32(node.local)
        total += sample
    return total / np.float32(len(tree.roots))


def _check_node(node: TreeNode) -> None:
    if node.has_left:
        return
    local = np.float32(node.emission) + np.float32(node.ambient)
    for light in node.lights:
        local = local + _term(light)
        # Diffuse and specular part are rounded on their own.
        parts = np.add(light.diffuse, light.specular)
        np.testing.assert_allclose(parts, light.total, rtol=4e-6, atol=1e-12)
    np.testing.assert_array_equal(local, np.float32(node.local))


def _term(light: LightTerm) -> np.ndarray:
    """Return what the kernel adds for a light: of a dome as a whole, the sum of its two parts."""
    if light.kind == "dome" and not light.samples:
        return np.float32(light.diffuse) + np.float32(light.specular)
    return np.float32(light.total)


def test_pixels_on_every_device(device: str) -> None:
    check_pixels(ROOT / "scenes" / "glass.usda", spp=2, shadows="auto", pixels=20, device=device)


@pytest.mark.parametrize("path", STAGES, ids=lambda path: path.stem)
def test_pixels_of_our_stages(path: Path) -> None:
    check_pixels(path, spp=1, shadows="auto")


@pytest.mark.parametrize("name", ["glass", "mirror_teapot", "shadows"])
def test_pixels_of_many_samples_under_transmitting_shadows(name: str) -> None:
    check_pixels(ROOT / "scenes" / f"{name}.usda", spp=3, shadows="transmit", pixels=30)


@pytest.mark.parametrize("name", ["dome", "glass", "lights", "preview_surface"])
def test_pixels_of_sampled_lights(name: str) -> None:
    check_pixels(ROOT / "scenes" / f"{name}.usda", spp=2, shadows="auto", pixels=40, light_samples=3)


@pytest.mark.parametrize("name", CORPORA, ids=lambda name: Path(name).stem)
def test_pixels_of_stages_by_others(name: str) -> None:
    corpora = find_test_data("corpora")
    if corpora is None:
        pytest.skip("the corpora are not at hand: set WARP_RT_TEST_DATA to the folder that holds corpora/")
    check_pixels(corpora / name, spp=1, shadows="auto")
