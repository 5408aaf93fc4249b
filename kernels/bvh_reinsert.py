# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Reinsertion: subtrees of a finished binary tree are moved to where they make the least area of inner nodes.

A builder that splits from the top down decides before it knows what comes of it. Every node is asked where it would
better be, side by side; those that know a better place are then moved one after the other, each to the best place in
the tree as it is by then. So no two moves get in each other's way, and the result does not depend on the threads.

Reference: Bittner, Hapala and Havran (2013), Fast Insertion-Based Optimization of Bounding Volume Hierarchies, Computer
Graphics Forum 32(1); the search is that of Meister and Bittner (2018), Parallel Reinsertion for Bounding Volume
Hierarchy Optimization, Computer Graphics Forum 37(2), section 4. Differs by who is moved: theirs lock what a move
touches, drop the moves that meet a lock, and search again in the next round.
"""

import warp as wp

from .bounds import box_half_area
from .bvh_collapse import evaluate_costs
from .bvh_structs import BinaryNode, BinaryTrees
from .constants import REINSERTION_GAIN, REINSERTION_STACK, REINSERTION_VISITS

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class Links:
    """What reinsertion knows of binary trees besides their nodes."""

    parents: wp.array[int]
    """By slot: that of the parent; of a root, -1 minus the number of its tree."""
    roots: wp.array[int]
    """By tree: the slot of its root."""
    is_stale: wp.array[wp.bool]
    """By slot: whether the node's costs are of another subtree than it has now. So are then those of its ancestors."""
    heights: wp.array[int]
    """By slot: edges from the node down to the deepest leaf below it."""
    height_limits: wp.array[int]
    """By tree: the height that no move may exceed."""


@wp.func
def is_leaf(nodes: wp.array[BinaryNode], slot: int) -> bool:
    """Return whether a node is a leaf."""
    return nodes[slot].right < 0


@wp.func
def sibling_of(nodes: wp.array[BinaryNode], parent: int, slot: int) -> int:
    """Return the other child of a node's parent."""
    return nodes[parent].right if nodes[parent].left == slot else nodes[parent].left


@wp.func
def height_of(nodes: wp.array[BinaryNode], links: Links, slot: int) -> int:
    """Return the height of a node, those of its children being known."""
    if is_leaf(nodes, slot):
        return 0
    return 1 + wp.max(links.heights[nodes[slot].left], links.heights[nodes[slot].right])


@wp.struct
class Listing:
    """What has been found in binary trees, and how far they have been gone through."""

    count: int
    """Nodes."""
    area: wp.float64
    """Half the area of all inner nodes."""
    tree: int
    """The tree to go on with; the number of trees where all have been gone through."""
    slot: int
    """The node to go on with; -1: the root of that tree."""


@wp.kernel
def list_nodes(
    nodes: wp.array[BinaryNode],
    links: Links,
    most: int,
    slots_out: wp.array[int],
    listing_out: wp.array[Listing],
):
    """Write the slots of all nodes, each tree's in preorder, and what they add up to; fill ``links``. One thread.

    A tree may become one level higher than it is. Without a limit, boxes that lie within each other, which have least
    area as a chain, make a thousand levels of twenty.

    Args:
        nodes: Binary trees.
        links: Output.
        most: Nodes after which a launch ends, for the next one to go on.
        slots_out: Output, one a node.
        listing_out: Where earlier launches have come to, at first zeros and slot -1; shape [1].
    """
    listing = listing_out[0]
    last = listing.count + most
    while listing.tree < links.roots.shape[0] and listing.count < last:
        slot = int(listing.slot)
        if slot < 0:
            slot = links.roots[listing.tree]
            links.parents[slot] = -1 - listing.tree
        slots_out[listing.count] = slot
        listing.count += 1
        links.is_stale[slot] = False
        if is_leaf(nodes, slot):
            links.heights[slot] = 0
            # The subtree ends here: on to the right child of the last ancestor that was left by its left one.
            parent = int(links.parents[slot])
            while parent >= 0 and nodes[parent].right == slot:
                slot = parent
                links.heights[slot] = height_of(nodes, links, slot)
                parent = links.parents[slot]
            if parent >= 0:
                listing.slot = nodes[parent].right
            else:
                links.height_limits[listing.tree] = links.heights[slot] + 1
                listing.slot = -1
                listing.tree += 1
        else:
            listing.area += wp.float64(box_half_area(nodes[slot].low, nodes[slot].high))
            links.parents[nodes[slot].left] = slot
            links.parents[nodes[slot].right] = slot
            listing.slot = nodes[slot].left
    listing_out[0] = listing


@wp.func
def find_place(
    nodes: wp.array[BinaryNode], links: Links, slot: int, stack: wp.array[int], gains: wp.array[float]
) -> tuple[int, float, int]:
    """Return the node beside which a subtree makes the least area of inner nodes, half of what that saves, and visits.

    -1 and 0 where no node is better than its sibling.

    Its parent goes with it, to be the parent of both. The siblings of its ancestors are searched one after the other,
    upwards, and between them the ancestors tried themselves; what cannot gain more than the best place so far is left
    out. The gain at a node is the area of the parent that goes, plus what the ancestors up to the common one shrink by,
    minus what the nodes below that one grow by, minus the area of the new parent, at least that of the subtree itself.

    Where boxes lie within each other, that leaves out next to nothing: so the search ends with REINSERTION_VISITS nodes
    and ancestors looked at, the nearest first, and returns the best among these. Places are passed over where the tree
    would become higher than it may.

    Args:
        nodes: Binary trees.
        links: Theirs.
        slot: The root of the subtree.
        stack: Working memory, shape [2 REINSERTION_STACK]: nodes, and how deep each is.
        gains: Likewise, shape [REINSERTION_STACK].
    """
    parent = links.parents[slot]
    if parent < 0:
        return -1, 0.0, 0
    depth = int(0)  # of the ancestor whose other child is searched
    above = int(parent)
    while links.parents[above] >= 0:
        above = links.parents[above]
        depth += 1
    limit = links.height_limits[-1 - links.parents[above]] - 1
    height = links.heights[slot]
    low = nodes[slot].low
    high = nodes[slot].high
    area = box_half_area(low, high)
    sibling = sibling_of(nodes, parent, slot)
    best = float(0.0)
    place = int(-1)
    # The box of the ancestor that was searched last, without the subtree.
    left_low = nodes[sibling].low
    left_high = nodes[sibling].high
    above_area = float(box_half_area(nodes[parent].low, nodes[parent].high))
    saved = float(above_area)
    beside = int(sibling)
    above = parent
    visits = int(0)
    while above >= 0 and visits < REINSERTION_VISITS:
        visits += 1
        need = wp.max(best, REINSERTION_GAIN * above_area)
        stack[0] = beside
        stack[1] = depth + 1
        gains[0] = saved
        top = int(1)
        while top > 0 and visits < REINSERTION_VISITS:
            top -= 1
            if gains[top] - area > need:
                visits += 1
                at = stack[2 * top]
                at_depth = stack[2 * top + 1]
                before = gains[top]
                at_low = nodes[at].low
                at_high = nodes[at].high
                gain = before - box_half_area(wp.min(at_low, low), wp.max(at_high, high))
                if gain > need and at != sibling and at_depth + wp.max(height, links.heights[at]) <= limit:
                    need = gain
                    best = gain
                    place = at
                below = gain + box_half_area(at_low, at_high)
                if below - area > need and not is_leaf(nodes, at) and top + 2 <= REINSERTION_STACK:
                    stack[2 * top] = nodes[at].right
                    stack[2 * top + 1] = at_depth + 1
                    gains[top] = below
                    stack[2 * top + 2] = nodes[at].left
                    stack[2 * top + 3] = at_depth + 1
                    gains[top + 1] = below
                    top += 2
        if above != parent:
            left_low = wp.min(left_low, nodes[beside].low)
            left_high = wp.max(left_high, nodes[beside].high)
            # Beside this ancestor itself the new parent has the box that the ancestor has now.
            gain_here = saved - box_half_area(left_low, left_high)
            if gain_here > need and depth + wp.max(height, links.heights[above]) <= limit:
                best = gain_here
                place = above
            saved = gain_here + above_area
        child = int(above)
        above = links.parents[child]
        if above >= 0:
            beside = sibling_of(nodes, above, child)
            above_area = box_half_area(nodes[above].low, nodes[above].high)
            depth -= 1
    return place, best, visits


@wp.kernel
def find_gains(nodes: wp.array[BinaryNode], links: Links, slots: wp.array[int], first: int, gains_out: wp.array[float]):
    """Write half of what a better place for a node saves; 0 where there is none."""
    stack = wp.zeros(shape=(wp.static(2 * REINSERTION_STACK),), dtype=int)
    gains = wp.zeros(shape=(REINSERTION_STACK,), dtype=float)
    i = first + wp.tid()
    _place, gain, _visits = find_place(nodes, links, slots[i], stack, gains)
    gains_out[i] = gain


@wp.func
def put(nodes: wp.array[BinaryNode], links: Links, parent: int, old: int, new: int):
    """Make a node the child of a parent, or the root of a tree, in place of another one."""
    links.parents[new] = parent
    if parent < 0:
        links.roots[-1 - parent] = new
    elif nodes[parent].left == old:
        nodes[parent].left = new
    else:
        nodes[parent].right = new


@wp.func
def refit(nodes: wp.array[BinaryNode], links: Links, slot: int) -> bool:
    """Make a node's box and height anew, its costs being stale then; return whether box or height has changed."""
    low = wp.min(nodes[nodes[slot].left].low, nodes[nodes[slot].right].low)
    high = wp.max(nodes[nodes[slot].left].high, nodes[nodes[slot].right].high)
    height = height_of(nodes, links, slot)
    is_same = low == nodes[slot].low and high == nodes[slot].high and height == links.heights[slot]
    nodes[slot].low = low
    nodes[slot].high = high
    links.heights[slot] = height
    links.is_stale[slot] = True
    return not is_same


@wp.func
def refit_path(nodes: wp.array[BinaryNode], links: Links, slot: int):
    """Make boxes and heights anew from a node, or from no node, upwards as far as they change; all costs are stale."""
    at = int(slot)
    is_changing = bool(True)
    while at >= 0 and (is_changing or not links.is_stale[at]):
        if is_changing:
            is_changing = refit(nodes, links, at)
        else:
            links.is_stale[at] = True
        at = links.parents[at]


@wp.kernel
def reinsert(slots: wp.array[int], nodes: wp.array[BinaryNode], links: Links, saved_out: wp.array[wp.float64]):
    """Move subtrees, given by their roots, one after the other to the best place that there is; one thread.

    Writes by how much half the area of all inner nodes has become less.
    """
    saved = wp.float64(0.0)
    stack = wp.zeros(shape=(wp.static(2 * REINSERTION_STACK),), dtype=int)
    gains = wp.zeros(shape=(REINSERTION_STACK,), dtype=float)
    for i in range(slots.shape[0]):
        slot = slots[i]
        place, gain, _visits = find_place(nodes, links, slot, stack, gains)
        if place >= 0:
            saved += wp.float64(gain)
            parent = links.parents[slot]
            left_behind = links.parents[parent]
            put(nodes, links, left_behind, parent, sibling_of(nodes, parent, slot))
            put(nodes, links, links.parents[place], place, parent)
            nodes[parent].left = place
            nodes[parent].right = slot
            links.parents[place] = parent
            refit(nodes, links, parent)
            refit_path(nodes, links, left_behind)
            refit_path(nodes, links, links.parents[parent])
    saved_out[0] = saved


@wp.kernel
def renew_costs(links: Links, trees: BinaryTrees, most: int, tree_out: wp.array[int]):
    """Find the costs anew that are stale, children before their parents. One thread.

    Args:
        links: What tells which are stale.
        trees: Binary trees; output.
        most: Costs after which a launch ends, for the next one to go on.
        tree_out: The tree to go on with, at first 0; the number of trees where all is done; shape [1].
    """
    found = int(0)
    tree = int(tree_out[0])
    while tree < links.roots.shape[0] and found < most:
        slot = int(links.roots[tree] if links.is_stale[links.roots[tree]] else -1)
        while slot >= 0 and found < most:
            left = trees.nodes[slot].left  # leaves are never stale
            right = trees.nodes[slot].right
            if links.is_stale[left]:
                slot = left
            elif links.is_stale[right]:
                slot = right
            else:
                evaluate_costs(trees, slot)
                found += 1
                links.is_stale[slot] = False
                slot = links.parents[slot]
        if slot < 0:
            tree += 1
    tree_out[0] = tree
