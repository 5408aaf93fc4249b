# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Programs: what an input is at a point of a surface, computed step by step where a ray hits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

Vector4 = tuple[float, float, float, float]

MAX_REGISTERS = 24
"""Values that a program can hold at a time."""


class Op(IntEnum):
    """What a step computes of its registers a, b and c, of four components each. What is no number counts as 0."""

    POSITION = 0
    """The point, in the space of its prim; in the world's: ``POSITION_WORLD``."""
    POSITION_WORLD = 1
    NORMAL_WORLD = 2
    """The shading normal, unit, on the mesh's side."""
    TANGENT_WORLD = 3
    """The unit direction in which the first component of the step's primvar grows; 0 where there is none."""
    VIEW_WORLD = 4
    """The ray's unit direction, from the eye to the point."""
    POSITION_ACROSS = 5
    """How ``POSITION`` changes from one sample to the next across the picture; ``POSITION_DOWN``: down."""
    POSITION_DOWN = 6
    GROWTH_S = 7
    """How ``POSITION`` changes along the surface with the first component of the step's primvar, the second staying;
    ``GROWTH_T``: with the second. 0 where there is none."""
    GROWTH_T = 8
    PRIMVAR = 9
    """The step's primvar; where there is none, its value."""
    TEXTURE = 10
    """The step's texture at its own coordinates."""
    TEXTURE_AT = 11
    """The step's texture at coordinates a, which change by b from one sample to the next across, and by c down."""
    POINT_TO_WORLD = 12
    """a, a point of the prim's space; so too the five that follow."""
    POINT_TO_OBJECT = 13
    VECTOR_TO_WORLD = 14
    VECTOR_TO_OBJECT = 15
    NORMAL_TO_WORLD = 16
    """Unit; so too the next one."""
    NORMAL_TO_OBJECT = 17
    AFFINE = 18
    """The step's first value + a sum over the components of a, each times one of its other values; + b if it adds."""
    UNIT = 19
    """a over its length."""
    LENGTH = 20
    CROSS = 21
    PERLIN_2D = 22
    PERLIN_3D = 23
    CELLS_2D = 24
    CELLS_3D = 25
    WORLEY_2D = 26
    """Distances to the nearest points, as many as the step's size says, jittered by b; so too ``WORLEY_3D``."""
    WORLEY_3D = 27
    WORLEY_CELLS_2D = 28
    """Numbers of the cell whose point is nearest."""
    WORLEY_CELLS_3D = 29
    MULTIPLY = 30
    """From here on: component by component, as the NumPy functions of these names."""
    RECIPROCAL = 31
    CLIP = 32
    CHOOSE = 33
    """b where a is not 0, else c."""
    GREATER = 34
    """1 or 0; so too the next two."""
    GREATER_EQUAL = 35
    EQUAL = 36
    MINIMUM = 37
    MAXIMUM = 38
    POWER = 39
    MODULO = 40
    ARCTAN2 = 41
    ABSOLUTE = 42
    SIGN = 43
    FLOOR = 44
    CEIL = 45
    SQRT = 46
    EXP = 47
    EXP2 = 48
    LOG = 49
    SIN = 50
    COS = 51
    TAN = 52
    ARCSIN = 53
    ARCCOS = 54


@dataclass(frozen=True)
class Step:
    """A step of a program."""

    op: Op
    out: int = 0
    """The register that it writes."""
    a: int = 0
    """Registers that it reads, as many as ``op`` needs."""
    b: int = 0
    c: int = 0
    size: int = 4
    """Components that it computes; of AFFINE: those of a that count."""
    primvar: str = ""
    texture: int = -1
    """Row of ``Scene.textures``."""
    adds: bool = False
    """Whether AFFINE adds b."""
    values: tuple[Vector4, ...] = ()


@dataclass(frozen=True)
class Program:
    """Steps, one after the other; the result is in register 0."""

    steps: tuple[Step, ...]

    @property
    def primvars(self) -> Iterator[str]:
        """Names of the primvars that its steps name; textures name their own."""
        return (step.primvar for step in self.steps if step.primvar)

    @property
    def textures(self) -> Iterator[int]:
        """Rows of the textures that it reads."""
        return (step.texture for step in self.steps if step.texture >= 0)

    def then(self, matrix: np.ndarray) -> Program:
        """Return the program whose result is this one's first three components by a matrix, shape [3, 3]."""
        columns = [(float(x), float(y), float(z), 0.0) for x, y, z in matrix.T]
        values = ((0.0, 0.0, 0.0, 0.0), *columns)
        return replace(self, steps=(*self.steps, Step(Op.AFFINE, size=3, values=values)))
