# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scene -> Accel: the two-level bounding volume hierarchy, one tree a mesh and one over the instances."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import Any

import numpy as np
import warp as wp

from warp_rt.bvh.collapse import Layout
from warp_rt.bvh.forest import BUILDER_MODULES, builder_device, builder_executor
from warp_rt.bvh.lower_level import join_arrays, join_lower_trees
from warp_rt.bvh.mesh_trees import MeshTrees, build_mesh_trees, has_same_triangles, refit_mesh_trees
from warp_rt.bvh.upper_level import build_upper_tree, write_instances
from warp_rt.device.jobs import Executor
from warp_rt.device.kernel_binaries import load_module
from warp_rt.device.workers import Workers
from warp_rt.errors import OptionError, SceneError
from warp_rt.kernels import (
    bvh_collapse,
    bvh_instances,
    bvh_references,
    bvh_refit,
    constants,
    shape_pack,
)
from warp_rt.kernels.bvh_structs import AccelData, InstanceRecord
from warp_rt.options import BUILDERS, INTERSECTORS, check_threads
from warp_rt.scene import Mesh, Scene, check_scene, primitive_count
from warp_rt.scene.placement import Placement, place_scene
from warp_rt.warp_setup import resolve_device

_INTERSECTORS = {
    "watertight": constants.WATERTIGHT,
    "moller-trumbore": constants.MOLLER_TRUMBORE,
    "plane-projection": constants.PLANE_PROJECTION,
}
_NAMES = {int(number): name for name, number in _INTERSECTORS.items()}


@dataclass(frozen=True)
class BvhStatistics:
    """What the hierarchy came out as."""

    builder: str
    nodes: int
    """Nodes of up to sixteen children, both levels."""
    leaves: int
    """Packets of up to sixteen triangles, or of up to four shapes."""
    depth: int
    """Levels of nodes on the longest way down, both levels."""
    sah_cost: float
    """Nodes and leaf packets that a random line through the scene's box is expected to visit; 0 of a box without area.
    """
    built_cost: float
    """``sah_cost`` when it was last built. Refitting keeps the trees, whose cost then drifts away from it."""
    bytes: int
    """Memory of nodes, leaves and instances."""


@dataclass(frozen=True, eq=False)
class Accel:
    """A scene's bounding volume hierarchy on a device."""

    scene: Scene
    placement: Placement
    """Coordinates that the device works in."""
    data: AccelData
    """What kernels take; valid as long as this object lives."""
    table: wp.array
    """``data`` on the device: an array of one, which a launch does not copy for each ray."""
    device: str
    """Warp's name of it: ``cpu`` or ``cuda:N``."""
    stack_size: int
    """Entries of a traversal stack that no ray can exceed."""
    statistics: BvhStatistics
    layout: Layout | None
    """Where the meshes' trees lie, for ``refit_accel``; None where there are none."""
    idle_launches: deque[Any] = field(default_factory=deque, init=False, repr=False)
    """Launches of array queries that no query uses at the moment; span_launches.py."""

    @property
    def origin(self) -> np.ndarray:
        """World point that rays' coordinates are relative to on the device: float64, shape [3]."""
        return self.placement.origin


def build_accel(
    scene: Scene,
    *,
    device: str = "cpu",
    bvh: str = "sah",
    intersector: str = "watertight",
    threads: int | None = None,
) -> Accel:
    """Return the bounding volume hierarchy of a scene.

    ``lbvh`` and ``ploc`` are built on the device; ``sah``, ``median`` and ``midpoint`` on the CPU, and then uploaded.

    Args:
        scene: What to build it over.
        device: ``cpu``, ``cuda:N`` or ``auto``.
        bvh: Builder: ``sah`` (best to trace), ``median``, ``midpoint``, ``lbvh`` (fast to build) or ``ploc`` (for GPUs:
            nearly as good to trace as ``sah``).
        intersector: Triangle test: ``watertight``, ``moller-trumbore`` or ``plane-projection``.
        threads: CPU threads; None: one a core. Their number does not change the result.

    Raises:
        OptionError: There is no such builder or triangle test, or ``scene`` is no Scene.
        DeviceError: There is no such device.
        LimitError: The scene has more triangles than fit.
        SceneError: A point is not finite, or farther than 1e15 from its mesh's origin.
    """
    check_scene(scene)
    for name, value, choices in (("bvh", bvh, BUILDERS), ("intersector", intersector, INTERSECTORS)):
        if value not in choices:
            raise OptionError(f"{name}: {value!r} is none of {', '.join(choices)}")
    executor = _prepare(bvh, device, threads)
    placement = place_scene(scene)
    if not _has_primitives(scene):
        return _empty(scene, placement, executor, bvh, intersector)
    has_triangles = any(isinstance(mesh, Mesh) and len(mesh.triangles) for mesh in scene.meshes)
    trees = build_mesh_trees(scene, placement, bvh, builder_executor(bvh, executor)) if has_triangles else None
    return _place(trees, scene, placement, executor, bvh, intersector)


def refit_accel(accel: Accel, scene: Scene, *, threads: int | None = None) -> Accel:
    """Return the hierarchy of a scene whose triangles another one was built over, such as the frame before.

    Each mesh keeps its tree, whose boxes are made anew from the leaves up: a fifth of the time of building. Trees over
    shapes and over the instances are built. Hits are those of a hierarchy that is built; rays meet more boxes the
    farther points have moved apart, which ``statistics.sah_cost`` tells beside ``statistics.built_cost``.

    Args:
        accel: The other hierarchy, which stays as it is.
        scene: Any points, shapes and instances, but the triangles of ``accel.scene``.
        threads: CPU threads; None: one a core. Their number does not change the result.

    Raises:
        SceneError: The scene's meshes have other triangles, or points that ``build_accel`` refuses.

    Reference: Wald, Boulos and Shirley (2007), Ray Tracing Deformable Scenes Using Dynamic Bounding Volume
    Hierarchies, ACM Transactions on Graphics 26(1), section 4.
    """
    if not has_same_triangles(accel.scene, scene):
        raise SceneError("a hierarchy can be refitted to a scene with the same triangles only")
    builder, intersector = accel.statistics.builder, _NAMES[accel.data.intersector]
    if accel.layout is None or not _has_primitives(scene):
        return build_accel(scene, device=accel.device, bvh=builder, intersector=intersector, threads=threads)
    executor = _prepare(builder, accel.device, threads)
    placement = place_scene(scene)
    trees = refit_mesh_trees(accel.layout, accel.data.nodes, accel.data.leaves, scene, placement, executor)
    refitted = _place(trees, scene, placement, executor, builder, intersector)
    return replace(refitted, statistics=replace(refitted.statistics, built_cost=accel.statistics.built_cost))


def _has_primitives(scene: Scene) -> bool:
    """Return whether any triangle or shape is placed."""
    counts = np.array([primitive_count(mesh) for mesh in scene.meshes], int)
    return bool((counts[scene.instances.mesh] > 0).any())


def build_modules(builder: str, device: str) -> list[tuple[ModuleType, str]]:
    """Return the kernel files that building or refitting a hierarchy for a device needs, and on which device each."""
    place = builder_device(builder, device)
    files = [(module, place) for module in (*BUILDER_MODULES[builder], bvh_references, bvh_collapse, shape_pack)]
    files += [(module, device) for module in (bvh_references, bvh_instances, bvh_refit)]
    return list(dict.fromkeys(files))


def _prepare(builder: str, device: str, threads: int | None) -> Executor:
    """Return what a hierarchy for a device is put together by, the kernels for it being loaded."""
    check_threads(threads)
    device = resolve_device(device)
    for module, name in build_modules(builder, device):
        load_module(module, name)
    return Executor(device, Workers(threads))


def _place(
    mesh_trees: MeshTrees | None,
    scene: Scene,
    placement: Placement,
    executor: Executor,
    builder: str,
    intersector: str,
) -> Accel:
    """Return both levels: the trees over meshes and shapes, and one over the instances; at least one is placed."""
    trees = join_lower_trees(mesh_trees, scene, placement, executor, builder)
    tree_of_mesh = np.full(len(scene.meshes), -1, np.int32)
    tree_of_mesh[trees.meshes] = np.arange(len(trees.meshes))
    tree = tree_of_mesh[scene.instances.mesh]
    placed = np.flatnonzero(tree >= 0).astype(np.int32)
    tree = tree[placed]
    device_tree, roots = executor.upload(tree, wp.int32), executor.upload(trees.roots, wp.int32)
    top = build_upper_tree(trees, device_tree, roots, placement, placed, executor, builder)
    nodes = join_arrays([trees.nodes, top.nodes], executor)
    instances = write_instances(top.leaves, trees, device_tree, roots, placement, placed, executor)
    statistics = BvhStatistics(
        builder=builder,
        nodes=nodes.shape[0] // constants.NODE_FLOATS,
        leaves=trees.leaf_count,
        depth=int(top.layout.depths[0] + trees.depths[tree].max()),
        sah_cost=top.cost,
        built_cost=top.cost,
        bytes=sum(array.size * array.strides[0] for array in (nodes, trees.leaves, trees.shapes, instances)),
    )
    data = AccelData()
    data.nodes, data.leaves, data.shapes, data.instances = nodes, trees.leaves, trees.shapes, instances
    data.root = int(top.layout.roots[0])
    data.only_instance = -1
    if len(placed) == 1 and instances.numpy()["is_identity"][0]:
        data.root = int(trees.roots[tree[0]])
        data.only_instance = 0
    data.intersector = _INTERSECTORS[intersector]
    # Besides what the trees leave pending: the child that is visited next, and where an instance is left.
    stack_size = 2 + int(top.layout.stack_sizes[0] + trees.stack_sizes[tree].max())
    return _make_accel(scene, placement, data, executor, stack_size, statistics, trees.layout)


def _make_accel(
    scene: Scene,
    placement: Placement,
    data: AccelData,
    executor: Executor,
    stack_size: int,
    statistics: BvhStatistics,
    layout: Layout | None,
) -> Accel:
    """Return a hierarchy with its table."""
    table: wp.array = wp.array([data], dtype=AccelData, device=executor.device)
    return Accel(scene, placement, data, table, executor.device, stack_size, statistics, layout)


def _empty(scene: Scene, placement: Placement, executor: Executor, builder: str, intersector: str) -> Accel:
    """Return the hierarchy of nothing: one node whose lanes are all empty, so that queries need no special case."""
    node = np.zeros(constants.NODE_FLOATS, np.float32)
    node[: 3 * constants.WIDTH] = np.inf
    node[3 * constants.WIDTH : 6 * constants.WIDTH] = -np.inf
    data = AccelData()
    data.nodes = executor.upload(node, wp.float32)
    data.leaves = executor.empty(0, wp.float32)
    data.shapes = executor.empty(0, wp.float32)
    data.instances = executor.empty(0, InstanceRecord)
    data.root = 0
    data.only_instance = -1
    data.intersector = _INTERSECTORS[intersector]
    statistics = BvhStatistics(builder, nodes=1, leaves=0, depth=1, sah_cost=0.0, built_cost=0.0, bytes=node.nbytes)
    return _make_accel(scene, placement, data, executor, 2, statistics, None)
