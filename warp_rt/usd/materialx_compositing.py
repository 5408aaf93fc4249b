# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's compositing nodes: two colours, by their alpha or by formulas of paint programs, mixed with the second.

Reference: MaterialX Specification 1.39, Compositing Nodes; Porter and Duff (1984), Compositing Digital Images,
SIGGRAPH 84.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from warp_rt.usd.node_inputs import Node, NodeInputs
from warp_rt.usd.signals import Signal, add, apply, apply_to_all, blend, choose, join, multiply, steps_of

_ONE = Signal.constant([1.0])
_NONE = Signal.constant([0.0])
_BLACK = (0.0, 0.0, 0.0, 1.0)
_LEAST = 1e-6  # below which a divisor counts as 0, as in the reference library


def _of(operator: Callable[[Signal, Signal], Signal]) -> Node:
    """Return the node that mixes what an operator makes of foreground and background with the background."""

    def composite(node: NodeInputs) -> Signal:
        foreground, background = node.get("fg"), node.get("bg")
        return blend(background, operator(foreground, background), node.read("mix") or _ONE)

    return composite


def _by_alpha(function: Callable[..., np.ndarray]) -> Node:
    """Return the node that mixes what a function makes of two colours with their alpha, shape [n, 4], likewise."""
    return _of(lambda foreground, background: apply_to_all(function, 4, foreground, background))


def _by_division(function: Callable[..., np.ndarray]) -> Node:
    """Return the node of a function that mixes the two itself, and is 0 where it would divide by 0."""
    return lambda node: apply(function, node.get("fg"), node.get("bg"), node.read("mix") or _ONE)


def _difference(a: Signal, b: Signal) -> Signal:
    return apply(np.abs, add(b, a, -1.0))


def _screen(a: Signal, b: Signal) -> Signal:
    return add(add(a, b), multiply(a, b), -1.0)


def _overlay(foreground: np.ndarray, background: np.ndarray) -> np.ndarray:
    low, high = 2.0 * foreground * background, 1.0 - 2.0 * (1.0 - foreground) * (1.0 - background)
    return np.where(background >= 0.5, high, low)


@steps_of(_overlay)
def _overlay_steps(foreground: Signal, background: Signal) -> Signal:
    product = multiply(foreground, background)
    low = add(product, product)
    rest = multiply(add(_ONE, foreground, -1.0), add(_ONE, background, -1.0))
    high = add(_ONE, rest, -2.0)
    return choose(apply(np.greater_equal, background, Signal.constant([0.5])), high, low)


def _burn(foreground: np.ndarray, background: np.ndarray, share: np.ndarray) -> np.ndarray:
    burnt = share * (1.0 - (1.0 - background) / foreground) + (1.0 - share) * background
    return np.where(np.abs(foreground) < _LEAST, 0.0, burnt)


@steps_of(_burn)
def _burn_steps(foreground: Signal, background: Signal, share: Signal) -> Signal:
    burnt = add(_ONE, multiply(add(_ONE, background, -1.0), apply(np.reciprocal, foreground)), -1.0)
    return choose(_is_least(foreground), _NONE, blend(background, burnt, share))


def _dodge(foreground: np.ndarray, background: np.ndarray, share: np.ndarray) -> np.ndarray:
    dodged = share * background / (1.0 - foreground) + (1.0 - share) * background
    return np.where(np.abs(1.0 - foreground) < _LEAST, 0.0, dodged)


@steps_of(_dodge)
def _dodge_steps(foreground: Signal, background: Signal, share: Signal) -> Signal:
    rest = add(_ONE, foreground, -1.0)
    dodged = multiply(background, apply(np.reciprocal, rest))
    return choose(_is_least(rest), _NONE, blend(background, dodged, share))


def _is_least(divisor: Signal) -> Signal:
    return apply(np.greater, Signal.constant([_LEAST]), apply(np.abs, divisor))


def _over(foreground: np.ndarray, background: np.ndarray) -> np.ndarray:
    return np.asarray(foreground + background * (1.0 - foreground[:, 3:]))


@steps_of(_over)
def _over_steps(foreground: Signal, background: Signal) -> Signal:
    return add(foreground, multiply(background, add(_ONE, foreground.pick([3]), -1.0)))


def _in(foreground: np.ndarray, background: np.ndarray) -> np.ndarray:
    return np.asarray(foreground * background[:, 3:])


@steps_of(_in)
def _in_steps(foreground: Signal, background: Signal) -> Signal:
    return multiply(foreground, background.pick([3]))


def _mask(foreground: np.ndarray, background: np.ndarray) -> np.ndarray:
    return np.asarray(background * foreground[:, 3:])


@steps_of(_mask)
def _mask_steps(foreground: Signal, background: Signal) -> Signal:
    return multiply(background, foreground.pick([3]))


def _out(foreground: np.ndarray, background: np.ndarray) -> np.ndarray:
    return np.asarray(foreground * (1.0 - background[:, 3:]))


@steps_of(_out)
def _out_steps(foreground: Signal, background: Signal) -> Signal:
    return multiply(foreground, add(_ONE, background.pick([3]), -1.0))


def _matte(foreground: np.ndarray, background: np.ndarray) -> np.ndarray:
    alpha = foreground[:, 3:]
    color = foreground[:, :3] * alpha + background[:, :3] * (1.0 - alpha)
    return np.concatenate([color, alpha + background[:, 3:] * (1.0 - alpha)], axis=1)


@steps_of(_matte)
def _matte_steps(foreground: Signal, background: Signal) -> Signal:
    alpha = foreground.pick([3])
    color = blend(background.pick(range(3)), foreground.pick(range(3)), alpha)
    return join([color, add(alpha, multiply(background.pick([3]), add(_ONE, alpha, -1.0)))])


def _disjoint_over(foreground: np.ndarray, background: np.ndarray) -> np.ndarray:
    total = foreground[:, 3:] + background[:, 3:]
    rest = (1.0 - foreground[:, 3:]) / background[:, 3:]
    share = np.where(total <= 1.0, 1.0, rest)
    color = foreground[:, :3] + background[:, :3] * share
    is_none = (total > 1.0) & (np.abs(background[:, 3:]) < _LEAST)
    return np.concatenate([np.where(is_none, 0.0, color), np.minimum(total, 1.0)], axis=1)


@steps_of(_disjoint_over)
def _disjoint_over_steps(foreground: Signal, background: Signal) -> Signal:
    top, below = foreground.pick([3]), background.pick([3])
    total = add(top, below)
    is_more = apply(np.greater, total, _ONE)
    share = choose(is_more, multiply(add(_ONE, top, -1.0), apply(np.reciprocal, below)), _ONE)
    color = add(foreground.pick(range(3)), multiply(background.pick(range(3)), share))
    is_none = multiply(is_more, _is_least(below))
    return join([choose(is_none, _NONE, color), apply(np.minimum, total, _ONE)])


def _premultiply(node: NodeInputs) -> Signal:
    color = node.get("in", _BLACK).resized(4)
    return join([multiply(color.pick(range(3)), color.pick([3])), color.pick([3])])


def _unpremultiply(node: NodeInputs) -> Signal:
    return apply_to_all(_divided_by_alpha, 4, node.get("in", _BLACK).resized(4))


def _divided_by_alpha(color: np.ndarray) -> np.ndarray:
    alpha = color[:, 3:]
    return np.concatenate([np.where(alpha == 0, color[:, :3], color[:, :3] / alpha), alpha], axis=1)


@steps_of(_divided_by_alpha)
def _divided_by_alpha_steps(color: Signal) -> Signal:
    alpha, first = color.pick([3]), color.pick(range(3))
    return join([choose(alpha, multiply(first, apply(np.reciprocal, alpha)), first), alpha])


COMPOSITES: Mapping[str, Node] = {
    "plus": _of(lambda a, b: add(b, a)),
    "minus": _of(lambda a, b: add(b, a, -1.0)),
    "difference": _of(_difference),
    "screen": _of(_screen),
    "overlay": _of(lambda a, b: apply(_overlay, a, b)),
    "burn": _by_division(_burn),
    "dodge": _by_division(_dodge),
    "over": _by_alpha(_over),
    "in": _by_alpha(_in),
    "mask": _by_alpha(_mask),
    "out": _by_alpha(_out),
    "matte": _by_alpha(_matte),
    "disjointover": _by_alpha(_disjoint_over),
    "mix": lambda node: blend(node.get("bg"), node.get("fg"), node.get("mix")),
    "inside": lambda node: multiply(node.get("in"), node.get("mask", 1.0)),
    "outside": lambda node: multiply(node.get("in"), add(_ONE, node.get("mask"), -1.0)),
    "premult": _premultiply,
    "unpremult": _unpremultiply,
}
"""By name of the node."""
