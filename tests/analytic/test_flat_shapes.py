# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Solids that a transform flattens along z are disks, whichever solids they were: outline, points and normals."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom

import warp_rt

PIXELS = 64
EXTENT = 3.0  # of the picture, in scene units
AWAY = 8.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("thickness", [1e-3, 1e-5, 1e-6, 1e-8])
@pytest.mark.parametrize("kind", ["Sphere", "Cylinder", "Cone", "Capsule", "Cylinder_1"])
def test_flattened_solids_are_disks(kind: str, thickness: float, side: float) -> None:
    """A parallel view aslant: rays meet the disk in z = 0 where they should, and see its face."""
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.Xform.Define(stage, "/flat")
    prim.AddScaleOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(1, 1, thickness))
    solid = stage.DefinePrim("/flat/solid", kind)
    for name in ("radius", "radiusBottom"):
        if solid.GetAttribute(name):
            solid.GetAttribute(name).Set(1.0)
    toward = np.array([0.4, 0.3, 0.8 * side])
    toward /= np.linalg.norm(toward)
    right = np.cross([0.1, 1.0, 0.2], toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    camera = UsdGeom.Camera.Define(stage, "/camera")
    rows = [[*right, 0], [*up, 0], [*toward, 0], [*(AWAY * toward), 1]]
    camera.AddTransformOp().Set(Gf.Matrix4d(*np.concatenate(rows).tolist()))
    camera.CreateProjectionAttr("orthographic")
    camera.CreateHorizontalApertureAttr(10 * EXTENT)
    camera.CreateVerticalApertureAttr(10 * EXTENT)
    image = warp_rt.render(
        stage, width=PIXELS, height=PIXELS, camera="/camera", aovs=("elementId", "position", "normal"), depth=1
    )

    across = ((np.arange(PIXELS) + 0.5) / PIXELS - 0.5) * EXTENT
    origin = across[None, :, None] * right - across[:, None, None] * up
    crossing = origin - origin[..., 2:] / toward[2] * toward
    distance = np.hypot(crossing[..., 0], crossing[..., 1])
    is_hit = np.asarray(image["elementId"]).reshape(PIXELS, PIXELS) >= 0
    # A ray passes the rim aslant: by as much as it moves on its way through the solid, and float32 rounds it.
    margin = 3 * thickness + 1e-5
    assert is_hit[distance < 1 - margin].all()
    assert not is_hit[distance > 1 + margin].any()
    inside = distance < 0.98
    found = np.asarray(image["position"], float)[inside]
    np.testing.assert_allclose(found, crossing[inside], atol=3 * thickness + 2e-5)
    normals = np.asarray(image["normal"], float)[inside]
    np.testing.assert_allclose(normals, np.tile([0, 0, side], (len(normals), 1)), atol=10 * thickness + 1e-6)
