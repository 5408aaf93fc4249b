# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Programs to a device: their instructions and constants in arrays that all share, and the spaces that they know."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.arrays import Packer
from warp_rt.kernels import op_codes, scene_structs
from warp_rt.scene import Scene
from warp_rt.scene.placement import Placement
from warp_rt.scene.programs import Op, Program, Step, Vector4

CODES: Mapping[Op, int] = {op: int(getattr(op_codes, f"OP_{op.name}")) for op in Op}


class ProgramTable:
    """Lists programs, those that are the same once.

    Args:
        slots: Slot of each primvar that is read.
    """

    def __init__(self, slots: Mapping[str, int]) -> None:
        self._slots = slots
        self._rows: dict[Program, int] = {}
        self._spans: list[tuple[int, int]] = []
        self._instructions: list[tuple[int, ...]] = []
        self._values: list[Vector4] = []

    def row(self, program: Program) -> int:
        """Return the row of a program in ``SceneData.programs``."""
        if program not in self._rows:
            self._rows[program] = len(self._spans)
            self._spans.append((len(self._instructions), len(program.steps)))
            self._instructions += [self._instruction(step) for step in program.steps]
        return self._rows[program]

    def _instruction(self, step: Step) -> tuple[int, ...]:
        data = int(step.adds)
        if step.texture >= 0:
            data = step.texture
        elif step.primvar:
            data = self._slots[step.primvar]
        first = len(self._values)
        self._values += step.values
        return (CODES[step.op], step.out, step.a, step.b, step.c, step.size, data, first)

    def pack(self, data: Any, pack: Packer) -> None:
        """Write all programs to ``SceneData``."""
        data.programs = pack.array(np.array(self._spans, np.int32).reshape(-1, 2), wp.vec2i)
        rows = np.zeros(len(self._instructions), scene_structs.InstructionData.numpy_dtype())
        for row, instruction in zip(rows, self._instructions, strict=True):
            row["op"], row["out"], row["a"], row["b"], row["c"], row["size"], row["data"], row["values"] = instruction
        data.instructions = pack.array(rows, scene_structs.InstructionData)
        data.program_values = pack.array(np.array(self._values, np.float32).reshape(-1, 4), wp.vec4)


def pack_spaces(data: Any, pack: Packer, scene: Scene, placement: Placement) -> None:
    """Write the spaces of prims, and where coordinates begin, to ``SceneData``: for programs alone."""
    has_programs = any(source.program is not None for m in scene.materials for source in m.inputs.values())
    prims: Sequence[str] = scene.prims if has_programs else ()
    spaces = np.zeros(len(prims), scene_structs.ObjectSpace.numpy_dtype())
    matrices = np.tile(np.eye(4), (len(prims), 1, 1))
    for row, matrix in scene.object_from_local.items():
        if row < len(prims):
            matrices[row] = matrix
    spaces["object_from_mesh"] = matrices[:, :3]
    spaces["mesh_from_object"] = np.linalg.inv(matrices)[:, :3]
    data.object_spaces = pack.array(spaces, scene_structs.ObjectSpace)
    origins = placement.mesh_origins if has_programs else placement.mesh_origins[:0]
    data.mesh_origins = pack.array(origins.astype(np.float32), wp.vec3)
    data.origin = wp.vec3(*placement.origin.tolist())
