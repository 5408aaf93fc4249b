# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lower level of the hierarchy, one tree a mesh: built, or refitted to points that have moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_rt.bvh.collapse import Layout
from warp_rt.bvh.forest import build_forest, pack_triangles, refer_to_triangles
from warp_rt.device.jobs import Executor
from warp_rt.kernels import bvh_refit
from warp_rt.kernels.bvh_structs import Box
from warp_rt.kernels.constants import LEAF_FLOATS, NODE_FLOATS, WIDTH
from warp_rt.scene import Mesh, Scene
from warp_rt.scene.placement import Placement, relative_points


@dataclass(frozen=True)
class MeshTrees:
    """Trees over the triangles of those meshes that have any."""

    meshes: np.ndarray
    """int, shape [tree_count], row of ``Scene.meshes``."""
    layout: Layout
    boxes: wp.array
    """``Box``, shape [tree_count], local space."""
    costs: wp.array
    """float32, shape [tree_count], half area of all nodes and leaves."""
    nodes: wp.array
    """float32, shape [node_count * NODE_FLOATS]."""
    leaves: wp.array
    """float32, shape [leaf_count * LEAF_FLOATS]."""


def build_mesh_trees(scene: Scene, placement: Placement, builder: str, executor: Executor) -> MeshTrees:
    """Return the trees of a scene, which has at least one triangle."""
    meshes, counts = _meshes_of(scene)
    points, triangles = _concatenate(scene, placement, meshes, counts, executor)
    references = refer_to_triangles(points, triangles, counts, executor)
    forest = build_forest(references, leaf_size=int(WIDTH), builder=builder, executor=executor)
    del references  # a third of the memory that building takes
    leaves = pack_triangles(forest, points, triangles, _first_triangles(counts, executor), executor)
    return MeshTrees(meshes, forest.layout, forest.boxes, forest.costs, forest.nodes, leaves)


def refit_mesh_trees(
    layout: Layout, nodes: wp.array, leaves: wp.array, scene: Scene, placement: Placement, executor: Executor
) -> MeshTrees:
    """Return the trees of a scene whose meshes have the triangles that other trees were built over.

    Args:
        layout: Of those trees.
        nodes: Theirs, which others may follow; they are left as they are.
        leaves: Theirs.
        scene: With the same triangles in the same meshes, at least one.
        placement: Of that scene.
        executor: Where those trees are.
    """
    meshes, counts = _meshes_of(scene)
    points, triangles = _concatenate(scene, placement, meshes, counts, executor)
    leaf_count, node_count = layout.leaf_count, int(layout.node_counts.sum())
    leaf_boxes, node_boxes = executor.empty(leaf_count, Box), executor.empty(node_count, Box)
    node_costs = executor.empty(node_count, wp.float32)
    new_leaves = executor.empty(leaf_count * LEAF_FLOATS, wp.float32)
    new_nodes = executor.empty(node_count * NODE_FLOATS, wp.float32)
    inputs = [leaves.view(wp.int32), points, triangles, layout.leaf_trees, _first_triangles(counts, executor)]
    executor.launch(bvh_refit.refit_leaves, leaf_count, inputs, [new_leaves, leaf_boxes], weight=int(WIDTH))
    for numbers in reversed(layout.levels):
        outputs = [node_boxes, node_costs, new_nodes]
        inputs = [numbers, nodes, leaf_boxes]
        executor.launch(bvh_refit.refit_nodes, numbers.shape[0], inputs, outputs, weight=int(WIDTH))
    boxes, costs = executor.empty(len(counts), Box), executor.empty(len(counts), wp.float32)
    inputs = [executor.upload(layout.roots, wp.int32), node_boxes, node_costs, leaf_boxes]
    executor.launch(bvh_refit.summarize_roots, len(counts), inputs, [boxes, costs])
    return MeshTrees(meshes, layout, boxes, costs, new_nodes, new_leaves)


def has_same_triangles(scene: Scene, other: Scene) -> bool:
    """Return whether two scenes have the same triangles in the same meshes, and as many points."""
    if len(scene.meshes) != len(other.meshes):
        return False
    for a, b in zip(scene.meshes, other.meshes, strict=True):
        if isinstance(a, Mesh) and isinstance(b, Mesh):
            if len(a.points) != len(b.points):
                return False
            if a.triangles is not b.triangles and not np.array_equal(a.triangles, b.triangles):
                return False
        elif isinstance(a, Mesh) or isinstance(b, Mesh):
            return False
    return True


def _meshes_of(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of the meshes that have triangles, and how many."""
    counts = np.array([len(one.triangles) if isinstance(one, Mesh) else 0 for one in scene.meshes], np.int32)
    rows = np.flatnonzero(counts)
    return rows, counts[rows]


def _first_triangles(counts: np.ndarray, executor: Executor) -> wp.array:
    """Return the first triangle of each tree: int32, shape [tree_count]."""
    return executor.upload((np.cumsum(counts) - counts).astype(np.int32), wp.int32)


def _concatenate(
    scene: Scene, placement: Placement, rows: np.ndarray, counts: np.ndarray, executor: Executor
) -> tuple[wp.array, wp.array]:
    """Return all meshes' points, relative to their origins, and all their triangles, rows of those points."""
    meshes = [mesh for mesh in (scene.meshes[row] for row in rows) if isinstance(mesh, Mesh)]
    origins = placement.mesh_origins[rows]
    points = [relative_points(mesh.points, origin) for mesh, origin in zip(meshes, origins, strict=True)]
    if len(meshes) == 1:
        triangles = np.ascontiguousarray(meshes[0].triangles, np.int32)
        return executor.upload(points[0], wp.vec3), executor.upload(triangles.reshape(-1), wp.int32)
    sizes = np.array([len(p) for p in points])
    triangles = np.concatenate([mesh.triangles for mesh in meshes], dtype=np.int32)
    triangles += np.repeat((np.cumsum(sizes) - sizes).astype(np.int32), counts)[:, None]
    return executor.upload(np.concatenate(points), wp.vec3), executor.upload(triangles.reshape(-1), wp.int32)
