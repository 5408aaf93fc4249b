# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From the binary tree to nodes of eight children: chosen by cost, then packed for traversal.

Reference: Ylitie, Karras and Laine (2017), Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs,
HPG, section 4.1. Differs by a leaf of the binary tree being a leaf packet already: nothing is left to merge.
"""

import warp as wp

from .bounds import box_half_area
from .bvh_structs import BinaryNode, Reference, TreeSummary
from .constants import LEAF_FLOATS, LEAF_IDS, NODE_CHILDREN, NODE_FLOATS, WIDTH

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class CollapseScratch:
    """Working memory for all trees; a tree of references [f, f + m) uses rows from 2 f, or f, on."""

    slots: wp.array[int]
    """shape [2 n], binary slot of each node, numbered in preorder without gaps."""
    right: wp.array[int]
    """shape [2 n], number of each inner node's right child; the left one is the next number."""
    costs: wp.array2d[float]
    """shape [2 n, 8], least cost of a subtree shown to its parent as at most k children, in column k - 1."""
    shares: wp.array2d[wp.int8]
    """shape [2 n, 8], how many of the k children in column k - 1 come from the left; 0: k - 1 children do as well."""
    pending: wp.array[int]
    """shape [n], stack of walks through the tree."""
    sources: wp.array[int]
    """shape [n], number of the binary node that each wide node stands for."""
    levels: wp.array[int]
    """shape [n], depth of each wide node."""
    entries: wp.array[int]
    """shape [n], stack entries that can be pending when a traversal reaches a wide node."""


@wp.func
def number_nodes(nodes: wp.array[BinaryNode], base: int, scratch: CollapseScratch) -> int:
    """Number the nodes of the tree at slot ``2 base`` in preorder without gaps, and return how many there are."""
    row = 2 * base
    count = int(0)
    slot = int(row)
    top = int(0)
    while slot >= 0:
        scratch.slots[row + count] = slot
        if nodes[slot].count == 0:
            scratch.pending[base + top] = count
            top += 1
            slot += 1
        elif top > 0:
            top -= 1
            parent = scratch.pending[base + top]
            scratch.right[row + parent] = count + 1
            slot = nodes[scratch.slots[row + parent]].first
        else:
            slot = -1
        count += 1
    return count


@wp.func
def evaluate_costs(nodes: wp.array[BinaryNode], base: int, count: int, scratch: CollapseScratch):
    """Fill ``costs`` and ``shares``, children before parents."""
    row = 2 * base
    for step in range(count):
        x = count - 1 - step
        node = nodes[scratch.slots[row + x]]
        area = box_half_area(node.low, node.high)
        if node.count > 0:
            for k in range(WIDTH):
                scratch.costs[row + x, k] = area
                scratch.shares[row + x, k] = wp.int8(0)
        else:
            left = row + x + 1
            right = row + scratch.right[row + x]
            # As a wide node of its own: the best way to share eight lanes.
            best = float(wp.inf)
            share = int(1)
            for k in range(1, WIDTH):
                cost = scratch.costs[left, k - 1] + scratch.costs[right, WIDTH - k - 1]
                if cost < best:
                    best = cost
                    share = int(k)
            scratch.shares[row + x, WIDTH - 1] = wp.int8(share)
            best += area
            scratch.costs[row + x, 0] = best
            scratch.shares[row + x, 0] = wp.int8(0)
            # Dissolved into its parent, as j + 1 of its children.
            for j in range(1, WIDTH - 1):
                share = int(0)
                for k in range(1, j + 1):
                    cost = scratch.costs[left, k - 1] + scratch.costs[right, j - k]
                    if cost < best:
                        best = cost
                        share = int(k)
                scratch.costs[row + x, j] = best
                scratch.shares[row + x, j] = wp.int8(share)


@wp.func
def gather_children(
    nodes: wp.array[BinaryNode], base: int, x: int, scratch: CollapseScratch, work: wp.array[int], found: wp.array[int]
) -> int:
    """Write the numbers of the binary nodes that become children of the wide node for x, left to right.

    Returns how many there are.
    """
    row = 2 * base
    share = int(scratch.shares[row + x, WIDTH - 1])
    work[0] = scratch.right[row + x]
    work[1] = WIDTH - share
    work[2] = x + 1
    work[3] = share
    top = int(2)
    count = int(0)
    while top > 0:
        top -= 1
        y = work[2 * top]
        lanes = work[2 * top + 1]
        while lanes > 1 and int(scratch.shares[row + y, lanes - 1]) == 0:
            lanes -= 1
        if lanes > 1:
            share = int(scratch.shares[row + y, lanes - 1])
            work[2 * top] = scratch.right[row + y]
            work[2 * top + 1] = lanes - share
            work[2 * top + 2] = y + 1
            work[2 * top + 3] = share
            top += 2
        else:
            found[count] = y
            count += 1
    return count


@wp.kernel
def collapse_trees(
    nodes: wp.array[BinaryNode],
    tree_first: wp.array[int],
    scratch: CollapseScratch,
    first: int,
    child_codes_out: wp.array2d[int],
    child_slots_out: wp.array2d[int],
    leaf_slots_out: wp.array[int],
    summaries_out: wp.array[TreeSummary],
):
    """Choose the wide nodes of tree ``first`` + thread, whose references begin at ``tree_first``.

    Its wide nodes and leaves are numbered from 0 and written to the rows from ``tree_first`` on: for each lane the
    child's code within the tree and its binary slot, -1 in empty lanes; for each leaf its binary slot.
    """
    tree = first + wp.tid()
    base = tree_first[tree]
    row = 2 * base
    work = wp.zeros(shape=(wp.static(2 * WIDTH),), dtype=int)
    found = wp.zeros(shape=(WIDTH,), dtype=int)
    summary = TreeSummary()
    evaluate_costs(nodes, base, number_nodes(nodes, base, scratch), scratch)
    summary.cost = scratch.costs[row, 0]
    top = int(0)
    if nodes[row].count > 0:
        leaf_slots_out[base] = row
        summary.leaf_count = 1
    else:
        scratch.sources[base] = 0
        scratch.levels[base] = 1
        scratch.entries[base] = 0
        scratch.pending[base] = 0
        summary.node_count = 1
        top += 1
    while top > 0:
        top -= 1
        wide = scratch.pending[base + top]
        level = scratch.levels[base + wide]
        count = gather_children(nodes, base, scratch.sources[base + wide], scratch, work, found)
        # A traversal goes on into one child and leaves the others on its stack.
        entries = scratch.entries[base + wide] + count - 1
        summary.depth = wp.max(summary.depth, level)
        summary.stack_size = wp.max(summary.stack_size, entries)
        for lane in range(WIDTH):
            code = int(0)
            slot = int(-1)
            if lane < count:
                slot = scratch.slots[row + found[lane]]
                if nodes[slot].count > 0:
                    leaf_slots_out[base + summary.leaf_count] = slot
                    summary.leaf_count += 1
                    code = -summary.leaf_count
                else:
                    child = summary.node_count
                    summary.node_count += 1
                    scratch.sources[base + child] = found[lane]
                    scratch.levels[base + child] = level + 1
                    scratch.entries[base + child] = entries
                    scratch.pending[base + top] = child
                    top += 1
                    code = child
            child_codes_out[base + wide, lane] = code
            child_slots_out[base + wide, lane] = slot
    summaries_out[tree] = summary


@wp.kernel
def pack_nodes(
    nodes: wp.array[BinaryNode],
    child_codes: wp.array2d[int],
    child_slots: wp.array2d[int],
    tree_first: wp.array[int],
    tree_node: wp.array[int],
    tree_leaf: wp.array[int],
    node_offset: int,
    chunk_tree: wp.array[int],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    first: int,
    wide_nodes_out: wp.array[float],
):
    """Write one chunk of a tree's wide nodes.

    ``tree_node`` and ``tree_leaf`` say where the tree's own begin, and ``node_offset`` how many nodes lie before the
    whole array.
    """
    chunk = first + wp.tid()
    tree = chunk_tree[chunk]
    for wide in range(chunk_first[chunk], chunk_first[chunk] + chunk_count[chunk]):
        source = tree_first[tree] + wide
        word = (tree_node[tree] + wide) * NODE_FLOATS
        for lane in range(WIDTH):
            low = wp.vec3(wp.inf)
            high = wp.vec3(-wp.inf)
            code = int(0)
            slot = child_slots[source, lane]
            if slot >= 0:
                low = nodes[slot].low
                high = nodes[slot].high
                code = child_codes[source, lane]
                if code >= 0:
                    code += node_offset + tree_node[tree]
                else:
                    code -= tree_leaf[tree]
            for axis in range(3):
                wide_nodes_out[word + 8 * axis + lane] = low[axis]
                wide_nodes_out[word + 24 + 8 * axis + lane] = high[axis]
            wide_nodes_out[word + NODE_CHILDREN + lane] = wp.cast(code, wp.float32)
            wide_nodes_out[word + NODE_CHILDREN + WIDTH + lane] = 0.0


@wp.kernel
def pack_triangles(
    nodes: wp.array[BinaryNode],
    references: wp.array[Reference],
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
    for leaf in range(chunk_first[chunk], chunk_first[chunk] + chunk_count[chunk]):
        node = nodes[leaf_slots[tree_first[tree] + leaf]]
        word = (tree_leaf[tree] + leaf) * LEAF_FLOATS
        for lane in range(WIDTH):
            index = int(-1)
            if lane < node.count:
                triangle = wp.cast(references[node.first + lane].low[3], wp.int32)
                index = triangle - tree_first[tree]
                for corner in range(3):
                    p = points[triangles[3 * triangle + corner]]
                    for axis in range(3):
                        leaves_out[word + 24 * corner + 8 * axis + lane] = p[axis]
            else:
                for row in range(9):
                    leaves_out[word + 8 * row + lane] = wp.nan
            leaves_out[word + LEAF_IDS + lane] = wp.cast(index, wp.float32)


@wp.kernel
def list_leaf_primitives(
    nodes: wp.array[BinaryNode], references: wp.array[Reference], leaf_slots: wp.array[int], ids_out: wp.array[int]
):
    """Write the primitive of each leaf of a tree whose leaves hold one."""
    leaf = wp.tid()
    ids_out[leaf] = wp.cast(references[nodes[leaf_slots[leaf]].first].low[3], wp.int32)
