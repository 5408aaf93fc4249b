# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights that rays see (``lights_visible``), and the textures of rect lights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warp_rt import Scene
from warp_rt.scene import Camera, Image, LightKind, RayMask

from .scenes import lamp, looking, parallel, preview, radiance, render, scene_of, square, whitted

L = np.array([2.0, 1.0, 0.5])
SHAPES = [LightKind.RECT, LightKind.DISK, LightKind.SPHERE, LightKind.CYLINDER]
FAR = square(whitted(ambient=0.0), z=-50.0)


def seen(scene: Scene, camera: Camera, **options: object) -> np.ndarray:
    return radiance(scene, camera, lights_visible=True, **options)


@pytest.mark.parametrize("kind", SHAPES)
def test_the_eye_sees_a_light_where_it_shines(kind: LightKind) -> None:
    scene = scene_of(FAR, lights=[lamp(kind, (0, 0, 2), L, radius=0.5, length=2.0)])
    from_below = parallel((0.2, 0.1, 0.0), (0, 0, 1))
    assert radiance(scene, from_below).tolist() == [0, 0, 0]
    np.testing.assert_allclose(seen(scene, from_below), L, rtol=1e-6)
    np.testing.assert_array_equal(seen(scene, parallel((1.5, 0.1, 0.0), (0, 0, 1))), 0.0)
    above = seen(scene, parallel((0.2, 0.1, 4.0)))
    if kind in (LightKind.RECT, LightKind.DISK):
        np.testing.assert_array_equal(above, 0.0)  # they shine along -Z alone
    else:
        np.testing.assert_allclose(above, L, rtol=1e-6)


def test_points_and_distant_lights_have_no_shape() -> None:
    lights = [lamp(LightKind.POINT, (0, 0, 2), L), lamp(LightKind.DISTANT, (0, 0, 0), L, angle=1.0)]
    assert seen(scene_of(FAR, lights=lights), parallel((0.0, 0.0, 0.0), (0, 0, 1))).tolist() == [0, 0, 0]


@pytest.mark.parametrize(("z", "expected"), [(1.0, 0.0), (3.0, 1.0)])
def test_what_is_nearer_hides_it(z: float, expected: float) -> None:
    scene = scene_of(square(whitted(), z=z), lights=[lamp(LightKind.SPHERE, (0, 0, 2), L, radius=0.5)])
    np.testing.assert_allclose(seen(scene, parallel((0, 0, 0), (0, 0, 1))), L * expected, rtol=1e-6)


def test_mirrors_and_glass_show_it() -> None:
    light = lamp(LightKind.SPHERE, (0, 0, 2), L, radius=0.5)
    mirror = scene_of(square(whitted(reflection=(0.5, 0.25, 1.0))), lights=[light])
    down = looking((0, 0, -1), (0.1, 0.0, 1.0))
    camera = replace(parallel((0.1, 0, 1.0)), world_from_camera=down)
    np.testing.assert_allclose(seen(mirror, camera), L * (0.5, 0.25, 1.0), rtol=1e-6)
    pane = scene_of(square(whitted(transmission=(0.5, 0.25, 1.0)), z=1.0), lights=[light])
    np.testing.assert_allclose(seen(pane, parallel((0, 0, 0), (0, 0, 1))), L * (0.5, 0.25, 1.0), rtol=1e-6)


def test_a_mirror_that_is_not_linked_does_not_show_it() -> None:
    light = lamp(LightKind.SPHERE, (0, 0, 2), L, radius=0.5, receivers=np.zeros(1, bool))
    scene = scene_of(square(whitted(reflection=0.5)), lights=[light])
    assert seen(scene, parallel((0.0, 0.0, 1.0))).tolist() == [0, 0, 0]
    np.testing.assert_allclose(seen(scene, parallel((0, 0, 1), (0, 0, 1))), L, rtol=1e-6)


def test_it_blocks_no_shadow_ray() -> None:
    """A sphere light between a floor and a point light: the floor is lit by both."""
    point = lamp(LightKind.POINT, (0, 0, 6), L, has_falloff=False)
    ball = lamp(LightKind.SPHERE, (0, 0, 3), L, radius=0.5)
    scene = scene_of(square(whitted(diffuse=1.0)), lights=[point, ball])
    under = parallel((-2.0, 0.0, 1.0), (2.0, 0.0, -1.0))
    np.testing.assert_allclose(seen(scene, under), radiance(scene, under), rtol=1e-6)


def test_its_mirror_image_replaces_the_highlight() -> None:
    """A smooth metal: without, the lobe about the mirror direction; with, the mirror ray sees the light and no lobe."""
    metal = preview(use_specular_workflow=True, specularColor=1.0, diffuseColor=0.0, roughness=0.05)
    scene = scene_of(square(metal), lights=[lamp(LightKind.RECT, (0, 0, 2), L, width=4.0, height=4.0)])
    camera = parallel((0.5, 0.0, 1.0))
    for samples in (0, 64):
        np.testing.assert_allclose(seen(scene, camera, light_samples=samples), L, rtol=1e-5)
    rough = preview(use_specular_workflow=True, specularColor=1.0, diffuseColor=0.0, roughness=0.8)
    scene = scene_of(square(rough), lights=[lamp(LightKind.RECT, (0, 0, 2), L, width=4.0, height=4.0)])
    for samples in (0, 64):
        options = {"light_samples": samples}
        np.testing.assert_allclose(seen(scene, camera, **options), radiance(scene, camera, **options), rtol=1e-5)


def test_it_is_covered_but_has_no_id() -> None:
    scene = scene_of(FAR, lights=[lamp(LightKind.SPHERE, (0, 0, 2), L, radius=0.5)], background=None)
    scene = replace(scene, instances=replace(scene.instances, seen_by=np.array([RayMask.SHADOWS], np.uint8)))
    film = render(scene, parallel((0, 0, 0), (0, 0, 1)), aovs=("primId",), lights_visible=True)
    assert (film.alpha[0, 0], film.aovs["primId"][0, 0]) == (1.0, -1)


# --- textures

# Bottom row first: red, green below; blue, white above.
TEXELS = np.float32([[(1, 0, 0, 1), (0, 1, 0, 1)], [(0, 0, 1, 1), (1, 1, 1, 1)]])


def textured(scene: Scene, texels: np.ndarray = TEXELS) -> Scene:
    return replace(scene, images=(Image("/image", texels),))


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_a_rects_texture_is_upright_for_whom_it_shines_on(mirror: float) -> None:
    """UsdLux: min coordinates at (+X, +Y). From -Z, with +Y up, +X is at the left; a mirroring transform turns that."""
    light = lamp(LightKind.RECT, (0, 0, 0), 1.0, width=2.0, height=2.0, image=0)
    matrix = np.diag([mirror, 1.0, 1.0, 1.0])
    scene = textured(scene_of(FAR, lights=[replace(light, world_from_light=matrix)]))
    camera = Camera("/camera", looking((0, 0, 1), (0, 0, -5)), (-1.0, 1.0, -1.0, 1.0), is_perspective=False)
    color = render(scene, camera, width=2, height=2, lights_visible=True).color
    expected = np.array([[(0, 0, 1), (1, 1, 1)], [(1, 0, 0), (0, 1, 0)]])
    np.testing.assert_allclose(color, expected[:, :: int(mirror)], atol=1e-6)


@pytest.mark.parametrize("place", [(0.3, 0.1), (1.5, -0.5), (-2.0, 1.0)])
def test_a_textured_rect_sends_its_texels(place: tuple[float, float]) -> None:
    """Each texel from where it is; as a whole, summed over fixed points of the light."""
    light = lamp(LightKind.RECT, (0, 0, 2), L, width=1.5, height=0.8, image=0)
    scene = scene_of(square(whitted(diffuse=1.0), half=20), lights=[light])
    camera = parallel((*place, 10.0))
    n = 400
    u, v = (q.reshape(-1) for q in np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n))
    frame = light.world_from_light
    points = frame[:3, 3] + np.outer((0.5 - u) * 1.5, frame[:3, 0]) + np.outer((v - 0.5) * 0.8, frame[:3, 1])
    to_light = points - (*place, 0.0)
    weight = (to_light[:, 2] ** 2 / (to_light**2).sum(axis=1) ** 2) * (1.5 * 0.8 / n**2) / np.pi
    # Bilinear between the centres of 2 x 2 texels, clamped outside.
    s, t = (np.clip(2 * q - 0.5, 0, 1)[:, None] for q in (u, v))
    low = TEXELS[0, 0] * (1 - s) + TEXELS[0, 1] * s
    high = TEXELS[1, 0] * (1 - s) + TEXELS[1, 1] * s
    expected = ((low * (1 - t) + high * t)[:, :3] * weight[:, None]).sum(axis=0) * L
    np.testing.assert_allclose(radiance(textured(scene), camera, light_samples=4096), expected, rtol=4e-3)
    np.testing.assert_allclose(radiance(textured(scene), camera), expected, rtol=0.02)


def test_a_textured_rect_as_a_whole_is_its_mean_from_far() -> None:
    light = lamp(LightKind.RECT, (0, 0, 4), L, width=1.5, height=0.8, image=0)
    scene = scene_of(square(whitted(diffuse=1.0), half=20), lights=[light])
    plain = replace(scene, lights=(replace(light, image=-1),))
    camera = parallel((14.0, 3.0, 10.0))
    np.testing.assert_allclose(radiance(textured(scene), camera), radiance(plain, camera) * 0.5, rtol=1e-5)


def test_an_8_bit_texture_is_decoded() -> None:
    """sRGB 188 is 0.503 of white."""
    light = lamp(LightKind.RECT, (0, 0, 0), 1.0, width=2.0, height=2.0, image=0, is_srgb=True)
    scene = textured(scene_of(FAR, lights=[light]), np.full((2, 2, 4), 188, np.uint8))
    color = seen(scene, parallel((0, 0, -5), (0, 0, 1)))
    np.testing.assert_allclose(color, ((188 / 255 + 0.055) / 1.055) ** 2.4, rtol=1e-5)
