# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sampled lights: floors, soft shadows and glossy surfaces against float64 sums over the light; noise that repeats."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import Film
from warp_rt.scene import Camera, Dome, Image, Light, LightKind

from ..lights_float64 import arriving, irradiance, irradiances, patches
from .scenes import Body, distant, lamp, looking, parallel, preview, radiance, render, scene_of, square, whitted

UP = np.array([0.0, 0.0, 1.0])
SAMPLES = 2048
HALF = 3.0
ACROSS = 3  # pixels
CENTERS = HALF * (2 * (np.arange(ACROSS) + 0.5) / ACROSS - 1)
PLACES = np.array([(x, y, 0.0) for y in -CENTERS for x in CENTERS])


def floor_film(light: Light, *bodies: Body, samples: int = SAMPLES, across: int = ACROSS, **options: object) -> Film:
    """Return a film of a white diffuse floor, 2 HALF wide, seen from above; what stands over the light is not seen."""
    scene = scene_of(square(whitted(diffuse=1.0), half=20), *bodies, lights=[light])
    camera = parallel((0, 0, 0.01), half=HALF)
    return render(scene, camera, width=across, height=across, light_samples=samples, **options)


def placed(
    position: tuple[float, float, float], direction: tuple[float, float, float], scale: object = 1.0
) -> np.ndarray:
    """Return a transform whose -Z looks along a direction, with a scale before it, which may be a matrix."""
    matrix = looking(direction, position)
    matrix[:3, :3] = matrix[:3, :3] @ (np.diag(np.broadcast_to(scale, 3)) if np.ndim(scale) < 2 else scale)
    return matrix


ABOVE, ASIDE = (0.3, -0.2, 2.0), (0.5, 0.1, -0.8)
SHEAR = np.array([[1.5, 0.6, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]])
LEANING = np.array([[1.25, 0.0, 0.6], [0.0, 1.0, 0.0], [0.0, 0.0, 0.75]])  # luxtest's frames 26 to 30
SHAPES = {
    LightKind.SPHERE: {"radius": 0.8},
    LightKind.RECT: {"width": 2.0, "height": 0.7},
    LightKind.DISK: {"radius": 0.9},
    LightKind.CYLINDER: {"radius": 0.4, "length": 2.5},
}
SHAPINGS: dict[str, dict[str, object]] = {
    "plain": {},
    "focus": {"focus": 3.0, "focus_tint": (0.0, 0.2, 1.0)},
    "cone": {"cone_angle": np.radians(50), "cone_softness": 0.5},
    "narrow cone": {"cone_angle": np.radians(25), "cone_softness": 0.1, "focus": 1.25},
}


def held_against(light: Light, film: Film, tolerance: float) -> None:
    """Compare every pixel with the sum over the light's patches."""
    expected = irradiances(light, PLACES, UP, count=144) / np.pi
    atol = tolerance * 0.1 * film.color.max()
    np.testing.assert_allclose(film.color.reshape(-1, 3), expected, rtol=tolerance, atol=atol)


@pytest.mark.parametrize("shaping", SHAPINGS)
@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_floors_under_shaped_lights(kind: LightKind, shaping: str) -> None:
    """Near enough that shaping differs from point to point of the light."""
    light = lamp(kind, ABOVE, (2.0, 1.0, 0.5), direction=ASIDE, **SHAPES[kind], **SHAPINGS[shaping])
    held_against(light, floor_film(light), 0.01)


@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_uneven_scales_are_sampled_as_they_are(kind: LightKind) -> None:
    """Under shear a flat light shines to one side of its plane, and focus looks at local Z, which leans against it."""
    for scale, focus in (((0.4, 1.6, 0.7), 0.0), (SHEAR, 0.0), (LEANING, 2.0)):
        light = Light("/lamp", kind, placed(ABOVE, ASIDE, scale), (1.0, 1.0, 1.0), focus=focus, **SHAPES[kind])
        held_against(light, floor_film(light), 0.01)


@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_narrow_cones_of_large_lights_get_samples_of_their_own(kind: LightKind) -> None:
    """Under the middle of a light whose cone shows an even disk of it: E = pi L sin^2 of the cone, as from the disk."""
    sizes = {"radius": 0.8, "width": 2.0, "height": 2.0, "length": 2.5}
    light = lamp(kind, (0.0, 0.0, 2.0), cone_angle=np.radians(6), **sizes)
    scene = scene_of(square(whitted(diffuse=1.0), half=20), lights=[light])
    for samples, error in ((4096, 5e-3), (64, 0.05)):  # 64 of the whole light would meet it twice
        got = radiance(scene, parallel((0, 0, 0.01)), light_samples=samples)[0]
        assert got == pytest.approx(np.sin(np.radians(6)) ** 2, rel=error)


@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_sharp_foci_of_large_lights_get_samples_of_their_own(kind: LightKind) -> None:
    """Under the middle of a light that ends where its focus is dark: E = 2 pi L / (focus + 2)."""
    sizes = {"radius": 0.8, "width": 2.0, "height": 2.0, "length": 2.5}
    light = lamp(kind, (0.0, 0.0, 2.0), focus=2000.0, **sizes)
    scene = scene_of(square(whitted(diffuse=1.0), half=20), lights=[light])
    for samples, error in ((4096, 5e-3), (64, 0.06)):
        got = radiance(scene, parallel((0, 0, 0.01)), light_samples=samples)[0]
        assert got == pytest.approx(2 / 2002, rel=error)


@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_what_lies_below_the_horizon_gives_nothing(kind: LightKind) -> None:
    """The floor cuts through the light, which reaches as far below it as above."""
    light = lamp(kind, (0.0, 0.0, 0.1), direction=(0, 1, -0.2), **SHAPES[kind])
    film = floor_film(light, samples=2 * SAMPLES)
    outside = np.linalg.norm(PLACES, axis=1) > 1.4
    expected = irradiances(light, PLACES[outside], UP, count=320) / np.pi
    np.testing.assert_allclose(film.color.reshape(-1, 3)[outside], expected, rtol=0.02, atol=2e-4)


@pytest.mark.parametrize("degrees", [0.53, 20.0, 100.0, 180.0, 300.0])
@pytest.mark.parametrize("tilt", [0.0, 60.0])
def test_distant_cones(degrees: float, tilt: float) -> None:
    """Within 0.1 % where all of it is above the horizon: there E = pi sin^2 of the half angle times the cosine."""
    direction = (np.sin(np.radians(tilt)), 0.0, -np.cos(np.radians(tilt)))
    light = Light("/sun", LightKind.DISTANT, looking(direction), (1.0, 1.0, 1.0), angle=np.radians(degrees))
    got = floor_film(light, samples=4 * SAMPLES, across=1).color[0, 0, 0]
    if degrees / 2 + tilt <= 90:
        expected = np.sin(np.radians(degrees) / 2) ** 2 * np.cos(np.radians(tilt))
        assert got == pytest.approx(expected, rel=1e-3)
    else:
        expected = irradiance(light, np.zeros(3), UP, count=1024)[0] / np.pi
        assert got == pytest.approx(expected, rel=3e-3)


# --- the same lights as a whole, without noise


@pytest.mark.parametrize("shaping", SHAPINGS)
@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_floors_under_whole_lights(kind: LightKind, shaping: str) -> None:
    """Closed forms, the cylinder's to 0.1 %; where shaping varies over the light, times a mean over cells of it."""
    light = lamp(kind, ABOVE, (2.0, 1.0, 0.5), direction=ASIDE, **SHAPES[kind], **SHAPINGS[shaping])
    got = floor_film(light, samples=0).color.reshape(-1, 3) * np.pi
    expected = irradiances(light, PLACES, UP, count=256)
    if shaping == "plain":
        np.testing.assert_allclose(got, expected, rtol=1e-3)
    else:
        np.testing.assert_allclose(got, expected, rtol=0.01, atol=2e-4 * expected.max())


@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_whole_lights_under_uneven_scales_and_on_the_horizon(kind: LightKind) -> None:
    lights = [
        Light("/lamp", kind, placed(ABOVE, ASIDE, (0.4, 1.6, 0.7)), (1.0, 1.0, 1.0), **SHAPES[kind]),
        Light("/lamp", kind, placed(ABOVE, ASIDE, SHEAR), (1.0, 1.0, 1.0), **SHAPES[kind]),
        lamp(kind, (0.0, 3.2, 0.2), direction=(0, -1, -0.2), **SHAPES[kind]),
        Light("/lamp", kind, placed((0.0, 3.2, 0.2), (0, -1, -0.2), SHEAR), (1.0, 1.0, 1.0), **SHAPES[kind]),
        Light("/lamp", kind, placed((0.0, 900.0, 0.2), (0, -1, -0.2)), (1e5, 1e5, 1e5), **SHAPES[kind]),
    ]
    for light in lights:
        got = floor_film(light, samples=0).color.reshape(-1, 3) * np.pi
        np.testing.assert_allclose(got, irradiances(light, PLACES, UP, count=256), rtol=1e-3)


def test_little_that_a_cone_leaves_of_uneven_lights() -> None:
    """Summed from the axis on, where they are a thousand times as bright, the digits of what is seen would cancel."""
    soft = {"cone_angle": np.radians(45), "cone_softness": 1.0}
    turned = np.array([[0.215, -0.156, -0.4865], [0.355, 1.87, 0.002], [0.91, -0.692, 0.1145]])
    cases = [(LightKind.CYLINDER, turned, (1.491, 1.336, 6.121), {"radius": 1.0, "length": 1.0}, soft, (5.24, 5.24))]
    turned = np.array([[1.036, 0.56, -0.383], [0.968, -0.433, -0.7225], [-1.34, 0.121, -0.817]])
    soft = {"cone_angle": np.radians(60), "cone_softness": 0.4055}
    cases += [(LightKind.SPHERE, turned, (-0.2, 0.767, 2.0), {"radius": 0.5}, soft, (3.14, 5.24))]
    for kind, linear, center, shape, shaping, place in cases:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = linear, center
        light = Light("/lamp", kind, matrix, (1.0, 1.0, 1.0), **shape, **shaping)
        scene = scene_of(square(whitted(diffuse=1.0), half=20), lights=[light])
        expected = irradiance(light, np.array([*place, 0.0]), UP, count=600)[0] / np.pi
        assert radiance(scene, parallel((*place, 0.01)))[0] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    ("degrees", "height"), [(60.0, 0.3), (150.0, 0.3), (300.0, 0.3), (0.53, 0.0), (0.53, 0.003), (0.53, -0.002)]
)
def test_whole_distant_lights_on_the_horizon(degrees: float, height: float) -> None:
    light = Light("/sun", LightKind.DISTANT, looking((1, 0, -height)), (1.0, 1.0, 1.0), angle=np.radians(degrees))
    expected = irradiance(light, np.zeros(3), UP, count=2048)[0] / np.pi
    assert floor_film(light, samples=0, across=1).color[0, 0, 0] == pytest.approx(expected, rel=2e-4)


# --- shadows


def half_plane(z: float) -> Body:
    """Return an opaque sheet that covers x < 0."""
    body = square(whitted(), half=20, z=z)
    return Body(body.points - (20, 0, 0), body.faces, body.material)


@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_penumbra_below_an_edge(kind: LightKind) -> None:
    """Each patch is seen or not: by where its line to the floor goes through the sheet's plane."""
    height = 1.0
    light = lamp(kind, (0.1, 0.0, 2.5), direction=(0, 0, -1), **SHAPES[kind])
    film = floor_film(light, half_plane(height))
    for column, x in enumerate(CENTERS):
        point = np.array([x, -CENTERS[0], 0.0])
        wi, solid_angle, radiance_ = arriving(light, point, count=160)
        through = x + wi[:, 0] / wi[:, 2] * height
        parts = radiance_[:, 0] * wi[:, 2] * solid_angle * (wi[:, 2] > 0)
        expected, whole = (parts * (through > 0)).sum() / np.pi, parts.sum() / np.pi
        assert film.color[0, column, 0] == pytest.approx(expected, abs=0.012 * whole)


def test_sky_behind_an_edge() -> None:
    """Under half of an even sky, cut along the edge of a sheet overhead: E / pi = (1 - sin of its angle) / 2."""
    scene = scene_of(square(whitted(diffuse=1.0), half=20), half_plane(1.0), domes=[Dome("/sky", np.eye(4), (1, 1, 1))])
    for x in (-2.0, 0.0, 1.0):
        got = radiance(scene, parallel((x, 0, 0.01)), light_samples=4096)[0]
        # The sheet ends 20 to the side, so far off that 2 % of a sky's half is all that comes from beyond it.
        edge = x / np.hypot(x, 1.0)
        assert got == pytest.approx((1 + edge) / 2, abs=0.006)


def test_points_cast_sharp_shadows_without_noise() -> None:
    point = lamp(LightKind.POINT, (0.0, 0.0, 2.0), radius=0.5)
    sun = distant((0.2, 0.1, -1))
    for light in (point, sun):
        sampled, whole = (floor_film(light, half_plane(0.5), samples=n) for n in (16, 0))
        np.testing.assert_array_equal(sampled.color, whole.color)
        assert sampled.rays.shadow == whole.rays.shadow == ACROSS**2


# --- glossy surfaces


def glossy(direction: np.ndarray, wo: np.ndarray, roughness: float, f0: float) -> np.ndarray:
    """Return UsdPreviewSurface's specular BRDF on a floor, in float64."""
    alpha = roughness**2
    h = direction + wo
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    q = alpha**2 * h[:, 2] ** 2 + h[:, 0] ** 2 + h[:, 1] ** 2
    k = alpha / 2
    g = np.prod([c / (c * (1 - k) + k) for c in np.broadcast_arrays(direction[:, 2], wo[2])], axis=0)
    fresnel = f0 + (1 - f0) * (1 - h @ wo) ** 5
    return fresnel * alpha**2 / (np.pi * q * q) * g / (4 * direction[:, 2] * wo[2])


@pytest.mark.parametrize("roughness", [0.15, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_highlights(kind: LightKind, roughness: float) -> None:
    """The BRDF times the light, summed over its patches, as an eye sees it that the middle is mirrored to."""
    material = preview(diffuseColor=0.0, useSpecularWorkflow=0, roughness=roughness, ior=1.5)
    light = lamp(kind, (-2.0, 0.0, 2.0), direction=(1, 0, -1), **SHAPES[kind])
    scene = scene_of(square(material, half=20), lights=[light])
    down = np.array([-0.6, 0.1, -0.8]) / np.linalg.norm([-0.6, 0.1, -0.8])
    got = radiance(scene, parallel(-5 * down, down), light_samples=4096, depth=1)[0]
    wi, solid_angle, emitted = arriving(light, np.zeros(3), count=400)
    expected = (glossy(wi, -down, roughness, 0.04) * emitted[:, 0] * np.maximum(wi[:, 2], 0) * solid_angle).sum()
    assert got == pytest.approx(expected, rel=0.015)


@pytest.mark.parametrize("degrees", [0.53, 20.0])
@pytest.mark.parametrize("is_coat", [False, True], ids=["specular workflow", "clearcoat"])
def test_highlights_of_the_sun(*, is_coat: bool, degrees: float) -> None:
    """Sampled, as summed up; as a whole, all of it from its middle, so that a wide sun's highlight is too bright."""
    coat = {"specularColor": 0.0, "ior": 1.5, "clearcoat": 0.8, "clearcoatRoughness": 0.35}
    base = {"specularColor": 0.3, "roughness": 0.35}
    material = preview(use_specular_workflow=True, diffuseColor=0.0, **(coat if is_coat else base))
    share, f0 = (0.8, 0.04) if is_coat else (1.0, 0.3)
    light = Light("/sun", LightKind.DISTANT, looking((1, 0, -1)), (2.0, 2.0, 2.0), angle=np.radians(degrees))
    scene = scene_of(square(material, half=20), lights=[light])
    down = np.array([-0.7, 0.1, -0.7]) / np.linalg.norm([-0.7, 0.1, -0.7])
    sampled, whole = (radiance(scene, parallel(-5 * down, down), light_samples=n)[0] for n in (2048, 0))
    wi, solid_angle, emitted = arriving(light, np.zeros(3), count=300)
    arrives = emitted[:, 0] * wi[:, 2] * solid_angle
    expected = share * (glossy(wi, -down, 0.35, f0) * arrives).sum()
    middle = np.array([[-1, 0, 1]]) / np.sqrt(2)
    from_middle = share * glossy(middle, -down, 0.35, f0)[0] * arrives.sum()
    assert sampled == pytest.approx(expected, rel=0.01)
    assert whole == pytest.approx(from_middle, rel=2e-3)
    if degrees < 1:
        assert whole == pytest.approx(expected, rel=5e-3)
    else:
        assert 1.165 < whole / expected < 1.185  # docs/whitted.md


def test_smooth_metal_mirrors_a_light() -> None:
    """A lobe of no width that lies within the light: radiance L times the metal's colour, from few samples."""
    material = preview(diffuseColor=(0.9, 0.6, 0.2), metallic=1.0, roughness=0.0)
    light = lamp(LightKind.SPHERE, (-2.0, 0.0, 2.0), 3.0, radius=0.5)
    scene = scene_of(square(material, half=20), lights=[light])
    down = np.array([-1, 0, -1]) / np.sqrt(2)
    got = radiance(scene, parallel(-5 * down, down), light_samples=16)
    np.testing.assert_allclose(got, (2.7, 1.8, 0.6), rtol=0.01)  # of a metal F90 is its colour too


# --- domes with images


def sky(pixels: np.ndarray) -> tuple[Image, Dome]:
    """Return a dome whose pole is up, and its image."""
    upright = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    return Image("/sky", np.asarray(pixels, np.float32)), Dome("/sky", upright, (1, 1, 1), image=0)


def test_floor_under_a_sky_with_a_small_sun() -> None:
    """The image as it is interpolated, summed up in float64; the sun is nine of 8192 texels and most of the light."""
    pixels = np.full((64, 128, 4), 0.2)
    pixels[40:43, 100:103, :3] = 300.0
    image, dome = sky(pixels)
    fine = 16
    rows = (np.arange(64 * fine) + 0.5) / fine - 0.5
    columns = (np.arange(128 * fine) + 0.5) / fine - 0.5
    y0, x0 = np.floor(rows).astype(int), np.floor(columns).astype(int)
    fy, fx = (rows - y0)[:, None], (columns - x0)[None, :]
    low, high = np.clip(y0, 0, 63), np.clip(y0 + 1, 0, 63)
    grey = pixels[..., 0]
    below = grey[low][:, x0 % 128] * (1 - fx) + grey[low][:, (x0 + 1) % 128] * fx
    above = grey[high][:, x0 % 128] * (1 - fx) + grey[high][:, (x0 + 1) % 128] * fx
    seen = below * (1 - fy) + above * fy
    latitude = ((np.arange(64 * fine) + 0.5) / (64 * fine) - 0.5) * np.pi
    weight = np.maximum(np.sin(latitude), 0) * np.cos(latitude) * (np.pi / (64 * fine)) * (2 * np.pi / (128 * fine))
    expected = (seen * weight[:, None]).sum() / np.pi
    scene = scene_of(square(whitted(diffuse=1.0), half=20), domes=[dome])
    scene = type(scene)(**{**vars(scene), "images": (image,)})
    film = render(scene, parallel((0, 0, 5), half=1.0), width=8, height=8, light_samples=256)
    assert film.color[..., 0].mean() == pytest.approx(expected, rel=0.01)
    assert film.color[..., 0].std() < 0.1 * expected


# --- noise


def test_the_picture_does_not_depend_on_who_makes_which_part() -> None:
    light = lamp(LightKind.RECT, ABOVE, direction=ASIDE, **SHAPES[LightKind.RECT])
    films = [
        floor_film(light, half_plane(1.0), samples=3, across=16, spp=2, **options)
        for options in ({}, {"tile_size": 5, "threads": 1}, {"tile_size": 3, "threads": 2})
    ]
    for film in films[1:]:
        np.testing.assert_array_equal(film.color, films[0].color)
        assert film.rays == films[0].rays
    crop = floor_film(light, half_plane(1.0), samples=3, across=16, spp=2, crop=(4, 6, 7, 5))
    np.testing.assert_array_equal(crop.color, films[0].color[6:11, 4:11])
    assert (floor_film(light, samples=3, seed=1).color != floor_film(light, samples=3).color).any()


@pytest.mark.parametrize("kind", SHAPES, ids=lambda kind: kind.name.lower())
def test_samples_of_pixel_and_light_are_stratified_together(kind: LightKind) -> None:
    """Sixty-four samples of a light err the same however they are shared out to those of the pixel, and far less than
    64 independent ones would, whose error is known: that of points of the light, a sixteenth part of it."""
    light = lamp(kind, (0.0, 0.0, 2.0), direction=(0.2, 0, -1), **SHAPES[kind])
    scene = scene_of(square(whitted(diffuse=1.0), half=20), lights=[light])
    expected = irradiance(light, np.array([1.0, 0.5, 0.0]), UP)[0] / np.pi
    centers, areas = patches(light, 128)
    to_light = centers - (1.0, 0.5, 0.0)
    d2 = (to_light**2).sum(1)
    arrives = np.maximum(-(areas * to_light).sum(1), 0) * to_light[:, 2] / d2**2 / np.linalg.norm(areas, axis=1)
    weights = np.linalg.norm(areas, axis=1)
    mean = np.average(arrives, weights=weights)
    independent = np.sqrt((np.average(arrives**2, weights=weights) / mean**2 - 1) / 64)
    for spp, samples in ((1, 64), (4, 16), (16, 4), (64, 1)):
        options = {"light_samples": samples, "spp": spp}
        seeds = [radiance(scene, parallel((1, 0.5, 0.01)), seed=seed, **options)[0] for seed in range(16)]
        error = np.sqrt(np.mean((np.array(seeds) / expected - 1) ** 2))
        assert error < 0.25 * independent, (spp, error, independent)


def test_shadow_rays_are_counted_one_by_one() -> None:
    light = lamp(LightKind.SPHERE, (0, 0, 3), radius=0.5)
    assert floor_film(light, samples=7).rays.shadow == 7 * ACROSS**2
    assert floor_film(light, samples=0).rays.shadow == ACROSS**2
    dome = scene_of(square(whitted(diffuse=1.0)), domes=[Dome("/dome", np.eye(4), (1, 1, 1))])
    camera: Camera = parallel((0, 0, 5))
    assert render(dome, camera, light_samples=5).rays.shadow == 5
    assert render(dome, camera).rays.shadow == 0
