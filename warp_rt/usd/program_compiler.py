# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Signals made programs: fields that are functions of the place, or of several sets of coordinates, step by step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from warp_rt.scene.programs import MAX_REGISTERS, Op, Program, Step, Vector4
from warp_rt.usd.signals import (
    CHANNELS,
    STEPS,
    DoesNotFold,
    Signal,
    Source,
    add,
    in_float32,
    join,
    joined,
    of_surface,
)

MAX_STEPS = 1024
"""Beyond, a program would take longer than all else that a ray does."""

_BY_COMPONENT: dict[Callable[..., np.ndarray], Op] = {
    np.multiply: Op.MULTIPLY,
    np.reciprocal: Op.RECIPROCAL,
    np.clip: Op.CLIP,
    np.where: Op.CHOOSE,
    np.greater: Op.GREATER,
    np.greater_equal: Op.GREATER_EQUAL,
    np.equal: Op.EQUAL,
    np.minimum: Op.MINIMUM,
    np.maximum: Op.MAXIMUM,
    np.power: Op.POWER,
    np.mod: Op.MODULO,
    np.arctan2: Op.ARCTAN2,
    np.abs: Op.ABSOLUTE,
    np.sign: Op.SIGN,
    np.floor: Op.FLOOR,
    np.ceil: Op.CEIL,
    np.sqrt: Op.SQRT,
    np.exp: Op.EXP,
    np.exp2: Op.EXP2,
    np.log: Op.LOG,
    np.sin: Op.SIN,
    np.cos: Op.COS,
    np.tan: Op.TAN,
    np.arcsin: Op.ARCSIN,
    np.arccos: Op.ARCCOS,
}
_NOTHING = Signal.constant((0.0, 0.0, 0.0, 0.0))


def compile_program(found: Signal, row: Callable[[Source], int]) -> Program:
    """Return the program that gives a signal; components that it has not are 0.

    Args:
        found: What varies.
        row: Gives the row of the texture that a source is, or is made.

    Raises:
        DoesNotFold: It would be too long, or hold too many values at a time.
    """
    compiler = _Compiler(row)
    with np.errstate(all="ignore"):  # of constants that steps are made of: see ``Op``
        return Program(_in_registers(compiler.steps, compiler.signal(found, is_exact=True)))


class _Compiler:
    """Lists the steps of a signal; their registers are numbers of steps, each of which writes one of its own."""

    def __init__(self, row: Callable[[Source], int]) -> None:
        self.steps: list[Step] = []
        self._row = row
        self._known: dict[Step, int] = {}
        self._widths: list[int] = []  # components that may be anything but 0
        self._sources: dict[str, int] = {}
        self._parts_of: dict[str, tuple[Signal, ...]] = {}

    def _emit(self, step: Step, width: int) -> int:
        """Return the number of a step, which is listed unless there is one like it."""
        if step not in self._known:
            if len(self.steps) >= MAX_STEPS:
                raise DoesNotFold
            self._known[step] = len(self.steps)
            self.steps.append(step)
            self._widths.append(width)
        return self._known[step]

    def signal(self, found: Signal, *, is_exact: bool = False) -> int:
        """Return the step that gives a signal.

        Args:
            found: The signal.
            is_exact: Whether components beyond its own have to be 0.
        """
        linear, offset = found.matrix[:, :-1], found.matrix[:, -1]
        if found.value is not None or found.source is None:
            return self._affine(None, np.zeros((found.size, CHANNELS)), offset)
        step = self._source(found.source)
        is_same = np.array_equal(linear, np.eye(found.size, CHANNELS)) and not offset.any()
        if is_same and (not is_exact or self._widths[step] <= found.size):
            return step
        return self._affine(step, linear, offset)

    def _affine(
        self, step: int | None, linear: np.ndarray, offset: np.ndarray, added: int | None = None, first: int = 0
    ) -> int:
        """Return linear @ a step + offset, as components from ``first`` on, plus another step."""
        used = np.flatnonzero(linear.any(axis=0))
        count = int(used[-1]) + 1 if step is not None and len(used) else 0
        columns = np.zeros((count + 1, CHANNELS))
        columns[0, first : first + len(offset)] = offset
        columns[1:, first : first + len(offset)] = linear[:, :count].T
        width = max(first + len(offset), 0 if added is None else self._widths[added])
        values = tuple(_vector4(column) for column in columns)
        made = Step(Op.AFFINE, a=step or 0, b=added or 0, size=count, adds=added is not None, values=values)
        return self._emit(made, width)

    def _sum(self, parts: Sequence[Signal], firsts: Sequence[int]) -> int:
        """Return the sum of signals, each as components from a number on."""
        total: int | None = None
        for part, first in zip(parts, firsts, strict=True):
            step = None if part.value is not None or part.source is None else self._source(part.source)
            total = self._affine(step, part.matrix[:, :-1], part.matrix[:, -1], total, first)
        if total is None:
            raise DoesNotFold
        return total

    def _source(self, source: Source) -> int:
        """Return the step that gives a source, after those that it is made of: by a loop, however long their chain."""
        waiting = [source]
        while waiting:
            top = waiting[-1]
            missing = [one for one in self._below(top) if one.key not in self._sources]
            if missing and top.key not in self._sources:
                waiting += missing[::-1]
                continue
            waiting.pop()
            if top.key not in self._sources:
                self._sources[top.key] = self._found(top)
        return self._sources[source.key]

    def _below(self, source: Source) -> list[Source]:
        """Return the sources that ``_found`` asks for."""
        return [part.source for part in self._parts(source) if part.value is None and part.source is not None]

    def _parts(self, source: Source) -> tuple[Signal, ...]:
        """Return the signals that a source is computed of, by steps that there are."""
        if source.key not in self._parts_of:
            self._parts_of[source.key] = self._new_parts(source)
        return self._parts_of[source.key]

    def _new_parts(self, source: Source) -> tuple[Signal, ...]:
        field = source.computed
        if field is None or field.is_slope:
            return ()
        if field.texture is not None:
            (place,) = field.arguments
            changes = (self._change(place, op) for op in (Op.POSITION_ACROSS, Op.POSITION_DOWN))
            return tuple(part.resized(2) for part in (place, *changes))
        function = field.function
        if isinstance(function, Op) or function is np.add or function is joined:
            return field.arguments
        if function in _BY_COMPONENT:
            return tuple(argument.resized(field.size) for argument in field.arguments)
        steps = getattr(function, "steps", None) or STEPS.get(function)
        if steps is None:
            raise DoesNotFold
        return (steps(*field.arguments).resized(field.size),)

    def _found(self, source: Source) -> int:
        field, parts = source.computed, self._parts(source)
        if source.texture is not None or (field is not None and field.is_slope):
            return self._emit(Step(Op.TEXTURE, texture=self._row(source)), CHANNELS)
        if field is None:
            fallback = _vector4(np.resize([*source.fallback, 0.0, 0.0, 0.0, 0.0], CHANNELS))
            return self._emit(Step(Op.PRIMVAR, primvar=source.primvar, values=(fallback,)), CHANNELS)
        if field.texture is not None:
            a, b, c = map(self.signal, parts)
            row = self._row(Source(f"looked up {source.key}", field.texture))
            return self._emit(Step(Op.TEXTURE_AT, a=a, b=b, c=c, texture=row), CHANNELS)
        function = field.function
        if isinstance(function, Op):
            a, b = (*(self.signal(part, is_exact=True) for part in parts), 0, 0)[:2]
            return self._emit(Step(function, a=a, b=b, size=field.size, primvar=field.primvar), field.size)
        if function is np.add:
            return self._sum(parts, [0] * len(parts))
        if function is joined:
            return self._sum(parts, np.cumsum([0, *(part.size for part in parts)])[:-1].tolist())
        if function in _BY_COMPONENT:
            a, b, c = (*map(self.signal, parts), 0, 0)[:3]
            return self._emit(Step(_BY_COMPONENT[function], a=a, b=b, c=c, size=field.size), field.size)
        return self.signal(parts[0], is_exact=True)

    # --- textures at computed places

    def _change(self, found: Signal, op: Op) -> Signal:
        """Return how a signal changes from one sample to the next, as far as it is a sum of the place.

        What noises and other functions add to that is left out: of texels that they scatter no mean is taken.
        """
        if found.value is not None or found.source is None:
            return Signal.constant([0.0] * found.size)
        return self._change_of(found.source, op).map(found.matrix[:, :-1])

    def _change_of(self, source: Source, op: Op) -> Signal:
        field = source.computed
        found = _NOTHING
        if field is None:
            return found
        if field.function is Op.POSITION:
            found = of_surface(op, 3)
        elif field.function is Op.POSITION_WORLD:
            found = of_surface(Op.VECTOR_TO_WORLD, 3, of_surface(op, 3))
        elif field.function is np.add:
            first, second = (self._change(argument, op) for argument in field.arguments)
            found = add(first, second)
        elif field.function is joined:
            found = join([self._change(argument, op) for argument in field.arguments])
        return found.pick(range(CHANNELS))


def _vector4(values: np.ndarray) -> Vector4:
    x, y, z, w = in_float32(values).tolist()
    return (x, y, z, w)


_TRIPLES = (Op.TEXTURE_AT, Op.CLIP, Op.CHOOSE)
_PAIRS = (
    *(Op.CROSS, Op.WORLEY_2D, Op.WORLEY_3D, Op.WORLEY_CELLS_2D, Op.WORLEY_CELLS_3D, Op.MULTIPLY, Op.GREATER),
    *(Op.GREATER_EQUAL, Op.EQUAL, Op.MINIMUM, Op.MAXIMUM, Op.POWER, Op.MODULO, Op.ARCTAN2),
)


def _read(step: Step) -> list[int]:
    """Return the registers that a step reads."""
    if step.op is Op.AFFINE:
        return [*([step.a] if step.size else []), *([step.b] if step.adds else [])]
    if step.op <= Op.TEXTURE:
        return []
    count = 3 if step.op in _TRIPLES else 2 if step.op in _PAIRS else 1
    return [step.a, step.b, step.c][:count]


def _in_registers(steps: Sequence[Step], result: int) -> tuple[Step, ...]:
    """Return steps that share registers: each is free again once nobody reads it any more.

    Args:
        steps: Whose registers are numbers of steps.
        result: The one whose value goes to register 0.

    Raises:
        DoesNotFold: There are not enough registers.
    """
    needed = _needed(steps, result)
    last = {number: number for number in needed}
    for number in needed:
        for given in _read(steps[number]):
            last[given] = number
    register: dict[int, int] = {}
    free = list(range(MAX_REGISTERS - 1, -1, -1))
    made = []
    for number in needed:
        step = steps[number]
        reads = _read(step)
        a, b, c = (register[given] if given in reads else 0 for given in (step.a, step.b, step.c))
        free += sorted({register[given] for given in reads if last[given] == number}, reverse=True)
        if number == result:
            register[number] = 0
        elif not free:
            raise DoesNotFold
        else:
            register[number] = free.pop()
        made.append(replace(step, out=register[number], a=a, b=b, c=c))
    return tuple(made)


def _needed(steps: Sequence[Step], result: int) -> list[int]:
    """Return the numbers of the steps that a result is made of, itself last, in order."""
    found, waiting = set(), [result]
    while waiting:
        number = waiting.pop()
        if number not in found:
            found.add(number)
            waiting += _read(steps[number])
    return sorted(found)
