# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The rays of a tree as a USD layer over its scene: any USD program can open it, and the rays are where they were."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdShade, UsdUtils

import warp_rt
from warp_rt.tree.curves import CURVE_COLORS

SCENES = Path(__file__).resolve().parents[2] / "scenes"
PIXEL = (240, 70)


@pytest.fixture(scope="module")
def tree() -> warp_rt.RayTree:
    """Eye, reflection and refraction rays, of which some leave; lit and shadowed points."""
    return warp_rt.trace_tree(SCENES / "mirror_teapot.usda", *PIXEL, width=320, device="cpu")


def curves_of(stage: Usd.Stage, root: str) -> dict[str, UsdGeom.BasisCurves]:
    prims = stage.GetPrimAtPath(root).GetChildren()
    return {prim.GetName(): UsdGeom.BasisCurves(prim) for prim in prims if prim.IsA(UsdGeom.BasisCurves)}


@pytest.mark.parametrize("extension", ["usda", "usdc", "usd"])
def test_layer_lies_over_its_scene(tree: warp_rt.RayTree, tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"rays.{extension}"
    tree.save_usd(path)
    stage, scene = Usd.Stage.Open(str(path)), Usd.Stage.Open(str(SCENES / "mirror_teapot.usda"))
    assert stage.GetPrimAtPath("/World/Mirror")
    assert stage.GetDefaultPrim().GetPath() == scene.GetDefaultPrim().GetPath()
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.GetStageUpAxis(scene)
    assert UsdGeom.GetStageMetersPerUnit(stage) == UsdGeom.GetStageMetersPerUnit(scene)
    assert stage.GetMetadata("renderSettingsPrimPath") == scene.GetMetadata("renderSettingsPrimPath")
    assert {layer.realPath for layer in stage.GetUsedLayers()} > {str(SCENES / "mirror_teapot.usda")}
    # The layer has opinions on nothing but its own prims.
    assert [spec.name for spec in stage.GetRootLayer().rootPrims] == ["RayTree_240_70"]


def test_curves_run_from_node_to_node(tree: warp_rt.RayTree, tmp_path: Path) -> None:
    tree.save_usd(tmp_path / "rays.usda")
    stage = Usd.Stage.Open(str(tmp_path / "rays.usda"))
    curves = curves_of(stage, "/RayTree_240_70")
    kinds = {"eye": 1, "reflection": tree.counts["reflection"], "refraction": tree.counts["refraction"]}
    lights = [light for node in tree for light in node.lights if light.has_shadow_ray]
    kinds["shadow"] = sum(light.occluder is not None for light in lights)
    kinds["light"] = len(lights) - kinds["shadow"]
    assert kinds["shadow"] > 0 < kinds["light"]
    assert {kind: len(curve.GetCurveVertexCountsAttr().Get()) for kind, curve in curves.items()} == kinds
    for kind, curve in curves.items():
        counts, points = curve.GetCurveVertexCountsAttr().Get(), np.array(curve.GetPointsAttr().Get())
        assert set(counts) == {2}
        assert len(points) == 2 * len(counts)
        assert curve.GetTypeAttr().Get() == "linear"
        assert curve.GetWidthsAttr().Get()[0] > 0
        assert tuple(curve.GetDisplayColorAttr().Get()[0]) == pytest.approx(CURVE_COLORS[kind])
        low, high = curve.GetExtentAttr().Get()
        assert (np.array(low) < points.min(axis=0)).all()
        assert (points.max(axis=0) < np.array(high)).all()
        material, _ = UsdShade.MaterialBindingAPI(curve).ComputeBoundMaterial()
        assert material.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"
    ends = {node.index: node.position for node in tree if not node.has_left}
    eye = np.array(curves["eye"].GetPointsAttr().Get())
    np.testing.assert_allclose(eye, [tree.root.origin, ends[0]], rtol=1e-6)
    bounced = np.array(curves["reflection"].GetPointsAttr().Get()).reshape(-1, 2, 3)
    parents = [node for node in tree for child in node.children if child.kind.name == "REFLECTION"]
    np.testing.assert_allclose(bounced[:, 0], [node.position for node in parents], atol=1e-3)


def test_a_shadow_ray_ends_at_what_throws_the_shadow(tree: warp_rt.RayTree, tmp_path: Path) -> None:
    tree.save_usd(tmp_path / "rays.usda")
    stage = Usd.Stage.Open(str(tmp_path / "rays.usda"))
    shadows = np.array(curves_of(stage, "/RayTree_240_70")["shadow"].GetPointsAttr().Get()).reshape(-1, 2, 3)
    expected = [light.crossings[-1].distance for node in tree for light in node.lights if light.occluder is not None]
    np.testing.assert_allclose(np.linalg.norm(shadows[:, 1] - shadows[:, 0], axis=1), expected, rtol=1e-5)


def test_the_name_gives_way_to_the_scenes(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "scene.usda"))
    UsdGeom.Cube.Define(stage, "/RayTree_8_8")
    stage.Save()
    warp_rt.trace_tree(tmp_path / "scene.usda", 8, 8, width=16, height=16, device="cpu").save_usd(
        tmp_path / "rays.usda"
    )
    found = Usd.Stage.Open(str(tmp_path / "rays.usda"))
    assert found.GetPrimAtPath("/RayTree_8_8").IsA(UsdGeom.Cube)
    assert curves_of(found, "/RayTree_8_8_1")


def test_layer_over_a_package(tmp_path: Path) -> None:
    (tmp_path / "scene.usda").write_text('#usda 1.0\n(upAxis = "Z")\ndef Sphere "Ball" {}\n')
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "scene.usda"), str(tmp_path / "scene.usdz"))
    tree = warp_rt.trace_tree(tmp_path / "scene.usdz", 8, 8, width=16, height=16, device="cpu")
    (tmp_path / "below").mkdir()
    tree.save_usd(tmp_path / "below" / "rays.usda")
    stage = Usd.Stage.Open(str(tmp_path / "below" / "rays.usda"))
    assert stage.GetPrimAtPath("/Ball")
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert curves_of(stage, "/RayTree_8_8")


def test_the_layer_renders(tree: warp_rt.RayTree, tmp_path: Path) -> None:
    """Through the scene's own camera, lights and settings, with the rays as tubes in their colours."""
    tree.save_usd(tmp_path / "rays.usdc")
    scene, plain = (warp_rt.load_scene(path) for path in (tmp_path / "rays.usdc", SCENES / "mirror_teapot.usda"))
    assert scene.settings == plain.settings
    assert [camera.path for camera in scene.cameras] == [camera.path for camera in plain.cameras]
    image = warp_rt.render(scene, width=640, device="cpu", aovs=("color", "primId"))
    rays = [row for row, path in enumerate(scene.prims) if path.startswith("/RayTree")]
    seen = np.isin(image["primId"], rays)
    assert seen.sum() > 100
    own = image.linear[seen] - warp_rt.render(plain, width=640, device="cpu").linear[seen]
    assert (np.abs(own).max(axis=-1) > 0.02).mean() > 0.9


@pytest.mark.parametrize("name", ["rays.png", "rays", "rays.usdz"])
def test_other_extensions_are_refused(tree: warp_rt.RayTree, tmp_path: Path, name: str) -> None:
    with pytest.raises(warp_rt.OptionError, match=r"rays.*: a USD layer ends in \.usda, \.usdc, \.usd"):
        tree.save_usd(tmp_path / name)


def test_a_scene_without_a_file_is_refused(tmp_path: Path) -> None:
    scene = warp_rt.Scene.from_arrays([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    tree = warp_rt.trace_tree(scene, 0, 0, width=1, height=1, device="cpu")
    with pytest.raises(warp_rt.OptionError, match="the scene was not read from one"):
        tree.save_usd(tmp_path / "rays.usda")
    assert list(tmp_path.iterdir()) == []
