# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lecture's own hierarchy: two children a node, one triangle a leaf, boxes or spheres around them; tests counted.

``intersect(node, ray, hits)`` of the lecture, with a stack instead of recursion. The renderer's own trees come out of
the same builders, but have eight children a node and eight triangles a leaf.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_rt.bvh.forest import build_binary_trees, refer_to_triangles
from warp_rt.device.jobs import Executor, as_warp
from warp_rt.device.workers import Workers
from warp_rt.kernels.bounds import intersect_box, inverse_direction
from warp_rt.kernels.bvh_structs import BinaryTrees
from warp_rt.kernels.intersect_sphere import is_sphere_met
from warp_rt.kernels.ray_triangle import intersect_plane_projection

from .meshes import TriangleMesh
from .ray_sets import Rays

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

STACK = wp.constant(256)  # levels; the trees of the torus have less than fifty


@wp.struct
class LectureTree:
    """What the traversal reads. The left child of a node comes right after it."""

    low: wp.array[wp.vec3]
    high: wp.array[wp.vec3]
    center: wp.array[wp.vec3]
    radius: wp.array[float]
    right: wp.array[int]
    """Slot of the right child; -1: a leaf."""
    triangle: wp.array[int]
    """Of a leaf."""
    corners: wp.array[wp.vec3]
    """Three a triangle."""


@wp.kernel
def copy_nodes(
    trees: BinaryTrees,
    root: int,
    low_out: wp.array[wp.vec3],
    high_out: wp.array[wp.vec3],
    right_out: wp.array[int],
    triangle_out: wp.array[int],
    leaves_out: wp.array[int],
    first_leaf_out: wp.array[int],
):
    """Copy a tree in the order in which the lecture's recursion comes by, and list its triangles in that order."""
    slots = wp.zeros(shape=(STACK,), dtype=int)
    parents = wp.zeros(shape=(STACK,), dtype=int)
    slots[0] = root
    parents[0] = -1
    top = int(1)
    node_count = int(0)
    leaf_count = int(0)
    while top > 0:
        top -= 1
        node = trees.nodes[slots[top]]
        if parents[top] >= 0:
            right_out[parents[top]] = node_count
        low_out[node_count] = node.low
        high_out[node_count] = node.high
        first_leaf_out[node_count] = leaf_count
        if node.right < 0:
            right_out[node_count] = -1
            triangle_out[node_count] = trees.ids[node.left]
            leaves_out[leaf_count] = trees.ids[node.left]
            leaf_count += 1
        else:
            slots[top] = node.right
            parents[top] = node_count
            slots[top + 1] = node.left
            parents[top + 1] = -1
            top += 2
        node_count += 1


@wp.kernel
def enclose_spheres(
    tree: LectureTree,
    leaves: wp.array[int],
    first_leaf: wp.array[int],
    leaf_counts: wp.array[int],
    center_out: wp.array[wp.vec3],
    radius_out: wp.array[float],
):
    """Put about each node the sphere that stands about the middle of its box and reaches the farthest vertex."""
    for step in range(tree.right.shape[0]):
        node = tree.right.shape[0] - 1 - step  # children before their parents
        leaf_counts[node] = 1
        if tree.right[node] >= 0:
            leaf_counts[node] = leaf_counts[node + 1] + leaf_counts[tree.right[node]]
        center = 0.5 * (tree.low[node] + tree.high[node])
        square = float(0.0)
        for i in range(first_leaf[node], first_leaf[node] + leaf_counts[node]):
            for k in range(3):
                square = wp.max(square, wp.length_sq(tree.corners[3 * leaves[i] + k] - center))
        center_out[node] = center
        radius_out[node] = 1.000001 * wp.sqrt(square)  # rounding must not leave a vertex outside


@wp.kernel
def trace_tree(
    tree: LectureTree,
    is_sphere: bool,
    is_nearer_first: bool,
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_out: wp.array[float],
    volume_tests_out: wp.array[int],
    triangle_tests_out: wp.array[int],
):
    """Write the closest hit of each ray, and how many volumes and triangles it was tested against."""
    ray = wp.tid()
    origin = origins[ray]
    direction = directions[ray]
    inverse = inverse_direction(direction)
    stack = wp.zeros(shape=(STACK,), dtype=int)
    top = int(1)
    t_best = float(wp.inf)
    volume_tests = int(0)
    triangle_tests = int(0)
    while top > 0:
        top -= 1
        node = stack[top]
        volume_tests += 1
        is_met = bool(False)
        if is_sphere:
            is_met = is_sphere_met(origin, direction, t_best, tree.center[node], tree.radius[node])
        else:
            t = intersect_box(origin, inverse, t_best, tree.low[node], tree.high[node])
            is_met = t[0] <= t[1]
        if is_met:
            right = tree.right[node]
            if right < 0:
                triangle_tests += 1
                corner = 3 * tree.triangle[node]
                hit = intersect_plane_projection(
                    origin, direction, tree.corners[corner], tree.corners[corner + 1], tree.corners[corner + 2]
                )
                t_best = wp.min(t_best, hit.t)
            else:
                later = int(right)
                sooner = int(node + 1)
                if is_nearer_first and wp.dot(tree.center[sooner] - tree.center[later], direction) > 0.0:
                    later = node + 1
                    sooner = int(right)
                stack[top] = later
                stack[top + 1] = sooner
                top += 2
    t_out[ray] = t_best
    volume_tests_out[ray] = volume_tests
    triangle_tests_out[ray] = triangle_tests


@wp.kernel
def trace_all(
    corners: wp.array[wp.vec3],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_out: wp.array[float],
):
    """Write the closest hit of each ray, tested against every triangle."""
    ray = wp.tid()
    t_best = float(wp.inf)
    for triangle in range(corners.shape[0] // 3):
        corner = 3 * triangle
        hit = intersect_plane_projection(
            origins[ray], directions[ray], corners[corner], corners[corner + 1], corners[corner + 2]
        )
        t_best = wp.min(t_best, hit.t)
    t_out[ray] = t_best


@dataclass(frozen=True)
class Counts:
    """What the rays cost."""

    t: np.ndarray
    """float32, shape [n], inf for a miss."""
    volume_tests: np.ndarray
    """int32, shape [n]."""
    triangle_tests: np.ndarray
    """int32, shape [n]."""


def build_tree(mesh: TriangleMesh, builder: str) -> LectureTree:
    """Return the binary tree of one of warp_rt's builders, one triangle a leaf."""
    points, triangles = as_warp(mesh.points, wp.vec3), as_warp(mesh.triangles.reshape(-1), wp.int32)
    executor = Executor("cpu", Workers(None))
    references = refer_to_triangles(points, triangles, np.array([len(mesh.triangles)], np.int32), executor)
    trees, roots = build_binary_trees(references, leaf_size=1, builder=builder, executor=executor)
    count = len(mesh.triangles)
    tree = LectureTree()
    tree.corners = corners_of(mesh)
    tree.low, tree.high, tree.center = (wp.empty(2 * count - 1, dtype=wp.vec3, device="cpu") for _ in range(3))
    tree.radius = wp.empty(2 * count - 1, dtype=float, device="cpu")
    tree.right, tree.triangle, first_leaf, leaf_counts = (
        wp.empty(2 * count - 1, dtype=int, device="cpu") for _ in range(4)
    )
    leaves = wp.empty(count, dtype=int, device="cpu")
    outputs = [tree.low, tree.high, tree.right, tree.triangle, leaves, first_leaf]
    wp.launch(copy_nodes, 1, inputs=[trees, int(roots.numpy()[0])], outputs=outputs, device="cpu")
    inputs = [tree, leaves, first_leaf, leaf_counts]
    wp.launch(enclose_spheres, 1, inputs=inputs, outputs=[tree.center, tree.radius], device="cpu")
    return tree


def corners_of(mesh: TriangleMesh) -> wp.array:
    """Return the three corners of each triangle, one after the other."""
    return as_warp(np.ascontiguousarray(mesh.points[mesh.triangles]).reshape(-1, 3), wp.vec3)


def trace(tree: LectureTree, rays: Rays, volume: str, is_nearer_first: bool = False) -> Counts:
    """Return the closest hits through a tree of ``box`` or ``sphere`` volumes; one thread."""
    outputs = [wp.empty(len(rays), dtype=dtype, device="cpu") for dtype in (float, int, int)]
    inputs = [tree, volume == "sphere", is_nearer_first, *vectors(rays)]
    wp.launch(trace_tree, len(rays), inputs=inputs, outputs=outputs, device="cpu")
    return Counts(*(array.numpy() for array in outputs))


def trace_brute_force(corners: wp.array, rays: Rays) -> np.ndarray:
    """Return the closest hits of rays tested against all triangles: float32, shape [n]; one thread."""
    t = wp.empty(len(rays), dtype=float, device="cpu")
    wp.launch(trace_all, len(rays), inputs=[corners, *vectors(rays)], outputs=[t], device="cpu")
    return t.numpy()


def vectors(rays: Rays) -> list[wp.array]:
    """Return origins and directions as Warp takes them."""
    return [as_warp(rays.origins, wp.vec3), as_warp(rays.directions, wp.vec3)]
