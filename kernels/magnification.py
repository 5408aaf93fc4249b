# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Textures between their texels otherwise than by linear interpolation: the nearest texel, or a cubic B-spline."""

import warp as wp

from .scene_structs import SceneData, TextureData
from .texture import WRAP_CLAMP, between_texels, make_probes, sample_footprint, wrap_coordinate
from .udim import bounded_place, find_tile, sample_tiles

MAG_LINEAR = wp.constant(0)
MAG_NEAREST = wp.constant(1)


@wp.func
def cubic_pair(x: float) -> wp.vec3:
    """Return two places between texels, and the share of the second, that make a cubic B-spline of four texels.

    Reference: Sigg and Hadwiger (2005), Fast Third-Order Texture Filtering, GPU Gems 2, chapter 20.
    """
    first = wp.floor(x)
    t = x - first
    r = 1.0 - t
    before = r * r * r / 6.0
    after = t * t * t / 6.0
    share = (4.0 - 6.0 * r * r + 3.0 * r * r * r) / 6.0 + after
    return wp.vec3(first - before / (1.0 - share), first + 1.0 + after / share, share)


# Out of line: few textures are read so.
@wp.func(inline=False)
def sample_magnified(
    scene: wp.ref[SceneData], texture: TextureData, u: float, v: float, across: wp.vec2, down: wp.vec2
) -> wp.vec4:
    """Return an image, or tiles, at (u, v) by the texture's filter; where a sample sees more than a texel, the mean.

    Args:
        scene: Shading data.
        texture: Its filter is not the linear one.
        u: Place in the image, (0, 0) being the lower left corner; of tiles in their grid.
        v: Likewise.
        across: Change of (u, v) from one sample to the next across the picture.
        down: Likewise down the picture.
    """
    image = texture.image
    place = wp.vec2(u, v)
    wrap_s = texture.wrap_s
    wrap_t = texture.wrap_t
    if texture.tiles >= 0:
        grid = scene.images[texture.image]
        place = bounded_place(grid, u, v)
        tile = find_tile(scene, grid, texture.tiles, place[0], place[1])
        if tile.image < 0:
            return wp.vec4(0.0, 0.0, 0.0, 0.0)
        image = tile.image
        place = place - wp.vec2(float(tile.column), float(tile.row))
        wrap_s = WRAP_CLAMP
        wrap_t = WRAP_CLAMP
    base = scene.images[image]
    probes = make_probes(base.width, base.height, base.level_count, across, down)
    if probes.count > 1 or probes.level > 0.0:
        if texture.tiles >= 0:
            return sample_tiles(scene, texture.image, texture.tiles, u, v, across, down)
        return sample_footprint(scene, image, u, v, across, down, wrap_s, wrap_t)
    x = wrap_coordinate(place[0], wrap_s) * float(base.width) - 0.5
    y = wrap_coordinate(place[1], wrap_t) * float(base.height) - 0.5
    if texture.mag_filter == MAG_NEAREST:
        return between_texels(scene, base, wp.floor(x + 0.5), wp.floor(y + 0.5), wrap_s, wrap_t)
    columns = cubic_pair(x)
    rows = cubic_pair(y)
    value = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for row in range(wp.int32(2)):
        for column in range(wp.int32(2)):
            weight = (columns[2] if column == 1 else 1.0 - columns[2]) * (rows[2] if row == 1 else 1.0 - rows[2])
            value += between_texels(scene, base, columns[column], rows[row], wrap_s, wrap_t) * weight
    return value
