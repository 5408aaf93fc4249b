# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights by their outline: vector irradiance above a horizon, against closed forms and sums in float64."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.outline import cone_flux, edge_flux
from warp_rt.kernels.profile import end_factor
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.scene import Light, LightKind
from warp_rt.warp_setup import init_warp

from ..lights_float64 import arriving, patches
from ..lights_on_device import see_outline, upload_light

init_warp()
UP = wp.vec3(0.0, 0.0, 1.0)


def see(light: Light, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return flux and middle: float32, shape [n, 2, 3]."""
    rows = see_outline(SceneData(), upload_light(light), positions, normals)
    return np.stack([rows["flux"], rows["middle"]], axis=1)


SHEAR = np.array([[1.3, 0.4, 0.0, 0.3], [0.0, 0.7, 0.5, -0.2], [0.0, 0.0, -0.9, 0.1], [0, 0, 0, 1.0]])
KINDS = [LightKind.RECT, LightKind.DISK, LightKind.SPHERE, LightKind.CYLINDER]


@pytest.mark.parametrize("distance", [1.3, 4.0, 300.0])
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name.lower())
def test_outlines_of_sheared_lights(kind: LightKind, distance: float) -> None:
    """Surfaces turned all ways, many of whose horizons cut the light; from far away in full digits, too."""
    rng = np.random.default_rng(3)
    light = Light("/light", kind, SHEAR, (1.0, 1.0, 1.0), radius=0.6, width=1.4, length=1.6)
    positions, normals = rng.normal(size=(2, 16, 3))
    positions *= distance / np.linalg.norm(positions, axis=1, keepdims=True)
    normals[8:] = np.cross(normals[8:], positions[8:])  # the light stands on these horizons
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    found = see(light, positions, normals)
    cut = patches(light, 200)
    for place, normal, (flux, middle) in zip(positions, normals, found, strict=True):
        wi, solid_angle, _ = arriving(light, place, cut=cut)
        above = wi @ normal > 0
        expected = (wi * solid_angle[:, None])[above].sum(axis=0)
        whole = solid_angle.sum()
        np.testing.assert_allclose(flux, expected, atol=3e-3 * whole)
        if solid_angle[above].sum() > 0.01 * whole:
            assert middle @ normal > 0
            assert np.linalg.norm(place + middle - SHEAR[:3, 3]) < np.linalg.norm(cut[0] - SHEAR[:3, 3], axis=1).max()


@pytest.mark.parametrize("degrees", [0.5, 20.0, 90.0, 130.0, 180.0])
def test_cones(degrees: float) -> None:
    """Of half angle a about the normal pi sin^2 a, or pi; on the horizon half the lune's: (a - sin a cos a)."""
    a = np.radians(degrees)
    cap = float(2 * np.sin(a / 2) ** 2)
    above = cone_flux(UP, cap, UP)[2]
    assert above == pytest.approx(np.pi * (np.sin(a) ** 2 if degrees < 90 else 1), rel=1e-5)
    level = cone_flux(wp.vec3(1.0, 0.0, 0.0), cap, UP)[2]
    assert level == pytest.approx(a - np.sin(a) * np.cos(a), rel=1e-3 if degrees < 1 else 1e-5)
    below = cone_flux(-UP, cap, UP)[2]
    assert below == pytest.approx(np.pi * np.cos(a) ** 2 if degrees > 90 else 0, abs=1e-5)


def test_an_edge_is_the_angle_that_it_covers() -> None:
    """From x to an angle further round z: that angle along z, less the part that closed outlines sum up to nothing."""
    for angle in (0.01, 0.5, 0.8, 2.0, 3.0):
        c = wp.vec3(1.0, 0.0, 0.0)
        b = wp.vec3(float(np.cos(angle) - 1), float(np.sin(angle)), 0.0)
        got = np.array(edge_flux(c, wp.vec3(0.0, 0.0, 0.0), b))
        np.testing.assert_allclose(got, (0, 0, angle - np.sin(angle)), rtol=2e-5, atol=1e-9)


def test_ends_of_a_profile() -> None:
    assert [end_factor(x, 0.0) for x in (-1.0, 0.0, 1.0)] == [0, 1, 1]
    assert [end_factor(x, 0.5) for x in (-0.25, 0.0, 0.25)] == [0, 0.5, 1]
