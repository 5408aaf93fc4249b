# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Stages of one prim ``/c``, a curve of any schema, and what became of it."""

from __future__ import annotations

import numpy as np
from pxr import Usd

import warp_rt
from warp_rt.scene import Scene, Shapes


def load_prim(kind: str, body: str) -> Scene:
    """Return the scene of a stage that holds one prim of a type, with the properties that ``body`` authors."""
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef {kind} "c" {{ {body}\n}}')
    return warp_rt.load_scene(stage)


def shapes_of(scene: Scene) -> Shapes:
    """Return the shapes that the prim became, and nothing else."""
    (shapes,) = scene.meshes
    assert isinstance(shapes, Shapes)
    return shapes


def codes(scene: Scene) -> set[str]:
    """Return the codes of what was told of the prim."""
    return {record.code for record in scene.diagnostics if record.prim == "/c"}


def bezier(controls: np.ndarray, u: float) -> np.ndarray:
    """Return the points of cubics at ``u`` by Bernstein's polynomials; controls along the first axis."""
    weights = [(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u * u * (1 - u), u**3]
    return np.tensordot(weights, controls, axes=(0, 0))
