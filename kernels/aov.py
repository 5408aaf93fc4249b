# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""AOVs: what the eye ray met first, and what a pixel cost, written beside the colour."""

import warp as wp

from .codes import (
    AOV_DEEPEST,
    AOV_DEPTH,
    AOV_DISTANCE,
    AOV_ELEMENT,
    AOV_INSTANCE,
    AOV_NODES_VISITED,
    AOV_NORMAL,
    AOV_POSITION,
    AOV_PRIM,
    AOV_PRIMVARS,
    AOV_RAYS,
    AOV_TREE_SIZE,
    AOV_TRIANGLE_TESTS,
    AOV_UV,
)
from .frame_structs import FilmData
from .observer import CostCounter
from .primvar import NORMALS_SLOT
from .scene_structs import SceneData
from .surface import Surface, element_of
from .surface_primvar import eval_primvar


@wp.struct
class FirstHit:
    """What the eye ray met first: for the AOVs."""

    instance: wp.int32
    """-1 where nothing was met."""
    surface: Surface
    distance: wp.float32
    """Along the eye ray; infinite where nothing was met."""


@wp.func
def forget(first: wp.ref[FirstHit]):
    """Make it say that nothing was met, as where a tree begins."""
    first.instance = -1
    first.distance = wp.inf


@wp.func
def write_aovs(
    scene: wp.ref[SceneData],
    film: wp.ref[FilmData],
    row: int,
    column: int,
    first: wp.ref[FirstHit],
    cosine: float,
):
    """Write the AOVs of one pixel from what its first sample met; ids are never filtered.

    Args:
        scene: Shading data.
        film: AOV arrays.
        row: Of the pixel in the film.
        column: Of the pixel in the film.
        first: What the eye ray met.
        cosine: Between the eye ray and the view axis.
    """
    mask = film.aov_mask
    is_hit = first.instance >= 0
    if (mask & AOV_DEPTH) != 0:
        film.depth[row, column] = first.distance * cosine if is_hit else wp.inf
    if (mask & AOV_DISTANCE) != 0:
        film.distance[row, column] = first.distance
    if not is_hit:
        return
    surface = first.surface
    if (mask & AOV_NORMAL) != 0:
        film.normal[row, column] = surface.n_shading
    if (mask & AOV_POSITION) != 0:
        film.position[row, column] = surface.position
    if (mask & AOV_UV) != 0:
        st = eval_primvar(scene, surface, wp.static(int(NORMALS_SLOT) + 1), wp.vec4(0.0, 0.0, 0.0, 0.0))
        film.uv[row, column] = wp.vec2(st[0], st[1])
    if (mask & AOV_PRIM) != 0:
        film.prim[row, column] = scene.instances[surface.instance].prim
    if (mask & AOV_INSTANCE) != 0:
        film.instance[row, column] = scene.instances[surface.instance].id
    if (mask & AOV_ELEMENT) != 0:
        film.element[row, column] = element_of(scene, surface)
    if (mask & AOV_PRIMVARS) != 0:
        for k in range(film.primvar_slots.shape[0]):
            nothing = wp.vec4(0.0, 0.0, 0.0, 0.0)
            film.primvars[k, row, column] = eval_primvar(scene, surface, film.primvar_slots[k], nothing)


@wp.func
def add_capped(a: int, b: int) -> int:
    """Return the sum of two counts that are not negative, or the greatest int32 where it is greater."""
    return wp.min(a, 2147483647 - b) + b


@wp.func
def add_costs(film: wp.ref[FilmData], row: int, column: int, cost: wp.ref[CostCounter]):
    """Add what one sample of a pixel cost to the AOVs of costs."""
    mask = film.aov_mask
    if (mask & AOV_NODES_VISITED) != 0:
        film.nodes_visited[row, column] = add_capped(film.nodes_visited[row, column], cost.nodes)
    if (mask & AOV_TRIANGLE_TESTS) != 0:
        film.triangle_tests[row, column] = add_capped(film.triangle_tests[row, column], cost.triangles)
    if (mask & AOV_TREE_SIZE) != 0:
        film.tree_size[row, column] = add_capped(film.tree_size[row, column], cost.tree_size)
    if (mask & AOV_DEEPEST) != 0:
        film.deepest[row, column] = wp.max(film.deepest[row, column], cost.deepest)
    if (mask & AOV_RAYS) != 0:
        film.rays[row, column] = add_capped(film.rays[row, column], cost.rays)
