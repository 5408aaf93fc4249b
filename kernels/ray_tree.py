# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray tree of a pixel, walked depth first with an explicit stack.

I = I_local + Kr R + Kt T at every node. Substituted into one another the equations become a sum over nodes of I_local
times the product of the coefficients on the way, so a node needs no memory of its parent but that product: it is
``RayTask.coefficient``, and the stack holds the rays that still wait.
"""

import warp as wp

from .aov import FirstHit, forget
from .bvh_structs import AccelData, Stack
from .bvh_traverse import closest_hit_from
from .camera import EyeRay
from .features import Features
from .frame_structs import FrameData
from .line_hit import surface_on_line
from .material import NO_LEAK
from .observer import Observer, observed
from .per_type import per_type
from .ray_counts import PRIMARY, count
from .ray_differential import track_eye
from .ray_structs import RayTask
from .scene_structs import SceneData
from .shadow_queue import AtOnce
from .surface import Surface
from .tile_structs import EyePath
from .tree_hooks import tell_eye
from .tree_node import visit_node


@per_type
def eye_task(
    scene: wp.ref[SceneData], frame: wp.ref[FrameData], ray: wp.ref[EyeRay], key: wp.uint32, features: Features
) -> RayTask:
    """Return the task of an eye ray; ``key`` scrambles the samples of its pixel."""
    eye = RayTask()
    eye.origin = ray.origin
    eye.direction = ray.direction
    eye.reach = ray.reach
    eye.coefficient = wp.vec3(1.0, 1.0, 1.0)
    eye.weight = 1.0
    eye.depth = 1
    eye.key = key
    eye.from_instance = -1
    eye.sender = -1
    eye.leaked = NO_LEAK
    track_eye(scene, frame, eye, features)
    return eye


@observed
def trace_tree(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    ray: wp.ref[EyeRay],
    key: wp.uint32,
    sample: int,
    stop: wp.array[int],
    tasks: wp.array[RayTask],
    stack: wp.ref[Stack],
    counts: wp.array[wp.int64],
    first: wp.ref[FirstHit],
    features: Features,
    observer: Observer,
) -> wp.vec4:
    """Return the radiance and alpha that an eye ray brings back.

    Args:
        scene: Shading data.
        accel: Hierarchies.
        frame: Terms of the tree.
        ray: The eye ray.
        key: Scrambling of its pixel.
        sample: Its number among those of the pixel.
        stop: Not 0: the tree ends at its next node, its value being wanted no more.
        tasks: Scratch, at least ``task_capacity`` long.
        stack: Scratch of the traversal.
        counts: Counter row.
        first: Where what the ray meets first is written, or that it meets nothing.
        features: What the kernel can render.
        observer: Who is told of every node, light and shadow.
    """
    forget(first)
    eye = EyePath()
    eye.reach = ray.reach
    shadows = AtOnce()
    surface = Surface()
    color = wp.vec3(0.0, 0.0, 0.0)
    tasks[0] = eye_task(scene, frame, ray, key, features)
    tell_eye(observer)
    count(counts, PRIMARY)
    top = int(1)
    while top > 0 and stop[0] == 0:
        task = tasks[top - 1]
        hit = closest_hit_from(
            accel, task.origin, task.direction, task.reach, task.from_instance, task.from_triangle, stack, observer
        )
        distance = float(0.0)
        if hit.instance >= 0:
            distance = surface_on_line(scene, hit, task.origin, task.offset, task.direction, surface)
        value, top = visit_node(
            scene,
            accel,
            frame,
            task,
            hit,
            surface,
            distance,
            tasks,
            top - 1,
            sample,
            eye,
            first,
            stack,
            shadows,
            counts,
            features,
            observer,
        )
        color += wp.cw_mul(task.coefficient, value)
    return wp.vec4(color[0], color[1], color[2], eye.alpha)
