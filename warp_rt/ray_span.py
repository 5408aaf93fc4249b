# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scratch memory of the queries that take rays in groups."""

from __future__ import annotations

import warp as wp

from warp_rt.accel import Accel, make_stacks
from warp_rt.kernels.bvh_group import GroupEntry, RayGroup
from warp_rt.kernels.bvh_structs import Stack
from warp_rt.kernels.constants import GROUP, GROUP_RAY_FLOATS, GROUP_SPAN, WIDTH
from warp_rt.kernels.intersect_packet import PacketRay
from warp_rt.kernels.query_group import RaySpan


def make_ray_span(accel: Accel) -> RaySpan:
    """Return what one worker of the CPU needs to take spans of rays through a hierarchy; valid as long as it lives."""
    group = RayGroup()
    group.words = _empty(2 * GROUP_RAY_FLOATS, float)
    group.rays = _empty(2 * GROUP, PacketRay)
    group.ends, group.u, group.v = (_empty(GROUP, float) for _ in range(3))
    group.word, group.record = _empty(GROUP, int), _empty(GROUP, int)
    group.distances, group.masks, group.tuv = _empty(WIDTH, float), _empty(WIDTH, wp.uint32), _empty(4, float)
    group.entries = _empty(accel.stack_size, GroupEntry)
    stacks = make_stacks(accel)
    group.stack = Stack()
    group.stack.codes, group.stack.distances = stacks.codes[0], stacks.distances[0]
    span = RaySpan()
    span.keys, span.order, span.ends = _empty(GROUP_SPAN, int), _empty(GROUP_SPAN, int), _empty(9, int)
    span.group = group
    return span


def _empty(count: int, dtype: type) -> wp.array:
    return wp.empty(count, dtype=dtype, device="cpu")
