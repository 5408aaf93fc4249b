# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Traversal stacks."""

from __future__ import annotations

import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.kernels import constants
from warp_rt.kernels.bvh_structs import Stacks


def make_stacks(accel: Accel, rows: int = 1) -> Stacks:
    """Return traversal stacks on the accel's device.

    Args:
        accel: The hierarchy to traverse.
        rows: On a GPU, the number of threads of the launch. On the CPU one row serves a whole launch, but launches
            that run at the same time need stacks of their own.
    """
    stacks = Stacks()
    for name, dtype in (("codes", wp.int32), ("distances", wp.float32)):
        if accel.device == "cpu":
            # All children of a node are written at once, and then as many count as the ray meets.
            entries = wp.empty((rows, accel.stack_size + constants.WIDTH), dtype=dtype, device=accel.device)
        else:
            # Threads of a GPU reach the same depth at about the same time: the entries of one depth are neighbours.
            entries = wp.empty((accel.stack_size, rows), dtype=dtype, device=accel.device).transpose()
        setattr(stacks, name, entries)
    return stacks
