# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Boxes, and the slab test against interval arithmetic in float64."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.bounds import box_half_area, intersect_box, inverse_direction, widest_axis
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.kernel
def evaluate(
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    t_max: float,
    low: wp.array[wp.vec3],
    high: wp.array[wp.vec3],
    span_out: wp.array[wp.vec2],
    inverse_out: wp.array[wp.vec3],
):
    i = wp.tid()
    inverse_out[i] = inverse_direction(directions[i])
    span_out[i] = intersect_box(origins[i], inverse_out[i], t_max, low[i], high[i])


def call(origins, directions, low, high, t_max=np.inf, device="cpu") -> tuple[np.ndarray, np.ndarray]:
    count = len(np.atleast_2d(origins))
    vectors = [
        np.broadcast_to(np.atleast_2d(v), (count, 3)).astype(np.float32) for v in (origins, directions, low, high)
    ]
    o, d, lo, hi = (wp.array(v, dtype=wp.vec3, device=device) for v in vectors)
    spans = wp.empty(count, dtype=wp.vec2, device=device)
    inverses = wp.empty(count, dtype=wp.vec3, device=device)
    wp.launch(evaluate, count, inputs=[o, d, float(t_max), lo, hi], outputs=[spans, inverses], device=device)
    return spans.numpy(), inverses.numpy()


def test_half_area_of_a_brick() -> None:
    assert box_half_area(wp.vec3(1, 1, 1), wp.vec3(3, 4, 5)) == 2 * 3 + 3 * 4 + 4 * 2


def test_widest_axis_prefers_the_first_of_equals() -> None:
    assert [widest_axis(wp.vec3(*e)) for e in ((1, 1, 1), (1, 2, 2), (0, 1, 2), (3, 1, 2))] == [0, 1, 2, 0]


def test_inverse_is_finite_and_keeps_the_sign() -> None:
    directions = [[0.0, -0.0, 1e-38], [-1e-38, 2, -4], [3e38, -3e38, 1e35]]
    _, inverses = call(np.zeros((3, 3)), directions, -np.ones(3), np.ones(3))
    assert np.isfinite(inverses).all()
    assert (np.abs(inverses) >= np.finfo(np.float32).tiny).all()
    assert (inverses[1, 1:] == [0.5, -0.25]).all()
    assert (inverses[1] < 0).tolist() == [True, False, True]
    assert (np.abs(inverses[0]) > 1e29).all()


def test_known_spans() -> None:
    low, high = -np.ones(3), np.ones(3)
    spans, _ = call([[-3, 0, 0], [0, 0, 0], [3, 0, 0], [-3, 2, 0]], [[2, 0, 0]] * 3 + [[1, 0, 0]], low, high)
    np.testing.assert_allclose(spans[0], [1, 2], rtol=1e-6)
    np.testing.assert_allclose(spans[1], [0, 0.5], rtol=1e-6)  # starts inside
    assert spans[2][0] > spans[2][1]  # behind
    assert spans[3][0] > spans[3][1]  # beside
    spans, _ = call([-3, 0, 0], [2, 0, 0], low, high, t_max=0.9)
    assert spans[0][0] > spans[0][1]  # too far


def test_a_ray_along_a_face_meets_the_box() -> None:
    spans, _ = call([[1, 0, -3], [-1, 0, -3], [0, 1, -3]], [0, 0, 1], -np.ones(3), np.ones(3))
    # On the far face of a slab that it is parallel to, t_leave is 0 there: such a ray may be let go. On the near face
    # it must be kept; so of the two boxes that share a face, one keeps it.
    assert spans[1][0] <= spans[1][1]


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6])
def test_no_ray_that_meets_the_box_is_missed(offset: float, device: str) -> None:
    """Rays aim at points of the box's surface, edges and corners, whose rounded rays meet it in exact arithmetic."""
    rng = np.random.default_rng(5)
    count = 100_000
    center = offset * rng.uniform(-1, 1, (count, 3))
    size = 10.0 ** rng.uniform(-2, 1, (count, 3))
    low, high = (center - size).astype(np.float32).astype(float), (center + size).astype(np.float32).astype(float)
    target = low + rng.choice([0.0, 0.5, 1.0], (count, 3)) * (high - low)
    origin = (center + 20 * rng.normal(size=(count, 3))).astype(np.float32).astype(float)
    direction = (target - origin).astype(np.float32).astype(float)
    exact_low, exact_high = np.full(count, 0.0), np.full(count, np.inf)
    for axis in range(3):
        with np.errstate(divide="ignore", invalid="ignore"):
            a = (low[:, axis] - origin[:, axis]) / direction[:, axis]
            b = (high[:, axis] - origin[:, axis]) / direction[:, axis]
        exact_low, exact_high = np.maximum(exact_low, np.fmin(a, b)), np.minimum(exact_high, np.fmax(a, b))
    meets = exact_low <= exact_high
    spans, _ = call(origin, direction, low, high, device=device)
    assert meets.sum() > count / 10
    assert (spans[meets, 0] <= spans[meets, 1]).all()
