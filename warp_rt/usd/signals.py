# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a shading network computes: a constant, or an affine map of one texture, of one primvar, or of one field.

Nodes that scale, shift, mix and rearrange channels are folded, while the stage is read, into one matrix, so that a
texture or a primvar is all that a kernel reads. Whatever else is done makes a field. One that is a function of one set
of texture coordinates ``baking`` makes a texture of; of any other, as of the place in space, ``program_compiler`` makes
a program.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from warp_rt.scene import Texture
from warp_rt.scene.programs import Op

CHANNELS = 4
"""Components that every source has."""


_LARGEST = float(np.finfo(np.float32).max)


def in_float32(values: np.ndarray) -> np.ndarray:
    """Return the nearest numbers within the range of float32, any shape; what is no number stays."""
    return np.clip(values, -_LARGEST, _LARGEST)


class DoesNotFold(Exception):
    """The value is none that a constant, a texture, a primvar or a program has."""


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
        """The primvar, with its fallback, that this is a function of; None where it is of no one set of coordinates."""
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

    @property
    def is_in_range(self) -> bool:
        """Whether float32, in which kernels compute, holds its numbers."""
        return np.array_equal(self.matrix, in_float32(self.matrix))

    def in_range(self) -> Signal:
        """Return the signal with the nearest numbers that float32 holds."""
        return Signal(in_float32(self.matrix), self.source)

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

        Args:
            linear: Shape [m, size].
            offset: Shape [m], or one number for all.

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
    """A function of other signals, or of the surface point itself."""

    function: Callable[..., np.ndarray] | Op
    """Of the values of each argument, float64, shape [n, k], to at most four components, shape [n, m]; or what only a
    program can tell."""
    arguments: tuple[Signal, ...]
    texture: Texture | None = None
    """What is read at the one argument's places, by ``baking``, which has the images; the function is not asked."""
    is_slope: bool = False
    """Whether the function is given how the one argument changes with the texture coordinates: across, then upwards."""
    primvar: str = ""
    """That an ``Op`` reads."""
    size: int = CHANNELS
    """Components that it has."""

    @property
    def of_arrays(self) -> Callable[..., np.ndarray]:
        """The function.

        Raises:
            DoesNotFold: It is none of arrays.
        """
        if isinstance(self.function, Op):
            raise DoesNotFold
        return self.function

    @property
    def name(self) -> str:
        """Equal for equal functions."""
        if isinstance(self.function, Op):
            return f"{self.function.name} {self.primvar}"
        return f"{getattr(self.function, '__module__', '')}.{self.function.__name__}"


def join(parts: Sequence[Signal]) -> Signal:
    """Return all components of all parts, in order.

    Raises:
        DoesNotFold: They are more than four, and not all of one source.
    """
    sources = {part.source for part in parts if part.value is None and part.source is not None}
    if len(sources) > 1:
        return _field(joined, parts, sum(part.size for part in parts))
    return Signal(np.concatenate([part.matrix for part in parts]), next(iter(sources), None))


def _even(a: Signal, b: Signal) -> tuple[Signal, Signal]:
    size = max(a.size, b.size)
    return a.resized(size), b.resized(size)


def add(a: Signal, b: Signal, factor: float = 1.0) -> Signal:
    """Return a + factor b."""
    a, b = _even(a, b)
    if a.source != b.source and a.value is None and b.value is None:
        return _field(np.add, (a, b.map(factor * np.eye(b.size))), a.size)
    both = join([a, b])
    return Signal(both.matrix[: a.size] + factor * both.matrix[a.size :], both.source)


def multiply(a: Signal, b: Signal) -> Signal:
    """Return a times b, component by component."""
    a, b = _even(a, b)
    if a.value is not None:
        a, b = b, a
    if b.value is None:
        return _field(np.multiply, (a, b), a.size)
    return Signal(a.matrix * b.constant_value()[:, None], a.source)


def blend(start: Signal, end: Signal, share: Signal) -> Signal:
    """Return start + share (end - start), component by component."""
    return add(start, multiply(add(end, start, -1.0), share))


def apply(function: Callable[..., np.ndarray], *arguments: Signal) -> Signal:
    """Return any function, component by component.

    Args:
        function: Of arrays, shape [..., n] each, to one of that shape; of a module, so that its name tells all.
        arguments: What it is given; scalars fill as many components as the others have.
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
    """Return what a texture gives at places that are computed, all four components."""
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
    if height.source is None or height.source.coordinates is None:
        raise DoesNotFold
    return _field(function, (height.pick([0]),), size, is_slope=True)


def with_arguments(source: Source, arguments: Sequence[Signal]) -> Signal:
    """Return a field of other arguments, with all components that it has.

    Raises:
        DoesNotFold: The source is no field.
    """
    if source.computed is None:
        raise DoesNotFold
    texture = None if source.computed.texture is None else Source(source.key, source.computed.texture)
    return _computed(replace(source.computed, arguments=tuple(arguments)), texture)


Steps = Callable[..., Signal]
"""A function of arrays as one of signals, of no others than those that a program has a step for."""

STEPS: dict[Callable[..., np.ndarray], Steps] = {}
"""By function."""


def steps_of(function: Callable[..., np.ndarray]) -> Callable[[Steps], Steps]:
    """Return the decorator that says how a program computes a function of arrays."""

    def register(steps: Steps) -> Steps:
        STEPS[function] = steps
        return steps

    return register


def choose(condition: Signal, yes: Signal, no: Signal) -> Signal:
    """Return one of two signals, the second where a condition is 0, component by component."""
    return apply(np.where, condition, yes, no)


def _places(place: np.ndarray) -> np.ndarray:
    return place


def joined(*parts: np.ndarray) -> np.ndarray:
    """Return all components of all parts, shape [n, k] each, in order."""
    return np.concatenate(parts, axis=1)


def of_surface(op: Op, size: int, *arguments: Signal, primvar: str = "") -> Signal:
    """Return what only a program can tell: what a surface point has, or what its transform makes of arguments.

    Args:
        op: The program's step.
        size: Components that it gives.
        arguments: Registers of the step.
        primvar: That it reads.
    """
    return _computed(Field(op, arguments, primvar=primvar, size=size), None)


def _field(
    function: Callable[..., np.ndarray],
    arguments: Sequence[Signal],
    size: int,
    texture: Source | None = None,
    *,
    is_slope: bool = False,
) -> Signal:
    """Return a function of signals.

    Raises:
        DoesNotFold: It has too many components.
    """
    if size > CHANNELS:
        raise DoesNotFold
    return _computed(
        Field(function, tuple(arguments), None if texture is None else texture.texture, is_slope, size=size), texture
    )


def _computed(field_: Field, texture: Source | None) -> Signal:
    sources = [argument.source for argument in field_.arguments if argument.value is None and argument.source]
    coordinates = {source.coordinates for source in sources}
    found = next(iter(coordinates)) if len(coordinates) == 1 else None
    read = "" if texture is None else texture.key
    said = f"{read} {field_.name} {[argument.key for argument in field_.arguments]}"
    key = hashlib.blake2b(said.encode(), digest_size=16).hexdigest()
    primvar, fallback = found or ("", ())
    return Signal.of(Source(key, primvar=primvar, fallback=fallback, computed=field_), field_.size)
