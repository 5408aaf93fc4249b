# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The upper level of a hierarchy: one tree over the instances that are placed, and the records in its leaves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import warp as wp

from warp_rt.bvh.collapse import Layout
from warp_rt.bvh.forest import build_forest, builder_executor, cost_instances, rank_primitives, refer_to_instances
from warp_rt.bvh.lower_level import LowerTrees
from warp_rt.device.jobs import Executor
from warp_rt.errors import SceneError
from warp_rt.kernels import bvh_instances, constants
from warp_rt.kernels.bvh_structs import InstanceRecord
from warp_rt.scene.placement import Placement, blocks


class UpperTree(NamedTuple):
    """The upper level: a tree over instances, without what it was built from, which takes four times as much memory."""

    nodes: wp.array
    """float32: wide nodes."""
    leaves: wp.array
    """int32, shape [n], leaf of each instance."""
    layout: Layout
    cost: float
    """``BvhStatistics.sah_cost``, of both levels."""


def build_upper_tree(
    trees: LowerTrees,
    tree: wp.array,
    roots: wp.array,
    placement: Placement,
    placed: np.ndarray,
    executor: Executor,
    builder: str,
) -> UpperTree:
    """Return the tree over the instances that are placed; the arguments are those of ``refer_to_instances``."""
    references = refer_to_instances(tree, roots, trees.boxes, trees.nodes, placement, placed, executor)
    world = references.ranges.numpy()[0]
    low, high = world["low"][:3].astype(float), world["high"][:3].astype(float)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise SceneError("instances: a transform takes geometry beyond the range of float32")
    visits = cost_instances(references, tree, trees.boxes, trees.costs, executor)
    node_count = trees.nodes.shape[0] // constants.NODE_FLOATS
    building = builder_executor(builder, executor)
    moved = references.move(building)
    top = build_forest(moved, leaf_size=1, builder=builder, executor=building, node_offset=node_count)
    leaves = executor.adopt(rank_primitives(top, building))
    area = _half_area(low, high)
    cost = (float(top.costs.numpy()[0]) + visits) / area if area > 0 else 0.0
    return UpperTree(top.nodes, leaves, top.layout, cost)


def write_instances(
    leaf_of_instance: wp.array,
    trees: LowerTrees,
    tree: wp.array,
    roots: wp.array,
    placement: Placement,
    placed: np.ndarray,
    executor: Executor,
) -> wp.array:
    """Return the records of the instances in the order of the upper level's leaves.

    Args:
        leaf_of_instance: Place of each instance that is placed among the leaves, shape [placed].
        trees: Hierarchies of the meshes.
        tree: As for ``refer_to_instances``; so too ``roots`` and ``placement``.
        roots: Likewise.
        placement: Likewise.
        placed: Numbers of the instances that are placed, int, shape [placed].
        executor: Runs the kernels.
    """
    shared = [
        leaf_of_instance,
        executor.upload(placed, wp.int32),
        tree,
        roots,
        executor.upload(trees.kinds, wp.int16),
        executor.upload(trees.meshes.astype(np.int32), wp.int32),
    ]
    records = executor.empty(len(placed), InstanceRecord)

    def write(rows: slice) -> None:
        transforms = executor.upload(placement.local_from_world(placed[rows]).astype(np.float32), wp.float32)
        inputs = [transforms, rows.start, *shared, 0]
        kernel = bvh_instances.write_instances
        wp.launch(kernel, rows.stop - rows.start, inputs=inputs, outputs=[records], device=executor.device)

    executor.map(write, blocks(len(placed)))
    return records


def _half_area(low: np.ndarray, high: np.ndarray) -> float:
    x, y, z = high - low
    return float(x * y + y * z + z * x)
