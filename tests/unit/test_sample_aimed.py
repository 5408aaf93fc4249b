# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Directions about a light's axis: their density is one, and they hold all that a cone leaves of a ball."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.light_structs import LightData
from warp_rt.kernels.sample_aimed import aim_at, aimed_direction, aimed_pdf
from warp_rt.kernels.sampling import sequence_point
from warp_rt.warp_setup import init_warp

init_warp()
COUNT = 1 << 18


@wp.kernel
def aim_all(
    lights: wp.array[LightData],
    to_center: wp.vec3,
    size2: float,
    given: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    numbers: wp.array[wp.vec3],
):
    """Write aimed directions, their densities, those of given ones, and the share."""
    i = wp.tid()
    aim = aim_at(lights[0], to_center, size2, 1.0e10, 0.0, 1.0)
    wi = aimed_direction(aim, sequence_point(wp.uint32(i), wp.uint32(99)))
    directions[i] = wi
    numbers[i] = wp.vec3(aimed_pdf(aim, wi), aimed_pdf(aim, given[i]), aim.share)


def aimed(
    cone: float, focus: float, to_center: tuple[float, float, float], radius: float, given: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return aimed directions, and numbers as the kernel writes them; the axis is z."""
    record = np.zeros(1, LightData.numpy_dtype())
    record["axis_z"], record["cone_angle"], record["focus"] = (0, 0, 1), np.radians(cone), focus
    arrays = [wp.zeros(COUNT, dtype=wp.vec3, device="cpu") for _ in range(2)]
    lights = wp.array(record, dtype=LightData, device="cpu")
    there = wp.array(given.astype(np.float32), dtype=wp.vec3, device="cpu")
    wp.launch(aim_all, dim=COUNT, inputs=[lights, wp.vec3(*to_center), radius**2, there, *arrays], device="cpu")
    directions, numbers = (array.numpy().astype(float) for array in arrays)
    return directions, numbers


def all_around(cap: float = 2.0) -> np.ndarray:
    """Return directions that are even over those whose cosine with z is above 1 - cap."""
    across = int(np.sqrt(COUNT))
    cells = np.stack(np.meshgrid(*[np.arange(across)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    u = (cells + np.random.default_rng(3).random((COUNT, 2))) / across
    height, turn = 1 - cap * u[:, 0], 2 * np.pi * u[:, 1]
    ring = np.sqrt(np.maximum(1 - height**2, 0))
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=-1)


CASES = [
    (180.0, 40.0, (0.0, 0.0, 5.0), 1.0),
    (180.0, 40.0, (3.0, 1.0, 3.0), 1.0),
    (180.0, 3.0, (2.0, 1.0, -3.0), 1.0),
    (25.0, 0.0, (0.3, 0.2, 0.1), 1.0),
    (25.0, 0.0, (1.0, -2.0, 4.0), 1.5),
    (60.0, 6.0, (-2.0, -2.0, 2.0), 1.5),
]


@pytest.mark.parametrize(("cone", "focus", "to_center", "radius"), CASES)
def test_densities_integrate_to_one_over_what_holds_the_light(
    cone: float, focus: float, to_center: tuple[float, float, float], radius: float
) -> None:
    given = all_around()
    directions, numbers = aimed(cone, focus, to_center, radius, given)
    pdf, met, share = numbers.T
    assert share.min() > 0
    assert met.mean() * 4 * np.pi == pytest.approx(1, rel=0.02)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    assert (pdf > 0).mean() > 0.999
    # All that is in the cone, and in a half space of the axis, of the ball.
    distance = np.linalg.norm(to_center)
    cosine = given @ np.array(to_center) / distance
    in_ball = cosine > np.sqrt(max(1 - (radius / distance) ** 2, 0.0)) if distance > radius else np.full(COUNT, True)
    front = given[:, 2] if to_center[2] > 0 else -given[:, 2]
    is_left = in_ball & (np.degrees(np.arccos(np.clip(front, -1, 1))) < min(cone, 90) - 1e-3)
    assert is_left.sum() > 100
    assert met[is_left].min() > 0
    # In proportion to the focus: the density by that is the same everywhere.
    even = met[is_left] / front[is_left] ** focus
    np.testing.assert_allclose(even, even.mean(), rtol=1e-3)


@pytest.mark.parametrize(("cone", "focus"), [(0.02, 0.0), (180.0, 1e6)])
def test_the_narrowest_keep_their_digits(cone: float, focus: float) -> None:
    """A fiftieth of a degree, and a focus that leaves as little: the density is that of the closed form."""
    cap = 1 - np.cos(np.radians(cone)) if cone < 180 else 1e-5
    _, numbers = aimed(cone, focus, (0.0, 0.0, 1.0), 2.0, all_around(cap))
    assert numbers[:, 1].mean() * 2 * np.pi * cap == pytest.approx(1, rel=0.01)
    peak = 1 / (2 * np.pi * cap) if cone < 180 else (focus + 1) / (2 * np.pi)
    assert numbers[:, 0].max() == pytest.approx(peak, rel=1e-3)


def test_nothing_is_aimed_where_neither_leaves_less() -> None:
    for cone, focus in ((180.0, 0.0), (95.0, 0.0)):
        assert aimed(cone, focus, (0.0, 0.0, 5.0), 1.0, all_around())[1][:, 2].max() == 0
