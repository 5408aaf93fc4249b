# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pushing the children of a node and dropping entries: native, in plain Warp and in NumPy, bit by bit."""

import numpy as np
import warp as wp

from warp_rt.kernels.bvh_stack import cull_stack, cull_stack_plain, push_children, push_children_plain, stack_code
from warp_rt.kernels.bvh_structs import Stack
from warp_rt.kernels.constants import SLAB_SCALE
from warp_rt.kernels.intersect_packet import make_packet_ray
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

COUNT = 20_000
SIZE = 48  # entries of a stack, with the room for a whole node that pushing on the CPU takes


@wp.kernel
def compare_pushes(
    nodes: wp.array[float],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    tops: wp.array[int],
    codes_out: wp.array3d[int],
    distances_out: wp.array3d[float],
    tops_out: wp.array2d[int],
):
    i = wp.tid()
    ray = make_packet_ray(origins[i], directions[i])
    stack = Stack()
    stack.codes = codes_out[0, i]
    stack.distances = distances_out[0, i]
    tops_out[0, i] = push_children(nodes, i, ray, t_max[i], stack, tops[i])
    stack.codes = codes_out[1, i]
    stack.distances = distances_out[1, i]
    tops_out[1, i] = push_children_plain(nodes, i, ray, t_max[i], stack, tops[i])


@wp.kernel
def compare_culls(
    t_max: wp.array[float],
    tops: wp.array[int],
    codes_out: wp.array3d[int],
    distances_out: wp.array3d[float],
    tops_out: wp.array2d[int],
    topmost_out: wp.array[int],
):
    i = wp.tid()
    stack = Stack()
    stack.codes = codes_out[0, i]
    stack.distances = distances_out[0, i]
    topmost_out[i] = stack_code(stack, tops[i] - 1)
    tops_out[0, i] = cull_stack(stack, tops[i], t_max[i])
    stack.codes = codes_out[1, i]
    stack.distances = distances_out[1, i]
    tops_out[1, i] = cull_stack_plain(stack, tops[i], t_max[i])


def random_nodes(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (nodes, which lanes are empty, the order of each octant: lanes, shape [COUNT, 8, 16])."""
    corners = rng.uniform(-2, 2, (COUNT, 2, 3, 16))
    corners = np.where(rng.uniform(size=(COUNT, 1, 1, 1)) < 0.3, np.round(corners), corners)
    empty = rng.uniform(size=(COUNT, 1, 16)) < 0.3
    nodes = np.zeros((COUNT, 128), np.float32)
    nodes[:, :48] = np.where(empty, np.inf, corners.min(axis=1)).reshape(COUNT, 48)
    nodes[:, 48:96] = np.where(empty, -np.inf, corners.max(axis=1)).reshape(COUNT, 48)
    words = nodes.view(np.uint32)
    words[:, 96:112] = rng.integers(-(2**31), 2**31, (COUNT, 16)).astype(np.int32).view(np.uint32)
    orders = rng.permuted(np.tile(np.arange(16, dtype=np.uint32), (COUNT, 8, 1)), axis=2)
    for parity in range(2):
        shifted = orders[:, :, parity::2] << (4 * np.arange(8, dtype=np.uint32))
        words[:, 112 + parity :: 2] = np.bitwise_or.reduce(shifted, axis=2)
    return nodes, empty[:, 0], orders


def random_rays(rng: np.random.Generator) -> list[np.ndarray]:
    """Return rays inwards, some along axes, some starting on the planes of integer coordinates, some cut short."""
    origins = rng.uniform(-2, 2, (COUNT, 3))
    directions = (0.5 * rng.normal(size=(COUNT, 3)) - origins) * rng.choice([0, 1, 1, 1], (COUNT, 3))
    snap = rng.uniform(size=COUNT) < 0.3
    origins[snap] = np.round(origins[snap])
    return [v.astype(np.float32) for v in (origins, directions, rng.choice([np.inf, 2.0, 0.3], COUNT))]


def test_push_children(device: str) -> None:
    rng = np.random.default_rng(1)
    nodes, empty, orders = random_nodes(rng)
    origins, directions, t_max = random_rays(rng)
    tops = rng.integers(0, 20, COUNT).astype(np.int32)
    before = rng.integers(0, 1000, (COUNT, SIZE)).astype(np.int32)
    codes = wp.array(np.stack([before, before]), dtype=wp.int32, device=device)
    distances = wp.zeros((2, COUNT, SIZE), dtype=wp.float32, device=device)
    tops_out = wp.empty((2, COUNT), dtype=wp.int32, device=device)
    inputs = [
        wp.array(nodes.reshape(-1), dtype=wp.float32, device=device),
        wp.array(origins, dtype=wp.vec3, device=device),
        wp.array(directions, dtype=wp.vec3, device=device),
        wp.array(t_max, dtype=wp.float32, device=device),
        wp.array(tops, dtype=wp.int32, device=device),
    ]
    wp.launch(compare_pushes, COUNT, inputs=inputs, outputs=[codes, distances, tops_out], device=device)
    new_tops = tops_out.numpy()
    np.testing.assert_array_equal(new_tops[0], new_tops[1])

    # The same in NumPy, in float32: (plane - origin) * inverse, and the far one by the scaled inverse.
    magnitude = np.clip(np.abs(directions), np.float32(1e-30), np.float32(1e30))
    inverse = (1 / np.where(directions < 0, -magnitude, magnitude)).astype(np.float32)
    planes = nodes[:, :96].reshape(COUNT, 2, 3, 16)
    is_negative = (inverse < 0)[:, :, None]
    near = np.where(is_negative, planes[:, 1], planes[:, 0]) - origins[:, :, None]
    far = np.where(is_negative, planes[:, 0], planes[:, 1]) - origins[:, :, None]
    t_enter = np.maximum((near * inverse[:, :, None]).max(axis=1), 0)
    t_leave = np.minimum((far * (inverse * np.float32(SLAB_SCALE))[:, :, None]).min(axis=1), t_max[:, None])
    is_met = t_enter <= t_leave
    assert not (is_met & empty).any()
    assert 0.05 < is_met.mean() < 0.6
    np.testing.assert_array_equal(new_tops[0] - tops, is_met.sum(axis=1))
    octants = ((inverse < 0) * [1, 2, 4]).sum(axis=1)
    children = nodes.view(np.int32)[:, 96:112]
    for twin in range(2):
        codes_out, distances_out = codes.numpy()[twin], distances.numpy()[twin]
        for i in range(0, COUNT, 7):
            lanes = orders[i, octants[i]]
            lanes = lanes[is_met[i, lanes]]
            np.testing.assert_array_equal(codes_out[i, : new_tops[0, i]], [*before[i, : tops[i]], *children[i, lanes]])
            np.testing.assert_array_equal(distances_out[i, tops[i] : new_tops[0, i]], t_enter[i, lanes])


def test_cull_stack(device: str) -> None:
    rng = np.random.default_rng(2)
    tops = rng.integers(1, 33, COUNT).astype(np.int32)
    before = rng.integers(-(2**31), 2**31, (COUNT, SIZE)).astype(np.int32)
    entries = rng.choice([0.0, 0.5, 1.0, 2.0, np.inf], (COUNT, SIZE)).astype(np.float32)
    t_max = rng.choice([0.0, 0.5, 1.5], COUNT).astype(np.float32)
    codes = wp.array(np.stack([before, before]), dtype=wp.int32, device=device)
    distances = wp.array(np.stack([entries, entries]), dtype=wp.float32, device=device)
    tops_out = wp.empty((2, COUNT), dtype=wp.int32, device=device)
    topmost = wp.empty(COUNT, dtype=wp.int32, device=device)
    inputs = [wp.array(t_max, dtype=wp.float32, device=device), wp.array(tops, dtype=wp.int32, device=device)]
    wp.launch(compare_culls, COUNT, inputs=inputs, outputs=[codes, distances, tops_out, topmost], device=device)
    np.testing.assert_array_equal(topmost.numpy(), before[np.arange(COUNT), tops - 1])
    for twin in range(2):
        codes_out, distances_out, new_tops = codes.numpy()[twin], distances.numpy()[twin], tops_out.numpy()[twin]
        for i in range(0, COUNT, 7):
            is_kept = entries[i, : tops[i]] <= t_max[i]
            np.testing.assert_array_equal(codes_out[i, : new_tops[i]], before[i, : tops[i]][is_kept])
            np.testing.assert_array_equal(distances_out[i, : new_tops[i]], entries[i, : tops[i]][is_kept])
