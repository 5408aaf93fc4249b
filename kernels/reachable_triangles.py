# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which triangles of a leaf packet the rays of a group may meet: a separating line each for those that none can.

The watertight test sees a triangle from its ray, sheared so that the ray is the z axis: at the point (0, 0) of a
plane, in which the triangle's corners lie. Seen from the middle of a group they lie somewhere else, but no farther off
than the rays differ from it. Where the ray is beyond the line through two corners, or all corners are to one side of
it, for all points within that reach, no ray of the group passes through the triangle.

References: Boulos, Wald and Shirley (2006), Geometric and Arithmetic Culling Methods for Entire Ray Packets;
Gottschalk, Lin and Manocha (1996), OBBTree: A Hierarchical Structure for Rapid Interference Detection, for separating
axes.
"""

import warp as wp

from .constants import AXES_ROW, GROUP, LEAF_FLOATS, LEAF_IDS, SHEAR_ROW
from .intersect_packet import VECTOR_TYPES
from .native import spell_out
from .ray_group import FOLD

_SEE_CORNER = r"""
    const float* lines = (const float*)group.data + first;
    const float* rows = (const float*)leaves.data + (size_t)leaf * LEAF_FLOATS;
    const int leader = __builtin_ctz(rays);
    const int z = ((const int*)lines)[(AXES_ROW + 2) * GROUP + leader], x = z == 2 ? 0 : z + 1, y = x == 2 ? 0 : x + 1;
    const float *row_x = rows + 16 * x, *row_y = rows + 16 * y, *row_z = rows + 16 * z;
    const auto absolute = [](const floats& v) { return __builtin_elementwise_abs(v); };

    const float corner_x = row_x[0], corner_y = row_y[0], corner_z = row_z[0];
    const ints bits = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
    const floats none = (floats)-INFINITY;
    floats right = none, left = none, up = none, down = none, far = none;
    floats shear_right = none, shear_left = none, shear_up = none, shear_down = none;
    ints is_other = (ints)0;
    for (int block = 0; block < GROUP; block += 16) {
        const float* line = lines + block;
        const ints is_in = ((int)(rays >> block) & bits) != 0;
        is_other |= is_in & (WARP_RT_LOAD_INTS((const int*)line + (AXES_ROW + 2) * GROUP) != z);
        const floats s_x = WARP_RT_LOAD(line + SHEAR_ROW * GROUP), s_y = WARP_RT_LOAD(line + (SHEAR_ROW + 1) * GROUP);
        const floats o_x = corner_x - WARP_RT_LOAD(line + x * GROUP), o_y = corner_y - WARP_RT_LOAD(line + y * GROUP);
        const floats o_z = corner_z - WARP_RT_LOAD(line + z * GROUP);
        const floats at_x = o_x - s_x * o_z, at_y = o_y - s_y * o_z;
        const auto widen = [&](floats& most, const floats& v) { most = (is_in & (v > most)) ? v : most; };
        widen(right, at_x), widen(left, -at_x), widen(up, at_y), widen(down, -at_y);
        widen(shear_right, s_x), widen(shear_left, -s_x), widen(shear_up, s_y), widen(shear_down, -s_y);
        widen(far, absolute(o_x) + absolute(o_y) + absolute(o_z));
    }
"""
"""The point at which each ray sees a corner of the first triangle, and its shear: the most of each to either side."""

_MIDDLE = r"""
    if (WARP_RT_MASK(is_other) != 0)
        return -1;
    const floats sides = fold(fold(right, left), fold(up, down));
    const floats shears = fold(fold(shear_right, shear_left), fold(shear_up, shear_down));
    const floats far_2 = fold(far, far), far_4 = fold(far_2, far_2);
    const floats most = fold(fold(sides, shears), fold(far_4, far_4));
    const float middle_x = 0.5f * (most[0] - most[1]), middle_y = 0.5f * (most[2] - most[3]);
    const float shear_x = 0.5f * (most[4] - most[5]), shear_y = 0.5f * (most[6] - most[7]);
    const float half_x = 0.5f * (most[0] + most[1]), half_y = 0.5f * (most[2] + most[3]);
    const float half_shear_x = 0.5f * (most[4] + most[5]), half_shear_y = 0.5f * (most[6] + most[7]);

"""
"""The middle of those, and how far the rays are off it."""

_CORNERS = r"""
    floats a[3], b[3], d[3];
    for (int k = 0; k < 3; ++k) {
        d[k] = WARP_RT_LOAD(row_z + 48 * k) - corner_z;
        a[k] = (WARP_RT_LOAD(row_x + 48 * k) - corner_x) - shear_x * d[k] + middle_x;
        b[k] = (WARP_RT_LOAD(row_y + 48 * k) - corner_y) - shear_y * d[k] + middle_y;
    }
    const auto least_of = [](const floats* v) {
        const floats w = WARP_RT_MIN(v[0], v[1]);
        return (floats)WARP_RT_MIN(w, v[2]);
    };
    const auto most_of = [](const floats* v) {
        const floats w = WARP_RT_MAX(v[0], v[1]);
        return (floats)WARP_RT_MAX(w, v[2]);
    };
    const auto greater = [](const floats& v, const floats& w) { return (floats)WARP_RT_MAX(v, w); };
    const floats low_x = least_of(a), low_y = least_of(b), low_z = least_of(d);
    const floats high_x = most_of(a), high_y = most_of(b), high_z = most_of(d);
    const floats width = high_x - low_x, height = high_y - low_y, depth = high_z - low_z;
    const floats deepest = greater(high_z, -low_z), widest = greater(high_x, -low_x), highest = greater(high_y, -low_y);
    const floats slip = 128.0f * ROUNDING * (most[8] + deepest + widest + highest);
    const floats reach_x = half_x + (half_shear_x * deepest + slip), reach_y = half_y + (half_shear_y * deepest + slip);
    const floats turn_x = half_shear_x * depth + 2.0f * slip, turn_y = half_shear_y * depth + 2.0f * slip;
    const floats span_x = widest + reach_x, span_y = highest + reach_y, size = span_x * span_y;
    const floats rounding = 32.0f * ROUNDING * size;
    const floats other = span_x * turn_y + span_y * turn_x + rounding;
"""
"""All corners as seen from the middle, and how far off that is for any ray."""

_APART = r"""
    floats least = (floats)INFINITY, greatest = -least, area = (floats)0.0f;
    for (int k = 0; k < 3; ++k) {
        const int p = k == 2 ? 0 : k + 1, q = p == 2 ? 0 : p + 1;
        const floats edge = a[q] * b[p] - b[q] * a[p];
        const floats support = reach_x * absolute(b[q] - b[p]) + reach_y * absolute(a[q] - a[p]);
        const floats over = edge + support, under = edge - support;
        least = WARP_RT_MIN(over, least);
        greatest = WARP_RT_MAX(under, greatest);
        area += edge;
    }
    const floats enough = 2.0f * ((width + turn_x) * turn_y + height * turn_x) + rounding;
    const floats side_x = reach_x + span_x * (1.0f / 512.0f), side_y = reach_y + span_y * (1.0f / 512.0f);
    const ints is_aside = (low_x > side_x) | (high_x < -side_x) | (low_y > side_y) | (high_y < -side_y);
    const ints is_apart = ((area > enough) & (least < -other)) | ((area < -enough) & (greatest > other))
        | (is_aside & (absolute(area) > enough + size * (1.0f / 1024.0f)));
    return WARP_RT_MASK((WARP_RT_LOAD_INTS((const int*)rows + LEAF_IDS) >= 0) & ~is_apart);
"""
"""Triangles beside which all rays pass."""

# A triangle is left out only where the test's own edge functions, rounded as they are, come out with both signs. Let k
# be 2^-24, and m the sum in ``slip``: the distance of any corner from any origin is 2 m at most along any axis, and
# that of corners from each other no more. Shear factors are 1 at most, so that sheared coordinates, the test's and
# those here, are off by rounding 30 k m at most, of the 128 k m that ``slip`` is. So a corner as the test sees it is
# within ``reach`` of where it is here, and the difference of two corners within ``turn``. Let s be ``size``: no
# coordinate exceeds the spans, no product of two of them s.
#
# An edge function of the test's coordinates, before it is rounded, is within ``support + other`` of the one here, less
# 32 k s. What is computed here is off by less than 16 k s, so that the edge function is more than 16 k s beyond zero.
# The test rounds two products, by k s each at most, and their difference has the right sign. The three functions add up
# to what they do here, within ``enough``, so that their sum has the opposite sign. One of the other two has it, too,
# and is larger than 8 k s: that sign, too, comes out right.
#
# Where all corners are more than g = span / 512 to one side of a ray along an axis, a, b and c, the edge functions
# fulfil u a + v b + w c = 0. Were none of them below -2 k s, as the test would have it of a hit, none would be above 4
# k s span / g, nor their sum above 12 k s span / g = 6144 k s. It is more than s / 1024 = 16384 k s.
_REACHABLE = (
    "#if defined(__CUDA_ARCH__) || !defined(__clang__)\nreturn -1;\n#else\n"
    + VECTOR_TYPES
    + FOLD
    + _SEE_CORNER
    + _MIDDLE
    + _CORNERS
    + _APART
    + "}\n#endif\n"
)
_REACHABLE = spell_out(
    _REACHABLE,
    AXES_ROW=AXES_ROW,
    GROUP=GROUP,
    LEAF_FLOATS=LEAF_FLOATS,
    LEAF_IDS=LEAF_IDS,
    ROUNDING=2.0**-24,
    SHEAR_ROW=SHEAR_ROW,
)


@wp.func_native(_REACHABLE)
def reachable_triangles(leaves: wp.array[float], leaf: int, group: wp.array[float], first: int, rays: wp.uint32) -> int:
    """Return the lanes of a leaf packet that some of a group's rays, at least one, may meet; -1 if it cannot tell.

    No ray would meet the others by the watertight test, whatever its end is. It cannot tell where the rays do not have
    their shear axes in common, and on a GPU.

    Args:
        leaves: Leaf packets.
        leaf: Which one.
        group: Rays of groups.
        first: Word at which this group's begin.
        rays: Those of them that are asked about.
    """
    ...
