# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Random stages of nested instances: what is drawn, where, with which material and primvars, is what USD computes."""

from __future__ import annotations

import random
from collections import Counter

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

from warp_rt.scene import Mesh, Scene
from warp_rt.usd.load import load_stage

PURPOSES = ("default", "render")
GPRIMS = {
    "Sphere": "",
    "Cube": "",
    "Mesh": """
        uniform token subdivisionScheme = "none"
        point3f[] points = [(0,0,0), (1,0,0), (0,1,0)]
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0,1,2]
    """,
}
MATERIALS = "".join(
    f'def Material "{name}" {{\ntoken outputs:surface.connect = </{name}/s.outputs:surface>\ndef Shader "s" {{\n'
    'uniform token info:id = "UsdPreviewSurface"\ntoken outputs:surface\n}\n}\n'
    for name in ("M0", "M1", "M2")
)
Drawn = tuple[object, ...]
"""Matrix, material, displayColor and w of what is drawn once."""


class RandomStage:
    """Writes prims with what is inherited by rules of its own: transforms, visibility, purpose, primvars, bindings.

    Args:
        seed: Of all that is random.
    """

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._count = 0

    def text(self) -> str:
        """Return a layer: two classes, the second with instances of the first, and a world of instances of both."""
        classes: list[str] = []
        parts = [MATERIALS]
        for name in ("C0", "C1", "World"):
            body = self._prims(3 if name == "World" else 2, classes)
            parts.append(self._prim("def" if name == "World" else "class", "Xform", name, body))
            classes.append(name)
        return "#usda 1.0\n" + "".join(parts)

    def _prims(self, depth: int, classes: list[str]) -> str:
        written = ""
        for _ in range(self._random.randint(2, 3)):
            self._count += 1
            kind = self._random.choice(["Xform", "Xform", "Scope", "", *GPRIMS] if depth else [*GPRIMS])
            is_instance = bool(classes) and kind in ("Xform", "") and self._is(0.4)
            arc = ""
            if is_instance:
                is_shared = str(self._is(0.8)).lower()
                arc = f"inherits = </{self._random.choice(classes)}>\ninstanceable = {is_shared}"
            body = GPRIMS.get(kind, "")
            if depth and kind not in GPRIMS and not is_instance:
                body = self._prims(depth - 1, classes)
            written += self._prim("def", kind, f"p{self._count}", body, arc)
        return written

    def _prim(self, specifier: str, kind: str, name: str, body: str, arc: str = "") -> str:
        return f'{specifier} {kind} "{name}" (\n{arc}\n{self._schemas()}) {{\n{self._properties(kind)}{body}\n}}\n'

    def _schemas(self) -> str:
        return 'prepend apiSchemas = ["MaterialBindingAPI"]\n'

    def _properties(self, kind: str) -> str:
        pick, number = self._random.choice, self._random.randint
        said = []
        if self._is(0.1):
            said.append(f'uniform token purpose = "{pick(["default", "render", "proxy", "guide"])}"')
        if self._is(0.06):
            said.append(f'token visibility = "{pick(["invisible", "inherited"])}"')
        if self._is(0.35):
            value, interpolation = (
                pick([f"[({number(0, 9)}, 0, 0)]", "None"]),
                pick(["constant", "constant", "uniform"]),
            )
            said.append(f'color3f[] primvars:displayColor = {value} (interpolation = "{interpolation}")')
        if self._is(0.25):
            said.append(f"float primvars:w = {number(0, 9)}")
        for purpose in ("", ":full", ":preview"):
            if self._is(0.15):
                strength = ' (bindMaterialAs = "strongerThanDescendants")' if self._is(0.3) else ""
                said.append(f"rel material:binding{purpose} = </M{number(0, 2)}>{strength}")
        if kind not in ("", "Scope") and self._is(0.5):
            reset = '"!resetXformStack!", ' if self._is(0.15) else ""
            said += [
                f"double3 xformOp:translate = ({number(-5, 5)}, {number(-5, 5)}, {number(-5, 5)})",
                f"float3 xformOp:scale = ({pick([1, 2, -1])}, 1, {pick([1, 0.5])})",
                f'uniform token[] xformOpOrder = [{reset}"xformOp:translate", "xformOp:scale"]',
            ]
        return "\n".join(said) + "\n"

    def _is(self, chance: float) -> bool:
        return self._random.random() < chance


def computed(stage: Usd.Stage) -> Counter[Drawn]:
    """Return what USD says of each gprim, instance proxies included."""
    transforms = UsdGeom.XformCache()
    found: Counter[Drawn] = Counter()
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        image = UsdGeom.Imageable(prim)
        if prim.GetTypeName() not in GPRIMS or image.ComputePurpose() not in PURPOSES:
            continue
        if image.ComputeVisibility() == UsdGeom.Tokens.invisible:
            continue
        material = "/__displayColor"
        for purpose in ("full", "", "preview"):
            bound, relationship = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(purpose)
            if relationship:
                material = str(bound.GetPath())
                break
        values = (UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name) for name in ("displayColor", "w"))
        given = [None if not value or value.Get() is None else np.ravel(value.Get()).tolist() for value in values]
        matrix = np.array(transforms.GetLocalToWorldTransform(prim)).T
        found[_key(matrix, material, *given)] += 1
    return found


def drawn(scene: Scene) -> Counter[Drawn]:
    """Return the instances of a scene likewise."""
    rows = scene.instances
    found: Counter[Drawn] = Counter()
    for row in range(len(rows)):
        mesh = scene.meshes[rows.mesh[row]]
        given = []
        for name, width in (("displayColor", 3), ("w", 1)):
            of_instance = rows.primvars.get(name)
            value = None
            if of_instance is not None and not np.isnan(of_instance[row, 0]):
                value = of_instance[row, :width].tolist()
            elif isinstance(mesh, Mesh) and name in mesh.primvars:
                value = mesh.primvars[name].values[0].tolist()
            given.append(value)
        material = scene.materials[rows.material_table[rows.material_offset[row]]].path
        found[_key(rows.world_from_local[row], material, *given)] += 1
    return found


def _key(matrix: np.ndarray, material: str, color: list | None, w: list | None) -> Drawn:
    return tuple(np.round(matrix, 4).ravel() + 0.0), material, tuple(color or ()), tuple(w or ())


@pytest.mark.parametrize("seeds", [range(start, start + 10) for start in range(0, 60, 10)], ids=lambda r: f"{r[0]}")
def test_random_stages_are_drawn_as_usd_computes_them_prim_by_prim(seeds: range) -> None:
    for seed in seeds:
        stage = Usd.Stage.CreateInMemory()
        assert stage.GetRootLayer().ImportFromString(RandomStage(seed).text())
        assert drawn(load_stage(stage, purposes=PURPOSES)) == computed(stage), seed
