# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lower level of a hierarchy: one tree a mesh, those over triangles and those over shapes behind each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_rt.bvh.collapse import Layout
from warp_rt.bvh.forest import builder_executor
from warp_rt.bvh.mesh_trees import MeshTrees
from warp_rt.bvh.shape_trees import build_shape_trees
from warp_rt.device.jobs import Executor
from warp_rt.kernels import constants
from warp_rt.scene import Scene, Shapes
from warp_rt.scene.placement import Placement


@dataclass(frozen=True)
class LowerTrees:
    """The lower level: trees over triangles, then those over shapes, one a row of the scene's meshes not empty.

    Warp arrays are on the hierarchy's device.
    """

    meshes: np.ndarray
    """int, shape [tree_count], row of ``Scene.meshes``."""
    kinds: np.ndarray
    """int16, shape [tree_count], TRIANGLES or a ``ShapeKind``."""
    boxes: wp.array
    """``Box``, shape [tree_count], local space."""
    roots: np.ndarray
    """int32, shape [tree_count], child codes."""
    depths: np.ndarray
    """int32, shape [tree_count], levels of wide nodes."""
    stack_sizes: np.ndarray
    """int32, shape [tree_count], entries that a traversal can leave on its stack at once, whatever the ray."""
    costs: wp.array
    """float32, shape [tree_count], half area of all nodes and leaves."""
    nodes: wp.array
    """float32: wide nodes."""
    leaf_count: int
    leaves: wp.array
    """float32: packets of triangles."""
    shapes: wp.array
    """float32: packets of shapes, then pieces of cubic tubes."""
    layout: Layout | None
    """Of the trees over triangles."""


def join_lower_trees(
    trees: MeshTrees | None, scene: Scene, placement: Placement, executor: Executor, builder: str
) -> LowerTrees:
    """Return the lower level: trees over meshes (None: there are none) and new ones over shapes."""
    rows = np.array([k for k, one in enumerate(scene.meshes) if isinstance(one, Shapes) and len(one.points)], int)
    sets = [one for one in (scene.meshes[row] for row in rows) if isinstance(one, Shapes)]
    nothing = executor.empty(0, wp.float32)
    layouts, meshes, kinds = [], [], []
    boxes, costs, nodes = [], [], []
    leaves = shapes = nothing
    if trees is not None:
        meshes.append(trees.meshes)
        kinds.append(np.zeros(len(trees.meshes), np.int16))
        layouts.append(trees.layout)
        boxes.append(trees.boxes)
        costs.append(trees.costs)
        nodes.append(trees.nodes)
        leaves = trees.leaves
    if sets:
        of_shapes = build_shape_trees(
            sets,
            placement.mesh_origins[rows],
            builder=builder,
            executor=builder_executor(builder, executor),
            node_offset=sum(part.shape[0] for part in nodes) // constants.NODE_FLOATS,
        )
        meshes.append(rows)
        kinds.append(np.array([one.kind for one in sets], np.int16))
        layouts.append(of_shapes.forest.layout)
        boxes.append(of_shapes.forest.boxes)
        costs.append(of_shapes.forest.costs)
        nodes.append(of_shapes.forest.nodes)
        shapes = of_shapes.packets
    return LowerTrees(
        meshes=np.concatenate(meshes),
        kinds=np.concatenate(kinds),
        boxes=join_arrays(boxes, executor),
        roots=np.concatenate([layout.roots for layout in layouts]),
        depths=np.concatenate([layout.depths for layout in layouts]),
        stack_sizes=np.concatenate([layout.stack_sizes for layout in layouts]),
        costs=join_arrays(costs, executor),
        nodes=join_arrays(nodes, executor),
        leaf_count=sum(layout.leaf_count for layout in layouts),
        leaves=executor.adopt(leaves),
        shapes=executor.adopt(shapes),
        layout=None if trees is None else trees.layout.move(executor),
    )


def join_arrays(arrays: list[wp.array], executor: Executor) -> wp.array:
    """Return arrays behind each other on an executor's device."""
    return executor.concatenate([executor.adopt(array) for array in arrays])
