# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's arithmetic, folded: what each node of the standard library makes of its inputs.

Reference: MaterialX Specification 1.39, Standard Nodes, and the node graphs of its reference library (place2d,
tiledimage).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from warp_rt.usd.signals import DoesNotFold, Signal, add, apply, join, multiply
from warp_rt.usd.texture_coordinates import rotation

_SIZES = {"float": 1, "integer": 1, "boolean": 1, "color3": 3, "color4": 4, "vector2": 2, "vector3": 3, "vector4": 4}
_NODE = re.compile(r"ND_([a-z0-9]+)(?:_(.+))?")
_TYPE = re.compile("|".join(_SIZES))
_CHANNELS = {**{name: k for k, name in enumerate("xyzw")}, **{name: k for k, name in enumerate("rgba")}}
_AP1_LUMINANCE = (0.2722287, 0.6740818, 0.0536895)  # the default of luminance's coefficients


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

    @property
    def size(self) -> int:
        """Components of the node's type."""
        return _SIZES[self.kinds[0]]

    @property
    def output_size(self) -> int:
        """Components of what it gives."""
        return _SIZES[self.kinds[-1]]

    def get(self, name: str, default: float | Sequence[float] = 0.0) -> Signal:
        """Return an input, or its default: a number for all components, or as many as it has."""
        found = self.read(name)
        if found is not None:
            return found
        values = [default] * self.size if isinstance(default, int | float) else list(default)
        return Signal.constant(values)

    def number(self, name: str, default: float) -> float:
        """Return an input that has to be constant."""
        found = self.read(name)
        return default if found is None else float(found.constant_value()[0])


def fold(identifier: str, output: str, read: Callable[[str], Signal | None], text: Callable[[str], str]) -> Signal:
    """Return what a node computes.

    Args:
        identifier: Of the node: ``ND_multiply_color3``.
        output: Name of its output.
        read: Gives the signal of an input, or None.
        text: Gives the text of an input, or nothing.

    Raises:
        DoesNotFold: The node is not known, or its value is no affine map of one source.
    """
    match = _NODE.fullmatch(identifier)
    function = _NODES.get(match[1]) if match else None
    if match is None or function is None:
        raise DoesNotFold
    kinds = tuple(_TYPE.findall(match[2] or "vector3"))  # ND_normalmap alone names no type
    if not kinds:
        raise DoesNotFold
    return function(NodeInputs(output, kinds, read, text))


def is_known_node(identifier: str) -> bool:
    """Return whether a node is one of those that fold, where what they are given lets them."""
    match = _NODE.fullmatch(identifier)
    return match is not None and match[1] in _NODES


def _convert(node: NodeInputs) -> Signal:
    result = node.get("in").resized(node.output_size)
    if node.kinds[-1] == "color4" and node.size < 4:
        return join([result.pick(range(3)), Signal.constant([1.0])])
    return result


def _extract(node: NodeInputs) -> Signal:
    index = int(node.number("index", 0.0))
    if not 0 <= index < node.size:
        raise DoesNotFold
    return node.get("in").pick([index])


def _swizzle(node: NodeInputs) -> Signal:
    given, parts = node.get("in"), []
    for name in node.text("channels"):
        if name in "01":
            parts.append(Signal.constant([float(name)]))
        elif name in _CHANNELS:
            parts.append(given.pick([0 if given.size == 1 else _CHANNELS[name]]))
        else:
            raise DoesNotFold
    if not parts:
        raise DoesNotFold
    return join(parts).resized(node.output_size)


def _separate(node: NodeInputs) -> Signal:
    channel = _CHANNELS.get(node.output[-1:])
    if channel is None:
        raise DoesNotFold
    return node.get("in").pick([channel])


def _combine(count: int) -> Callable[[NodeInputs], Signal]:
    def combine(node: NodeInputs) -> Signal:
        parts = []
        for k in range(1, count + 1):
            part = node.read(f"in{k}")
            parts.append(Signal.constant([0.0]) if part is None else part)
        return join(parts).pick(range(node.size))

    return combine


def _divide(node: NodeInputs) -> Signal:
    return multiply(node.get("in1"), apply(np.reciprocal, node.get("in2", 1.0)))


def _mix(node: NodeInputs) -> Signal:
    foreground, background, share = node.get("fg"), node.get("bg"), node.get("mix")
    return add(background, multiply(add(foreground, background, -1.0), share))


def _dot_product(node: NodeInputs) -> Signal:
    product = multiply(node.get("in1"), node.get("in2"))
    return product.map(np.ones((1, product.size)))


def _luminance(node: NodeInputs) -> Signal:
    color, weights = node.get("in").pick(range(3)), node.get("lumacoeffs", _AP1_LUMINANCE).constant_value()
    return color.map(np.tile(weights, (node.size, 1)))


def _range(node: NodeInputs) -> Signal:
    low, high = node.get("inlow"), node.get("inhigh", 1.0)
    start, end = node.get("outlow"), node.get("outhigh", 1.0)
    if node.number("gamma", 1.0) != 1.0:
        raise DoesNotFold
    share = multiply(add(node.get("in"), low, -1.0), apply(np.reciprocal, add(high, low, -1.0)))
    result = add(start, multiply(share, add(end, start, -1.0)))
    return apply(np.clip, result, start, end) if node.number("doclamp", 0.0) else result


def _if(holds: Callable[[float, float], bool]) -> Callable[[NodeInputs], Signal]:
    def choose(node: NodeInputs) -> Signal:
        chosen = "in1" if holds(node.number("value1", 1.0), node.number("value2", 0.0)) else "in2"
        return node.get(chosen)

    return choose


def _switch(node: NodeInputs) -> Signal:
    return node.get(f"in{int(node.number('which', 0.0)) + 1}")


def _place(node: NodeInputs) -> Signal:
    """Return moved texture coordinates: scaled, turned, shifted, or by ``operationorder`` 1 the other way round."""
    pivot, offset = (node.get(name).resized(2).constant_value() for name in ("pivot", "offset"))
    shrink = np.diag(apply(np.reciprocal, node.get("scale", 1.0)).resized(2).constant_value())
    turn = rotation(node.number("rotate", 0.0))
    coordinates = node.get("texcoord").map(np.eye(2), -pivot)
    if node.number("operationorder", 0.0) == 0.0:
        return coordinates.map(turn @ shrink, pivot - offset)
    return coordinates.map(np.eye(2), -offset).map(shrink @ turn, pivot)


def _rotate(node: NodeInputs) -> Signal:
    return node.get("in").map(rotation(node.number("amount", 0.0)))


def _normal_map(node: NodeInputs) -> Signal:
    """Return a normal in the frame of the surface: texels from 0..1 to -1..1, x and y scaled."""
    found = node.read("scale")
    scale = np.ones(1) if found is None else found.constant_value()
    x, y = np.resize(scale, 2)
    return node.get("in", (0.5, 0.5, 1.0)).resized(3).map(np.diag((2 * x, 2 * y, 2.0)), np.array((-x, -y, -1.0)))


def _clamp(node: NodeInputs) -> Signal:
    return apply(np.clip, node.get("in"), node.get("low"), node.get("high", 1.0))


def _smoothstep(node: NodeInputs) -> Signal:
    def step(value: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        x = np.clip((value - low) / (high - low), 0, 1)
        return x * x * (3 - 2 * x)

    return apply(step, node.get("in"), node.get("low"), node.get("high", 1.0))


def _unary(function: Callable[[np.ndarray], np.ndarray]) -> Callable[[NodeInputs], Signal]:
    return lambda node: apply(function, node.get("in"))


def _binary(function: Callable[..., np.ndarray], second: float) -> Callable[[NodeInputs], Signal]:
    return lambda node: apply(function, node.get("in1"), node.get("in2", second))


_NODES: Mapping[str, Callable[[NodeInputs], Signal]] = {
    "constant": lambda node: node.get("value"),
    "dot": lambda node: node.get("in"),
    "convert": _convert,
    "extract": _extract,
    "swizzle": _swizzle,
    **{f"separate{count}": _separate for count in (2, 3, 4)},
    **{f"combine{count}": _combine(count) for count in (2, 3, 4)},
    "add": lambda node: add(node.get("in1"), node.get("in2")),
    "subtract": lambda node: add(node.get("in1"), node.get("in2"), -1.0),
    "multiply": lambda node: multiply(node.get("in1"), node.get("in2", 1.0)),
    "divide": _divide,
    "mix": _mix,
    "invert": lambda node: add(node.get("amount", 1.0), node.get("in"), -1.0),
    "dotproduct": _dot_product,
    "luminance": _luminance,
    "range": _range,
    "remap": _range,
    "ifgreater": _if(lambda a, b: a > b),
    "ifgreatereq": _if(lambda a, b: a >= b),
    "ifequal": _if(lambda a, b: a == b),
    "switch": _switch,
    "place2d": _place,
    "rotate2d": _rotate,
    "normalmap": _normal_map,
    # Of constants alone.
    "clamp": _clamp,
    "smoothstep": _smoothstep,
    "power": _binary(np.power, 1.0),
    "modulo": _binary(np.mod, 1.0),
    "min": _binary(np.minimum, 0.0),
    "max": _binary(np.maximum, 0.0),
    "absval": _unary(np.abs),
    "floor": _unary(np.floor),
    "ceil": _unary(np.ceil),
    "round": _unary(np.round),
    "sign": _unary(np.sign),
    "sqrt": _unary(np.sqrt),
    "exp": _unary(np.exp),
    "ln": _unary(np.log),
    "sin": _unary(np.sin),
    "cos": _unary(np.cos),
    "tan": _unary(np.tan),
}
