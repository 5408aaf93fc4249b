# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Morton codes against bit-by-bit interleaving in Python's integers."""

import numpy as np
import warp as wp

from warp_rt.kernels.morton import morton_code
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False})


@wp.kernel
def encode(points: wp.array[wp.vec3], codes_out: wp.array[wp.uint64]):
    i = wp.tid()
    codes_out[i] = morton_code(points[i])


def interleave(cells: list[int]) -> int:
    return sum(((cell >> bit) & 1) << (3 * bit + axis) for axis, cell in enumerate(cells) for bit in range(21))


def test_codes_interleave_the_bits_of_the_cells(device: str) -> None:
    corners = [[0, 0, 0], [1, 1, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 2, 0.5]]
    points = np.concatenate([corners, np.random.default_rng(0).uniform(0, 1, (500, 3))]).astype(np.float32)
    codes = wp.empty(len(points), dtype=wp.uint64, device=device)
    wp.launch(
        encode, len(points), inputs=[wp.array(points, dtype=wp.vec3, device=device)], outputs=[codes], device=device
    )
    for point, code in zip(points, codes.numpy(), strict=True):
        cells = [min(max(int(np.float32(c) * np.float32(2**21)), 0), 2**21 - 1) for c in point]
        assert int(code) == interleave(cells)
