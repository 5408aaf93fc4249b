# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scratch memory of the workers that grow the ray trees of a tile together."""

from __future__ import annotations

from typing import Any

import warp as wp

from warp_rt.accel import Accel
from warp_rt.kernels.constants import PASS_LIMIT, SHADOW_RAYS, TILE_NODES, TILE_PIXELS
from warp_rt.kernels.group_surfaces import SURFACE_FLOATS
from warp_rt.kernels.ray_tree import task_capacity
from warp_rt.kernels.shadow_queue import ShadowQueue
from warp_rt.kernels.structs import RayTask, ShadowRay
from warp_rt.kernels.tile_trees import TilePixel, TileTrees, TreeNode
from warp_rt.ray_span import make_ray_group


def make_tile_trees(
    accel: Accel, depth: int, *, nodes: int = int(TILE_NODES), shadow_rays: int = int(SHADOW_RAYS)
) -> TileTrees:
    """Return what one worker of the CPU needs; valid as long as it lives.

    Args:
        accel: The hierarchy.
        depth: Levels of the ray trees.
        nodes: How many of trees that grow together there is room for: more than TILE_PIXELS.
        shadow_rays: How many wait at most.
    """
    trees = TileTrees()
    trees.size = int(TILE_PIXELS)
    trees.pixels = _empty(TILE_PIXELS, TilePixel)
    trees.tasks, trees.nodes = _empty(nodes, RayTask), _empty(nodes, TreeNode)
    trees.shadows = _make_queue(accel, nodes + 1, shadow_rays)
    trees.keys, trees.order, trees.ends = _empty(nodes, int), _empty(nodes, int), _empty(9, int)
    trees.group = make_ray_group(accel)
    trees.surfaces = _empty(SURFACE_FLOATS, float)
    capacity = task_capacity(depth, int(PASS_LIMIT))
    trees.walk, trees.path = _empty(capacity, RayTask), _empty(capacity, int)
    return trees


def _make_queue(accel: Accel, nodes: int, rays: int) -> ShadowQueue:
    queue = ShadowQueue()
    queue.rays = _empty(rays, ShadowRay)
    queue.values = _empty(nodes, wp.vec3)
    queue.is_blocked, queue.keys, queue.order = (_empty(rays, int) for _ in range(3))
    queue.ends = _empty(9, int)
    queue.group = make_ray_group(accel)
    queue.stack = queue.group.single_stack
    return queue


def _empty(count: int, dtype: Any) -> wp.array:
    return wp.empty(int(count), dtype=dtype, device="cpu")
