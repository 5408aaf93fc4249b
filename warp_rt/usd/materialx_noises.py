# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's noises, of texture coordinates and of places in space, and its random numbers.

Reference: MaterialX Specification 1.39, Procedural Nodes, and the node graphs and noise functions of its reference
library.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from warp_rt.scene.programs import Op
from warp_rt.usd.hsv import rgb_from_hsv
from warp_rt.usd.materialx_places import position, turned, turned_in_space
from warp_rt.usd.node_inputs import Node, NodeInputs
from warp_rt.usd.noise import cells, perlin, perlin_vector, worley, worley_vector
from warp_rt.usd.signals import (
    DoesNotFold,
    Signal,
    add,
    apply,
    apply_to_all,
    blend,
    join,
    multiply,
    of_surface,
    steps_of,
)
from warp_rt.usd.solid_noise import (
    cells_solid,
    perlin_solid,
    perlin_solid_vector,
    worley_cells,
    worley_cells_vector,
    worley_solid,
    worley_solid_cells,
    worley_solid_cells_vector,
    worley_solid_vector,
)

Function = Callable[..., np.ndarray]

_FRACTAL = (("lacunarity", 2.0), ("diminish", 0.5))
_MAX_OCTAVES = 16  # beyond, they are finer than texels and pixels are
_JITTER_TURN = 90000.0  # degrees by which places are turned where jitter is 0
_TURN_AXIS = Signal.constant([0.1, 1.0, 0.0])
_RANDOM_SCALE = 4096.0  # of values that are no whole numbers


@dataclass(frozen=True)
class _Domain:
    """Noises of the plane, or of space: each function of one number, then of a vector."""

    place: Callable[[NodeInputs], Signal]
    perlin: tuple[Function, Function]
    cells: Function
    worley: tuple[Function, Function]
    """Distances."""
    worley_cells: tuple[Function, Function]
    """Numbers of the nearest point's cell."""
    noise_offset: tuple[float, ...]
    """Where the fourth component of a noise is that of a number."""
    fractal_offset: tuple[float, ...]
    """Where the last component of a fractal of two or four is that of a number."""


_PLANE = _Domain(
    lambda node: node.coordinates,
    (perlin, perlin_vector),
    cells,
    (worley, worley_vector),
    (worley_cells, worley_cells_vector),
    (19.0, 73.0),
    (19.0, 193.0),
)
_SPACE = _Domain(
    lambda node: position(node, "position"),
    (perlin_solid, perlin_solid_vector),
    cells_solid,
    (worley_solid, worley_solid_vector),
    (worley_solid_cells, worley_solid_cells_vector),
    (19.0, 73.0, 29.0),
    (19.0, 193.0, 17.0),
)


# --- as steps of programs


def _register(function: Function, op: Op, size: int) -> None:
    steps_of(function)(lambda place, *jitter: of_surface(op, size, place, *jitter))


for _function, _op, _size in (
    *((perlin, Op.PERLIN_2D, 1), (perlin_vector, Op.PERLIN_2D, 3), (cells, Op.CELLS_2D, 1)),
    *((worley, Op.WORLEY_2D, 1), (worley_vector, Op.WORLEY_2D, 3)),
    *((worley_cells, Op.WORLEY_CELLS_2D, 1), (worley_cells_vector, Op.WORLEY_CELLS_2D, 3)),
    *((perlin_solid, Op.PERLIN_3D, 1), (perlin_solid_vector, Op.PERLIN_3D, 3), (cells_solid, Op.CELLS_3D, 1)),
    *((worley_solid, Op.WORLEY_3D, 1), (worley_solid_vector, Op.WORLEY_3D, 3)),
    *((worley_solid_cells, Op.WORLEY_CELLS_3D, 1), (worley_solid_cells_vector, Op.WORLEY_CELLS_3D, 3)),
):
    _register(_function, _op, _size)


# --- nodes


def _noise(domain: _Domain) -> Node:
    """Return the node of a number's noise, of as many components of a vector's, or of a colour's and its alpha."""

    def noise(node: NodeInputs) -> Signal:
        place = domain.place(node)
        if node.size == 1:
            found = apply_to_all(domain.perlin[0], 1, place)
        else:
            found = apply_to_all(domain.perlin[1], 3, place).pick(range(min(node.size, 3)))
        if node.size == 4:
            moved = add(place, Signal.constant(domain.noise_offset))
            found = join([found, apply_to_all(domain.perlin[0], 1, moved)])
        return add(multiply(found, node.get("amplitude", 1.0)), node.get("pivot", 0.0))

    return noise


def _fractal(domain: _Domain) -> Node:
    def fractal(node: NodeInputs) -> Signal:
        return multiply(_octaves(node, domain, domain.place(node), node.size), node.get("amplitude", 1.0))

    return fractal


def _octaves(node: NodeInputs, domain: _Domain, place: Signal, size: int) -> Signal:
    """Return octaves of noise, each ``lacunarity`` times as fine as the one before and ``diminish`` times as strong.

    The last component of two, or of four, is a fractal of its own, elsewhere.
    """
    if size in (2, 4):
        moved = add(place, Signal.constant(domain.fractal_offset))
        return join([_octaves(node, domain, place, size - 1), _octaves(node, domain, moved, 1)])
    octaves = int(node.number("octaves", 3.0))
    if not 0 <= octaves <= _MAX_OCTAVES:
        raise DoesNotFold
    function = domain.perlin[0 if size == 1 else 1]
    total, strength = Signal.constant([0.0] * size), Signal.constant([1.0])
    lacunarity, diminish = (node.read(name) or Signal.constant([value]) for name, value in _FRACTAL)
    for _ in range(octaves):
        total = add(total, multiply(apply_to_all(function, size, place), strength))
        place, strength = multiply(place, lacunarity), multiply(strength, diminish)
    return total


def _cells(domain: _Domain) -> Node:
    return lambda node: apply_to_all(domain.cells, 1, domain.place(node))


def _worley(domain: _Domain) -> Node:
    """Return the node of the distances to the nearest points, or of numbers of the nearest one's cell."""

    def nearest(node: NodeInputs) -> Signal:
        return _nearest(node, domain, domain.place(node), node.size)

    return nearest


def _nearest(node: NodeInputs, domain: _Domain, place: Signal, size: int) -> Signal:
    functions = domain.worley_cells if node.number("style", 0.0) == 1.0 else domain.worley
    jitter = (node.read("jitter") or Signal.constant([1.0])).pick([0])
    if size == 1:
        return apply_to_all(functions[0], 1, place, jitter)
    return apply_to_all(functions[1], 3, place, jitter).pick(range(size))


def _unified(domain: _Domain) -> Node:
    """Return the node of any noise, scaled, moved, and turned by the jitter so that nobody can tell it from chance."""

    def unified(node: NodeInputs) -> Signal:
        kind, place = int(node.number("type", 0.0)), domain.place(node)
        jitter = (node.read("jitter") or Signal.constant([1.0])).pick([0])
        turn = jitter.map(np.array([[_JITTER_TURN]]), -_JITTER_TURN)
        scale, offset = (
            node.read(name) or Signal.constant([value]) for name, value in (("freq", 1.0), ("offset", 0.0))
        )
        place = add(multiply(place, scale.resized(place.size)), offset.resized(place.size))
        moved = turned(place, turn) if place.size == 2 else turned_in_space(place, turn, _TURN_AXIS)
        if kind == 0:
            found = apply_to_all(domain.perlin[0], 1, moved).map(np.array([[0.5]]), 0.5)
        elif kind == 1:
            found = apply_to_all(domain.cells, 1, moved)
        elif kind == 2:
            found = _nearest(node, domain, place, 1)
        elif kind == 3:
            solid = join([place, turn]) if place.size == 2 else moved
            found = _octaves(node, _SPACE, solid, 1)
        else:
            raise DoesNotFold
        low, high = node.get("outmin"), node.get("outmax", 1.0)
        found = blend(low, high, found)
        return apply(np.clip, found, low, high) if node.number("clampoutput", 1.0) else found

    return unified


def _random(node: NodeInputs) -> Signal:
    """Return the number of a cell that value and seed name."""
    low, high = (node.read(name) or Signal.constant([value]) for name, value in (("min", 0.0), ("max", 1.0)))
    scale = 1.0 if node.kinds[0] == "integer" else _RANDOM_SCALE
    return blend(low, high, _chance(node.get("in"), scale, node.number("seed", 0.0)))


def _chance(value: Signal, scale: float, seed: float) -> Signal:
    return apply_to_all(cells, 1, join([value.pick([0]).map(np.array([[scale]])), Signal.constant([seed])]))


def _random_color(node: NodeInputs) -> Signal:
    """Return the colour of a hue, a saturation and a brightness that value and seed name, each by a seed of its own."""
    seed, parts = node.number("seed", 0.0), []
    ranges = (("hue", 413.3, 0.0), ("saturation", 1522.4, 0.825), ("brightness", 1813.8, 1.0))
    for name, shift, least in ranges:
        low, high = (node.read(f"{name}{end}") or Signal.constant([v]) for end, v in (("low", least), ("high", 1.0)))
        parts.append(blend(low, high, _chance(node.get("in"), _RANDOM_SCALE, float(np.ceil(seed + shift)))))
    return apply_to_all(rgb_from_hsv, 3, join(parts))


NOISES: Mapping[str, Node] = {
    "noise2d": _noise(_PLANE),
    "noise3d": _noise(_SPACE),
    "fractal2d": _fractal(_PLANE),
    "fractal3d": _fractal(_SPACE),
    "cellnoise2d": _cells(_PLANE),
    "cellnoise3d": _cells(_SPACE),
    "worleynoise2d": _worley(_PLANE),
    "worleynoise3d": _worley(_SPACE),
    "unifiednoise2d": _unified(_PLANE),
    "unifiednoise3d": _unified(_SPACE),
    "randomfloat": _random,
    "randomcolor": _random_color,
}
"""By name of the node."""
