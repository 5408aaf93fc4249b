# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A frame of each sweep of ``python -m benchmarks radiometry``: a floor under a light, from the stage to the pixel."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import Renderer, RenderOptions, load_scene

from ..benchmark_modules import load

light_files, light_floor = load("light_files"), load("light_floor")
light_sweeps, radiometry = load("light_sweeps"), load("radiometry")
ACROSS = 6
# Every other pixel, as on a chequerboard: of two that mirror each other at the light's plane, which is that of most
# frames, exactly one.
CHECKED = np.flatnonzero(np.indices((ACROSS, ACROSS)).sum(axis=0) % 2 == 0)
TYPES = (*light_sweeps.AREA_LIGHTS, "DistantLight", "DomeLight", *radiometry.SWEEPS)


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> dict:
    files = light_files.write_files(tmp_path_factory.mktemp("lights"))
    found: dict = {}
    for light, name, frames in radiometry.all_sweeps(files):
        found.setdefault(light, {})[name] = frames
    return found


@pytest.mark.parametrize("light", TYPES)
def test_floors_within_one_percent(light: str, sweeps: dict) -> None:
    """Each pixel away from the terminator; distant lights to a thousandth, means to half a percent."""
    points = light_floor.floor_points(ACROSS)[CHECKED]
    module = radiometry.SWEEPS.get(light, light_sweeps)
    pixel_goal, mean_goal = (1e-3, 1e-3) if light == "DistantLight" else (0.01, 0.005)
    for name, frames in sweeps[light].items():
        frame = frames[len(frames) // 2]
        scene = load_scene(module.make_stage([frame]), time=0, render_pass=module.PASS)
        film = Renderer(scene, RenderOptions(width=ACROSS, height=ACROSS), device="cpu").render()
        mean, pixel, _ = radiometry.errors_of(film.color.reshape(-1, 3)[CHECKED], module.expected(frame, points))
        assert (abs(mean) < mean_goal, abs(pixel) < pixel_goal) == (True, True), (name, mean, pixel)
        assert not [d for d in scene.diagnostics if d.code.startswith("W")], name


def test_errors_are_told() -> None:
    exact = np.array([[1.0, 2.0, 4.0], [0.5, 1.0, 2.0], [0.01, 0.0, 0.0]])
    found = exact * np.array([[1.0], [1.1], [9.0]])
    mean, pixel, rms = radiometry.errors_of(found, exact)
    assert (mean, pixel, rms) == pytest.approx((0.43 / 10.51, 0.1, np.sqrt(0.005)))
    assert radiometry.errors_of(np.full((1, 3), 0.25), np.zeros((1, 3))) == (0.25, 0.25, 0.25)
