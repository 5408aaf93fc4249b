# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Signals to inputs of surfaces, and the textures that these take."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pxr import Sdf

from warp_rt.report import Report
from warp_rt.scene import Input, Texture
from warp_rt.scene.materials import LARGEST_INPUT
from warp_rt.usd.baking import Baked, bake
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.mixed_texture import mixed_texture
from warp_rt.usd.program_compiler import compile_program
from warp_rt.usd.signal_reader import UNKNOWN_NODE
from warp_rt.usd.signals import CHANNELS, DoesNotFold, Signal, Source, in_float32

OUT_OF_RANGE = "W312"
LOSSY = "W313"
BAKED = "N938"

Vector4 = tuple[float, float, float, float]


@dataclass(frozen=True)
class Unknown:
    """An image that is what it was made of within its window alone."""

    path: str
    """Of the input that it was made for."""
    is_continued: tuple[bool, bool]
    """Whether it is so beyond it, too, across and upwards."""


class InputRows:
    """Keeps the textures that inputs take, one row for equal ones.

    Args:
        images: Holds the images of the textures.
        report: Takes the diagnostics.
    """

    def __init__(self, images: ImageCache, report: Report) -> None:
        self.textures: list[Texture] = []
        """Rows of ``Scene.textures``."""
        self.unknown_beyond: dict[int, Unknown] = {}
        """Textures whose images are repeated beyond for want of anything better."""
        self._images = images
        self._report = report
        self._rows: dict[tuple[str, bytes], int] = {}
        self._bakes: dict[str, Baked] = {}
        """By key of the field."""
        self._unknown: dict[str, Unknown] = {}
        """By key of what was made of a field."""

    def lower(self, found: Signal, count: int, path: Sdf.Path) -> Input | None:
        """Return a signal as an input of ``count`` components; None, told, where nothing gives it.

        Args:
            found: The signal.
            count: 1 or 3.
            path: Of what diagnostics are about.
        """
        value = found.value
        if value is not None:
            return Input(value=_components(self._bounded(value, path), count))
        matrix = found.resized(count if found.size != 4 else 4).matrix[:count]
        linear, offset, source = matrix[:, :-1], matrix[:, -1], found.source
        if source is None:
            return None
        if source.computed is not None and source.coordinates is None:
            return self._program(Signal(matrix, source), path)
        if source.computed is not None:
            source = self._baked(source, path)
        channel = _common_channel(matrix)
        diagonal = np.zeros((count, CHANNELS))
        np.fill_diagonal(diagonal, linear.diagonal())
        is_plain = channel >= 0 or np.array_equal(linear, diagonal)
        if source.texture is None:
            if not is_plain:
                return self._program(Signal(matrix, source), path)
            scale, bias = _scale_and_bias(matrix, channel)
            fallback = _components(source.fallback, count) if channel <= 0 else _components(source.fallback, CHANNELS)
            return Input(value=fallback, primvar=source.primvar, channel=channel, scale=scale, bias=bias)
        if is_plain:
            scale, bias = _scale_and_bias(matrix, channel)
            row = self._row(source, scale, bias)
        else:
            row, channel = self._mixed_row(source, linear, offset), 0 if count == 1 else -1
        if source.key in self._unknown:
            self.unknown_beyond[row] = self._unknown[source.key]
        return Input(texture=row, channel=channel)

    def _bounded(self, value: tuple[float, ...], path: Sdf.Path) -> tuple[float, ...]:
        """Return a constant that kernels may compute with; what is larger is told."""
        largest = max(value, key=abs)
        if abs(largest) <= LARGEST_INPUT:
            return value
        self._report.warn(OUT_OF_RANGE, path, f"is {largest:g}; no more than {LARGEST_INPUT:.3g} counts")
        return tuple(np.clip(value, -LARGEST_INPUT, LARGEST_INPUT).tolist())

    def add(self, texture: Texture) -> int:
        """Return the row of a new texture."""
        self.textures.append(texture)
        return len(self.textures) - 1

    def _program(self, found: Signal, path: Sdf.Path) -> Input | None:
        """Return the input that a program computes; None, told, where it would be too large for one."""
        try:
            return Input(program=compile_program(found, lambda source: self._plain_row(source, path)))
        except DoesNotFold:
            message = "what its network computes is too much for a program; the default is used"
            self._report.warn(UNKNOWN_NODE, path, message)
            return None

    def _plain_row(self, source: Source, path: Sdf.Path) -> int:
        """Return the row of a texture as it is, or of what is made of a field."""
        source = source if source.computed is None else self._baked(source, path)
        row = self._row(source, (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0))
        if source.key in self._unknown:
            self.unknown_beyond[row] = self._unknown[source.key]
        return row

    def _baked(self, source: Source, path: Sdf.Path) -> Source:
        """Return the texture that is made of a field, which is told: as a warning where that loses something."""
        if source.key not in self._bakes:
            self._bakes[source.key] = bake(source, self._images)
        baked = self._bakes[source.key]
        width, height = baked.size
        message = f"what its network computes is made an image of {width} x {height} texels{_where(baked)}"
        losses = _losses(baked)
        self._report.warn(LOSSY if losses else BAKED, path, "; ".join([message, *losses]))
        made = Source(f"baked {source.key}", baked.texture)
        if not all(baked.is_continued):
            self._unknown[made.key] = Unknown(str(path), baked.is_continued)
        return made

    def _row(self, source: Source, scale: Vector4, bias: Vector4) -> int:
        """Return the row of a texture whose value, and fallback, is scaled and shifted."""
        key = (source.key, np.array((scale, bias)).tobytes())
        if key not in self._rows and source.texture:
            texture = source.texture
            self._rows[key] = self.add(
                replace(
                    texture,
                    scale=_vector4(np.multiply(texture.scale, scale)),
                    bias=_vector4(np.multiply(texture.bias, scale) + bias),
                    fallback=_vector4(np.multiply(texture.fallback, scale) + bias),
                )
            )
        return self._rows[key]

    def _mixed_row(self, source: Source, linear: np.ndarray, offset: np.ndarray) -> int:
        """Return the row of a texture whose channels are sums over those of a source."""
        key = (source.key, np.column_stack([linear, offset]).tobytes())
        if key not in self._rows and source.texture:
            matrix, shift = np.zeros((CHANNELS, CHANNELS)), np.zeros(CHANNELS)
            matrix[: len(linear)], shift[: len(linear)] = linear, offset
            self._rows[key] = self.add(mixed_texture(source.texture, matrix, shift, self._images.mixed))
        return self._rows[key]


def _where(baked: Baked) -> str:
    """Return where the image of a field holds; nothing where that is everywhere."""
    if baked.is_proven:
        return ""
    across, upwards = (f"from {low:g} to {high:g}" for low, high in baked.window)
    where = across if across == upwards else f"{across} and {upwards}"
    if not all(baked.is_continued):
        return f", of its coordinates {where}, and repeated beyond, as what is computed is not"
    return f", of its coordinates {where}; that it goes on beyond as the image does is seen at samples alone"


def _losses(baked: Baked) -> list[str]:
    """Return what the image of a field has not as the field has it."""
    losses = []
    if not baked.is_fine:
        losses.append("what is finer than its texels is lost")
    if baked.undefined:
        losses.append(f"at {baked.undefined} of them something on the way is no number and counts as 0")
    return losses


def _components(found: tuple[float, ...], count: int) -> tuple[float, float, float, float]:
    """Return numbers as an Input's value: scalars fill a colour, a colour gives a scalar its first component."""
    if count == 1:
        return (found[0], 0.0, 0.0, 0.0)
    red, green, blue, alpha = (*((found * 3) if len(found) == 1 else found), 0.0, 0.0)[:4]
    return (red, green, blue, alpha)


def _vector4(values: np.ndarray) -> Vector4:
    x, y, z, w = in_float32(values).tolist()
    return (x, y, z, w)


def _common_channel(matrix: np.ndarray) -> int:
    """Return the one channel that all rows take alike; -1 where they do not, or are the first channels in order."""
    used = np.flatnonzero(matrix[0, :-1])
    if len(used) == 1 and (matrix == matrix[0]).all():
        return int(used[0])
    return -1


def _scale_and_bias(matrix: np.ndarray, channel: int) -> tuple[Vector4, Vector4]:
    """Return what the channels of a source are multiplied by and shifted by; those that nobody asks for stay."""
    scale, bias = np.ones(CHANNELS), np.zeros(CHANNELS)
    if channel >= 0:
        scale[channel], bias[channel] = matrix[0, channel], matrix[0, -1]
    else:
        scale[: len(matrix)], bias[: len(matrix)] = matrix[:, :-1].diagonal(), matrix[:, -1]
    return _vector4(scale), _vector4(bias)
