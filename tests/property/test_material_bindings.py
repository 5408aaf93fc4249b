# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Random bindings, of prims, collections and subsets, by purpose and strength: what is drawn is what UsdShade says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdShade

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


def bind_by_chance(
    prim: Usd.Prim,
    materials: list[UsdShade.Material],
    rng: np.random.Generator,
    groups: Sequence[str] = GROUPS,
    leaves: Sequence[str] = LEAVES,
) -> None:
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
        for target in (*rng.choice(leaves, 2), rng.choice(groups)):
            collection.CreateIncludesRel().AddTarget(str(target))
        if rng.random() < 0.3:
            collection.CreateExcludesRel().AddTarget(str(rng.choice(leaves)))
        api.Bind(collection, material, f"b{rng.integers(3)}", strength, purpose)


def said_of(prim: Usd.Prim) -> str:
    """Return what UsdShade finds for the purpose full, or, where nothing is bound for it, for previews."""
    for purpose in ("full", "preview"):
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(purpose)
        if material:
            return str(material.GetPath())
    return "/__displayColor"


def new_stage() -> tuple[Usd.Stage, list[UsdShade.Material]]:
    """Return a stage with five materials."""
    stage = Usd.Stage.CreateInMemory()
    materials = []
    for k in range(5):
        material = UsdShade.Material.Define(stage, f"/Looks/M{k}")
        shader = UsdShade.Shader.Define(stage, f"/Looks/M{k}/S")
        shader.CreateIdAttr("UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        materials.append(material)
    return stage, materials


@pytest.mark.parametrize("seed", range(12))
def test_materials_are_those_that_usdshade_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    stage, materials = new_stage()
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


@pytest.mark.parametrize("seed", range(16))
def test_materials_within_instances_are_those_that_usdshade_finds(seed: int) -> None:
    """Collections go by paths, which copies of one prototype do not share, nor need they share their materials."""
    rng = np.random.default_rng(100 + seed)
    stage, materials = new_stage()
    UsdGeom.Xform.Define(stage, "/W")
    inner = ("m0", "A", "A/m1", "A/m2")
    for name in inner:
        if name == "A":
            UsdGeom.Xform.Define(stage, "/Asset/A")
        else:
            quad(stage, f"/Asset/{name}")
    stage.GetPrimAtPath("/Asset").SetSpecifier(Sdf.SpecifierClass)
    copies = [f"/W/I{k}" for k in range(4)]
    for path in copies:
        copy = UsdGeom.Xform.Define(stage, path).GetPrim()
        copy.GetReferences().AddInternalReference("/Asset")
        copy.SetInstanceable(True)
    own = ("/Asset/A", "/Asset/A/m1")
    bind_by_chance(stage.GetPrimAtPath("/Asset/A"), materials, rng, own, own)
    within = [f"{path}/{name}" for path in copies for name in inner]
    for path in ("/W", *copies) if rng.random() < 0.5 else ("/W",):
        bind_by_chance(stage.GetPrimAtPath(path), materials, rng, ("/W", *copies), (*copies, *within))
    if rng.random() < 0.3:
        collection = Usd.CollectionAPI.Apply(stage.GetPrimAtPath("/W"), "said")
        collection.CreateMembershipExpressionAttr().Set(Sdf.PathExpression("/W/I1//m* /W/I2/A"))
        UsdShade.MaterialBindingAPI.Apply(stage.GetPrimAtPath("/W")).Bind(collection, materials[0], "said")
    scene = load_stage(stage)
    assert len(scene.instances) == 12
    for row in range(len(scene.instances)):
        drawn_as = scene.prims[scene.instances.prim[row]].split("/")
        path = "/".join([scene.instance_paths[scene.instances.instance_id[row]], *drawn_as[3:]])
        material = scene.materials[scene.instances.material_table[scene.instances.material_offset[row]]]
        assert material.path == said_of(stage.GetPrimAtPath(path)), path
