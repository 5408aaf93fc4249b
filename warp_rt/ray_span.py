# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scratch memory of the queries that take rays in groups."""

from __future__ import annotations

import warp as wp

from warp_rt.accel import Accel, make_stacks
from warp_rt.kernels.bvh_flight import Flights, RayInFlight
from warp_rt.kernels.bvh_group import RayGroup
from warp_rt.kernels.bvh_structs import Stack
from warp_rt.kernels.constants import FLIGHTS, GROUP, GROUP_FLOATS, GROUP_SPAN, WIDTH
from warp_rt.kernels.group_stack import GroupStack
from warp_rt.kernels.trace_span import RaySpan

_OCTANTS = 8


def make_ray_group(accel: Accel) -> RayGroup:
    """Return the memory of a group of rays and of its way through a hierarchy; valid as long as it lives."""
    group = RayGroup()
    group.rays = _empty(2 * GROUP_FLOATS, float)
    group.ends, group.u, group.v = (_empty(GROUP, float) for _ in range(3))
    group.words, group.records = _empty(GROUP, int), _empty(GROUP, int)
    group.senders = wp.full(GROUP, -1, dtype=int, device="cpu")  # what the rays of a query start on is not known
    group.triangles, group.skips = _empty(GROUP, int), _empty(GROUP, int)
    # All children of a node are written at once to a single ray's stack, and then as many count as it meets.
    group.single_stack = Stack()
    group.single_stack.codes = _empty(accel.stack_size + WIDTH, int)
    group.single_stack.distances = _empty(accel.stack_size + WIDTH, float)
    group.stack = GroupStack()
    entries = accel.stack_size + _OCTANTS + WIDTH  # the rays in an instance are up to eight parts
    group.stack.codes, group.stack.rays = _empty(entries, int), _empty(entries, wp.uint32)
    group.stack.distances = _empty(entries, float)
    return group


def make_ray_span(accel: Accel) -> RaySpan:
    """Return what one worker of the CPU needs to take spans of rays through a hierarchy; valid as long as it lives."""
    span = RaySpan()
    span.order, span.sizes = _empty(9 * GROUP_SPAN, int), _empty(9, int)
    span.group = make_ray_group(accel)
    span.flights = _make_flights(accel)
    return span


def _make_flights(accel: Accel) -> Flights:
    flights = Flights()
    flights.rays = _empty(FLIGHTS, RayInFlight)
    flights.stacks = make_stacks(accel, FLIGHTS)
    flights.slots, flights.tuv = _empty(FLIGHTS, int), _empty(4, float)
    flights.t, flights.u, flights.v = (_empty(GROUP_SPAN, float) for _ in range(3))
    flights.words = _empty(GROUP_SPAN, int)
    return flights


def _empty(count: int, dtype: type) -> wp.array:
    return wp.empty(count, dtype=dtype, device="cpu")
