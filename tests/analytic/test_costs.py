# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""AOVs of costs: trees of known size, sums that equal the counters, traversals counted anew in NumPy."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from warp_rt import Film, Renderer, RenderOptions, Scene
from warp_rt.kernels.constants import LEAF_FLOATS, LEAF_IDS, NODE_CHILDREN, NODE_FLOATS, WIDTH
from warp_rt.options import BUILDERS, COSTS
from warp_rt.scene import Camera, LightKind

from ..meshes import octasphere, soup
from .scenes import Body, box, distant, lamp, looking, parallel, preview, render, scene_of, square, whitted
from .test_ray_counts import mirror_box, split_tree

AOVS = ("color", *COSTS)


@pytest.mark.parametrize("depth", [1, 2, 3, 8, 11])
def test_size_of_a_tree_that_doubles(depth: int) -> None:
    """One node and its children: 2^floor(d / 2) nodes at depth d."""
    scene, camera = split_tree()
    film = render(scene, camera, depth=depth, aovs=AOVS)
    size = sum(2 ** (d // 2) for d in range(1, depth + 1))
    assert [int(film.aovs[name][0, 0]) for name in ("treeSize", "rays", "deepest")] == [size, size, depth]


def test_a_node_and_its_children() -> None:
    """A pane that also mirrors, alone in the world: the eye ray, its reflection, its refraction, two lamps' rays."""
    pane = square(whitted(diffuse=0.5, reflection=0.5, transmission=0.5))
    scene = scene_of(pane, lights=[lamp(LightKind.POINT, (x, 0.2, 3.0)) for x in (0.0, 1.0)])
    film = render(scene, parallel((0.3, 0.1, 2.0)), depth=7, aovs=AOVS)
    assert [int(film.aovs[name][0, 0]) for name in ("treeSize", "deepest", "rays")] == [1 + 2, 2, 1 + 2 + 2]


def test_a_pass_through_is_no_bounce() -> None:
    """Straight through two cut-outs onto a wall: one node, at depth 1."""
    hole = preview(opacity=0.0, opacity_threshold=0.5)
    scene = scene_of(square(hole, z=2.0), square(hole, z=1.0), square(whitted(diffuse=1.0)))
    film = render(scene, parallel((0.3, 0.1, 5.0)), aovs=AOVS)
    assert film.rays.passed == 2
    assert [int(film.aovs[name][0, 0]) for name in ("treeSize", "deepest")] == [1, 1]


@pytest.mark.parametrize("lights", [1, 3])
def test_box_of_mirrors(lights: int) -> None:
    scene, camera = mirror_box(lights)
    film = render(scene, camera, width=8, height=6, depth=9, spp=4, aovs=AOVS)
    assert (film.aovs["treeSize"] == 4 * 9).all()
    assert (film.aovs["rays"] == 4 * 9 * (1 + lights)).all()
    assert (film.aovs["deepest"] == 9).all()


# --- a scene with everything: instances, glass, mirrors, shadows


def glass_and_mirrors() -> tuple[Scene, Camera]:
    """Return a glass ball, a mirror ball, a floor and two lamps, and a camera before them."""
    points, faces = octasphere(3)
    glass = whitted(reflection=0.2, transmission=0.7, diffuse=0.1, ior=1.5)
    silver = whitted(reflection=0.8, diffuse=0.2)
    moved = np.eye(4)
    moved[:3, 3] = (-1.2, 0.8, 0.5)
    scene = scene_of(
        Body(points, faces, glass, normals=points),
        Body(points, faces, silver, world_from_local=moved),
        square(whitted(diffuse=0.7, reflection=0.1), z=-1.0),
        lights=[distant((0.3, 0.2, -1.0)), lamp(LightKind.POINT, (2.0, -2.0, 3.0))],
    )
    camera = Camera("/eye", looking((0.0, 1.0, -0.4), (0.2, -4.0, 1.5)), (-0.6, 0.6, -0.4, 0.4), is_perspective=True)
    return scene, camera


def costs_of(**options: object) -> Film:
    scene, camera = glass_and_mirrors()
    return render(scene, camera, **({"width": 48, "height": 32, "depth": 6, "aovs": AOVS} | options))


@pytest.mark.parametrize("spp", [1, 3])
@pytest.mark.parametrize("shadows", ["opaque", "transmit"])
def test_sums_are_the_counters(spp: int, shadows: str) -> None:
    film = costs_of(spp=spp, shadows=shadows, threshold=0.01)
    assert film.aovs["rays"].sum() == film.rays.total
    assert film.aovs["treeSize"].sum() == sum(level.nodes for level in film.rays.per_depth)
    assert film.aovs["deepest"].max() == film.rays.deepest
    for name in COSTS:
        assert film.aovs[name].dtype == np.int32
        assert film.aovs[name].shape == (32, 48)


def test_counting_changes_nothing() -> None:
    counted, plain = costs_of(spp=2), costs_of(spp=2, aovs=("color",))
    np.testing.assert_array_equal(counted.color, plain.color)
    assert counted.rays == plain.rays


@pytest.mark.parametrize("options", [{"tile_size": 5}, {"threads": 1}, {"threads": 3}])
def test_costs_do_not_depend_on_who_counts(options: dict[str, int]) -> None:
    one, other = costs_of(), costs_of(**options)
    for name in COSTS:
        np.testing.assert_array_equal(one.aovs[name], other.aovs[name])


def test_costs_of_a_crop_are_those_of_the_whole() -> None:
    whole, part = costs_of(spp=2), costs_of(spp=2, crop=(10, 8, 20, 12))
    for name in COSTS:
        np.testing.assert_array_equal(part.aovs[name], whole.aovs[name][8:20, 10:30])


def test_costs_come_without_a_picture() -> None:
    """Each AOV alone, and the same."""
    whole = costs_of()
    for name in COSTS:
        np.testing.assert_array_equal(costs_of(aovs=(name,)).aovs[name], whole.aovs[name])


# --- traversals, counted anew


def test_one_leaf_is_tested_whole() -> None:
    """A single mesh of few triangles has no node, only its leaf: every eye ray is tested against every triangle."""
    scene = scene_of(box(whitted(ambient=1.0), (-1, -1, -1), (1, 1, 1)), ambient=(1, 1, 1))
    few = dataclasses.replace(scene.meshes[0], triangles=scene.meshes[0].triangles[:5])
    film = render(
        dataclasses.replace(scene, meshes=(few,)), parallel((0, 0, 5), half=3.0), width=9, height=7, depth=1, aovs=AOVS
    )
    assert (film.aovs["nodesVisited"] == 0).all()
    assert (film.aovs["triangleTests"] == 5).all()


def visits(nodes: np.ndarray, leaves: np.ndarray, root: int, ray: tuple[np.ndarray, np.ndarray]) -> tuple[int, int]:
    """Return how many nodes, and triangles in leaves, a ray comes to that meets nothing: float64, no order needed."""
    origin, direction = ray
    with np.errstate(divide="ignore"):
        inverse = 1.0 / direction
    node_count, triangle_count, waiting = 0, 0, [root]
    while waiting:
        code = waiting.pop()
        if code < 0:
            first = (-1 - code) * int(LEAF_FLOATS) + int(LEAF_IDS)
            triangle_count += int((leaves[first : first + int(WIDTH)].view(np.int32) >= 0).sum())
            continue
        node_count += 1
        words = nodes[code * int(NODE_FLOATS) :]
        planes = words[: 6 * int(WIDTH)].reshape(2, 3, int(WIDTH)).astype(float)
        with np.errstate(invalid="ignore"):
            t = (planes - origin[:, None]) * inverse[:, None]
        enter = np.fmax(np.fmin(t[0], t[1]).max(axis=0), 0.0)
        leave = np.fmax(t[0], t[1]).min(axis=0)
        children = words[int(NODE_CHILDREN) : int(NODE_CHILDREN) + int(WIDTH)].view(np.int32)
        is_there = planes[0, 0] <= planes[1, 0]
        waiting += children[is_there & (enter <= leave)].tolist()
    return node_count, triangle_count


@pytest.mark.parametrize("bvh", BUILDERS)
def test_rays_that_meet_nothing_visit_every_box_on_their_way(bvh: str) -> None:
    """Nothing cuts such a ray short, so that order plays no part: its visits are the boxes it passes through."""
    scene = scene_of(Body(*soup(400, seed=5, size=0.025), whitted(ambient=1.0)), ambient=(1, 1, 1))
    width = 24
    options = RenderOptions(width=width, height=width, depth=1, aovs=("depth", *COSTS), bvh=bvh)
    renderer = Renderer(scene, options, device="cpu")
    film = renderer.render(camera=parallel((0.5, 0.5, 5.0), half=0.6))
    data = renderer.accel.data
    nodes, leaves = data.nodes.numpy(), data.leaves.numpy()
    missed = np.argwhere(np.isinf(film.aovs["depth"]))
    assert len(missed) > width * width / 4
    equal = 0
    for row, column in missed:
        at = 1.2 * (column + 0.5) / width - 0.1, 1.1 - 1.2 * (row + 0.5) / width, 5.0
        ray = np.array(at) - renderer.accel.origin, np.array([0.0, 0.0, -1.0])
        expected = visits(nodes, leaves, data.root, ray)
        found = tuple(int(film.aovs[name][row, column]) for name in ("nodesVisited", "triangleTests"))
        equal += found == expected
        assert found >= expected  # the renderer's boxes are conservative by a few units in the last place
    assert equal >= 0.99 * len(missed)
    assert film.aovs["triangleTests"].sum() > len(missed)


def test_an_early_hit_saves_tests() -> None:
    """Towards a wall of many triangles, a ray is tested against few of them, and a shadow ray ends at its first hit."""
    points, faces = octasphere(5)
    scene = scene_of(Body(points, faces, whitted(ambient=1.0)), ambient=(1, 1, 1))
    film = render(scene, parallel((0, 0, 5), half=0.5), width=16, height=16, depth=1, aovs=AOVS)
    assert len(faces) == 8 * 4**5
    assert film.aovs["triangleTests"].mean() < 0.01 * len(faces)
    assert (film.aovs["triangleTests"] >= 1).all()
    assert (film.aovs["nodesVisited"] >= 2).all()
