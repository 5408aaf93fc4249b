# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's normals of heights: by how these change with the texture coordinates.

Heights of one set of texture coordinates are asked beside each texel of their image (``baking``). Others are computed
at four places beside the point: along the surface by as much as goes with a small step of a texture coordinate.

Reference: MaterialX Specification 1.39, heighttonormal and bump; the reference library's implementations.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warp_rt.scene.programs import Op
from warp_rt.usd.node_inputs import Node, NodeInputs
from warp_rt.usd.signals import (
    CHANNELS,
    DoesNotFold,
    Signal,
    Source,
    add,
    apply_to_all,
    apply_to_slope,
    join,
    look_up,
    multiply,
    of_surface,
    steps_of,
    with_arguments,
)

_STEP = 1 / 2048  # of texture coordinates: float32 has digits left of the difference a hundred units from the origin
_SOBEL = 1 / 16  # the library's scale, for what a Sobel filter of an image gives


def normal_map(given: Signal, scale: Signal | None) -> Signal:
    """Return a normal in the frame of the surface: texels from 0..1 to -1..1, x and y scaled."""
    x, y = np.resize(np.ones(1) if scale is None else scale.constant_value(), 2)
    return given.resized(3).map(np.diag((2 * x, 2 * y, 2.0)), np.array((-x, -y, -1.0)))


def _normal_map(node: NodeInputs) -> Signal:
    return normal_map(node.get("in", (0.5, 0.5, 1.0)), node.read("scale"))


def _height_to_normal(node: NodeInputs) -> Signal:
    """Return the normal of a height, from -1..1 to 0..1 as maps have it."""
    height = multiply(node.sized("in", 1), node.read("scale") or Signal.constant([1.0]))
    return _encoded_normal(height, node.coordinates)


def _bump(node: NodeInputs) -> Signal:
    """Return the normal of a height in the frame of the surface."""
    encoded = _encoded_normal(node.sized("height", 1), node.coordinates)
    return normal_map(encoded, (node.read("scale") or Signal.constant([1.0])).pick([0]))


def _encoded_normal(height: Signal, place: Signal) -> Signal:
    source = place.source
    is_plain = source is not None and source.texture is None and source.computed is None
    if height.value is None and not (is_plain and np.array_equal(place.matrix, np.eye(2, CHANNELS + 1))):
        raise DoesNotFold  # slopes by coordinates that are moved themselves
    own = height.source.coordinates if height.source is not None else None
    if source is None or height.value is not None or own == source.coordinates:
        return apply_to_slope(_normal_of_slope, 3, height)
    if own is not None:
        raise DoesNotFold  # of other coordinates than the height's own
    return apply_to_all(_normal_of_slope, 3, join([_slope(height, source, axis) for axis in (0, 1)]))


def _normal_of_slope(slope: np.ndarray) -> np.ndarray:
    normal = np.concatenate([-slope * _SOBEL, np.ones((len(slope), 1))], axis=1)
    return np.asarray(0.5 * normal / np.linalg.norm(normal, axis=1, keepdims=True) + 0.5)


@steps_of(_normal_of_slope)
def _normal_of_slope_steps(slope: Signal) -> Signal:
    normal = join([slope.map(-_SOBEL * np.eye(2)), Signal.constant([1.0])])
    return of_surface(Op.UNIT, 3, normal).map(0.5 * np.eye(3), 0.5)


# --- heights of the place


def _slope(height: Signal, coordinates: Source, axis: int) -> Signal:
    ahead, behind = (_Moved(coordinates, axis, step).signal(height) for step in (_STEP, -_STEP))
    return add(ahead, behind, -1.0).map(np.array([[0.5 / _STEP]]))


class _Moved:
    """Signals at a place beside the point.

    Args:
        coordinates: The texture coordinates, a primvar.
        axis: 0: across, 1: upwards.
        step: How much of them the place is away.
    """

    def __init__(self, coordinates: Source, axis: int, step: float) -> None:
        self._coordinates = coordinates
        self._step = Signal.constant([step * (axis == 0), step * (axis == 1)])
        growth = of_surface((Op.GROWTH_S, Op.GROWTH_T)[axis], 3, primvar=coordinates.primvar)
        self._way = growth.map(step * np.eye(3))
        self._done: dict[str, Signal] = {}

    def signal(self, found: Signal) -> Signal:
        """Return a signal there.

        Raises:
            DoesNotFold: Something that it is made of is known at the point alone, as a normal is.
        """
        if found.value is not None or found.source is None:
            return found
        moved = self._source(found.source)
        return moved.map(found.matrix[:, :CHANNELS], found.matrix[:, CHANNELS])

    def _source(self, source: Source) -> Signal:
        """Return all four components of a source."""
        if source.key not in self._done:
            self._done[source.key] = self._found(source).pick(range(CHANNELS))
        return self._done[source.key]

    def _found(self, source: Source) -> Signal:
        field = source.computed
        if field is None:
            if source.coordinates != self._coordinates.coordinates:
                raise DoesNotFold
            place = add(Signal.of(self._coordinates, 2), self._step)
            return place if source.texture is None else look_up(source, place)
        if field.function is Op.POSITION:
            return add(Signal.of(source, 3), self._way)
        if field.function is Op.POSITION_WORLD:
            return add(Signal.of(source, 3), of_surface(Op.VECTOR_TO_WORLD, 3, self._way))
        if not field.arguments or field.is_slope:
            raise DoesNotFold
        return with_arguments(source, [self.signal(argument) for argument in field.arguments])


HEIGHTS: Mapping[str, Node] = {"normalmap": _normal_map, "heighttonormal": _height_to_normal, "bump": _bump}
"""By name of the node."""
