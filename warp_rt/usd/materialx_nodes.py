# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's arithmetic: what each node of the standard library makes of its inputs.

Reference: MaterialX Specification 1.39, Standard Nodes, and the node graphs of its reference library (place2d, ramp4,
...).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from warp_rt.usd.hsv import adjusted_hsv, hsv_from_rgb, rgb_from_hsv
from warp_rt.usd.noise import cells, perlin, perlin_vector, worley
from warp_rt.usd.signals import DoesNotFold, Signal, add, apply, apply_to_all, join, multiply
from warp_rt.usd.texture_coordinates import rotation

_SIZES = {"float": 1, "integer": 1, "boolean": 1, "color3": 3, "color4": 4, "vector2": 2, "vector3": 3, "vector4": 4}
_NODE = re.compile(r"ND_([a-z0-9]+)(?:_(.+))?")
_TYPE = re.compile("|".join(_SIZES))
_CHANNELS = {**{name: k for k, name in enumerate("xyzw")}, **{name: k for k, name in enumerate("rgba")}}
_FRACTAL = (("lacunarity", 2.0), ("diminish", 0.5))
_MAX_OCTAVES = 16  # beyond, they are finer than texels are
_ALPHA_OFFSET = (19.0, 73.0)  # where the fourth component of a noise is that of a number
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
    """Return what a node computes; of constants, that may be no number.

    Args:
        identifier: Of the node: ``ND_multiply_color3``.
        output: Name of its output.
        read: Gives the signal of an input, or None.
        text: Gives the text of an input, or nothing.

    Raises:
        DoesNotFold: The node is not known, or what it is given is none of what it can be computed of.
    """
    match = _NODE.fullmatch(identifier)
    function = _NODES.get(match[1]) if match else None
    if match is None or function is None:
        raise DoesNotFold
    kinds = tuple(_TYPE.findall(match[2] or "vector3"))  # ND_normalmap alone names no type
    if not kinds:
        raise DoesNotFold
    with np.errstate(all="ignore"):
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
    return _blend(node.get("bg"), node.get("fg"), node.get("mix"))


def _dot_product(node: NodeInputs) -> Signal:
    product = multiply(node.get("in1"), node.get("in2"))
    return product.map(np.ones((1, product.size)))


def _luminance(node: NodeInputs) -> Signal:
    color, weights = node.get("in"), node.get("lumacoeffs", _AP1_LUMINANCE).constant_value()
    result = color.pick(range(3)).map(np.tile(weights, (3, 1)))
    return join([result, color.pick([3])]) if node.size == 4 else result


def _range(node: NodeInputs) -> Signal:
    low, high = node.get("inlow"), node.get("inhigh", 1.0)
    start, end = node.get("outlow"), node.get("outhigh", 1.0)
    share = multiply(add(node.get("in"), low, -1.0), apply(np.reciprocal, add(high, low, -1.0)))
    gamma = node.get("gamma", 1.0)
    if gamma.value is None or set(gamma.value) != {1.0}:
        share = apply(_gamma_curve, share, gamma)
    result = add(start, multiply(share, add(end, start, -1.0)))
    return apply(np.clip, result, start, end) if node.number("doclamp", 0.0) else result


def _gamma_curve(values: np.ndarray, gamma: np.ndarray) -> np.ndarray:
    return np.asarray(np.sign(values) * np.abs(values) ** (1.0 / gamma))


def _if(holds: np.ufunc) -> Callable[[NodeInputs], Signal]:
    def chosen(first: np.ndarray, second: np.ndarray, yes: np.ndarray, no: np.ndarray) -> np.ndarray:
        return np.where(holds(first, second), yes, no)

    chosen.__name__ = f"chosen where {holds.__name__}"  # tells all about it, as ``apply`` asks for

    def choose(node: NodeInputs) -> Signal:
        first, second = (node.read(name) or Signal.constant([value]) for name, value in (("value1", 1), ("value2", 0)))
        if first.value is not None and second.value is not None:
            return node.get("in1" if holds(first.value[0], second.value[0]) else "in2")
        return apply(chosen, first, second, node.get("in1"), node.get("in2"))

    return choose


def _switch(node: NodeInputs) -> Signal:
    return node.get(f"in{int(node.number('which', 0.0)) + 1}")


def _place(node: NodeInputs) -> Signal:
    """Return moved texture coordinates: scaled, turned, shifted, or by ``operationorder`` 1 the other way round."""
    pivot, offset = (node.get(name).resized(2).constant_value() for name in ("pivot", "offset"))
    shrink = np.diag(apply(np.reciprocal, node.get("scale", 1.0)).resized(2).constant_value())
    turn = rotation(node.number("rotate", 0.0))
    coordinates = _coordinates(node).map(np.eye(2), -pivot)
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
    return apply(_smooth_step, node.get("in"), node.get("low"), node.get("high", 1.0))


def _smooth_step(value: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    x = np.clip((value - low) / (high - low), 0, 1)
    return np.asarray(x * x * (3 - 2 * x))


# --- of texture coordinates


def _coordinates(node: NodeInputs) -> Signal:
    return node.get("texcoord").resized(2)


def _along(node: NodeInputs, axis: int) -> Signal:
    """Return s or t, from 0 to 1."""
    return apply(np.clip, _coordinates(node).pick([axis]), Signal.constant([0.0]), Signal.constant([1.0]))


def _blend(start: Signal, end: Signal, share: Signal) -> Signal:
    return add(start, multiply(add(end, start, -1.0), share))


def _ramp(start: str, end: str, axis: int) -> Callable[[NodeInputs], Signal]:
    return lambda node: _blend(node.get(start), node.get(end), _along(node, axis))


def _ramp_of_corners(node: NodeInputs) -> Signal:
    across = _along(node, 0)
    top, bottom = (_blend(node.get(f"value{side}l"), node.get(f"value{side}r"), across) for side in "tb")
    return _blend(top, bottom, _along(node, 1))


def _split(start: str, end: str, axis: int) -> Callable[[NodeInputs], Signal]:
    def split(node: NodeInputs) -> Signal:
        center = Signal.constant([node.number("center", 0.5)])
        return _blend(node.get(start), node.get(end), apply(_step, _coordinates(node).pick([axis]), center))

    return split


def _step(value: np.ndarray, edge: np.ndarray) -> np.ndarray:
    return np.asarray(value >= edge, float)


def _checkerboard(node: NodeInputs) -> Signal:
    tiling, offset = (
        (node.read(name) or Signal.constant([value] * 2)).resized(2)
        for name, value in (("uvtiling", 8), ("uvoffset", 0))
    )
    place = add(multiply(_coordinates(node), tiling), offset, -1.0)
    return _blend(node.get("color1", 1.0), node.get("color2", 0.0), apply_to_all(_is_odd, 1, place))


def _is_odd(place: np.ndarray) -> np.ndarray:
    return np.asarray(np.floor(place).sum(axis=1, keepdims=True) % 2)


def _noise(node: NodeInputs) -> Signal:
    found = _perlin_at(_coordinates(node), node.size)
    return add(multiply(found, node.get("amplitude", 1.0)), node.get("pivot", 0.0))


def _fractal(node: NodeInputs) -> Signal:
    """Return octaves of noise, each ``lacunarity`` times as fine as the one before and ``diminish`` times as strong."""
    octaves = int(node.number("octaves", 3.0))
    if not 0 <= octaves <= _MAX_OCTAVES:
        raise DoesNotFold
    place, total, strength = _coordinates(node), Signal.constant([0.0] * node.size), Signal.constant([1.0])
    lacunarity, diminish = (node.read(name) or Signal.constant([value]) for name, value in _FRACTAL)
    for _ in range(octaves):
        total = add(total, multiply(_perlin_at(place, node.size), strength))
        place, strength = multiply(place, lacunarity), multiply(strength, diminish)
    return multiply(total, node.get("amplitude", 1.0))


def _perlin_at(place: Signal, size: int) -> Signal:
    """Return the noise of a number, of as many components of a vector, or of a colour and its alpha."""
    if size == 1:
        return apply_to_all(perlin, 1, place)
    vector = apply_to_all(perlin_vector, 3, place)
    if size < 4:
        return vector.pick(range(size))
    return join([vector, apply_to_all(perlin, 1, add(place, Signal.constant(_ALPHA_OFFSET)))])


def _cells(node: NodeInputs) -> Signal:
    return apply_to_all(cells, 1, _coordinates(node))


def _worley(node: NodeInputs) -> Signal:
    if node.size != 1 or node.number("style", 0.0):
        raise DoesNotFold
    return apply_to_all(worley, 1, _coordinates(node), Signal.constant([node.number("jitter", 1.0)]))


# --- of all components of a colour or vector


def _hsv(function: Callable[..., np.ndarray]) -> Callable[[NodeInputs], Signal]:
    """Return a function of red, green and blue; alpha stays."""

    def convert(node: NodeInputs) -> Signal:
        color = node.get("in")
        result = apply_to_all(function, 3, color.pick(range(3)))
        return join([result, color.pick([3])]) if color.size == 4 else result

    return convert


def _adjust_hsv(node: NodeInputs) -> Signal:
    color = node.get("in")
    amount = node.read("amount") or Signal.constant([0.0, 1.0, 1.0])
    result = apply_to_all(adjusted_hsv, 3, color.pick(range(3)), amount.resized(3))
    return join([result, color.pick([3])]) if color.size == 4 else result


def _saturate(node: NodeInputs) -> Signal:
    return _blend(_luminance(node), node.get("in"), node.read("amount") or Signal.constant([1.0]))


def _contrast(node: NodeInputs) -> Signal:
    pivot = node.get("pivot", 0.5)
    return add(pivot, multiply(add(node.get("in"), pivot, -1.0), node.get("amount", 1.0)))


def _magnitude(node: NodeInputs) -> Signal:
    return apply_to_all(_length, 1, node.get("in"))


def _distance(node: NodeInputs) -> Signal:
    return apply_to_all(_length, 1, add(node.get("in1"), node.get("in2"), -1.0))


def _normalize(node: NodeInputs) -> Signal:
    return apply_to_all(_unit, node.size, node.get("in").resized(node.size))


def _cross_product(node: NodeInputs) -> Signal:
    return apply_to_all(np.cross, 3, node.get("in1").resized(3), node.get("in2").resized(3))


def _length(values: np.ndarray) -> np.ndarray:
    return np.linalg.norm(values, axis=1, keepdims=True)


def _unit(values: np.ndarray) -> np.ndarray:
    return np.asarray(values / np.maximum(_length(values), np.finfo(float).tiny))


def _premultiply(node: NodeInputs) -> Signal:
    color = node.get("in")
    return join([multiply(color.pick(range(3)), color.pick([3])), color.pick([3])])


def _unpremultiply(node: NodeInputs) -> Signal:
    return apply_to_all(_divided_by_alpha, 4, node.get("in").resized(4))


def _divided_by_alpha(color: np.ndarray) -> np.ndarray:
    alpha = color[:, 3:]
    return np.concatenate([np.where(alpha == 0, color[:, :3], color[:, :3] / alpha), alpha], axis=1)


# --- of two, mixed with the second


def _composite(operator: Callable[[Signal, Signal], Signal]) -> Callable[[NodeInputs], Signal]:
    def composite(node: NodeInputs) -> Signal:
        foreground, background = node.get("fg"), node.get("bg")
        share = node.read("mix") or Signal.constant([1.0])
        return _blend(background, operator(foreground, background), share)

    return composite


def _difference(a: Signal, b: Signal) -> Signal:
    return apply(np.abs, add(b, a, -1.0))


def _screen(a: Signal, b: Signal) -> Signal:
    return add(add(a, b), multiply(a, b), -1.0)


def _safe_power(base: np.ndarray, exponent: np.ndarray) -> np.ndarray:
    return np.asarray(np.sign(base) * np.abs(base) ** exponent)


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.floor(values + 0.5)  # halves upwards, where NumPy's own takes them to even numbers


def _fraction(values: np.ndarray) -> np.ndarray:
    return np.asarray(values - np.floor(values))


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
    "plus": _composite(lambda a, b: add(b, a)),
    "minus": _composite(lambda a, b: add(b, a, -1.0)),
    "difference": _composite(_difference),
    "screen": _composite(_screen),
    "invert": lambda node: add(node.get("amount", 1.0), node.get("in"), -1.0),
    "dotproduct": _dot_product,
    "luminance": _luminance,
    "range": _range,
    "remap": _range,
    "contrast": _contrast,
    "saturate": _saturate,
    "rgbtohsv": _hsv(hsv_from_rgb),
    "hsvtorgb": _hsv(rgb_from_hsv),
    "hsvadjust": _adjust_hsv,
    "premult": _premultiply,
    "unpremult": _unpremultiply,
    "inside": lambda node: multiply(node.get("in"), node.get("mask", 1.0)),
    "outside": lambda node: multiply(node.get("in"), add(Signal.constant([1.0]), node.get("mask"), -1.0)),
    "magnitude": _magnitude,
    "distance": _distance,
    "normalize": _normalize,
    "crossproduct": _cross_product,
    "ifgreater": _if(np.greater),
    "ifgreatereq": _if(np.greater_equal),
    "ifequal": _if(np.equal),
    "switch": _switch,
    "place2d": _place,
    "rotate2d": _rotate,
    "normalmap": _normal_map,
    "ramplr": _ramp("valuel", "valuer", 0),
    "ramptb": _ramp("valuet", "valueb", 1),
    "ramp4": _ramp_of_corners,
    "splitlr": _split("valuel", "valuer", 0),
    "splittb": _split("valuet", "valueb", 1),
    "checkerboard": _checkerboard,
    "noise2d": _noise,
    "fractal2d": _fractal,
    "cellnoise2d": _cells,
    "worleynoise2d": _worley,
    "clamp": _clamp,
    "smoothstep": _smoothstep,
    "power": _binary(np.power, 1.0),
    "safepower": _binary(_safe_power, 1.0),
    "modulo": _binary(np.mod, 1.0),
    "min": _binary(np.minimum, 0.0),
    "max": _binary(np.maximum, 0.0),
    "absval": _unary(np.abs),
    "floor": _unary(np.floor),
    "ceil": _unary(np.ceil),
    "round": _unary(_rounded),
    "sign": _unary(np.sign),
    "sqrt": _unary(np.sqrt),
    "exp": _unary(np.exp),
    "ln": _unary(np.log),
    "sin": _unary(np.sin),
    "cos": _unary(np.cos),
    "tan": _unary(np.tan),
    "asin": _unary(np.arcsin),
    "acos": _unary(np.arccos),
    "fract": _unary(_fraction),
    "atan2": lambda node: apply(np.arctan2, node.get("iny"), node.get("inx", 1.0)),
}
