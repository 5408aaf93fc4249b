# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The kernel that renders a tile of any scene, each pixel's tree by itself."""

import warp as wp

from .bvh_structs import AccelData, Stacks
from .features import AnyScene
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
def render_tile(
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
    """Add one sample to every pixel of a tile (x, y, width, height; film coordinates).

    One thread is one pixel; it writes that pixel of the film, and counts in the row of ``counts`` that its scratch has.
    Scratch has one row where threads run one after the other, as on a CPU, else at least one for each thread.

    The large structs come as arrays of one: a struct argument would be copied by every thread, 2 KB of them by value
    taking as long as tracing the eye ray.
    """
    i = wp.tid()
    features = AnyScene()
    nobody = Unobserved()
    render_thread(
        scenes[0], accels[0], frames[0], films[0], stop, tasks, stacks, counts, tile, sample, i, features, nobody
    )
