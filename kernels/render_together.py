# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The kernel that renders a tile on a CPU: one thread grows the trees of its pixels together."""

import warp as wp

from .bvh_structs import AccelData
from .features import AnyScene
from .frame_structs import FilmData, FrameData
from .scene_structs import SceneData
from .tile_structs import TileTrees

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def import_body():
    """Import what the kernel calls: to compile it; who launches what is compiled needs its arguments' types alone."""
    global grow_tile
    from .tile_trees import grow_tile


@wp.kernel
def render_tile_together(
    scenes: wp.array[SceneData],
    accels: wp.array[AccelData],
    frames: wp.array[FrameData],
    films: wp.array[FilmData],
    stop: wp.array[int],
    trees: wp.array[TileTrees],
    counts: wp.array2d[wp.int64],
    tile: wp.vec4i,
    sample: int,
):
    """Add one sample to every pixel of a tile (x, y, width, height; film coordinates), in one thread.

    The large structs come as arrays of one, as for ``render_tile``.
    """
    features = AnyScene()
    grow_tile(scenes[0], accels[0], frames[0], films[0], trees[0], tile, sample, stop, counts[0], features)
