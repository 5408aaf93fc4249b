# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pictures and ray counts beside POV-Ray 3.7, where it is installed; and what its exporter says of the rest."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from warp_rt import Scene, load_scene
from warp_rt.scene import Camera, Dome, Input, LightKind

from ..analytic.scenes import box, distant, lamp, looking, preview, scene_of, square, whitted
from ..benchmark_modules import load
from ..data import ROOT

povray, povray_run, povray_scenes = (load(name) for name in ("povray", "povray_run", "povray_scenes"))
OPTIONS = Namespace(width=160, height=120, povray=povray_run.PROGRAM, pov=None)
CAMERA = Camera("/camera", looking((0, 1, -1), (0, -5, 5)), (-0.4, 0.4, -0.3, 0.3))

needs_povray = pytest.mark.skipif(not povray_run.is_installed(), reason=f"no POV-Ray: {povray_run.INSTALL}")


@needs_povray
@pytest.mark.parametrize("seed", [None, 0, 1])
def test_beside_povray(seed: int | None) -> None:
    """The mirror and the teapot, then random scenes: none but soft spots differ."""
    base = load_scene(ROOT / "scenes" / "mirror_teapot.usda")
    scene = povray_scenes.with_povray_glass(base) if seed is None else povray_scenes.random_scene(base, seed)
    shadows = "transmit" if seed == 1 else "opaque"
    row, _, _ = povray.compare(scene, OPTIONS, depth=7, threshold=0.0, shadows=shadows)
    assert row["unsupported"] == []
    assert row["differ_on_soft_spots"] + row["differ_elsewhere"] <= row["pixels"] / 1000
    assert row["differ_elsewhere"] <= 1  # a hundredth of a pixel does not find all
    for name in ("tree_rays", "shadow_rays", "total_internal_reflections"):
        ours, theirs = row[name]
        if theirs is not None:
            assert ours == pytest.approx(theirs, rel=1e-3, abs=2), name


def exported(scene: Scene, **more: object) -> Any:
    scene = replace(scene, cameras=(replace(CAMERA, **more),))
    return povray.Export(scene, width=40, height=30, depth=3, threshold=0.0)


def test_what_povray_has_no_equal_for_is_told() -> None:
    texture = Input(texture=0)
    glass = replace(whitted(transmission=(0.9, 0.8, 0.7), reflection=0.1), path="/glass")
    bodies = [
        square(replace(whitted(diffuse=texture, specular=(0.1, 0.2, 0.3)), path="/floor")),
        square(preview(), z=-1.0),
        box(glass, (0, 0, 0), (1, 1, 1)),
        box(glass, (0.5, 0, 0), (2, 1, 1)),
    ]
    lights = [
        lamp(LightKind.RECT, (0, 0, 5)),
        lamp(LightKind.POINT, (0, 0, 5)),
        distant((0, 0, -1), angle=0.1),
        lamp(LightKind.POINT, (0, 0, 5), has_falloff=False, cone_angle=1.0),
        lamp(LightKind.POINT, (0, 0, 5), has_falloff=False, casts_shadow=False),
    ]
    scene = scene_of(*bodies, lights=lights, domes=[Dome("/dome", np.eye(4), (1, 1, 1))])
    told = "\n".join(exported(scene, is_perspective=False, exposure_scale=2.0).unsupported)
    for line in (
        "/camera: an orthographic camera",
        "/camera: exposure",
        "/dome: a dome light is left out",
        "/lamp: a rect light with an extent is left out",
        "/lamp: a point light that weakens with distance is left out",
        "/distant: a distant light with an extent is left out",
        "/lamp: a light with a cone or focus is left out",
        "/lamp: a light with multipliers, or without shadows is left out",
        "/floor: diffuse is textured",
        "/floor: specular is coloured",
        "/preview: no WhittedSurface",
        "/glass: transmission is coloured",
        "/glass: reflection + transmission is not 1",
        "/body3: glass that may touch /body2",
    ):
        assert line in told
    assert len(told.splitlines()) == 14


def test_a_scene_of_the_lectures_terms_is_exported_in_full() -> None:
    glass = whitted(transmission=0.8, reflection=0.2, ior=1.5)
    lights = [distant((0, 0, -1)), lamp(LightKind.POINT, (0, 0, 5), has_falloff=False)]
    scene = scene_of(square(whitted(diffuse=0.5)), box(glass, (0, 0, 0.1), (1, 1, 1)), lights=lights)
    export = exported(scene)
    assert export.unsupported == []
    assert export.text.count("light_source{") == 2
    assert export.text.count("mesh2{") == 3  # the glass has a twin for shadows
    assert export.text.count("{") == export.text.count("}")


def test_the_command_writes_picture_and_scene(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if not povray_run.is_installed():
        pytest.skip(f"no POV-Ray: {povray_run.INSTALL}")
    picture, pov = tmp_path / "both.png", tmp_path / "scene.pov"
    stage = str(ROOT / "scenes" / "mirror_teapot.usda")
    povray.main([stage, "--width", "40", "--height", "30", "--picture", str(picture), "--pov", str(pov)])
    assert "reflection + transmission is not 1" in capsys.readouterr().out
    assert picture.stat().st_size > 0
    assert pov.read_text().startswith("#version 3.7;")
