# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The kernel that renders a tile of a plain scene on a CPU, as ``render_plain`` is on a GPU."""

import warp as wp

from .bvh_structs import AccelData
from .features import PlainScene
from .frame_structs import FilmData, FrameData
from .scene_structs import SceneData
from .tile_structs import TileTrees

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def import_body():
    """Import what the kernel calls: to compile it; who launches what is compiled needs its arguments' types alone."""
    global grow_tile
    from .tile_trees import grow_tile


@wp.kernel
def render_tile_together_plain(
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
    """Do what ``render_tile_together`` does, with the same arguments, for a scene that is plain."""
    features = PlainScene()
    grow_tile(scenes[0], accels[0], frames[0], films[0], trees[0], tile, sample, stop, counts[0], features)
