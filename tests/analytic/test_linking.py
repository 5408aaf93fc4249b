# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which instances a light illuminates, which cast its shadows, what its shadows are like, and which rays meet what."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warp_rt import Scene
from warp_rt.scene import Dome, RayMask, Shadow

from .scenes import distant, parallel, preview, radiance, render, scene_of, square, whitted

RTOL = 2e-6
FLOOR = whitted(diffuse=0.5)
# The eye looks under the panes, which hang between the floor and the light.
UNDER = parallel((-3.0, 0.0, 0.5), (3.0, 0.0, -0.5))


def held(count: int, *rows: int) -> np.ndarray:
    """Return the set of some of ``count`` instances."""
    result = np.zeros(count, bool)
    result[list(rows)] = True
    return result


def floor_below(*panes: float, shadow: Shadow, material: object = None) -> Scene:
    """Return a floor lit from straight above, with panes at some heights."""
    bodies = [square(material or whitted(diffuse=0.3), z=z) for z in panes]
    return scene_of(square(FLOOR), *bodies, lights=[distant((0, 0, -1), shadow=shadow)])


# --- linking


@pytest.mark.parametrize("row", [0, 31, 32, 69])
def test_a_light_illuminates_what_it_is_linked_to(row: int) -> None:
    """Seventy floors side by side: the bits fill three words."""
    floors = [square(FLOOR, half=0.5, world_from_local=shifted(2.0 * k)) for k in range(70)]
    lights = [distant((0, 0, -1), receivers=held(70, row)), distant((0, 0, -1), 0.25, receivers=~held(70, row))]
    scene = scene_of(*floors, lights=lights)
    for k in {0, 31, 32, 69}:
        expected = 0.5 if k == row else 0.125
        np.testing.assert_allclose(radiance(scene, parallel((2.0 * k, 0, 5))), expected, rtol=RTOL)


def shifted(x: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def test_an_unlinked_light_casts_no_shadow_ray() -> None:
    scene = scene_of(square(FLOOR), lights=[distant((0, 0, -1), receivers=held(1))])
    film = render(scene, parallel((0, 0, 5)))
    assert film.color[0, 0].tolist() == [0, 0, 0]
    assert film.rays.shadow == 0


def test_a_dome_illuminates_what_it_is_linked_to() -> None:
    """Neither the floor's diffuse term nor the mirror's reflection has light of a dome that they are not linked to."""
    dome = Dome("/dome", np.eye(4), (0.8, 0.4, 0.2))
    floor, mirror = square(whitted(diffuse=0.5), half=1.0), square(whitted(reflection=0.5), half=1.0)
    mirror = replace(mirror, world_from_local=shifted(4.0))
    for receivers, expected in ((None, (1, 1)), (held(2, 0), (1, 0)), (held(2, 1), (0, 1))):
        scene = scene_of(floor, mirror, domes=[replace(dome, receivers=receivers)])
        for x, share in zip((0.0, 4.0), expected, strict=True):
            color = radiance(scene, parallel((x, 0, 5)))
            np.testing.assert_allclose(color, 0.5 * share * np.array(dome.radiance), rtol=1e-5)


def test_a_reflection_that_passes_a_cut_out_is_still_the_mirrors() -> None:
    """The mirror is linked to the dome, the cut-out in the reflection's way is not."""
    dome = Dome("/dome", np.eye(4), (1.0, 1.0, 1.0), receivers=held(2, 0))
    cut_out = square(preview(opacity=0.25, opacity_threshold=0.5), half=30.0, z=2.0)
    scene = scene_of(square(whitted(reflection=0.5)), cut_out, domes=[dome])
    np.testing.assert_allclose(radiance(scene, UNDER), 0.5, rtol=RTOL)


@pytest.mark.parametrize("shadows", ["opaque", "auto", "transmit"])
@pytest.mark.parametrize(("casters", "visible"), [(None, 0.0), ((0, 1), 0.0), ((0, 2), 0.0), ((0,), 1.0), ((), 1.0)])
def test_only_what_is_shadow_linked_casts_shadows(shadows: str, casters: tuple | None, visible: float) -> None:
    """Two panes over a floor."""
    shadow = Shadow(casters=None if casters is None else held(3, *casters))
    color = radiance(floor_below(1.0, 2.0, shadow=shadow), UNDER, shadows=shadows)
    np.testing.assert_allclose(color, 0.5 * visible, rtol=RTOL)


def test_a_linked_pane_of_glass_is_crossed_beside_one_that_is_not() -> None:
    scene = floor_below(1.0, 2.0, shadow=Shadow(casters=held(3, 2)), material=whitted(transmission=(0.5, 0.25, 1.0)))
    np.testing.assert_allclose(radiance(scene, UNDER, shadows="transmit"), [0.25, 0.125, 0.5], rtol=RTOL)


# --- ShadowAPI


@pytest.mark.parametrize("shadows", ["opaque", "auto", "transmit"])
def test_shadow_color_is_what_is_left_of_the_light(shadows: str) -> None:
    color = radiance(floor_below(1.0, shadow=Shadow(color=(1.0, 0.5, 0.0))), UNDER, shadows=shadows)
    np.testing.assert_allclose(color, [0.5, 0.25, 0.0], rtol=RTOL)


def test_shadow_color_tints_only_what_is_taken() -> None:
    """Kt = 0.75 takes a quarter, of which half comes back."""
    scene = floor_below(1.0, shadow=Shadow(color=(0.5, 0.5, 0.5)), material=whitted(transmission=0.75))
    np.testing.assert_allclose(radiance(scene, UNDER, shadows="transmit"), 0.5 * 0.875, rtol=RTOL)
    bare = scene_of(square(FLOOR), lights=[distant((0, 0, -1), shadow=Shadow(color=(0.5, 0.5, 0.5)))])
    np.testing.assert_allclose(radiance(bare, UNDER), 0.5, rtol=RTOL)


@pytest.mark.parametrize("shadows", ["opaque", "auto", "transmit"])
@pytest.mark.parametrize(("height", "visible"), [(1.0, 0.0), (1.99, 0.0), (2.01, 1.0), (3.0, 1.0)])
def test_nothing_beyond_the_distance_casts_a_shadow(shadows: str, height: float, visible: float) -> None:
    color = radiance(floor_below(height, shadow=Shadow(distance=2.0)), UNDER, shadows=shadows)
    np.testing.assert_allclose(color, 0.5 * visible, rtol=RTOL)


@pytest.mark.parametrize("gamma", [1.0, 2.0, 0.5])
@pytest.mark.parametrize("shadows", ["opaque", "auto", "transmit"])
@pytest.mark.parametrize(("height", "linear"), [(1.0, 1.0), (2.5, 0.75), (3.5, 0.25), (4.5, 0.0)])
def test_shadows_fade_within_the_falloff(shadows: str, height: float, linear: float, gamma: float) -> None:
    """Distance 4, falloff 2: full strength up to 2, then linear to 0 at 4, to the power of gamma."""
    shadow = Shadow(distance=4.0, falloff=2.0, falloff_gamma=gamma)
    color = radiance(floor_below(height, shadow=shadow), UNDER, shadows=shadows)
    np.testing.assert_allclose(color, 0.5 * (1 - linear**gamma), rtol=1e-5, atol=1e-7)


def test_the_nearest_of_two_fading_panes_decides() -> None:
    """Opaque panes at 2.5 and 3.5: the first takes all the light, with a strength of 0.75."""
    color = radiance(floor_below(2.5, 3.5, shadow=Shadow(distance=4.0, falloff=2.0)), UNDER)
    np.testing.assert_allclose(color, 0.5 * 0.25, rtol=1e-5)


def test_each_pane_of_glass_fades_by_itself() -> None:
    """Kt = 1/2 at 1, full strength: half is left. Kt = 1/2 at 3, strength 1/2: of the quarter that it takes, 1/8."""
    shadow, glass = Shadow(distance=4.0, falloff=2.0), whitted(transmission=0.5)
    color = radiance(floor_below(1.0, 3.0, shadow=shadow, material=glass), UNDER, shadows="transmit")
    np.testing.assert_allclose(color, 0.5 * (0.5 - 0.125), rtol=1e-5)


# --- rays that an instance is there for


def seen_by(scene: Scene, *masks: RayMask) -> Scene:
    return replace(scene, instances=replace(scene.instances, seen_by=np.array(masks, np.uint8)))


@pytest.mark.parametrize("mask", list(map(RayMask, range(8))))
def test_each_kind_of_ray_meets_what_is_there_for_it(mask: RayMask) -> None:
    """A pane of emission 1 over a mirror of Kr 1/4 and kd 1/2, under a light: seen, reflected, in the light's way."""
    pane = square(preview(emissiveColor=1.0, diffuseColor=0.0, use_specular_workflow=True), half=30.0, z=2.0)
    mirror = square(whitted(diffuse=0.5, reflection=0.25))
    scene = seen_by(scene_of(mirror, pane, lights=[distant((0, 0, -1))]), RayMask.ALL, mask)
    lit = 0.0 if RayMask.SHADOWS in mask else 0.5
    reflected = 0.25 if RayMask.BOUNCES in mask else 0.0
    for shadows in ("opaque", "auto", "transmit"):
        np.testing.assert_allclose(radiance(scene, UNDER, shadows=shadows), lit + reflected, rtol=1e-5)
    from_above = radiance(scene, parallel((0, 0, 5)))
    if RayMask.EYE in mask:
        assert from_above.min() >= 1.0
    else:
        np.testing.assert_allclose(from_above, lit + reflected, rtol=1e-5)


def test_what_eye_rays_pass_has_no_id_and_no_alpha() -> None:
    scene = seen_by(scene_of(square(FLOOR), lights=[distant((0, 0, -1))], background=None), RayMask.BOUNCES)
    film = render(scene, parallel((0, 0, 5)), aovs=("primId",))
    assert film.aovs["primId"][0, 0] == -1
    assert film.alpha[0, 0] == 0.0


# --- domes that are sampled


@pytest.mark.parametrize(
    ("shadow", "visible"),
    [(Shadow(), 0.0), (Shadow(distance=0.5), 1.0), (Shadow(casters=held(2, 0)), 1.0), (Shadow((1.0, 0.5, 0.0)), None)],
)
def test_shadows_of_a_sampled_dome(shadow: Shadow, visible: float | None) -> None:
    """A floor under a pane so wide that nothing of the dome is seen past it."""
    dome = Dome("/dome", np.eye(4), (0.8, 0.8, 0.8), shadow=shadow)
    scene = scene_of(square(FLOOR), square(whitted(), half=1e4, z=1.0), domes=[dome])
    color = radiance(scene, UNDER, light_samples=16)
    expected = (1.0, 0.5, 0.0) if visible is None else visible
    np.testing.assert_allclose(color, 0.4 * np.array(expected), rtol=2e-3, atol=1e-4)
    unshadowed = replace(scene, domes=(replace(dome, casts_shadow=False),))
    np.testing.assert_allclose(radiance(unshadowed, UNDER, light_samples=16), 0.4, rtol=2e-3)
