# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A sample of a pixel: its ray tree, added to the film."""

import warp as wp

from .aov import FirstHit, write_aovs
from .bvh_structs import AccelData, Stack, Stacks, stack_of_thread
from .camera import make_eye_ray
from .features import Features
from .frame_structs import FilmData, FrameData
from .observer import Observer, observed
from .ray_structs import RayTask
from .ray_tree import trace_tree
from .sampling import pixel_key
from .scene_structs import SceneData


@observed
def render_pixel(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    film: wp.ref[FilmData],
    stop: wp.array[int],
    tasks: wp.array[RayTask],
    stack: wp.ref[Stack],
    counts: wp.array[wp.int64],
    row: int,
    column: int,
    sample: int,
    features: Features,
    observer: Observer,
):
    """Add one sample to a pixel of the film."""
    eye = make_eye_ray(frame, film.x + column, film.y + row, sample)
    key = pixel_key(film.x + column, film.y + row, frame.seed)
    first = FirstHit()
    value = trace_tree(scene, accel, frame, eye, key, sample, stop, tasks, stack, counts, first, features, observer)
    film.color[row, column] = film.color[row, column] + value
    if sample == 0:
        first.distance += eye.near
        write_aovs(scene, film, row, column, first, eye.cosine)


@wp.func
def pixel_of_thread(tile: wp.vec4i, thread: int) -> wp.vec2i:
    """Return row and column, in the film, of the pixel of a tile that has a thread's number."""
    return wp.vec2i(tile[1] + thread // tile[2], tile[0] + thread % tile[2])


@observed
def render_thread(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    film: wp.ref[FilmData],
    stop: wp.array[int],
    tasks: wp.array2d[RayTask],
    stacks: wp.ref[Stacks],
    counts: wp.array2d[wp.int64],
    tile: wp.vec4i,
    sample: int,
    thread: int,
    features: Features,
    observer: Observer,
):
    """Add one sample to the pixel of a tile that has a thread's number."""
    pixel = pixel_of_thread(tile, thread)
    scratch = thread if tasks.shape[0] > 1 else 0
    stack = stack_of_thread(stacks, scratch)
    row_counts = counts[scratch % counts.shape[0]]
    mine = tasks[scratch]
    render_pixel(
        scene, accel, frame, film, stop, mine, stack, row_counts, pixel[0], pixel[1], sample, features, observer
    )
