# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's arithmetic: what each node of the standard library makes of its inputs.

Reference: MaterialX Specification 1.39, Standard Nodes, and the node graphs of its reference library (place2d, ramp4,
...).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

import numpy as np

from warp_rt.usd.blackbody import blackbody
from warp_rt.usd.hsv import adjusted_hsv, hsv_from_rgb, rgb_from_hsv
from warp_rt.usd.materialx_compositing import COMPOSITES
from warp_rt.usd.materialx_heights import HEIGHTS
from warp_rt.usd.materialx_noises import NOISES
from warp_rt.usd.materialx_patterns import PATTERNS, smooth_step
from warp_rt.usd.materialx_places import PLACES, dot, length, turned, turned_in_space, unit
from warp_rt.usd.materialx_tilings import TILINGS
from warp_rt.usd.node_inputs import SIZES, Node, NodeInputs
from warp_rt.usd.signals import (
    DoesNotFold,
    Signal,
    add,
    apply,
    apply_to_all,
    blend,
    choose,
    join,
    multiply,
    steps_of,
)

_BRANCHES = 10  # of a switch
_NODE = re.compile(r"ND_(?:(logical_[a-z]+)|([a-z0-9]+)(?:_(.+))?)")
_TYPE = re.compile("|".join(SIZES))
_UNTYPED = {"normalmap": ("vector3",), "ramp": ("color4",), "blackbody": ("color3",)}
_CHANNELS = {**{name: k for k, name in enumerate("xyzw")}, **{name: k for k, name in enumerate("rgba")}}
_AP1_LUMINANCE = (0.2722287, 0.6740818, 0.0536895)  # the default of luminance's coefficients


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
    category, kinds = _parsed(identifier)
    function = _NODES.get(category)
    if function is None or not kinds:
        raise DoesNotFold
    with np.errstate(all="ignore"):
        return function(NodeInputs(output, kinds, read, text, variant=_TYPE.split(identifier)[-1]))


def is_known_node(identifier: str) -> bool:
    """Return whether a node is one of those that fold, where what they are given lets them."""
    return _parsed(identifier)[0] in _NODES


def _parsed(identifier: str) -> tuple[str, tuple[str, ...]]:
    """Return the name of a node without its types, and these; empty for what is no node of MaterialX."""
    match = _NODE.fullmatch(identifier)
    if match is None:
        return "", ()
    if match[1]:
        return match[1], ("boolean",)
    return match[2], tuple(_TYPE.findall(match[3])) if match[3] else _UNTYPED.get(match[2], ())


def _convert(node: NodeInputs) -> Signal:
    given = node.get("in")
    if node.kinds[-1] == "boolean":
        return _truth(given)
    if node.output_size == 4 and 1 < node.size < 4:
        return join([given.resized(3), Signal.constant([1.0])])
    return given.resized(node.output_size)


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


def _combine(count: int) -> Node:
    def combine(node: NodeInputs) -> Signal:
        # Of several types: two vectors of two, or one of three and a number.
        sizes = {"VV": (2, 2), "VF": (3, 1), "CF": (3, 1)}.get(node.variant, (1,) * count)
        return join([node.sized(f"in{k}", size) for k, size in enumerate(sizes, start=1)])

    return combine


def _divide(node: NodeInputs) -> Signal:
    return multiply(node.get("in1"), apply(np.reciprocal, node.get("in2", 1.0)))


def _luminance(node: NodeInputs) -> Signal:
    color, weights = node.get("in"), node.get("lumacoeffs", _AP1_LUMINANCE)
    if weights.size < 3:
        raise DoesNotFold
    result = dot(color.pick(range(3)), weights.resized(3)).resized(3)
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


@steps_of(_gamma_curve)
def _gamma_curve_steps(values: Signal, gamma: Signal) -> Signal:
    return apply(_safe_power, values, apply(np.reciprocal, gamma))


def _if(holds: np.ufunc, default: float) -> Node:
    """Return the node of a comparison, whose first value has a default; the second's is 0.

    Without branches it gives whether it holds; the first of two numbers is then 1.
    """

    def branch(node: NodeInputs) -> Signal:
        is_truth = node.kinds == ("boolean",) and node.read("in1") is None and node.read("in2") is None
        of_numbers = is_truth and node.variant != "B"
        first = node.read("value1") or Signal.constant([1.0 if of_numbers else default])
        second = node.sized("value2", 1)
        if is_truth:
            return apply(holds, first, second)
        if first.value is not None and second.value is not None:
            return node.get("in1" if holds(first.value[0], second.value[0]) else "in2")
        return choose(apply(holds, first, second), node.get("in1"), node.get("in2"))

    return branch


def _switch(node: NodeInputs) -> Signal:
    """Return the branch of a number, each from one whole number to the next, the first below; 0 beyond the last."""
    which = node.sized("which", 1)
    if which.value is not None:
        number = max(int(which.value[0]), 0) + 1
        return node.get(f"in{number}") if number <= _BRANCHES else Signal.constant([0.0] * node.size)
    found = Signal.constant([0.0] * node.size)
    for number in range(_BRANCHES, 0, -1):
        is_below = apply(np.greater, Signal.constant([float(number)]), which)
        found = choose(is_below, node.get(f"in{number}"), found)
    return found


def _place(node: NodeInputs) -> Signal:
    """Return moved texture coordinates: scaled, turned, shifted, or by ``operationorder`` 1 the other way round."""
    pivot, offset = (node.get(name).resized(2) for name in ("pivot", "offset"))
    shrink, degrees = apply(np.reciprocal, node.get("scale", 1.0)).resized(2), node.sized("rotate", 1)
    coordinates = add(node.coordinates, pivot, -1.0)
    if node.number("operationorder", 0.0) == 0.0:
        moved = add(turned(multiply(coordinates, shrink), degrees), offset, -1.0)
    else:
        moved = multiply(turned(add(coordinates, offset, -1.0), degrees), shrink)
    return add(moved, pivot)


def _rotate(node: NodeInputs) -> Signal:
    return turned(node.get("in").resized(2), node.sized("amount", 1))


def _rotate_in_space(node: NodeInputs) -> Signal:
    """Return a vector turned about an axis."""
    return turned_in_space(node.sized("in", 3), node.sized("amount", 1), node.get("axis", (0.0, 1.0, 0.0)).resized(3))


def _clamp(node: NodeInputs) -> Signal:
    return apply(np.clip, node.get("in"), node.get("low"), node.get("high", 1.0))


def _smoothstep(node: NodeInputs) -> Signal:
    return apply(smooth_step, node.get("in"), node.get("low"), node.get("high", 1.0))


# --- of all components of a colour or vector


def _hsv(function: Callable[..., np.ndarray]) -> Node:
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


def _correct(node: NodeInputs) -> Signal:
    """Return a colour turned in hue, saturated, and put through the curves of a grading tool, in this order."""
    color = node.get("in", (1.0, 1.0, 1.0, 0.0)[: node.size])
    numbers = {
        name: node.read(name) or Signal.constant([value])
        for name, value in (
            *(("hue", 0.0), ("saturation", 1.0), ("gamma", 1.0), ("lift", 0.0), ("gain", 1.0)),
            *(("contrast", 1.0), ("contrastpivot", 0.5), ("exposure", 0.0)),
        )
    }
    one, pivot, lift = Signal.constant([1.0]), numbers["contrastpivot"], numbers["lift"]
    result = color.pick(range(3))
    if numbers["hue"].value != (0.0,):
        result = apply_to_all(adjusted_hsv, 3, result, join([numbers["hue"], one, one]))
    grey = result.map(np.tile(_AP1_LUMINANCE, (3, 1)))
    result = blend(grey, result, numbers["saturation"])
    if numbers["gamma"].value != (1.0,):
        result = apply(_gamma_curve, result, numbers["gamma"])
    result = multiply(blend(result, one, lift), numbers["gain"])
    result = add(pivot, multiply(add(result, pivot, -1.0), numbers["contrast"]))
    result = multiply(result, apply(np.exp2, numbers["exposure"]))
    return join([result, color.pick([3])]) if color.size == 4 else result


def _saturate(node: NodeInputs) -> Signal:
    return blend(_luminance(node), node.get("in"), node.read("amount") or Signal.constant([1.0]))


def _contrast(node: NodeInputs) -> Signal:
    pivot = node.get("pivot", 0.5)
    return add(pivot, multiply(add(node.get("in"), pivot, -1.0), node.get("amount", 1.0)))


def _blackbody(node: NodeInputs) -> Signal:
    return apply_to_all(blackbody, 3, (node.read("temperature") or Signal.constant([5000.0])).pick([0]))


def _magnitude(node: NodeInputs) -> Signal:
    return apply_to_all(length, 1, node.get("in"))


def _distance(node: NodeInputs) -> Signal:
    return apply_to_all(length, 1, add(node.get("in1"), node.get("in2"), -1.0))


def _normalize(node: NodeInputs) -> Signal:
    return apply_to_all(unit, node.size, node.get("in").resized(node.size))


def _cross_product(node: NodeInputs) -> Signal:
    return apply_to_all(np.cross, 3, node.get("in1").resized(3), node.get("in2").resized(3))


# --- component by component


def _safe_power(base: np.ndarray, exponent: np.ndarray) -> np.ndarray:
    return np.asarray(np.sign(base) * np.abs(base) ** exponent)


@steps_of(_safe_power)
def _safe_power_steps(base: Signal, exponent: Signal) -> Signal:
    return multiply(apply(np.sign, base), apply(np.power, apply(np.abs, base), exponent))


def _rounded(values: np.ndarray) -> np.ndarray:
    return np.floor(values + 0.5)  # halves upwards, where NumPy's own takes them to even numbers


@steps_of(_rounded)
def _rounded_steps(values: Signal) -> Signal:
    return apply(np.floor, add(values, Signal.constant([0.5])))


def _triangle_wave(values: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 - np.abs(np.abs(values) % 1.0 - 0.5))


@steps_of(_triangle_wave)
def _triangle_wave_steps(values: Signal) -> Signal:
    half = Signal.constant([0.5])
    part = apply(np.mod, apply(np.abs, values), Signal.constant([1.0]))
    return add(half, apply(np.abs, add(part, half, -1.0)), -1.0)


def _fraction(values: np.ndarray) -> np.ndarray:
    return np.asarray(values - np.floor(values))


@steps_of(_fraction)
def _fraction_steps(values: Signal) -> Signal:
    return add(values, apply(np.floor, values), -1.0)


@steps_of(np.logical_not)
def _not_steps(value: Signal) -> Signal:
    return choose(value, Signal.constant([0.0]), Signal.constant([1.0]))


@steps_of(np.logical_and)
def _and_steps(first: Signal, second: Signal) -> Signal:
    return choose(first, _truth(second), Signal.constant([0.0]))


@steps_of(np.logical_or)
def _or_steps(first: Signal, second: Signal) -> Signal:
    return choose(first, Signal.constant([1.0]), _truth(second))


@steps_of(np.logical_xor)
def _xor_steps(first: Signal, second: Signal) -> Signal:
    return choose(first, apply(np.logical_not, second), _truth(second))


def _truth(value: Signal) -> Signal:
    return choose(value, Signal.constant([1.0]), Signal.constant([0.0]))


def _unary(function: Callable[[np.ndarray], np.ndarray]) -> Node:
    return lambda node: apply(function, node.get("in"))


def _binary(function: Callable[..., np.ndarray], second: float) -> Node:
    return lambda node: apply(function, node.get("in1"), node.get("in2", second))


_NODES: Mapping[str, Node] = {
    **COMPOSITES,
    **HEIGHTS,
    **NOISES,
    **PATTERNS,
    **PLACES,
    **TILINGS,
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
    "invert": lambda node: add(node.get("amount", 1.0), node.get("in"), -1.0),
    "dotproduct": lambda node: dot(node.get("in1"), node.get("in2")),
    "luminance": _luminance,
    "range": _range,
    "remap": _range,
    "contrast": _contrast,
    "saturate": _saturate,
    "rgbtohsv": _hsv(hsv_from_rgb),
    "hsvtorgb": _hsv(rgb_from_hsv),
    "hsvadjust": _adjust_hsv,
    "colorcorrect": _correct,
    "blackbody": _blackbody,
    "magnitude": _magnitude,
    "distance": _distance,
    "normalize": _normalize,
    "crossproduct": _cross_product,
    "ifgreater": _if(np.greater, 1.0),
    "ifgreatereq": _if(np.greater_equal, 1.0),
    "ifequal": _if(np.equal, 0.0),
    "switch": _switch,
    "place2d": _place,
    "rotate2d": _rotate,
    "rotate3d": _rotate_in_space,
    "trianglewave": _unary(_triangle_wave),
    "logical_and": _binary(np.logical_and, 0.0),
    "logical_or": _binary(np.logical_or, 0.0),
    "logical_xor": _binary(np.logical_xor, 0.0),
    "logical_not": _unary(np.logical_not),
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
    "ln": lambda node: apply(np.log, node.get("in", 1.0)),
    "sin": _unary(np.sin),
    "cos": _unary(np.cos),
    "tan": _unary(np.tan),
    "asin": _unary(np.arcsin),
    "acos": _unary(np.arccos),
    "fract": _unary(_fraction),
    "atan2": lambda node: apply(np.arctan2, node.get("iny"), node.get("inx", 1.0)),
}
