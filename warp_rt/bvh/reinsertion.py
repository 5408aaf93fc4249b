# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Drives the kernels that move subtrees of binary trees to better places."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.jobs import Executor, host_array, numpy_type
from warp_rt.kernels import bvh_reinsert
from warp_rt.kernels.bvh_reinsert import Links, Listing

# What the searches promise as part of the SAH cost, below which nothing is moved. A third of it comes true, for moves
# get in each other's way, and a seventh of that outlives the collapse: this stands for 1 % of the cost.
_PROMISE = 0.2
_SAMPLE = 512  # searches, or one node in _STRIDE where that is more, that tell what all of them promise
_STRIDE = 16
_WORTHWHILE = 0.02  # part of the area of inner nodes that a round has to save before another one pays
_ROUNDS = 4
_SEARCH_WEIGHT = 16  # a search for a better place looks at some twenty nodes
# What one launch does, some 10 ms in which no interrupt is heard:
_LISTED = 1 << 19  # nodes listed
_SEARCHED = 1 << 16  # searched for a better place
_SLICE = 1 << 13  # moved
_RENEWED = 1 << 14  # given new costs


def reinsert_subtrees(trees: Any, roots: wp.array, executor: Executor) -> None:
    """Lessen the cost of binary trees by moving subtrees, each to the best place that a bounded search finds.

    Trees stay as they are where a sample of the searches promises little, and get at most one level higher.

    Args:
        trees: ``BinaryTrees`` on the CPU, their costs known; they are changed.
        roots: int32, shape [tree_count], slots of the trees' roots; they are changed.
        executor: Of the CPU. Its threads do not change the result.
    """
    slot_count = trees.nodes.shape[0]
    # Most slots may be of no node: then this, like the nodes, stays virtual memory.
    slots = host_array(slot_count, np.int32)
    links = Links()
    links.parents = executor.empty(slot_count, wp.int32)
    links.is_stale = executor.empty(slot_count, wp.bool)
    links.heights = executor.empty(slot_count, wp.int32)
    links.height_limits = executor.empty(roots.shape[0], wp.int32)
    links.roots = roots
    listing = list_nodes(trees.nodes, links, slots, executor)
    slots = slots[: listing["count"]]
    cost = trees.costs.numpy()[roots.numpy(), 0].sum(dtype=np.float64)
    stride = min(max(len(slots) // _SAMPLE, 1), _STRIDE)
    promise = stride * _find_gains(trees, links, slots[::stride], executor).sum(dtype=np.float64)
    if not promise > _PROMISE * cost:  # nor where areas are beyond float32
        return
    for _ in range(_ROUNDS):
        gains = _find_gains(trees, links, slots, executor)
        if not _reinsert(trees, links, slots[gains > 0], executor) > _WORTHWHILE * listing["area"]:
            break
    tree = np.zeros(1, np.int32)
    while tree[0] < roots.shape[0]:
        inputs = [links, trees, _RENEWED]
        wp.launch(bvh_reinsert.renew_costs, 1, inputs=inputs, outputs=[executor.upload(tree, wp.int32)], device="cpu")


def list_nodes(nodes: wp.array, links: Links, slots: np.ndarray, executor: Executor) -> np.void:
    """Fill the links of binary trees, which have at least their roots, and the slots of their nodes, in preorder.

    Args:
        nodes: Binary trees.
        links: Theirs, filled in place.
        slots: int32, shape [slots], filled in place with the slots of nodes.
        executor: Runs the kernels.

    Returns:
        The ``Listing``: how many slots are filled, and the area of the inner nodes.
    """
    listing = np.zeros(1, numpy_type(Listing))
    listing["slot"] = -1
    outputs = [executor.upload(slots, wp.int32), executor.upload(listing, Listing)]
    while listing["tree"][0] < links.roots.shape[0]:
        wp.launch(bvh_reinsert.list_nodes, 1, inputs=[nodes, links, _LISTED], outputs=outputs, device="cpu")
    return listing[0]


def _find_gains(trees: Any, links: Any, slots: np.ndarray, executor: Executor) -> np.ndarray:
    """Return what a better place for each of some nodes saves: float32, shape [n], half areas."""
    gains = np.empty(len(slots), np.float32)
    for start in range(0, len(slots), _SEARCHED):
        some = slice(start, start + _SEARCHED)
        inputs = [trees.nodes, links, executor.upload(slots[some], wp.int32)]
        outputs = [executor.upload(gains[some], wp.float32)]
        executor.launch(bvh_reinsert.find_gains, len(slots[some]), inputs, outputs, weight=_SEARCH_WEIGHT)
    return gains


def _reinsert(trees: Any, links: Any, slots: np.ndarray, executor: Executor) -> float:
    """Move the subtrees of some nodes; return by how much half the area of all inner nodes becomes less."""
    total = 0.0
    saved = np.empty(1, np.float64)
    for start in range(0, len(slots), _SLICE):
        inputs = [executor.upload(slots[start : start + _SLICE], wp.int32), trees.nodes, links]
        wp.launch(bvh_reinsert.reinsert, 1, inputs=inputs, outputs=[executor.upload(saved, wp.float64)], device="cpu")
        total += saved[0]
    return total
