# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scene -> Accel: the two-level bounding volume hierarchy, one tree a mesh and one over the instances."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import warp as wp

from warp_rt.collapse import Forest, Layout
from warp_rt.errors import OptionError, SceneError
from warp_rt.forest import build_forest, list_leaf_primitives, refer_to_instances
from warp_rt.jobs import as_warp
from warp_rt.kernels import bvh_build, bvh_clusters, bvh_collapse, bvh_instances, bvh_refit, constants, shape_pack
from warp_rt.kernels.bvh_structs import AccelData, InstanceRecord, Stacks
from warp_rt.mesh_trees import MeshTrees, build_mesh_trees, has_same_triangles, refit_mesh_trees
from warp_rt.options import BUILDERS, INTERSECTORS, check_threads
from warp_rt.placement import Placement, blocks, place_scene
from warp_rt.scene import Mesh, Scene, Shapes, primitive_count
from warp_rt.shape_trees import build_shape_trees
from warp_rt.warp_setup import init_warp, load_module, resolve_device
from warp_rt.workers import Workers

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
    idle_spans: deque[Any] = field(default_factory=deque, init=False, repr=False)
    """Scratch memory of array queries that no query uses at the moment; ray_span.py."""

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

    It is built on the CPU, whatever the device, by the same kernels, and then uploaded.

    Args:
        scene: What to build it over.
        device: ``cpu``, ``cuda:N`` or ``auto``.
        bvh: Builder: ``sah`` (best to trace), ``median``, ``midpoint`` or ``lbvh`` (fast to build).
        intersector: Triangle test: ``watertight``, ``moller-trumbore`` or ``plane-projection``.
        threads: CPU threads; None: one a core. Their number does not change the result.

    Raises:
        OptionError: There is no such builder or triangle test.
        DeviceError: There is no such device.
        LimitError: The scene has more triangles than fit.
    """
    for name, value, choices in (("bvh", bvh, BUILDERS), ("intersector", intersector, INTERSECTORS)):
        if value not in choices:
            raise OptionError(f"{name}: {value!r} is none of {', '.join(choices)}")
    workers = _prepare(threads)
    device = resolve_device(device)
    placement = place_scene(scene)
    if not _has_primitives(scene):
        return _upload_bvh(_empty(bvh), scene, placement, device, intersector)
    has_triangles = any(isinstance(mesh, Mesh) and len(mesh.triangles) for mesh in scene.meshes)
    trees = build_mesh_trees(scene, placement, bvh, workers) if has_triangles else None
    return _upload_bvh(_place(trees, scene, placement, bvh, workers), scene, placement, device, intersector)


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
        SceneError: The scene's meshes have other triangles.

    Reference: Wald, Boulos and Shirley (2007), Ray Tracing Deformable Scenes Using Dynamic Bounding Volume
    Hierarchies, ACM Transactions on Graphics 26(1), section 4.
    """
    if not has_same_triangles(accel.scene, scene):
        raise SceneError("a hierarchy can be refitted to a scene with the same triangles only")
    workers = _prepare(threads)
    builder, intersector = accel.statistics.builder, _NAMES[accel.data.intersector]
    if accel.layout is None or not _has_primitives(scene):
        return build_accel(scene, device=accel.device, bvh=builder, intersector=intersector, threads=threads)
    placement = place_scene(scene)
    nodes, leaves = accel.data.nodes.numpy(), accel.data.leaves.numpy()
    trees = refit_mesh_trees(accel.layout, nodes, leaves, scene, placement, workers)
    host = _place(trees, scene, placement, builder, workers)
    host = replace(host, statistics=replace(host.statistics, built_cost=accel.statistics.built_cost))
    return _upload_bvh(host, scene, placement, accel.device, intersector)


def _has_primitives(scene: Scene) -> bool:
    """Return whether any triangle or shape is placed."""
    counts = np.array([primitive_count(mesh) for mesh in scene.meshes], int)
    return bool((counts[scene.instances.mesh] > 0).any())


def _prepare(threads: int | None) -> Workers:
    """Return the threads to build with, whose kernels are loaded."""
    check_threads(threads)
    init_warp()
    for module in (bvh_build, bvh_clusters, bvh_collapse, bvh_instances, bvh_refit, shape_pack):
        load_module(module, "cpu")
    return Workers(threads)


def _upload_bvh(host: _HostBvh, scene: Scene, placement: Placement, device: str, intersector: str) -> Accel:
    """Return a hierarchy on its device."""
    data = AccelData()
    data.nodes = _upload(host.nodes, wp.float32, device)
    data.leaves = _upload(host.leaves, wp.float32, device)
    data.shapes = _upload(host.shapes, wp.float32, device)
    data.instances = _upload(host.instances, InstanceRecord, device)
    data.root = host.root
    data.only_instance = -1
    if len(host.instances) == 1 and host.instances["is_identity"][0]:
        data.root = int(host.instances["root"][0])
        data.only_instance = 0
    data.intersector = _INTERSECTORS[intersector]
    table: wp.array = wp.array([data], dtype=AccelData, device=device)
    return Accel(scene, placement, data, table, device, host.stack_size, host.statistics, host.layout)


def make_stacks(accel: Accel, rows: int = 1) -> Stacks:
    """Return traversal stacks on the accel's device.

    Args:
        accel: The hierarchy to traverse.
        rows: On a GPU, the number of threads of the launch. On the CPU one row serves a whole launch, but launches
            that run at the same time need stacks of their own.
    """
    stacks = Stacks()
    for name, dtype in (("codes", wp.int32), ("distances", wp.float32)):
        if accel.device == "cpu":
            # All children of a node are written at once, and then as many count as the ray meets.
            entries = wp.empty((rows, accel.stack_size + constants.WIDTH), dtype=dtype, device=accel.device)
        else:
            # Threads of a GPU reach the same depth at about the same time: the entries of one depth are neighbours.
            entries = wp.empty((accel.stack_size, rows), dtype=dtype, device=accel.device).transpose()
        setattr(stacks, name, entries)
    return stacks


@dataclass(frozen=True)
class _HostBvh:
    """The hierarchy in the host's memory."""

    nodes: np.ndarray
    leaves: np.ndarray
    shapes: np.ndarray
    instances: np.ndarray
    root: int
    stack_size: int
    statistics: BvhStatistics
    layout: Layout | None


@dataclass(frozen=True)
class _Trees:
    """The lower level: trees over triangles, then those over shapes, one a row of the scene's meshes not empty."""

    meshes: np.ndarray
    """int, shape [tree_count], row of ``Scene.meshes``."""
    kinds: np.ndarray
    """int16, shape [tree_count], TRIANGLES or a ``ShapeKind``."""
    boxes: np.ndarray
    """float32, shape [tree_count, 2, 3], local space."""
    roots: np.ndarray
    """int32, shape [tree_count], child codes."""
    depths: np.ndarray
    """int32, shape [tree_count], levels of wide nodes."""
    stack_sizes: np.ndarray
    """int32, shape [tree_count], entries that a traversal can leave on its stack at once, whatever the ray."""
    costs: np.ndarray
    """float32, shape [tree_count], half area of all nodes and leaves."""
    nodes: np.ndarray
    """float32: wide nodes."""
    leaf_count: int
    leaves: np.ndarray
    """float32: packets of triangles."""
    shapes: np.ndarray
    """float32: packets of shapes, then pieces of cubic tubes."""


def _with_shapes(trees: MeshTrees | None, scene: Scene, placement: Placement, builder: str, workers: Workers) -> _Trees:
    """Return the lower level: trees over meshes (None: there are none) and new ones over shapes."""
    rows = np.array([k for k, one in enumerate(scene.meshes) if isinstance(one, Shapes) and len(one.points)], int)
    sets = [one for one in (scene.meshes[row] for row in rows) if isinstance(one, Shapes)]
    of_shapes = None
    if sets:
        node_offset = 0 if trees is None else len(trees.nodes) // constants.NODE_FLOATS
        of_shapes = build_shape_trees(
            sets, placement.mesh_origins[rows], builder=builder, workers=workers, node_offset=node_offset
        )
    nothing = np.zeros(0, np.float32)
    parts: list[tuple[Any, Layout, np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []
    if trees is not None:
        no_kinds = np.zeros(len(trees.meshes), np.int16)
        parts.append((trees.meshes, trees.layout, no_kinds, trees.boxes, trees.costs, trees.nodes))
    if of_shapes is not None:
        forest, kinds = of_shapes.forest, np.array([one.kind for one in sets], np.int16)
        parts.append((rows, forest.layout, kinds, of_shapes.boxes, forest.costs, forest.nodes))
    meshes, layouts, all_kinds, boxes, costs, nodes = zip(*parts, strict=True)
    return _Trees(
        meshes=np.concatenate(meshes),
        kinds=np.concatenate(all_kinds),
        boxes=np.concatenate(boxes),
        roots=np.concatenate([layout.roots for layout in layouts]),
        depths=np.concatenate([layout.depths for layout in layouts]),
        stack_sizes=np.concatenate([layout.stack_sizes for layout in layouts]),
        costs=np.concatenate(costs),
        nodes=nodes[0] if len(nodes) == 1 else np.concatenate(nodes),
        leaf_count=sum(layout.leaf_count for layout in layouts),
        leaves=nothing if trees is None else trees.leaves,
        shapes=nothing if of_shapes is None else of_shapes.packets,
    )


def _place(
    mesh_trees: MeshTrees | None, scene: Scene, placement: Placement, builder: str, workers: Workers
) -> _HostBvh:
    """Return both levels: the trees over meshes and shapes, and one over the instances; at least one is placed."""
    trees = _with_shapes(mesh_trees, scene, placement, builder, workers)
    tree_of_mesh = np.full(len(scene.meshes), -1, np.int32)
    tree_of_mesh[trees.meshes] = np.arange(len(trees.meshes))
    tree = tree_of_mesh[scene.instances.mesh]
    placed = np.flatnonzero(tree >= 0).astype(np.int32)
    tree = tree[placed]
    roots = trees.roots
    references = refer_to_instances(tree, roots, trees.boxes, trees.nodes, placement, placed, workers)
    low, high = (references.array.numpy()[name][:, :3].copy() for name in ("low", "high"))
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise SceneError("instances: a transform takes geometry beyond the range of float32")
    top = build_forest(
        references,
        leaf_size=1,
        builder=builder,
        workers=workers,
        node_offset=len(trees.nodes) // constants.NODE_FLOATS,
    )
    order = list_leaf_primitives(top)
    instances = np.zeros(len(order), InstanceRecord.numpy_dtype())
    for rows in blocks(len(order)):
        _write_transforms(instances[rows], placement.local_from_world(placed[order[rows]]).astype(np.float32))
    instances["kind"] = trees.kinds[tree[order]]
    instances["root"] = roots[tree[order]]
    instances["instance"] = placed[order]
    instances["mesh"] = trees.meshes[tree[order]]
    nodes = np.concatenate([trees.nodes, top.nodes]) if len(top.nodes) else trees.nodes
    cost = _sah_cost(top, trees, low, high, tree)
    statistics = BvhStatistics(
        builder=builder,
        nodes=len(nodes) // constants.NODE_FLOATS,
        leaves=trees.leaf_count,
        depth=int(top.layout.depths[0] + trees.depths[tree].max()),
        sah_cost=cost,
        built_cost=cost,
        bytes=nodes.nbytes + trees.leaves.nbytes + trees.shapes.nbytes + instances.nbytes,
    )
    # Besides what the trees leave pending: the child that is visited next, and where an instance is left.
    stack_size = 2 + int(top.layout.stack_sizes[0] + trees.stack_sizes[tree].max())
    root = int(top.layout.roots[0])
    layout = None if mesh_trees is None else mesh_trees.layout
    return _HostBvh(nodes, trees.leaves, trees.shapes, instances, root, stack_size, statistics, layout)


def _write_transforms(records: np.ndarray, local_from_world: np.ndarray) -> None:
    """Write transforms, float32, shape [n, 3, 4], into instance records."""
    for row, name in enumerate(("row_x", "row_y", "row_z")):
        records[name] = local_from_world[:, row]
    records["is_identity"] = (local_from_world == np.eye(4, dtype=np.float32)[:3]).all(axis=(1, 2))


def _empty(builder: str) -> _HostBvh:
    """Return the hierarchy of nothing: one node whose lanes are all empty, so that queries need no special case."""
    node = np.zeros(constants.NODE_FLOATS, np.float32)
    node[: 3 * constants.WIDTH] = np.inf
    node[3 * constants.WIDTH : 6 * constants.WIDTH] = -np.inf
    instances = np.zeros(0, InstanceRecord.numpy_dtype())
    statistics = BvhStatistics(builder, nodes=1, leaves=0, depth=1, sah_cost=0.0, built_cost=0.0, bytes=node.nbytes)
    nothing = np.zeros(0, np.float32)
    return _HostBvh(node, nothing, nothing, instances, 0, 2, statistics, None)


def _sah_cost(top: Forest, trees: _Trees, low: np.ndarray, high: np.ndarray, tree: np.ndarray) -> float:
    """Return the expected number of visits: those of the upper level, and a mesh's wherever an instance is entered."""
    world = _half_area(low.min(axis=0), high.max(axis=0))
    if not world > 0:
        return 0.0
    mesh = _half_area(trees.boxes[:, 0], trees.boxes[:, 1])
    in_mesh = np.divide(trees.costs, mesh, out=np.zeros(len(mesh)), where=mesh > 0)
    return float((top.costs[0] + (_half_area(low, high) * in_mesh[tree]).sum()) / world)


def _half_area(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis((high - low).astype(float), -1, 0)
    return x * y + y * z + z * x


def _upload(array: np.ndarray, dtype: Any, device: str) -> wp.array:
    """Return an array on the device; on the CPU, one over the same memory."""
    return as_warp(array, dtype) if device == "cpu" else wp.array(array, dtype=dtype, device=device)
