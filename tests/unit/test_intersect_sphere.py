# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray against a sphere, against the quadratic formula in float64."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.intersect_sphere import intersect_sphere, is_sphere_met
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def evaluate(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    centers: wp.array[wp.vec3],
    radii: wp.array[float],
    t_max: float,
    t_out: wp.array[wp.vec2],
    is_met_out: wp.array[wp.bool],
):
    i = wp.tid()
    t_out[i] = intersect_sphere(origins[i], directions[i], centers[i], radii[i])
    is_met_out[i] = is_sphere_met(origins[i], directions[i], t_max, centers[i], radii[i])


def call(o, d, c, r, t_max=np.inf, device="cpu") -> tuple[np.ndarray, np.ndarray]:
    vectors = [wp.array(np.atleast_2d(v).astype(np.float32), dtype=wp.vec3, device=device) for v in (o, d, c)]
    radii = wp.array(np.atleast_1d(r).astype(np.float32), dtype=float, device=device)
    t = wp.empty(len(radii), dtype=wp.vec2, device=device)
    met = wp.empty(len(radii), dtype=wp.bool, device=device)
    wp.launch(evaluate, len(radii), inputs=[*vectors, radii, float(t_max)], outputs=[t, met], device=device)
    return t.numpy(), met.numpy()


@pytest.mark.parametrize("length", [0.5, 1.0, 7.0])
def test_through_the_centre(length: float) -> None:
    t, met = call([0, 0, 5], [0, 0, -length], [0, 0, 0], 2)
    np.testing.assert_allclose(t[0], [3 / length, 7 / length], rtol=1e-6)
    assert met[0]


def test_roots_of_random_rays(device: str) -> None:
    rng = np.random.default_rng(2)
    count = 5000
    o, c = rng.uniform(-3, 3, (2, count, 3)).astype(np.float32).astype(float)
    d = rng.normal(size=(count, 3)).astype(np.float32).astype(float)
    r = rng.uniform(0.1, 2, count).astype(np.float32).astype(float)
    t, met = call(o, d, c, r, device=device)
    a, b, q = (d * d).sum(1), 2 * ((o - c) * d).sum(1), ((o - c) ** 2).sum(1) - r * r
    discriminant = b * b - 4 * a * q
    clear = np.abs(discriminant) > 1e-3 * a
    root = np.sqrt(np.maximum(discriminant, 0))
    expected = np.stack([(-b - root) / (2 * a), (-b + root) / (2 * a)], axis=1)
    hit = clear & (discriminant > 0)
    np.testing.assert_allclose(t[hit], expected[hit], rtol=1e-3, atol=1e-4)
    assert np.isinf(t[clear & (discriminant < 0)]).all()
    assert hit.sum() > 100
    away = clear & (np.abs(expected[:, 1]) > 1e-3)
    assert (met[away] == ((discriminant > 0) & (expected[:, 1] >= 0))[away]).all()


def test_small_sphere_far_away_keeps_its_digits() -> None:
    """The textbook discriminant b^2 - 4 a c of this one is 4e12 - 4e12: float32 would have nothing left."""
    t, _ = call([0, 0, 1e6], [0, 0, -1], [0, 0, 0], 1.0)
    np.testing.assert_allclose(t[0], [1e6 - 1, 1e6 + 1], rtol=1e-7)
    t, _ = call([0.99, 0, 1e5], [0, 0, -1], [0, 0, 0], 1.0)
    assert np.isfinite(t).all()
    t, _ = call([1.01, 0, 1e5], [0, 0, -1], [0, 0, 0], 1.0)
    assert np.isinf(t).all()


def test_bounding_sphere() -> None:
    assert call([0, 0, 0], [1, 0, 0], [0, 0, 0], 1)[1][0]  # from inside
    assert not call([5, 0, 0], [1, 0, 0], [0, 0, 0], 1)[1][0]  # behind
    assert not call([-5, 0, 0], [1, 0, 0], [0, 0, 0], 1, t_max=3.9)[1][0]  # too far
    assert call([-5, 0, 0], [1, 0, 0], [0, 0, 0], 1, t_max=4.1)[1][0]
    assert not call([-5, 0, 0], [0, 0, 0], [0, 0, 0], 9)[1][0]  # no direction
    assert not call([np.nan, 0, 0], [1, 0, 0], [0, 0, 0], 9)[1][0]
