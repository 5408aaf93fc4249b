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

_WORTHWHILE = 0.02  # part of the area that a round has to save before another one pays
_SEARCH_WEIGHT = 16  # a search for a better place looks at some twenty nodes


def reinsert_subtrees(trees: Any, roots: wp.array, executor: Executor) -> None:
    """Lessen the cost of binary trees by moving subtrees, each to the best place in its tree.

    Args:
        trees: ``BinaryTrees`` on the CPU, their costs known; they are changed.
        roots: int32, shape [tree_count], slots of the trees' roots; they are changed.
        executor: Of the CPU. Its threads do not change the result.
    """
    slot_count = trees.nodes.shape[0]
    # Most slots may be of no node: then this, like the nodes, stays virtual memory.
    slots, listing = host_array(slot_count, np.int32), np.empty(1, numpy_type(Listing))
    links = Links()
    links.parents = executor.empty(slot_count, wp.int32)
    links.is_stale = executor.empty(slot_count, wp.bool)
    links.roots = roots
    outputs = [executor.upload(slots, wp.int32), executor.upload(listing, Listing)]
    wp.launch(bvh_reinsert.list_nodes, 1, inputs=[trees.nodes, links], outputs=outputs, device="cpu")
    slots, area = slots[: listing["count"][0]], listing["area"][0]
    saved = np.full(1, np.inf)
    is_misplaced = np.empty(len(slots), np.bool_)
    while saved[0] > _WORTHWHILE * area:
        inputs = [trees.nodes, links, executor.upload(slots, wp.int32)]
        outputs = [executor.upload(is_misplaced, wp.bool)]
        executor.launch(bvh_reinsert.find_misplaced, len(slots), inputs, outputs, weight=_SEARCH_WEIGHT)
        inputs = [executor.upload(slots[is_misplaced], wp.int32), trees.nodes, links]
        outputs = [executor.upload(saved, wp.float64)]
        wp.launch(bvh_reinsert.reinsert, 1, inputs=inputs, outputs=outputs, device="cpu")
    wp.launch(bvh_reinsert.renew_costs, 1, inputs=[links, trees], device="cpu")
