# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which kernel renders a scene."""

from __future__ import annotations

import warp as wp

from warp_rt.kernels import render, render_costs, render_plain, render_together, render_together_plain
from warp_rt.options import COSTS, RenderOptions
from warp_rt.rendering.plain import is_plain
from warp_rt.scene import Scene

_WALKING = {False: render.render_tile, True: render_plain.render_tile_plain}
"""Each pixel's tree by itself; by whether the scene is plain."""
_TOGETHER = {False: render_together.render_tile_together, True: render_together_plain.render_tile_together_plain}
"""The trees of a tile's pixels grow together; likewise."""


def choose_kernel(scene: Scene, options: RenderOptions, device: str) -> wp.Kernel:
    """Return the fastest kernel that draws a scene and gives the AOVs that are wanted.

    On a CPU the trees of a tile's pixels grow together, but where costs are counted, which are those of rays that
    are traced one by one, and with the triangle tests that are for single rays.
    """
    if set(options.aovs) & set(COSTS):
        return render_costs.render_tile_costs
    is_together = device == "cpu" and options.intersector == "watertight"
    return (_TOGETHER if is_together else _WALKING)[is_plain(scene, options)]


def grows_together(kernel: wp.Kernel) -> bool:
    """Return whether a kernel takes a whole tile in one thread, and ``kernels.tile_structs.TileTrees`` for it."""
    return kernel in _TOGETHER.values()
