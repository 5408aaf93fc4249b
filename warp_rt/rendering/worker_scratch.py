# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What one worker's launches of a render kernel need: scratch memory for ray trees, and a row of counters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.bvh.stacks import make_stacks
from warp_rt.device.arrays import array_of_one
from warp_rt.kernels import ray_counts
from warp_rt.kernels.ray_structs import RayTask
from warp_rt.kernels.tile_structs import TileTrees
from warp_rt.rendering.task_stack import task_capacity
from warp_rt.rendering.tile_scratch import make_tile_trees

_CUDA_COUNTER_ROWS = 256  # spreads atomic additions


@dataclass(frozen=True)
class Scratch:
    """Arguments of a kernel that are a worker's own."""

    arguments: list[Any]
    """Scratch memory, and last the counters."""
    kept: Any = None
    """What has to live as long."""

    @property
    def counts(self) -> np.ndarray:
        """Counters summed over threads: int64, shape [counters]."""
        return self.arguments[-1].numpy().sum(axis=0, dtype=np.int64)


def walking_scratch(accel: Accel, depth: int, rows: int) -> Scratch:
    """Return ray tasks, traversal stacks and counters, for trees that are walked ray by ray.

    Args:
        accel: Its device takes them, its hierarchies say how long stacks are.
        depth: Levels of the trees.
        rows: Threads that run at once.
    """
    tasks = wp.empty(shape=(rows, task_capacity(depth)), dtype=RayTask, device=accel.device)
    return Scratch([tasks, make_stacks(accel, rows), _counters(depth, accel.device)])


def together_scratch(accel: Accel, depth: int) -> Scratch:
    """Return the trees of a tile, which grow together on a CPU, and counters."""
    trees = make_tile_trees(accel, depth)
    return Scratch([array_of_one(trees, TileTrees, accel.device), _counters(depth, accel.device)], kept=trees)


def _counters(depth: int, device: str) -> wp.array:
    elements = int(ray_counts.LEVELS) + int(ray_counts.PER_LEVEL) * depth
    rows = 1 if device == "cpu" else _CUDA_COUNTER_ROWS
    return wp.zeros(shape=(rows, elements), dtype=wp.int64, device=device)
