# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Reflection models, against their definitions in float64."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.brdf import ggx_specular, phong
from warp_rt.warp_setup import init_warp

init_warp()


def direction(theta: float, phi: float = 0.0) -> np.ndarray:
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@pytest.mark.parametrize("angles", [(0.2, 0.1, 0.0), (0.7, 0.6, 3.1), (1.2, 1.1, 2.0), (0.4, 1.3, 0.5)])
@pytest.mark.parametrize("exponent", [1.0, 24.0, 200.0])
def test_phong_is_the_lectures_formula(angles: tuple, exponent: float) -> None:
    wo, wi, n = direction(angles[0]), direction(angles[1], angles[2]), np.array([0.0, 0, 1])
    kd, ks = np.array([0.5, 0.2, 0.1]), np.array([0.3, 0.3, 0.4])
    mirrored = 2 * (n @ wi) * n - wi
    expected = kd * (n @ wi) + ks * max(mirrored @ wo, 0) ** exponent
    got = phong(wp.vec3(*kd), wp.vec3(*ks), exponent, wp.vec3(*n), wp.vec3(*wo), wp.vec3(*wi))
    np.testing.assert_allclose(got, expected, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("angles", [(0.3, 0.35, 3.14), (0.9, 0.8, 3.0), (0.1, 1.2, 1.0)])
def test_ggx_is_cook_torrance(alpha: float, angles: tuple) -> None:
    wo, wi, n = direction(angles[0]), direction(angles[1], angles[2]), np.array([0.0, 0, 1])
    f0, f90 = np.array([0.04, 0.5, 0.9]), np.ones(3)
    h = (wo + wi) / np.linalg.norm(wo + wi)
    d = alpha**2 / (np.pi * ((n @ h) ** 2 * (alpha**2 - 1) + 1) ** 2)
    k = alpha / 2
    g = (n @ wo) / ((n @ wo) * (1 - k) + k) * (n @ wi) / ((n @ wi) * (1 - k) + k)
    f = f0 + (f90 - f0) * (1 - wo @ h) ** 5
    expected = f * d * g / (4 * (n @ wo) * (n @ wi))
    got = ggx_specular(wp.vec3(*f0), wp.vec3(*f90), alpha, wp.vec3(*n), wp.vec3(*wo), wp.vec3(*wi))
    # A lobe of width 0.01 magnifies the rounding of the half vector: 1e-7 / alpha^2 relative.
    np.testing.assert_allclose(got, expected, rtol=1e-4 + 2e-7 / alpha**2)


@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_ggx_never_returns_more_light_than_comes(alpha: float) -> None:
    """With F = 1 the directional albedo must stay below one: integral of brdf cos over the hemisphere."""
    n_theta, n_phi = 400, 200
    h_theta = np.arctan(
        alpha * np.sqrt((np.arange(n_theta) + 0.5) / n_theta / (1 - (np.arange(n_theta) + 0.5) / n_theta))
    )
    phi = (np.arange(n_phi) + 0.5) / n_phi * 2 * np.pi
    for theta in (0.1, 0.8, 1.3):
        wo = direction(theta)
        th, ph = (q.reshape(-1) for q in np.meshgrid(h_theta, phi))
        h = np.stack([np.sin(th) * np.cos(ph), np.sin(th) * np.sin(ph), np.cos(th)], -1)
        wi = 2 * (h @ wo)[:, None] * h - wo
        up = (wi[:, 2] > 0) & (h @ wo > 0)
        # Importance sampling of D: each sample stands for brdf cos / pdf = G (wo.h) / ((n.wo) (n.h)).
        k = alpha / 2
        g = (wo[2] / (wo[2] * (1 - k) + k)) * (wi[:, 2] / (wi[:, 2] * (1 - k) + k))
        albedo = np.sum(np.where(up, g * (h @ wo) / (wo[2] * h[:, 2]), 0)) / len(th)
        assert albedo < 1.0
        i = int(np.flatnonzero(up)[len(np.flatnonzero(up)) // 2])
        one = wp.vec3(1.0, 1.0, 1.0)
        got = ggx_specular(one, one, alpha, wp.vec3(0.0, 0.0, 1.0), wp.vec3(*wo), wp.vec3(*wi[i]))[0]
        d = alpha**2 / (np.pi * (h[i, 2] ** 2 * (alpha**2 - 1) + 1) ** 2)
        assert got == pytest.approx(d * g[i] / (4 * wo[2] * wi[i, 2]), rel=1e-3)
