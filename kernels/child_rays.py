# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The rays that a node of the ray tree sends on: reflection, refraction, and straight on through what is not there."""

import warp as wp

from .constants import PASS_LIMIT
from .features import Features
from .frame_structs import FrameData
from .observer import Observer, observed
from .per_type import per_type
from .ray_counts import (
    DROPPED_BY_DEPTH,
    PASSED,
    TOTAL_INTERNAL_REFLECTION,
    count,
    count_dropped_by_threshold,
    count_reflection,
    count_refraction,
)
from .ray_differential import track_bounce
from .ray_structs import RayTask
from .response import Shading
from .sampling import branch_key
from .scene_structs import SceneData
from .shading_normal import mirror_normal
from .spawn import spawn_origin
from .surface import Surface
from .tile_structs import EyePath
from .tree_hooks import tell_child, tell_push
from .tree_record import (
    PASSAGE,
    REFLECTION,
    REFRACTION,
    STOPPED_BY_DEPTH,
    STOPPED_BY_PASSES,
    STOPPED_BY_THRESHOLD,
    TOTALLY_REFLECTED,
)
from .vector import max_component, reflect, refract, refraction_discriminant


@observed
def is_kept(
    kind: int,
    coefficient: wp.vec3,
    task: wp.ref[RayTask],
    frame: wp.ref[FrameData],
    counts: wp.array[wp.int64],
    observer: Observer,
) -> bool:
    """Return whether a child with this coefficient is traced; count it as dropped by what stops it first.

    Reference: Hall and Greenberg (1983), A Testbed for Realistic Image Synthesis, IEEE CG&A 3(8), adaptive tree depth.
    """
    largest = max_component(coefficient)
    if largest <= 0.0:
        return False
    if task.weight * largest < frame.threshold:
        count_dropped_by_threshold(counts, task.depth)
        tell_child(observer, kind, STOPPED_BY_THRESHOLD)
        return False
    if task.depth >= frame.depth:
        count(counts, DROPPED_BY_DEPTH)
        tell_child(observer, kind, STOPPED_BY_DEPTH)
        return False
    return True


@wp.func
def leak(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    before: wp.vec4i,
    direction: wp.vec3,
    came_from: wp.vec3,
    crosses: bool,
) -> wp.vec4i:
    """Return the instances on the wrong side of whose surfaces a spawned ray starts; -1: none.

    Interpolated normals near a silhouette can mirror a ray to the inside of a glass body, or refract one back out.
    Such a ray is followed where it goes, but what it next does at this body must not depend on that accident: it has
    entered or not as its parent's reflection or refraction says. Four bodies within one another are kept apart; one
    more at the same time is told by the geometric side.

    Args:
        scene: Shading data.
        surface: Where the ray starts.
        before: The parent's leaks.
        direction: Of the ray.
        came_from: Direction back along the parent.
        crosses: Whether it means to go through the surface.
    """
    if scene.meshes[surface.mesh].is_closed == 0:
        return before
    has_crossed = wp.dot(surface.n_geometric, direction) * wp.dot(surface.n_geometric, came_from) < 0.0
    if has_crossed == crosses:
        return before
    after = before
    for k in range(4):
        if before[k] == surface.instance:
            after[k] = -1
            return after
    for k in range(4):
        if before[k] < 0:
            after[k] = surface.instance
            return after
    return after


@per_type
def child_task(
    scene: wp.ref[SceneData],
    parent: wp.ref[RayTask],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    n: wp.vec3,
    direction: wp.vec3,
    coefficient: wp.vec3,
    leaked: wp.vec4i,
    kind: int,
    features: Features,
) -> RayTask:
    """Return the task of a ray that is one level deeper.

    Args:
        scene: Shading data.
        parent: Task of the ray that sends it.
        surface: Where it starts.
        shading: Of the surface.
        n: Unit normal that it is mirrored or bent about.
        direction: Unit.
        coefficient: Kr or Kt.
        leaked: As ``leak`` returns it.
        kind: REFLECTION or REFRACTION.
        features: What the kernel can render.
    """
    child = RayTask()
    child.origin = spawn_origin(scene, surface, direction)
    child.offset = child.origin - surface.position
    child.direction = direction
    child.reach = wp.inf
    child.coefficient = wp.cw_mul(parent.coefficient, coefficient)
    child.weight = parent.weight * max_component(coefficient)
    child.depth = parent.depth + 1
    child.key = branch_key(parent.key, kind)
    child.passes = parent.passes
    child.from_instance = surface.instance
    child.from_triangle = surface.triangle
    child.sender = surface.instance
    child.leaked = leaked
    eta = shading.eta if kind == REFRACTION else 0.0
    track_bounce(scene, surface, parent, child, n, eta, features)
    return child


@observed
def push_passage(
    scene: wp.ref[SceneData],
    tasks: wp.array[RayTask],
    top: int,
    task: wp.ref[RayTask],
    surface: wp.ref[Surface],
    share: float,
    eye: wp.ref[EyePath],
    counts: wp.array[wp.int64],
    observer: Observer,
) -> int:
    """Push what goes straight on of a ray where only part of a surface is there; return the new top of the stack.

    It is the same ray, no level deeper. From the eye it sees no farther than the camera does.

    Args:
        scene: Shading data.
        tasks: Stack.
        top: Its top.
        task: Of the ray.
        surface: Where it goes on.
        share: Of the surface that is not there.
        eye: Of the tree.
        counts: Counter row.
        observer: Who is told.
    """
    if task.passes >= PASS_LIMIT:
        tell_child(observer, PASSAGE, STOPPED_BY_PASSES)
        return top
    onward = task
    onward.origin = spawn_origin(scene, surface, task.direction)
    onward.offset = onward.origin - surface.position
    if task.depth == 1:
        onward.reach = eye.reach - eye.travelled
    onward.coefficient = task.coefficient * share
    onward.weight = task.weight * share
    onward.differential.origin_x = surface.dpdx
    onward.differential.origin_y = surface.dpdy
    onward.passes = task.passes + 1
    onward.key = branch_key(task.key, PASSAGE)
    onward.from_instance = surface.instance
    onward.from_triangle = surface.triangle
    tasks[top] = onward
    tell_push(observer, top, PASSAGE)
    count(counts, PASSED)
    return top + 1


@observed
def push_children(
    scene: wp.ref[SceneData],
    tasks: wp.array[RayTask],
    top: int,
    task: wp.ref[RayTask],
    surface: wp.ref[Surface],
    shading: wp.ref[Shading],
    frame: wp.ref[FrameData],
    counts: wp.array[wp.int64],
    features: Features,
    observer: Observer,
) -> int:
    """Push the refraction and the reflection ray of a node; return the new top of the stack.

    Diffuse surfaces (Kr = Kt = 0) push nothing. Total internal reflection has no T, and R is weighted by Kr + Kt.
    """
    kr = shading.kr
    kt = shading.kt
    n = mirror_normal(scene, surface, shading, features)
    if max_component(kt) > 0.0:
        cos_in = wp.dot(n, shading.wo)
        if refraction_discriminant(cos_in, shading.eta) < 0.0:
            count(counts, TOTAL_INTERNAL_REFLECTION)
            tell_child(observer, REFRACTION, TOTALLY_REFLECTED)
            kr = kr + kt
        elif is_kept(REFRACTION, kt, task, frame, counts, observer):
            direction = task.direction
            if shading.eta != 1.0:
                direction = refract(task.direction, n, shading.eta)
            leaked = leak(scene, surface, task.leaked, direction, shading.wo, True)
            tasks[top] = child_task(scene, task, surface, shading, n, direction, kt, leaked, REFRACTION, features)
            tell_push(observer, top, REFRACTION)
            top += 1
            count_refraction(counts, task.depth + 1)
    if is_kept(REFLECTION, kr, task, frame, counts, observer):
        mirrored = wp.normalize(reflect(task.direction, n))
        leaked = leak(scene, surface, task.leaked, mirrored, shading.wo, False)
        tasks[top] = child_task(scene, task, surface, shading, n, mirrored, kr, leaked, REFLECTION, features)
        tell_push(observer, top, REFLECTION)
        top += 1
        count_reflection(counts, task.depth + 1)
    return top
