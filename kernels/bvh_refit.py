# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""New boxes for old trees: meshes whose points move while their triangles stay the same ones.

Leaves first, then level by level upwards, a launch each: a node reads what earlier launches have written.
"""

import warp as wp

from .bounds import box_half_area, box_padding
from .bvh_collapse import order_lanes, pack_leaf
from .bvh_structs import Box
from .constants import LEAF_FLOATS, LEAF_IDS, NODE_CHILDREN, NODE_FLOATS, WIDTH
from .native import spell_out

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


_MEASURE_LEAF = """
    const float* words = leaves.data + (size_t)leaf * LEAF_FLOATS;
    for (int axis = 0; axis < 3; ++axis) {
        float low = INFINITY, high = -INFINITY;
        for (int corner = 0; corner < 3; ++corner) {
            for (int lane = 0; lane < WIDTH; ++lane) {
                // Empty lanes hold NaN, which is neither less nor greater.
                const float value = words[(3 * corner + axis) * WIDTH + lane];
                low = value < low ? value : low;
                high = value > high ? value : high;
            }
        }
        boxes.data[leaf].low[axis] = low;
        boxes.data[leaf].high[axis] = high;
    }
"""


@wp.func_native(spell_out(_MEASURE_LEAF, LEAF_FLOATS=LEAF_FLOATS, WIDTH=WIDTH))
def measure_leaf(leaves: wp.array[float], leaf: int, boxes: wp.array[Box]):
    """Write the box of a leaf packet's triangles."""
    ...


@wp.kernel
def refit_leaves(
    ids: wp.array[int],
    points: wp.array[wp.vec3],
    triangles: wp.array[int],
    leaf_trees: wp.array[int],
    tree_first: wp.array[int],
    first: int,
    leaves_out: wp.array[float],
    boxes_out: wp.array[Box],
):
    """Write a leaf packet anew, and its box; ``ids`` are the words of the old packets."""
    leaf = first + wp.tid()
    word = leaf * LEAF_FLOATS + LEAF_IDS
    count = int(0)
    for lane in range(WIDTH):
        if ids[word + lane] >= 0:
            count += 1
    first_triangle = tree_first[leaf_trees[leaf]]
    pack_leaf(ids, word, count, first_triangle, points, triangles, first_triangle, leaf, leaves_out)
    measure_leaf(leaves_out, leaf, boxes_out)


@wp.kernel
def refit_nodes(
    numbers: wp.array[int],
    nodes: wp.array[float],
    leaf_boxes: wp.array[Box],
    first: int,
    node_boxes: wp.array[Box],
    node_costs: wp.array[float],
    nodes_out: wp.array[float],
):
    """Write the nodes of one level anew, their boxes, and the half area of all nodes and leaves below each.

    Those of the level below are done. A number of -1 stands for a tree that is one leaf.
    """
    node = numbers[first + wp.tid()]
    if node < 0:
        return
    word = node * NODE_FLOATS
    box = Box()
    box.low = wp.vec3(wp.inf)
    box.high = wp.vec3(-wp.inf)
    cost = float(0.0)
    for lane in range(WIDTH):
        child = Box()
        child.low = wp.vec3(wp.inf)
        child.high = wp.vec3(-wp.inf)
        code = wp.cast(nodes[word + NODE_CHILDREN + lane], wp.int32)
        if nodes[word + lane] < wp.inf:
            if code >= 0:
                child = node_boxes[code]
                cost += node_costs[code]
            else:
                child = leaf_boxes[-1 - code]
                cost += box_half_area(child.low, child.high)
            box.low = wp.min(box.low, child.low)
            box.high = wp.max(box.high, child.high)
            padding = box_padding(child.low, child.high)
            child.low = child.low - wp.vec3(padding)
            child.high = child.high + wp.vec3(padding)
        for axis in range(3):
            nodes_out[word + WIDTH * axis + lane] = child.low[axis]
            nodes_out[word + WIDTH * (3 + axis) + lane] = child.high[axis]
        nodes_out[word + NODE_CHILDREN + lane] = nodes[word + NODE_CHILDREN + lane]
    node_boxes[node] = box
    node_costs[node] = cost + box_half_area(box.low, box.high)
    keys = wp.zeros(shape=(WIDTH,), dtype=float)
    lanes = wp.zeros(shape=(WIDTH,), dtype=int)
    for octant in range(8):
        order_lanes(nodes_out, word, octant, keys, lanes)


@wp.kernel
def summarize_roots(
    roots: wp.array[int],
    node_boxes: wp.array[Box],
    node_costs: wp.array[float],
    leaf_boxes: wp.array[Box],
    first: int,
    boxes_out: wp.array[Box],
    costs_out: wp.array[float],
):
    """Write the boxes of trees and their costs, given the child codes of their roots."""
    tree = first + wp.tid()
    root = roots[tree]
    if root >= 0:
        boxes_out[tree] = node_boxes[root]
        costs_out[tree] = node_costs[root]
    else:
        boxes_out[tree] = leaf_boxes[-1 - root]
        costs_out[tree] = box_half_area(leaf_boxes[-1 - root].low, leaf_boxes[-1 - root].high)
