# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Leaf packets of trees over shapes; bvh_structs.py describes them."""

import warp as wp

from .bvh_structs import BinaryTrees
from .constants import SHAPE_FLOATS, SHAPE_ID, SHAPE_LANES, SHAPE_WORDS

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def pack_shapes(
    trees: BinaryTrees,
    lanes: wp.array2d[float],
    ids: wp.array[int],
    leaf_slots: wp.array[int],
    first: int,
    shapes_out: wp.array[float],
):
    """Write a leaf packet: of each reference's row of ``lanes`` the nine words, and its id."""
    leaf = first + wp.tid()
    node = trees.nodes[leaf_slots[leaf]]
    for lane in range(SHAPE_LANES):
        word = leaf * SHAPE_FLOATS + lane * SHAPE_WORDS
        index = int(-1)
        if lane < -node.right:
            source = trees.ids[node.left + lane]
            index = ids[source]
            for k in range(SHAPE_ID):
                shapes_out[word + k] = lanes[source, k]
        shapes_out[word + SHAPE_ID] = wp.cast(index, wp.float32)
