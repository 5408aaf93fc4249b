# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the benchmark of reference pictures changes of stages and pictures."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdRender

from ..benchmark_modules import load

settings = load("reference_settings")
as_polygons = settings.as_polygons
references = load("references")
PARTS, filter_parts = references.PARTS, references.filter_parts


@pytest.mark.parametrize("kind", ["Sphere", "Cylinder", "Cone", "Capsule"])
def test_cages_are_closed_and_touch_the_shape(kind: str) -> None:
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/Shape", kind)
    prim.GetAttribute("radius").Set(2.0)
    if kind != "Sphere":
        prim.GetAttribute("height").Set(12.0)
        prim.GetAttribute("axis").Set("X")
    as_polygons(stage, Usd.TimeCode.Default())
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Shape"))
    points = np.array(mesh.GetPointsAttr().Get())
    counts, corners = mesh.GetFaceVertexCountsAttr().Get(), np.array(mesh.GetFaceVertexIndicesAttr().Get())
    starts = np.cumsum([0, *counts])
    edges = {
        (int(first), int(second))
        for start, end in itertools.pairwise(starts)
        for first, second in zip(corners[start:end], np.roll(corners[start:end], -1), strict=True)
    }
    assert len(edges) == len(corners)  # none twice the same way
    assert edges == {(second, first) for first, second in edges}  # and each both ways: closed
    assert len(points) - len(edges) / 2 + len(counts) == 2  # Euler's formula
    length = 2.0 if kind == "Sphere" else 8.0 if kind == "Capsule" else 6.0
    axis = 2 if kind == "Sphere" else 0
    np.testing.assert_allclose(np.abs(points[:, axis]).max(), length, rtol=1e-6)
    across = np.delete(points, axis, axis=1)
    np.testing.assert_allclose(np.linalg.norm(across, axis=1).max(), 2.0, rtol=1e-6)


def test_a_patch_becomes_its_control_net() -> None:
    stage = Usd.Stage.CreateInMemory()
    patch = UsdGeom.NurbsPatch.Define(stage, "/Patch")
    patch.GetPointsAttr().Set([(x, y, 0) for y in range(3) for x in range(4)])
    patch.GetUVertexCountAttr().Set(4)
    patch.GetVVertexCountAttr().Set(3)
    as_polygons(stage, Usd.TimeCode.Default())
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Patch"))
    assert list(mesh.GetFaceVertexCountsAttr().Get()) == [4] * 6
    assert list(mesh.GetFaceVertexIndicesAttr().Get())[:4] == [0, 1, 5, 4]


def test_segments_of_curves_become_cylinders_that_end_where_they_do() -> None:
    stage = Usd.Stage.CreateInMemory()
    curves = UsdGeom.BasisCurves.Define(stage, "/Curves")
    curves.GetTypeAttr().Set("linear")
    curves.GetPointsAttr().Set([(1, 0, 0), (1, 4, 0), (4, 4, 0), (0, 0, 7), (0, 0, 9)])
    curves.GetCurveVertexCountsAttr().Set([3, 2])
    curves.GetWidthsAttr().Set([0.5])
    settings.with_flat_ends(stage, Usd.TimeCode.Default())
    cylinders = [UsdGeom.Cylinder(prim) for prim in stage.TraverseAll() if prim.IsA(UsdGeom.Cylinder)]
    ends = []
    for cylinder in cylinders:
        assert cylinder.GetRadiusAttr().Get() == 0.25
        half = cylinder.GetHeightAttr().Get() / 2
        place = cylinder.ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        ends.append([tuple(np.round(place.Transform((0, 0, z)), 6)) for z in (-half, half)])
    assert ends == [[(1, 0, 0), (1, 4, 0)], [(1, 4, 0), (4, 4, 0)], [(0, 0, 7), (0, 0, 9)]]


def test_velocities_carry_from_the_frame_where_both_have_a_sample_there() -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.SetTimeCodesPerSecond(4)
    instancer = UsdGeom.PointInstancer.Define(stage, "/Instancer")
    instancer.GetProtoIndicesAttr().Set([0])
    instancer.GetPositionsAttr().Set([(1, 0, 0)])
    instancer.GetVelocitiesAttr().Set([(8, 0, 0)], 1)
    sphere = UsdGeom.Sphere.Define(stage, "/Instancer/Sphere")
    instancer.GetPrototypesRel().AddTarget(sphere.GetPath())
    settings.as_sampled_now(stage, Usd.TimeCode(0))
    for time, place in ((0, 1), (0.5, 2), (-0.5, 0)):
        (transform,) = instancer.ComputeInstanceTransformsAtTime(time, 0)
        assert transform.ExtractTranslation() == (place, 0, 0)


def test_pixels_have_one_sample_where_no_render_settings_or_they_say_so(tmp_path: Path) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "stage.usda"))
    stage.Save()
    assert references.is_sampled_once(tmp_path / "stage.usda")
    prim = UsdRender.Settings.Define(stage, "/Render/Settings").GetPrim()
    stage.Save()
    assert not references.is_sampled_once(tmp_path / "stage.usda")
    prim.CreateAttribute("arnold:global:AA_samples", Sdf.ValueTypeNames.Int).Set(1)
    stage.Save()
    assert references.is_sampled_once(tmp_path / "stage.usda")


def test_of_one_sample_a_pixel_the_filter_takes_four_neighbours() -> None:
    dot = np.zeros((5, 5))
    dot[2, 2] = 1.0
    filtered = filter_parts(dot, 1)
    beside = np.exp(-2) / (1 + 4 * np.exp(-2))  # 22 of 255, as in the pictures
    np.testing.assert_allclose(filtered[2], [0, beside, 1 - 4 * beside, beside, 0], rtol=1e-6)
    assert filtered[1, 1] == 0


def test_the_filter_keeps_constants_and_reaches_one_pixel() -> None:
    np.testing.assert_allclose(filter_parts(np.ones((4 * PARTS, 5 * PARTS, 3)), PARTS), 1.0, rtol=1e-6)
    edge = np.zeros((PARTS, 8 * PARTS))
    edge[:, 4 * PARTS :] = 1.0
    filtered = filter_parts(edge, PARTS)[0]
    np.testing.assert_allclose(filtered[3] + filtered[4], 1.0, rtol=1e-6)  # an edge, seen from both sides
    assert 0.5 > filtered[3] > 0.0
    assert filtered[2] == 0.0
