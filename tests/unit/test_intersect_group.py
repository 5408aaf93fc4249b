# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A group of rays against the boxes of a node: the native test against its plain twin and against each single ray."""

import numpy as np
import warp as wp

from warp_rt.kernels.bvh_stack import push_children
from warp_rt.kernels.bvh_structs import Stack
from warp_rt.kernels.constants import GROUP, GROUP_RAY_FLOATS, WIDTH
from warp_rt.kernels.intersect_group import (
    bound_group,
    bound_group_plain,
    greatest_end,
    intersect_boxes_group,
    intersect_boxes_group_plain,
)
from warp_rt.kernels.intersect_packet import make_packet_ray
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

COUNT = 3000


@wp.kernel
def compare_groups(
    nodes: wp.array[float],
    origins: wp.array2d[wp.vec3],
    directions: wp.array2d[wp.vec3],
    ends: wp.array2d[float],
    active: wp.array[wp.uint32],
    words_out: wp.array3d[float],
    met_out: wp.array2d[int],
    masks_out: wp.array3d[wp.uint32],
    distances_out: wp.array3d[float],
    alone_out: wp.array2d[wp.uint32],
    alone_distances_out: wp.array3d[float],
    codes_out: wp.array2d[int],
    entries_out: wp.array2d[float],
    greatest_out: wp.array[float],
):
    i = wp.tid()
    for ray in range(wp.int32(GROUP)):
        one = make_packet_ray(origins[i, ray], directions[i, ray])
        for axis in range(3):
            for copy in range(2):
                words_out[copy, i, axis * GROUP + ray] = one.origin[axis]
                words_out[copy, i, (3 + axis) * GROUP + ray] = one.inverse[axis]
    bound_group(words_out[0, i], 0)
    bound_group_plain(words_out[1, i], 0)
    t_end = greatest_end(ends[i])
    greatest_out[i] = t_end
    met_out[0, i] = intersect_boxes_group(
        nodes, i, words_out[0, i], 0, active[i], ends[i], t_end, distances_out[0, i], masks_out[0, i]
    )
    met_out[1, i] = intersect_boxes_group_plain(
        nodes, i, words_out[1, i], 0, active[i], ends[i], t_end, distances_out[1, i], masks_out[1, i]
    )
    for ray in range(wp.int32(GROUP)):
        bit = wp.uint32(1) << wp.uint32(ray)
        one = make_packet_ray(origins[i, ray], directions[i, ray])
        stack = Stack()
        stack.codes = codes_out[i]
        stack.distances = entries_out[i]
        for entry in range(push_children(nodes, i, one, ends[i, ray], stack, 0)):
            lane = stack.codes[entry]  # a child's code is its lane here
            alone_out[i, lane] = alone_out[i, lane] | bit
            alone_distances_out[i, ray, lane] = stack.distances[entry]


def random_groups(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return groups of one octant each: narrow and wide ones, some rays along axes, some on planes of boxes."""
    width = rng.choice([0, 0.01, 1.0], (COUNT, 1, 1))
    origins = rng.uniform(-2, 2, (COUNT, 1, 3)) + width * rng.normal(size=(COUNT, GROUP, 3))
    directions = np.abs(0.5 * rng.normal(size=(COUNT, 1, 3)) - origins[:, :1]) + 0.0 * origins
    directions = np.abs(directions + width * rng.normal(size=origins.shape)) * rng.choice([0, 1, 1, 1], origins.shape)
    directions *= np.where(origins[:, :1] > 0, -1.0, 1.0) + 0.0  # towards the middle; no component is -0.0 alone
    snap = rng.uniform(size=(COUNT, 1, 1)) < 0.3
    origins = np.where(snap, np.round(origins), origins)
    ends = rng.choice([np.inf, 2.0, 0.3, -1.0], (COUNT, GROUP), p=[0.5, 0.3, 0.1, 0.1])
    # a component of zero counts as positive, so that an axis whose others are negative would be of two octants
    directions = np.where(directions == 0, 1e-38 * np.sign(directions.sum(axis=1, keepdims=True)), directions)
    return origins.astype(np.float32), directions.astype(np.float32), ends.astype(np.float32)


def test_groups_against_their_rays(device: str) -> None:
    rng = np.random.default_rng(1)
    corners = rng.uniform(-2, 2, (COUNT, 2, 3, WIDTH))
    corners = np.where(rng.uniform(size=(COUNT, 1, 1, 1)) < 0.3, np.round(corners), corners)
    nodes = np.zeros((COUNT, 8 * WIDTH), np.float32)
    nodes[:, : 3 * WIDTH] = corners.min(axis=1).reshape(COUNT, -1)
    nodes[:, 3 * WIDTH : 6 * WIDTH] = corners.max(axis=1).reshape(COUNT, -1)
    empty = rng.uniform(size=(COUNT, WIDTH)) < 0.2
    nodes[:, : 3 * WIDTH][np.tile(empty, (1, 3))] = np.inf
    nodes[:, 3 * WIDTH : 6 * WIDTH][np.tile(empty, (1, 3))] = -np.inf
    words = nodes.view(np.uint32)
    words[:, 6 * WIDTH : 7 * WIDTH] = np.arange(WIDTH)
    shifts = 4 * np.arange(WIDTH // 2, dtype=np.uint32)
    for parity in range(2):  # lanes in their own order, whatever the octant
        lanes_of_word = np.arange(parity, WIDTH, 2, dtype=np.uint32)
        words[:, 7 * WIDTH + parity :: 2] = np.bitwise_or.reduce(lanes_of_word << shifts)
    origins, directions, ends = random_groups(rng)
    active = rng.integers(0, 2**32, COUNT, dtype=np.uint32) | rng.choice([0, 2**32 - 1], COUNT).astype(np.uint32)
    inputs = [
        wp.array(nodes.reshape(-1), dtype=float, device=device),
        *(wp.array(v, dtype=wp.vec3, device=device) for v in (origins, directions)),
        wp.array(ends, dtype=float, device=device),
        wp.array(active, dtype=wp.uint32, device=device),
    ]
    shapes = [((2, COUNT, GROUP_RAY_FLOATS), float), ((2, COUNT), int), ((2, COUNT, WIDTH), wp.uint32)]
    shapes += [((2, COUNT, WIDTH), float), ((COUNT, WIDTH), wp.uint32), ((COUNT, GROUP, WIDTH), float)]
    shapes += [((COUNT, 2 * WIDTH), int), ((COUNT, 2 * WIDTH), float), ((COUNT,), float)]
    outputs = [wp.zeros(shape, dtype=dtype, device=device) for shape, dtype in shapes]
    wp.launch(compare_groups, COUNT, inputs=inputs, outputs=outputs, device=device)
    words, met, masks, distances, alone, alone_distances, _, _, greatest = (array.numpy() for array in outputs)

    np.testing.assert_array_equal(words[0], words[1])
    np.testing.assert_array_equal(greatest, ends.max(axis=1))
    np.testing.assert_array_equal(met[0], met[1])
    lanes = (met[0][:, None] >> np.arange(WIDTH)) & 1 == 1
    assert 0.1 < lanes.mean() < 0.7
    np.testing.assert_array_equal(masks[0][lanes], masks[1][lanes])
    np.testing.assert_array_equal(distances[0][lanes], distances[1][lanes])
    # the rays that the test of a single one finds, every one of them and no other
    expected = alone & active[:, None]
    np.testing.assert_array_equal(lanes, expected != 0)
    np.testing.assert_array_equal(masks[0][lanes], expected[lanes])
    rays = (masks[0].astype(np.int64)[:, None, :] >> np.arange(GROUP)[:, None]) & 1 == 1
    rays &= lanes[:, None]
    assert (distances[0][:, None] <= alone_distances)[rays].all()
    assert not (lanes & empty).any()
