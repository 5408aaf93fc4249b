# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How long the task stack of a ray tree has to be that is walked ray by ray."""

from __future__ import annotations

import warp as wp

from warp_rt.kernels.constants import PASS_LIMIT
from warp_rt.kernels.ray_structs import RayTask


def task_capacity(depth: int) -> int:
    """Return how many tasks of a tree of ``depth`` levels can wait at once.

    A node pops one task and pushes at most three: its pass-through, its refraction and its reflection. Depth first, two
    of them wait while the third is followed, and no path has more nodes than bounces and pass-throughs together.
    """
    return 2 * (depth + int(PASS_LIMIT)) + 1


def task_bytes(depth: int) -> int:
    """Return the memory of a pixel's tasks [byte]."""
    return int(task_capacity(depth) * wp.types.type_size_in_bytes(RayTask))
