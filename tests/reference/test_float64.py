# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pictures and ray counts against our own float64 tracer, at depth 1 to 7, where ray trees are hard.

The tracer itself is held to the oracles' pictures, which agree with POV-Ray's, where those have an answer.
"""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import Renderer, RenderOptions, Scene, load_scene

from .float64_tree import trace
from .glass_scenes import HEIGHT, KINDS, WIDTH, draw_scene
from .oracle_scenes import assert_same_counts, assert_same_image, oracle_folder

DEEPEST = 7


def check(scene: Scene, *, shadows: str, threshold: float, depths: range) -> None:
    """Compare pictures and counts of some depths; the reference is traced once, for the deepest."""
    tree = trace(
        scene,
        scene.cameras[0],
        WIDTH,
        HEIGHT,
        depth=depths[-1],
        threshold=threshold,
        transmit=shadows == "transmit",
    )
    for depth in depths:
        options = RenderOptions(
            width=WIDTH, height=HEIGHT, depth=depth, threshold=threshold, shadows=shadows, texture_filter="bilinear"
        )
        film = Renderer(scene, options, device="cpu").render(camera=scene.cameras[0])
        assert_same_image(film.color, tree.image(depth))
        assert_same_counts(film, tree.counts(depth))


@pytest.mark.parametrize(("kind", "shadows"), list(zip(KINDS, ("opaque", "transmit") * 3, strict=True)))
def test_every_depth(kind: str, shadows: str) -> None:
    check(draw_scene(kind, 0), shadows=shadows, threshold=0.0, depths=range(1, DEEPEST + 1))


@pytest.mark.parametrize("kind", ["overlapping", "textures"])
def test_threshold(kind: str) -> None:
    check(draw_scene(kind, 1), shadows="transmit", threshold=0.02, depths=range(9, 10))


@pytest.mark.heavy
@pytest.mark.parametrize("seed", range(2, 22))
@pytest.mark.parametrize("kind", KINDS)
def test_sweep(kind: str, seed: int) -> None:
    shadows = ("transmit", "opaque")[seed % 2]
    check(draw_scene(kind, seed), shadows=shadows, threshold=0.0, depths=range(DEEPEST, DEEPEST + 1))
    check(draw_scene(kind, seed), shadows=shadows, threshold=0.03, depths=range(9, 10))


@pytest.mark.parametrize("name", ["random_1", "random_2"])
def test_the_reference_agrees_with_the_oracle(name: str) -> None:
    """Two float64 programs, two authors: all but the few pixels whose rays pass within 1e-4 of another surface."""
    folder = oracle_folder()
    scene = load_scene(folder / "scenes" / f"{name}.usda")
    tree = trace(scene, scene.cameras[0], 160, 160, depth=7)
    for depth in (1, 7):
        expected = np.load(folder / "expected" / f"{name}_depth{depth}.npz")["img"]
        assert (np.abs(tree.image(depth) - expected).max(axis=-1) <= 2e-6).mean() >= 0.9995
