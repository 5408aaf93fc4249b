# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UDIM tiles: a grid of images, each of which is looked up and filtered by itself.

Nothing of a tile gets into its neighbours, which may be another part of a model, nor does the black of absent tiles.
Where a footprint is wider than a tile, the means of the tiles that there are are filtered in their turn.
"""

import warp as wp

from .constants import SEAM
from .scene_structs import ImageData, SceneData
from .texture import WRAP_CLAMP, make_probes, sample_image


@wp.struct
class Tile:
    """A tile, and the place in it, or at its edge, that is looked at."""

    image: wp.int32
    """Row of ``SceneData.images``; -1: there is no tile."""
    column: wp.int32
    row: wp.int32


@wp.func
def tile_at(scene: wp.ref[SceneData], grid: ImageData, tiles: int, column: int, row: int) -> int:
    """Return the image of a place of the grid, a row of ``SceneData.images``; -1 where there is none."""
    if column < 0 or row < 0 or column >= grid.width or row >= grid.height:
        return -1
    return scene.tiles[tiles + row * grid.width + column]


@wp.func
def find_tile(scene: wp.ref[SceneData], grid: ImageData, tiles: int, u: float, v: float) -> Tile:
    """Return the tile about (u, v); where there is none, one on whose edge it lies to within rounding.

    Seams end on the edges of tiles; beyond them an absent tile is transparent black.

    Args:
        scene: Shading data.
        grid: The grid's size.
        tiles: Its first entry in ``SceneData.tiles``.
        u: Place, a unit a tile from the grid's lower left corner.
        v: Likewise.
    """
    tile = Tile()
    tile.column = int(wp.floor(u))
    tile.row = int(wp.floor(v))
    tile.image = tile_at(scene, grid, tiles, tile.column, tile.row)
    if tile.image >= 0:
        return tile
    s = u - wp.floor(u)
    t = v - wp.floor(v)
    beside = 1 if s > 0.5 else -1
    above = 1 if t > 0.5 else -1
    for k in range(1, 4):
        column = tile.column + (beside if k != 2 else 0)
        row = tile.row + (above if k != 1 else 0)
        image = tile_at(scene, grid, tiles, column, row)
        if image >= 0:
            is_at_u = k == 2 or wp.min(s, 1.0 - s) <= SEAM * wp.max(wp.abs(u), 1.0)
            is_at_v = k == 1 or wp.min(t, 1.0 - t) <= SEAM * wp.max(wp.abs(v), 1.0)
            if is_at_u and is_at_v:
                tile.column = column
                tile.row = row
                tile.image = image
                return tile
    return tile


@wp.func
def bounded_place(grid: ImageData, u: float, v: float) -> wp.vec2:
    """Return (u, v) kept to what is about the grid: beyond it all is alike. What is not finite is on no tile."""
    return wp.vec2(
        wp.clamp(u, -2.0, float(grid.width) + 2.0) if wp.isfinite(u) else -2.0,
        wp.clamp(v, -2.0, float(grid.height) + 2.0) if wp.isfinite(v) else -2.0,
    )


@wp.func
def sample_level(
    scene: wp.ref[SceneData], grid_image: int, grid: ImageData, tile: Tile, u: float, v: float, level: int
) -> wp.vec4:
    """Return a tile's value on one level; levels above its coarsest, a texel, are those of the grid."""
    base = scene.images[tile.image]
    if level < base.level_count:
        image = scene.images[tile.image + level]
        return sample_image(scene, image, u - float(tile.column), v - float(tile.row), WRAP_CLAMP, WRAP_CLAMP)
    image = scene.images[grid_image + wp.min(level - base.level_count + 1, grid.level_count - 1)]
    return sample_image(scene, image, u / float(grid.width), v / float(grid.height), WRAP_CLAMP, WRAP_CLAMP)


# Out of line, as ``sample_footprint`` is.
@wp.func(inline=False)
def sample_tiles(
    scene: wp.ref[SceneData], grid_image: int, tiles: int, u: float, v: float, across: wp.vec2, down: wp.vec2
) -> wp.vec4:
    """Return the mean of tiles about (u, v) over a footprint; transparent black where (u, v) is on no tile.

    The tile at (u, v) is clamped, for what a model has there ends at its edges.

    Args:
        scene: Shading data.
        grid_image: Row of ``SceneData.images``: the means of the tiles, a texel each, and its pyramid.
        tiles: First entry of the grid in ``SceneData.tiles``.
        u: Place, a unit a tile from the grid's lower left corner.
        v: Likewise.
        across: Change of (u, v) from one sample to the next across the picture.
        down: Likewise down the picture.
    """
    grid = scene.images[grid_image]
    place = bounded_place(grid, u, v)
    x = place[0]
    y = place[1]
    tile = find_tile(scene, grid, tiles, x, y)
    total = wp.vec4(0.0, 0.0, 0.0, 0.0)
    if tile.image < 0:
        return total
    base = scene.images[tile.image]
    probes = make_probes(base.width, base.height, base.level_count + grid.level_count - 1, across, down)
    if probes.count == 1 and probes.level <= 0.0:
        return sample_level(scene, grid_image, grid, tile, x, y, 0)
    lower = int(probes.level)
    share = probes.level - float(lower)
    step = probes.reach / float(wp.max(probes.count - 1, 1))
    for k in range(probes.count):
        x_k = x - 0.5 * probes.reach[0] + step[0] * float(k)
        y_k = y - 0.5 * probes.reach[1] + step[1] * float(k)
        value = sample_level(scene, grid_image, grid, tile, x_k, y_k, lower)
        if share > 0.0:
            value = value * (1.0 - share)
            value += sample_level(scene, grid_image, grid, tile, x_k, y_k, lower + 1) * share
        total += value
    return total / float(probes.count)
