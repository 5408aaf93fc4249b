# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays of a group against one triangle of a leaf packet after the other, sixteen rays at once.

The other way round than ``meet_triangles`` does it: faster where the group has many rays that may meet few triangles.
"""

import warp as wp

from .constants import AXES_ROW, GROUP, LEAF_FLOATS, LEAF_IDS, SHEAR_ROW
from .intersect_packet import EDGES, VECTOR_TYPES
from .native import spell_out

_LOAD_BLOCKS = r"""
    const float* lines = (const float*)group.data + first;
    const float* rows = (const float*)leaves.data + (size_t)leaf * LEAF_FLOATS;
    const int* axes = (const int*)lines + AXES_ROW * GROUP + __builtin_ctz(rays);
    const int x = axes[0], y = axes[GROUP], z = axes[2 * GROUP];
    const float *row_x = rows + 16 * x, *row_y = rows + 16 * y, *row_z = rows + 16 * z;
    const ints bits = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768};
    enum { BLOCKS = GROUP / 16 };
    struct {
        floats origin_x, origin_y, origin_z, shear_x, shear_y, shear_z, t, edge_v, edge_w, determinant;
        ints skip, is_in, lane;
    } blocks[BLOCKS];
#pragma unroll
    for (int k = 0; k < BLOCKS; ++k) {
        auto& block = blocks[k];
        const float* line = lines + 16 * k;
        block.origin_x = WARP_RT_LOAD(line + x * GROUP);
        block.origin_y = WARP_RT_LOAD(line + y * GROUP);
        block.origin_z = WARP_RT_LOAD(line + z * GROUP);
        block.shear_x = WARP_RT_LOAD(line + SHEAR_ROW * GROUP);
        block.shear_y = WARP_RT_LOAD(line + (SHEAR_ROW + 1) * GROUP);
        block.shear_z = WARP_RT_LOAD(line + (SHEAR_ROW + 2) * GROUP);
        block.skip = WARP_RT_LOAD_INTS((const int*)skips.data + 16 * k);
        block.is_in = ((int)(rays >> 16 * k) & bits) != 0;
        block.t = block.is_in ? WARP_RT_LOAD((const float*)ends.data + 16 * k) : (floats)-1.0f;
        block.edge_v = block.edge_w = (floats)0.0f;
        block.determinant = (floats)1.0f;
        block.lane = (ints)0;
    }
"""

_MEET_ONE_BY_ONE = (
    r"""
    for (unsigned int rest = lanes; rest != 0; rest &= rest - 1) {
        const int lane = __builtin_ctz(rest), id = ((const int*)rows)[LEAF_IDS + lane];
        const auto in_lane = [&](const float* row) { return row[lane]; };
        struct { floats az, bz, cz, edge_u, edge_v, edge_w; ints is_inside; } seen[BLOCKS];
        unsigned int inside = 0;
#pragma unroll
        for (int k = 0; k < BLOCKS; ++k) {
            const floats origin_x = blocks[k].origin_x, origin_y = blocks[k].origin_y, origin_z = blocks[k].origin_z;
            const floats shear_x = blocks[k].shear_x, shear_y = blocks[k].shear_y;
"""
    + EDGES.replace("ROW", "in_lane")
    + r"""
            seen[k] = {az, bz, cz, edge_u, edge_v, edge_w, (least >= 0.0f) | (greatest <= 0.0f)};
            inside |= WARP_RT_MASK(seen[k].is_inside);
        }
        if (inside == 0)
            continue;
#pragma unroll
        for (int k = 0; k < BLOCKS; ++k) {
            auto& block = blocks[k];
            const auto& s = seen[k];
            const floats determinant = s.edge_u + s.edge_v + s.edge_w;
            const floats t
                = (s.edge_u * s.az + s.edge_v * s.bz + s.edge_w * s.cz) * (block.shear_z / determinant);
            const ints is_met = s.is_inside & (determinant != 0.0f) & (block.skip != id) & (t >= 0.0f) & (t < block.t);
            block.t = is_met ? t : block.t;
            block.edge_v = is_met ? s.edge_v : block.edge_v;
            block.edge_w = is_met ? s.edge_w : block.edge_w;
            block.determinant = is_met ? determinant : block.determinant;
            block.lane = is_met ? (ints)lane : block.lane;
        }
    }
"""
)

_WRITE_HITS = r"""
#pragma unroll
    for (int k = 0; k < BLOCKS; ++k) {
        const auto& block = blocks[k];
        float *end = (float*)ends.data + 16 * k, *u_ = (float*)u.data + 16 * k, *v_ = (float*)v.data + 16 * k;
        int* words_ = (int*)words.data + 16 * k;
        const ints is_hit = block.is_in & (block.t < WARP_RT_LOAD(end));
        const unsigned int mask = WARP_RT_MASK(is_hit);
        if (mask == 0)
            continue;
        const floats inverse = 1.0f / block.determinant;
        *(floats_load*)end = is_hit ? block.t : WARP_RT_LOAD(end);
        *(floats_load*)u_ = is_hit ? block.edge_v * inverse : WARP_RT_LOAD(u_);
        *(floats_load*)v_ = is_hit ? block.edge_w * inverse : WARP_RT_LOAD(v_);
        *(ints_load*)words_ = is_hit ? leaf * LEAF_FLOATS + LEAF_IDS + block.lane : WARP_RT_LOAD_INTS(words_);
        hits |= (uint32_t)mask << 16 * k;
    }
"""

_MEET_CHOSEN = (
    "uint32_t hits = 0;\n#if defined(__clang__) && !defined(__CUDA_ARCH__)\n"
    + VECTOR_TYPES
    + _LOAD_BLOCKS
    + _MEET_ONE_BY_ONE
    + _WRITE_HITS
    + "}\n#endif\nreturn hits;\n"
)
_MEET_CHOSEN = spell_out(
    _MEET_CHOSEN, AXES_ROW=AXES_ROW, GROUP=GROUP, LEAF_FLOATS=LEAF_FLOATS, LEAF_IDS=LEAF_IDS, SHEAR_ROW=SHEAR_ROW
)


@wp.func_native(_MEET_CHOSEN)
def meet_chosen_triangles(
    leaves: wp.array[float],
    leaf: int,
    lanes: int,
    group: wp.array[float],
    first: int,
    rays: wp.uint32,
    skips: wp.array[int],
    ends: wp.array[float],
    u: wp.array[float],
    v: wp.array[float],
    words: wp.array[int],
) -> wp.uint32:
    """Return and write what ``meet_triangles`` does if no ray meets a triangle but those of some lanes of the packet.

    All rays, at least one, have their shear axes in common. Not on a GPU, where ``reachable_triangles`` chooses none.
    """
    ...
