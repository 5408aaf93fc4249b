# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What is seen of UDIM tiles from so far that a footprint is wider than a tile: a pyramid over their means."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from warp_rt.upload.image_pyramid import halve


def grid_levels(means: np.ndarray, is_there: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the levels of a grid, a texel a tile, then half as wide and high, and so on down to one texel.

    Absent tiles do not count: no mesh is textured by them, and their black would darken what is seen from afar. So each
    texel is the mean of the tiles there are below it, weighted by what it covers of them; where there are none, it is
    that of the next coarser level, for interpolation not to meet a hole.

    Reference: Gortler, Grzeszczuk, Szeliski and Cohen (1996), The Lumigraph, SIGGRAPH 96, section 3.4 (pull, push).

    Args:
        means: Linear colour and alpha of the tiles, float32, shape [rows, columns, 4].
        is_there: bool, shape [rows, columns]; at least one is.
    """
    weight = is_there[..., None].astype(np.float32)
    sums = [(means * weight, weight)]
    while sums[-1][1].shape[:2] != (1, 1):
        color, weight = (halve(halve(part, 0), 1) for part in sums[-1])
        sums.append((color, weight))
    levels: list[np.ndarray] = []
    for color, weight in reversed(sums):
        level = np.divide(color, weight, out=np.zeros_like(color), where=weight > 0)
        if levels:
            coarser = levels[-1]
            y, x = (np.arange(n) * have // n for n, have in zip(level.shape, coarser.shape[:2], strict=False))
            level = np.where(weight > 0, level, coarser[np.ix_(y, x)])
        levels.append(level)
    yield from reversed(levels)
