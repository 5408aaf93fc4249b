# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's nodes of texture coordinates: ramps, splits, chequers, shapes and noises.

Reference: MaterialX Specification 1.39, Procedural Nodes, and the node graphs of its reference library.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warp_rt.usd.node_inputs import Node, NodeInputs
from warp_rt.usd.noise import cells, perlin, perlin_vector, worley, worley_vector
from warp_rt.usd.signals import DoesNotFold, Signal, add, apply, apply_to_all, blend, join, multiply
from warp_rt.usd.texture_coordinates import rotation

_FRACTAL = (("lacunarity", 2.0), ("diminish", 0.5))
_MAX_STOPS = 10
_MAX_OCTAVES = 16  # beyond, they are finer than texels are
_ALPHA_OFFSET = (19.0, 73.0)  # where the fourth component of a noise is that of a number


def smooth_step(value: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return MaterialX's smoothstep: 0 up to ``low``, 1 from ``high`` on, and between 3 x^2 - 2 x^3."""
    x = np.clip((value - low) / (high - low), 0, 1)
    return np.asarray(x * x * (3 - 2 * x))


def _along(node: NodeInputs, axis: int) -> Signal:
    """Return s or t, from 0 to 1."""
    return apply(np.clip, node.coordinates.pick([axis]), Signal.constant([0.0]), Signal.constant([1.0]))


def _ramp(start: str, end: str, axis: int) -> Node:
    return lambda node: blend(node.get(start), node.get(end), _along(node, axis))


def _ramp_of_corners(node: NodeInputs) -> Signal:
    across = _along(node, 0)
    top, bottom = (blend(node.get(f"value{side}l"), node.get(f"value{side}r"), across) for side in "tb")
    return blend(top, bottom, _along(node, 1))


def _split(start: str, end: str, axis: int) -> Node:
    def split(node: NodeInputs) -> Signal:
        center = Signal.constant([node.number("center", 0.5)])
        return blend(node.get(start), node.get(end), apply(_step, node.coordinates.pick([axis]), center))

    return split


def _step(value: np.ndarray, edge: np.ndarray) -> np.ndarray:
    return np.asarray(value >= edge, float)


def _checkerboard(node: NodeInputs) -> Signal:
    tiling, offset = (
        (node.read(name) or Signal.constant([value] * 2)).resized(2)
        for name, value in (("uvtiling", 8), ("uvoffset", 0))
    )
    place = add(multiply(node.coordinates, tiling), offset, -1.0)
    return blend(node.get("color1", 1.0), node.get("color2", 0.0), apply_to_all(_is_odd, 1, place))


def _is_odd(place: np.ndarray) -> np.ndarray:
    return np.asarray(np.floor(place).sum(axis=1, keepdims=True) % 2)


def _noise(node: NodeInputs) -> Signal:
    found = _perlin_at(node.coordinates, node.size)
    return add(multiply(found, node.get("amplitude", 1.0)), node.get("pivot", 0.0))


def _fractal(node: NodeInputs) -> Signal:
    """Return octaves of noise, each ``lacunarity`` times as fine as the one before and ``diminish`` times as strong."""
    octaves = int(node.number("octaves", 3.0))
    if not 0 <= octaves <= _MAX_OCTAVES:
        raise DoesNotFold
    place, total, strength = node.coordinates, Signal.constant([0.0] * node.size), Signal.constant([1.0])
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
    return apply_to_all(cells, 1, node.coordinates)


def _worley(node: NodeInputs) -> Signal:
    """Return the distances to the nearest points, as many as there are components."""
    if node.number("style", 0.0):
        raise DoesNotFold
    jitter = Signal.constant([node.number("jitter", 1.0)])
    if node.size == 1:
        return apply_to_all(worley, 1, node.coordinates, jitter)
    return apply_to_all(worley_vector, 3, node.coordinates, jitter).pick(range(node.size))


def _unified(node: NodeInputs) -> Signal:
    """Return one of the noises, scaled, moved, and turned by the jitter in a way that nobody can tell from chance."""
    kind, jitter = int(node.number("type", 0.0)), node.number("jitter", 1.0)
    place = multiply(node.coordinates, (node.read("freq") or Signal.constant([1.0, 1.0])).resized(2))
    place = add(place, (node.read("offset") or Signal.constant([0.0, 0.0])).resized(2))
    turned = place.map(rotation(90000.0 * (jitter - 1.0)))
    if kind == 0:
        found = apply_to_all(perlin, 1, turned).map(np.array([[0.5]]), 0.5)
    elif kind == 1:
        found = apply_to_all(cells, 1, turned)
    elif kind == 2 and not node.number("style", 0.0):
        found = apply_to_all(worley, 1, place, Signal.constant([jitter]))
    else:
        raise DoesNotFold  # a fractal in space
    low, high = node.get("outmin"), node.get("outmax", 1.0)
    found = blend(low, high, found)
    return apply(np.clip, found, low, high) if node.number("clampoutput", 1.0) else found


def _random(node: NodeInputs) -> Signal:
    """Return the number of a cell that value and seed name."""
    scale = 1.0 if node.kinds[0] == "integer" else 4096.0
    place = join([node.get("in").pick([0]).map(np.array([[scale]])), Signal.constant([node.number("seed", 0.0)])])
    low, high = (node.read(name) or Signal.constant([value]) for name, value in (("min", 0.0), ("max", 1.0)))
    return blend(low, high, apply_to_all(cells, 1, place))


def _circle(node: NodeInputs) -> Signal:
    center = (node.read("center") or Signal.constant([0.0, 0.0])).resized(2)
    radius = node.read("radius") or Signal.constant([0.5])
    return apply_to_all(_is_within, 1, add(node.coordinates, center, -1.0), radius)


def _is_within(place: np.ndarray, radius: np.ndarray) -> np.ndarray:
    return np.asarray((place**2).sum(axis=1, keepdims=True) <= radius**2, float)


def _line(node: NodeInputs) -> Signal:
    center, start, end, radius = (
        node.read(name) or Signal.constant(value)
        for name, value in (
            *(("center", (0.0, 0.0)), ("point1", (0.25, 0.25))),
            *(("point2", (0.75, 0.75)), ("radius", (0.1,))),
        )
    )
    return apply_to_all(_is_by_line, 1, add(node.coordinates, center.resized(2), -1.0), start, end, radius)


def _is_by_line(place: np.ndarray, start: np.ndarray, end: np.ndarray, radius: np.ndarray) -> np.ndarray:
    way, way_to = end - start, place - start
    along = np.clip((way_to * way).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)[:, None]
    return np.asarray(np.linalg.norm(way_to - along * way, axis=1, keepdims=True) <= radius, float)


def _ramp_of_stops(node: NodeInputs) -> Signal:
    """Return a ramp of up to ten colours along s, about the middle, away from it, or away from it in squares."""
    count = int(node.number("num_intervals", 2.0))
    if not 1 <= count <= _MAX_STOPS:
        raise DoesNotFold
    stops = np.array([node.number(f"interval{k}", 0.0 if k == 1 else 1.0) for k in range(1, count + 1)])
    defaults = ((0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0, 1.0))
    colors = [node.get(f"color{k}", defaults[k > 1]).resized(4).constant_value() for k in range(1, count + 1)]
    ways = {0: _across, 1: _about, 2: _away, 3: _in_squares}
    shapes = {0: _straight, 1: _smooth, 2: _stepped}
    way, shape = ways.get(int(node.number("type", 0.0))), shapes.get(int(node.number("interpolation", 1.0)))
    if way is None or shape is None:
        raise DoesNotFold
    place = apply_to_all(way, 1, node.coordinates)
    result = Signal.constant(colors[0].tolist())
    for k in range(count - 1):
        inside = [Signal.constant([stop]) for stop in stops[k : k + 2]]
        start, end = (Signal.constant(color.tolist()) for color in colors[k : k + 2])
        part = blend(start, end, apply(shape, place, *inside))
        result = apply_to_all(_from_stop, 4, result, part, place, inside[0])
    return result


def _from_stop(before: np.ndarray, beyond: np.ndarray, place: np.ndarray, stop: np.ndarray) -> np.ndarray:
    return np.where(place > stop, beyond, before)


def _across(st: np.ndarray) -> np.ndarray:
    return st[:, :1]


def _about(st: np.ndarray) -> np.ndarray:
    return np.asarray(np.arctan2(st[:, :1] - 0.5, st[:, 1:] - 0.5) / (2.0 * np.pi) + 0.5)


def _away(st: np.ndarray) -> np.ndarray:
    return np.linalg.norm(st - 0.5, axis=1, keepdims=True) * 1.414  # the reference library's root of 2


def _in_squares(st: np.ndarray) -> np.ndarray:
    return np.asarray(2.0 * np.abs(st - 0.5).max(axis=1, keepdims=True))


def _straight(place: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.clip((place - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)


def _smooth(place: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return smooth_step(place, low, np.where(high > low, high, low + 1.0))


def _stepped(place: np.ndarray, _: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.asarray(place >= high, float)


PATTERNS: Mapping[str, Node] = {
    "ramp": _ramp_of_stops,
    "ramplr": _ramp("valuel", "valuer", 0),
    "ramptb": _ramp("valuet", "valueb", 1),
    "ramp4": _ramp_of_corners,
    "splitlr": _split("valuel", "valuer", 0),
    "splittb": _split("valuet", "valueb", 1),
    "checkerboard": _checkerboard,
    "circle": _circle,
    "line": _line,
    "noise2d": _noise,
    "fractal2d": _fractal,
    "cellnoise2d": _cells,
    "worleynoise2d": _worley,
    "unifiednoise2d": _unified,
    "randomfloat": _random,
}
"""By name of the node."""
