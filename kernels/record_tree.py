# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The kernel that traces one pixel and writes down its ray tree.

It is the render's own ``trace_tree`` with another observer, in a file of its own: Warp compiles file by file, and who
only renders does not wait for it.
"""

import warp as wp

from .bvh_structs import AccelData, Stacks, stack_of_thread
from .features import AnyScene
from .frame_structs import FrameData
from .observer import TreeRecorder
from .ray_structs import RayTask
from .scene_structs import SceneData

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


def import_body():
    """Import what the kernel calls: to compile it; who launches what is compiled needs its arguments' types alone."""
    global FirstHit, make_eye_ray, trace_tree, pixel_key
    from .aov import FirstHit
    from .camera import make_eye_ray
    from .ray_tree import trace_tree
    from .sampling import pixel_key


@wp.kernel
def record_sample(
    scenes: wp.array[SceneData],
    accels: wp.array[AccelData],
    frames: wp.array[FrameData],
    recorders: wp.array[TreeRecorder],
    tasks: wp.array2d[RayTask],
    stacks: Stacks,
    counts: wp.array2d[wp.int64],
    x: int,
    y: int,
    sample: int,
    values_out: wp.array[wp.vec4],
):
    """Trace one sample of pixel (x, y) of the whole image, in one thread; write its radiance and alpha to its row.

    The large structs come as arrays of one, as for ``render_tile``.
    """
    recorder = recorders[0]
    recorder.sample = sample
    stack = stack_of_thread(stacks, 0)
    eye = make_eye_ray(frames[0], x, y, sample)
    first = FirstHit()
    features = AnyScene()
    values_out[sample] = trace_tree(
        scenes[0],
        accels[0],
        frames[0],
        eye,
        pixel_key(x, y, frames[0].seed),
        sample,
        recorder.stop,
        tasks[0],
        stack,
        counts[0],
        first,
        features,
        recorder,
    )
