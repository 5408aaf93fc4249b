# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Nodes, shadow rays and ends of single pixels' trees: as the oracle counts them, and as a render of the pixel does."""

from __future__ import annotations

import json

import numpy as np
import pytest

from warp_rt import RayTree, Renderer, RenderOptions, load_scene

from ..data import ROOT
from .float64_tree import trace
from .glass_scenes import KINDS, draw_scene
from .oracle_scenes import assert_near, oracle_folder, oracle_module

NAMES = {
    "nodes": "nodes",
    "reflection": "reflection",
    "refraction": "refraction",
    "shadow": "shadow",
    "total_internal_reflection": "tir",
    "dropped_by_depth": "pruned_depth",
    "dropped_by_threshold": "pruned_threshold",
}
"""Counts by our names and the oracle's."""


@pytest.mark.parametrize(("depth", "threshold"), [(7, 0.0), (9, 0.02)])
def test_pixels_of_the_lectures_scene(depth: int, threshold: float) -> None:
    """Thirty pixels whose trees branch. Rays along an edge may part: one pixel in thirty."""
    folder = oracle_folder() / "scenes"
    oracle = oracle_module("oracle")
    scene = oracle.Scene.load(str(folder / "mirror_teapot.json"))
    scene.build()
    camera = json.loads((folder / "mirror_teapot.json").read_text())["camera"]
    width, height = camera["width"], camera["height"]
    options = RenderOptions(width=width, height=height, depth=depth, threshold=threshold)
    renderer = Renderer(load_scene(folder / "mirror_teapot.usda"), options, device="cpu")
    generator = np.random.default_rng(depth)
    same, compared = 0, 0
    while compared < 30:
        x, y = int(generator.integers(width)), int(generator.integers(height))
        tree = renderer.trace_tree(x, y)
        if not any(len(node.children) > 1 for node in tree):
            continue
        compared += 1
        right, up = np.array(camera["right"]), np.array(camera["up"])
        direction = np.array(camera["dir"]) + ((x + 0.5) / width - 0.5) * right + (0.5 - (y + 0.5) / height) * up
        rays = ([camera["eye"]], [direction])
        color, expected, _ = oracle.render(scene, depth, threshold, "krkt", "opaque", rays=rays)
        same += all(tree.counts[ours] == expected[theirs] for ours, theirs in NAMES.items()) and np.allclose(
            tree.value, color[0], atol=1e-4
        )
    assert same >= 29


@pytest.mark.parametrize("kind", KINDS)
def test_all_pixels_of_a_small_picture_of_glass(kind: str) -> None:
    scene = draw_scene(kind, 3)
    width, height, depth = 16, 12, 6
    expected = trace(scene, scene.cameras[0], width, height, depth=depth, transmit=True)
    options = RenderOptions(width=width, height=height, depth=depth, threshold=0.0, shadows="transmit")
    renderer = Renderer(scene, options, device="cpu")
    trees = [renderer.trace_tree(x, y, camera=scene.cameras[0]) for y in range(height) for x in range(width)]
    counts = expected.counts(depth)
    for ours, theirs in NAMES.items():
        assert_near(sum(tree.counts[ours] for tree in trees), counts[theirs], ours)


@pytest.mark.parametrize("name", ["glass", "mirror_teapot", "preview_surface", "shadows"])
def test_counts_are_those_of_a_render_of_the_pixel(name: str) -> None:
    scene = load_scene(ROOT / "scenes" / f"{name}.usda")
    generator = np.random.default_rng(5)
    for x, y in generator.integers((160, 100), size=(8, 2)).tolist():
        options = RenderOptions(width=160, spp=2, crop=(x, y, 1, 1), depth=8)
        renderer = Renderer(scene, options, device="cpu")
        film, tree = renderer.render(), renderer.trace_tree(0, 0)
        assert np.float32(tree.value).tobytes() == film.color[0, 0].tobytes()
        _check_counts(tree, film.rays)


def _check_counts(tree: RayTree, rays: object) -> None:
    for name in ("reflection", "refraction", "shadow", "total_internal_reflection"):
        assert tree.counts[name] == getattr(rays, name), name
    for name in ("dropped_by_depth", "dropped_by_threshold", "deepest"):
        assert tree.counts[name] == getattr(rays, name), name
    assert tree.counts["passage"] == rays.passed
