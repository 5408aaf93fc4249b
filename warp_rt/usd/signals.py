# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a shading network computes: a constant, or an affine map of one texture, of one primvar, or of one field.

A kernel reads a texture or a primvar and no more: so nodes that scale, shift, mix and rearrange channels are folded,
while the stage is read, into one matrix. Whatever else is done to textures of one set of coordinates, or to the
coordinates themselves, makes a field, which ``baking`` makes a texture of.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from warp_rt.scene import Texture

CHANNELS = 4
"""Components that every source has."""


class DoesNotFold(Exception):
    """The value is neither constant nor a function of one set of texture coordinates."""


@dataclass(frozen=True)
class Source:
    """What varies over a surface: the value of a texture node, a primvar, or what is computed of them."""

    key: str
    """Equal for equal sources."""
    texture: Texture | None = field(default=None, compare=False)
    """None: a primvar or a field."""
    primvar: str = field(default="", compare=False)
    """Of a field, that of its texture coordinates."""
    fallback: tuple[float, ...] = field(default=(), compare=False)
    """Of the primvar, where a mesh has none of that name."""
    computed: Field | None = field(default=None, compare=False)
    """Of a field."""

    @property
    def coordinates(self) -> tuple[str, tuple[float, float]] | None:
        """The primvar, with its fallback, that this is a function of; None where that is no texture coordinates'."""
        if self.texture is not None:
            return self.texture.primvar, self.texture.uv_fallback
        return (self.primvar, (self.fallback[0], self.fallback[1])) if len(self.fallback) == 2 else None


@dataclass(frozen=True)
class Signal:
    """One to four components: matrix @ (the source's four components, 1)."""

    matrix: np.ndarray
    """float64, shape [n, 5]; a constant is in the last column."""
    source: Source | None = None
    """None: constant."""

    @staticmethod
    def constant(values: Sequence[float]) -> Signal:
        """Return a value that is the same everywhere."""
        matrix = np.zeros((len(values), CHANNELS + 1))
        matrix[:, -1] = values
        return Signal(matrix)

    @staticmethod
    def of(source: Source, size: int) -> Signal:
        """Return the first components of a source."""
        return Signal(np.eye(size, CHANNELS + 1), source)

    @property
    def size(self) -> int:
        """Number of components."""
        return len(self.matrix)

    @property
    def value(self) -> tuple[float, ...] | None:
        """The components of a constant; None of what varies."""
        return None if self.matrix[:, :-1].any() else tuple(self.matrix[:, -1].tolist())

    @cached_property
    def key(self) -> str:
        """Equal for equal signals."""
        return f"{self.source.key if self.source else ''} {self.matrix.tolist()}"

    @property
    def is_defined(self) -> bool:
        """Whether all components are numbers: a division by a constant 0 leaves some that are none."""
        return bool(np.isfinite(self.matrix).all())

    def defined(self) -> Signal:
        """Return the signal with 0 in place of components that are no numbers, as a field of them has."""
        rows = np.isfinite(self.matrix).all(axis=1, keepdims=True)
        return Signal(np.where(rows, self.matrix, 0.0), self.source)

    def constant_value(self) -> np.ndarray:
        """Return the components of a constant, shape [n].

        Raises:
            DoesNotFold: It varies.
        """
        if self.value is None:
            raise DoesNotFold
        return self.matrix[:, -1]

    def pick(self, indices: Sequence[int]) -> Signal:
        """Return some of the components; those that are not there are 0."""
        rows = [self.matrix[i] if i < self.size else np.zeros(CHANNELS + 1) for i in indices]
        return Signal(np.array(rows), self.source)

    def map(self, linear: np.ndarray, offset: np.ndarray | float = 0.0) -> Signal:
        """Return linear @ self + offset.

        Raises:
            DoesNotFold: It has not as many components as ``linear`` has columns.
        """
        if np.shape(linear)[1] != self.size:
            raise DoesNotFold
        matrix = np.asarray(linear, float) @ self.matrix
        matrix[:, -1] += offset
        return Signal(matrix, self.source)

    def resized(self, size: int) -> Signal:
        """Return as many components: a scalar fills all, others are cut, or filled up with 0, as MaterialX converts."""
        return self.pick([0] * size if self.size == 1 else range(size))


@dataclass(frozen=True)
class Field:
    """A function of texture coordinates, made of signals that are."""

    function: Callable[..., np.ndarray]
    """Of the values of each argument, float64, shape [n, k], to at most four components, shape [n, m]."""
    arguments: tuple[Signal, ...]
    texture: Texture | None = None
    """What is read at the one argument's places, by ``baking``, which has the images; the function is not asked."""
    is_slope: bool = False
    """Whether the function is given how the one argument changes with the texture coordinates: across, then upwards."""


def join(parts: Sequence[Signal]) -> Signal:
    """Return all components of all parts, in order.

    Raises:
        DoesNotFold: They are functions of different things.
    """
    sources = {part.source for part in parts if part.value is None and part.source is not None}
    if len(sources) > 1:
        return _field(_joined, parts, sum(part.size for part in parts))
    return Signal(np.concatenate([part.matrix for part in parts]), next(iter(sources), None))


def _even(a: Signal, b: Signal) -> tuple[Signal, Signal]:
    size = max(a.size, b.size)
    return a.resized(size), b.resized(size)


def add(a: Signal, b: Signal, factor: float = 1.0) -> Signal:
    """Return a + factor b.

    Raises:
        DoesNotFold: They are functions of different things.
    """
    a, b = _even(a, b)
    if a.source != b.source and a.value is None and b.value is None:
        return _field(np.add, (a, b.map(factor * np.eye(b.size))), a.size)
    both = join([a, b])
    return Signal(both.matrix[: a.size] + factor * both.matrix[a.size :], both.source)


def multiply(a: Signal, b: Signal) -> Signal:
    """Return a times b, component by component.

    Raises:
        DoesNotFold: They are functions of different things.
    """
    a, b = _even(a, b)
    if a.value is not None:
        a, b = b, a
    if b.value is None:
        return _field(np.multiply, (a, b), a.size)
    return Signal(a.matrix * b.constant_value()[:, None], a.source)


def blend(start: Signal, end: Signal, share: Signal) -> Signal:
    """Return start + share (end - start), component by component.

    Raises:
        DoesNotFold: They are functions of different things.
    """
    return add(start, multiply(add(end, start, -1.0), share))


def apply(function: Callable[..., np.ndarray], *arguments: Signal) -> Signal:
    """Return any function, component by component.

    Args:
        function: Of arrays; of a module, so that its name tells all about it.
        arguments: What it is given; scalars fill as many components as the others have.

    Raises:
        DoesNotFold: They are functions of different things.
    """
    size = max(argument.size for argument in arguments)
    even = [argument.resized(size) for argument in arguments]
    if any(argument.value is None for argument in even):
        return _field(function, even, size)
    with np.errstate(all="ignore"):
        values = function(*(argument.constant_value() for argument in even))
    return Signal.constant(np.asarray(values, float).tolist())


def apply_to_all(function: Callable[..., np.ndarray], size: int, *arguments: Signal) -> Signal:
    """Return a function of all components of its arguments together, of ``size`` components; else as ``apply``."""
    if any(argument.value is None for argument in arguments):
        return _field(function, arguments, size)
    with np.errstate(all="ignore"):
        values = function(*(argument.constant_value()[None] for argument in arguments))[0]
    return Signal.constant(np.asarray(values, float).tolist())


def look_up(source: Source, place: Signal) -> Signal:
    """Return what a texture gives at places that are computed, all four components.

    Raises:
        DoesNotFold: The places are functions of different things.
    """
    return _field(_places, (place,), CHANNELS, source)


def apply_to_slope(function: Callable[..., np.ndarray], size: int, height: Signal) -> Signal:
    """Return a function, of ``size`` components, of how a height changes with its texture coordinates.

    Args:
        function: Of slopes by the unit, shape [n, 2].
        size: Components that it gives.
        height: One component.

    Raises:
        DoesNotFold: The height is no function of one set of texture coordinates.
    """
    if height.value is not None:
        return Signal.constant(function(np.zeros((1, 2)))[0].tolist())
    return _field(function, (height.pick([0]),), size, is_slope=True)


def _places(place: np.ndarray) -> np.ndarray:
    return place


def _joined(*parts: np.ndarray) -> np.ndarray:
    return np.concatenate(parts, axis=1)


def _field(
    function: Callable[..., np.ndarray],
    arguments: Sequence[Signal],
    size: int,
    texture: Source | None = None,
    *,
    is_slope: bool = False,
) -> Signal:
    """Return a function of signals that are all functions of one set of texture coordinates.

    Raises:
        DoesNotFold: They are not.
    """
    sources = [argument.source for argument in arguments if argument.value is None and argument.source]
    coordinates = {source.coordinates for source in sources}
    found = next(iter(coordinates), None)
    if len(coordinates) != 1 or found is None or size > CHANNELS:
        raise DoesNotFold
    read = "" if texture is None else texture.key
    said = (
        f"{read} {getattr(function, '__module__', '')}.{function.__name__} {[argument.key for argument in arguments]}"
    )
    key = hashlib.blake2b(said.encode(), digest_size=16).hexdigest()
    primvar, fallback = found
    made = Field(function, tuple(arguments), None if texture is None else texture.texture, is_slope)
    source = Source(key, primvar=primvar, fallback=fallback, computed=made)
    return Signal.of(source, size)
