# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's nodes of texture coordinates: ramps, splits, chequers and shapes.

Reference: MaterialX Specification 1.39, Procedural Nodes, and the node graphs of its reference library.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warp_rt.scene.programs import Op
from warp_rt.usd.node_inputs import Node, NodeInputs
from warp_rt.usd.signals import (
    DoesNotFold,
    Signal,
    add,
    apply,
    apply_to_all,
    blend,
    choose,
    multiply,
    of_surface,
    steps_of,
)

_MAX_STOPS = 10
_ZERO, _ONE, _HALF = (Signal.constant([value]) for value in (0.0, 1.0, 0.5))


def smooth_step(value: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return MaterialX's smoothstep: 1 from ``high`` on, else 0 up to ``low``, and between 3 x^2 - 2 x^3.

    Arrays of one shape, or that broadcast to one.
    """
    x = np.clip((value - low) / (high - low), 0, 1)
    return np.where(value >= high, 1.0, np.where(value > low, x * x * (3 - 2 * x), 0.0))


@steps_of(smooth_step)
def _smooth_step_steps(value: Signal, low: Signal, high: Signal) -> Signal:
    share = multiply(add(value, low, -1.0), apply(np.reciprocal, add(high, low, -1.0)))
    x = apply(np.clip, share, _ZERO, _ONE)
    between = multiply(multiply(x, x), add(Signal.constant([3.0]), x, -2.0))
    return choose(apply(np.greater_equal, value, high), _ONE, choose(apply(np.greater, value, low), between, _ZERO))


def _along(node: NodeInputs, axis: int) -> Signal:
    """Return s or t, from 0 to 1."""
    return apply(np.clip, node.coordinates.pick([axis]), Signal.constant([0.0]), Signal.constant([1.0]))


def _ramp(start: str, end: str, axis: int) -> Node:
    return lambda node: blend(node.get(start), node.get(end), _along(node, axis))


def _ramp_of_corners(node: NodeInputs) -> Signal:
    across = _along(node, 0)
    top, bottom = (blend(node.get(f"value{side}l"), node.get(f"value{side}r"), across) for side in "tb")
    return blend(bottom, top, _along(node, 1))


def _split(start: str, end: str, axis: int) -> Node:
    def split(node: NodeInputs) -> Signal:
        center = node.read("center") or _HALF
        return blend(node.get(start), node.get(end), apply(_step, node.coordinates.pick([axis]), center))

    return split


def _step(value: np.ndarray, edge: np.ndarray) -> np.ndarray:
    return np.asarray(value >= edge, float)


@steps_of(_step)
def _step_steps(value: Signal, edge: Signal) -> Signal:
    return apply(np.greater_equal, value, edge)


def _checkerboard(node: NodeInputs) -> Signal:
    tiling, offset = (
        (node.read(name) or Signal.constant([value] * 2)).resized(2)
        for name, value in (("uvtiling", 8), ("uvoffset", 0))
    )
    place = add(multiply(node.coordinates, tiling), offset, -1.0)
    return blend(node.get("color2", 0.0), node.get("color1", 1.0), apply_to_all(_is_odd, 1, place))


def _is_odd(place: np.ndarray) -> np.ndarray:
    return np.asarray(np.floor(place).sum(axis=1, keepdims=True) % 2)


@steps_of(_is_odd)
def _is_odd_steps(place: Signal) -> Signal:
    cell = apply(np.floor, place)
    return apply(np.mod, cell.map(np.ones((1, cell.size))), Signal.constant([2.0]))


def _circle(node: NodeInputs) -> Signal:
    center = (node.read("center") or Signal.constant([0.0, 0.0])).resized(2)
    radius = node.read("radius") or Signal.constant([0.5])
    return is_within(add(node.coordinates, center, -1.0), radius)


def is_within(place: Signal, radius: Signal) -> Signal:
    """Return 1 within a circle about the origin, else 0."""
    return apply_to_all(_is_within, 1, place, radius)


def _is_within(place: np.ndarray, radius: np.ndarray) -> np.ndarray:
    return np.asarray((place**2).sum(axis=1, keepdims=True) <= radius**2, float)


@steps_of(_is_within)
def _is_within_steps(place: Signal, radius: Signal) -> Signal:
    squared = multiply(place, place)
    return apply(np.greater_equal, multiply(radius, radius), squared.map(np.ones((1, squared.size))))


def _line(node: NodeInputs) -> Signal:
    center, start, end, radius = (
        node.read(name) or Signal.constant(value)
        for name, value in (
            *(("center", (0.0, 0.0)), ("point1", (0.25, 0.25))),
            *(("point2", (0.75, 0.75)), ("radius", (0.1,))),
        )
    )
    return is_by_line(add(node.coordinates, center.resized(2), -1.0), start, end, radius)


def is_by_line(place: Signal, start: Signal, end: Signal, radius: Signal) -> Signal:
    """Return 1 within a radius of a line from one point to another, else 0."""
    return apply_to_all(_is_by_line, 1, place, start, end, radius)


def _is_by_line(place: np.ndarray, start: np.ndarray, end: np.ndarray, radius: np.ndarray) -> np.ndarray:
    way, way_to = end - start, place - start
    along = np.clip((way_to * way).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)[:, None]
    return np.asarray(np.linalg.norm(way_to - along * way, axis=1, keepdims=True) <= radius, float)


@steps_of(_is_by_line)
def _is_by_line_steps(place: Signal, start: Signal, end: Signal, radius: Signal) -> Signal:
    way, way_to = add(end, start, -1.0), add(place, start, -1.0)
    total = np.ones((1, 2))
    share = multiply(multiply(way_to, way).map(total), apply(np.reciprocal, multiply(way, way).map(total)))
    off = add(way_to, multiply(way, apply(np.clip, share, _ZERO, _ONE)), -1.0)
    return apply(np.greater_equal, radius, of_surface(Op.LENGTH, 1, off))


def _ramp_of_stops(node: NodeInputs) -> Signal:
    """Return a ramp of up to ten colours along s, about the middle, away from it, or away from it in squares."""
    count = int(node.number("num_intervals", 2.0))
    if not 1 <= count <= _MAX_STOPS:
        raise DoesNotFold
    numbers = range(1, count + 1)
    stops = [node.read(f"interval{k}") or (_ZERO if k == 1 else _ONE) for k in numbers]
    defaults = ((0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 1.0))
    colors = [node.get(f"color{k}", defaults[k > 1]).resized(4) for k in numbers]
    ways = {0: _across, 1: _about, 2: _away, 3: _in_squares}
    shapes = {0: _straight, 1: _smooth, 2: _stepped}
    way, shape = ways.get(int(node.number("type", 0.0))), shapes.get(int(node.number("interpolation", 1.0)))
    if way is None or shape is None:
        raise DoesNotFold
    place = apply_to_all(way, 1, node.coordinates)
    result = colors[0]
    for k in range(count - 1):
        part = blend(colors[k], colors[k + 1], apply(shape, place, *stops[k : k + 2]))
        result = apply_to_all(_from_stop, 4, result, part, place, stops[k])
    return result


def _from_stop(before: np.ndarray, beyond: np.ndarray, place: np.ndarray, stop: np.ndarray) -> np.ndarray:
    return np.where(place > stop, beyond, before)


@steps_of(_from_stop)
def _from_stop_steps(before: Signal, beyond: Signal, place: Signal, stop: Signal) -> Signal:
    return choose(apply(np.greater, place, stop), beyond, before)


def _across(st: np.ndarray) -> np.ndarray:
    return st[:, :1]


@steps_of(_across)
def _across_steps(st: Signal) -> Signal:
    return st.pick([0])


def _about(st: np.ndarray) -> np.ndarray:
    return np.asarray(np.arctan2(st[:, :1] - 0.5, st[:, 1:] - 0.5) / (2.0 * np.pi) + 0.5)


@steps_of(_about)
def _about_steps(st: Signal) -> Signal:
    off = add(st, _HALF, -1.0)
    return apply(np.arctan2, off.pick([0]), off.pick([1])).map(np.array([[0.5 / np.pi]]), 0.5)


def _away(st: np.ndarray) -> np.ndarray:
    return np.linalg.norm(st - 0.5, axis=1, keepdims=True) * 1.414  # the reference library's root of 2


@steps_of(_away)
def _away_steps(st: Signal) -> Signal:
    return of_surface(Op.LENGTH, 1, add(st, _HALF, -1.0)).map(np.array([[1.414]]))


def _in_squares(st: np.ndarray) -> np.ndarray:
    return np.asarray(2.0 * np.abs(st - 0.5).max(axis=1, keepdims=True))


@steps_of(_in_squares)
def _in_squares_steps(st: Signal) -> Signal:
    off = apply(np.abs, add(st, _HALF, -1.0))
    return apply(np.maximum, off.pick([0]), off.pick([1])).map(np.array([[2.0]]))


def _straight(place: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.clip((place - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)


@steps_of(_straight)
def _straight_steps(place: Signal, low: Signal, high: Signal) -> Signal:
    width = choose(apply(np.greater, high, low), add(high, low, -1.0), _ONE)
    return apply(np.clip, multiply(add(place, low, -1.0), apply(np.reciprocal, width)), _ZERO, _ONE)


def _smooth(place: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return smooth_step(place, low, np.where(high > low, high, low + 1.0))


@steps_of(_smooth)
def _smooth_steps(place: Signal, low: Signal, high: Signal) -> Signal:
    end = choose(apply(np.greater, high, low), high, add(low, _ONE))
    return apply(smooth_step, place, low, end)


def _stepped(place: np.ndarray, _: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.asarray(place >= high, float)


@steps_of(_stepped)
def _stepped_steps(place: Signal, _: Signal, high: Signal) -> Signal:
    return apply(np.greater_equal, place, high)


PATTERNS: Mapping[str, Node] = {
    "ramp": _ramp_of_stops,
    "ramplr": _ramp("valuel", "valuer", 0),
    "ramptb": _ramp("valueb", "valuet", 1),
    "ramp4": _ramp_of_corners,
    "splitlr": _split("valuel", "valuer", 0),
    "splittb": _split("valueb", "valuet", 1),
    "checkerboard": _checkerboard,
    "circle": _circle,
    "line": _line,
}
"""By name of the node."""
