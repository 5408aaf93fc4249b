# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Groups of rays against nodes and leaf packets: native functions, their plain twins, and each ray by itself."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.bvh_stack import push_children
from warp_rt.kernels.bvh_structs import InstanceRecord, Stack
from warp_rt.kernels.constants import (
    ALL_RAYS,
    DIRECTION_ROW,
    GROUP,
    GROUP_BOUNDS,
    GROUP_FLOATS,
    GROUP_SPAN,
    LEAF_FLOATS,
    NO_TRIANGLE,
    WIDTH,
)
from warp_rt.kernels.gather_rays import load_group, load_group_plain
from warp_rt.kernels.group_stack import GroupStack, push_children_group, push_children_group_plain
from warp_rt.kernels.group_stack_each import push_children_of_each, push_children_of_each_plain
from warp_rt.kernels.intersect_group import meet_triangles, meet_triangles_plain, set_skips, set_skips_plain
from warp_rt.kernels.ray_group import (
    bound_group,
    bound_group_plain,
    greatest_end,
    group_ray,
    rays_of_first_octant,
    rays_reaching,
)
from warp_rt.kernels.ray_set import count_rays, drop_first, first_ray
from warp_rt.kernels.trace_span import are_scattered, sort_by_octant, sort_by_octant_plain
from warp_rt.kernels.transform_group import transform_group, transform_group_plain
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

COUNT = 2000
ROOM = 2 * WIDTH  # of stacks


@wp.kernel
def compare_loads(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    base: wp.vec3d,
    order: wp.array[int],
    counts: wp.array[int],
    groups_out: wp.array3d[float],
    ends_out: wp.array3d[float],
):
    i = wp.tid()
    load_group(origins, directions, t_max, base, order, i * GROUP, counts[i], groups_out[0, i], 0, ends_out[0, i])
    load_group_plain(origins, directions, t_max, base, order, i * GROUP, counts[i], groups_out[1, i], 0, ends_out[1, i])
    bound_group(groups_out[0, i], 0, ALL_RAYS)
    bound_group_plain(groups_out[1, i], 0, ALL_RAYS)


@wp.kernel
def compare_transforms(
    instances: wp.array[InstanceRecord],
    rays: wp.array[wp.uint32],
    groups_out: wp.array3d[float],
    together_out: wp.array2d[wp.uint32],
):
    i = wp.tid()
    together_out[0, i] = transform_group(instances, i, groups_out[0, i], rays[i])
    together_out[1, i] = transform_group_plain(instances, i, groups_out[1, i], rays[i])
    for twin in range(2):
        if together_out[twin, i] != wp.uint32(0):
            together_out[twin, i] = rays_of_first_octant(groups_out[twin, i], GROUP_FLOATS, together_out[twin, i])
    if together_out[0, i] != wp.uint32(0):
        bound_group(groups_out[0, i], GROUP_FLOATS, together_out[0, i])
        bound_group_plain(groups_out[1, i], GROUP_FLOATS, together_out[0, i])


@wp.kernel
def list_reaching(
    ends: wp.array2d[float], t: wp.array[float], rays: wp.array[wp.uint32], reaching_out: wp.array[wp.uint32]
):
    i = wp.tid()
    reaching_out[i] = rays_reaching(ends[i], t[i], rays[i])


@wp.kernel
def compare_boxes(
    nodes: wp.array[float],
    leaves: wp.array[float],
    groups: wp.array2d[float],
    ends: wp.array2d[float],
    rays: wp.array[wp.uint32],
    tops_out: wp.array2d[int],
    codes_out: wp.array3d[int],
    distances_out: wp.array3d[float],
    rays_out: wp.array3d[wp.uint32],
    alone_tops_out: wp.array2d[int],
    alone_codes_out: wp.array3d[int],
    alone_distances_out: wp.array3d[float],
):
    i = wp.tid()
    t_end = greatest_end(ends[i])
    for twin in range(4):
        stack = GroupStack()
        stack.codes = codes_out[twin, i]
        stack.distances = distances_out[twin, i]
        stack.rays = rays_out[twin, i]
        if twin == 0:
            tops_out[0, i] = push_children_group(nodes, leaves, i, groups[i], 0, rays[i], ends[i], t_end, stack, 0)
        elif twin == 1:
            tops_out[1, i] = push_children_group_plain(
                nodes, leaves, i, groups[i], 0, rays[i], ends[i], t_end, stack, 0
            )
        elif rays[i] != wp.uint32(0):
            if twin == 2:
                tops_out[2, i] = push_children_of_each(nodes, i, groups[i], 0, rays[i], ends[i], stack, 0)
            else:
                tops_out[3, i] = push_children_of_each_plain(nodes, i, groups[i], 0, rays[i], ends[i], stack, 0)
    for index in range(wp.int32(GROUP)):
        alone = Stack()
        alone.codes = alone_codes_out[i, index]
        alone.distances = alone_distances_out[i, index]
        ray = group_ray(groups[i], 0, index)
        alone_tops_out[i, index] = push_children(nodes, i, ray, ends[i, index], alone, 0)


@wp.kernel
def compare_triangles(
    leaves: wp.array[float],
    groups: wp.array2d[float],
    rays: wp.array[wp.uint32],
    senders: wp.array2d[int],
    triangles: wp.array2d[int],
    skips_out: wp.array3d[int],
    hits_out: wp.array2d[wp.uint32],
    tuv_out: wp.array4d[float],
    words_out: wp.array3d[int],
):
    i = wp.tid()
    t, u, v, words, skips = tuv_out[0, i, 0], tuv_out[0, i, 1], tuv_out[0, i, 2], words_out[0, i], skips_out[0, i]
    set_skips(senders[i], triangles[i], 1, skips)
    hits_out[0, i] = meet_triangles(leaves, i, groups[i], 0, rays[i], skips, t, u, v, words)
    t, u, v, words, skips = tuv_out[1, i, 0], tuv_out[1, i, 1], tuv_out[1, i, 2], words_out[1, i], skips_out[1, i]
    set_skips_plain(senders[i], triangles[i], 1, skips)
    hits_out[1, i] = meet_triangles_plain(leaves, i, groups[i], 0, rays[i], skips, t, u, v, words)


@wp.kernel
def compare_sorts(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    sorted: wp.array[int],
    first: int,
    count: int,
    orders_out: wp.array2d[int],
    sizes_out: wp.array2d[int],
    scattered_out: wp.array[wp.bool],
):
    sort_by_octant(origins, directions, sorted, first, count, orders_out[0], sizes_out[0])
    sort_by_octant_plain(origins, directions, sorted, first, count, orders_out[1], sizes_out[1])
    scattered_out[0] = are_scattered(origins, first, count)


@wp.kernel
def list_sets(
    sets: wp.array[wp.uint32], first_out: wp.array[int], count_out: wp.array[int], rest_out: wp.array[wp.uint32]
):
    i = wp.tid()
    first_out[i] = first_ray(sets[i])
    count_out[i] = count_rays(sets[i])
    rest_out[i] = drop_first(sets[i])


def launch(kernel: wp.Kernel, count: int, inputs: list, outputs: list[wp.array], device: str) -> list[np.ndarray]:
    wp.launch(kernel, count, inputs=inputs, outputs=outputs, device=device)
    return [array.numpy() for array in outputs]


def random_groups(
    rng: np.random.Generator, device: str, base: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> tuple[wp.array, wp.array, np.ndarray, list[np.ndarray]]:
    """Return loaded groups and ends, their sizes, and all that was loaded, native and plain.

    Rays that follow each other in memory, and others. Narrow and wide groups, each of one octant; some rays along axes,
    some on planes of integer coordinates.
    """
    width = rng.choice([0, 0.01, 1.0], (COUNT, 1, 1))
    origins = rng.uniform(-2, 2, (COUNT, 1, 3)) + width * rng.normal(size=(COUNT, GROUP, 3))
    origins = np.where(rng.uniform(size=(COUNT, 1, 1)) < 0.3, np.round(origins), origins)
    directions = np.abs(0.5 * rng.normal(size=(COUNT, 1, 3)) - origins[:, :1])
    directions = np.abs(directions + width * rng.normal(size=origins.shape)) + 1e-38
    directions = np.where(rng.uniform(size=origins.shape) < 0.2, 1e-38, directions)
    directions *= np.where(origins[:, :1] > 0, -1.0, 1.0)
    ends = rng.choice([np.inf, 2.0, 0.3, -1.0, np.nan], COUNT * GROUP, p=[0.5, 0.3, 0.1, 0.05, 0.05])
    order = np.concatenate([(rng.permutation(GROUP) if i % 2 else np.arange(GROUP)) + i * GROUP for i in range(COUNT)])
    counts = rng.choice([1, 5, GROUP - 1, GROUP], COUNT)
    inputs = [wp.array(v.reshape(-1, 3), dtype=wp.vec3, device=device) for v in (origins, directions)]
    inputs += [wp.array(ends, dtype=float, device=device), wp.vec3d(*base)]
    inputs += [wp.array(v, dtype=int, device=device) for v in (order, counts)]
    outputs = [wp.zeros((2, COUNT, n), dtype=float, device=device) for n in (GROUP_FLOATS, GROUP)]
    groups, loaded_ends = launch(compare_loads, COUNT, inputs, outputs, device)
    return outputs[0][0], outputs[1][0], counts, [groups, loaded_ends]


def random_sets(rng: np.random.Generator, counts: np.ndarray) -> np.ndarray:
    """Return sets of the rays of groups: all of them, or some."""
    some = rng.integers(0, 2**32, COUNT, dtype=np.uint32) | rng.choice([0, 2**32 - 1], COUNT).astype(np.uint32)
    return some & (np.uint32(2**32 - 1) >> (GROUP - counts).astype(np.uint32))


def test_groups_are_loaded(device: str) -> None:
    _, _, counts, (groups, ends) = random_groups(np.random.default_rng(1), device)
    rows = slice(0, GROUP_BOUNDS)
    np.testing.assert_array_equal(groups[0][:, rows].view(np.int32), groups[1][:, rows].view(np.int32))
    np.testing.assert_array_equal(groups[0][:, GROUP_BOUNDS:], groups[1][:, GROUP_BOUNDS:])
    np.testing.assert_array_equal(ends[0], ends[1])
    assert (ends[0][np.arange(GROUP) >= counts[:, None]] == -1).all()
    inverse = groups[0][:, 96:192]
    assert np.isfinite(inverse).all()
    assert (inverse != 0).all()


def test_groups_are_loaded_relative_to_a_point(device: str) -> None:
    """Rounded once, after a subtraction in float64."""
    base = (1000.1, -3e7, 0.3)
    _, _, _, (here, _) = random_groups(np.random.default_rng(1), device)
    _, _, _, (moved, _) = random_groups(np.random.default_rng(1), device, base)
    for axis, offset in enumerate(base):
        origins = here[0][:, axis * GROUP : (axis + 1) * GROUP].astype(float)
        for twin in moved:
            np.testing.assert_array_equal(
                twin[:, axis * GROUP : (axis + 1) * GROUP], (origins - offset).astype(np.float32)
            )
    np.testing.assert_array_equal(here[0][:, 3 * GROUP : 6 * GROUP], moved[0][:, 3 * GROUP : 6 * GROUP])


def test_groups_enter_instances(device: str) -> None:
    rng = np.random.default_rng(7)
    loaded, _, counts, _ = random_groups(rng, device)
    groups = np.zeros((2, COUNT, 2 * GROUP_FLOATS), np.float32)
    groups[:, :, :GROUP_FLOATS] = loaded.numpy()
    far = rng.integers(0, COUNT, 20)  # origins that a transform takes beyond float32, some rays of each group
    groups[:, far, : GROUP // 2] = 1e38
    rows = np.concatenate([np.linalg.qr(rng.normal(size=(COUNT, 3, 3)))[0], rng.normal(size=(COUNT, 3, 1))], axis=2)
    rows *= rng.choice([1.0, 1e-3, 30.0], (COUNT, 1, 1))
    turned = rng.uniform(size=COUNT) < 0.2  # by right angles: zeros in the matrix
    rows[turned, :, :3] = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], (turned.sum(), 1, 3))
    records = np.zeros(COUNT, InstanceRecord.numpy_dtype())
    for row, name in enumerate(("row_x", "row_y", "row_z")):
        records[name] = rows[:, row]
    sets = random_sets(rng, counts)
    transformed, together = launch(
        compare_transforms,
        COUNT,
        [wp.array(records, dtype=InstanceRecord, device=device), wp.array(sets, device=device)],
        [wp.array(groups, dtype=float, device=device), wp.zeros((2, COUNT), dtype=wp.uint32, device=device)],
        device,
    )
    np.testing.assert_array_equal(together[0], together[1])
    np.testing.assert_array_equal(transformed[0], transformed[1])
    np.testing.assert_array_equal(transformed[0, :, :GROUP_FLOATS], groups[0, :, :GROUP_FLOATS])
    # what the sets hold, and the bounds of their rays, from the transformed origins and directions themselves
    words = transformed[0, :, GROUP_FLOATS:]
    origins, directions = (
        words[:, row * GROUP : (row + 3) * GROUP].reshape(COUNT, 3, GROUP) for row in (0, DIRECTION_ROW)
    )
    before = groups[0, :, : 3 * GROUP].reshape(COUNT, 3, GROUP).astype(float)
    expected = np.einsum("nij,njr->nir", rows[:, :, :3], before) + rows[:, :, 3:]
    near = np.isfinite(origins)
    np.testing.assert_allclose(origins[near], expected[near], rtol=1e-4, atol=1e-3)
    with np.errstate(invalid="ignore"):
        is_finite = np.isfinite(origins.sum(axis=1) + directions.sum(axis=1))
    octants = np.einsum("nir,i->nr", directions < 0, [1, 2, 4])
    is_in = (sets[:, None] >> np.arange(GROUP, dtype=np.uint32) & 1).astype(bool) & is_finite
    first = is_in.argmax(axis=1)
    is_in &= octants == octants[np.arange(COUNT), first][:, None]
    np.testing.assert_array_equal(together[0], (is_in.astype(np.uint64) << np.arange(GROUP, dtype=np.uint64)).sum(1))
    assert 0.1 < (together[0] != sets).mean() < 0.9
    low, high = (limit(origins, is_in[:, None]) for limit in (least, greatest))
    some = is_in.any(axis=1)
    bounds = words[:, GROUP_BOUNDS:].reshape(COUNT, 4, 3)
    np.testing.assert_array_equal(np.minimum(bounds[some, 0], bounds[some, 1]), low[some])
    np.testing.assert_array_equal(np.maximum(bounds[some, 0], bounds[some, 1]), high[some])


def least(values: np.ndarray, where: np.ndarray) -> np.ndarray:
    return np.where(where, values, np.inf).min(axis=2)


def greatest(values: np.ndarray, where: np.ndarray) -> np.ndarray:
    return np.where(where, values, -np.inf).max(axis=2)


def test_rays_that_have_ended_before(device: str) -> None:
    rng = np.random.default_rng(8)
    ends = rng.choice(np.float32([-1, 0, 1, 2, np.inf]), (COUNT, GROUP))
    t = rng.choice(np.float32([0, 1, 1.5, 3]), COUNT)
    sets = random_sets(rng, np.full(COUNT, GROUP))
    inputs = [wp.array(ends, dtype=float, device=device), wp.array(t, dtype=float, device=device)]
    inputs += [wp.array(sets, device=device)]
    (reaching,) = launch(list_reaching, COUNT, inputs, [wp.zeros(COUNT, dtype=wp.uint32, device=device)], device)
    bits = ((ends >= t[:, None]).astype(np.uint64) << np.arange(GROUP, dtype=np.uint64)).sum(axis=1)
    np.testing.assert_array_equal(reaching, bits & sets)


def test_boxes(device: str) -> None:
    rng = np.random.default_rng(2)
    groups, ends, counts, _ = random_groups(rng, device)
    corners = rng.uniform(-2, 2, (COUNT, 2, 3, WIDTH))
    corners = np.where(rng.uniform(size=(COUNT, 1, 1, 1)) < 0.3, np.round(corners), corners)
    nodes = np.zeros((COUNT, 8 * WIDTH), np.float32)
    nodes[:, : 3 * WIDTH] = corners.min(axis=1).reshape(COUNT, -1)
    nodes[:, 3 * WIDTH : 6 * WIDTH] = corners.max(axis=1).reshape(COUNT, -1)
    empty = np.tile(rng.uniform(size=(COUNT, WIDTH)) < 0.2, (1, 3))
    nodes[:, : 3 * WIDTH][empty], nodes[:, 3 * WIDTH : 6 * WIDTH][empty] = np.inf, -np.inf
    nodes[:, 6 * WIDTH : 7 * WIDTH] = np.arange(WIDTH, dtype=np.int32).view(
        np.float32
    )  # each lane's code is its number
    lanes = np.argsort(rng.uniform(size=(COUNT, 8, WIDTH)), axis=-1).astype(np.uint64)
    words = (lanes.reshape(COUNT, 8, 8, 2) << (4 * np.arange(8, dtype=np.uint64))[:, None]).sum(axis=2)
    nodes[:, 7 * WIDTH :] = words.astype(np.uint32).view(np.float32).reshape(COUNT, WIDTH)
    sets = random_sets(rng, counts)
    shapes = [((4, COUNT), int), ((4, COUNT, ROOM), int), ((4, COUNT, ROOM), float), ((4, COUNT, ROOM), wp.uint32)]
    shapes += [((COUNT, GROUP), int), ((COUNT, GROUP, ROOM), int), ((COUNT, GROUP, ROOM), float)]
    tops, codes, distances, rays, alone_tops, alone_codes, alone_distances = launch(
        compare_boxes,
        COUNT,
        [
            wp.array(nodes.reshape(-1), dtype=float, device=device),
            wp.zeros(LEAF_FLOATS, dtype=float, device=device),
            groups,
            ends,
            wp.array(sets, device=device),
        ],
        [wp.zeros(shape, dtype=dtype, device=device) for shape, dtype in shapes],
        device,
    )
    used = np.arange(ROOM) < tops[0][:, None]
    assert 0.05 < used.mean() < 0.6
    for twin in range(1, 4):
        np.testing.assert_array_equal(tops[twin], tops[0])
        np.testing.assert_array_equal(codes[twin][used], codes[0][used])
        np.testing.assert_array_equal(rays[twin][used], rays[0][used])
    np.testing.assert_array_equal(distances[1][used], distances[0][used])
    np.testing.assert_array_equal(distances[3][used], distances[2][used])
    # what single rays find, in the same order: each child that one of the set meets, with all of those
    for i in range(COUNT):
        pushed = codes[0, i, : tops[0, i]].tolist()
        bounds = dict(zip(pushed, distances[0, i].tolist(), strict=False))
        nearest = dict(zip(pushed, distances[2, i].tolist(), strict=False))
        found: dict[int, int] = {}
        least_t: dict[int, float] = {}
        for index in np.flatnonzero(sets[i] >> np.arange(GROUP, dtype=np.uint32) & 1):
            mine = alone_codes[i, index, : alone_tops[i, index]].tolist()
            assert [code for code in pushed if code in mine] == mine
            for code, t in zip(mine, alone_distances[i, index].tolist(), strict=False):
                found[code] = found.get(code, 0) | 1 << int(index)
                least_t[code] = min(least_t.get(code, np.inf), t)
                assert bounds[code] <= t
        assert found == dict(zip(pushed, rays[0, i].tolist(), strict=False))
        assert least_t == nearest


def test_triangles(device: str) -> None:
    rng = np.random.default_rng(3)
    groups, ends, counts, _ = random_groups(rng, device)
    leaves = np.zeros((COUNT, 10 * WIDTH), np.float32)
    center = rng.uniform(-1.5, 1.5, (COUNT, 1, 3, WIDTH))
    leaves[:, : 9 * WIDTH] = (center + rng.normal(size=(COUNT, 3, 3, WIDTH))).reshape(COUNT, -1)
    empty = np.arange(WIDTH) >= rng.integers(1, WIDTH + 1, (COUNT, 1))
    leaves[:, : 9 * WIDTH][np.tile(empty, (1, 9))] = np.nan
    leaves.view(np.int32)[:, 9 * WIDTH :] = np.where(empty, -1, np.arange(WIDTH))
    sets = random_sets(rng, counts)
    senders, triangles = rng.integers(-1, 2, (COUNT, GROUP)), rng.integers(0, WIDTH, (COUNT, GROUP))
    tuv = np.zeros((2, COUNT, 3, GROUP), np.float32)
    tuv[:, :, 0] = ends.numpy()
    arrays = [wp.array(leaves.reshape(-1), dtype=float, device=device), groups, wp.array(sets, device=device)]
    arrays += [wp.array(values, dtype=int, device=device) for values in (senders, triangles)]
    skips, hits, tuv, words = launch(
        compare_triangles,
        COUNT,
        arrays,
        [
            wp.zeros((2, COUNT, GROUP), dtype=int, device=device),
            wp.zeros((2, COUNT), dtype=wp.uint32, device=device),
            wp.array(tuv, dtype=float, device=device),
            wp.zeros((2, COUNT, GROUP), dtype=int, device=device),
        ],
        device,
    )
    np.testing.assert_array_equal(hits[0], hits[1])
    np.testing.assert_array_equal(tuv[0], tuv[1])
    np.testing.assert_array_equal(words[0], words[1])
    np.testing.assert_array_equal(skips, np.broadcast_to(np.where(senders == 1, triangles, NO_TRIANGLE), skips.shape))
    assert not (hits[0] & ~sets).any()
    is_hit = (hits[0][:, None] >> np.arange(GROUP) & 1).astype(bool)
    met = words[0] - LEAF_FLOATS * np.arange(COUNT)[:, None] - 9 * WIDTH
    assert not (is_hit & (met == skips[0])).any()
    assert (is_hit & (met == triangles) & (senders != 1)).any()
    share = np.bitwise_count(hits[0]).sum() / np.bitwise_count(sets).sum()
    assert 0.1 < share < 0.9


@pytest.mark.parametrize("is_sorted", [False, True])
def test_rays_are_listed_by_octant(device: str, is_sorted: bool) -> None:
    rng = np.random.default_rng(4)
    first, count = 7, GROUP_SPAN - 30
    origins = rng.normal(size=(GROUP_SPAN, 3)).astype(np.float32)
    directions = rng.normal(size=(GROUP_SPAN, 3)).astype(np.float32)
    directions[rng.uniform(size=directions.shape) < 0.1] = 0
    directions[rng.uniform(size=directions.shape) < 0.01] = np.nan
    origins[rng.uniform(size=origins.shape) < 0.01] = np.inf
    arrays = [wp.array(v, dtype=wp.vec3, device=device) for v in (origins, directions)]
    outputs = [wp.zeros(shape, dtype=int, device=device) for shape in ((2, 9 * GROUP_SPAN), (2, 9))]
    outputs += [wp.zeros(1, dtype=wp.bool, device=device)]
    taken = rng.permutation(GROUP_SPAN) if is_sorted else np.arange(GROUP_SPAN)
    arrays.append(wp.array(taken if is_sorted else [], dtype=int, device=device))
    orders, sizes, _ = launch(compare_sorts, 1, [*arrays, first, count], outputs, device)
    np.testing.assert_array_equal(orders[0], orders[1])
    np.testing.assert_array_equal(sizes[0], sizes[1])
    octant = (directions < 0) @ [1, 2, 4]
    octant[~np.isfinite(origins + directions).all(axis=1)] = 8
    for row in range(9):
        rays = taken[first : first + count]
        expected = rays[octant[rays] == row]
        np.testing.assert_array_equal(orders[0][row * GROUP_SPAN :][: sizes[0][row]], expected)
    assert sizes[0].sum() == count


def test_scattered_rays_are_told_from_those_of_pixels(device: str) -> None:
    rng = np.random.default_rng(5)
    y, x = np.divmod(np.arange(GROUP_SPAN), 8)
    tiles = np.stack([8 * (y // 8) + x, y % 8, 0.1 * rng.normal(size=GROUP_SPAN)], axis=1)
    sets = {
        "an eye": (np.zeros((GROUP_SPAN, 3)), False),
        "tiles": (tiles, False),
        "a line": (np.linspace(0, 1, 3 * GROUP_SPAN).reshape(-1, 3), False),
        "a box": (rng.uniform(size=(GROUP_SPAN, 3)), True),
        "a sphere": (rng.normal(size=(GROUP_SPAN, 3)), True),
    }
    for name, (origins, expected) in sets.items():
        arrays = [wp.array(origins, dtype=wp.vec3, device=device)] * 2 + [wp.zeros(0, dtype=int, device=device)]
        outputs = [wp.zeros(shape, dtype=int, device=device) for shape in ((2, 9 * GROUP_SPAN), (2, 9))]
        outputs += [wp.zeros(1, dtype=wp.bool, device=device)]
        _, _, is_scattered = launch(compare_sorts, 1, [*arrays, 0, GROUP_SPAN], outputs, device)
        assert is_scattered[0] == expected, name


def test_sets(device: str) -> None:
    sets = np.random.default_rng(6).integers(1, 2**32, 500, dtype=np.uint32)
    sets[:32] = 1 << np.arange(32, dtype=np.uint32)
    outputs = [wp.zeros(len(sets), dtype=dtype, device=device) for dtype in (int, int, wp.uint32)]
    first, count, rest = launch(list_sets, len(sets), [wp.array(sets, device=device)], outputs, device)
    np.testing.assert_array_equal(first, [(int(s) & -int(s)).bit_length() - 1 for s in sets])
    np.testing.assert_array_equal(count, np.bitwise_count(sets))
    np.testing.assert_array_equal(rest, [int(s) & (int(s) - 1) for s in sets])
