# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A group of rays against the triangles, or the shapes, of a leaf packet."""

import warp as wp

from .constants import (
    AXES_ROW,
    DIRECTION_ROW,
    GROUP,
    LEAF_FLOATS,
    LEAF_IDS,
    NO_TRIANGLE,
    SHAPE_FLOATS,
    SHAPE_ID,
    SHAPE_WORDS,
    SHEAR_ROW,
    WATERTIGHT,
)
from .intersect_packet import ALL_TRIANGLES, LEAF_ROWS, ONE_TRIANGLE, intersect_triangles_plain
from .intersect_shape import intersect_shapes
from .native import spell_out
from .ray_group import group_ray, group_vector
from .ray_set import drop_first, first_ray

_SKIP = r"""
    for (int ray = 0; ray < GROUP; ++ray) {
        const int triangle = ((const int*)triangles.data)[ray];
        ((int*)skips.data)[ray] = ((const int*)senders.data)[ray] == instance ? triangle : NO_TRIANGLE;
    }
"""


@wp.func_native(spell_out(_SKIP, GROUP=GROUP, NO_TRIANGLE=NO_TRIANGLE))
def set_skips(senders: wp.array[int], triangles: wp.array[int], instance: int, skips: wp.array[int]):
    """Write which triangle of an instance, or which shape, each ray of a group starts on; NO_TRIANGLE: none.

    Args:
        senders: Instance that each ray starts on.
        triangles: Triangle of it.
        instance: Which is asked about.
        skips: Output, shape [GROUP].
    """
    ...


@wp.func
def set_skips_plain(senders: wp.array[int], triangles: wp.array[int], instance: int, skips: wp.array[int]):
    """Write what ``set_skips`` writes, in plain Warp."""
    for ray in range(wp.int32(GROUP)):
        skips[ray] = triangles[ray] if senders[ray] == instance else NO_TRIANGLE


_NOTE_HITS = r"""
    for (int ray = 0; ray < GROUP; ++ray) {
        const bool is_hit = hits >> ray & 1;
        ((int*)records.data)[ray] = is_hit ? record : ((const int*)records.data)[ray];
        ((float*)ends.data)[ray] = is_hit && is_any ? -1.0f : ((const float*)ends.data)[ray];
    }
"""


@wp.func_native(spell_out(_NOTE_HITS, GROUP=GROUP))
def note_hits(records: wp.array[int], ends: wp.array[float], hits: wp.uint32, record: int, is_any: bool):
    """Write in which instance some rays of a group have hit something, and if any hit is enough, that they have ended.

    Args:
        records: Output, instance record of each ray's hit.
        ends: -1 for those of the rays that need no more.
        hits: The rays.
        record: The instance.
        is_any: Whether any hit is enough.
    """
    ...


_MEET_TRIANGLES = (
    r"""
    const float* lines = (const float*)group.data + first;
    float* ends_ = (float*)ends.data;
    uint32_t hits = 0;
    for (uint32_t rest = rays; rest != 0; rest &= rest - 1) {
#if defined(__CUDA_ARCH__)
        const int index = __ffs(rest) - 1;
#else
        const int index = __builtin_ctz(rest);
#endif
        const float* line = lines + index;
        const int* bits = (const int*)line;
        const struct { float origin[3], shear[3]; int axes[3], skip; } ray = {
            {line[0], line[GROUP], line[2 * GROUP]},
            {line[SHEAR_ROW * GROUP], line[(SHEAR_ROW + 1) * GROUP], line[(SHEAR_ROW + 2) * GROUP]},
            {bits[AXES_ROW * GROUP], bits[(AXES_ROW + 1) * GROUP], bits[(AXES_ROW + 2) * GROUP]},
            ((const int*)skips.data)[index]};
        float t_max = ends_[index];
"""
    + LEAF_ROWS
    + r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
        for (int lane = 0; lane < 16; ++lane) {
"""
    + ONE_TRIANGLE
    + r"""
            t_max = t;
            const float inverse = 1.0f / determinant;
            ends_[index] = t;
            ((float*)u.data)[index] = edge_v * inverse;
            ((float*)v.data)[index] = edge_w * inverse;
            ((int*)words.data)[index] = leaf * LEAF_FLOATS + LEAF_IDS + lane;
            hits |= (uint32_t)1 << index;
        }
#else
"""
    + ALL_TRIANGLES.replace("return WARP_RT_NONE;", "continue;")
    + r"""
        if (mask == 0)
            continue;
        int nearest = __builtin_ctz(mask);
        for (mask &= mask - 1; mask != 0; mask &= mask - 1)
            if (t[__builtin_ctz(mask)] < t[nearest])
                nearest = __builtin_ctz(mask);
        const float inverse = 1.0f / determinant[nearest];
        ends_[index] = t[nearest];
        ((float*)u.data)[index] = edge_v[nearest] * inverse;
        ((float*)v.data)[index] = edge_w[nearest] * inverse;
        ((int*)words.data)[index] = leaf * LEAF_FLOATS + LEAF_IDS + nearest;
        hits |= (uint32_t)1 << index;
        }
#endif
    }
    return hits;
"""
)
_MEET_TRIANGLES = spell_out(
    _MEET_TRIANGLES,
    GROUP=GROUP,
    SHEAR_ROW=SHEAR_ROW,
    AXES_ROW=AXES_ROW,
    LEAF_FLOATS=LEAF_FLOATS,
    LEAF_IDS=LEAF_IDS,
)


@wp.func_native(_MEET_TRIANGLES)
def meet_triangles(
    leaves: wp.array[float],
    leaf: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    skips: wp.array[int],
    ends: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    words: wp.array[int],
) -> wp.uint32:
    """Return which rays of a group meet a triangle of a leaf packet before their ends, and write where.

    Writes t to ``ends``, u, v, and the word of the leaves that holds the triangle's index. Each ray by itself against
    all triangles, as ``intersect_triangles`` does it.
    """
    ...


@wp.func
def meet_triangles_plain(
    leaves: wp.array[float],
    leaf: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    skips: wp.array[int],
    ends: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    words: wp.array[int],
) -> wp.uint32:
    """Return and write what ``meet_triangles`` does, in plain Warp."""
    tuv = wp.zeros(shape=(4,), dtype=float)
    hits = wp.uint32(0)
    for index in range(wp.int32(GROUP)):
        bit = wp.uint32(1) << wp.uint32(index)
        if (rays & bit) != wp.uint32(0):
            ray = group_ray(group, first, index)
            ray.skip = skips[index]
            lane = intersect_triangles_plain(leaves, leaf, WATERTIGHT, ray, ends[index], tuv)
            if lane >= 0:
                ends[index] = tuv[0]
                u[index] = tuv[1]
                v[index] = tuv[2]
                words[index] = leaf * LEAF_FLOATS + LEAF_IDS + lane
                hits = hits | bit
    return hits


@wp.func
def meet_shapes(
    shapes: wp.array[float],
    leaf: int,
    kind: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    skips: wp.array[int],
    ends: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    words: wp.array[int],
) -> wp.uint32:
    """Return which rays of a group meet a shape of a leaf packet before their ends, and write where.

    As ``meet_triangles`` does, each ray by itself by ``intersect_shapes``; the words are those of ``shapes``.
    """
    tuv = wp.zeros(shape=(4,), dtype=float)
    hits = wp.uint32(0)
    rest = wp.uint32(rays)
    while rest != wp.uint32(0):
        index = first_ray(rest)
        rest = drop_first(rest)
        origin = group_vector(group, first + index, GROUP)
        direction = group_vector(group, first + DIRECTION_ROW * GROUP + index, GROUP)
        lane = intersect_shapes(shapes, leaf, kind, origin, direction, skips[index], ends[index], tuv)
        if lane >= 0:
            ends[index] = tuv[0]
            u[index] = tuv[1]
            v[index] = tuv[2]
            words[index] = leaf * SHAPE_FLOATS + lane * SHAPE_WORDS + SHAPE_ID
            hits = hits | (wp.uint32(1) << wp.uint32(index))
    return hits
