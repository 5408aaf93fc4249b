# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Directions at a surface, against Snell's law, Fresnel's equations and the law of reflection in float64."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.vector import (
    face_forward,
    fresnel_schlick,
    max_component,
    reflect,
    refract,
    refraction_discriminant,
)
from warp_rt.warp_setup import init_warp

init_warp()

FLOAT32_DIRECTIONS = 5e-7  # a few roundings of float32 on components of size one


def unit(rng: np.random.Generator) -> np.ndarray:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def incoming(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    n, d = unit(rng), unit(rng)
    return (d if d @ n < 0 else -d), n


@pytest.mark.parametrize("seed", range(8))
def test_reflection_keeps_the_tangent_and_turns_the_normal_part(seed: int) -> None:
    d, n = incoming(np.random.default_rng(seed))
    r = np.array(reflect(wp.vec3(*d), wp.vec3(*n)))
    np.testing.assert_allclose(r - (r @ n) * n, d - (d @ n) * n, atol=FLOAT32_DIRECTIONS)
    assert r @ n == pytest.approx(-(d @ n), abs=FLOAT32_DIRECTIONS)


@pytest.mark.parametrize("eta", [1 / 1.5, 1 / 2.4, 1.0])
@pytest.mark.parametrize("seed", range(4))
def test_refraction_obeys_snell(seed: int, eta: float) -> None:
    d, n = incoming(np.random.default_rng(seed))
    sin_in = np.linalg.norm(np.cross(d, n))
    t = np.array(refract(wp.vec3(*d), wp.vec3(*n), eta))
    assert np.linalg.norm(np.cross(t, n)) == pytest.approx(eta * sin_in, abs=2e-6)  # n1 sin1 = n2 sin2
    assert t @ n < 0
    assert np.linalg.norm(t) == pytest.approx(1, abs=FLOAT32_DIRECTIONS)
    assert np.linalg.det([d, n, t]) == pytest.approx(0, abs=2e-6)  # in the plane of incidence


def test_total_internal_reflection_starts_at_the_critical_angle() -> None:
    critical = np.arcsin(1 / 1.5)
    for angle, is_total in ((critical - 1e-3, False), (critical + 1e-3, True)):
        assert (refraction_discriminant(float(np.cos(angle)), 1.5) < 0) is is_total
        d = wp.vec3(float(np.sin(angle)), 0.0, float(-np.cos(angle)))
        assert bool(np.any(refract(d, wp.vec3(0.0, 0.0, 1.0), 1.5))) is not is_total


def test_schlick_runs_from_normal_to_grazing() -> None:
    f0, f90 = wp.vec3(0.04, 0.5, 1.0), wp.vec3(1.0, 0.9, 1.0)
    np.testing.assert_allclose(fresnel_schlick(f0, f90, 1.0), f0, atol=1e-7)
    np.testing.assert_allclose(fresnel_schlick(f0, f90, 0.0), f90, atol=1e-7)
    middle = np.array(f0) + (np.array(f90) - np.array(f0)) * 0.5**5
    np.testing.assert_allclose(fresnel_schlick(f0, f90, 0.5), middle, atol=1e-7)


def test_face_forward_and_max_component() -> None:
    n = wp.vec3(0.0, 0.0, 1.0)
    assert tuple(face_forward(n, wp.vec3(0.3, 0.0, 0.5))) == (0.0, 0.0, 1.0)
    assert tuple(face_forward(n, wp.vec3(0.3, 0.0, -0.5))) == (0.0, 0.0, -1.0)
    assert [max_component(wp.vec3(*v)) for v in ((3.0, 1.0, 2.0), (1.0, 3.0, 2.0), (1.0, 2.0, 3.0))] == [3.0] * 3
