# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's tiles: grids, hatchings, and circles, clover leaves and hexagons in rows, straight or staggered.

Reference: MaterialX Specification 1.39, Procedural Nodes, and the node graphs of its reference library.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from warp_rt.usd.materialx_patterns import is_by_line, is_within
from warp_rt.usd.materialx_places import dot
from warp_rt.usd.node_inputs import Node, NodeInputs
from warp_rt.usd.signals import Signal, add, apply, choose, join, multiply

_ZERO, _HALF, _ONE = (Signal.constant([value]) for value in (0.0, 0.5, 1.0))
_TRIANGLES = 0.866025  # height of a triangle of sides of 1, to the library's digits
_SLOPE = 0.57735
_THICKNESS = Signal.constant([0.05])

Shape = Callable[[Signal, Signal], Signal]
"""1 within a shape about the origin, of some radius, else 0."""


def _clover_leaf(place: Signal, radius: Signal) -> Signal:
    """Return four circles that touch the middle, of half the radius."""
    doubled = place.map(2.0 * np.eye(2))
    offsets = (join([radius, _ZERO]), join([_ZERO, radius]))
    circles = [is_within(add(doubled, offset, sign), radius) for offset in offsets for sign in (1.0, -1.0)]
    return _any_of(circles)


def _hexagon(place: Signal, radius: Signal) -> Signal:
    """Return a hexagon by its distance: folded twice at its corners' lines, it is an edge."""
    folded = apply(np.abs, place).pick([1, 0])
    for normal in ((-_TRIANGLES, 0.5), (_TRIANGLES, 0.5)):
        line = Signal.constant(normal)
        folded = add(folded, multiply(line, apply(np.minimum, dot(line, folded), _ZERO)), -2.0)
    half = multiply(radius, Signal.constant([_SLOPE]))
    along = apply(np.clip, folded.pick([0]), multiply(half, Signal.constant([-1.0])), half)
    beyond = dot(add(folded, join([along, radius]), -1.0), Signal.constant([1.0, 1.0]))
    return apply(np.greater_equal, _ZERO, beyond)


def _any_of(shapes: list[Signal]) -> Signal:
    found = shapes[0]
    for shape in shapes[1:]:
        found = apply(np.maximum, found, shape)
    return found


def _number(node: NodeInputs, name: str, default: Signal) -> Signal:
    return (node.read(name) or default).pick([0])


def _alone(shape: Shape) -> Node:
    def draw(node: NodeInputs) -> Signal:
        radius = _number(node, "radius", _HALF)
        return shape(add(node.coordinates, node.sized("center", 2), -1.0), radius)

    return draw


# --- in rows


def _scaled(node: NodeInputs) -> Signal:
    tiling = (node.read("uvtiling") or Signal.constant([1.0, 1.0])).resized(2)
    return add(multiply(node.coordinates, tiling), node.sized("uvoffset", 2), -1.0)


def _is_staggered(node: NodeInputs) -> bool:
    return node.number("staggered", 0.0) != 0.0


def _shifted(place: Signal, height: float) -> Signal:
    """Return the way across, where every other row of some height is half a tile on."""
    row = apply(np.mod, place.pick([1]), Signal.constant([2.0 * height]))
    is_odd = apply(np.greater, row, Signal.constant([height]))
    return add(place.pick([0]), choose(is_odd, _HALF, _ZERO))


def _in_tile(place: Signal) -> Signal:
    """Return places from -1 to 1 within tiles of one unit."""
    return apply(np.mod, place, _ONE).map(2.0 * np.eye(2), -1.0)


def _tiled(shape: Shape, height: float) -> Node:
    """Return the node of a shape in tiles of one unit, or staggered in rows of some height."""

    def draw(node: NodeInputs) -> Signal:
        place, size = _scaled(node), _number(node, "size", _HALF)
        if not _is_staggered(node):
            return shape(_in_tile(place), size).resized(3)
        x = apply(np.mod, _shifted(place, height), _ONE)
        y = apply(np.mod, place.pick([1]), Signal.constant([height]))
        above = add(Signal.constant([height]), y, -1.0)
        places = (join([x, y]), join([add(_ONE, x, -1.0), y]), join([add(x, _HALF, -1.0), above]))
        return _any_of([shape(one, multiply(size, _HALF)) for one in places]).resized(3)

    return draw


def _in_square(node: NodeInputs) -> Signal:
    place = _scaled(node)
    return _in_tile(join([_shifted(place, 1.0), place.pick([1])]) if _is_staggered(node) else place)


def _grid(node: NodeInputs) -> Signal:
    thickness = _number(node, "thickness", _THICKNESS)
    off = apply(np.greater, apply(np.abs, _in_square(node)), add(_ONE, thickness, -1.0))
    return apply(np.maximum, off.pick([0]), off.pick([1])).resized(3)


def _cross_hatch(node: NodeInputs) -> Signal:
    place, thickness = _in_square(node), _number(node, "thickness", _THICKNESS)
    ends = (((1.0, 1.0), (-1.0, -1.0)), ((-1.0, 1.0), (1.0, -1.0)))
    lines = [is_by_line(place, Signal.constant(start), Signal.constant(end), thickness) for start, end in ends]
    return _any_of(lines).resized(3)


TILINGS: Mapping[str, Node] = {
    "cloverleaf": _alone(_clover_leaf),
    "hexagon": _alone(_hexagon),
    "grid": _grid,
    "crosshatch": _cross_hatch,
    "tiledcircles": _tiled(is_within, _TRIANGLES),
    "tiledcloverleafs": _tiled(_clover_leaf, 0.5),
    "tiledhexagons": _tiled(_hexagon, _TRIANGLES),
}
"""By name of the node."""
