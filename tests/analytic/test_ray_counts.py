# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ray counts with a closed form: a box of mirrors, where no ray ends, and a half-silvered pane, where each splits."""

from __future__ import annotations

import math

import pytest

from warp_rt.scene import Camera, LightKind, Scene

from .scenes import box, lamp, looking, parallel, render, scene_of, square, whitted

WIDTH, HEIGHT = 8, 6
PIXELS = WIDTH * HEIGHT


def mirror_box(lights: int) -> tuple[Scene, Camera]:
    """Return a box of mirrors (Kr = 1/2) with lamps in it, and a camera that looks round from inside."""
    mirrors = box(whitted(diffuse=0.5, reflection=0.5), (-3, -2, -4), (3, 2, 4))
    lamps = [lamp(LightKind.POINT, (0.4 * k - 0.5, 0.3, -1.0)) for k in range(lights)]
    camera = Camera("/eye", looking((0.3, 0.2, -1.0), (0.2, -0.1, 0.7)), (-1.0, 1.0, -0.75, 0.75), is_perspective=True)
    return scene_of(mirrors, lights=lamps), camera


@pytest.mark.parametrize("lights", [1, 3])
@pytest.mark.parametrize("depth", [1, 2, 9])
def test_box_of_mirrors_by_depth(depth: int, lights: int) -> None:
    """Every ray meets a wall, which faces every lamp, and is mirrored once; depth alone ends it."""
    scene, camera = mirror_box(lights)
    rays = render(scene, camera, width=WIDTH, height=HEIGHT, depth=depth).rays
    for level in rays.per_depth:
        mirrored = 0 if level.depth == 1 else PIXELS
        assert (level.nodes, level.reflection, level.refraction) == (PIXELS, mirrored, 0)
        assert level.shadow == lights * PIXELS
        assert level.dropped_by_threshold == 0
        assert level.dropped_by_depth == (PIXELS if level.depth == depth else 0)
    assert (rays.deepest, rays.dropped_by_depth) == (depth, PIXELS)


@pytest.mark.parametrize(("threshold", "deepest"), [(1.0, 1), (0.5, 2), (0.3, 2), (1 / 255, 8)])
def test_box_of_mirrors_by_threshold(threshold: float, deepest: int) -> None:
    """A ray at depth d weighs 2^(1 - d); the first one below the threshold is dropped, at its parent's depth."""
    assert deepest == 1 + math.floor(-math.log2(threshold))
    scene, camera = mirror_box(1)
    rays = render(scene, camera, width=WIDTH, height=HEIGHT, depth=20, threshold=threshold).rays
    assert [level.nodes for level in rays.per_depth] == deepest * [PIXELS]
    assert [level.dropped_by_threshold for level in rays.per_depth] == [*(deepest - 1) * [0], PIXELS]
    assert (rays.dropped_by_threshold, rays.dropped_by_depth) == (PIXELS, 0)


def split_tree() -> tuple[Scene, Camera]:
    """Return a pane that mirrors and lets through, between two mirrors, and a beam across them.

    Rays at odd depths meet the pane and split in two, those at even depths meet a mirror: 2^floor(d / 2) at depth d.
    """
    pane = square(whitted(reflection=0.5, transmission=0.5))
    mirror = whitted(reflection=1.0)
    return scene_of(pane, square(mirror, z=-1.0), square(mirror, z=1.0)), parallel((0.3, 0.1, 0.5))


@pytest.mark.parametrize("depth", [1, 2, 3, 8, 11])
def test_pane_doubles_the_rays(depth: int) -> None:
    scene, camera = split_tree()
    rays = render(scene, camera, depth=depth).rays
    assert [level.nodes for level in rays.per_depth] == [2 ** (d // 2) for d in range(1, depth + 1)]
    for level in rays.per_depth[1:]:
        assert level.refraction == (level.nodes // 2 if level.depth % 2 == 0 else 0)
    assert rays.dropped_by_depth == rays.per_depth[-1].dropped_by_depth == 2 ** ((depth + 1) // 2)
