# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The native tests of sixteen triangles against their plain twins, lane by lane and bit by bit."""

import numpy as np
import warp as wp

from warp_rt.kernels.constants import WATERTIGHT
from warp_rt.kernels.intersect_packet import (
    count_triangles,
    count_triangles_plain,
    intersect_triangles,
    intersect_triangles_plain,
    make_packet_ray,
)
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

COUNT = 20_000


@wp.kernel
def compare_triangles(
    leaves: wp.array[float],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    lanes_out: wp.array2d[int],
    tuv_out: wp.array3d[float],
):
    i = wp.tid()
    ray = make_packet_ray(origins[i], directions[i])
    lanes_out[0, i] = intersect_triangles(leaves, i, ray, t_max[i], tuv_out[0, i])
    lanes_out[1, i] = intersect_triangles_plain(leaves, i, WATERTIGHT, ray, t_max[i], tuv_out[1, i])


@wp.kernel
def compare_counts(
    leaves: wp.array[float],
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: wp.array[float],
    counts_out: wp.array2d[int],
    unused_out: wp.array3d[float],
):
    i = wp.tid()
    ray = make_packet_ray(origins[i], directions[i])
    counts_out[0, i] = count_triangles(leaves, i, ray, t_max[i])
    counts_out[1, i] = count_triangles_plain(leaves, i, WATERTIGHT, ray, t_max[i])


def launch(kernel, records: np.ndarray, rays: list[np.ndarray], width: int, device: str):
    out = wp.zeros((2, COUNT), dtype=int, device=device)
    values = wp.zeros((2, COUNT, width), dtype=float, device=device)
    arrays = [wp.array(records.reshape(-1).astype(np.float32), dtype=float, device=device)]
    arrays += [wp.array(v.astype(np.float32), dtype=wp.vec3, device=device) for v in rays[:2]]
    arrays += [wp.array(rays[2].astype(np.float32), dtype=float, device=device)]
    wp.launch(kernel, COUNT, inputs=arrays, outputs=[out, values], device=device)
    return out.numpy(), values.numpy()


def random_rays(rng: np.random.Generator) -> list[np.ndarray]:
    """Return rays inwards, some along axes, some starting on the planes of integer coordinates, some cut short."""
    origins = rng.uniform(-2, 2, (COUNT, 3))
    directions = (0.5 * rng.normal(size=(COUNT, 3)) - origins) * rng.choice([0, 1, 1, 1], (COUNT, 3))
    snap = rng.uniform(size=COUNT) < 0.3
    origins[snap] = np.round(origins[snap])
    t_max = rng.choice([np.inf, 2.0, 0.3], COUNT)
    origins[:5, 0] = np.nan
    directions[5:10] = 0
    return [origins, directions, t_max]


def random_leaves(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return leaf packets, all lanes with index 0, and which lanes are empty."""
    leaves = np.zeros((COUNT, 160))
    center = rng.uniform(-1.5, 1.5, (COUNT, 1, 3, 16))
    leaves[:, :144] = (center + rng.normal(size=(COUNT, 3, 3, 16))).reshape(COUNT, 144)
    empty = np.arange(16) >= rng.integers(1, 17, (COUNT, 1))
    leaves[:, :144] = np.where(np.repeat(empty[:, None], 9, axis=1).reshape(COUNT, 144), np.nan, leaves[:, :144])
    return leaves, empty


def test_triangles(device: str) -> None:
    rng = np.random.default_rng(2)
    leaves, empty = random_leaves(rng)
    lanes, tuv = launch(compare_triangles, leaves, random_rays(rng), 4, device)
    np.testing.assert_array_equal(lanes[0], lanes[1])
    np.testing.assert_array_equal(tuv[0], tuv[1])
    hit = lanes[0] >= 0
    assert 0.1 < hit.mean() < 0.9
    assert not empty[np.flatnonzero(hit), lanes[0][hit]].any()
    assert (lanes[0][:10] == -1).all()  # NaN origins and zero directions


def test_counts(device: str) -> None:
    rng = np.random.default_rng(3)
    leaves, empty = random_leaves(rng)
    rays = random_rays(rng)
    counts, _ = launch(compare_counts, leaves, rays, 4, device)
    np.testing.assert_array_equal(counts[0], counts[1])
    lanes, _ = launch(compare_triangles, leaves, rays, 4, device)
    np.testing.assert_array_equal(counts[0] > 0, lanes[0] >= 0)
    assert len(np.unique(counts)) > 4
    assert (counts[0] <= (~empty).sum(axis=1)).all()
