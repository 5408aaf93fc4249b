# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's images that are not read by texture coordinates: projected along three axes, or by a direction.

Reference: MaterialX Specification 1.39, triplanarprojection and latlongimage, and the graphs of its reference library.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warp_rt.usd.materialx_places import normal, position, unit
from warp_rt.usd.node_inputs import NodeInputs
from warp_rt.usd.signals import DoesNotFold, Signal, Source, add, apply, apply_to_all, join, look_up, multiply

Part = Callable[[str, tuple[str, str]], Source]
"""Gives an image by the input that names it, and by what it has beyond its edges."""

# By ``upaxis`` x, y and z: for each axis that an image is projected along, what of a place is across it, and what up.
_X, _Y, _Z = np.eye(3)
_UPRIGHT = (
    ((_Z, _Y), (_Z, _X), (-_Y, _X)),
    ((_Z, _Y), (_X, _Z), (_X, _Y)),
    ((_Y, _Z), (_X, _Z), (_X, _Y)),
)
_LEAST_BLEND = 0.03
_REPEATED = ("periodic", "periodic")
_SKY = ("periodic", "mirror")


def projected(node: NodeInputs, part: Part) -> Signal:
    """Return three images, each seen along an axis of the object, weighted by how the surface faces these."""
    up = int(node.number("upaxis", 2.0))
    if not 0 <= up < len(_UPRIGHT):
        raise DoesNotFold
    place = position(node, "position")
    facing = apply(np.abs, apply_to_all(unit, 3, normal(node, "normal", is_world=False)))
    blend = (node.read("blend") or Signal.constant([1.0])).pick([0])
    blend = apply(np.clip, blend, Signal.constant([_LEAST_BLEND]), Signal.constant([1.0]))
    weights = _shares(apply(np.power, _shares(facing), apply(np.reciprocal, blend)))
    total = Signal.constant([0.0] * node.size)
    for axis, (name, rows) in enumerate(zip("xyz", _UPRIGHT[up], strict=True)):
        image = look_up(part(f"file{name}", _REPEATED), place.map(np.array(rows)))
        total = add(total, multiply(image.pick(range(node.size)), weights.pick([axis])))
    return total


def _shares(weights: Signal) -> Signal:
    """Return numbers over their sum."""
    return multiply(weights, apply(np.reciprocal, weights.map(np.ones((1, 3)))))


def on_sky(node: NodeInputs, part: Part) -> Signal:
    """Return an image of all around, by longitude and latitude, in the direction in which it is seen."""
    direction = node.get("viewdir", (0.0, 0.0, 1.0)).resized(3)
    turn = (node.read("rotation") or Signal.constant([0.0])).pick([0])
    around = apply(np.arctan2, direction.pick([0]), direction.pick([2])).map(np.array([[-0.5 / np.pi]]), 0.5)
    longitude = add(around, turn, 1.0 / 360.0)
    latitude = apply(np.arcsin, direction.pick([1])).map(np.array([[1.0 / np.pi]]), 0.5)
    return look_up(part("file", _SKY), join([longitude, latitude])).pick(range(node.size))
