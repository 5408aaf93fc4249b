# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sample positions: a (0, 2)-sequence in every pixel, the centre for one sample, nothing but pixel, sample and seed."""

import numpy as np
import warp as wp

from warp_rt.kernels.sampling import (
    concentric_disk,
    finer_bits,
    hash_uint,
    lens_position,
    mirrored_point,
    sample_position,
)
from warp_rt.warp_setup import init_warp

init_warp()


@wp.kernel
def positions(x: int, y: int, count: int, seed: int, out: wp.array[wp.vec2]):
    i = wp.tid()
    out[i] = sample_position(x, y, i, count, seed)


@wp.kernel
def lens_positions(x: int, y: int, seed: int, out: wp.array[wp.vec2]):
    i = wp.tid()
    out[i] = lens_position(x, y, i, seed)


@wp.kernel
def mirrored_points(count: int, out: wp.array2d[wp.vec2]):
    key, i = wp.tid()
    out[key, i] = mirrored_point(wp.uint32(i), hash_uint(wp.uint32(key)), finer_bits(count))


@wp.kernel
def disk_points(points: wp.array[wp.vec2], out: wp.array[wp.vec2]):
    i = wp.tid()
    out[i] = concentric_disk(points[i])


def on_lens(x: int, y: int, count: int, seed: int = 0) -> np.ndarray:
    out = wp.zeros(count, dtype=wp.vec2, device="cpu")
    wp.launch(lens_positions, dim=count, inputs=[x, y, seed, out], device="cpu")
    return out.numpy()


def sample(x: int, y: int, count: int, seed: int = 0) -> np.ndarray:
    out = wp.zeros(count, dtype=wp.vec2, device="cpu")
    wp.launch(positions, dim=count, inputs=[x, y, count, seed, out], device="cpu")
    return out.numpy()


def test_one_sample_is_the_centre() -> None:
    assert sample(12, 7, 1).tolist() == [[0.5, 0.5]]


def test_every_elementary_interval_holds_one_sample() -> None:
    """The definition of a (0, 4, 2)-net: each box of area 1/16 with power-of-two sides has exactly one of 16 points."""
    for pixel in ((0, 0), (5, 3), (1919, 1079)):
        p = sample(*pixel, 16)
        assert ((p >= 0) & (p < 1)).all()
        for k in range(5):
            columns, rows = 2**k, 2 ** (4 - k)
            cell = np.floor(p[:, 0] * columns) * rows + np.floor(p[:, 1] * rows)
            assert len(np.unique(cell)) == 16


def test_pixels_and_seeds_differ_and_repeat() -> None:
    a, b, c = sample(3, 4, 8), sample(4, 3, 8), sample(3, 4, 8, seed=1)
    assert not np.allclose(a, b)
    assert not np.allclose(a, c)
    assert (a == sample(3, 4, 8)).all()


def test_the_disk_map_keeps_areas_and_squares_become_rings() -> None:
    """Shirley and Chiu: the square of half-side r becomes the disk of radius r, and eight sectors stay sectors."""
    side = (np.arange(64) + 0.5) / 64
    square = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2).astype(np.float32)
    out = wp.zeros(len(square), dtype=wp.vec2, device="cpu")
    wp.launch(disk_points, dim=len(square), inputs=[wp.array(square, dtype=wp.vec2, device="cpu"), out], device="cpu")
    disk, centred = out.numpy(), 2 * square - 1
    np.testing.assert_allclose(np.linalg.norm(disk, axis=1), np.abs(centred).max(axis=1), atol=1e-6)
    octant = np.floor(np.arctan2(disk[:, 1], disk[:, 0]) / (np.pi / 4))
    assert (
        octant == np.floor(np.arctan2(centred[:, 1], centred[:, 0]) / (np.pi / 4))
    ).mean() > 0.97  # but on diagonals
    middle = wp.zeros(1, dtype=wp.vec2, device="cpu")
    wp.launch(disk_points, dim=1, inputs=[wp.full(1, wp.vec2(0.5, 0.5), dtype=wp.vec2, device="cpu"), middle])
    assert middle.numpy().tolist() == [[0.0, 0.0]]


def test_samples_are_spread_over_the_lens_evenly() -> None:
    """Rings of equal area, and sectors, each hold their share: the points are a (0, 8, 2)-net of the square."""
    p = on_lens(5, 3, 256)
    ring = np.floor(16 * np.sqrt((p**2).sum(axis=1)) ** 2).astype(int)
    np.testing.assert_allclose(np.bincount(ring, minlength=16), 16, atol=4)
    np.testing.assert_allclose(p.mean(axis=0), 0, atol=0.01)
    assert not np.allclose(p, on_lens(6, 3, 256))


def test_places_on_the_lens_do_not_follow_from_places_in_the_pixel() -> None:
    """Every quarter of the pixel is seen through every quarter of the lens, equally often but for chance."""
    p, q = sample(17, 4, 1024), on_lens(17, 4, 1024)
    quarter = 2 * (p[:, 0] > 0.5) + (p[:, 1] > 0.5)
    counts = np.bincount((4 * quarter + 2 * (q[:, 0] > 0) + (q[:, 1] > 0)).astype(int), minlength=16)
    np.testing.assert_allclose(counts, 64, atol=32)  # four standard deviations of independent samples
    assert np.abs(np.corrcoef(np.hstack([p, q]).T)[:2, 2:]).max() < 0.1


def mirrored(keys: int, count: int) -> np.ndarray:
    out = wp.zeros((keys, count), dtype=wp.vec2, device="cpu")
    wp.launch(mirrored_points, dim=out.shape, inputs=[count, out], device="cpu")
    return out.numpy().astype(float)


def test_mirrored_strata_hold_one_sample_each_and_no_place_is_more_likely() -> None:
    points = mirrored(4096, 16)
    for k in range(5):
        columns, rows = 2**k, 2 ** (4 - k)
        cells = np.floor(points[..., 0] * columns) * rows + np.floor(points[..., 1] * rows)
        assert (np.sort(cells, axis=1) == np.arange(16)).all()
    for at in range(16):  # of each sample alone, over the scramblings
        counts = np.histogramdd(points[:, at], bins=(8, 8), range=[(0, 1)] * 2)[0]
        np.testing.assert_allclose(counts, 64, atol=5 * 8)
    assert np.ptp(mirrored(4096, 1)[..., 0]) > 0.99


def test_mirrored_strata_cancel_errors_of_first_order() -> None:
    """x and y are integrated exactly, but for digits; squares as by a lattice of half the samples: to 4 / (6 n^2)."""
    for count in (4, 16, 64, 256):
        points = mirrored(256, count)
        np.testing.assert_allclose(points.mean(axis=1), 0.5, atol=1e-6)
        assert np.abs((points**2).mean(axis=1) - 1 / 3).max() <= 2 / 3 / count**2 + 1e-6
