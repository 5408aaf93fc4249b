# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From the binary tree to wide nodes: chosen by cost, then packed for traversal.

Reference: Ylitie, Karras and Laine (2017), Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs,
HPG, section 4.1. Differs by a leaf of the binary tree being a leaf packet already: nothing is left to merge.
"""

import warp as wp

from .bounds import box_half_area, box_padding
from .bvh_structs import BinaryTrees, TreeSummary
from .constants import NODE_CHILDREN, NODE_FLOATS, NODE_ORDERS, WIDTH

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class WideNode:
    """A wide node that a walk has yet to visit."""

    slot: int
    """Of the binary node that it stands for."""
    number: int
    """Its own, within the walk."""
    level: int
    """Wide nodes on the way to it, its own included."""
    entries: int
    """Stack entries that can be pending when a traversal reaches it."""


@wp.func
def evaluate_costs(trees: BinaryTrees, slot: int):
    """Fill a node's row of ``costs`` and ``shares`` from those of its children."""
    node = trees.nodes[slot]
    area = box_half_area(node.low, node.high)
    if node.right < 0:
        for k in range(WIDTH):
            trees.costs[slot, k] = area
            trees.shares[slot, k] = wp.int8(0)
    else:
        # As a wide node of its own: the best way to share its lanes.
        best = float(wp.inf)
        share = int(1)
        for k in range(1, WIDTH):
            cost = trees.costs[node.left, k - 1] + trees.costs[node.right, WIDTH - k - 1]
            if cost < best:
                best = cost
                share = int(k)
        trees.shares[slot, WIDTH - 1] = wp.int8(share)
        best += area
        trees.costs[slot, 0] = best
        trees.shares[slot, 0] = wp.int8(0)
        # Dissolved into its parent, as j + 1 of its children.
        for j in range(1, WIDTH - 1):
            share = int(0)
            for k in range(1, j + 1):
                cost = trees.costs[node.left, k - 1] + trees.costs[node.right, j - k]
                if cost < best:
                    best = cost
                    share = int(k)
            trees.costs[slot, j] = best
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


@wp.struct
class Parts:
    """Parts of trees that are walked one by one: all of a small tree; of a big one the levels above all subtrees,
    then what is cut off there, each piece from a wide node down."""

    root: wp.array[int]
    """shape [part_count], slot of the topmost node."""
    is_above: int
    """1: the parts end where ``is_above_subtrees`` does."""
    room: wp.array[int]
    """shape [part_count], where those parts have room for pending nodes; others know by themselves."""
    cut: wp.array[int]
    """shape [part_count], first of a part's cuts."""
    node: wp.array[int]
    """shape [part_count], number of the part's first wide node."""
    leaf: wp.array[int]
    """shape [part_count], number of the part's first leaf."""


@wp.kernel
def walk_parts(
    trees: BinaryTrees,
    is_above_subtrees: wp.array[wp.int8],
    parts: Parts,
    node_offset: int,
    pending: wp.array[WideNode],
    is_packing: bool,
    first: int,
    cuts: wp.array[WideNode],
    summaries_out: wp.array[TreeSummary],
    leaf_slots_out: wp.array[int],
    wide_nodes_out: wp.array[float],
):
    """Walk the wide nodes of part ``first`` + thread: first to count them and list the cuts, then to write them.

    Packing writes the nodes and the slots of the leaves, and reads the numbers of the cuts' nodes from ``cuts``.
    """
    part = first + wp.tid()
    root = parts.root[part]
    summary = TreeSummary()
    cut = int(parts.cut[part])
    first_node = int(0)
    first_leaf = int(0)
    if is_packing:
        first_node = parts.node[part]
        first_leaf = parts.leaf[part]
    if trees.nodes[root].right < 0:
        if is_packing:
            leaf_slots_out[first_leaf] = root
        summary.leaf_count = 1
        summaries_out[part] = summary
        return
    # Parts that are walked at the same time have disjoint subtrees, whose nodes but for the root lie together, two a
    # pair of children: half the slot of the first pair begins a place that is a part's own and has enough room.
    base = trees.nodes[root].left // 2
    if parts.is_above == 1:
        base = parts.room[part]
    work = wp.zeros(shape=(wp.static(2 * WIDTH),), dtype=int)
    found = wp.zeros(shape=(WIDTH,), dtype=int)
    keys = wp.zeros(shape=(WIDTH,), dtype=float)
    pending[base].slot = root
    pending[base].number = 0
    pending[base].level = 1
    pending[base].entries = 0
    summary.node_count = 1
    top = int(1)
    while top > 0:
        top -= 1
        wide = pending[base + top]
        count = gather_children(trees, wide.slot, work, found)
        # A traversal goes on into one child and leaves the others on its stack.
        entries = wide.entries + count - 1
        summary.depth = wp.max(summary.depth, wide.level)
        summary.stack_size = wp.max(summary.stack_size, entries)
        word = (first_node + wide.number) * NODE_FLOATS
        for lane in range(WIDTH):
            low = wp.vec3(wp.inf)
            high = wp.vec3(-wp.inf)
            code = int(0)
            if lane < count:
                slot = found[lane]
                padding = box_padding(trees.nodes[slot].low, trees.nodes[slot].high)
                low = trees.nodes[slot].low - wp.vec3(padding)
                high = trees.nodes[slot].high + wp.vec3(padding)
                if trees.nodes[slot].right < 0:
                    code = -1 - first_leaf - summary.leaf_count
                    if is_packing:
                        leaf_slots_out[-1 - code] = slot
                    summary.leaf_count += 1
                elif parts.is_above == 1 and is_above_subtrees[slot] == wp.int8(0):
                    if is_packing:
                        code = node_offset + cuts[cut].number
                    else:
                        cuts[cut].slot = slot
                        cuts[cut].level = wide.level
                        cuts[cut].entries = entries
                    cut += 1
                else:
                    code = node_offset + first_node + summary.node_count
                    pending[base + top].slot = slot
                    pending[base + top].number = summary.node_count
                    pending[base + top].level = wide.level + 1
                    pending[base + top].entries = entries
                    summary.node_count += 1
                    top += 1
            if is_packing:
                for axis in range(3):
                    wide_nodes_out[word + WIDTH * axis + lane] = low[axis]
                    wide_nodes_out[word + WIDTH * (3 + axis) + lane] = high[axis]
                wide_nodes_out[word + NODE_CHILDREN + lane] = wp.cast(code, wp.float32)
        if is_packing:
            for octant in range(8):
                order_lanes(wide_nodes_out, word, octant, keys, found)
    summary.cut_count = cut - parts.cut[part]
    summaries_out[part] = summary


@wp.func_native(
    """
    float* words = leaves.data + (size_t)leaf * 160;
    int* ids_out = (int*)words + 144;
    for (int lane = 0; lane < 16; ++lane) {
        const int triangle = lane < count ? ids.data[begin + lane] + first_id : -1;
        for (int corner = 0; corner < 3; ++corner) {
            const float* p = triangle < 0 ? nullptr : &points.data[triangles.data[3 * (size_t)triangle + corner]][0];
            for (int axis = 0; axis < 3; ++axis)
                words[48 * corner + 16 * axis + lane] = p ? p[axis] : NAN;
        }
        ids_out[lane] = triangle < 0 ? -1 : triangle - first_triangle;
    }
"""
)
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
    tree_first: wp.array[int],
    tree_leaf: wp.array[int],
    chunk_tree: wp.array[int],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    first: int,
    leaves_out: wp.array[float],
):
    """Write one chunk of a tree's leaf packets."""
    chunk = first + wp.tid()
    tree = chunk_tree[chunk]
    begin = tree_leaf[tree] + chunk_first[chunk]
    for leaf in range(begin, begin + chunk_count[chunk]):
        node = trees.nodes[leaf_slots[leaf]]
        pack_leaf(trees.ids, node.left, -node.right, 0, points, triangles, tree_first[tree], leaf, leaves_out)


@wp.kernel
def list_leaf_primitives(trees: BinaryTrees, leaf_slots: wp.array[int], ids_out: wp.array[int]):
    """Write the primitive of each leaf of a tree whose leaves hold one."""
    leaf = wp.tid()
    ids_out[leaf] = trees.ids[trees.nodes[leaf_slots[leaf]].left]
