# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The kernel that renders a tile and counts what each pixel costs.

It is the render's own ``render_thread`` with another observer, in a file of its own: Warp compiles file by file, and
who does not ask for costs neither waits for it nor pays.
"""

import warp as wp

from .bvh_structs import AccelData, Stacks
from .features import AnyScene
from .frame_structs import FilmData, FrameData
from .observer import CostCounter
from .ray_structs import RayTask
from .scene_structs import SceneData

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def import_body():
    """Import what the kernel calls: to compile it; who launches what is compiled needs its arguments' types alone."""
    global add_costs, pixel_of_thread, render_thread
    from .aov import add_costs
    from .render_pixel import pixel_of_thread, render_thread


@wp.kernel
def render_tile_costs(
    scenes: wp.array[SceneData],
    accels: wp.array[AccelData],
    frames: wp.array[FrameData],
    films: wp.array[FilmData],
    stop: wp.array[int],
    tasks: wp.array2d[RayTask],
    stacks: Stacks,
    counts: wp.array2d[wp.int64],
    tile: wp.vec4i,
    sample: int,
):
    """Do what ``render_tile`` does, with the same arguments, and add each pixel's costs to the film."""
    i = wp.tid()
    features = AnyScene()
    cost = CostCounter()
    render_thread(
        scenes[0], accels[0], frames[0], films[0], stop, tasks, stacks, counts, tile, sample, i, features, cost
    )
    pixel = pixel_of_thread(tile, i)
    add_costs(films[0], pixel[0], pixel[1], cost)
