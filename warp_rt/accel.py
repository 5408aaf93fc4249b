# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scene -> Accel: the two-level bounding volume hierarchy, one tree a mesh and one over the instances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.collapse import Forest
from warp_rt.errors import OptionError
from warp_rt.forest import (
    build_forest,
    list_leaf_primitives,
    pack_triangles,
    refer_to_instances,
    refer_to_triangles,
)
from warp_rt.jobs import as_warp
from warp_rt.kernels import bvh_build, bvh_clusters, bvh_collapse, bvh_instances, constants
from warp_rt.kernels.bvh_structs import AccelData, InstanceRecord, Stacks
from warp_rt.options import BUILDERS, INTERSECTORS
from warp_rt.placement import Placement, place_scene, relative_points
from warp_rt.scene import Mesh, Scene
from warp_rt.warp_setup import init_warp, load_module, resolve_device
from warp_rt.workers import Workers

_INTERSECTORS = {
    "watertight": constants.WATERTIGHT,
    "moller-trumbore": constants.MOLLER_TRUMBORE,
    "plane-projection": constants.PLANE_PROJECTION,
}


@dataclass(frozen=True)
class BvhStatistics:
    """What the hierarchy came out as."""

    builder: str
    nodes: int
    """Nodes of up to sixteen children, both levels."""
    leaves: int
    """Packets of up to sixteen triangles."""
    depth: int
    """Levels of nodes on the longest way down, both levels."""
    sah_cost: float
    """Nodes and leaf packets that a random line through the scene's box is expected to visit."""
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
    if threads is not None and threads < 1:
        raise OptionError(f"threads: {threads} is less than 1")
    init_warp()
    device = resolve_device(device)
    for module in (bvh_build, bvh_clusters, bvh_collapse, bvh_instances):
        load_module(module, "cpu")
    placement = place_scene(scene)
    host = _build(scene, placement, bvh, Workers(threads))
    data = AccelData()
    data.nodes = _upload(host.nodes, wp.float32, device)
    data.leaves = _upload(host.leaves, wp.float32, device)
    data.instances = _upload(host.instances, InstanceRecord, device)
    data.root = host.root
    data.only_instance = -1
    if len(host.instances) == 1 and host.instances["is_identity"][0]:
        data.root = int(host.instances["root"][0])
        data.only_instance = 0
    data.intersector = _INTERSECTORS[intersector]
    table: wp.array = wp.array([data], dtype=AccelData, device=device)
    return Accel(scene, placement, data, table, device, host.stack_size, host.statistics)


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
    instances: np.ndarray
    root: int
    stack_size: int
    statistics: BvhStatistics


def _build(scene: Scene, placement: Placement, builder: str, workers: Workers) -> _HostBvh:
    counts = np.array([len(mesh.triangles) for mesh in scene.meshes], np.int32)
    trees = np.flatnonzero(counts)
    placed = np.flatnonzero(np.isin(scene.instances.mesh, trees)).astype(np.int32)
    if not len(placed):
        return _empty(builder)
    points, triangles = _concatenate(
        [scene.meshes[i] for i in trees], [placement.mesh_origins[i] for i in trees], counts[trees]
    )
    references = refer_to_triangles(points, triangles, counts[trees], workers)
    boxes = np.stack([references.ranges["low"][:, :3], references.ranges["high"][:, :3]], axis=1)
    forest = build_forest(references, leaf_size=constants.WIDTH, builder=builder, workers=workers)
    leaves = pack_triangles(forest, points, triangles, workers)

    tree = np.searchsorted(trees, scene.instances.mesh[placed]).astype(np.int32)
    world_from_local, local_from_world = placement.world_from_local, placement.local_from_world
    if len(placed) < len(scene.instances):
        world_from_local, local_from_world = world_from_local[placed], local_from_world[placed]
    references = refer_to_instances(tree, forest.roots, boxes, forest.nodes, world_from_local, workers)
    low, high = (references.array.numpy()[name][:, :3].copy() for name in ("low", "high"))
    top = build_forest(
        references,
        leaf_size=1,
        builder=builder,
        workers=workers,
        node_offset=len(forest.nodes) // constants.NODE_FLOATS,
    )
    order = list_leaf_primitives(top)
    instances = np.zeros(len(order), InstanceRecord.numpy_dtype())
    wp.launch(
        bvh_instances.write_transforms,
        len(order),
        inputs=[as_warp(order, wp.int32), as_warp(local_from_world, wp.float64)],
        outputs=[as_warp(instances, InstanceRecord)],
        device="cpu",
    )
    instances["root"] = forest.roots[tree[order]]
    instances["instance"] = placed[order]
    instances["mesh"] = trees[tree[order]]
    nodes = np.concatenate([forest.nodes, top.nodes]) if len(top.nodes) else forest.nodes
    statistics = BvhStatistics(
        builder=builder,
        nodes=len(nodes) // constants.NODE_FLOATS,
        leaves=forest.leaf_count,
        depth=int(top.depths[0] + forest.depths[tree].max()),
        sah_cost=_sah_cost(top, forest, boxes, low, high, tree),
        bytes=nodes.nbytes + leaves.nbytes + instances.nbytes,
    )
    # Besides what the trees leave pending: the child that is visited next, and where an instance is left.
    stack_size = 2 + int(top.stack_sizes[0] + forest.stack_sizes[tree].max())
    return _HostBvh(nodes, leaves, instances, int(top.roots[0]), stack_size, statistics)


def _empty(builder: str) -> _HostBvh:
    """Return the hierarchy of nothing: one node whose lanes are all empty, so that queries need no special case."""
    node = np.zeros(constants.NODE_FLOATS, np.float32)
    node[: 3 * constants.WIDTH] = np.inf
    node[3 * constants.WIDTH : 6 * constants.WIDTH] = -np.inf
    instances = np.zeros(0, InstanceRecord.numpy_dtype())
    statistics = BvhStatistics(builder, nodes=1, leaves=0, depth=1, sah_cost=0.0, bytes=node.nbytes)
    return _HostBvh(node, np.zeros(0, np.float32), instances, 0, 2, statistics)


def _concatenate(
    meshes: Sequence[Mesh], origins: Sequence[np.ndarray], counts: np.ndarray
) -> tuple[wp.array, wp.array]:
    """Return all meshes' points, relative to their origins, and all their triangles, rows of those points."""
    points = [relative_points(mesh.points, origin) for mesh, origin in zip(meshes, origins, strict=True)]
    if len(meshes) == 1:
        triangles = np.ascontiguousarray(meshes[0].triangles, np.int32)
        return as_warp(points[0], wp.vec3), as_warp(triangles.reshape(-1), wp.int32)
    sizes = np.array([len(p) for p in points])
    triangles = np.concatenate([mesh.triangles for mesh in meshes], dtype=np.int32)
    triangles += np.repeat((np.cumsum(sizes) - sizes).astype(np.int32), counts)[:, None]
    return as_warp(np.concatenate(points), wp.vec3), as_warp(triangles.reshape(-1), wp.int32)


def _sah_cost(
    top: Forest, forest: Forest, boxes: np.ndarray, low: np.ndarray, high: np.ndarray, tree: np.ndarray
) -> float:
    """Return the expected number of visits: those of the upper level, and a mesh's wherever an instance is entered."""
    world = _half_area(low.min(axis=0), high.max(axis=0))
    mesh = _half_area(boxes[:, 0], boxes[:, 1])
    in_mesh = np.divide(forest.costs, mesh, out=np.zeros(len(mesh)), where=mesh > 0)
    return float((top.costs[0] + (_half_area(low, high) * in_mesh[tree]).sum()) / world)


def _half_area(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis((high - low).astype(float), -1, 0)
    return x * y + y * z + z * x


def _upload(array: np.ndarray, dtype: Any, device: str) -> wp.array:
    """Return an array on the device; on the CPU, one over the same memory."""
    return as_warp(array, dtype) if device == "cpu" else wp.array(array, dtype=dtype, device=device)
