# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Builders of which every step runs on the hierarchy's device: beside NumPy, brute force, and the other builders.

What holds for every builder, these included, is in test_bvh.py and test_refit.py.
"""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

import warp_rt
from warp_rt.bvh import forest
from warp_rt.bvh.accel import refit_accel
from warp_rt.bvh.forest import build_binary_trees, builder_device, refer_to_triangles
from warp_rt.device import jobs
from warp_rt.device.jobs import Executor
from warp_rt.device.workers import Workers
from warp_rt.errors import SceneError
from warp_rt.kernels.bvh_ploc import Cluster, find_nearest, mark_pairs
from warp_rt.kernels.constants import PACKET_REACH, PLOC_NODE_WEIGHT, PLOC_RADIUS, WIDTH
from warp_rt.options import BUILDERS
from warp_rt.scene import Scene

from ..meshes import Shape, brute_force, octasphere, soup, torus
from .test_bvh import Reader, check, random_matrices, scene_of

PARALLEL = ("lbvh", "ploc")


def uneven(count: int, seed: int) -> Shape:
    """Return triangles of sizes over three orders of magnitude, most of them in a corner of the unit cube."""
    rng = np.random.default_rng(seed)
    center, size = rng.uniform(0, 1, (count, 1, 3)) ** 4, 10 ** rng.uniform(-3.5, -0.5, (count, 1, 1))
    corners = center + size * rng.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


def binary_leaves(shape: Shape, builder: str, leaf_size: int, device: str = "cpu") -> list[list[int]]:
    """Return the primitives of each leaf of a binary tree, from left to right; check that boxes are unions."""
    executor = Executor(device, Workers(1))
    points = executor.upload(shape[0].astype(np.float32), wp.vec3)
    triangles = executor.upload(shape[1].reshape(-1).astype(np.int32), wp.int32)
    references = refer_to_triangles(points, triangles, np.array([len(shape[1])], np.int32), executor)
    trees, roots = build_binary_trees(references, leaf_size=leaf_size, builder=builder, executor=executor)
    nodes, ids = trees.nodes.numpy(), trees.ids.numpy()
    leaves, todo = [], [int(roots.numpy()[0])]
    corners = shape[0].astype(np.float32)[shape[1]]
    while todo:
        node = nodes[todo.pop()]
        if node["right"] < 0:
            leaves.append(ids[node["left"] : node["left"] - node["right"]].tolist())
            np.testing.assert_array_equal(node["low"], corners[leaves[-1]].min(axis=(0, 1)))
            np.testing.assert_array_equal(node["high"], corners[leaves[-1]].max(axis=(0, 1)))
        else:
            children = nodes[[node["left"], node["right"]]]
            np.testing.assert_array_equal(node["low"], children["low"].min(axis=0))
            np.testing.assert_array_equal(node["high"], children["high"].max(axis=0))
            todo += [int(node["right"]), int(node["left"])]
    return leaves


def linear_leaves(shape: Shape, leaf_size: int) -> list[list[int]]:
    """Return what the leaves of ``lbvh`` must be: Morton codes are Python's integers, split by their highest bit."""
    boxes = shape[0].astype(np.float32)[shape[1]]
    centroids = boxes.min(axis=1) + boxes.max(axis=1)
    low, high = centroids.min(axis=0), centroids.max(axis=0)
    scale = np.float32(1) / (high - low).max()  # cells are cubes
    cells = np.clip((centroids - low) * scale * np.float32(2**21), 0, 2**21 - 1).astype(int).tolist()
    codes = [sum((c[axis] >> bit & 1) << (3 * bit + axis) for bit in range(21) for axis in range(3)) for c in cells]
    found: list[list[int]] = []

    def split(run: list[int], bit: int) -> None:
        if len(run) <= leaf_size:
            found.append(run)
        elif bit < 0:
            split(run[: len(run) // 2], bit)
            split(run[len(run) // 2 :], bit)
        else:
            halves = [i for i in run if not codes[i] >> bit & 1], [i for i in run if codes[i] >> bit & 1]
            for half in halves:
                if half:
                    split(half, bit - 1)

    split(sorted(range(len(codes)), key=codes.__getitem__), 62)
    return found


@pytest.mark.parametrize("leaf_size", [1, 16])
@pytest.mark.parametrize("shape", [octasphere(4), soup(3000, 1), torus(), uneven(2000, 2)])
def test_linear_trees_are_split_by_morton_codes(shape: Shape, leaf_size: int, device: str) -> None:
    assert binary_leaves(shape, "lbvh", leaf_size, device) == linear_leaves(shape, leaf_size)


def nearest_of(clusters: np.ndarray, capacity: int, is_filling: bool) -> list[int]:
    """Return what ``find_nearest`` must write, pair by pair, in float32."""

    def area(low: np.ndarray, high: np.ndarray) -> np.float32:
        e = high - low
        return e[0] * e[1] + e[1] * e[2] + e[2] * e[0]

    found = []
    for i, one in enumerate(clusters):
        best = (np.float32(np.inf), 0, -1)
        for j in range(max(i - int(PLOC_RADIUS), 0), min(i + int(PLOC_RADIUS) + 1, len(clusters))):
            other = clusters[j]
            if j == i or other["tree"] != one["tree"] or one["count"] + other["count"] > capacity:
                continue
            joint = area(np.minimum(one["low"], other["low"]), np.maximum(one["high"], other["high"]))
            single = area(one["low"], one["high"]) + area(other["low"], other["high"])
            if is_filling and joint > np.float32(PACKET_REACH) * single and single > 0:
                continue
            weight = np.float32(1 if is_filling else PLOC_NODE_WEIGHT)
            best = min(best, (joint - weight * single, i ^ j, j))
        found.append(best[2])
    return found


@pytest.mark.parametrize("kind", ["random", "equal", "grid", "points", "huge"])
@pytest.mark.parametrize("is_filling", [False, True])
def test_the_nearest_cluster_is_found_and_found_back(kind: str, is_filling: bool, device: str) -> None:
    """Some pair is each other's nearest wherever there is any, and of equal clusters every one has its partner."""
    rng = np.random.default_rng(0)
    clusters = np.zeros(200, Cluster.numpy_dtype())
    clusters["tree"] = np.sort(rng.integers(0, 5, 200))
    clusters["count"] = rng.integers(1, 17, 200) if kind == "random" else 1
    places = {"equal": np.zeros((200, 3)), "grid": np.arange(200)[:, None] * np.ones(3)}
    low = places.get(kind, rng.normal(size=(200, 3)))
    size = {"points": 0.0, "random": rng.exponential(0.5, (200, 3))}.get(kind, 1.0)
    clusters["low"] = low * (1e30 if kind == "huge" else 1)
    clusters["high"] = clusters["low"] + size * (1e30 if kind == "huge" else 1)
    capacity = 16 if is_filling else 1 << 30
    nearest = wp.empty(200, dtype=int, device=device)
    inputs = [wp.array(clusters, dtype=Cluster, device=device), capacity, is_filling, 0]
    wp.launch(find_nearest, 200, inputs=inputs, outputs=[nearest], device=device)
    marks = wp.empty(200, dtype=wp.vec3i, device=device)
    wp.launch(mark_pairs, 200, inputs=[nearest, 0], outputs=[marks], device=device)
    partners = nearest.numpy()
    if kind != "huge":  # whose areas are beyond float32: all alike
        assert partners.tolist() == nearest_of(clusters, capacity, is_filling)
    is_mutual = (partners >= 0) & (partners[partners] == np.arange(200))
    kept, joined, able = marks.numpy().sum(axis=0)
    assert (able, joined, kept) == ((partners >= 0).sum(), is_mutual.sum() // 2, 200 - is_mutual.sum() // 2)
    assert joined > 0 or (kind == "grid" and is_filling)  # the box of two diagonal cells is twice as big as both
    if kind in ("equal", "huge"):
        trees = np.bincount(clusters["tree"])
        assert joined >= (trees // 2 - 1).sum()


@pytest.mark.parametrize(
    "shape",
    [octasphere(5), torus(300, 150), soup(20_000, 3, 0.02), uneven(20_000, 4)],
    ids=["sphere", "torus", "soup", "uneven"],
)
def test_costs_beside_the_surface_area_heuristic(shape: Shape, monkeypatch: pytest.MonkeyPatch) -> None:
    """As docs/performance.md says: beside splits without reinsertion within a tenth by clusters, a third by codes."""
    scene = Scene.from_arrays(*shape)

    def cost(bvh: str) -> float:
        return warp_rt.build_accel(scene, bvh=bvh).statistics.sah_cost

    best, by_clusters, by_codes = cost("sah"), cost("ploc"), cost("lbvh")
    left_out = []
    monkeypatch.setattr(forest, "reinsert_subtrees", lambda *trees: left_out.append(trees))
    by_splits = cost("sah")
    assert left_out
    assert by_clusters < 1.1 * min(best, by_splits)
    assert by_codes < 1.33 * by_splits
    assert by_clusters < by_codes


@pytest.mark.parametrize("bvh", PARALLEL)
def test_flat_scenes_are_not_cut_through_their_height(bvh: str) -> None:
    """Heaps strewn over a plane, a hundredth as high as wide: codes tell heaps apart before top from bottom."""
    rng = np.random.default_rng(14)
    places = np.repeat(rng.uniform(0, 100, (150, 1, 3)) * [1, 0, 1], 100, axis=0)
    corners = places + rng.uniform(0, 1, (15_000, 1, 3)) + 0.05 * rng.normal(size=(15_000, 3, 3))
    scene = Scene.from_arrays(corners.reshape(-1, 3), np.arange(45_000, dtype=np.int32).reshape(-1, 3))
    cost = {name: warp_rt.build_accel(scene, bvh=name).statistics.sah_cost for name in ("sah", bvh)}
    assert cost[bvh] < 1.2 * cost["sah"]


@pytest.mark.parametrize("bvh", PARALLEL)
@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_hits_are_those_of_brute_force(bvh: str, scale: float, device: str) -> None:
    shape = soup(700, 5, size=0.05)
    points = (shape[0] * scale).astype(np.float32)
    rng = np.random.default_rng(6)
    origins, targets = (scale * rng.uniform(-0.5, 1.5, (500, 3)) for _ in range(2))
    origins, directions = origins.astype(np.float32), ((targets - origins) / scale).astype(np.float32)
    accel = warp_rt.build_accel(Scene.from_arrays(points, shape[1]), bvh=bvh, device=device)
    check(accel)
    hits = warp_rt.closest_hit(accel, origins, directions)
    double = [array.astype(float) / scale for array in (points, origins)]
    t, triangle, is_near_edge, is_tie = brute_force(double[0], shape[1], double[1], directions)
    is_sure = ~is_near_edge & ~is_tie
    assert (is_sure & np.isfinite(t)).mean() > 0.3
    np.testing.assert_array_equal(hits.triangle[is_sure], triangle[is_sure])
    np.testing.assert_allclose(hits.t[is_sure] / scale, t[is_sure], rtol=1e-3)


def test_chains_do_not_make_deep_trees() -> None:
    """Each triangle half as big as the one before: all but one of the nearest are one-sided, yet rounds stay few."""
    count = 3000
    size = 2.0 ** (-np.arange(count) / 30)
    corners = size[:, None, None] * np.array([[[1.0, 0, 0], [1, 0.03, 0], [1, 0, 0.03]]])
    scene = Scene.from_arrays(corners.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3))
    accel = warp_rt.build_accel(scene, bvh="ploc")
    check(accel)
    assert accel.statistics.depth <= 12
    assert accel.stack_size <= 12 * 15 + 2


@pytest.mark.parametrize("bvh", PARALLEL)
def test_many_trees_are_built_at_once(bvh: str) -> None:
    """Of all sizes, a single triangle among them; none takes anything of its neighbours in the arrays."""
    shapes = [soup(1 + i * i % 97, i, 0.05) for i in range(120)]
    matrices = np.tile(np.eye(4), (len(shapes), 1, 1))
    matrices[:, :3, 3] = np.random.default_rng(0).uniform(-20, 20, (len(shapes), 3))
    accel = warp_rt.build_accel(scene_of(shapes, list(range(len(shapes))), matrices), bvh=bvh)
    check(accel)


@pytest.mark.parametrize("bvh", BUILDERS)
def test_refitting_in_place_gives_the_boxes_that_were_built(bvh: str, device: str) -> None:
    """Boxes, children and orders of the same points are those of the build, to the bit."""
    scene = Scene.from_arrays(*uneven(3000, 7))
    accel = warp_rt.build_accel(scene, bvh=bvh, device=device)
    refitted = refit_accel(accel, scene)
    for name in ("nodes", "leaves", "instances"):
        assert getattr(accel.data, name).numpy().tobytes() == getattr(refitted.data, name).numpy().tobytes()
    assert refitted.statistics.sah_cost == pytest.approx(accel.statistics.sah_cost, rel=1e-5)


@pytest.mark.parametrize("bvh", PARALLEL)
def test_every_run_gives_the_same_tree(bvh: str, device: str) -> None:
    """On every device: neither contracts products and sums, and sorts are stable."""
    scene = Scene.from_arrays(*uneven(5000, 8))
    runs = [warp_rt.build_accel(scene, bvh=bvh, device=device).data for _ in range(2)]
    runs.append(warp_rt.build_accel(scene, bvh=bvh, device="cpu", threads=3).data)
    for name in ("nodes", "leaves", "instances"):
        assert len({getattr(run, name).numpy().tobytes() for run in runs}) == 1


@pytest.mark.parametrize("bvh", PARALLEL)
def test_threads_of_a_launch_may_come_in_any_order(bvh: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """No thread reads what another one of its launch writes, nor do two write the same: else order would show.

    What a GPU does at once is done here thread by thread, shuffled, in chunks as small as there.
    """
    shapes = [uneven(300, 10), soup(1, 11), octasphere(2), (np.ones((3, 3)), np.zeros((40, 3), np.int32))]
    matrices = random_matrices(30, 12)
    meshes = [i % len(shapes) for i in range(len(matrices))]
    before, after = (scene_of(some, meshes, matrices) for some in (shapes, [(p * [1, 2, 3], t) for p, t in shapes]))
    expected = warp_rt.build_accel(before, bvh=bvh, threads=1)
    expected = expected, refit_accel(expected, after, threads=1)

    rng = np.random.default_rng(13)
    launches: list[str] = []

    def launch(self: Executor, kernel: wp.Kernel, count: int, inputs: list, outputs: list = (), **_: int) -> None:
        launches.append(kernel.key)
        for thread in rng.permutation(count).tolist():
            wp.launch(kernel, 1, inputs=[*inputs, thread], outputs=list(outputs), device="cpu")

    def launch_uneven(self: Executor, kernel: wp.Kernel, weights: np.ndarray, inputs: list, outputs: list) -> None:
        self.launch(kernel, len(weights), inputs, outputs)

    monkeypatch.setattr(Executor, "launch", launch)
    monkeypatch.setattr(Executor, "launch_uneven", launch_uneven)
    monkeypatch.setattr(jobs, "_CHUNK", jobs._GPU_CHUNK)
    shuffled = warp_rt.build_accel(before, bvh=bvh, threads=1)
    shuffled = shuffled, refit_accel(shuffled, after, threads=1)
    of_builder = {
        "lbvh": {"split_runs", "list_halves", "write_runs"},
        "ploc": {"find_nearest", "join_packets", "join_nodes"},
    }
    assert {"refer_to_triangles", "merge_ranges", "open_nodes", "write_nodes", "refit_nodes", *of_builder[bvh]} <= {
        *launches
    }
    for one, other in zip(expected, shuffled, strict=True):
        for name in ("nodes", "leaves", "instances"):
            assert getattr(one.data, name).numpy().tobytes() == getattr(other.data, name).numpy().tobytes()
        assert one.statistics == other.statistics


@pytest.mark.parametrize("bvh", BUILDERS)
def test_points_that_are_not_numbers_are_refused(bvh: str) -> None:
    points, triangles = soup(100, 9)
    for value in (np.nan, np.inf):
        broken = points.copy()
        broken[17, 1] = value
        with pytest.raises(SceneError, match="finite"):
            warp_rt.build_accel(Scene.from_arrays(broken, triangles), bvh=bvh)


def test_builders_know_where_they_build() -> None:
    assert [builder_device(bvh, "cuda:0") for bvh in BUILDERS] == ["cpu", "cpu", "cpu", "cuda:0", "cuda:0"]
    assert {builder_device(bvh, "cpu") for bvh in BUILDERS} == {"cpu"}


def test_packets_stand_where_the_order_of_clusters_puts_them() -> None:
    """Leaves of a wide tree are packets of at most sixteen triangles, none empty, well filled on a surface."""
    shape = octasphere(5)
    accel = warp_rt.build_accel(Scene.from_arrays(*shape), bvh="ploc")
    sizes = [len(Reader(accel).packet(leaf)[0]) for leaf in range(accel.statistics.leaves)]
    assert max(sizes) <= 16
    assert np.mean(sizes) > 11


@pytest.mark.parametrize("builder", ["sah", "median", "midpoint"])
def test_trees_are_the_same_whether_costs_are_kept_or_not(builder: str) -> None:
    points, triangles = torus()
    executor = Executor("cpu", Workers(2))
    found = []
    for keeps_costs in (True, False):
        corners = executor.upload(triangles.reshape(-1).astype(np.int32), wp.int32)
        counts = np.array([len(triangles)], np.int32)
        references = refer_to_triangles(executor.upload(points.astype(np.float32), wp.vec3), corners, counts, executor)
        trees, roots = build_binary_trees(
            references, leaf_size=1, builder=builder, executor=executor, keeps_costs=keeps_costs
        )
        nodes, shares = trees.nodes.numpy(), trees.shares.numpy()
        todo, shared = [int(roots.numpy()[0])], []
        costs = trees.costs.numpy()[todo[0], : int(WIDTH) - 1]  # the last column is nobody's
        while todo:
            slot = todo.pop()
            shared.append(shares[slot])
            if nodes["right"][slot] >= 0:
                todo += [int(nodes["left"][slot]), int(nodes["right"][slot])]
        found.append((costs, np.array(shared)))
    for kept, lost in zip(*found, strict=True):
        np.testing.assert_array_equal(kept, lost)
