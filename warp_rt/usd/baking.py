# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Fields made textures: what a network computes of texture coordinates, evaluated once, texel by texel.

Where all images that a field reads are placed alike, their texels are its texels, and it is computed of each: only what
is read between texels is then interpolated after the network instead of before it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from warp_rt.scene import Image, MagFilter, Texture, Tiles, Wrap
from warp_rt.scene.texture_values import decoded_texels, grid_values, texture_values
from warp_rt.usd.continuation import UNIT, Continuation, Span, continuation, onto_unit
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.resolution import texel_axis
from warp_rt.usd.signals import CHANNELS, Signal, Source

MAX_STRETCHED = 2048  # texels each way of images that are not placed alike, unless one has more itself
_CHUNK = 1 << 15  # texels at a time: what is computed of them stays in the caches
_SAME = 1e-5  # of a texel
_SINGULAR = 1e-12
_STEP = 1 / 8192  # of texture coordinates, for slopes: below half a texel
_ASIDE = np.array([[1.0 - 2.0**-30, 0.0, 0.62 * 2.0**-30], [0.0, 1.0 - 2.0**-30, 0.38 * 2.0**-30], [0.0, 0.0, 1.0]])
"""Off the corners and the middle, at which fields of coordinates have values of no extent, as x / x and x == 0 do."""


@dataclass(frozen=True)
class Baked:
    """A texture in place of a field."""

    texture: Texture
    size: tuple[int, int]
    """Width and height [texel], of the largest tile."""
    window: tuple[Span, Span]
    """From where to where the image lies, across and upwards: of the coordinates as its textures are placed."""
    is_continued: tuple[bool, bool]
    """Whether the field beyond is as the texture has it wherever it was asked, across and upwards; else the image is
    repeated."""
    is_proven: bool
    """Whether it is so everywhere, as the wrap modes of images tell that are placed alike."""
    is_fine: bool
    """Whether its texels are as fine as what the field is made of, but for edges, which are as wide as a texel."""
    undefined: int
    """Texels at which something that the field is computed of is no number."""


def bake(source: Source, images: ImageCache) -> Baked:
    """Return the texture that gives what a field does.

    Args:
        source: The field.
        images: Takes its images.
    """
    leaves = list(_leaves(source, set()))
    textures = [leaf.texture for leaf in leaves if leaf.texture is not None]
    transform, is_common = _transform(textures)
    from_image = np.linalg.inv(transform)
    size, is_fine = _size(textures, images.images, from_image)
    evaluation = _Evaluation(images.images, size, from_image if textures else from_image @ _ASIDE)
    grids = [texture.tiles for texture in textures if texture.tiles is not None]
    is_tiled = bool(grids) and is_common
    if is_tiled:
        beyond = Continuation((Wrap.BLACK, Wrap.BLACK), (UNIT, UNIT), np.zeros(CHANNELS), (True, True))
    else:
        field = functools.partial(evaluation.at, source)
        beyond = continuation(field, is_of_images=bool(textures))
        if not textures:
            across, upwards = (texel_axis(field, beyond, axis) for axis in (0, 1))
            size, is_fine = (across.count, upwards.count), across.is_fine and upwards.is_fine
            transform = onto_unit((across.span, upwards.span))
            evaluation = _Evaluation(images.images, size, np.linalg.inv(transform) @ _ASIDE)
    looked_up = _looked_up(source, set())
    used = [row for texture in (*textures, *looked_up) for row in _rows(texture)]

    def made(column: int, row: int) -> int:
        key = f"{source.key} {transform.tolist()} {size} {column} {row} {beyond.border.tolist()}"

        def compute() -> tuple[np.ndarray, int]:
            texels, undefined = evaluation.texels(source, column, row, is_tile=is_tiled)
            return texels - beyond.border.astype(np.float32), undefined

        return images.computed(key, used, compute)

    image, tiles = _lay_out(grids, made) if is_tiled else (made(0, 0), None)
    red, green, blue, alpha = beyond.border.tolist()
    texture = Texture(
        image,
        tiles=tiles,
        primvar=source.primvar,
        uv_fallback=(source.fallback[0], source.fallback[1]),
        uv_transform=transform[:2].astype(np.float32),
        wrap_s=beyond.wraps[0],
        wrap_t=beyond.wraps[1],
        mag_filter=MagFilter.NEAREST if is_common and _are_nearest(textures, looked_up) else MagFilter.LINEAR,
        bias=(red, green, blue, alpha),
    )
    rows = _rows(texture)
    is_proven = all(beyond.fits) and is_common and not looked_up and all(leaf.texture is not None for leaf in leaves)
    return Baked(
        texture, size, beyond.spans, beyond.fits, is_proven, is_fine, sum(images.undefined(row) for row in rows)
    )


@dataclass(frozen=True)
class _Places:
    """Where a field is asked for: single places of the image that is made, or the middles of rows of its texels."""

    points: np.ndarray
    """Shape [n, 2]; of rows of texels one after the other."""
    grid: tuple[np.ndarray, np.ndarray] | None = None
    """Of rows of texels their places across and upwards."""
    tile: tuple[int, int] | None = None
    """The tile that they are on."""

    def moved(self, way: np.ndarray) -> _Places:
        """Return the places so far away, shape [2]."""
        grid = None if self.grid is None else (self.grid[0] + way[0], self.grid[1] + way[1])
        return _Places(self.points + way, grid, self.tile)


class _Evaluation:
    """Values of signals at places of the image that is made."""

    def __init__(self, images: Sequence[Image], size: tuple[int, int], from_image: np.ndarray) -> None:
        self._images = images
        self._size = size
        self._from_image = from_image
        self._decoded: dict[tuple[int, bool], np.ndarray] = {}
        self._is_undefined = np.zeros(0, bool)  # of the latest places

    def texels(self, source: Source, column: int, row: int, *, is_tile: bool) -> tuple[np.ndarray, int]:
        """Return the values at all texels of a tile, or of the one image, float32, shape [height, width, 4].

        Then at how many of them something on the way is no number.
        """
        width, height = self._size
        x = column + (np.arange(width) + 0.5) / width
        y = row + (np.arange(height) + 0.5) / height
        lines = max(1, _CHUNK // width)
        texels, undefined = np.empty((height, width, CHANNELS), np.float32), 0
        for first in range(0, height, lines):
            rows = y[first : first + lines]
            points = np.stack([np.tile(x, len(rows)), np.repeat(rows, width)], axis=1)
            places = _Places(points, (x, rows), (column, row) if is_tile else None)
            values = self._values(source, places)
            texels[first : first + lines] = values.reshape(len(rows), width, CHANNELS)
            undefined += int(self._is_undefined.sum())
        return texels, undefined

    def at(self, source: Source, points: np.ndarray) -> np.ndarray:
        """Return the values at places of the image, shape [n, 2]: float64, shape [n, 4]."""
        return self._values(source, _Places(points))

    def _values(self, source: Source, places: _Places) -> np.ndarray:
        self._is_undefined = np.zeros(len(places.points), bool)
        return self._source(source, places, {})

    def _signal(self, signal: Signal, places: _Places, done: dict[str, np.ndarray]) -> np.ndarray:
        linear, offset = signal.matrix[:, :-1], signal.matrix[:, -1]
        if signal.value is not None or signal.source is None:
            return np.broadcast_to(offset, (len(places.points), len(offset)))
        values = self._source(signal.source, places, done)
        if not np.array_equal(linear, np.eye(*linear.shape)):
            values = values @ np.ascontiguousarray(linear.T)
        values = values[:, : len(linear)]
        return values + offset if offset.any() else values

    def _source(self, source: Source, places: _Places, done: dict[str, np.ndarray]) -> np.ndarray:
        """Return the four components of a source, float64, shape [n, 4]; ``done`` keeps them, by key."""
        if source.key not in done:
            done[source.key] = self._found(source, places, done)
        return done[source.key]

    def _found(self, source: Source, places: _Places, done: dict[str, np.ndarray]) -> np.ndarray:
        if source.computed is not None:
            if source.computed.is_slope:
                arguments = [self._slope(source.computed.arguments[0], places)]
            else:
                arguments = [self._signal(argument, places, done) for argument in source.computed.arguments]
            if source.computed.texture is not None:
                return texture_values(source.computed.texture, self._images, arguments[0])
            with np.errstate(all="ignore"):
                values = np.asarray(source.computed.of_arrays(*arguments), float)
            is_number = np.isfinite(values)
            if not is_number.all():
                self._is_undefined |= ~is_number.all(axis=1)
                values = np.where(is_number, values, 0.0)
            return _padded(values)
        if source.texture is None:
            return _padded(self._coordinates(places.points))
        if places.tile is not None and source.texture.tiles is not None:
            return self._texture(_on_tile(source.texture, places.tile), places)
        return self._texture(source.texture, places)

    def _slope(self, height: Signal, places: _Places) -> np.ndarray:
        """Return how a height changes with the texture coordinates, by central differences: shape [n, 2]."""
        image = np.linalg.inv(self._from_image)[:2, :2]
        slopes = [
            self._signal(height, places.moved(_STEP * image[:, axis]), {})
            - self._signal(height, places.moved(-_STEP * image[:, axis]), {})
            for axis in (0, 1)
        ]
        return np.concatenate(slopes, axis=1) / (2.0 * _STEP)

    def _coordinates(self, points: np.ndarray) -> np.ndarray:
        return np.asarray(points @ self._from_image[:2, :2].T + self._from_image[:2, 2])

    def _texture(self, texture: Texture, places: _Places) -> np.ndarray:
        placed = _matrix(texture) @ self._from_image
        is_upright = placed[0, 1] == placed[1, 0] == 0.0
        if places.grid is None or not is_upright or texture.image < 0 or texture.tiles is not None:
            return texture_values(texture, self._images, self._coordinates(places.points))
        across, upwards = places.grid
        s, t = placed[0, 0] * across + placed[0, 2], placed[1, 1] * upwards + placed[1, 2]
        key = (texture.image, texture.is_srgb)
        if key not in self._decoded:
            pixels = self._images[texture.image].pixels
            self._decoded[key] = decoded_texels(pixels, is_srgb=texture.is_srgb).astype(np.float32)
        values = grid_values(self._decoded[key], s, t, texture)
        return np.asarray(values.reshape(-1, CHANNELS) * texture.scale + texture.bias)


def _on_tile(texture: Texture, tile: tuple[int, int]) -> Texture:
    """Return one tile of a texture; transparent black, as it is scaled and shifted, where there is none."""
    grid = texture.tiles
    if grid is None:
        return texture
    column, row = tile[0] - grid.left, tile[1] - grid.bottom
    is_there = 0 <= row < len(grid.images) and 0 <= column < len(grid.images[0])
    image = grid.images[row][column] if is_there else -1
    moved = texture.uv_transform.astype(float)
    moved[:, 2] -= tile
    return replace(
        texture,
        image=image,
        tiles=None,
        uv_transform=moved,
        wrap_s=Wrap.CLAMP,
        wrap_t=Wrap.CLAMP,
        fallback=texture.fallback if image >= 0 else texture.bias,
    )


def _padded(values: np.ndarray) -> np.ndarray:
    padded = np.zeros((len(values), CHANNELS))
    padded[:, : values.shape[1]] = values
    return padded


def _matrix(texture: Texture) -> np.ndarray:
    return np.vstack([texture.uv_transform.astype(float), [0.0, 0.0, 1.0]])


def _are_nearest(textures: Sequence[Texture], looked_up: Sequence[Texture]) -> bool:
    """Return whether a field of images that are placed alike has one value from edge to edge of its texels."""
    return bool(textures) and not looked_up and all(one.mag_filter == MagFilter.NEAREST for one in textures)


def _rows(texture: Texture) -> tuple[int, ...]:
    if texture.tiles is not None:
        return texture.tiles.present
    return (texture.image,) if texture.image >= 0 else ()


def _leaves(source: Source, seen: set[str]) -> Iterator[Source]:
    """Yield what a field is made of in the end: textures and coordinates, each once."""
    if source.key in seen:
        return
    seen.add(source.key)
    if source.computed is None:
        yield source
        return
    for argument in source.computed.arguments:
        if argument.source is not None and argument.value is None:
            yield from _leaves(argument.source, seen)


def _looked_up(source: Source, seen: set[str]) -> list[Texture]:
    """Return the textures that are read at computed places."""
    if source.key in seen or source.computed is None:
        return []
    seen.add(source.key)
    below = [argument.source for argument in source.computed.arguments if argument.source is not None]
    found = [texture for one in below for texture in _looked_up(one, seen)]
    return found if source.computed.texture is None else [*found, source.computed.texture]


def _transform(textures: Sequence[Texture]) -> tuple[np.ndarray, bool]:
    """Return how the image is placed, shape [3, 3], and whether that is how all textures are.

    Else it lies over the unit square of the coordinates.
    """
    transforms = [_matrix(texture) for texture in textures] or [np.eye(3)]
    is_common = all(np.array_equal(transforms[0], other) for other in transforms)
    if is_common and abs(np.linalg.det(transforms[0])) > _SINGULAR:
        return transforms[0], True
    return np.eye(3), False


def _size(textures: Sequence[Texture], images: Sequence[Image], from_image: np.ndarray) -> tuple[tuple[int, int], bool]:
    """Return the width and height that are as fine as the finest of some textures; whether the limits let them be."""
    size, limit = np.ones(2), np.full(2, float(MAX_STRETCHED))
    for texture in textures:
        stretch = _matrix(texture)[:2] @ from_image[:, :2]
        for row in _rows(texture):
            height, width = images[row].pixels.shape[:2]
            size = np.maximum(size, np.linalg.norm(stretch * [[width], [height]], axis=0))
            limit = np.maximum(limit, (width, height))
    needed = np.ceil(size - _SAME)
    width, height = np.minimum(needed, limit).astype(int).tolist()
    return (width, height), bool((needed <= limit).all())


def _lay_out(grids: Sequence[Tiles], made: Callable[[int, int], int]) -> tuple[int, Tiles]:
    """Return one of the images and the grid of tiles that any of several grids has, each made by its place."""
    places = {
        (grid.left + column, grid.bottom + row)
        for grid in grids
        for row, images in enumerate(grid.images)
        for column, image in enumerate(images)
        if image >= 0
    }
    (left, bottom), (right, top) = np.min(list(places), axis=0).tolist(), np.max(list(places), axis=0).tolist()
    rows = tuple(
        tuple(made(column, row) if (column, row) in places else -1 for column in range(left, right + 1))
        for row in range(bottom, top + 1)
    )
    tiles = Tiles(left, bottom, rows)
    return tiles.present[0], tiles
