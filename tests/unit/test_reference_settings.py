# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the benchmark of reference pictures changes of stages and pictures."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from ..benchmark_modules import load

as_polygons = load("reference_settings").as_polygons
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


def test_the_filter_keeps_constants_and_reaches_one_pixel() -> None:
    np.testing.assert_allclose(filter_parts(np.ones((4 * PARTS, 5 * PARTS, 3))), 1.0, rtol=1e-6)
    edge = np.zeros((PARTS, 8 * PARTS))
    edge[:, 4 * PARTS :] = 1.0
    filtered = filter_parts(edge)[0]
    np.testing.assert_allclose(filtered[3] + filtered[4], 1.0, rtol=1e-6)  # an edge, seen from both sides
    assert 0.5 > filtered[3] > 0.0
    assert filtered[2] == 0.0
