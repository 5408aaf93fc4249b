# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a picture does not show as the stage says it is told from Python too: in its film, and in the log."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

import warp_rt

BROKEN = """\
#usda 1.0
def Mesh "M{0}"
{{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 1, 7]
}}
"""


def stage(folder: Path, count: int) -> Path:
    """Write a stage of meshes that name a point that is not there."""
    path = folder / "broken.usda"
    meshes = [BROKEN.format(index).removeprefix("#usda 1.0\n") for index in range(count)]
    path.write_text("#usda 1.0\n" + "".join(meshes))
    return path


def test_a_picture_tells_its_warnings_and_keeps_them(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, logger="warp_rt")
    image = warp_rt.render(stage(tmp_path, 1), width=8, device="cpu")
    kept = image.film.diagnostics
    assert [record.prim for record in kept if record.is_warning] == ["/M0"]
    assert {"N901", "N902"} <= {record.code for record in kept}  # no camera, no light
    told = [record for record in caplog.records if record.levelno == logging.WARNING]
    assert [record.getMessage() for record in told if "compiling" not in record.getMessage()] == [
        str(record) for record in kept if record.is_warning
    ]


def test_a_scene_tells_long_groups_in_short(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    scene = warp_rt.load_scene(stage(tmp_path, 30))
    (code,) = {record.code for record in scene.diagnostics if record.is_warning}
    assert len(caplog.records) == 4
    assert caplog.records[-1].getMessage() == f"{code}: and 27 more of this kind (Scene.diagnostics names them all)"
    assert "warnings 30>" in repr(scene)
