# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Samplers of lights: directions meet the shape, densities are true, means are the float64 sums over patches."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.light_structs import LightData
from warp_rt.kernels.sample_light import meet_extent, sample_extent
from warp_rt.kernels.sampling import sequence_point
from warp_rt.scene import Light, LightKind
from warp_rt.warp_setup import init_warp

from ..lights_float64 import arriving
from ..lights_on_device import upload_light

init_warp()
COUNT = 1 << 14


@wp.kernel
def sample_all(
    lights: wp.array[LightData],
    position: wp.vec3,
    directions: wp.array[wp.vec3],
    distances: wp.array[wp.vec2],
    densities: wp.array[wp.vec2],
):
    """Sample a light, and meet it again in the direction that came out."""
    i = wp.tid()
    u = sequence_point(wp.uint32(i), wp.uint32(77))
    s = sample_extent(lights[0], position, u)
    t = meet_extent(lights[0], position, s.wi)
    directions[i] = s.wi
    distances[i] = wp.vec2(s.distance, t.distance)
    densities[i] = wp.vec2(s.pdf, t.pdf)


@wp.kernel
def meet_all(lights: wp.array[LightData], position: wp.vec3, directions: wp.array[wp.vec3], out: wp.array[wp.vec2]):
    """Meet a light in given directions."""
    i = wp.tid()
    t = meet_extent(lights[0], position, directions[i])
    out[i] = wp.vec2(t.pdf, t.distance)


def sample(light: Light, position: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return directions, distances and densities, the last two also as the light is met: [n, 3], [n, 2], [n, 2]."""
    arrays = [wp.zeros(COUNT, dtype=kind, device="cpu") for kind in (wp.vec3, wp.vec2, wp.vec2)]
    wp.launch(sample_all, dim=COUNT, inputs=[upload_light(light), wp.vec3(*position), *arrays], device="cpu")
    return tuple(array.numpy().astype(float) for array in arrays)


def placed(scale: tuple[float, float, float], shear: float = 0.0, at: tuple[float, ...] = (0, 0, 0)) -> np.ndarray:
    """Return a transform with a scale, a shear of x by y, and a turn."""
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    leaning = np.eye(3)
    leaning[0, 1] = shear
    matrix = np.eye(4)
    matrix[:3, :3] = turn @ leaning @ np.diag(scale)
    matrix[:3, 3] = at
    return matrix


def light(kind: LightKind, matrix: np.ndarray, **fields: float) -> Light:
    return Light("/light", kind, matrix, (1.0, 1.0, 1.0), **fields)


EVEN = placed((1, 1, 1), at=(0.3, -0.2, 0.1))
UNEVEN = placed((0.5, 1.5, 0.8), at=(0.3, -0.2, 0.1))
SHEARED = placed((0.5, 1.5, 0.8), shear=0.7, at=(0.3, -0.2, 0.1))
# In front of, beside and near to them; rects and disks shine along the turned -Z, about (0.8, 0, -0.6).
PLACES = [(2.0, 0.5, -2.0), (3.0, 3.0, 0.5), (0.9, -0.3, -0.6), (40.0, -10.0, -30.0)]
CASES = {
    f"{kind.name.lower()} {name}": light(kind, matrix, **fields)
    for kind, fields in (
        (LightKind.SPHERE, {"radius": 0.4}),
        (LightKind.RECT, {"width": 1.5, "height": 0.8}),
        (LightKind.DISK, {"radius": 0.7}),
        (LightKind.CYLINDER, {"radius": 0.3, "length": 2.0}),
    )
    for name, matrix in (("even", EVEN), ("uneven", UNEVEN), ("sheared", SHEARED))
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", CASES)
def test_means_are_the_sums_over_patches(name: str, place: tuple[float, float, float]) -> None:
    """The mean of 1 / pdf is the solid angle, that of wi / pdf the vector irradiance for radiance 1."""
    source = CASES[name]
    wi, _, densities = sample(source, place)
    pdf = densities[:, 0]
    expected, solid_angle, _ = arriving(source, np.array(place), count=256)
    assert pdf.min() > 0
    np.testing.assert_allclose((1 / pdf).mean(), solid_angle.sum(), rtol=2e-3)
    vector = (expected * solid_angle[:, None]).sum(0)
    np.testing.assert_allclose((wi / pdf[:, None]).mean(0), vector, atol=2e-3 * np.linalg.norm(vector))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", CASES)
def test_samples_lie_on_the_light_and_are_met_again(name: str, place: tuple[float, float, float]) -> None:
    source = CASES[name]
    wi, distances, densities = sample(source, place)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1, atol=1e-5)
    local = place + wi * distances[:, :1] - source.world_from_light[:3, 3]
    x, y, z = np.linalg.solve(source.world_from_light[:3, :3], local.T)
    slack = 3e-5 * max(1.0, np.linalg.norm(place))
    if source.kind == LightKind.SPHERE:
        np.testing.assert_allclose(np.sqrt(x * x + y * y + z * z), source.radius, atol=slack)
    elif source.kind == LightKind.CYLINDER:
        np.testing.assert_allclose(np.hypot(y, z), source.radius, atol=slack)
        assert np.abs(x).max() <= source.length / 2 + slack
    else:
        np.testing.assert_allclose(z, 0, atol=slack)
        if source.kind == LightKind.RECT:
            assert np.abs(x).max() <= source.width / 2 + slack
            assert np.abs(y).max() <= source.height / 2 + slack
        else:
            assert np.hypot(x, y).max() <= source.radius + slack
    # At the rim a direction may miss by a rounding, and near it of a round light distances change fast.
    is_met = densities[:, 1] > 0
    assert is_met.mean() > 0.995
    np.testing.assert_allclose(np.median(densities[is_met, 1] / densities[is_met, 0]), 1, rtol=1e-5)
    assert (np.abs(densities[is_met, 1] / densities[is_met, 0] - 1) < 1e-2).mean() > 0.99
    np.testing.assert_allclose(distances[is_met, 1], distances[is_met, 0], rtol=2e-2)


@pytest.mark.parametrize("place", [(0.38, -0.2, 0.04), (0.78, -0.2, -0.26), (0.676, -0.68, 0.268)])
@pytest.mark.parametrize("name", [name for name in CASES if name.startswith("disk")])
def test_disks_are_sampled_by_their_solid_angle(name: str, place: tuple[float, float, float]) -> None:
    """Near by, where by their area single samples of the solid angle would spread by up to several times itself."""
    pdf = sample(CASES[name], place)[2][:, 0]
    assert (1 / pdf).std() < 0.25 * (1 / pdf).mean()


@pytest.mark.parametrize("name", CASES)
def test_densities_integrate_to_one(name: str) -> None:
    """Over the cap of directions that holds the light, near by."""
    source = CASES[name]
    place = np.array(PLACES[2] if not name.startswith(("sphere", "cyl")) else (1.2, -0.2, -0.7))
    rng = np.random.default_rng(5)
    strata = (
        np.stack(np.meshgrid(*[np.arange(512)] * 2, indexing="ij"), -1).reshape(-1, 2) + rng.random((512**2, 2))
    ) / 512
    height, turn = 1 - 2 * strata[:, 0], 2 * np.pi * strata[:, 1]
    ring = np.sqrt(1 - height**2)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], -1)
    out = wp.zeros(len(directions), dtype=wp.vec2, device="cpu")
    given = wp.array(directions.astype(np.float32), dtype=wp.vec3, device="cpu")
    wp.launch(meet_all, dim=len(directions), inputs=[upload_light(source), wp.vec3(*place), given, out], device="cpu")
    assert out.numpy()[:, 0].mean() * 4 * np.pi == pytest.approx(1, rel=1e-2)


@pytest.mark.parametrize("degrees", [0.01, 0.53, 20.0, 140.0, 180.0, 260.0, 360.0])
def test_distant_cone(degrees: float) -> None:
    """Uniform over the whole cone, half angles beyond 90 degrees too, and a hundredth of a degree."""
    source = light(LightKind.DISTANT, EVEN, angle=np.radians(degrees))
    wi, distances, densities = sample(source, (5.0, 1.0, 2.0))
    axis = EVEN[:3, 2]
    solid_angle = 4 * np.pi * np.sin(np.radians(degrees) / 4) ** 2
    np.testing.assert_allclose(densities[:, 0], 1 / solid_angle, rtol=1e-5)
    assert np.isinf(distances).all()
    angle = 2 * np.arcsin(np.clip(np.linalg.norm(wi - axis, axis=1) / 2, 0, 1))
    assert angle.max() <= np.radians(degrees) / 2 * (1 + 2e-3)
    # Uniform in 1 - cos, that is in the squared sine of half the angle.
    heights = np.sort(2 * np.sin(angle / 2) ** 2) * 2 * np.pi / solid_angle
    np.testing.assert_allclose(heights, (np.arange(COUNT) + 0.5) / COUNT, atol=2e-3)


@pytest.mark.parametrize("distance", [1.0001, 1.5, 10.0, 1e3, 1e6])
@pytest.mark.parametrize("radius", [1e-4, 1.0, 1e4])
def test_spheres_near_and_far_small_and_large(distance: float, radius: float) -> None:
    """The solid angle of the cone: 2 pi (1 - sqrt(1 - r^2 / d^2))."""
    source = light(LightKind.SPHERE, np.eye(4), radius=radius)
    wi, distances, densities = sample(source, (0.0, 0.0, distance * radius))
    sine2 = 1 / distance**2
    solid_angle = 2 * np.pi * sine2 / (1 + np.sqrt(1 - sine2))
    np.testing.assert_allclose(1 / densities[:, 0], solid_angle, rtol=2e-3 if distance < 1.01 else 1e-5)
    assert -wi[:, 2].min() > 0
    assert distances[:, 0].min() >= radius * (distance - 1) * (1 - 1e-3)
    assert distances[:, 0].max() <= radius * np.sqrt(distance**2 - 1) * (1 + 1e-3)


@pytest.mark.parametrize(
    ("kind", "place"),
    [
        (LightKind.SPHERE, (0.1, 0.0, 0.0)),
        (LightKind.CYLINDER, (0.1, 0.1, 0.0)),
        (LightKind.RECT, (0.0, 0.0, 1.0)),
        (LightKind.DISK, (0.0, 0.0, 1.0)),
    ],
)
def test_no_light_within_or_behind(kind: LightKind, place: tuple[float, float, float]) -> None:
    """Spheres and cylinders shine outwards, rects and disks along -Z."""
    assert sample(light(kind, np.eye(4)), place)[2].max() == 0.0


@pytest.mark.parametrize("place", [(0.1, 0.05, -1e-3), (0.7, 0.0, -1e-3), (30.0, 0.0, -0.5), (0.0, 0.0, -1e5)])
def test_rects_where_their_solid_angle_is_extreme(place: tuple[float, float, float]) -> None:
    """All but in its plane, grazing, and far: exact by the sum of four arctangents over the corners."""
    source = light(LightKind.RECT, np.eye(4), width=1.0, height=1.0)
    _, _, densities = sample(source, place)
    x, y, z = -place[0], -place[1], place[2]
    sides = [(sx * sy, x + sx / 2, y + sy / 2) for sx in (-1, 1) for sy in (-1, 1)]
    expected = abs(sum(s * np.arctan(a * b / (z * np.sqrt(a * a + b * b + z * z))) for s, a, b in sides))
    tolerance = 2e-2 if place[2] == -0.5 else 5e-3
    np.testing.assert_allclose((1 / densities[:, 0]).mean(), expected, rtol=tolerance)
