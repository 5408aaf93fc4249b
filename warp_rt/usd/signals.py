# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a shading network computes, as far as it is a constant or an affine map of one texture or of one primvar.

A kernel reads a texture or a primvar and no more: so nodes that scale, shift, mix and rearrange channels are folded,
while the stage is read, into one matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from warp_rt.scene import Texture

CHANNELS = 4
"""Components that every source has."""


class DoesNotFold(Exception):
    """The value is no affine map of one source."""


@dataclass(frozen=True)
class Source:
    """What varies over a surface: the value of a texture node, or a primvar."""

    key: str
    """Equal for equal sources."""
    texture: Texture | None = field(default=None, compare=False)
    """None: a primvar."""
    primvar: str = field(default="", compare=False)
    fallback: tuple[float, ...] = field(default=(), compare=False)
    """Of the primvar, where a mesh has none of that name."""


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


def join(parts: Sequence[Signal]) -> Signal:
    """Return all components of all parts, in order.

    Raises:
        DoesNotFold: They come from several sources.
    """
    sources = {part.source for part in parts if part.value is None and part.source is not None}
    if len(sources) > 1:
        raise DoesNotFold
    return Signal(np.concatenate([part.matrix for part in parts]), next(iter(sources), None))


def _even(a: Signal, b: Signal) -> tuple[Signal, Signal]:
    size = max(a.size, b.size)
    return a.resized(size), b.resized(size)


def add(a: Signal, b: Signal, factor: float = 1.0) -> Signal:
    """Return a + factor b."""
    a, b = _even(a, b)
    both = join([a, b])
    return Signal(both.matrix[: a.size] + factor * both.matrix[a.size :], both.source)


def multiply(a: Signal, b: Signal) -> Signal:
    """Return a times b, component by component.

    Raises:
        DoesNotFold: Both vary.
    """
    a, b = _even(a, b)
    if a.value is not None:
        a, b = b, a
    return a.map(np.diag(b.constant_value()))


def apply(function: Callable[..., np.ndarray], *arguments: Signal) -> Signal:
    """Return any function of constants, component by component.

    Raises:
        DoesNotFold: One varies, or the result is no number.
    """
    size = max(argument.size for argument in arguments)
    with np.errstate(all="ignore"):
        values = function(*(argument.resized(size).constant_value() for argument in arguments))
    if not np.isfinite(values).all():
        raise DoesNotFold
    return Signal.constant(np.asarray(values, float).tolist())
