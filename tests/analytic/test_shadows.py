# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Shadow rays: opaque, and the product of Kt over what is crossed in a straight line."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import Scene
from warp_rt.scene import LightKind

from .scenes import box, distant, lamp, looking, parallel, preview, radiance, render, scene_of, square, whitted

RTOL = 2e-6
# The eye looks under the panes, which hang between the floor and the light.
UNDER = parallel((-3.0, 0.0, 0.5), (3.0, 0.0, -0.5))
FLOOR = whitted(ambient=0.1, diffuse=0.5)
KT = np.array([[0.9, 0.5, 0.25], [0.5, 1.0, 0.25]])


def lit_floor(*panes: object) -> Scene:
    return scene_of(square(FLOOR), *panes, lights=[distant((0, 0, -1))], ambient=(1, 1, 1))


def test_nothing_between() -> None:
    np.testing.assert_allclose(radiance(lit_floor(), UNDER), 0.1 + 0.5, rtol=RTOL)


@pytest.mark.parametrize(
    ("shadows", "visible"), [("opaque", np.zeros(3)), ("auto", np.zeros(3)), ("transmit", KT.prod(axis=0))]
)
def test_panes_of_whitted_glass(shadows: str, visible: np.ndarray) -> None:
    panes = [square(whitted(transmission=kt, diffuse=0.3), z=z) for kt, z in zip(KT, (2.0, 3.0), strict=True)]
    color = radiance(lit_floor(*panes), UNDER, shadows=shadows)
    np.testing.assert_allclose(color, 0.1 + 0.5 * visible, rtol=RTOL)


def test_a_closed_body_is_crossed_twice() -> None:
    glass = box(whitted(transmission=KT[0], ior=1.5), (-9, -9, 2), (9, 9, 3))
    color = radiance(lit_floor(glass), UNDER, shadows="transmit")
    np.testing.assert_allclose(color, 0.1 + 0.5 * KT[0] ** 2, rtol=RTOL)


@pytest.mark.parametrize(("shadows", "visible"), [("opaque", 0.0), ("auto", 0.75), ("transmit", 0.75)])
def test_a_pane_of_preview_surface(shadows: str, visible: float) -> None:
    """Opacity 1/4 and ior 1: met head-on there is no Fresnel reflection, and Kt is 3/4."""
    pane = square(preview(opacity=0.25, ior=1.0), z=2.0)
    np.testing.assert_allclose(radiance(lit_floor(pane), UNDER, shadows=shadows), 0.1 + 0.5 * visible, rtol=RTOL)


@pytest.mark.parametrize(("opacity", "visible"), [(0.6, 0.0), (0.5, 0.0), (0.4, 1.0)])
def test_a_cut_out_is_there_or_not(opacity: float, visible: float) -> None:
    """opacityThreshold 1/2: from it on all there, below it nothing, in the shadow too."""
    pane = square(preview(opacity=opacity, opacity_threshold=0.5), z=2.0)
    np.testing.assert_allclose(radiance(lit_floor(pane), UNDER), 0.1 + 0.5 * visible, rtol=RTOL)


def test_presence_lets_the_rest_of_the_light_through() -> None:
    pane = square(preview(opacity=0.25, presence=True), z=2.0)
    np.testing.assert_allclose(radiance(lit_floor(pane), UNDER), 0.1 + 0.5 * 0.75, rtol=RTOL)


def test_what_is_behind_the_lamp_casts_no_shadow() -> None:
    light = lamp(LightKind.POINT, (0, 0, 1.5), has_falloff=False)
    scene = scene_of(square(FLOOR), square(whitted(), z=2.0), lights=[light], ambient=(1, 1, 1))
    np.testing.assert_allclose(radiance(scene, UNDER), 0.1 + 0.5, rtol=RTOL)


def test_a_light_that_casts_no_shadow() -> None:
    light = distant((0, 0, -1), casts_shadow=False)
    scene = scene_of(square(FLOOR), square(whitted(), z=2.0), lights=[light], ambient=(1, 1, 1))
    np.testing.assert_allclose(radiance(scene, UNDER), 0.1 + 0.5, rtol=RTOL)


def test_one_light_of_two_is_blocked() -> None:
    """A blocker over the origin hides the light from above, not the one that falls at 60 degrees."""
    aslant = (np.sqrt(3) / 2, 0.0, -0.5)
    scene = scene_of(
        square(FLOOR),
        square(whitted(), half=0.5, z=2.0),
        lights=[distant((0, 0, -1), 0.7), distant(aslant, 0.4)],
        ambient=(1, 1, 1),
    )
    film = render(scene, UNDER)
    np.testing.assert_allclose(film.color[0, 0], 0.1 + 0.5 * 0.4 * 0.5, rtol=RTOL)
    assert film.rays.shadow == 2


@pytest.mark.parametrize(
    ("material", "count"),
    [
        (whitted(ambient=1.0), 0),  # neither kd nor ks
        (whitted(specular=0.1), 1),
        (whitted(diffuse=(0.0, 0.0, 0.1)), 1),
    ],
)
def test_shadow_rays_are_cast_where_light_could_matter(material: object, count: int) -> None:
    lights = [distant((0, 0, -1)), distant((0, 0, 1))]  # the second is below the horizon
    assert render(scene_of(square(material), lights=lights), parallel((0, 0, 5))).rays.shadow == count


@pytest.mark.parametrize("half", [1e-3, 1.0, 1e4])
def test_no_surface_shadows_itself(half: float) -> None:
    """A plane at any scale, seen and lit at 85 degrees, is lit in every pixel."""
    angle = np.radians(85)
    grazing = np.array([np.sin(angle), 0, -np.cos(angle)])
    scene = scene_of(square(whitted(diffuse=1.0), half=half), lights=[distant(grazing)])
    camera = parallel(-3 * half * grazing, grazing, half=0.05 * half)
    assert looking(grazing)[2, 2] > 0
    color = render(scene, camera, width=64, height=64).color
    np.testing.assert_allclose(color, np.cos(angle), rtol=1e-5)


@pytest.mark.parametrize("direction", [(0, 0, -1), (0.3, 0.2, -1)])
@pytest.mark.parametrize("half", [10.0, 1e3, 1e5])
def test_a_thing_just_above_a_great_floor_shadows_it(half: float, direction: tuple) -> None:
    """R5, contact: a box from 0.02 to 0.06 above a floor of up to 200 thousand units."""
    white, thing = whitted(diffuse=1.0), box(whitted(), (-0.5, -0.5, 0.02), (0.5, 0.5, 0.06))
    scene = scene_of(square(white, half=half), thing, lights=[distant(direction)])
    # The eye ray comes in under the box.
    assert radiance(scene, parallel((1.0, 0.0, 0.01), (-1, 0, -0.01))).tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("count", [1, 40, 100])
def test_every_pane_counts(count: int) -> None:
    """No number of surfaces makes a transmit shadow black by itself."""
    glass = whitted(transmission=1.0)
    panes = [square(glass, half=1.0, z=1.0 + 0.1 * k) for k in range(count)]
    scene = scene_of(square(whitted(diffuse=1.0)), *panes, lights=[distant((0, 0, -1))])
    camera = parallel((0.0, 0.0, 0.5))
    np.testing.assert_allclose(radiance(scene, camera, shadows="transmit"), 1.0, rtol=1e-6)
