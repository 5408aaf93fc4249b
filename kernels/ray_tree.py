# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray tree of a pixel, walked depth first with an explicit stack.

I = I_local + Kr R + Kt T at every node. Substituted into one another the equations become a sum over nodes of I_local
times the product of the coefficients on the way, so a node needs no memory of its parent but that product: it is
``RayTask.coefficient``, and the stack holds the rays that still wait.
"""

import warp as wp

from .aov import FirstHit, forget, write_aovs
from .bvh_structs import AccelData, Hit, Stack, Stacks, stack_of_thread
from .bvh_traverse import closest_hit_from
from .camera import EyeRay, make_eye_ray
from .constants import PASS_LIMIT
from .emission import light_met, radiance_of_seen
from .environment import environment
from .features import Features
from .line_hit import surface_on_line
from .material import NO_LEAK, eval_material
from .observer import Observer, observed
from .per_type import per_type
from .ray_counts import (
    DROPPED_BY_DEPTH,
    PASSED,
    PRIMARY,
    TOTAL_INTERNAL_REFLECTION,
    count,
    count_dropped_by_threshold,
    count_reflection,
    count_refraction,
)
from .ray_differential import track_bounce, track_eye, track_hit
from .response import Shading
from .sampling import branch_key, pixel_key
from .shading import local_illumination
from .shading_normal import mirror_normal
from .shadow_queue import AtOnce, Shadows
from .spawn import spawn_origin
from .structs import FilmData, FrameData, RayTask, SceneData
from .surface import Surface
from .tile_structs import EyePath
from .tree_hooks import tell_background, tell_child, tell_eye, tell_local, tell_push, tell_ray, tell_surface
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
from .visibility import is_held_out, is_seen

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


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
        behind, behind_alpha = environment(scene, frame, task.direction, task.differential, task.sender, features)
        if seen.row >= 0:
            behind = radiance_of_seen(scene, seen, task, features)
            behind_alpha = 1.0
        tell_background(observer, behind)
        if task.depth == 1:
            eye.alpha += task.weight * behind_alpha
        return behind, top
    track_hit(scene, surface, task, distance, features)
    shading = eval_material(scene, surface, -task.direction, task.leaked, features)
    if not is_seen(scene, hit.instance, task.depth, features):
        shading.presence = 0.0
    tell_surface(observer, scene, surface, shading)
    holds_out = is_held_out(scene, hit.instance, task.depth, features)
    if task.depth == 1:
        eye.travelled += distance
        if not holds_out:
            eye.alpha += task.weight * shading.presence
        if first.instance < 0 and shading.presence > 0.0:
            first.instance = hit.instance
            first.surface = surface
            first.distance = eye.travelled
    if shading.presence < 1.0:
        if task.passes < PASS_LIMIT:
            onward = task
            onward.origin = spawn_origin(scene, surface, task.direction)
            onward.offset = onward.origin - surface.position
            if task.depth == 1:
                onward.reach = eye.reach - eye.travelled
            onward.coefficient = task.coefficient * (1.0 - shading.presence)
            onward.weight = task.weight * (1.0 - shading.presence)
            onward.differential.origin_x = surface.dpdx
            onward.differential.origin_y = surface.dpdy
            onward.passes = task.passes + 1
            onward.key = branch_key(task.key, PASSAGE)
            onward.from_instance = surface.instance
            onward.from_triangle = surface.triangle
            tasks[top] = onward
            tell_push(observer, top, PASSAGE)
            top += 1
            count(counts, PASSED)
        else:
            tell_child(observer, PASSAGE, STOPPED_BY_PASSES)
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
