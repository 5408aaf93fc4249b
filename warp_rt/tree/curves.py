# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The rays of a tree as line segments in the scene."""

from __future__ import annotations

import math

import numpy as np

from warp_rt.tree.lines import KIND_STYLES
from warp_rt.tree.nodes import LightTerm, TreeNode, Vector
from warp_rt.tree.pixel_tree import PixelTree

CURVE_COLORS = {
    "eye": (1.0, 0.8, 0.1),
    "reflection": (0.9, 0.05, 0.1),
    "refraction": (0.05, 0.3, 0.9),
    "passage": (0.1, 0.6, 0.1),
    "light": (1.0, 1.0, 0.6),
    "shadow": (0.15, 0.05, 0.2),
}
"""Linear colour of each kind: rays of the tree, shadow rays that reach the light, and those that do not."""

LEAVING = 0.25
"""Length of rays that end nowhere, in diagonals of the scene."""
WIDTH = 0.002
"""Of the curves, in diagonals of the scene."""

Segments = np.ndarray
"""float64, shape [n, 2, 3], world space: from, to."""


def ray_segments(tree: PixelTree) -> dict[str, Segments]:
    """Return the segments of each kind that the tree has, by the names of ``CURVE_COLORS``."""
    found: dict[str, list[tuple[Vector, Vector]]] = {kind: [] for kind in CURVE_COLORS}
    length = LEAVING * tree.scene_size
    for node in tree:
        found[KIND_STYLES[node.kind]].append((node.origin, _end(node, length)))
        for light in node.lights:
            if light.has_shadow_ray:
                kind = "light" if any(light.visible) else "shadow"
                found[kind].append((node.position, _shadow_end(node, light, length)))
    return {kind: np.array(segments) for kind, segments in found.items() if segments}


def _end(node: TreeNode, length: float) -> Vector:
    return _along(node.origin, node.direction, length) if node.has_left else node.position


def _shadow_end(node: TreeNode, light: LightTerm, length: float) -> Vector:
    distance = light.distance
    if not any(light.visible) and light.crossings:
        distance = light.crossings[-1].distance
    return _along(node.position, light.to_shadow, distance if math.isfinite(distance) else length)


def _along(start: Vector, direction: Vector, distance: float) -> Vector:
    x, y, z = (a + distance * b for a, b in zip(start, direction, strict=True))
    return x, y, z
