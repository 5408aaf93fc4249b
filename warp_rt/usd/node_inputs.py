# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A MaterialX node as its arithmetic sees it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from warp_rt.usd.signals import Signal

SIZES = {"float": 1, "integer": 1, "boolean": 1, "color3": 3, "color4": 4, "vector2": 2, "vector3": 3, "vector4": 4}
"""Components of each type."""

Node = Callable[["NodeInputs"], Signal]
"""What a node gives."""


@dataclass(frozen=True)
class NodeInputs:
    """A node as its arithmetic sees it."""

    output: str
    kinds: tuple[str, ...]
    """The types in its name: of what comes in, and of what goes out, where those differ."""
    read: Callable[[str], Signal | None]
    """What an input says; None where it says nothing."""
    text: Callable[[str], str]
    """What a text input says; empty where it says nothing."""
    variant: str = ""
    """What its name ends on after its types: ``CF`` of ``ND_combine2_color4CF``."""

    @property
    def size(self) -> int:
        """Components of the node's type."""
        return SIZES[self.kinds[0]]

    @property
    def output_size(self) -> int:
        """Components of what it gives."""
        return SIZES[self.kinds[-1]]

    def get(self, name: str, default: float | Sequence[float] = 0.0) -> Signal:
        """Return an input, or its default: a number for all components, or as many as it has."""
        found = self.read(name)
        if found is not None:
            return found
        values = [default] * self.size if isinstance(default, int | float) else list(default)
        return Signal.constant(values)

    def sized(self, name: str, size: int) -> Signal:
        """Return an input as so many components; 0 where it says nothing."""
        found = self.read(name)
        return Signal.constant([0.0] * size) if found is None else found.resized(size)

    @property
    def coordinates(self) -> Signal:
        """The texture coordinates that it is given, else ``st``."""
        return self.get("texcoord").resized(2)

    def number(self, name: str, default: float) -> float:
        """Return an input that has to be constant."""
        found = self.read(name)
        return default if found is None else float(found.constant_value()[0])
