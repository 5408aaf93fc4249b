# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The clustering builder (PLOC): clusters in the order of Morton codes, joined round by round with their nearest ones.

A round finds the nearest cluster of each among its neighbours in the order, and joins those that are each other's. The
first rounds fill leaf packets, joining nothing that does not fit into one; the others build the tree over these. A node
is written by the thread that joins its children, which earlier launches have written: there is neither an atomic nor a
fence, and trees do not depend on the order of threads.

Reference: Meister and Bittner (2018), Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction,
IEEE Transactions on Visualization and Computer Graphics 24(3). Differs by the packets; by what counts as near; by ties;
and by rounds that join neighbours where few clusters are each other's nearest: a chain of ever smaller triangles, say,
would otherwise be joined from one end, a link a round.
"""

import warp as wp

from .bounds import box_half_area
from .bvh_collapse import evaluate_costs
from .bvh_references import xyz
from .bvh_structs import BinaryNode, BinaryTrees, Reference
from .constants import PACKET_REACH, PLOC_AREA_MAX, PLOC_NODE_WEIGHT, PLOC_RADIUS

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.struct
class Cluster:
    """Primitives that are in one subtree."""

    low: wp.vec3
    tree: int
    high: wp.vec3
    count: int
    """References."""
    head: int
    """While packets are filled, its first reference; then the slot of its node."""
    tail: int
    """While packets are filled, its last reference."""


@wp.kernel
def start_clusters(
    references: wp.array[Reference],
    chunk_first: wp.array[int],
    chunk_count: wp.array[int],
    chunk_tree: wp.array[int],
    first: int,
    clusters_out: wp.array[Cluster],
):
    """Write a cluster for each of a chunk of references."""
    chunk = first + wp.tid()
    for i in range(chunk_first[chunk], chunk_first[chunk] + chunk_count[chunk]):
        cluster = Cluster()
        cluster.low = xyz(references[i].low)
        cluster.high = xyz(references[i].high)
        cluster.tree = chunk_tree[chunk]
        cluster.count = 1
        cluster.head = i
        cluster.tail = i
        clusters_out[i] = cluster


@wp.func
def cluster_area(low: wp.vec3, high: wp.vec3) -> float:
    """Return half the area of a cluster's box, but never more than PLOC_AREA_MAX, nor NaN."""
    area = box_half_area(low, high)
    return area if area < PLOC_AREA_MAX else PLOC_AREA_MAX


@wp.kernel
def find_nearest(clusters: wp.array[Cluster], capacity: int, is_filling: bool, first: int, nearest_out: wp.array[int]):
    """Write the nearest cluster of a cluster, among PLOC_RADIUS on either side; -1: none can be joined with it.

    Joining can be done within a tree, to a number of references that fits ``capacity``, and, while packets are filled,
    where the box does not get out of proportion. How near two clusters are says what the surface area heuristic wins
    by joining them: of packets, both areas go and the joint one comes; of nodes, half of them does, for the collapse
    will dissolve about every other node.

    Of those that are as near it is the one whose number has the lowest bits in which it differs. All pairs are thus
    ordered strictly, so that the first of all is each other's nearest; and of equal ones all find a partner at once.
    """
    i = first + wp.tid()
    low = clusters[i].low
    high = clusters[i].high
    tree = clusters[i].tree
    room = capacity - clusters[i].count
    area = cluster_area(low, high)
    weight = 1.0 if is_filling else PLOC_NODE_WEIGHT
    nearest = int(-1)
    least = float(wp.inf)
    if room > 0:
        for j in range(wp.max(i - PLOC_RADIUS, 0), wp.min(i + PLOC_RADIUS + 1, clusters.shape[0])):
            if j != i and clusters[j].tree == tree and clusters[j].count <= room:
                joint = cluster_area(wp.min(low, clusters[j].low), wp.max(high, clusters[j].high))
                single = area + cluster_area(clusters[j].low, clusters[j].high)
                if not is_filling or joint <= PACKET_REACH * single or single == 0.0:
                    distance = joint - weight * single
                    if distance < least or (distance == least and (i ^ j) < (i ^ nearest)):
                        least = distance
                        nearest = j
    nearest_out[i] = nearest


@wp.func
def can_join(clusters: wp.array[Cluster], i: int, j: int, capacity: int) -> bool:
    """Return whether two clusters are of one tree and fit into one of ``capacity`` references."""
    return clusters[i].tree == clusters[j].tree and clusters[i].count + clusters[j].count <= capacity


@wp.kernel
def pair_neighbors(clusters: wp.array[Cluster], capacity: int, first: int, nearest_out: wp.array[int]):
    """Write the other one of two neighbours, where they can be joined: what ``find_nearest`` does, without a choice."""
    i = first + wp.tid()
    j = i ^ 1
    nearest_out[i] = -1
    if j < clusters.shape[0]:
        if can_join(clusters, i, j, capacity):
            nearest_out[i] = j


@wp.func
def are_nearest(nearest: wp.array[int], i: int, j: int) -> bool:
    """Return whether a cluster and its nearest one (-1: it has none) are each other's."""
    if j < 0:
        return False
    return nearest[j] == i


@wp.kernel
def mark_pairs(nearest: wp.array[int], first: int, marks_out: wp.array[wp.vec3i]):
    """Write of a cluster if it stays, if it is joined with a later one, and if it has a nearest one: 0 or 1 each."""
    i = first + wp.tid()
    j = nearest[i]
    mark = wp.vec3i(1, 0, 1 if j >= 0 else 0)
    if are_nearest(nearest, i, j):
        if i < j:
            mark[1] = 1
        else:
            mark[0] = 0
    marks_out[i] = mark


@wp.func
def join(clusters: wp.array[Cluster], i: int, j: int) -> Cluster:
    """Return the cluster of two, but for its node."""
    cluster = clusters[i]
    cluster.low = wp.min(cluster.low, clusters[j].low)
    cluster.high = wp.max(cluster.high, clusters[j].high)
    cluster.count = cluster.count + clusters[j].count
    cluster.tail = clusters[j].tail
    return cluster


@wp.kernel
def join_packets(
    clusters: wp.array[Cluster],
    nearest: wp.array[int],
    marks: wp.array[wp.vec3i],
    first: int,
    following: wp.array[int],
    clusters_out: wp.array[Cluster],
):
    """Write the clusters of the next round; the references of one are linked by ``following``.

    ``marks`` are the running sums of those of ``mark_pairs``.
    """
    i = first + wp.tid()
    j = nearest[i]
    if not are_nearest(nearest, i, j):
        clusters_out[marks[i][0] - 1] = clusters[i]
    elif i < j:
        clusters_out[marks[i][0] - 1] = join(clusters, i, j)
        following[clusters[i].tail] = clusters[j].head


@wp.kernel
def count_references(clusters: wp.array[Cluster], first: int, counts_out: wp.array[int]):
    """Write how many references a cluster has."""
    i = first + wp.tid()
    counts_out[i] = clusters[i].count


@wp.kernel
def write_packets(
    references: wp.array[Reference],
    following: wp.array[int],
    count_ends: wp.array[int],
    first: int,
    clusters: wp.array[Cluster],
    trees: BinaryTrees,
):
    """Write the leaf of a cluster at the slot of its number; ``count_ends`` are the running sums of their counts."""
    i = first + wp.tid()
    node = BinaryNode()
    node.low = clusters[i].low
    node.high = clusters[i].high
    node.left = count_ends[i] - clusters[i].count
    node.right = -clusters[i].count
    at = int(clusters[i].head)
    for k in range(clusters[i].count):
        trees.ids[node.left + k] = wp.cast(references[at].low[3], wp.int32)
        if k < clusters[i].count - 1:
            at = following[at]
    trees.nodes[i] = node
    evaluate_costs(trees, i)
    clusters[i].head = i


@wp.kernel
def join_nodes(
    clusters: wp.array[Cluster],
    nearest: wp.array[int],
    marks: wp.array[wp.vec3i],
    slot: int,
    first: int,
    trees: BinaryTrees,
    clusters_out: wp.array[Cluster],
):
    """Write the clusters of the next round, and the nodes of those that are new, from ``slot`` on.

    ``marks`` are the running sums of those of ``mark_pairs``.
    """
    i = first + wp.tid()
    j = nearest[i]
    if not are_nearest(nearest, i, j):
        clusters_out[marks[i][0] - 1] = clusters[i]
    elif i < j:
        at = slot + marks[i][1] - 1
        cluster = join(clusters, i, j)
        node = BinaryNode()
        node.low = cluster.low
        node.high = cluster.high
        node.left = clusters[i].head
        node.right = clusters[j].head
        trees.nodes[at] = node
        evaluate_costs(trees, at)
        cluster.head = at
        clusters_out[marks[i][0] - 1] = cluster


@wp.kernel
def write_roots(clusters: wp.array[Cluster], first: int, roots_out: wp.array[int]):
    """Write the slot of each tree's root, when there is one cluster a tree."""
    i = first + wp.tid()
    roots_out[clusters[i].tree] = clusters[i].head
