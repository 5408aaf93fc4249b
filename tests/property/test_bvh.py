# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Invariants of the hierarchy, for every builder: read back from the very arrays that kernels traverse."""

from __future__ import annotations

import time

import numpy as np
import pytest
import warp as wp

import warp_rt
from warp_rt.bvh.accel import Accel
from warp_rt.bvh.forest import check_words
from warp_rt.errors import LimitError, SceneError
from warp_rt.kernels.constants import BOX_PADDING
from warp_rt.options import BUILDERS
from warp_rt.scene import Instances, Mesh, Scene

from ..meshes import Shape, cube, octasphere, soup, torus


def scene_of(shapes: list[Shape], meshes: list[int], matrices: np.ndarray) -> Scene:
    """Return a scene of instances: which mesh, and its world_from_local, shape [n, 4, 4]."""
    zeros = np.zeros(len(meshes), np.int32)
    return Scene(
        meshes=tuple(Mesh(p.astype(np.float32), t) for p, t in shapes),
        instances=Instances(np.array(meshes, np.int32), matrices, zeros, zeros[:1], zeros, zeros - 1),
    )


def random_matrices(count: int, seed: int) -> np.ndarray:
    """Return affine transforms of every kind: sheared, mirrored, unevenly scaled."""
    rng = np.random.default_rng(seed)
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, :3] = rng.normal(size=(count, 3, 3)) + np.eye(3)
    matrices[:, :3, 3] = rng.uniform(-5, 5, (count, 3))
    return matrices[np.abs(np.linalg.det(matrices[:, :3, :3])) > 0.05]


class Reader:
    """Walks an accel's arrays on the host."""

    def __init__(self, accel: Accel) -> None:
        self.nodes = accel.data.nodes.numpy().reshape(-1, 128)
        self.leaves = accel.data.leaves.numpy().reshape(-1, 160)
        self.instances = accel.data.instances.numpy()

    def children(self, node: int) -> list[tuple[int, np.ndarray, np.ndarray]]:
        """Return (code, low, high) of each child of a node; empty lanes must look empty."""
        low, high = self.nodes[node, :48].reshape(3, 16).T, self.nodes[node, 48:96].reshape(3, 16).T
        codes = self.nodes[node, 96:112].view(np.int32)
        is_empty = low[:, 0] == np.inf
        assert (low[is_empty] == np.inf).all()
        assert (high[is_empty] == -np.inf).all()
        assert (low[~is_empty] <= high[~is_empty]).all()
        return [(int(codes[i]), low[i], high[i]) for i in np.flatnonzero(~is_empty)]

    def check_orders(self, node: int) -> None:
        """Assert that each octant's order names every lane once, the centre that its rays meet last first."""
        words = self.nodes[node, 112:].view(np.uint32).reshape(8, 2, 1)
        orders = (words >> (4 * np.arange(8, dtype=np.uint32)) & 15).transpose(0, 2, 1).reshape(8, 16)
        assert (np.sort(orders, axis=1) == np.arange(16)).all()
        low, high = self.nodes[node, :48].reshape(3, 16), self.nodes[node, 48:96].reshape(3, 16)
        is_used = low[0] < np.inf
        centers = np.where(is_used, low, 0).astype(float) + np.where(is_used, high, 0)
        for octant in range(8):
            along = np.array([-1.0 if octant >> axis & 1 else 1.0 for axis in range(3)]) @ centers
            used = orders[octant][is_used[orders[octant]]]
            assert (np.diff(along[used]) <= 1e-5 * np.abs(centers[:, used]).max()).all()

    def walk(self, root: int) -> tuple[list[int], list[int], int, int]:
        """Return (nodes, leaves, depth, entries that a stack needs) below a child code, checking containment."""
        nodes: list[int] = []
        leaves: list[int] = []
        depth = entries = 0
        todo = [(root, 1, 0, np.full(3, -np.inf), np.full(3, np.inf))]
        while todo:
            code, level, pending, low, high = todo.pop()
            if code < 0:
                leaves.append(-1 - code)
                continue
            nodes.append(code)
            children = self.children(code)
            self.check_orders(code)
            depth = max(depth, level)
            entries = max(entries, pending + len(children) - 1)
            for child, child_low, child_high in children:
                assert (child_low >= low).all()
                assert (child_high <= high).all()
                todo.append((child, level + 1, pending + len(children) - 1, child_low, child_high))
        return nodes, leaves, depth, entries

    def leaf_boxes(self, root: int) -> dict[int, tuple[np.ndarray, np.ndarray]]:
        """Return the box that its parent keeps of each leaf below a node."""
        nodes, _, _, _ = self.walk(root)
        return {-1 - c: (low, high) for node in nodes for c, low, high in self.children(node) if c < 0}

    def packet(self, leaf: int) -> tuple[np.ndarray, np.ndarray]:
        """Return a packet's triangle indices, shape [k], and corners, shape [k, 3, 3]; empty lanes must be empty."""
        ids = self.leaves[leaf, 144:].view(np.int32)
        corners = self.leaves[leaf, :144].reshape(3, 3, 16).transpose(2, 0, 1)
        used = ids >= 0
        assert np.isnan(corners[~used]).all()
        assert used.any()
        return ids[used], corners[used]


def check_box(low: np.ndarray, high: np.ndarray, inner_low: np.ndarray, inner_high: np.ndarray) -> None:
    """Assert that a node's box is wider on all sides than what is in it, by BOX_PADDING rounded to neighbours."""
    size = max((inner_high - inner_low).max(), np.abs(inner_low).max(), np.abs(inner_high).max())
    for slack in (inner_low.astype(float) - low, high - inner_high.astype(float)):
        assert (slack > 0).all() or size == 0
        assert (slack <= 2.001 * float(BOX_PADDING) * size).all()


def check(accel: Accel) -> None:
    """Assert every invariant."""
    scene, reader = accel.scene, Reader(accel)
    roots: dict[int, int] = {}
    for record in reader.instances:
        roots[int(record["mesh"])] = int(record["root"])
    depth = entries = 0
    seen_nodes: list[int] = []
    seen_leaves: list[int] = []
    for mesh, root in roots.items():
        nodes, leaves, mesh_depth, mesh_entries = reader.walk(root)
        boxes = reader.leaf_boxes(root)
        ids = []
        for leaf in leaves:
            triangles, corners = reader.packet(leaf)
            ids += triangles.tolist()
            expected = scene.meshes[mesh].points[scene.meshes[mesh].triangles[triangles]]
            np.testing.assert_array_equal(corners, expected)
            if leaf in boxes:
                check_box(*boxes[leaf], corners.min(axis=(0, 1)), corners.max(axis=(0, 1)))
        assert sorted(ids) == list(range(len(scene.meshes[mesh].triangles)))  # every primitive exactly once
        seen_nodes += nodes
        seen_leaves += leaves
        depth, entries = max(depth, mesh_depth), max(entries, mesh_entries)
    if accel.data.only_instance < 0:
        nodes, leaves, top_depth, top_entries = reader.walk(accel.data.root)
        assert sorted(leaves) == list(range(len(reader.instances)))
        seen_nodes += nodes
        depth, entries = depth + top_depth, entries + top_entries
        for leaf, (low, high) in reader.leaf_boxes(accel.data.root).items():
            record = reader.instances[leaf]
            mesh = scene.meshes[record["mesh"]]
            matrix = scene.instances.world_from_local[record["instance"]]
            world = mesh.points[mesh.triangles.reshape(-1)] @ matrix[:3, :3].T + matrix[:3, 3] - accel.origin
            assert (world >= low).all()
            assert (world <= high).all()
    used = [i for i in range(len(scene.instances)) if len(scene.meshes[scene.instances.mesh[i]].triangles)]
    assert sorted(reader.instances["instance"].tolist()) == used
    assert sorted(seen_nodes) == list(range(len(reader.nodes)))  # none shared, none lost
    assert sorted(seen_leaves) == list(range(len(reader.leaves)))
    statistics = accel.statistics
    assert (statistics.nodes, statistics.leaves, statistics.depth) == (len(reader.nodes), len(reader.leaves), depth)
    assert accel.stack_size >= entries + 2


@pytest.mark.parametrize("bvh", BUILDERS)
@pytest.mark.parametrize("shape", [cube(), octasphere(4), torus(), soup(3000, 1), soup(1, 2), soup(16, 3), soup(17, 4)])
def test_one_mesh(shape: Shape, bvh: str) -> None:
    check(warp_rt.build_accel(Scene.from_arrays(*shape), bvh=bvh))


@pytest.mark.parametrize("bvh", BUILDERS)
def test_instances_of_several_meshes(bvh: str) -> None:
    shapes = [octasphere(3), cube(), soup(200, 5), (np.zeros((0, 3)), np.zeros((0, 3), np.int32)), soup(3, 6)]
    matrices = random_matrices(60, 7)
    meshes = np.random.default_rng(8).integers(0, len(shapes), len(matrices)).tolist()
    check(warp_rt.build_accel(scene_of(shapes, meshes, matrices), bvh=bvh))


@pytest.mark.parametrize("bvh", BUILDERS)
@pytest.mark.parametrize("name", ["identical", "exponential", "zero area", "line", "grid"])
def test_degenerate_meshes(name: str, bvh: str) -> None:
    rng = np.random.default_rng(0)
    count = 4000
    if name == "identical":
        corners = np.broadcast_to(rng.normal(size=(1, 3, 3)), (count, 3, 3))
    elif name == "exponential":
        corners = soup(count, 1)[0].reshape(-1, 3, 3) * 2.0 ** -np.linspace(0, 120, count)[:, None, None]
    elif name == "zero area":
        corners = np.repeat(rng.normal(size=(count, 1, 3)), 3, axis=1)
    elif name == "line":
        corners = rng.uniform(size=(count, 3, 1)) * np.array([1.0, 0, 0])
    else:
        x, y = np.divmod(np.arange(count), 64)
        corner = np.stack([x, y, np.zeros(count)], axis=1)[:, None]
        corners = corner + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    shape = corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    accel = warp_rt.build_accel(Scene.from_arrays(*shape), bvh=bvh)
    check(accel)
    if name in ("identical", "grid"):
        target = corners[1234].mean(axis=0)
        hits = warp_rt.closest_hit(accel, target[None] + [[0.1, 0.2, 3]], [[-0.1, -0.2, -3]])
        assert hits.t[0] == pytest.approx(1, rel=1e-4)


def test_packets_are_full() -> None:
    """The builder's cost counts packets, so that most of them are nearly full."""
    shape = octasphere(6)
    accel = warp_rt.build_accel(Scene.from_arrays(*shape))
    assert len(shape[1]) / accel.statistics.leaves > 13


def test_cost_ranks_the_builders() -> None:
    """The surface area heuristic is what ``sah`` minimises: no other builder may do better."""
    scene = Scene.from_arrays(*soup(20_000, 9, size=0.02))
    cost = {bvh: warp_rt.build_accel(scene, bvh=bvh).statistics.sah_cost for bvh in BUILDERS}
    assert min(cost, key=cost.__getitem__) == "sah"


def test_cost_of_a_known_tree() -> None:
    """Two unit cubes far apart, 12 triangles each: the root, and two packets below it for either of them."""
    points, triangles = cube()
    both = np.concatenate([points, points + np.array([100.0, 0, 0])]), np.concatenate([triangles, triangles + 8])
    accel = warp_rt.build_accel(Scene.from_arrays(*both))
    reader = Reader(accel)
    nodes, _, _, _ = reader.walk(accel.data.root)
    assert len(nodes) == 1
    extents = [high - low for _, low, high in reader.children(nodes[0])]
    areas = sum(e @ np.roll(e, 1) for e in extents)
    whole = np.array([102.0, 2, 2])
    # one instance, entered through its (slightly larger) world box: its leaf, the root node, the packets
    assert accel.statistics.sah_cost == pytest.approx(1 + 1 + areas / (whole @ np.roll(whole, 1)), rel=1e-4)


@pytest.mark.parametrize("bvh", BUILDERS)
def test_thread_count_does_not_change_the_tree(bvh: str) -> None:
    scene = Scene.from_arrays(*soup(30_000, 10, size=0.02))
    one, three = (warp_rt.build_accel(scene, bvh=bvh, threads=n).data for n in (1, 3))
    for name in ("nodes", "leaves", "instances"):
        assert getattr(one, name).numpy().tobytes() == getattr(three, name).numpy().tobytes()


def test_an_empty_scene_is_missed() -> None:
    accel = warp_rt.build_accel(Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int)))
    hits = warp_rt.closest_hit(accel, np.zeros((3, 3)), np.ones((3, 3)))
    assert (hits.instance == -1).all()
    assert np.isinf(hits.t).all()
    assert not warp_rt.any_hit(accel, np.zeros((3, 3)), np.ones((3, 3))).any()


def test_thousands_of_small_meshes_are_built_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some launches a level of the trees and a block of meshes, not some a mesh; ``benchmarks scale`` has the time."""
    count = 2000
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, 3] = np.random.default_rng(0).uniform(-50, 50, (count, 3))
    scene = scene_of([soup(20, i) for i in range(count)], list(range(count)), matrices)
    launches: list[str] = []
    launch = wp.launch

    def count_launch(kernel: wp.Kernel, *arguments: object, **options: object) -> object:
        launches.append(kernel.key)
        return launch(kernel, *arguments, **options)

    monkeypatch.setattr(wp, "launch", count_launch)
    accel = warp_rt.build_accel(scene, threads=2)
    assert 0 < len(launches) < count / 4
    check(accel)


@pytest.mark.heavy
@pytest.mark.parametrize("bvh", BUILDERS)
@pytest.mark.parametrize("name", ["identical", "exponential"])
def test_a_hundred_thousand_degenerate_triangles(name: str, bvh: str) -> None:
    count = 100_000
    one = np.random.default_rng(1).normal(size=(1, 3, 3))
    scale = np.ones(count) if name == "identical" else 2.0 ** -np.linspace(0, 120, count)
    shape = (one * scale[:, None, None]).reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    accel = warp_rt.build_accel(Scene.from_arrays(*shape), bvh=bvh)
    rng = np.random.default_rng(2)
    origins = rng.normal(size=(1000, 3)) * 3
    start = time.perf_counter()
    hits = warp_rt.closest_hit(accel, origins, one[0].mean(axis=0) - origins, threads=1)
    assert (time.perf_counter() - start) / 1000 < 1e-3
    assert (hits.t <= 1.001).all()


def test_hierarchies_that_indices_cannot_reach_are_refused() -> None:
    """Median splits can leave packets half empty: their number counts, not that of the triangles."""
    check_words("leaf packets", 13_421_772, 160)
    with pytest.raises(LimitError, match="13421773 leaf packets"):
        check_words("leaf packets", 13_421_773, 160)


@pytest.mark.parametrize("bvh", ["sah", "lbvh"])
def test_thread_count_does_not_change_a_big_tree(bvh: str) -> None:
    """Upper levels over clusters, a cluster dense enough to be split into others, and one of identical triangles."""
    even, dense, same = soup(70_000, 11, size=0.01), soup(80_000, 12, size=0.01), soup(1, 13)
    points = np.concatenate([even[0], 1e-4 * dense[0] + 0.3, np.tile(same[0], (70_000, 1))])
    scene = Scene.from_arrays(points, np.arange(len(points)).reshape(-1, 3))
    one, three = (warp_rt.build_accel(scene, bvh=bvh, threads=n) for n in (1, 3))
    for name in ("nodes", "leaves", "instances"):
        assert getattr(one.data, name).numpy().tobytes() == getattr(three.data, name).numpy().tobytes()
    check(three)


def test_transforms_beyond_float32_are_refused() -> None:
    """One instance is as big as float32 can say; scaled, it no longer is."""
    matrices = np.tile(np.eye(4), (5000, 1, 1))
    matrices[:, :3, 3] = np.random.default_rng(0).uniform(-5, 5, (5000, 3))
    scene = scene_of([cube()], [0] * 5000, matrices)
    check(warp_rt.build_accel(scene, bvh="lbvh"))
    for scale in (1e39, -1e39):
        matrices = matrices.copy()
        matrices[4321, :3, :3] = scale * np.eye(3)
        with pytest.raises(SceneError, match="beyond the range of float32"):
            warp_rt.build_accel(scene_of([cube()], [0] * 5000, matrices))
