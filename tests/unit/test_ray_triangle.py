# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Three tests of a ray against a triangle: their parts against the lecture, the whole against linear algebra."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.ray_triangle import (
    intersect_moller_trumbore,
    intersect_plane,
    intersect_plane_projection,
    intersect_triangle,
    plane_equation,
    primary_axis,
    project_barycentrics,
    shear_axes,
    shear_factors,
)
from warp_rt.warp_setup import init_warp

init_warp()

TESTS = ["plane-projection", "moller-trumbore", "watertight"]
FLOAT32 = 2e-5  # dozens of roundings on numbers of size one, with determinants down to a tenth

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def evaluate(
    test: int,
    o: wp.array[wp.vec3],
    d: wp.array[wp.vec3],
    p0: wp.array[wp.vec3],
    p1: wp.array[wp.vec3],
    p2: wp.array[wp.vec3],
    tuv_out: wp.array[wp.vec3],
):
    i = wp.tid()
    if test == 0:
        hit = intersect_plane_projection(o[i], d[i], p0[i], p1[i], p2[i])
    elif test == 1:
        hit = intersect_moller_trumbore(o[i], d[i], p0[i], p1[i], p2[i])
    else:
        hit = intersect_triangle(o[i], d[i], p0[i], p1[i], p2[i])
    tuv_out[i] = wp.vec3(hit.t, hit.u, hit.v)


@wp.kernel
def project(axis: int, points: wp.array[wp.vec3], weights_out: wp.array[wp.vec2]):
    weights_out[0] = project_barycentrics(points[0], points[1], points[2], points[3], axis)


@wp.kernel
def shear(directions: wp.array[wp.vec3], axes_out: wp.array[wp.vec3i], factors_out: wp.array[wp.vec3]):
    i = wp.tid()
    axes_out[i] = shear_axes(directions[i])
    factors_out[i] = shear_factors(directions[i], axes_out[i])


def solve(o: np.ndarray, d: np.ndarray, p0: np.ndarray, p1: np.ndarray, p2: np.ndarray) -> np.ndarray:
    """Return (t, u, v) with o + t d = p0 + u (p1 - p0) + v (p2 - p0), in float64."""
    return np.linalg.solve(np.stack([-d, p1 - p0, p2 - p0], axis=1), o - p0)


def call(test: str, *vectors: np.ndarray, device: str = "cpu") -> np.ndarray:
    """Return (t, u, v): of one ray and triangle, or row by row."""
    arrays = [wp.array(np.atleast_2d(v).astype(np.float32), dtype=wp.vec3, device=device) for v in vectors]
    out = wp.empty(len(arrays[0]), dtype=wp.vec3, device=device)
    wp.launch(evaluate, len(out), inputs=[TESTS.index(test), *arrays], outputs=[out], device=device)
    return out.numpy().reshape(np.shape(vectors[0]))


def float32_cases(seed: int, count: int) -> list[tuple[np.ndarray, ...]]:
    """Return rays aimed at random triangles that are neither small nor seen edge-on, exact in float32."""
    rng = np.random.default_rng(seed)
    cases = []
    while len(cases) < count:
        p0, p1, p2, o = rng.uniform(-1, 1, (4, 3)).astype(np.float32).astype(float)
        u, v = rng.uniform(-0.5, 1.5, 2)
        d = (p0 + u * (p1 - p0) + v * (p2 - p0) - o) * rng.choice([0.25, 1.0, 3.0])
        d = d.astype(np.float32).astype(float)
        if abs(np.linalg.det([p1 - p0, p2 - p0, d])) > 0.1 and min(abs(np.array([u, v, 1 - u - v]))) > 1e-3:
            cases.append((o, d, p0, p1, p2))
    return cases


@pytest.mark.parametrize("test", TESTS)
def test_hits_solve_the_linear_system(test: str, device: str) -> None:
    cases = float32_cases(1, 2000)
    hit_count = 0
    for case, found in zip(cases, call(test, *np.array(cases).swapaxes(0, 1), device=device), strict=True):
        t, u, v = solve(*case)
        if min(u, v, 1 - u - v) >= 0 and t >= 0:
            hit_count += 1
            np.testing.assert_allclose(found, (t, u, v), atol=FLOAT32, rtol=FLOAT32)
        else:
            assert found[0] == np.inf
    assert 200 < hit_count < 1800


@pytest.mark.parametrize("test", TESTS)
def test_t_counts_lengths_of_the_direction(test: str) -> None:
    o, p = np.array([0.25, 0.25, 3.0]), np.eye(3)
    p[2] = 0
    for length in (0.5, 1.0, 8.0):
        assert call(test, o, np.array([0, 0, -length]), p[2], p[0], p[1]) == pytest.approx((3 / length, 0.25, 0.25))


@pytest.mark.parametrize("test", TESTS)
def test_both_sides_edges_and_vertices_count(test: str) -> None:
    p0, p1, p2 = np.array([0.0, 0, 0]), np.array([1.0, 0, 0]), np.array([0.0, 1, 0])
    for z in (2.0, -2.0):
        for u, v in ((0, 0), (1, 0), (0, 1), (0.5, 0), (0, 0.5), (0.5, 0.5), (0.25, 0.5)):
            assert call(test, np.array([u, v, z]), np.array([0, 0, -z]), p0, p1, p2) == pytest.approx((1, u, v))


@pytest.mark.parametrize("test", TESTS)
def test_misses(test: str) -> None:
    p0, p1, p2 = np.array([0.0, 0, 0]), np.array([1.0, 0, 0]), np.array([0.0, 1, 0])
    down = np.array([0.0, 0, -1])
    inside = np.array([0.25, 0.25, 1.0])
    assert call(test, inside, -down, p0, p1, p2)[0] == np.inf  # behind the origin
    assert call(test, inside, np.array([1.0, 0, 0]), p0, p1, p2)[0] == np.inf  # parallel
    assert call(test, np.array([-1, 0.25, 0.0]), np.array([1.0, 0, 0]), p0, p1, p2)[0] == np.inf  # in the plane
    assert call(test, inside, down, p0, p0, p2)[0] == np.inf  # two corners in one
    assert call(test, inside, down, p0, p1, 2 * p1)[0] == np.inf  # three corners on a line
    for outside in ((-0.1, 0.5), (0.5, -0.1), (0.6, 0.6), (2.0, 2.0)):
        assert call(test, np.array([*outside, 1.0]), down, p0, p1, p2)[0] == np.inf
    nan = np.full(3, np.nan)
    assert call(test, nan, down, p0, p1, p2)[0] == np.inf
    assert call(test, inside, down, nan, nan, nan)[0] == np.inf


def test_plane_equation_of_the_lecture() -> None:
    # z = 2 through (0, 0, 2), (3, 0, 2), (0, 5, 2): N = (3, 0, 0) x (0, 5, 0) = (0, 0, 15), d = -30
    plane = plane_equation(wp.vec3(0, 0, 2), wp.vec3(3, 0, 2), wp.vec3(0, 5, 2))
    assert tuple(plane) == (0, 0, 15, -30)
    # t = -(d + N . O) / (N . D) = -(-30 + 15 * 8) / (15 * -3) = 2
    assert intersect_plane(plane, wp.vec3(1, 1, 8), wp.vec3(0, 0, -3)) == 2
    assert intersect_plane(plane, wp.vec3(1, 1, 8), wp.vec3(1, 0, 0)) == np.inf


def test_primary_axis_is_that_of_the_largest_component() -> None:
    assert [primary_axis(wp.vec3(*n)) for n in ((-3, 1, 2), (1, -3, 2), (1, 2, -3), (1, 1, 1))] == [0, 1, 2, 0]


@pytest.mark.parametrize("axis", range(3))
def test_barycentrics_by_determinants(axis: int) -> None:
    rng = np.random.default_rng(axis)
    p0, p1, p2 = rng.uniform(-1, 1, (3, 3))
    alpha, beta = 0.3, 0.6
    p = p0 + alpha * (p1 - p0) + beta * (p2 - p0)
    weights = wp.empty(1, dtype=wp.vec2, device="cpu")
    points = wp.array(np.array([p, p0, p1, p2], np.float32), dtype=wp.vec3, device="cpu")
    wp.launch(project, 1, inputs=[axis, points], outputs=[weights], device="cpu")
    np.testing.assert_allclose(weights.numpy()[0], (alpha, beta), atol=FLOAT32)


def test_shear_turns_the_ray_into_the_z_axis() -> None:
    directions = np.array([[3, 1, -2], [1, -5, 2], [0.1, 0.2, 4], [0, 0, -1], [-1, -1, -1]], np.float32)
    axes = wp.empty(len(directions), dtype=wp.vec3i, device="cpu")
    factors = wp.empty(len(directions), dtype=wp.vec3, device="cpu")
    rays = wp.array(directions, dtype=wp.vec3, device="cpu")
    wp.launch(shear, len(directions), inputs=[rays], outputs=[axes, factors], device="cpu")
    for d, order, (sx, sy, sz) in zip(directions, axes.numpy(), factors.numpy(), strict=True):
        assert abs(d[order[2]]) == abs(d).max()
        assert tuple(order) in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        x, y, z = d[order]
        np.testing.assert_allclose([x - sx * z, y - sy * z, z * sz], [0, 0, 1], atol=1e-6)
