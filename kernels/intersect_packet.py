# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray against the eight boxes of a node or the eight triangles of a leaf packet, all lanes at once.

Warp does not turn its own vector code into SIMD, so each test exists twice: as a small native function (clang vector
types on a CPU, a loop over the lanes on a GPU), four times faster there, and as its twin in plain Warp, which says
what it computes and which tests compare it with, ray by ray.
"""

import warp as wp

from .bounds import intersect_box, inverse_direction
from .constants import (
    LEAF_FLOATS,
    LEAF_IDS,
    MOLLER_TRUMBORE,
    NO_TRIANGLE,
    NODE_FLOATS,
    PLANE_PROJECTION,
    SLAB_SCALE,
    WIDTH,
)
from .intersect_triangle import (
    TriangleHit,
    intersect_moller_trumbore,
    intersect_plane_projection,
    intersect_watertight,
    shear_axes,
    shear_factors,
    triangle_miss,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class PacketRay:
    """A ray and what its tests need of it, computed once."""

    origin: wp.vec3
    direction: wp.vec3
    inverse: wp.vec3
    """``inverse_direction``, for boxes."""
    shear: wp.vec3
    """``shear_factors``, for triangles."""
    axes: wp.vec3i
    """``shear_axes``, for triangles."""
    skip: int
    """Triangle of the mesh that the ray starts on and cannot meet again, or NO_TRIANGLE."""


@wp.func
def make_packet_ray(origin: wp.vec3, direction: wp.vec3) -> PacketRay:
    """Return a ray prepared for the packet tests."""
    ray = PacketRay()
    ray.origin = origin
    ray.direction = direction
    ray.inverse = inverse_direction(direction)
    ray.axes = shear_axes(direction)
    ray.shear = shear_factors(direction, ray.axes)
    ray.skip = NO_TRIANGLE
    return ray


# Vectors are loaded through a type without alignment: whoever owns the memory may align it, nothing depends on it.
# The conditional operator becomes one vminps or vmaxps; it yields its second operand where one is NaN.
_VECTOR_TYPES = r"""
{
#pragma clang fp contract(off)
typedef float float8 __attribute__((ext_vector_type(8)));
typedef float float8_load __attribute__((ext_vector_type(8), aligned(4)));
typedef int int8x __attribute__((ext_vector_type(8)));
typedef int int8_load __attribute__((ext_vector_type(8), aligned(4)));
typedef bool bool8 __attribute__((ext_vector_type(8)));
#define WARP_RT_LOAD(p) (*(const float8_load*)(p))
#define WARP_RT_MIN(a, b) ((a) < (b) ? (a) : (b))
#define WARP_RT_MAX(a, b) ((a) > (b) ? (a) : (b))
#define WARP_RT_MASK(m) __builtin_bit_cast(unsigned char, __builtin_convertvector((m), bool8))
"""

_BOXES = (
    r"""
    const float* rows = (const float*)nodes.data + (size_t)node * 64;
    const int flip_x = ray.inverse[0] < 0.0f ? 24 : 0;
    const int flip_y = ray.inverse[1] < 0.0f ? 24 : 0;
    const int flip_z = ray.inverse[2] < 0.0f ? 24 : 0;
    const float *near_x = rows + flip_x, *near_y = rows + 8 + flip_y, *near_z = rows + 16 + flip_z;
    const float *far_x = rows + 24 - flip_x, *far_y = rows + 32 - flip_y, *far_z = rows + 40 - flip_z;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    int mask = 0;
    for (int lane = 0; lane < 8; ++lane) {
        float t_enter = wp::max((near_x[lane] - ray.origin[0]) * ray.inverse[0], 0.0f);
        t_enter = wp::max((near_y[lane] - ray.origin[1]) * ray.inverse[1], t_enter);
        t_enter = wp::max((near_z[lane] - ray.origin[2]) * ray.inverse[2], t_enter);
        float t_leave = (far_x[lane] - ray.origin[0]) * ray.inverse[0];
        t_leave = wp::min((far_y[lane] - ray.origin[1]) * ray.inverse[1], t_leave);
        t_leave = wp::min((far_z[lane] - ray.origin[2]) * ray.inverse[2], t_leave);
        distances.data[lane] = t_enter;
        mask |= (t_enter <= wp::min(t_leave * SLAB_SCALE, t_max)) << lane;
    }
    return mask;
#else
"""
    + _VECTOR_TYPES
    + r"""
    const float8 enter_x = (WARP_RT_LOAD(near_x) - ray.origin[0]) * ray.inverse[0];
    const float8 enter_y = (WARP_RT_LOAD(near_y) - ray.origin[1]) * ray.inverse[1];
    const float8 enter_z = (WARP_RT_LOAD(near_z) - ray.origin[2]) * ray.inverse[2];
    const float8 leave_x = (WARP_RT_LOAD(far_x) - ray.origin[0]) * ray.inverse[0];
    const float8 leave_y = (WARP_RT_LOAD(far_y) - ray.origin[1]) * ray.inverse[1];
    const float8 leave_z = (WARP_RT_LOAD(far_z) - ray.origin[2]) * ray.inverse[2];
    const float8 enter_yz = WARP_RT_MAX(enter_z, (float8)0.0f);
    const float8 enter_xy = WARP_RT_MAX(enter_x, enter_y);
    const float8 t_enter = WARP_RT_MAX(enter_xy, enter_yz);
    const float8 leave_xy = WARP_RT_MIN(leave_x, leave_y);
    const float8 t_box = WARP_RT_MIN(leave_xy, leave_z) * SLAB_SCALE;
    const float8 t_leave = WARP_RT_MIN(t_box, (float8)t_max);
    __builtin_memcpy(distances.data, &t_enter, sizeof(t_enter));
    return WARP_RT_MASK(t_enter <= t_leave);
}
#endif
"""
).replace("SLAB_SCALE", f"{SLAB_SCALE!r}f")


@wp.func_native(_BOXES)
def intersect_boxes(nodes: wp.array[float], node: int, ray: PacketRay, t_max: float, distances: wp.array[float]) -> int:
    """Return the bit mask of a node's children whose boxes a ray meets in [0, t_max].

    Writes where it enters each of the eight boxes to ``distances[0:8]``. Conservative, as ``intersect_box`` is.
    """
    ...


@wp.func
def intersect_boxes_plain(
    nodes: wp.array[float], node: int, ray: PacketRay, t_max: float, distances: wp.array[float]
) -> int:
    """Return what ``intersect_boxes`` returns, in plain Warp."""
    mask = int(0)
    for lane in range(wp.int32(WIDTH)):  # a loop, not eight copies
        base = node * NODE_FLOATS + lane
        low = wp.vec3(nodes[base], nodes[base + 8], nodes[base + 16])
        high = wp.vec3(nodes[base + 24], nodes[base + 32], nodes[base + 40])
        span = intersect_box(ray.origin, ray.inverse, t_max, low, high)
        distances[lane] = span[0]
        if span[0] <= span[1]:
            mask += 1 << lane
    return mask


_LEAF_ROWS = r"""
    const float* rows = (const float*)leaves.data + (size_t)leaf * 80;
    const float *row_x = rows + 8 * ray.axes[0], *row_y = rows + 8 * ray.axes[1], *row_z = rows + 8 * ray.axes[2];
    const float origin_x = ray.origin[ray.axes[0]], origin_y = ray.origin[ray.axes[1]];
    const float origin_z = ray.origin[ray.axes[2]];
    const float shear_x = ray.shear[0], shear_y = ray.shear[1], shear_z = ray.shear[2];
    const int* ids = (const int*)rows + 72;
"""

_ONE_TRIANGLE = r"""
        const float az = row_z[lane] - origin_z, bz = row_z[24 + lane] - origin_z, cz = row_z[48 + lane] - origin_z;
        const float ax = (row_x[lane] - origin_x) - shear_x * az, ay = (row_y[lane] - origin_y) - shear_y * az;
        const float bx = (row_x[24 + lane] - origin_x) - shear_x * bz;
        const float by = (row_y[24 + lane] - origin_y) - shear_y * bz;
        const float cx = (row_x[48 + lane] - origin_x) - shear_x * cz;
        const float cy = (row_y[48 + lane] - origin_y) - shear_y * cz;
        const float edge_u = cx * by - cy * bx, edge_v = ax * cy - ay * cx, edge_w = bx * ay - by * ax;
        const float determinant = edge_u + edge_v + edge_w;
        const bool is_inside = (edge_u >= 0.0f && edge_v >= 0.0f && edge_w >= 0.0f)
            || (edge_u <= 0.0f && edge_v <= 0.0f && edge_w <= 0.0f);
        if (!is_inside || determinant == 0.0f || ids[lane] == ray.skip)
            continue;
        const float t = (edge_u * az + edge_v * bz + edge_w * cz) * (shear_z / determinant);
        if (!(t >= 0.0f && t < t_max))
            continue;
"""

_EIGHT_TRIANGLES = (
    _VECTOR_TYPES
    + r"""
    const float8 az = WARP_RT_LOAD(row_z) - origin_z;
    const float8 bz = WARP_RT_LOAD(row_z + 24) - origin_z;
    const float8 cz = WARP_RT_LOAD(row_z + 48) - origin_z;
    const float8 ax = (WARP_RT_LOAD(row_x) - origin_x) - shear_x * az;
    const float8 ay = (WARP_RT_LOAD(row_y) - origin_y) - shear_y * az;
    const float8 bx = (WARP_RT_LOAD(row_x + 24) - origin_x) - shear_x * bz;
    const float8 by = (WARP_RT_LOAD(row_y + 24) - origin_y) - shear_y * bz;
    const float8 cx = (WARP_RT_LOAD(row_x + 48) - origin_x) - shear_x * cz;
    const float8 cy = (WARP_RT_LOAD(row_y + 48) - origin_y) - shear_y * cz;
    const float8 edge_u = cx * by - cy * bx, edge_v = ax * cy - ay * cx, edge_w = bx * ay - by * ax;
    const float8 determinant = edge_u + edge_v + edge_w;
    const float8 least_uv = WARP_RT_MIN(edge_u, edge_v), greatest_uv = WARP_RT_MAX(edge_u, edge_v);
    const float8 least = WARP_RT_MIN(least_uv, edge_w), greatest = WARP_RT_MAX(greatest_uv, edge_w);
    const int8x is_inside = ((least >= 0.0f) | (greatest <= 0.0f)) & (determinant != 0.0f)
        & (*(const int8_load*)ids != ray.skip);
    // Most packets are missed: the division is paid for by rays that pass through a triangle only.
    if (WARP_RT_MASK(is_inside) == 0)
        return WARP_RT_NONE;
    const float8 t = (edge_u * az + edge_v * bz + edge_w * cz) * (shear_z / determinant);
    unsigned int mask = WARP_RT_MASK(is_inside & (t >= 0.0f) & (t < t_max));
"""
)

_NEAREST_TRIANGLE = (
    _LEAF_ROWS
    + r"""
    int nearest = -1;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int lane = 0; lane < 8; ++lane) {
"""
    + _ONE_TRIANGLE
    + r"""
        t_max = t;
        nearest = lane;
        const float inverse = 1.0f / determinant;
        tuv.data[0] = t;
        tuv.data[1] = edge_v * inverse;
        tuv.data[2] = edge_w * inverse;
    }
    return nearest;
#else
"""
    + _EIGHT_TRIANGLES.replace("WARP_RT_NONE", "-1")
    + r"""
    for (; mask != 0; mask &= mask - 1) {
        const int lane = __builtin_ctz(mask);
        if (t[lane] < t_max) {
            t_max = t[lane];
            nearest = lane;
        }
    }
    if (nearest >= 0) {
        const float inverse = 1.0f / determinant[nearest];
        tuv.data[0] = t_max;
        tuv.data[1] = edge_v[nearest] * inverse;
        tuv.data[2] = edge_w[nearest] * inverse;
    }
    return nearest;
}
#endif
"""
)

_TRIANGLE_COUNT = (
    _LEAF_ROWS
    + r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    int count = 0;
    for (int lane = 0; lane < 8; ++lane) {
"""
    + _ONE_TRIANGLE
    + r"""
        ++count;
    }
    return count;
#else
"""
    + _EIGHT_TRIANGLES.replace("WARP_RT_NONE", "0")
    + r"""
    return __builtin_popcount(mask);
}
#endif
"""
)


@wp.func_native(_NEAREST_TRIANGLE)
def intersect_triangles(leaves: wp.array[float], leaf: int, ray: PacketRay, t_max: float, tuv: wp.array[float]) -> int:
    """Return the lane of a leaf packet's triangle that a ray meets first in [0, t_max), or -1.

    Writes (t, u, v) to ``tuv[0:3]`` on a hit. Watertight, as ``intersect_watertight`` is, but for ``ray.skip``.
    """
    ...


@wp.func
def packet_vertex(leaves: wp.array[float], leaf: int, lane: int, corner: int) -> wp.vec3:
    """Return a vertex of a packet's triangle; NaN in an empty lane."""
    base = leaf * LEAF_FLOATS + corner * 24 + lane
    return wp.vec3(leaves[base], leaves[base + 8], leaves[base + 16])


@wp.func
def packet_triangle(leaves: wp.array[float], leaf: int, lane: int) -> int:
    """Return the index of a packet's triangle in its mesh; -1 for an empty lane."""
    return wp.cast(leaves[leaf * LEAF_FLOATS + LEAF_IDS + lane], wp.int32)


@wp.func_native(_TRIANGLE_COUNT)
def count_triangles(leaves: wp.array[float], leaf: int, ray: PacketRay, t_max: float) -> int:
    """Return how many of a leaf packet's triangles a ray meets in [0, t_max), edges and vertices included."""
    ...


@wp.func
def intersect_packet_triangle(
    leaves: wp.array[float], leaf: int, lane: int, intersector: int, ray: PacketRay
) -> TriangleHit:
    """Return where a ray meets one triangle of a packet, by the scalar test that ``intersector`` names."""
    if packet_triangle(leaves, leaf, lane) == ray.skip:
        return triangle_miss()
    p0 = packet_vertex(leaves, leaf, lane, 0)
    p1 = packet_vertex(leaves, leaf, lane, 1)
    p2 = packet_vertex(leaves, leaf, lane, 2)
    if intersector == MOLLER_TRUMBORE:
        return intersect_moller_trumbore(ray.origin, ray.direction, p0, p1, p2)
    if intersector == PLANE_PROJECTION:
        return intersect_plane_projection(ray.origin, ray.direction, p0, p1, p2)
    return intersect_watertight(ray.origin, ray.direction, p0, p1, p2)


@wp.func
def packet_triangle_count(leaves: wp.array[float], leaf: int) -> int:
    """Return how many lanes of a leaf packet hold a triangle."""
    count = int(0)
    for lane in range(wp.int32(WIDTH)):
        if packet_triangle(leaves, leaf, lane) >= 0:
            count += 1
    return count


@wp.func
def intersect_triangles_plain(
    leaves: wp.array[float], leaf: int, intersector: int, ray: PacketRay, t_max: float, tuv: wp.array[float]
) -> int:
    """Return what ``intersect_triangles`` returns, in plain Warp, by the scalar test that ``intersector`` names."""
    nearest = int(-1)
    t_nearest = float(t_max)
    for lane in range(wp.int32(WIDTH)):  # a loop, not eight copies
        hit = intersect_packet_triangle(leaves, leaf, lane, intersector, ray)
        if hit.t < t_nearest:
            t_nearest = hit.t
            nearest = lane
            tuv[0] = hit.t
            tuv[1] = hit.u
            tuv[2] = hit.v
    return nearest


@wp.func
def count_triangles_plain(leaves: wp.array[float], leaf: int, intersector: int, ray: PacketRay, t_max: float) -> int:
    """Return what ``count_triangles`` returns, in plain Warp, by the scalar test that ``intersector`` names."""
    count = int(0)
    for lane in range(wp.int32(WIDTH)):
        if intersect_packet_triangle(leaves, leaf, lane, intersector, ray).t < t_max:
            count += 1
    return count


@wp.func_native(
    r"""
#if defined(__CUDA_ARCH__)
    return __ffs(mask) - 1;
#else
    return __builtin_ctz(mask);
#endif
"""
)
def lowest_bit(mask: int) -> int:
    """Return the index of the lowest set bit of a mask that is not 0."""
    ...
