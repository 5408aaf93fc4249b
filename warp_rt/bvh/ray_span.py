# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scratch memory of the queries that take rays in groups."""

from __future__ import annotations

from warp_rt.bvh.accel import Accel
from warp_rt.bvh.ray_group import empty, make_ray_group
from warp_rt.bvh.stacks import make_stacks
from warp_rt.kernels.bvh_flight import Flights, RayInFlight
from warp_rt.kernels.constants import FLIGHTS, GROUP_SPAN
from warp_rt.kernels.trace_span import RaySpan


def make_ray_span(accel: Accel, worker: int) -> RaySpan:
    """Return what a worker of the CPU needs to take spans of rays through a hierarchy; valid as long as it lives."""
    span = RaySpan()
    span.worker = worker
    span.order, span.sizes = empty(9 * GROUP_SPAN, int), empty(9, int)
    span.group = make_ray_group(accel)
    span.flights = _make_flights(accel)
    return span


def _make_flights(accel: Accel) -> Flights:
    flights = Flights()
    flights.rays = empty(FLIGHTS, RayInFlight)
    flights.stacks = make_stacks(accel, FLIGHTS)
    flights.slots, flights.tuv = empty(FLIGHTS, int), empty(4, float)
    flights.t, flights.u, flights.v = (empty(GROUP_SPAN, float) for _ in range(3))
    flights.words = empty(GROUP_SPAN, int)
    return flights
