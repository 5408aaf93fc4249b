# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""luxtest's sweep of IES profiles on a disk light, against quadrature in float64 of what the file says.

https://github.com/anderslanglands/luxtest, frames 51 to 60 of ``disk.usda``: angle scales from -1 to 1, then the same
normalized. The file's numbers are read here a second time, by NumPy alone.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.data import find_test_data
from warp_rt import Renderer, RenderOptions, load_scene

CORPORA = find_test_data("corpora")
VERTICAL_COUNT, HORIZONTAL_COUNT = 73, 37
SCALES = (-1.0, -0.5, 0.0, 0.5, 1.0)
ALMOST_ZERO = -2.6645353e-15
"""Of frame 53: what angles are divided by, so that it is dark."""
GREY = 0.5
"""Diffuse reflectance of the floor, which has no material."""


def _profile(text: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    numbers = np.array(text.split("TILT=NONE")[1].split(), float)[13:]
    vertical, horizontal, values = np.split(numbers, [VERTICAL_COUNT, VERTICAL_COUNT + HORIZONTAL_COUNT])
    return np.radians(vertical), np.radians(horizontal), values.reshape(HORIZONTAL_COUNT, VERTICAL_COUNT)


def _factor(file: tuple[np.ndarray, np.ndarray, np.ndarray], emitted: np.ndarray, scale: float) -> np.ndarray:
    """Return the profile in directions of the light's space; its half turn is mirrored at the plane 0 to 180."""
    vertical, horizontal, values = file
    theta = np.arccos(np.clip(-emitted[..., 2] / np.linalg.norm(emitted, axis=-1), -1, 1))
    if scale > 0:
        theta = theta / scale
    elif scale < 0:
        theta = (theta - np.pi) / -scale + np.pi
    phi = np.abs(np.arctan2(-emitted[..., 1], -emitted[..., 0]))
    row, column = phi / horizontal[1], np.clip(theta, 0, np.pi) / vertical[1]  # both evenly spaced
    j = np.minimum(row.astype(int), HORIZONTAL_COUNT - 2)
    i = np.minimum(column.astype(int), VERTICAL_COUNT - 2)
    h, v = row - j, column - i
    low = values[j, i] * (1 - v) + values[j, i + 1] * v
    high = values[j + 1, i] * (1 - v) + values[j + 1, i + 1] * v
    return np.where((theta >= 0) & (theta <= np.pi), low * (1 - h) + high * h, 0.0)


def _power(file: tuple[np.ndarray, np.ndarray, np.ndarray]) -> float:
    """Return the mean over the sphere, by a fine grid of directions."""
    theta, phi = np.meshgrid((np.arange(1440) + 0.5) * np.pi / 1440, (np.arange(720) + 0.5) * np.pi / 720)
    emitted = np.stack([-np.sin(theta) * np.cos(phi), -np.sin(theta) * np.sin(phi), -np.cos(theta)], axis=-1)
    weight = np.sin(theta)
    return float((_factor(file, emitted, 0.0) * weight).sum() / weight.sum())


@pytest.mark.skipif(CORPORA is None, reason="the stages are not at hand: set WARP_RT_TEST_DATA")
@pytest.mark.parametrize("frame", range(51, 61))
def test_disk_with_a_profile(frame: int) -> None:
    folder = CORPORA / "luxtest"
    scene = load_scene(folder / "usd" / "disk.usda", time=frame)
    options = RenderOptions(width=12, height=12, aovs=("color", "position", "primId"), light_samples=1024)
    film = Renderer(scene, options, device="cpu").render()
    file = _profile((folder / "bega_omni002_4777lm.ies").read_text())
    scale = SCALES[(frame - 51) % 5] if frame != 53 else ALMOST_ZERO
    light = scene.lights[0]
    n = 60
    radius, angle = (q.reshape(-1) for q in np.meshgrid((np.arange(n) + 0.5) / n / 2, np.arange(2 * n) / n * np.pi))
    frame_axes = light.world_from_light[:3, :3]
    local = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * radius], axis=1)
    points = light.world_from_light[:3, 3] + local @ frame_axes.T
    areas = radius / (2 * n) * (np.pi / n)
    # On the floor, away from the pane in its middle and from what that shadows.
    is_floor = film.aovs["primId"] == scene.prims.index("/floorPlane/mesh_0")
    is_floor &= np.abs(film.aovs["position"][..., 0]) > 2
    assert is_floor.sum() == 60
    expected = []
    for position in film.aovs["position"][is_floor].astype(float):
        emitted = position - points
        d2 = (emitted**2).sum(axis=1)
        own = emitted @ frame_axes
        cosines = np.maximum(-own[:, 2], 0) * -emitted[:, 1] / d2
        expected.append(float((_factor(file, own, scale) * cosines / d2 * areas).sum()) / np.pi)
    reference = np.array(expected) * light.radiance[0] * GREY
    if frame >= 56:
        reference /= _power(file)
    found = film.aovs["color"][is_floor][:, 0]
    np.testing.assert_allclose(found, reference, rtol=0.02, atol=0.002 * reference.max())
    np.testing.assert_allclose(found.mean(), reference.mean(), rtol=2e-3)
