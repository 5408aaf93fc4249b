# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Leaves of the tree over instances: their world boxes."""

import warp as wp

from .bvh_build import measure_range
from .bvh_structs import BuildRange, Reference
from .constants import INSTANCE_ROUNDING, NODE_FLOATS, WIDTH

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def node_corner(nodes: wp.array[float], word: int) -> wp.vec3d:
    """Return a corner of a child's box: the lane of three rows that begin at ``word``."""
    x = wp.float64(nodes[word])
    y = wp.float64(nodes[word + WIDTH])
    z = wp.float64(nodes[word + 2 * WIDTH])
    return wp.vec3d(x, y, z)


@wp.kernel
def refer_to_instances(
    tree: wp.array[int],
    roots: wp.array[int],
    boxes: wp.array2d[wp.vec3],
    nodes: wp.array[float],
    world_from_local: wp.array3d[wp.float64],
    first: int,
    end: int,
    chunk: int,
    references_out: wp.array[Reference],
    chunk_ranges_out: wp.array[BuildRange],
):
    """Write the references of one chunk of instances, from ``first`` to before ``end``, and the chunk's boxes.

    Transforms are those of the chunk.
    Each world box contains all that float32 rays can hit of the instance. It is that of the boxes of the root's
    children, transformed one by one: smaller than the root's own box transformed, where that is turned.
    """
    for i in range(first, end):
        root = roots[tree[i]]
        lanes = wp.int32(WIDTH) if root >= 0 else 1
        world_low = wp.vec3d(wp.float64(wp.inf))
        world_high = wp.vec3d(wp.float64(-wp.inf))
        for lane in range(lanes):
            low = wp.vec3d(boxes[tree[i], 0])
            high = wp.vec3d(boxes[tree[i], 1])
            if root >= 0:
                low = node_corner(nodes, root * NODE_FLOATS + lane)
                high = node_corner(nodes, root * NODE_FLOATS + 3 * WIDTH + lane)
            if low[0] <= high[0]:
                for row in range(3):
                    center = world_from_local[i - first, row, 3]
                    half = wp.float64(0.0)
                    for k in range(3):
                        center += world_from_local[i - first, row, k] * (low[k] + high[k]) * wp.float64(0.5)
                        half += wp.abs(world_from_local[i - first, row, k]) * (high[k] - low[k]) * wp.float64(0.5)
                    world_low[row] = wp.min(world_low[row], center - half)
                    world_high[row] = wp.max(world_high[row], center + half)
        growth = wp.float64(INSTANCE_ROUNDING) * wp.max(wp.max(wp.abs(world_low)), wp.max(wp.abs(world_high)))
        reference = Reference()
        for axis in range(3):
            reference.low[axis] = wp.float32(world_low[axis] - growth)
            reference.high[axis] = wp.float32(world_high[axis] + growth)
        reference.low[3] = wp.cast(i, wp.float32)
        reference.high[3] = wp.cast(1, wp.float32)
        references_out[i] = reference
    measure_range(references_out, first, end - first, chunk_ranges_out, chunk)
