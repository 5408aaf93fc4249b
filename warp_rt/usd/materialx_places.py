# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's nodes of the surface point itself: where it is, its frame, from where it is seen, and its spaces.

The object's space is that of the prim; the model's is the same, as in the reference library.

Reference: MaterialX Specification 1.39, Geometric Nodes and Math Nodes, and what its generators make of them.
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
    join,
    multiply,
    of_surface,
    steps_of,
)
from warp_rt.usd.texture_coordinates import coordinate_name, rotation, rotation_in_space

_IS_WORLD = {"model": False, "object": False, "world": True}


# --- vectors, which other nodes compute of, too


def length(values: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors, shape [n, k]: shape [n, 1]."""
    return np.linalg.norm(values, axis=1, keepdims=True)


@steps_of(length)
def _length_steps(values: Signal) -> Signal:
    return of_surface(Op.LENGTH, 1, values)


def unit(values: np.ndarray) -> np.ndarray:
    """Return vectors over their lengths, shape [n, k]; those of no length stay."""
    return np.asarray(values / np.maximum(length(values), np.finfo(float).tiny))


@steps_of(unit)
def _unit_steps(values: Signal) -> Signal:
    return of_surface(Op.UNIT, values.size, values)


@steps_of(np.cross)
def _cross_steps(first: Signal, second: Signal) -> Signal:
    return of_surface(Op.CROSS, 3, first, second)


def dot(first: Signal, second: Signal) -> Signal:
    """Return the sum of the products of components."""
    product = multiply(first, second)
    return product.map(np.ones((1, product.size)))


def turned(vector: Signal, degrees: Signal) -> Signal:
    """Return a vector of the plane turned clockwise, as MaterialX's rotate2d does."""
    if degrees.value is not None:
        return vector.map(rotation(degrees.value[0]))
    sine, cosine = _sine_and_cosine(degrees)
    x, y = vector.pick([0]), vector.pick([1])
    return join([add(multiply(cosine, x), multiply(sine, y)), add(multiply(cosine, y), multiply(sine, x), -1.0)])


def turned_in_space(vector: Signal, degrees: Signal, axis: Signal) -> Signal:
    """Return a vector of space turned about an axis, as MaterialX's rotate3d does: see ``rotation_in_space``."""
    if degrees.value is not None and axis.value is not None:
        return vector.map(rotation_in_space(degrees.value[0], axis.constant_value()))
    sine, cosine = _sine_and_cosine(degrees)
    along = _unit(axis)
    crossed = apply_to_all(np.cross, 3, vector, along)
    rest = multiply(multiply(along, dot(along, vector)), add(Signal.constant([1.0]), cosine, -1.0))
    return add(add(multiply(vector, cosine), multiply(crossed, sine)), rest)


def _sine_and_cosine(degrees: Signal) -> tuple[Signal, Signal]:
    angle = degrees.pick([0]).map(np.array([[np.pi / 180.0]]))
    return apply(np.sin, angle), apply(np.cos, angle)


# --- the point


def position(node: NodeInputs, name: str) -> Signal:
    """Return the place that a node is given by an input of some name, else the point in the object's space."""
    found = node.read(name)
    return of_surface(Op.POSITION, 3) if found is None else found.resized(3)


def normal(node: NodeInputs, name: str, *, is_world: bool) -> Signal:
    """Return the normal that a node is given by an input of some name, else that of the surface."""
    found = node.read(name)
    return _normal(is_world=is_world) if found is None else found.resized(3)


def _normal(*, is_world: bool) -> Signal:
    found = of_surface(Op.NORMAL_WORLD, 3)
    return found if is_world else of_surface(Op.NORMAL_TO_OBJECT, 3, found)


def _tangent(primvar: str, *, is_world: bool) -> Signal:
    found = of_surface(Op.TANGENT_WORLD, 3, primvar=primvar)
    return found if is_world else _unit(of_surface(Op.VECTOR_TO_OBJECT, 3, found))


def _unit(vector: Signal) -> Signal:
    return apply_to_all(unit, vector.size, vector)


def _is_world(node: NodeInputs, default: str = "object") -> bool:
    space = _IS_WORLD.get(node.text("space") or default)
    if space is None:
        raise DoesNotFold
    return space


def _position_node(node: NodeInputs) -> Signal:
    return of_surface(Op.POSITION_WORLD if _is_world(node) else Op.POSITION, 3)


def _primvar(node: NodeInputs) -> str:
    return coordinate_name(int(node.number("index", 0.0)))


def _bitangent_node(node: NodeInputs) -> Signal:
    """Return the unit vector at right angles to normal and tangent, as the reference library has it."""
    is_world = _is_world(node)
    crossed = apply_to_all(np.cross, 3, _normal(is_world=is_world), _tangent(_primvar(node), is_world=is_world))
    return _unit(crossed)


def _view_node(node: NodeInputs) -> Signal:
    found = of_surface(Op.VIEW_WORLD, 3)
    return found if _is_world(node, "world") else _unit(of_surface(Op.VECTOR_TO_OBJECT, 3, found))


def _facing_ratio(node: NodeInputs) -> Signal:
    view = node.read("viewdirection") or of_surface(Op.VIEW_WORLD, 3)
    cosine = dot(view.resized(3), normal(node, "normal", is_world=True))
    facing = apply(np.abs, cosine) if node.number("faceforward", 1.0) else cosine.map(np.array([[-1.0]]))
    return add(Signal.constant([1.0]), facing, -1.0) if node.number("invert", 0.0) else facing


def _reflect(node: NodeInputs) -> Signal:
    given, about = node.get("in", (1.0, 0.0, 0.0)).resized(3), normal(node, "normal", is_world=True)
    return add(given, multiply(about, dot(about, given)), -2.0)


def _refract(node: NodeInputs) -> Signal:
    """Return the direction of a ray beyond a surface; 0 where none goes on."""
    given, about = node.get("in", (1.0, 0.0, 0.0)).resized(3), normal(node, "normal", is_world=True)
    ior, one = (node.read("ior") or Signal.constant([1.0])).pick([0]), Signal.constant([1.0])
    cosine = dot(given, about)
    squared = add(one, multiply(multiply(ior, ior), add(one, multiply(cosine, cosine), -1.0)), -1.0)
    root = apply(np.sqrt, apply(np.maximum, squared, Signal.constant([0.0])))
    bent = add(multiply(given, ior), multiply(about, add(multiply(ior, cosine), root)), -1.0)
    is_none = apply(np.greater, Signal.constant([0.0]), squared)
    return apply(np.where, is_none, Signal.constant([0.0, 0.0, 0.0]), bent)


def _transform(to_world: Op, to_object: Op, default: tuple[float, float, float]) -> Node:
    """Return the node that takes a point, a vector or a normal from one space to another; normals are unit then."""

    def transform(node: NodeInputs) -> Signal:
        given = node.get("in", default).resized(3)
        names = node.text("fromspace"), node.text("tospace")
        if any(name and name not in _IS_WORLD for name in names):
            raise DoesNotFold
        start, end = (_IS_WORLD.get(name) for name in names)
        is_moved = start is not None and end is not None and start != end
        if is_moved:
            return of_surface(to_world if end else to_object, 3, given)
        return _unit(given) if to_world == Op.NORMAL_TO_WORLD else given

    return transform


PLACES: Mapping[str, Node] = {
    "position": _position_node,
    "normal": lambda node: _normal(is_world=_is_world(node)),
    "tangent": lambda node: _tangent(_primvar(node), is_world=_is_world(node)),
    "bitangent": _bitangent_node,
    "viewdirection": _view_node,
    "facingratio": _facing_ratio,
    "reflect": _reflect,
    "refract": _refract,
    "transformpoint": _transform(Op.POINT_TO_WORLD, Op.POINT_TO_OBJECT, (0.0, 0.0, 0.0)),
    "transformvector": _transform(Op.VECTOR_TO_WORLD, Op.VECTOR_TO_OBJECT, (0.0, 0.0, 0.0)),
    "transformnormal": _transform(Op.NORMAL_TO_WORLD, Op.NORMAL_TO_OBJECT, (0.0, 0.0, 1.0)),
}
"""By name of the node."""
