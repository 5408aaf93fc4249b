# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray trees of a tile's pixels, grown together on a CPU, so that their rays go through the hierarchy in groups.

The trees grow level by level. The rays of a level are listed by octant and by the instance that sent them, traced 32 at
a time, and what they meet is shaded right away; shadow rays wait in a queue. All nodes are kept until everything is
known, and each pixel then adds up its tree in the order in which ``trace_tree`` walks it: the picture is the same, to
the last bit. Nodes that find no room wait until then, and their branches are walked.
"""

import warp as wp

from .aov import FirstHit, forget, write_aovs
from .bvh_group import trace_group
from .bvh_structs import AccelData, Hit
from .bvh_traverse import closest_hit_from
from .camera import make_eye_ray
from .constants import CELL_HEIGHT, CELL_WIDTH, GROUP, TILE_PIXELS
from .features import Features
from .frame_structs import FilmData, FrameData
from .group_structs import RayGroup
from .group_surfaces import find_surfaces, surface_in_group
from .light_waiting import light_waiting
from .line_hit import surface_on_line
from .list_rays import gather_tasks, list_tasks
from .observer import Unobserved
from .per_type import per_type
from .ray_counts import PRIMARY, count
from .ray_structs import RayTask
from .ray_tree import eye_task
from .sampling import pixel_key
from .scene_structs import SceneData
from .shadow_queue import close_sum, open_queue, settle
from .surface import Surface
from .tile_structs import TilePixel, TileTrees
from .tree_node import visit_node

CHILDREN = wp.constant(3)
"""At most, of a node: its pass-through, its refraction and its reflection."""


@per_type
def plant_trees(
    scene: wp.ref[SceneData],
    frame: wp.ref[FrameData],
    film: wp.ref[FilmData],
    trees: wp.ref[TileTrees],
    tile: wp.vec4i,
    begin: int,
    end: int,
    sample: int,
    counts: wp.array[wp.int64],
    features: Features,
) -> int:
    """Write the eye rays of a tile's pixels ``begin`` to ``end``, and return how many there are.

    Cells at the tile's right and lower edge stick out: numbers beyond it have no pixel.
    """
    cells = (tile[2] + CELL_WIDTH - 1) // CELL_WIDTH
    planted = int(0)
    for position in range(begin, end):
        cell = position // (CELL_WIDTH * CELL_HEIGHT)
        x = CELL_WIDTH * (cell % cells) + position % CELL_WIDTH
        y = CELL_HEIGHT * (cell // cells) + (position // CELL_WIDTH) % CELL_HEIGHT
        if x < tile[2] and y < tile[3]:
            pixel = TilePixel()
            pixel.column = tile[0] + x
            pixel.row = tile[1] + y
            ray = make_eye_ray(frame, film.x + pixel.column, film.y + pixel.row, sample)
            pixel.eye.reach = ray.reach
            pixel.near = ray.near
            pixel.cosine = ray.cosine
            key = pixel_key(film.x + pixel.column, film.y + pixel.row, frame.seed)
            trees.pixels[planted] = pixel
            trees.tasks[planted] = eye_task(scene, frame, ray, key, features)
            trees.nodes[planted].pixel = planted
            count(counts, PRIMARY)
            planted += 1
    return planted


@wp.func
def note_first_hit(
    scene: wp.ref[SceneData],
    film: wp.ref[FilmData],
    pixel: wp.ref[TilePixel],
    first: wp.ref[FirstHit],
    sample: int,
):
    """Write the AOVs of a pixel, unless that was done, from what its eye ray has met; and forget that."""
    if pixel.has_met == 0 and sample == 0:
        first.distance += pixel.near
        write_aovs(scene, film, pixel.row, pixel.column, first, pixel.cosine)
    pixel.has_met = 1
    forget(first)


@wp.func
def trace_tasks(
    accel: wp.ref[AccelData],
    group: wp.ref[RayGroup],
    tasks: wp.array[RayTask],
    order: wp.array[int],
    start: int,
    size: int,
):
    """Find the closest hits of ``size`` tasks of one octant, listed in ``order`` from ``start`` on."""
    gather_tasks(tasks, order, start, size, group.rays, group.ends, group.senders, group.triangles)
    trace_group(accel, group, size, False)


@per_type
def grow_level(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    film: wp.ref[FilmData],
    trees: wp.ref[TileTrees],
    begin: int,
    end: int,
    sample: int,
    stop: wp.array[int],
    first: wp.ref[FirstHit],
    counts: wp.array[wp.int64],
    features: Features,
) -> int:
    """Trace and shade the rays ``begin`` to ``end`` of a level; return where the next level, which follows, ends."""
    nobody = Unobserved()
    surface = Surface()
    hit = Hit()
    tasks = trees.tasks  # as a local, its address need not be read anew after each write
    nodes = trees.nodes
    order = trees.order
    values = trees.shadows.values
    pixels = trees.pixels
    top = int(end)
    list_tasks(tasks, begin, end - begin, trees.keys, order, trees.ends)
    start = int(0)
    for octant in range(wp.int32(9)):
        while start < trees.ends[octant]:
            size = wp.min(GROUP, trees.ends[octant] - start)
            if octant < 8:
                trace_tasks(accel, trees.group, tasks, order, start, size)
            else:
                for index in range(size):
                    trees.group.words[index] = -1
            find_surfaces(scene, accel, trees.group, tasks, order, start, size, trees.surfaces)
            for index in range(size):
                node = order[start + index]
                nodes[node].children = -1
                if top + CHILDREN <= tasks.shape[0] and stop[0] == 0:
                    distance = surface_in_group(
                        scene, accel, trees.group, tasks[node], trees.surfaces, index, hit, surface
                    )
                    root = nodes[node].pixel
                    trees.shadows.node = node
                    trees.shadows.lit.slot = index
                    values[node] = wp.vec3(0.0, 0.0, 0.0)
                    value, after = visit_node(
                        scene,
                        accel,
                        frame,
                        tasks[node],
                        hit,
                        surface,
                        distance,
                        tasks,
                        top,
                        sample,
                        pixels[root].eye,
                        first,
                        trees.shadows.stack,
                        trees.shadows,
                        counts,
                        features,
                        nobody,
                    )
                    values[node] = values[node] + value
                    if first.instance >= 0:
                        note_first_hit(scene, film, pixels[root], first, sample)
                    for child in range(top, after):
                        nodes[child].pixel = root
                    nodes[node].children = top
                    nodes[node].end = after
                    top = after
            light_waiting(
                scene, accel, frame, trees.group, order, start, trees.surfaces, trees.shadows, counts, features
            )
            start += size
    return top


@per_type
def walk_branch(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    trees: wp.ref[TileTrees],
    node: int,
    sum: wp.vec3,
    sample: int,
    stop: wp.array[int],
    first: wp.ref[FirstHit],
    counts: wp.array[wp.int64],
    features: Features,
) -> wp.vec3:
    """Return ``sum`` and what a node that waits and all nodes below it add, walked as ``trace_tree`` does it."""
    nobody = Unobserved()
    surface = Surface()
    color = sum
    root = trees.nodes[node].pixel
    walked = trees.tasks.shape[0]  # its place among the values of nodes
    trees.shadows.node = walked
    trees.shadows.lit.slot = -1
    trees.walk[0] = trees.tasks[node]
    top = int(1)
    while top > 0 and stop[0] == 0:
        task = trees.walk[top - 1]
        hit = closest_hit_from(
            accel,
            task.origin,
            task.direction,
            task.reach,
            task.from_instance,
            task.from_triangle,
            trees.shadows.stack,
            nobody,
        )
        trees.shadows.values[walked] = wp.vec3(0.0, 0.0, 0.0)
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
            trees.walk,
            top - 1,
            sample,
            trees.pixels[root].eye,
            first,
            trees.shadows.stack,
            trees.shadows,
            counts,
            features,
            nobody,
        )
        settle(scene, accel, frame, trees.shadows, features)
        close_sum(trees.shadows)
        color += wp.cw_mul(task.coefficient, trees.shadows.values[walked] + value)
    return color


@per_type
def sum_tree(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    trees: wp.ref[TileTrees],
    root: int,
    sample: int,
    stop: wp.array[int],
    first: wp.ref[FirstHit],
    counts: wp.array[wp.int64],
    features: Features,
) -> wp.vec3:
    """Return what a pixel's tree brings back: the sum over its nodes, in the order of ``trace_tree``."""
    color = wp.vec3(0.0, 0.0, 0.0)
    trees.path[0] = root
    top = int(1)
    while top > 0 and stop[0] == 0:
        top -= 1
        node = trees.path[top]
        if trees.nodes[node].children < 0:
            color = walk_branch(scene, accel, frame, trees, node, color, sample, stop, first, counts, features)
        else:
            color += wp.cw_mul(trees.tasks[node].coefficient, trees.shadows.values[node])
            for child in range(trees.nodes[node].children, trees.nodes[node].end):
                trees.path[top] = child
                top += 1
    return color


@per_type
def render_together(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    film: wp.ref[FilmData],
    trees: wp.ref[TileTrees],
    tile: wp.vec4i,
    begin: int,
    end: int,
    sample: int,
    stop: wp.array[int],
    counts: wp.array[wp.int64],
    features: Features,
) -> int:
    """Add one sample to the pixels ``begin`` to ``end`` of a tile; return how many nodes have found room."""
    first = FirstHit()
    forget(first)
    open_queue(trees.shadows)
    planted = plant_trees(scene, frame, film, trees, tile, begin, end, sample, counts, features)
    level = int(0)
    top = int(planted)
    while level < top:
        after = grow_level(scene, accel, frame, film, trees, level, top, sample, stop, first, counts, features)
        level = top
        top = after
    settle(scene, accel, frame, trees.shadows, features)
    close_sum(trees.shadows)
    for root in range(planted):
        color = sum_tree(scene, accel, frame, trees, root, sample, stop, first, counts, features)
        row = trees.pixels[root].row
        column = trees.pixels[root].column
        value = wp.vec4(color[0], color[1], color[2], trees.pixels[root].eye.alpha)
        film.color[row, column] = film.color[row, column] + value
        note_first_hit(scene, film, trees.pixels[root], first, sample)
    return top


@per_type
def grow_tile(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    frame: wp.ref[FrameData],
    film: wp.ref[FilmData],
    trees: wp.ref[TileTrees],
    tile: wp.vec4i,
    sample: int,
    stop: wp.array[int],
    counts: wp.array[wp.int64],
    features: Features,
):
    """Add one sample to every pixel of a tile (x, y, width, height; film coordinates).

    Where trees find no room, fewer grow together from the next time on, and more again where there is room to spare.
    """
    columns = (tile[2] + CELL_WIDTH - 1) // CELL_WIDTH
    rows = (tile[3] + CELL_HEIGHT - 1) // CELL_HEIGHT
    positions = CELL_WIDTH * CELL_HEIGHT * columns * rows
    begin = int(0)
    while begin < positions and stop[0] == 0:
        end = wp.min(begin + trees.size, positions)
        used = render_together(scene, accel, frame, film, trees, tile, begin, end, sample, stop, counts, features)
        begin = end
        if used + CHILDREN > trees.tasks.shape[0]:
            trees.size = wp.max(trees.size // 2, GROUP)
        elif 4 * used < trees.tasks.shape[0]:
            trees.size = wp.min(2 * trees.size, TILE_PIXELS)
