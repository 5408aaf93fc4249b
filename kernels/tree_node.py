# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A node of the ray tree: what its ray meets, what that adds, and the rays that it sends on."""

import warp as wp

from .aov import FirstHit
from .bvh_structs import AccelData, Hit, Stack
from .child_rays import push_children, push_passage
from .emission import SeenLight, light_met, radiance_of_seen
from .environment import environment
from .features import Features
from .frame_structs import FrameData
from .material import eval_material
from .observer import Observer, observed
from .per_type import per_type
from .ray_differential import track_hit
from .ray_structs import RayTask
from .scene_structs import SceneData
from .shading import local_illumination
from .shadow_queue import Shadows
from .surface import Surface
from .tile_structs import EyePath
from .tree_hooks import tell_background, tell_local, tell_ray, tell_surface
from .visibility import is_held_out, is_seen


@per_type
def radiance_behind(
    scene: wp.ref[SceneData],
    frame: wp.ref[FrameData],
    task: wp.ref[RayTask],
    seen: wp.ref[SeenLight],
    eye: wp.ref[EyePath],
    features: Features,
) -> wp.vec3:
    """Return what a ray brings back that meets no surface, from a light or the environment.

    An eye ray adds to its alpha what of that covers the pixel.
    """
    behind, alpha = environment(scene, frame, task.direction, task.differential, task.sender, features)
    if seen.row >= 0:
        behind = radiance_of_seen(scene, seen, task, features)
        alpha = 1.0
    if task.depth == 1:
        eye.alpha += task.weight * alpha
    return behind


@wp.func
def follow_eye(
    task: wp.ref[RayTask],
    hit: wp.ref[Hit],
    surface: wp.ref[Surface],
    presence: float,
    distance: float,
    holds_out: bool,
    eye: wp.ref[EyePath],
    first: wp.ref[FirstHit],
):
    """Write down what a surface means to the eye ray: how far it came, its alpha, and what it met first."""
    eye.travelled += distance
    if not holds_out:
        eye.alpha += task.weight * presence
    if first.instance < 0 and presence > 0.0:
        first.instance = hit.instance
        first.surface = surface
        first.distance = eye.travelled


@observed
def visit_node(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    task: wp.ref[RayTask],
    hit: wp.ref[Hit],
    surface: wp.ref[Surface],
    distance: float,
    tasks: wp.array[RayTask],
    slot: int,
    sample: int,
    eye: wp.ref[EyePath],
    first: wp.ref[FirstHit],
    stack: wp.ref[Stack],
    shadows: Shadows,
    counts: wp.array[wp.int64],
    features: Features,
    observer: Observer,
):
    """Return (what a node of the tree adds before its coefficient, the top of the stack with its children on it).

    Args:
        scene: Shading data.
        accel: Hierarchies.
        frame: Terms of the tree.
        task: The node's ray. Where only part of a surface is there, its coefficient and weight become that part's.
        hit: The first surface on its way; becomes that of a light which stands before it.
        surface: Where that is.
        distance: To there.
        tasks: Stack to which children are pushed.
        slot: Its top.
        sample: Number of the eye ray among those of its pixel.
        eye: Of the tree.
        first: Where what the eye ray meets first is written.
        stack: Scratch of the traversal.
        shadows: When shadow rays are traced.
        counts: Counter row.
        features: What the kernel can render.
        observer: Who is told of the node, its lights and shadows.
    """
    nothing = wp.vec3(0.0, 0.0, 0.0)
    top = int(slot)
    seen = light_met(scene, frame, task, hit.t, features)
    if seen.row >= 0:
        hit.t = seen.distance
        hit.instance = -1
    tell_ray(observer, slot, task, hit)
    if hit.instance < 0:
        behind = radiance_behind(scene, frame, task, seen, eye, features)
        tell_background(observer, behind)
        return behind, top
    track_hit(scene, surface, task, distance, features)
    shading = eval_material(scene, surface, -task.direction, task.leaked, features)
    if not is_seen(scene, hit.instance, task.depth, features):
        shading.presence = 0.0
    tell_surface(observer, scene, surface, shading)
    holds_out = is_held_out(scene, hit.instance, task.depth, features)
    if task.depth == 1:
        follow_eye(task, hit, surface, shading.presence, distance, holds_out, eye, first)
    if shading.presence < 1.0:
        top = push_passage(scene, tasks, top, task, surface, 1.0 - shading.presence, eye, counts, observer)
        if shading.presence <= 0.0:
            return nothing, top
        task.coefficient = task.coefficient * shading.presence
        task.weight = task.weight * shading.presence
    if holds_out:
        return nothing, top
    local = local_illumination(
        scene, accel, frame, stack, surface, shading, task.depth, task.key, sample, shadows, counts, features, observer
    )
    tell_local(observer, local)
    top = push_children(scene, tasks, top, task, surface, shading, frame, counts, features, observer)
    return local, top
