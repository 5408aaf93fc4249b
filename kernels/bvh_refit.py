# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""New boxes for old trees: meshes whose points move while their triangles stay the same ones."""

import warp as wp

from .bounds import box_half_area, box_padding
from .bvh_collapse import order_lanes, pack_leaf
from .constants import LEAF_FLOATS, LEAF_IDS, NODE_CHILDREN, NODE_FLOATS, WIDTH

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class Box:
    """An axis-aligned box."""

    low: wp.vec3
    high: wp.vec3


@wp.func_native(
    """
    const float* words = leaves.data + (size_t)leaf * 160;
    for (int axis = 0; axis < 3; ++axis) {
        float low = INFINITY, high = -INFINITY;
        for (int corner = 0; corner < 3; ++corner) {
            for (int lane = 0; lane < 16; ++lane) {
                // Empty lanes hold NaN, which is neither less nor greater.
                const float value = words[48 * corner + 16 * axis + lane];
                low = value < low ? value : low;
                high = value > high ? value : high;
            }
        }
        boxes.data[leaf].low[axis] = low;
        boxes.data[leaf].high[axis] = high;
    }
"""
)
def measure_leaf(leaves: wp.array[float], leaf: int, boxes: wp.array[Box]):
    """Write the box of a leaf packet's triangles."""
    ...


@wp.kernel
def refit_leaves(
    ids: wp.array[int],
    points: wp.array[wp.vec3],
    triangles: wp.array[int],
    tree_first: wp.array[int],
    tree_leaf: wp.array[int],
    chunk_tree: wp.array[int],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    first: int,
    leaves_out: wp.array[float],
    boxes_out: wp.array[Box],
):
    """Write one chunk of a tree's leaf packets anew, and their boxes; ``ids`` are the words of the old packets."""
    chunk = first + wp.tid()
    tree = chunk_tree[chunk]
    begin = tree_leaf[tree] + chunk_first[chunk]
    for leaf in range(begin, begin + chunk_count[chunk]):
        word = leaf * LEAF_FLOATS + LEAF_IDS
        count = int(0)
        for lane in range(WIDTH):
            if ids[word + lane] >= 0:
                count += 1
        pack_leaf(ids, word, count, tree_first[tree], points, triangles, tree_first[tree], leaf, leaves_out)
        measure_leaf(leaves_out, leaf, boxes_out)


@wp.kernel
def refit_nodes(
    nodes: wp.array[float],
    tree_node: wp.array[int],
    node_counts: wp.array[int],
    tree_leaf: wp.array[int],
    leaf_boxes: wp.array[Box],
    node_boxes: wp.array[Box],
    first: int,
    nodes_out: wp.array[float],
    boxes_out: wp.array[Box],
    costs_out: wp.array[float],
):
    """Write the nodes of tree ``first`` + thread anew, its box, and the half area of its nodes and leaves.

    Nodes have higher numbers than their parents.
    """
    tree = first + wp.tid()
    cost = float(0.0)
    root = Box()
    root.low = leaf_boxes[tree_leaf[tree]].low
    root.high = leaf_boxes[tree_leaf[tree]].high
    for step in range(node_counts[tree]):
        node = tree_node[tree] + node_counts[tree] - 1 - step
        word = node * NODE_FLOATS
        root.low = wp.vec3(wp.inf)
        root.high = wp.vec3(-wp.inf)
        for lane in range(WIDTH):
            child = Box()
            child.low = wp.vec3(wp.inf)
            child.high = wp.vec3(-wp.inf)
            code = wp.cast(nodes[word + NODE_CHILDREN + lane], wp.int32)
            if nodes[word + lane] < wp.inf:
                if code >= 0:
                    child = node_boxes[code]
                else:
                    child = leaf_boxes[-1 - code]
                    cost += box_half_area(child.low, child.high)
                root.low = wp.min(root.low, child.low)
                root.high = wp.max(root.high, child.high)
                padding = box_padding(child.low, child.high)
                child.low = child.low - wp.vec3(padding)
                child.high = child.high + wp.vec3(padding)
            for axis in range(3):
                nodes_out[word + WIDTH * axis + lane] = child.low[axis]
                nodes_out[word + WIDTH * (3 + axis) + lane] = child.high[axis]
            nodes_out[word + NODE_CHILDREN + lane] = nodes[word + NODE_CHILDREN + lane]
        node_boxes[node] = root
        cost += box_half_area(root.low, root.high)
    if node_counts[tree] == 0:
        cost = box_half_area(root.low, root.high)
    boxes_out[tree] = root
    costs_out[tree] = cost


@wp.kernel
def order_nodes(first: int, nodes: wp.array[float]):
    """Write the orders of the lanes of node ``first`` + thread."""
    keys = wp.zeros(shape=(WIDTH,), dtype=float)
    lanes = wp.zeros(shape=(WIDTH,), dtype=int)
    for octant in range(8):
        order_lanes(nodes, (first + wp.tid()) * NODE_FLOATS, octant, keys, lanes)
