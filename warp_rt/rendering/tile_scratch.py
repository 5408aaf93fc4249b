# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scratch memory of the workers that grow the ray trees of a tile together."""

from __future__ import annotations

import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.bvh.ray_group import empty, make_ray_group
from warp_rt.kernels.constants import GROUP, LIT_FLOATS, SHADOW_RAYS, SURFACE_FLOATS, TILE_NODES, TILE_PIXELS
from warp_rt.kernels.ray_structs import RayTask, ShadowRay
from warp_rt.kernels.tile_structs import LitSurfaces, ShadowQueue, TilePixel, TileTrees, TreeNode
from warp_rt.rendering.task_stack import task_capacity


def make_tile_trees(
    accel: Accel, depth: int, *, nodes: int = int(TILE_NODES), shadow_rays: int = int(SHADOW_RAYS)
) -> TileTrees:
    """Return what one worker of the CPU needs; valid as long as it lives.

    Args:
        accel: The hierarchy.
        depth: Levels of the ray trees.
        nodes: How many of trees that grow together there is room for: more than TILE_PIXELS.
        shadow_rays: How many wait at most: GROUP or more.
    """
    trees = TileTrees()
    trees.size = int(TILE_PIXELS)
    trees.pixels = empty(TILE_PIXELS, TilePixel)
    trees.tasks, trees.nodes = empty(nodes, RayTask), empty(nodes, TreeNode)
    trees.shadows = _make_queue(accel, nodes + 1, shadow_rays)
    trees.keys, trees.order, trees.ends = empty(nodes, int), empty(nodes, int), empty(9, int)
    trees.group = make_ray_group(accel)
    trees.surfaces = empty(SURFACE_FLOATS, float)
    capacity = task_capacity(depth)
    trees.walk, trees.path = empty(capacity, RayTask), empty(capacity, int)
    return trees


def _make_queue(accel: Accel, nodes: int, rays: int) -> ShadowQueue:
    queue = ShadowQueue()
    queue.rays = empty(rays, ShadowRay)
    queue.values = empty(nodes, wp.vec3)
    queue.is_blocked, queue.keys, queue.order = (empty(rays, int) for _ in range(3))
    queue.ends = empty(9, int)
    queue.lit = LitSurfaces()
    queue.lit.rows, queue.lit.depths = empty(LIT_FLOATS, float), empty(GROUP, int)
    queue.group = make_ray_group(accel)
    queue.stack = queue.group.single_stack
    return queue
