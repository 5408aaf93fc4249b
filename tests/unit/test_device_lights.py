# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights under scales, mirrors and shears, against what UsdLux says of the shape that they become."""

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.light import sample_light
from warp_rt.kernels.light_structs import LightData
from warp_rt.scene import Light, LightKind
from warp_rt.upload.device_lights import light_record
from warp_rt.upload.light_tables import LightTables, LinkTable
from warp_rt.warp_setup import init_warp

init_warp()


def sample(light: Light, position: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Return direction and irradiance at a world position."""
    data = LightData()
    for name, value in light_record(light, np.zeros(3), LightTables(lambda light: (0, np.ones(3)))).items():
        if np.ndim(value):
            setattr(data, name, wp.vec3(*(float(v) for v in value)))
        else:
            setattr(data, name, float(value) if isinstance(value, float) else int(value))
    got = sample_light(data, wp.vec3(*position))
    return np.array(got.wi), np.array(got.irradiance)


def light(kind: LightKind, matrix: np.ndarray, **fields: float) -> Light:
    return Light("/light", kind, matrix, (1.0, 1.0, 1.0), **fields)


AREA = [LightKind.RECT, LightKind.DISK, LightKind.SPHERE, LightKind.CYLINDER]


@pytest.mark.parametrize("mirror", [(-1, 1, 1), (1, -1, 1), (-1, -1, 1)])
@pytest.mark.parametrize("kind", AREA)
def test_mirrored_lights_shine_as_before(kind: LightKind, mirror: tuple) -> None:
    """Each shape is its own mirror image in X and in Y."""
    below = (0.0, 0.0, -2.0)  # rect and disk emit along -Z
    wi, irradiance = sample(light(kind, np.eye(4)), below)
    mirrored = sample(light(kind, np.diag([*mirror, 1.0])), below)
    np.testing.assert_allclose(mirrored[0], wi, atol=1e-6)
    np.testing.assert_allclose(mirrored[1], irradiance, rtol=1e-5)
    assert irradiance.min() > 0


@pytest.mark.parametrize("kind", [LightKind.RECT, LightKind.DISK])
def test_flat_lights_emit_on_one_side_and_mirroring_turns_it(kind: LightKind) -> None:
    turned = np.diag([1.0, 1.0, -1.0, 1.0])
    above, below = (0.0, 0.0, 2.0), (0.0, 0.0, -2.0)
    assert sample(light(kind, np.eye(4)), above)[1].max() == 0
    assert sample(light(kind, turned), below)[1].max() == 0
    np.testing.assert_allclose(sample(light(kind, turned), above)[1], sample(light(kind, np.eye(4)), below)[1])


def test_where_no_light_comes_from_there_is_no_direction() -> None:
    assert not sample(light(LightKind.RECT, np.eye(4)), (0.0, 0.0, 2.0))[0].any()


def test_a_sheared_rect_emits_along_its_plane_s_normal() -> None:
    """Local Z leans, the plane z = 0 does not move: what is just in front of it stays lit."""
    leaning = np.eye(4)
    leaning[:3, 2] = 3.0, 0.0, 1.0
    np.testing.assert_allclose(
        sample(light(LightKind.RECT, leaning), (1.0, 0.0, -0.2))[1],
        sample(light(LightKind.RECT, np.eye(4)), (1.0, 0.0, -0.2))[1],
    )


@pytest.mark.parametrize("distance", [20.0, 300.0, 3000.0, 1e6])
def test_far_lights_are_patches(distance: float) -> None:
    """E = L A cos / d^2, off axis too; 16 half diagonals off the next order is below 1e-3."""
    direction = np.array([0.48, 0.36, -0.8])
    p = tuple((direction * distance).tolist())
    scale = np.diag([2.0, 3.0, 1.0, 1.0])
    rect = sample(light(LightKind.RECT, scale), p)
    np.testing.assert_allclose(rect[1], 6.0 * 0.8 / distance**2, rtol=max(20 / distance**2 * 10, 1e-5))
    np.testing.assert_allclose(rect[0], -direction, atol=20 / distance**2 + 1e-6)
    tube = sample(light(LightKind.CYLINDER, np.eye(4), length=1.0, radius=0.05), p)
    sine = np.sqrt(1 - direction[0] ** 2)
    # Six facets stand for the half circle: their silhouette is exact, hence 2 r l sin / d^2.
    np.testing.assert_allclose(tube[1], 2 * 0.05 * sine / distance**2, rtol=2e-3)


def test_sets_of_instances_are_bits_the_lowest_first() -> None:
    """Instances 0, 31, 32 and 33 of 34: bits 0 and 31 of the first word, 0 and 1 of the second."""
    held = np.zeros(34, bool)
    held[[0, 31, 32, 33]] = True
    links = LinkTable()
    assert links.add(None) == -1
    assert (links.add(held), links.add(~held)) == (0, 2)
    assert links.words().tolist() == [0x80000001, 3, 0x7FFFFFFE, 0]
