# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays that have nothing in common, several in flight in one thread.

A single ray over a hierarchy beyond the caches waits for memory at every step. Here each of FLIGHTS rays takes one step
in turn and asks for what its next one needs, which arrives while the others take theirs.

Reference: Kocberber, Falsafi and Grot (2015), Asynchronous Memory Access Chaining, PVLDB 9(4).
"""

import warp as wp

from .bvh_stack import cull_stack, push, push_children, stack_code
from .bvh_structs import AccelData, Stacks, stack_of_thread
from .bvh_traverse import is_ray_finite
from .constants import FLIGHT_FLOATS, FLIGHTS, LEAF_FLOATS, LEAF_IDS, TRIANGLES
from .intersect_packet import PacketRay, intersect_triangles, make_packet_ray
from .prefetch import prefetch_child
from .vector import relative


@wp.struct
class RayInFlight:
    """A ray and how far it has come."""

    ray: PacketRay
    top: int
    """Entries on its stack."""
    row: int
    """Of the results."""
    end: float
    """t_max, then t of the closest hit."""


@wp.struct
class Flights:
    """Scratch memory of rays in flight, and where they land."""

    rays: wp.array[RayInFlight]
    """shape [FLIGHTS]"""
    stacks: Stacks
    """One row a ray in flight."""
    slots: wp.array[int]
    """Those of ``rays`` that are in flight, shape [FLIGHTS]."""
    tuv: wp.array[float]
    t: wp.array[float]
    """Results, one a ray of the span: t, u, v, and the word of the leaves that holds the triangle's index, or -1."""
    u: wp.array[float]
    v: wp.array[float]
    words: wp.array[int]


@wp.func
def take_off(
    accel: wp.ref[AccelData],
    flights: wp.ref[Flights],
    slot: int,
    origin: wp.vec3,
    direction: wp.vec3,
    end: float,
    row: int,
) -> bool:
    """Put a ray into a slot, and return whether there is one to be traced."""
    flights.words[row] = -1
    flights.rays[slot].row = row
    if not is_ray_finite(origin, direction):
        return False
    flights.rays[slot].ray = make_packet_ray(origin, direction)
    flights.rays[slot].end = end
    flights.rays[slot].top = 1
    push(stack_of_thread(flights.stacks, slot), 0, accel.root, 0.0)
    return True


@wp.func
def step(accel: wp.ref[AccelData], flights: wp.ref[Flights], slot: int, is_any: bool) -> bool:
    """Visit the topmost entry of a ray's stack, and return whether others are left."""
    stack = stack_of_thread(flights.stacks, slot)
    top = flights.rays[slot].top - 1
    code = stack_code(stack, top)
    end = flights.rays[slot].end
    if code >= 0:
        top = push_children(accel.nodes, code, flights.rays[slot].ray, end, stack, top)
    else:
        lane = intersect_triangles(accel.leaves, -1 - code, flights.rays[slot].ray, end, flights.tuv)
        if lane >= 0:
            row = flights.rays[slot].row
            flights.t[row] = flights.tuv[0]
            flights.u[row] = flights.tuv[1]
            flights.v[row] = flights.tuv[2]
            flights.words[row] = (-1 - code) * LEAF_FLOATS + LEAF_IDS + lane
            flights.rays[slot].end = flights.tuv[0]
            if is_any:
                top = 0
            else:
                top = cull_stack(stack, top, flights.tuv[0])
    flights.rays[slot].top = top
    if top > 0:
        prefetch_child(accel.nodes, accel.leaves, stack_code(stack, top - 1))
    return top > 0


@wp.func
def is_for_flights(accel: wp.ref[AccelData]) -> bool:
    """Return whether a hierarchy is of one level, over triangles, and so big that rays with nothing in common wait."""
    if accel.only_instance < 0 or int(accel.instances[0].kind) != TRIANGLES:
        return False
    return accel.nodes.shape[0] + accel.leaves.shape[0] > FLIGHT_FLOATS


@wp.func
def trace_flights(
    accel: wp.ref[AccelData],
    flights: wp.ref[Flights],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    base: wp.vec3d,
    first: int,
    count: int,
    is_any: bool,
):
    """Find the closest hits of successive rays, or any hits, in a hierarchy of one level; leave them in ``flights``.

    Args:
        accel: The hierarchy, in coordinates relative to ``base``.
        flights: Scratch memory, and results.
        origins: Of all rays.
        directions: Likewise.
        t_max: One value for all rays, or one a ray.
        base: A point, in the coordinates of the rays.
        first: The first ray.
        count: Rays; at most GROUP_SPAN.
        is_any: Whether any hit will do.
    """
    waiting = int(0)
    flying = int(wp.min(FLIGHTS, count))
    for k in range(flying):
        flights.slots[k] = k
        flights.rays[k].top = 0
        flights.rays[k].row = -1
    k = int(0)
    while flying > 0:
        slot = flights.slots[k]
        is_flying = bool(False)
        if flights.rays[slot].top > 0:
            is_flying = step(accel, flights, slot, is_any)
        while waiting < count and not is_flying:
            i = first + waiting
            end = t_max[wp.min(i, t_max.shape[0] - 1)]
            is_flying = take_off(accel, flights, slot, relative(origins[i], base), directions[i], end, waiting)
            waiting += 1
        if is_flying:
            k += 1
        else:
            flying -= 1
            flights.slots[k] = flights.slots[flying]
        if k >= flying:
            k = 0
