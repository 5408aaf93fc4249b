# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scratch memory of rays that go through the hierarchy in a group."""

from __future__ import annotations

from typing import Any

import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.kernels.bvh_structs import Stack
from warp_rt.kernels.constants import GROUP, GROUP_FLOATS, WIDTH
from warp_rt.kernels.group_structs import GroupStack, RayGroup

_OCTANTS = 8


def make_ray_group(accel: Accel) -> RayGroup:
    """Return the memory of a group of rays and of its way through a hierarchy; valid as long as it lives."""
    group = RayGroup()
    group.rays = empty(2 * GROUP_FLOATS, float)
    group.ends, group.u, group.v = (empty(GROUP, float) for _ in range(3))
    group.words, group.records = empty(GROUP, int), empty(GROUP, int)
    group.senders = wp.full(GROUP, -1, dtype=int, device="cpu")  # what the rays of a query start on is not known
    group.triangles, group.skips = empty(GROUP, int), empty(GROUP, int)
    # All children of a node are written at once to a single ray's stack, and then as many count as it meets.
    group.single_stack = Stack()
    group.single_stack.codes = empty(accel.stack_size + WIDTH, int)
    group.single_stack.distances = empty(accel.stack_size + WIDTH, float)
    group.stack = GroupStack()
    entries = accel.stack_size + _OCTANTS + WIDTH  # the rays in an instance are up to eight parts
    group.stack.codes, group.stack.rays = empty(entries, int), empty(entries, wp.uint32)
    group.stack.distances = empty(entries, float)
    return group


def empty(count: int, dtype: Any) -> wp.array:
    """Return an array of the CPU whose elements somebody will write."""
    return wp.empty(int(count), dtype=dtype, device="cpu")
