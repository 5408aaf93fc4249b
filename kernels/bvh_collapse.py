# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From binary trees to wide ones: chosen by cost, then packed for traversal, level by level.

Wide nodes of one level are opened side by side, each by a thread; what they add up to is found from the deepest level
up, and then, from the roots down, where they go. A launch reads only what earlier ones have written: there is neither
an atomic nor a fence, and the result is the same on every device, whatever the order of threads.

Reference: Ylitie, Karras and Laine (2017), Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs,
HPG, section 4.1. Differs by a leaf of the binary tree being a leaf packet already: nothing is left to merge.
"""

import warp as wp

from .bounds import box_half_area, box_padding
from .bvh_structs import BinaryTrees, Box
from .constants import LEAF_FLOATS, LEAF_IDS, NODE_CHILDREN, NODE_FLOATS, NODE_ORDERS, WIDTH
from .native import spell_out

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class WideNode:
    """A wide node to be, one of a level of all trees: what it stands for, what is below it, and where it goes."""

    slot: int
    """Of the binary node that it stands for."""
    tree: int
    child_count: int
    """0 where it is the root of a tree that is one leaf: then it becomes no node."""
    node_count: int
    """Wide nodes of its subtree, its own included."""
    leaf_count: int
    """Leaves of its subtree."""
    depth: int
    """Levels of its subtree."""
    stack_size: int
    """Entries that a traversal of its subtree can leave on its stack at once, whatever the ray."""
    number: int
    """Its own."""
    first_below: int
    """Number of the first node below it."""
    first_leaf: int
    """Number of the first leaf below it."""


@wp.func
def evaluate_costs(trees: BinaryTrees, slot: int):
    """Fill a node's row of ``costs`` and ``shares`` from those of its children."""
    node = trees.nodes[slot]
    area = box_half_area(node.low, node.high)
    row = slot - trees.first_cost
    if node.right < 0:
        for k in range(WIDTH):
            trees.costs[row, k] = area
            trees.shares[slot, k] = wp.int8(0)
    else:
        left = node.left - trees.first_cost
        right = node.right - trees.first_cost
        # As a wide node of its own: the best way to share its lanes.
        best = float(wp.inf)
        share = int(1)
        for k in range(1, WIDTH):
            cost = trees.costs[left, k - 1] + trees.costs[right, WIDTH - k - 1]
            if cost < best:
                best = cost
                share = int(k)
        trees.shares[slot, WIDTH - 1] = wp.int8(share)
        best += area
        trees.costs[row, 0] = best
        trees.shares[slot, 0] = wp.int8(0)
        # Dissolved into its parent, as j + 1 of its children.
        for j in range(1, WIDTH - 1):
            share = int(0)
            for k in range(1, j + 1):
                cost = trees.costs[left, k - 1] + trees.costs[right, j - k]
                if cost < best:
                    best = cost
                    share = int(k)
            trees.costs[row, j] = best
            trees.shares[slot, j] = wp.int8(share)


@wp.kernel
def evaluate_above(slots: wp.array[int], trees: BinaryTrees):
    """Fill the rows of the nodes above all subtrees, given parents first; one thread."""
    for step in range(slots.shape[0]):
        evaluate_costs(trees, slots[slots.shape[0] - 1 - step])


@wp.func
def gather_children(trees: BinaryTrees, slot: int, work: wp.array[int], found: wp.array[int]) -> int:
    """Write the slots of the binary nodes that become children of the wide node for a slot, left to right.

    Returns how many there are.
    """
    share = int(trees.shares[slot, WIDTH - 1])
    work[0] = trees.nodes[slot].right
    work[1] = WIDTH - share
    work[2] = trees.nodes[slot].left
    work[3] = share
    top = int(2)
    count = int(0)
    while top > 0:
        top -= 1
        y = work[2 * top]
        lanes = work[2 * top + 1]
        while lanes > 1 and int(trees.shares[y, lanes - 1]) == 0:
            lanes -= 1
        if lanes > 1:
            share = int(trees.shares[y, lanes - 1])
            work[2 * top] = trees.nodes[y].right
            work[2 * top + 1] = lanes - share
            work[2 * top + 2] = trees.nodes[y].left
            work[2 * top + 3] = share
            top += 2
        else:
            found[count] = y
            count += 1
    return count


@wp.func
def order_lanes(nodes: wp.array[float], word: int, octant: int, keys: wp.array[float], lanes: wp.array[int]):
    """Write the order in which rays of an octant meet the lanes of the node at ``word``, the farthest first.

    By the boxes' centres along the octant's diagonal: within 1 % of the visits that sorting by each ray's own distances
    would need.

    Reference: Fuetterling et al. (2017), Accelerated Single Ray Tracing for Wide Vector Units, HPG, section 3. Differs
    by the key: theirs is the binary tree's order.

    Args:
        nodes: Wide nodes.
        word: Where the node begins.
        octant: Bit a is set where component a of the directions is negative.
        keys: Working memory, shape [16].
        lanes: Working memory, shape [16].
    """
    for lane in range(WIDTH):
        key = float(0.0)
        for axis in range(3):
            center = nodes[word + WIDTH * axis + lane] + nodes[word + WIDTH * (3 + axis) + lane]
            key += -center if (octant >> axis) & 1 == 1 else center
        place = int(lane)
        while place > 0 and keys[place - 1] < key:
            keys[place] = keys[place - 1]
            lanes[place] = lanes[place - 1]
            place -= 1
        keys[place] = key
        lanes[place] = lane
    for parity in range(2):
        order = wp.uint32(0)
        for half in range(wp.static(WIDTH // 2)):
            order = order | (wp.uint32(lanes[2 * half + parity]) << wp.uint32(4 * half))
        nodes[word + NODE_ORDERS + 2 * octant + parity] = wp.cast(order, wp.float32)


@wp.kernel
def start_levels(slots: wp.array[int], first: int, roots_out: wp.array[WideNode]):
    """Write the topmost level: the root of each tree."""
    tree = first + wp.tid()
    root = WideNode()
    root.slot = slots[tree]
    root.tree = tree
    roots_out[tree] = root


@wp.kernel
def open_nodes(
    trees: BinaryTrees,
    first: int,
    level: wp.array[WideNode],
    children_out: wp.array2d[int],
    inner_counts_out: wp.array[int],
):
    """Write the binary slots of the children of a level's nodes, and how many of these become nodes themselves."""
    i = first + wp.tid()
    slot = level[i].slot
    count = int(0)
    inner_count = int(0)
    if trees.nodes[slot].right >= 0:
        work = wp.zeros(shape=(wp.static(2 * WIDTH),), dtype=int)
        found = wp.zeros(shape=(WIDTH,), dtype=int)
        count = gather_children(trees, slot, work, found)
        for lane in range(count):
            children_out[i, lane] = found[lane]
            if trees.nodes[found[lane]].right >= 0:
                inner_count += 1
    level[i].child_count = count
    inner_counts_out[i] = inner_count


@wp.kernel
def list_children(
    trees: BinaryTrees,
    level: wp.array[WideNode],
    inner_ends: wp.array[int],
    first: int,
    children: wp.array2d[int],
    below_out: wp.array[WideNode],
):
    """Write the next level, and turn children into its rows, or, where they are leaves, into -1 - slot.

    ``inner_ends`` are the running sums of the counts of ``open_nodes``.
    """
    i = first + wp.tid()
    row = int(0)
    if i > 0:
        row = inner_ends[i - 1]
    for lane in range(level[i].child_count):
        slot = children[i, lane]
        if trees.nodes[slot].right < 0:
            children[i, lane] = -1 - slot
        else:
            children[i, lane] = row
            node = WideNode()
            node.slot = slot
            node.tree = level[i].tree
            below_out[row] = node
            row += 1


@wp.kernel
def summarize_nodes(below: wp.array[WideNode], children: wp.array2d[int], first: int, level: wp.array[WideNode]):
    """Write what lies below the nodes of a level, the level ``below`` being done."""
    i = first + wp.tid()
    count = level[i].child_count
    node_count = int(1)
    leaf_count = int(0)
    depth = int(0)
    stack_size = int(0)
    for lane in range(count):
        row = children[i, lane]
        if row < 0:
            leaf_count += 1
        else:
            node_count += below[row].node_count
            leaf_count += below[row].leaf_count
            depth = wp.max(depth, below[row].depth)
            stack_size = wp.max(stack_size, below[row].stack_size)
    if count == 0:
        level[i].node_count = 0
        level[i].leaf_count = 1
        level[i].depth = 0
        level[i].stack_size = 0
    else:
        level[i].node_count = node_count
        level[i].leaf_count = leaf_count
        level[i].depth = 1 + depth
        # A traversal goes on into one child and leaves the others on its stack.
        level[i].stack_size = count - 1 + stack_size


@wp.kernel
def place_roots(tree_node: wp.array[int], tree_leaf: wp.array[int], first: int, level: wp.array[WideNode]):
    """Write where the trees' nodes and leaves go."""
    tree = first + wp.tid()
    level[tree].number = tree_node[tree]
    level[tree].first_below = tree_node[tree] + 1
    level[tree].first_leaf = tree_leaf[tree]


@wp.kernel
def write_nodes(
    trees: BinaryTrees,
    level: wp.array[WideNode],
    children: wp.array2d[int],
    node_offset: int,
    first: int,
    below: wp.array[WideNode],
    numbers_out: wp.array[int],
    leaf_slots_out: wp.array[int],
    leaf_trees_out: wp.array[int],
    wide_nodes_out: wp.array[float],
):
    """Write the nodes of a level and where those of the level below go.

    The nodes of a tree lie together, those with the same parent side by side; then come the last one's descendants,
    then those of the one before, and leaves likewise: neighbours in space are neighbours in memory.
    """
    i = first + wp.tid()
    count = level[i].child_count
    leaf = int(level[i].first_leaf)
    numbers_out[i] = level[i].number if count > 0 else -1
    if count == 0:
        leaf_slots_out[leaf] = level[i].slot
        leaf_trees_out[leaf] = level[i].tree
        return
    word = level[i].number * NODE_FLOATS
    number = int(level[i].first_below)
    for lane in range(WIDTH):
        low = wp.vec3(wp.inf)
        high = wp.vec3(-wp.inf)
        code = int(0)
        if lane < count:
            row = children[i, lane]
            slot = -1 - row
            if row < 0:
                code = -1 - leaf
                leaf_slots_out[leaf] = slot
                leaf_trees_out[leaf] = level[i].tree
                leaf += 1
            else:
                slot = below[row].slot
                code = node_offset + number
                below[row].number = number
                number += 1
            padding = box_padding(trees.nodes[slot].low, trees.nodes[slot].high)
            low = trees.nodes[slot].low - wp.vec3(padding)
            high = trees.nodes[slot].high + wp.vec3(padding)
        for axis in range(3):
            wide_nodes_out[word + WIDTH * axis + lane] = low[axis]
            wide_nodes_out[word + WIDTH * (3 + axis) + lane] = high[axis]
        wide_nodes_out[word + NODE_CHILDREN + lane] = wp.cast(code, wp.float32)
    for step in range(count):
        row = children[i, count - 1 - step]
        if row >= 0:
            below[row].first_below = number
            below[row].first_leaf = leaf
            number += below[row].node_count - 1
            leaf += below[row].leaf_count
    keys = wp.zeros(shape=(WIDTH,), dtype=float)
    lanes = wp.zeros(shape=(WIDTH,), dtype=int)
    for octant in range(8):
        order_lanes(wide_nodes_out, word, octant, keys, lanes)


@wp.kernel
def summarize_trees(
    trees: BinaryTrees, slots: wp.array[int], first: int, boxes_out: wp.array[Box], costs_out: wp.array[float]
):
    """Write the boxes of trees and their costs."""
    tree = first + wp.tid()
    root = slots[tree]
    boxes_out[tree].low = trees.nodes[root].low
    boxes_out[tree].high = trees.nodes[root].high
    costs_out[tree] = trees.costs[root, 0]


_PACK_LEAF = """
    float* words = leaves.data + (size_t)leaf * LEAF_FLOATS;
    int* ids_out = (int*)words + LEAF_IDS;
    for (int lane = 0; lane < WIDTH; ++lane) {
        const int triangle = lane < count ? ids.data[begin + lane] + first_id : -1;
        for (int corner = 0; corner < 3; ++corner) {
            const float* p = triangle < 0 ? nullptr : &points.data[triangles.data[3 * (size_t)triangle + corner]][0];
            for (int axis = 0; axis < 3; ++axis)
                words[(3 * corner + axis) * WIDTH + lane] = p ? p[axis] : NAN;
        }
        ids_out[lane] = triangle < 0 ? -1 : triangle - first_triangle;
    }
"""


@wp.func_native(spell_out(_PACK_LEAF, LEAF_FLOATS=LEAF_FLOATS, LEAF_IDS=LEAF_IDS, WIDTH=WIDTH))
def pack_leaf(
    ids: wp.array[int],
    begin: int,
    count: int,
    first_id: int,
    points: wp.array[wp.vec3],
    triangles: wp.array[int],
    first_triangle: int,
    leaf: int,
    leaves: wp.array[float],
):
    """Write a leaf packet of ``count`` triangles, whose numbers are ``ids`` from ``begin`` on, plus ``first_id``.

    Their mesh's begin at ``first_triangle``.
    """
    ...


@wp.kernel
def pack_triangles(
    trees: BinaryTrees,
    points: wp.array[wp.vec3],
    triangles: wp.array[int],
    leaf_slots: wp.array[int],
    leaf_trees: wp.array[int],
    tree_first: wp.array[int],
    first: int,
    leaves_out: wp.array[float],
):
    """Write a leaf packet."""
    leaf = first + wp.tid()
    node = trees.nodes[leaf_slots[leaf]]
    first_triangle = tree_first[leaf_trees[leaf]]
    pack_leaf(trees.ids, node.left, -node.right, 0, points, triangles, first_triangle, leaf, leaves_out)


@wp.kernel
def rank_primitives(trees: BinaryTrees, leaf_slots: wp.array[int], first: int, leaf_of_primitive_out: wp.array[int]):
    """Write the leaf of each primitive of a tree whose leaves hold one."""
    leaf = first + wp.tid()
    leaf_of_primitive_out[trees.ids[trees.nodes[leaf_slots[leaf]].left]] = leaf
