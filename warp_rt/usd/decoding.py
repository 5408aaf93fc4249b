# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Colours of a colour space made linear Rec. 709 within a shading network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warp_rt.usd.color_spaces import ColorSpace
from warp_rt.usd.signals import Signal, add, apply, apply_to_all, choose, join


@dataclass(frozen=True)
class _Decoder:
    """A function of arrays, and of signals, that takes colours of a space to linear Rec. 709, below 0 as 0."""

    space: ColorSpace

    @property
    def __name__(self) -> str:  # what ``apply_to_all`` tells functions by
        return f"decoded from {self.space}"

    def __call__(self, values: np.ndarray) -> np.ndarray:
        return self.space.to_linear(np.maximum(values, 0.0))

    def steps(self, color: Signal) -> Signal:
        """Return the same of a signal."""
        values = apply(np.maximum, color, Signal.constant([0.0]))
        space = self.space
        if space.gamma != 1.0:
            knee, slope = space.foot
            share = add(values, Signal.constant([space.bias])).map(np.eye(3) / (1.0 + space.bias))
            power = apply(np.power, share, Signal.constant([space.gamma]))
            is_low = apply(np.greater, Signal.constant([knee]), values)
            values = choose(is_low, values.map(slope * np.eye(3)), power)
        return values.map(np.array(self.space.matrix))


def linear(color: Signal, space: ColorSpace) -> Signal:
    """Return a colour of a space in linear Rec. 709, below 0 as 0; alpha stays."""
    result = apply_to_all(_Decoder(space), 3, color.resized(max(color.size, 3)).pick(range(3)))
    return join([result, color.pick([3])]) if color.size == 4 else result
