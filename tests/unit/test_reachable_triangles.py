# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Triangles that a group of rays may meet, one by one against sixteen rays: none is left out that a ray alone meets."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.constants import GROUP, GROUP_FLOATS, LEAF_IDS, NO_TRIANGLE, WATERTIGHT, WIDTH
from warp_rt.kernels.gather_rays import load_group
from warp_rt.kernels.intersect_group import meet_triangles_plain
from warp_rt.kernels.intersect_packet import intersect_packet_triangle
from warp_rt.kernels.intersect_rays import meet_chosen_triangles
from warp_rt.kernels.ray_group import group_ray
from warp_rt.kernels.reachable_triangles import reachable_triangles
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

COUNT = 3000


@wp.kernel
def find_reachable(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    order: wp.array[int],
    t_max: wp.array[float],
    leaves: wp.array[float],
    rays: wp.array[wp.uint32],
    skips: wp.array2d[int],
    groups: wp.array2d[float],
    lanes_out: wp.array[int],
    met_out: wp.array2d[int],
    hits_out: wp.array2d[wp.uint32],
    tuv_out: wp.array4d[float],
    words_out: wp.array3d[int],
):
    i = wp.tid()
    base = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
    for twin in range(2):
        load_group(origins, directions, t_max, base, order, GROUP * i, GROUP, groups[i], 0, tuv_out[twin, i, 0])
    lanes_out[i] = reachable_triangles(leaves, i, groups[i], 0, rays[i])
    for index in range(wp.int32(GROUP)):
        ray = group_ray(groups[i], 0, index)
        for lane in range(wp.int32(WIDTH)):
            if intersect_packet_triangle(leaves, i, lane, WATERTIGHT, ray).t < wp.inf:
                met_out[i, index] = met_out[i, index] | (1 << lane)
    t, u, v, words = tuv_out[0, i, 0], tuv_out[0, i, 1], tuv_out[0, i, 2], words_out[0, i]
    hits_out[0, i] = meet_triangles_plain(leaves, i, groups[i], 0, rays[i], skips[i], t, u, v, words)
    if lanes_out[i] >= 0:
        t, u, v, words = tuv_out[1, i, 0], tuv_out[1, i, 1], tuv_out[1, i, 2], words_out[1, i]
        hits_out[1, i] = meet_chosen_triangles(leaves, i, lanes_out[i], groups[i], 0, rays[i], skips[i], t, u, v, words)


def packets(rng: np.random.Generator, sizes: tuple[float, ...]) -> np.ndarray:
    """Return triangles of these sizes in a cube, some of them slivers, shape [COUNT, corner, axis, lane]."""
    size = rng.choice(sizes, (COUNT, 1, 1, WIDTH))
    corners = rng.uniform(-1, 1, (COUNT, 1, 3, WIDTH)) + size * rng.normal(size=(COUNT, 3, 3, WIDTH))
    along = rng.uniform(size=(COUNT, 1, WIDTH))
    between = along * corners[:, 0] + (1 - along) * corners[:, 1]
    height = rng.choice([1.0, 1e-3, 1e-6, 0.0], (COUNT, 1, WIDTH), p=[0.7, 0.1, 0.1, 0.1])
    corners[:, 2] = between + height * (corners[:, 2] - between)
    flat = rng.uniform(size=(COUNT, 1, 3, 1)) < 0.1  # coordinates that all have in common
    return np.where(flat, np.round(corners[:, :1, :, :1]), corners)


def bundles(rng: np.random.Generator, corners: np.ndarray, far: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Return origins and directions, shape [COUNT, GROUP, 3]: at corners, edges and insides of triangles, or in planes.

    Args:
        rng: Random numbers.
        corners: As ``packets`` returns them.
        far: How far the origins are away.
        width: How far the rays of a group are apart, at both ends.
    """
    group = np.arange(COUNT)[:, None]
    one, other = rng.integers(0, WIDTH, (2, COUNT, GROUP))
    one[::2] = one[::2, :1]  # all rays of every second group at one triangle
    weights = rng.dirichlet([1, 1, 1], (COUNT, GROUP)) * rng.choice([0, 1], (COUNT, GROUP, 3), p=[0.4, 0.6])
    weights[weights.sum(axis=2) == 0] = [0, 0, 1]
    weights /= weights.sum(axis=2, keepdims=True)
    target = np.einsum("grk,grka->gra", weights, corners[group, :, :, one])
    target += width * rng.normal(size=target.shape) * rng.choice([0, 1], (COUNT, GROUP, 1))
    eye = far * rng.normal(size=(COUNT, 1, 3)) + width * rng.normal(size=target.shape)
    edge_on = corners[group, 0, :, other] + rng.uniform(1, 2, (COUNT, GROUP, 1)) * far * (
        corners[group, 1, :, other] - corners[group, 0, :, other]
    )
    eye = np.where(rng.uniform(size=(COUNT, 1, 1)) < 0.2, edge_on, eye)
    return eye, target - eye


@pytest.mark.parametrize("far", [3.0, 300.0])
@pytest.mark.parametrize("width", [0.0, 0.01, 0.3])
@pytest.mark.parametrize("shift", [0.0, 1e4])
@pytest.mark.parametrize("sizes", [(0.1,), (1.0, 1e-2, 1e-4), (1e-5,)])
def test_no_triangle_that_a_ray_meets(
    device: str, far: float, width: float, shift: float, sizes: tuple[float, ...]
) -> None:
    rng = np.random.default_rng(1)
    corners = packets(rng, sizes)
    origins, directions = bundles(rng, corners, far, width)
    corners += shift
    origins += shift
    leaves = np.zeros((COUNT, 10 * WIDTH), np.float32)
    leaves[:, :LEAF_IDS] = corners.reshape(COUNT, -1)
    empty = np.arange(WIDTH) >= rng.integers(1, WIDTH + 1, (COUNT, 1))
    leaves[:, :LEAF_IDS][np.tile(empty, (1, 9))] = np.nan
    leaves.view(np.int32)[:, LEAF_IDS:] = np.where(empty, -1, np.arange(WIDTH))
    sets = rng.integers(1, 2**32, COUNT, dtype=np.uint32)
    skips = np.where(rng.uniform(size=(COUNT, GROUP)) < 0.1, rng.integers(0, WIDTH, (COUNT, GROUP)), NO_TRIANGLE)
    ends = rng.choice(np.float32([np.inf, 1.0, 0.5]), COUNT * GROUP)
    inputs = [wp.array(v.reshape(-1, 3), dtype=wp.vec3, device=device) for v in (origins, directions)]
    inputs += [wp.array(np.arange(COUNT * GROUP), dtype=int, device=device), wp.array(ends, device=device)]
    inputs += [wp.array(leaves.reshape(-1), device=device), wp.array(sets, device=device)]
    inputs += [wp.array(skips, dtype=int, device=device), wp.zeros((COUNT, GROUP_FLOATS), dtype=float, device=device)]
    shapes = [(COUNT, int), ((COUNT, GROUP), int), ((2, COUNT), wp.uint32)]
    shapes += [((2, COUNT, 3, GROUP), float), ((2, COUNT, GROUP), int)]
    outputs = [wp.zeros(shape, dtype=dtype, device=device) for shape, dtype in shapes]
    wp.launch(find_reachable, COUNT, inputs=inputs, outputs=outputs, device=device)
    lanes, met, hits, tuv, words = (array.numpy() for array in outputs)
    if device != "cpu":
        assert (lanes == -1).all()
        return
    told = lanes >= 0
    is_in = (sets[:, None] >> np.arange(GROUP, dtype=np.uint32) & 1).astype(bool)
    met_by_any = np.bitwise_or.reduce(np.where(is_in, met, 0), axis=1)
    assert not (met_by_any & ~lanes)[told].any()
    assert not (lanes[told] & (empty[told] << np.arange(WIDTH)).sum(axis=1)).any()
    for values in (hits, tuv, words):  # those of the plain twin, bit for bit; those of rays not asked about stay
        np.testing.assert_array_equal(values[1].view(np.int32)[told], values[0].view(np.int32)[told])
    assert hits[1].any() or (shift > 0 and sizes == (1e-5,))  # which float32 does not tell from points
    assert told.mean() > 0.3
    if width == 0.0 and far == 3.0 and sizes == (0.1,):  # rays through one triangle miss most others
        one = told & (np.arange(COUNT) % 2 == 0)
        assert np.bitwise_count(lanes[one]).sum() < 0.5 * (~empty[one]).sum()
