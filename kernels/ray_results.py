# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a query on arrays writes, as types: closest hits, or whether there are any.

The functions ``write_...`` and ``is_satisfied_by_any`` have an overload for each.
"""

from typing import TypeVar

import warp as wp

from .bvh_flight import Flights
from .bvh_structs import AccelData, InstanceRecord, Stack
from .bvh_traverse import any_hit, closest_hit
from .constants import GROUP, TRIANGLES
from .group_structs import RayGroup
from .intersect_packet import VECTOR_TYPES
from .native import spell_out
from .ray_group import RUN_OF_RAYS


@wp.struct
class ClosestHits:
    """Where the closest hits of rays go: contiguous arrays, one element a ray."""

    t: wp.array[float]
    u: wp.array[float]
    v: wp.array[float]
    triangle: wp.array[int]
    instance: wp.array[int]


@wp.struct
class AnyHits:
    """Where it goes whether rays hit anything."""

    is_blocked: wp.array[wp.bool]
    """One element a ray."""


Results = TypeVar("Results", ClosestHits, AnyHits)
"""Stands for each of them in the annotations of a ``per_type`` function."""


@wp.func
def is_satisfied_by_any(results: wp.ref[ClosestHits]) -> bool:
    """Return whether any hit of a ray will do."""
    return False


@wp.func
def is_satisfied_by_any(results: wp.ref[AnyHits]) -> bool:
    """It will."""
    return True


# --- rays one by one


@wp.func
def trace_single(
    accel: wp.ref[AccelData],
    results: wp.ref[ClosestHits],
    ray: int,
    origin: wp.vec3,
    direction: wp.vec3,
    t_max: float,
    stack: Stack,
):
    """Trace a ray, and write what becomes of it."""
    hit = closest_hit(accel, origin, direction, t_max, stack)
    results.t[ray] = hit.t if hit.instance >= 0 else wp.inf
    results.u[ray] = hit.u
    results.v[ray] = hit.v
    results.triangle[ray] = hit.triangle
    results.instance[ray] = hit.instance


@wp.func
def trace_single(
    accel: wp.ref[AccelData],
    results: wp.ref[AnyHits],
    ray: int,
    origin: wp.vec3,
    direction: wp.vec3,
    t_max: float,
    stack: Stack,
):
    """Write whether it hits anything."""
    results.is_blocked[ray] = any_hit(accel, origin, direction, t_max, stack)


# --- rays in flight


@wp.func
def write_flight(accel: wp.ref[AccelData], results: wp.ref[ClosestHits], ray: int, flights: wp.ref[Flights], row: int):
    """Write what became of the ray that landed in a row of ``flights``."""
    word = flights.words[row]
    if word >= 0:
        results.t[ray] = flights.t[row]
        results.u[ray] = flights.u[row]
        results.v[ray] = flights.v[row]
        results.triangle[ray] = wp.cast(accel.leaves[word], wp.int32)
        results.instance[ray] = accel.instances[0].instance
    else:
        results.t[ray] = wp.inf
        results.u[ray] = 0.0
        results.v[ray] = 0.0
        results.triangle[ray] = -1
        results.instance[ray] = -1


@wp.func
def write_flight(accel: wp.ref[AccelData], results: wp.ref[AnyHits], ray: int, flights: wp.ref[Flights], row: int):
    """Write whether it hit anything."""
    results.is_blocked[ray] = flights.words[row] >= 0


# --- rays in groups

_PREFETCH_HITS = r"""
#if !defined(__CUDA_ARCH__)
    const int* rays = (const int*)order.data + start;
    for (int index = 0; index < count; ++index) {
        const size_t ray = rays[index];
        __builtin_prefetch((const float*)t.data + ray, 1);
        __builtin_prefetch((const float*)u.data + ray, 1);
        __builtin_prefetch((const float*)v.data + ray, 1);
        __builtin_prefetch((const int*)triangle.data + ray, 1);
        __builtin_prefetch((const int*)instance.data + ray, 1);
    }
#endif
"""


@wp.func_native(_PREFETCH_HITS)
def prefetch_hits(
    order: wp.array[int],
    start: int,
    count: int,
    t: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    triangle: wp.array[int],
    instance: wp.array[int],
):
    """Ask for the memory of ``count`` rays' results, listed in ``order`` from ``start`` on; it changes none."""
    ...


@wp.func
def prefetch_results(results: wp.ref[ClosestHits], order: wp.array[int], start: int, count: int):
    """Ask for the memory that results of rays all over the arrays will be written to, while the rays are traced."""
    prefetch_hits(order, start, count, results.t, results.u, results.v, results.triangle, results.instance)


@wp.func
def prefetch_results(results: wp.ref[AnyHits], order: wp.array[int], start: int, count: int):
    """Do nothing: the results of a query are as small as the cache."""
    pass


_WRITE_HITS = (
    r"""
    const int* rays = (const int*)order.data + start;
    const int *word = (const int*)words.data, *record = (const int*)records.data;
    const float *t = (const float*)ends.data, *u_ = (const float*)u.data, *v_ = (const float*)v.data;
    bool is_run = false;
#if defined(__clang__) && !defined(__CUDA_ARCH__)
"""
    + VECTOR_TYPES
    + RUN_OF_RAYS
    + r"""
    is_run &= is_traced;
    for (int block = 0; is_run && block < GROUP; block += 16) {
        const size_t ray = (size_t)rays[0] + block;
        const ints is_hit = WARP_RT_LOAD_INTS(word + block) >= 0;
        *(floats_load*)((float*)t_out.data + ray) = is_hit ? WARP_RT_LOAD(t + block) : (floats)INFINITY;
        *(floats_load*)((float*)u_out.data + ray) = is_hit ? WARP_RT_LOAD(u_ + block) : (floats)0.0f;
        *(floats_load*)((float*)v_out.data + ray) = is_hit ? WARP_RT_LOAD(v_ + block) : (floats)0.0f;
    }
}
#endif
    for (int index = 0; index < count; ++index) {
        const int ray = rays[index];
        const bool is_hit = is_traced && word[index] >= 0;
        if (!is_run) {
            ((float*)t_out.data)[ray] = is_hit ? t[index] : INFINITY;
            ((float*)u_out.data)[ray] = is_hit ? u_[index] : 0.0f;
            ((float*)v_out.data)[ray] = is_hit ? v_[index] : 0.0f;
        }
        int triangle = -1, instance = -1;
        if (is_hit) {
            const auto& met = instances.data[record[index]];
            triangle = ((const int*)(met.kind == TRIANGLES ? leaves : shapes).data)[word[index]];
            instance = met.instance;
        }
        ((int*)triangle_out.data)[ray] = triangle;
        ((int*)instance_out.data)[ray] = instance;
    }
"""
)


@wp.func_native(spell_out(_WRITE_HITS, TRIANGLES=TRIANGLES, GROUP=GROUP))
def write_hits(
    leaves: wp.array[float],
    shapes: wp.array[float],
    instances: wp.array[InstanceRecord],
    order: wp.array[int],
    start: int,
    count: int,
    is_traced: bool,
    words: wp.array[int],
    records: wp.array[int],
    ends: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    t_out: wp.array[float],
    u_out: wp.array[float],
    v_out: wp.array[float],
    triangle_out: wp.array[int],
    instance_out: wp.array[int],
):
    """Write the closest hits of ``count`` rays, listed in ``order`` from ``start`` on, to where each of them belongs.

    Native, for in plain Warp each of fifteen array accesses a ray reads its array's address anew.

    Args:
        leaves: Leaf packets of triangles.
        shapes: Those of shapes.
        instances: Instance records.
        order: Rays.
        start: First of them.
        count: How many.
        is_traced: Whether they were; if not, none hits anything.
        words: As in ``RayGroup``; so are the next four.
        records: Instance records of the hits.
        ends: t of the hits.
        u: Weights of the second vertex.
        v: Weights of the third.
        t_out: Output, one a ray, contiguous; so are the next four.
        u_out: Output.
        v_out: Output.
        triangle_out: Output.
        instance_out: Output.
    """
    ...


@wp.func
def write_group(
    accel: wp.ref[AccelData],
    results: wp.ref[ClosestHits],
    order: wp.array[int],
    start: int,
    count: int,
    is_traced: bool,
    group: wp.ref[RayGroup],
):
    """Write what became of ``count`` rays, listed in ``order`` from ``start`` on: a group, if they were traced."""
    write_hits(
        accel.leaves,
        accel.shapes,
        accel.instances,
        order,
        start,
        count,
        is_traced,
        group.words,
        group.records,
        group.ends,
        group.u,
        group.v,
        results.t,
        results.u,
        results.v,
        results.triangle,
        results.instance,
    )


_WRITE_BLOCKED = r"""
    const int *rays = (const int*)order.data + start, *word = (const int*)words.data;
    for (int index = 0; index < count; ++index)
        ((bool*)blocked_out.data)[rays[index]] = is_traced && word[index] >= 0;
"""


@wp.func_native(_WRITE_BLOCKED)
def write_blocked(
    order: wp.array[int], start: int, count: int, is_traced: bool, words: wp.array[int], blocked_out: wp.array[wp.bool]
):
    """Write whether each of ``count`` rays hits anything; as ``write_hits`` writes where."""
    ...


@wp.func
def write_group(
    accel: wp.ref[AccelData],
    results: wp.ref[AnyHits],
    order: wp.array[int],
    start: int,
    count: int,
    is_traced: bool,
    group: wp.ref[RayGroup],
):
    """Write which of them hit anything."""
    write_blocked(order, start, count, is_traced, group.words, results.is_blocked)
