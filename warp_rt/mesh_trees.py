# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lower level of the hierarchy, one tree a mesh: built, or refitted to points that have moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_rt.collapse import Layout
from warp_rt.forest import build_forest, pack_triangles, refer_to_triangles
from warp_rt.jobs import as_warp, host_array, launch_jobs, split_chunks
from warp_rt.kernels import bvh_refit
from warp_rt.kernels.bvh_refit import Box
from warp_rt.kernels.constants import LEAF_FLOATS, NODE_FLOATS, WIDTH
from warp_rt.placement import Placement, relative_points
from warp_rt.scene import Mesh, Scene
from warp_rt.workers import Workers


@dataclass(frozen=True)
class MeshTrees:
    """Trees over the triangles of those meshes that have any."""

    meshes: np.ndarray
    """int, shape [tree_count], row of ``Scene.meshes``."""
    layout: Layout
    boxes: np.ndarray
    """float32, shape [tree_count, 2, 3], local space."""
    costs: np.ndarray
    """float32, shape [tree_count], half area of all nodes and leaves."""
    nodes: np.ndarray
    """float32, shape [node_count * NODE_FLOATS]."""
    leaves: np.ndarray
    """float32, shape [leaf_count * LEAF_FLOATS]."""


def build_mesh_trees(scene: Scene, placement: Placement, builder: str, workers: Workers) -> MeshTrees:
    """Return the trees of a scene, which has at least one triangle."""
    meshes, counts = _meshes_of(scene)
    points, triangles = _concatenate(scene, placement, meshes, counts)
    references = refer_to_triangles(points, triangles, counts, workers)
    boxes = np.stack([references.ranges["low"][:, :3], references.ranges["high"][:, :3]], axis=1)
    forest = build_forest(references, leaf_size=int(WIDTH), builder=builder, workers=workers)
    del references  # a third of the memory that building takes
    leaves = pack_triangles(forest, points, triangles, workers)
    return MeshTrees(meshes, forest.layout, boxes, forest.costs, forest.nodes, leaves)


def refit_mesh_trees(
    layout: Layout, nodes: np.ndarray, leaves: np.ndarray, scene: Scene, placement: Placement, workers: Workers
) -> MeshTrees:
    """Return the trees of a scene whose meshes have the triangles that other trees were built over.

    Args:
        layout: Of those trees.
        nodes: Theirs; they are left as they are.
        leaves: Theirs.
        scene: With the same triangles in the same meshes, at least one.
        placement: Of that scene.
        workers: Threads to use.
    """
    meshes, counts = _meshes_of(scene)
    points, triangles = _concatenate(scene, placement, meshes, counts)
    leaf_boxes = as_warp(host_array(layout.leaf_count, Box.numpy_dtype()), Box)
    new_leaves = host_array(layout.leaf_count * LEAF_FLOATS, np.float32)
    chunks = split_chunks(layout.leaf_counts)
    tree_leaf = as_warp(layout.tree_leaf, wp.int32)
    inputs = [
        as_warp(leaves.view(np.int32), wp.int32),
        points,
        triangles,
        as_warp((np.cumsum(counts) - counts).astype(np.int32), wp.int32),
        tree_leaf,
        as_warp(chunks.tree, wp.int32),
        as_warp(chunks.first, wp.int32),
        as_warp(chunks.count, wp.int32),
    ]
    outputs = [as_warp(new_leaves, wp.float32), leaf_boxes]
    launch_jobs(workers, bvh_refit.refit_leaves, chunks.count, inputs, outputs)

    node_count = int(layout.node_counts.sum())
    new_nodes = host_array(node_count * NODE_FLOATS, np.float32)
    boxes, costs = np.empty(len(counts), Box.numpy_dtype()), np.empty(len(counts), np.float32)
    inputs = [
        as_warp(nodes[: node_count * NODE_FLOATS], wp.float32),
        as_warp(layout.tree_node, wp.int32),
        as_warp(layout.node_counts, wp.int32),
        tree_leaf,
        leaf_boxes,
        as_warp(host_array(node_count, Box.numpy_dtype()), Box),
    ]
    outputs = [as_warp(new_nodes, wp.float32), as_warp(boxes, Box)]
    outputs.append(as_warp(costs, wp.float32))
    launch_jobs(workers, bvh_refit.refit_nodes, layout.node_counts + 1, inputs, outputs)
    launch_jobs(workers, bvh_refit.order_nodes, np.full(node_count, 64), [], [as_warp(new_nodes, wp.float32)])
    corners = np.stack([boxes["low"], boxes["high"]], axis=1)
    return MeshTrees(meshes, layout, corners, costs, new_nodes, new_leaves)


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


def _concatenate(scene: Scene, placement: Placement, rows: np.ndarray, counts: np.ndarray) -> tuple[wp.array, wp.array]:
    """Return all meshes' points, relative to their origins, and all their triangles, rows of those points."""
    meshes = [mesh for mesh in (scene.meshes[row] for row in rows) if isinstance(mesh, Mesh)]
    origins = placement.mesh_origins[rows]
    points = [relative_points(mesh.points, origin) for mesh, origin in zip(meshes, origins, strict=True)]
    if len(meshes) == 1:
        triangles = np.ascontiguousarray(meshes[0].triangles, np.int32)
        return as_warp(points[0], wp.vec3), as_warp(triangles.reshape(-1), wp.int32)
    sizes = np.array([len(p) for p in points])
    triangles = np.concatenate([mesh.triangles for mesh in meshes], dtype=np.int32)
    triangles += np.repeat((np.cumsum(sizes) - sizes).astype(np.int32), counts)[:, None]
    return as_warp(np.concatenate(points), wp.vec3), as_warp(triangles.reshape(-1), wp.int32)
