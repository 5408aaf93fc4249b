# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Reinsertion beside brute force: the best place of a subtree is the one that no other beats when all are tried."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
import warp as wp

from warp_rt.bvh import reinsertion
from warp_rt.bvh.collapse import collapse_forest
from warp_rt.bvh.forest import build_binary_trees, refer_to_triangles
from warp_rt.bvh.reinsertion import list_nodes, reinsert_subtrees
from warp_rt.device.jobs import Executor, as_warp
from warp_rt.device.workers import Workers
from warp_rt.kernels.bvh_collapse import evaluate_above
from warp_rt.kernels.bvh_reinsert import Links, find_place
from warp_rt.kernels.bvh_structs import BinaryNode, BinaryTrees
from warp_rt.kernels.constants import REINSERTION_STACK, REINSERTION_VISITS, WIDTH
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

Tree = int | tuple["Tree", "Tree"]
"""A leaf, row of the boxes, or two subtrees."""


@wp.kernel
def find_places(
    nodes: wp.array[BinaryNode],
    links: Links,
    slots: wp.array[int],
    places_out: wp.array[int],
    gains_out: wp.array[float],
    visits_out: wp.array[int],
):
    stack = wp.zeros(shape=(wp.static(2 * REINSERTION_STACK),), dtype=int)
    gains = wp.zeros(shape=(REINSERTION_STACK,), dtype=float)
    place, gain, visits = find_place(nodes, links, slots[wp.tid()], stack, gains)
    places_out[wp.tid()] = place
    gains_out[wp.tid()] = gain
    visits_out[wp.tid()] = visits


def list_all(trees: BinaryTrees, roots: wp.array) -> tuple[Links, wp.array, np.void]:
    """Return the links of trees, the slots of their nodes, and what they add up to."""
    count = trees.nodes.shape[0]
    links = Links()
    links.parents, links.heights = (wp.empty(count, dtype=int, device="cpu") for _ in range(2))
    links.is_stale = wp.empty(count, dtype=wp.bool, device="cpu")
    links.height_limits = wp.empty(len(roots), dtype=int, device="cpu")
    links.roots = roots
    slots = np.empty(count, np.int32)
    listing = list_nodes(trees.nodes, links, slots, Executor("cpu", Workers(1)))
    return links, as_warp(slots[: int(listing["count"])], wp.int32), listing


def search(trees: BinaryTrees, links: Links, slots: wp.array) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return of each node the best place, the gain there, and what was looked at for it."""
    outputs = [wp.empty(len(slots), dtype=dtype, device="cpu") for dtype in (int, float, int)]
    wp.launch(find_places, len(slots), inputs=[trees.nodes, links, slots], outputs=outputs, device="cpu")
    places, gains, visits = (array.numpy() for array in outputs)
    return places, gains, visits


@dataclass
class Forest:
    """Binary trees as kernels take them, a node a slot in preorder."""

    boxes: np.ndarray
    """float32, shape [n, 2, 3]."""
    nodes: list[tuple] = field(default_factory=list)
    subtrees: list[Tree] = field(default_factory=list)
    """By slot."""
    roots: list[int] = field(default_factory=list)

    def plant(self, tree: Tree) -> None:
        self.roots.append(self._add(tree))

    def _add(self, tree: Tree) -> int:
        slot = len(self.nodes)
        box = bounds(tree, self.boxes)
        self.nodes.append(())
        self.subtrees.append(tree)
        if isinstance(tree, int):
            self.nodes[slot] = (box[0], tree, box[1], -1)
        else:
            self.nodes[slot] = (box[0], self._add(tree[0]), box[1], self._add(tree[1]))
        return slot

    def trees(self) -> BinaryTrees:
        count = len(self.nodes)
        trees = BinaryTrees()
        trees.nodes = wp.array(np.array(self.nodes, BinaryNode.numpy_dtype()), dtype=BinaryNode, device="cpu")
        trees.ids = as_warp(np.arange(len(self.boxes), dtype=np.int32), wp.int32)
        trees.costs = as_warp(np.zeros((count, int(WIDTH)), np.float32), wp.float32)
        trees.shares = as_warp(np.zeros((count, int(WIDTH)), np.int8), wp.int8)
        slots = as_warp(np.arange(count, dtype=np.int32), wp.int32)  # parents come before their children
        wp.launch(evaluate_above, 1, inputs=[slots], outputs=[trees], device="cpu")
        return trees


def bounds(tree: Tree, boxes: np.ndarray) -> np.ndarray:
    leaves = boxes[leaves_of(tree)]
    return np.stack([leaves[:, 0].min(axis=0), leaves[:, 1].max(axis=0)])


def leaves_of(tree: Tree) -> list[int]:
    return [tree] if isinstance(tree, int) else leaves_of(tree[0]) + leaves_of(tree[1])


def half_area(box: np.ndarray) -> float:
    x, y, z = (box[1] - box[0]).astype(float)
    return x * y + y * z + z * x


def inner_area(tree: Tree, boxes: np.ndarray) -> float:
    """Return half the area of all inner nodes."""
    if isinstance(tree, int):
        return 0.0
    return half_area(bounds(tree, boxes)) + inner_area(tree[0], boxes) + inner_area(tree[1], boxes)


def without(tree: Tree, part: Tree) -> Tree:
    """Return a tree less one of its subtrees, whose sibling takes their parent's place."""
    if isinstance(tree, int):
        return tree
    if part is tree[0]:
        return tree[1]
    if part is tree[1]:
        return tree[0]
    return without(tree[0], part), without(tree[1], part)


def every_insertion(tree: Tree, part: Tree) -> list[Tree]:
    """Return the trees that come of giving ``part`` each node of a tree as its sibling."""
    here: list[Tree] = [(tree, part)]
    if isinstance(tree, int):
        return here
    here += [(left, tree[1]) for left in every_insertion(tree[0], part)]
    return here + [(tree[0], right) for right in every_insertion(tree[1], part)]


def random_tree(leaves: list[int], rng: np.random.Generator) -> Tree:
    """Return a tree of leaves that are split anywhere, as no builder would."""
    if len(leaves) == 1:
        return leaves[0]
    at = int(rng.integers(1, len(leaves)))
    return random_tree(leaves[:at], rng), random_tree(leaves[at:], rng)


def random_boxes(count: int, rng: np.random.Generator, kind: str = "uneven") -> np.ndarray:
    """Return boxes: float32, shape [n, 2, 3]."""
    low = rng.uniform(0, 1, (count, 3))
    size = 10 ** rng.uniform(-2, -0.3, (count, 3))
    if kind == "points":
        size = np.zeros_like(size)
    elif kind == "equal":
        low, size = np.zeros_like(low), np.ones_like(size)
    elif kind == "huge":  # areas beyond float32
        low, size = 1e25 * low, 1e25 * size
    return np.stack([low, low + size], axis=1).astype(np.float32)


def read(trees: BinaryTrees, root: int) -> Tree:
    """Return a tree that kernels have written."""
    nodes = trees.nodes.numpy()

    def subtree(slot: int) -> Tree:
        node = nodes[slot]
        return int(node["left"]) if node["right"] < 0 else (subtree(node["left"]), subtree(node["right"]))

    return subtree(root)


def check_boxes_and_costs(trees: BinaryTrees, root: int, boxes: np.ndarray) -> None:
    """Each box is the union of its leaves, each cost the least that its children allow (Ylitie et al. 2017)."""
    nodes, costs = trees.nodes.numpy(), trees.costs.numpy()
    todo = [root]
    while todo:
        slot = todo.pop()
        node = nodes[slot]
        box = np.stack([node["low"], node["high"]])
        if node["right"] < 0:
            np.testing.assert_array_equal(box, boxes[node["left"]])
            continue
        left, right = node["left"], node["right"]
        np.testing.assert_array_equal(box[0], np.minimum(nodes["low"][left], nodes["low"][right]))
        np.testing.assert_array_equal(box[1], np.maximum(nodes["high"][left], nodes["high"][right]))
        lanes = int(WIDTH)
        shared = [costs[left, k - 1] + costs[right, lanes - k - 1] for k in range(1, lanes)]
        np.testing.assert_allclose(costs[slot, 0], half_area(box) + min(shared), rtol=1e-6)
        todo += [left, right]


@pytest.mark.parametrize("seed", range(6))
def test_the_place_found_is_the_best_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = random_boxes(14, rng)
    forest = Forest(boxes)
    forest.plant(random_tree(list(range(14)), rng))
    trees, count = forest.trees(), len(forest.nodes)
    links, slots, listing = list_all(trees, wp.array(forest.roots, dtype=int, device="cpu"))
    links.height_limits.fill_(count)
    tree = forest.subtrees[0]
    before = inner_area(tree, boxes)
    assert slots.numpy().tolist() == list(range(count))
    assert listing["count"] == count
    assert listing["area"] == pytest.approx(before, rel=1e-5)

    places, gains, _visits = search(trees, links, slots)
    found = 0
    for slot in range(1, count):
        part = forest.subtrees[slot]
        rest = without(tree, part)
        best = before - min(inner_area(other, boxes) for other in every_insertion(rest, part))
        assert gains[slot] == pytest.approx(max(best, 0), abs=1e-5 * before)
        if places[slot] >= 0:
            found += 1
            place = forest.subtrees[places[slot]]
            assert not set(leaves_of(place)) <= set(leaves_of(part))
    assert places[0] == -1
    assert found > 5


def test_pairs_that_were_torn_apart_find_each_other() -> None:
    """Unit cubes at x = 0, 2 and at x = 100, 102, each pair in two halves: half areas 207 of all, 7 of either pair."""
    low = np.array([[0, 0, 0], [2, 0, 0], [100, 0, 0], [102, 0, 0]], np.float32)
    forest = Forest(np.stack([low, low + 1], axis=1))
    forest.plant(((0, 2), (1, 3)))
    assert inner_area(forest.subtrees[0], forest.boxes) == 207 + 203 + 203
    trees, roots = forest.trees(), wp.array(forest.roots, dtype=int, device="cpu")
    reinsert_subtrees(trees, roots, Executor("cpu", Workers(1)))
    tree = read(trees, int(roots.numpy()[0]))
    assert not isinstance(tree, int)
    assert {frozenset(leaves_of(half)) for half in tree} == {frozenset({0, 1}), frozenset({2, 3})}
    assert inner_area(tree, forest.boxes) == 207 + 7 + 7


@pytest.mark.parametrize("kind", ["uneven", "points", "equal", "huge"])
def test_trees_stay_whole_and_get_no_larger(kind: str) -> None:
    rng = np.random.default_rng(3)
    sizes = [1, 2, 3, 40, 300, 1, 120]
    boxes = random_boxes(sum(sizes), rng, kind)
    forest = Forest(boxes)
    first = 0
    for size in sizes:
        forest.plant(random_tree(list(range(first, first + size)), rng))
        first += size
    planted = [forest.subtrees[root] for root in forest.roots]
    results = []
    for threads in (1, 3):
        trees, roots = forest.trees(), wp.array(forest.roots, dtype=int, device="cpu")
        reinsert_subtrees(trees, roots, Executor("cpu", Workers(threads)))
        results.append((trees.nodes.numpy().copy(), roots.numpy().copy()))
    for a, b in zip(*results, strict=True):
        np.testing.assert_array_equal(a, b)
    for root, tree in zip(roots.numpy().tolist(), planted, strict=True):
        moved = read(trees, root)
        assert sorted(leaves_of(moved)) == sorted(leaves_of(tree))
        if kind != "huge":
            check_boxes_and_costs(trees, root, boxes)
            assert inner_area(moved, boxes) <= inner_area(tree, boxes) * (1 + 1e-5)
    if kind == "uneven":  # random trees are far from what can be had
        assert inner_area(read(trees, int(roots.numpy()[4])), boxes) < 0.6 * inner_area(planted[4], boxes)


def nesting_triangles(kind: str, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return triangles whose boxes lie within or across each other: float32, shape [n, 3, 3]."""
    if kind == "similar, of all sizes":
        corners = np.eye(3) * np.exp2(rng.uniform(-60, 40, count))[:, None, None]
    elif kind == "parallel, within each other":
        corners = np.eye(3) * (1 + np.arange(count) / count)[:, None, None]
    elif kind == "long sticks":
        corners = 1e-3 * rng.random((count, 3, 3))
        half = 5 + rng.random(count)
        corners[:, 0, 0] -= half
        corners[:, 1, 0] += half
    else:
        corners = rng.random((count, 3, 3))
    return corners.astype(np.float32)


@pytest.mark.parametrize("is_forced", [False, True], ids=["as it is", "whatever it promises"])
@pytest.mark.parametrize(
    "kind", ["similar, of all sizes", "parallel, within each other", "long sticks", "big, anywhere"]
)
def test_boxes_within_each_other_make_neither_chains_nor_long_searches(
    kind: str, is_forced: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of such boxes a chain has least area, and the best place could be anywhere."""
    count, leaf_size = 20_000, int(WIDTH)
    points = nesting_triangles(kind, count, np.random.default_rng(1)).reshape(-1, 3)
    executor = Executor("cpu", Workers(1))
    triangles = as_warp(np.arange(3 * count, dtype=np.int32), wp.int32)
    counts = np.array([count], np.int32)

    def build() -> tuple[BinaryTrees, wp.array]:
        references = refer_to_triangles(as_warp(points, wp.vec3), triangles, counts, executor)
        return build_binary_trees(references, leaf_size=leaf_size, builder="sah", executor=executor, keeps_costs=True)

    trees, roots = build()
    before = collapse_forest(trees, roots, 0, executor).layout
    links, slots, _ = list_all(trees, roots)
    height = int(links.heights.numpy()[roots.numpy()[0]])
    _, _, visits = search(trees, links, slots)
    assert visits.max() <= REINSERTION_VISITS
    assert visits.sum() <= 10 * count

    if is_forced:
        monkeypatch.setattr(reinsertion, "_PROMISE", 0.0)
    nodes = trees.nodes.numpy().copy()
    reinsert_subtrees(trees, roots, executor)
    links, slots, _ = list_all(trees, roots)
    assert links.heights.numpy()[roots.numpy()[0]] <= height + 1
    if is_forced:
        assert kind.startswith("parallel") or (trees.nodes.numpy() != nodes)[slots.numpy()].any()
    after = collapse_forest(trees, roots, 0, executor).layout
    slack = 2 if is_forced else 1.5
    assert after.depths[0] <= slack * before.depths[0]
    assert after.stack_sizes[0] <= slack * before.stack_sizes[0]
