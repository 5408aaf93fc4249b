# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sample positions: a (0, 2)-sequence in every pixel, the centre for one sample, nothing but pixel, sample and seed."""

import numpy as np
import warp as wp

from warp_rt.kernels.sampling import sample_position
from warp_rt.warp_setup import init_warp

init_warp()


@wp.kernel
def positions(x: int, y: int, count: int, seed: int, out: wp.array[wp.vec2]):
    i = wp.tid()
    out[i] = sample_position(x, y, i, count, seed)


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
