# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Random bindings, of prims, collections and subsets, by purpose and strength: what is drawn is what UsdShade says."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade

from warp_rt.usd.load import load_stage

GROUPS = ("/W", "/W/A", "/W/B", "/W/A/C")
LEAVES = tuple(f"{group}/m{k}" for group in GROUPS for k in range(2))
STRENGTHS = (
    UsdShade.Tokens.weakerThanDescendants,
    UsdShade.Tokens.strongerThanDescendants,
    UsdShade.Tokens.fallbackStrength,
)


def quad(stage: Usd.Stage, path: str) -> Usd.Prim:
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    mesh.CreateFaceVertexCountsAttr([3, 3])
    mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 0, 2, 3])
    return mesh.GetPrim()


def bind_by_chance(prim: Usd.Prim, materials: list[UsdShade.Material], rng: np.random.Generator) -> None:
    """Bind up to two materials to a prim, or to a collection on it."""
    api = UsdShade.MaterialBindingAPI.Apply(prim)
    for _ in range(rng.integers(0, 3)):
        purpose, strength = ("", "full", "preview")[rng.integers(3)], STRENGTHS[rng.integers(3)]
        material = materials[rng.integers(len(materials))]
        if rng.random() < 0.5 or prim.IsA(UsdGeom.Subset):
            api.Bind(material, strength, purpose)
            continue
        collection = Usd.CollectionAPI.Apply(prim, f"c{rng.integers(3)}")
        collection.CreateExpansionRuleAttr().Set(("expandPrims", "explicitOnly")[rng.integers(2)])
        for target in (*rng.choice(LEAVES, 2), rng.choice(GROUPS)):
            collection.CreateIncludesRel().AddTarget(str(target))
        if rng.random() < 0.3:
            collection.CreateExcludesRel().AddTarget(str(rng.choice(LEAVES)))
        api.Bind(collection, material, f"b{rng.integers(3)}", strength, purpose)


def said_of(prim: Usd.Prim) -> str:
    """Return what UsdShade finds for the purpose full, or, where nothing is bound for it, for previews."""
    for purpose in ("full", "preview"):
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(purpose)
        if material:
            return str(material.GetPath())
    return "/__displayColor"


@pytest.mark.parametrize("seed", range(12))
def test_materials_are_those_that_usdshade_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    stage = Usd.Stage.CreateInMemory()
    materials = []
    for k in range(5):
        material = UsdShade.Material.Define(stage, f"/Looks/M{k}")
        shader = UsdShade.Shader.Define(stage, f"/Looks/M{k}/S")
        shader.CreateIdAttr("UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        materials.append(material)
    for path in GROUPS:
        UsdGeom.Xform.Define(stage, path)
    for path in LEAVES:
        api = UsdShade.MaterialBindingAPI.Apply(quad(stage, path))
        if rng.random() < 0.5:
            bind_by_chance(api.CreateMaterialBindSubset("part", [int(rng.integers(2))]).GetPrim(), materials, rng)
    for path in (*GROUPS, *LEAVES):
        bind_by_chance(stage.GetPrimAtPath(path), materials, rng)
    scene = load_stage(stage)
    for row in range(len(scene.instances)):
        prim = stage.GetPrimAtPath(scene.prims[scene.instances.prim[row]])
        expected = [said_of(part) for part in (prim, *prim.GetChildren())]
        first = scene.instances.material_offset[row]
        table = scene.instances.material_table[first : first + len(expected)]
        assert [scene.materials[k].path for k in table] == expected, prim.GetPath()
