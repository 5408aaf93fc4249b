# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The kernel that renders a tile of a plain scene.

It is ``render_thread`` for other features, in a file of its own: Warp compiles file by file, and a plain scene does not
wait for what it does not use.
"""

import warp as wp

from .bvh_structs import AccelData, Stacks
from .features import PlainScene
from .frame_structs import FilmData, FrameData
from .observer import Unobserved
from .ray_structs import RayTask
from .scene_structs import SceneData

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def import_body():
    """Import what the kernel calls: to compile it; who launches what is compiled needs its arguments' types alone."""
    global render_thread
    from .render_pixel import render_thread


@wp.kernel
def render_tile_plain(
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
    """Do what ``render_tile`` does, with the same arguments, for a scene that is plain."""
    i = wp.tid()
    features = PlainScene()
    nobody = Unobserved()
    render_thread(
        scenes[0], accels[0], frames[0], films[0], stop, tasks, stacks, counts, tile, sample, i, features, nobody
    )
