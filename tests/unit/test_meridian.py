# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights that are shaped, by integrals along their outline, against closed forms and sums in float64."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.constants import MERIDIAN_CELLS
from warp_rt.kernels.light_structs import MeridianData
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.scene import Light, LightKind, Profile
from warp_rt.upload.light_tables import LightTables
from warp_rt.upload.meridian_tables import meridian_record
from warp_rt.warp_setup import init_warp

from ..lights_float64 import arriving, patches
from ..lights_on_device import no_tables, see_outline, upload_light

init_warp()
WHITE = (1.0, 1.0, 1.0)
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])  # shines along +Z, at what is above it
KINDS = [LightKind.RECT, LightKind.DISK, LightKind.SPHERE, LightKind.CYLINDER]


def see(light: Light, positions: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the flux by focus, cone and profile, and that without the focus: float32, shape [n, 3] each."""
    tables = no_tables()
    record = upload_light(light, tables)
    rows = np.zeros(len(tables.meridians), MeridianData.numpy_dtype())
    for row, fields in zip(rows, tables.meridians, strict=True):
        for name, value in fields.items():
            row[name] = value
    scene = SceneData()
    scene.meridians = wp.array(rows, dtype=MeridianData, device="cpu")
    scene.meridian_sums = wp.array(tables.meridian_sums(), dtype=wp.vec4, device="cpu")
    shaped = see_outline(scene, record, positions, normals)["shaped"]
    return shaped["focused"], shaped["open"]


@pytest.mark.parametrize("focus", [0.5, 3.0, 40.0])
@pytest.mark.parametrize("half_angle", [8.0, 35.0, 75.0])
def test_a_disk_under_a_focus_seen_from_its_axis(focus: float, half_angle: float) -> None:
    """cos^n over a cone of half angle a sends 2 pi (1 - cos^(n + 2) a) / (n + 2) along its axis; n = 0 is sin^2."""
    a = np.radians(half_angle)
    light = Light("/l", LightKind.DISK, DOWN, WHITE, radius=2 * np.tan(a), focus=focus, focus_tint=(0.5, 0, 0))
    focused, open_ = see(light, np.array([[0, 0, 2.0]]), np.array([[0, 0, -1.0]]))
    expected = 2 * np.pi * (1 - np.cos(a) ** (focus + 2)) / (focus + 2)
    np.testing.assert_allclose(focused[0], (0, 0, -expected), rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(open_[0], (0, 0, -np.pi * np.sin(a) ** 2), rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("cone", [3.0, 30.0, 60.0])
def test_the_rim_of_a_hard_cone_within_a_light(cone: float) -> None:
    """Where a large rect is lit no farther than its cone, that is all that counts: pi sin^2."""
    light = Light("/l", LightKind.RECT, DOWN, WHITE, width=30.0, height=20.0, cone_angle=np.radians(cone))
    focused, _ = see(light, np.array([[0.3, -0.2, 2.0]]), np.array([[0, 0, -1.0]]))
    np.testing.assert_allclose(focused[0], (0, 0, -np.pi * np.sin(np.radians(cone)) ** 2), rtol=1e-4, atol=1e-5)


TURNED = np.array([[0.6, 0.0, 0.8, 0.3], [0.0, 1.0, 0.0, -0.2], [-0.8, 0.0, 0.6, 0.1], [0, 0, 0, 1.0]])
SHAPES = {
    "focus": {"focus": 6.0, "focus_tint": (0.2, 0.2, 0.2)},
    "soft cone": {"cone_angle": 1.2, "cone_softness": 0.7},
    "cone from behind": {"cone_angle": 2.6, "cone_softness": 0.3, "focus": 1.5},
}


@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name.lower())
def test_surfaces_all_around(kind: LightKind, shape: dict) -> None:
    """Near the light, turned all ways, many of the horizons cutting it."""
    rng = np.random.default_rng(5)
    light = Light("/l", kind, TURNED, WHITE, radius=0.6, width=1.4, length=1.6, **shape)
    plain = Light("/l", kind, TURNED, WHITE, radius=0.6, width=1.4, length=1.6)
    positions, normals = rng.normal(size=(2, 24, 3))
    positions *= rng.uniform(1.5, 6.0, (24, 1)) / np.linalg.norm(positions, axis=1, keepdims=True)
    normals -= positions * (0.4 / np.linalg.norm(positions, axis=1, keepdims=True))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    focused, open_ = see(light, positions, normals)
    tint = light.focus_tint[0]
    cut = patches(light, 200)
    for place, normal, found in zip(positions, normals, (1 - tint) * focused + tint * open_, strict=True):
        wi, solid_angle, radiance = arriving(light, place, cut=cut)
        above = wi @ normal > 0
        expected = (wi * radiance[:, :1] * solid_angle[:, None])[above].sum(axis=0)
        whole = arriving(plain, place, cut=cut)[1].sum()
        np.testing.assert_allclose(found, expected, atol=3e-3 * whole)


def test_lights_that_are_shaped_alike_share_their_numbers() -> None:
    tables = LightTables(lambda light: (-1, np.ones(3)))
    shapes = (1.0, 1.0, 0.5)
    rows = [tables.add_meridians(Light("/l", LightKind.DISK, DOWN, WHITE, cone_angle=a), is_even=True) for a in shapes]
    assert rows == [0, 0, 1]
    assert len(tables.meridian_sums()) == 2 * 2 * (MERIDIAN_CELLS + 1)


def test_what_depends_on_more_than_the_direction_has_none() -> None:
    profile = Profile(*(np.array(rows, np.float32) for rows in ((0, np.pi), (0, 2 * np.pi), ((1, 2), (3, 4)))))
    lamp = Light("/l", LightKind.RECT, DOWN, WHITE, profile=profile)
    assert meridian_record(lamp, is_even=False) is None  # its directions are those of its own, uneven, space
    assert meridian_record(lamp, is_even=True) is not None
    assert meridian_record(Light("/l", LightKind.RECT, DOWN, WHITE, image=0, focus=1.0), is_even=True) is None
    assert meridian_record(Light("/l", LightKind.RECT, DOWN, WHITE), is_even=True) is None


def test_profiles_that_do_not_turn_have_one_plane() -> None:
    angles = [np.array(rows, np.float32) for rows in ((0.0, 0.4, np.pi), (0.0, np.pi, 2 * np.pi))]
    same, other = (
        Profile(*angles, np.array(rows, np.float32)) for rows in ([(1, 2, 3)] * 3, [(1, 2, 3)] * 2 + [(1, 2, 4)])
    )
    planes = []
    for profile in (same, other):
        found = meridian_record(Light("/l", LightKind.DISK, DOWN, WHITE, profile=profile), is_even=True)
        assert found is not None
        planes.append(found[0]["planes"])
    assert planes == [1, 3]
