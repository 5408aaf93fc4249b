# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray, prepared for the tests of packets, against the sixteen triangles of a leaf packet, all lanes at once.

Warp does not turn its own vector code into SIMD, so each test exists twice: as a small native function (clang vector
types on a CPU, a loop over the lanes on a GPU), several times faster there, and as its twin in plain Warp, which says
what it computes and which tests compare it with, ray by ray. Native functions take the ray by reference: one passed by
value is written to memory and read back in other pieces, for which the processor waits.
"""

import warp as wp

from .bounds import inverse_direction
from .constants import (
    LEAF_FLOATS,
    LEAF_IDS,
    MOLLER_TRUMBORE,
    NO_TRIANGLE,
    PLANE_PROJECTION,
    SLAB_SCALE,
    WIDTH,
)
from .native import spell_out
from .ray_triangle import (
    TriangleHit,
    intersect_moller_trumbore,
    intersect_plane_projection,
    intersect_triangle,
    shear_axes,
    shear_factors,
    triangle_miss,
)


@wp.struct
class PacketRay:
    """A ray and what its tests need of it, computed once."""

    origin: wp.vec3
    direction: wp.vec3
    inverse: wp.vec3
    """``inverse_direction``, for the near planes of boxes."""
    far_inverse: wp.vec3
    """``inverse`` times SLAB_SCALE, for their far planes."""
    octant: int
    """Bit a is set where component a of the direction is negative."""
    shear: wp.vec3
    """``shear_factors``, for triangles."""
    axes: wp.vec3i
    """``shear_axes``, for triangles."""
    skip: int
    """Triangle of the mesh that the ray starts on and cannot meet again, or NO_TRIANGLE."""


@wp.func
def octant_of(direction: wp.vec3) -> int:
    """Return the octant of directions that a vector lies in: bit a is set where component a is negative."""
    return (1 if direction[0] < 0.0 else 0) + (2 if direction[1] < 0.0 else 0) + (4 if direction[2] < 0.0 else 0)


@wp.func
def make_packet_ray(origin: wp.vec3, direction: wp.vec3) -> PacketRay:
    """Return a ray prepared for the packet tests."""
    ray = PacketRay()
    ray.origin = origin
    ray.direction = direction
    ray.inverse = inverse_direction(direction)
    ray.far_inverse = ray.inverse * SLAB_SCALE
    ray.octant = octant_of(direction)
    ray.axes = shear_axes(direction)
    ray.shear = shear_factors(direction, ray.axes)
    ray.skip = NO_TRIANGLE
    return ray


# Vectors are loaded through a type without alignment: whoever owns the memory may align it, nothing depends on it.
# The conditional operator becomes one vminps or vmaxps; it yields its second operand where one is NaN.
VECTOR_TYPES = r"""
{
#pragma clang fp contract(off)
typedef float floats __attribute__((ext_vector_type(16)));
typedef float floats_load __attribute__((ext_vector_type(16), aligned(4)));
typedef int ints __attribute__((ext_vector_type(16)));
typedef int ints_load __attribute__((ext_vector_type(16), aligned(4)));
typedef bool bools __attribute__((ext_vector_type(16)));
#define WARP_RT_LOAD(p) (*(const floats_load*)(p))
#define WARP_RT_LOAD_INTS(p) (*(const ints_load*)(p))
#define WARP_RT_MIN(a, b) ((a) < (b) ? (a) : (b))
#define WARP_RT_MAX(a, b) ((a) > (b) ? (a) : (b))
#define WARP_RT_MASK(m) __builtin_bit_cast(unsigned short, __builtin_convertvector((m), bools))
"""
"""Opens a block, in which nothing is contracted: the source that it stands before closes it."""

COLUMNS = r"""
#define WARP_RT_COLUMNS(p, x, y, z) \
    floats x, y, z; { \
    const floats a = WARP_RT_LOAD(p), b = WARP_RT_LOAD((p) + 16), c = WARP_RT_LOAD((p) + 32); \
    x = __builtin_shufflevector(a, b, 0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, -1, -1, -1, -1, -1); \
    x = __builtin_shufflevector(x, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29); \
    y = __builtin_shufflevector(a, b, 1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, -1, -1, -1, -1, -1); \
    y = __builtin_shufflevector(y, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30); \
    z = __builtin_shufflevector(a, b, 2, 5, 8, 11, 14, 17, 20, 23, 26, 29, -1, -1, -1, -1, -1, -1); \
    z = __builtin_shufflevector(z, c, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31); }
"""
"""After VECTOR_TYPES: x, y and z of sixteen vectors that follow each other in memory."""

LEAF_ROWS = spell_out(
    r"""
    const float* rows = (const float*)leaves.data + (size_t)leaf * LEAF_FLOATS;
    const float *row_x = rows + 16 * ray.axes[0], *row_y = rows + 16 * ray.axes[1], *row_z = rows + 16 * ray.axes[2];
    const float origin_x = ray.origin[ray.axes[0]], origin_y = ray.origin[ray.axes[1]];
    const float origin_z = ray.origin[ray.axes[2]];
    const float shear_x = ray.shear[0], shear_y = ray.shear[1], shear_z = ray.shear[2];
    const int* ids = (const int*)rows + LEAF_IDS;
""",
    LEAF_FLOATS=LEAF_FLOATS,
    LEAF_IDS=LEAF_IDS,
)

ONE_TRIANGLE = r"""
        const float az = row_z[lane] - origin_z, bz = row_z[48 + lane] - origin_z, cz = row_z[96 + lane] - origin_z;
        const float ax = (row_x[lane] - origin_x) - shear_x * az, ay = (row_y[lane] - origin_y) - shear_y * az;
        const float bx = (row_x[48 + lane] - origin_x) - shear_x * bz;
        const float by = (row_y[48 + lane] - origin_y) - shear_y * bz;
        const float cx = (row_x[96 + lane] - origin_x) - shear_x * cz;
        const float cy = (row_y[96 + lane] - origin_y) - shear_y * cz;
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

EDGES = r"""
    const floats az = ROW(row_z) - origin_z, bz = ROW(row_z + 48) - origin_z, cz = ROW(row_z + 96) - origin_z;
    const floats ax = (ROW(row_x) - origin_x) - shear_x * az, ay = (ROW(row_y) - origin_y) - shear_y * az;
    const floats bx = (ROW(row_x + 48) - origin_x) - shear_x * bz, by = (ROW(row_y + 48) - origin_y) - shear_y * bz;
    const floats cx = (ROW(row_x + 96) - origin_x) - shear_x * cz, cy = (ROW(row_y + 96) - origin_y) - shear_y * cz;
    const floats edge_u = cx * by - cy * bx, edge_v = ax * cy - ay * cx, edge_w = bx * ay - by * ax;
    const floats least_uv = WARP_RT_MIN(edge_u, edge_v), greatest_uv = WARP_RT_MAX(edge_u, edge_v);
    const floats least = WARP_RT_MIN(least_uv, edge_w), greatest = WARP_RT_MAX(greatest_uv, edge_w);
"""
"""Edge functions of triangles as rays see them, after VECTOR_TYPES and LEAF_ROWS; ROW: what is read of a row."""

ALL_TRIANGLES = (
    VECTOR_TYPES
    + EDGES.replace("ROW", "WARP_RT_LOAD")
    + r"""
    const floats determinant = edge_u + edge_v + edge_w;
    const ints is_inside = ((least >= 0.0f) | (greatest <= 0.0f)) & (determinant != 0.0f)
        & (WARP_RT_LOAD_INTS(ids) != ray.skip);
    // Most packets are missed: the division is paid for by rays that pass through a triangle only.
    if (WARP_RT_MASK(is_inside) == 0)
        return WARP_RT_NONE;
    const floats t = (edge_u * az + edge_v * bz + edge_w * cz) * (shear_z / determinant);
    unsigned int mask = WARP_RT_MASK(is_inside & (t >= 0.0f) & (t < t_max));
"""
)

_NEAREST_TRIANGLE = (
    LEAF_ROWS
    + r"""
    int nearest = -1;
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int lane = 0; lane < 16; ++lane) {
"""
    + ONE_TRIANGLE
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
    + ALL_TRIANGLES.replace("WARP_RT_NONE", "-1")
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
    LEAF_ROWS
    + r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    int count = 0;
    for (int lane = 0; lane < 16; ++lane) {
"""
    + ONE_TRIANGLE
    + r"""
        ++count;
    }
    return count;
#else
"""
    + ALL_TRIANGLES.replace("WARP_RT_NONE", "0")
    + r"""
    return __builtin_popcount(mask);
}
#endif
"""
)


@wp.func_native(_NEAREST_TRIANGLE)
def intersect_triangles(
    leaves: wp.array[float], leaf: int, ray: wp.ref[PacketRay], t_max: float, tuv: wp.array[float]
) -> int:
    """Return the lane of a leaf packet's triangle that a ray meets first in [0, t_max), or -1.

    Writes (t, u, v) to ``tuv[0:3]`` on a hit. Watertight, as ``intersect_triangle`` is, but for ``ray.skip``.
    """
    ...


@wp.func
def packet_vertex(leaves: wp.array[float], leaf: int, lane: int, corner: int) -> wp.vec3:
    """Return a vertex of a packet's triangle; NaN in an empty lane."""
    base = leaf * LEAF_FLOATS + 3 * WIDTH * corner + lane
    return wp.vec3(leaves[base], leaves[base + WIDTH], leaves[base + 2 * WIDTH])


@wp.func
def packet_triangle(leaves: wp.array[float], leaf: int, lane: int) -> int:
    """Return the index of a packet's triangle in its mesh; -1 for an empty lane."""
    return wp.cast(leaves[leaf * LEAF_FLOATS + LEAF_IDS + lane], wp.int32)


@wp.func_native(_TRIANGLE_COUNT)
def count_triangles(leaves: wp.array[float], leaf: int, ray: wp.ref[PacketRay], t_max: float) -> int:
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
    return intersect_triangle(ray.origin, ray.direction, p0, p1, p2)


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
    for lane in range(wp.int32(WIDTH)):  # a loop, not sixteen copies
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
