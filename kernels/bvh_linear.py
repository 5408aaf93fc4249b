# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The linear builder (LBVH): references in the order of their Morton codes, split where the codes say, level by level.

Downwards each thread splits one run of references of the level; upwards each writes one node, whose children an earlier
launch has written. So no thread waits for another one, and there is neither an atomic nor a fence.

Reference: Lauterbach et al. (2009), Fast BVH Construction on GPUs, Eurographics, section 4. Differs by leaves that hold
as many references as a packet. Karras (2012), Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d
Trees, HPG, writes all levels at once; but then boxes are found by whoever comes last, which takes atomics and fences.
"""

import warp as wp

from .bvh_collapse import evaluate_costs
from .bvh_references import xyz
from .bvh_structs import BinaryNode, BinaryTrees, BuildRange, Reference
from .constants import MIN_EXTENT, MORTON_BITS
from .morton import morton_code

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class Run:
    """Successive references that become a node."""

    first: int
    count: int
    middle: int
    """First reference of the right half; of a leaf -1."""
    child: int
    """Row, in the level below, of the left half; the right one follows it."""


@wp.kernel
def encode_references(
    references: wp.array[Reference],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    chunk_tree: wp.array[int],
    ranges: wp.array[BuildRange],
    tree_bits: int,
    first: int,
    codes_out: wp.array[wp.uint64],
    order_out: wp.array[int],
):
    """Write, of a chunk of references, the tree's number above the Morton code of the centroid, and the row.

    The codes are those within a cube at the lower corner of the tree's centroid box: were cells as flat as the box,
    what is strewn over a plane would be cut through its height as often as sideways. The tree's number has
    ``tree_bits`` bits, for which the code's lowest ones make room, so that one sort does for all trees.
    """
    chunk = first + wp.tid()
    tree = chunk_tree[chunk]
    low = ranges[tree].centroid_low
    extent = ranges[tree].centroid_high - low
    side = wp.max(extent[0], wp.max(extent[1], extent[2]))
    scale = float(0.0)
    if side > MIN_EXTENT:
        scale = 1.0 / side
    shift = wp.uint64(3 * MORTON_BITS - tree_bits)
    for i in range(chunk_first[chunk], chunk_first[chunk] + chunk_count[chunk]):
        place = (xyz(references[i].low) + xyz(references[i].high) - xyz(low)) * scale
        codes_out[i] = (wp.uint64(tree) << shift) | (morton_code(place) >> wp.uint64(tree_bits))
        order_out[i] = i


@wp.kernel
def gather_references(
    references: wp.array[Reference], order: wp.array[int], first: int, references_out: wp.array[Reference]
):
    """Write the reference that comes at a place of an order."""
    i = first + wp.tid()
    references_out[i] = references[order[i]]


@wp.func
def split_morton(codes: wp.array[wp.uint64], first: int, count: int) -> int:
    """Return where the highest bit that differs within a run of sorted codes changes; the middle where none does."""
    low = int(first)
    high = int(first + count - 1)
    difference = codes[low] ^ codes[high]
    if difference == wp.uint64(0):
        return first + count // 2
    for shift in range(6):
        difference = difference | (difference >> wp.uint64(1 << shift))
    bit = difference ^ (difference >> wp.uint64(1))
    # The bit is clear at low and set at high; keep it so until they are neighbours.
    while high - low > 1:
        middle = (low + high) // 2
        if (codes[middle] & bit) == wp.uint64(0):
            low = int(middle)
        else:
            high = int(middle)
    return high


@wp.kernel
def start_runs(firsts: wp.array[int], counts: wp.array[int], first: int, level_out: wp.array[Run]):
    """Write the topmost level: all references of each tree."""
    tree = first + wp.tid()
    level_out[tree].first = firsts[tree]
    level_out[tree].count = counts[tree]


@wp.kernel
def split_runs(
    codes: wp.array[wp.uint64], leaf_size: int, first: int, level: wp.array[Run], inner_counts_out: wp.array[int]
):
    """Find where a run of a level is split, and write whether it is: runs of ``leaf_size`` and less are leaves."""
    i = first + wp.tid()
    if level[i].count <= leaf_size:
        level[i].middle = -1
        inner_counts_out[i] = 0
    else:
        level[i].middle = split_morton(codes, level[i].first, level[i].count)
        inner_counts_out[i] = 1


@wp.kernel
def list_halves(inner_ends: wp.array[int], first: int, level: wp.array[Run], below_out: wp.array[Run]):
    """Write the halves of a run that is split; ``inner_ends`` are the running sums of the counts of ``split_runs``."""
    i = first + wp.tid()
    if level[i].middle >= 0:
        row = 2 * (inner_ends[i] - 1)
        level[i].child = row
        below_out[row].first = level[i].first
        below_out[row].count = level[i].middle - level[i].first
        below_out[row + 1].first = level[i].middle
        below_out[row + 1].count = level[i].count - below_out[row].count


@wp.kernel
def write_runs(
    references: wp.array[Reference],
    level: wp.array[Run],
    slot: int,
    slot_below: int,
    first: int,
    trees: BinaryTrees,
):
    """Write the node of a run, its best wide nodes, and, of a leaf, its primitives.

    Slots of a level begin at ``slot``; the level below, whose slots begin at ``slot_below``, is done.
    """
    i = first + wp.tid()
    node = BinaryNode()
    if level[i].middle < 0:
        node.low = wp.vec3(wp.inf)
        node.high = wp.vec3(-wp.inf)
        node.left = level[i].first
        node.right = -level[i].count
        for at in range(level[i].first, level[i].first + level[i].count):
            node.low = wp.min(node.low, xyz(references[at].low))
            node.high = wp.max(node.high, xyz(references[at].high))
            trees.ids[at] = wp.cast(references[at].low[3], wp.int32)
    else:
        node.left = slot_below + level[i].child
        node.right = node.left + 1
        node.low = wp.min(trees.nodes[node.left].low, trees.nodes[node.right].low)
        node.high = wp.max(trees.nodes[node.left].high, trees.nodes[node.right].high)
    trees.nodes[slot + i] = node
    evaluate_costs(trees, slot + i)
