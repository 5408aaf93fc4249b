# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdPreviewSurface where its formulas reduce to a few symbols: head-on views of flat surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from .scenes import distant, parallel, preview, radiance, render, scene_of, square, whitted

RTOL = 4e-6
DOWN = parallel((0, 0, 5))
# Lambertian: no reflectance at normal incidence, so that only diffuseColor is left head-on.
LAMBERT = {"use_specular_workflow": True, "specularColor": 0.0, "ior": 1.0, "roughness": 1.0}


def test_lambert_floor() -> None:
    """Radiance diffuse / pi times irradiance pi / 2."""
    scene = scene_of(square(preview(diffuseColor=(0.2, 0.4, 0.8), **LAMBERT)), lights=[distant((0, 0, -1), 0.5)])
    np.testing.assert_allclose(radiance(scene, DOWN), (0.1, 0.2, 0.4), rtol=RTOL)


def test_defaults_are_the_specifications() -> None:
    """diffuseColor 0.18, ior 1.5: F0 = 0.04 is taken from the diffuse term; GGX with alpha = 0.25 adds its peak."""
    scene = scene_of(square(preview()), lights=[distant((0, 0, -1))])
    expected = 0.18 * 0.96 + 0.04 / (4 * np.pi * 0.25**2) * np.pi
    np.testing.assert_allclose(radiance(scene, DOWN), expected, rtol=RTOL)


@pytest.mark.parametrize("roughness", [0.4, 0.7, 1.0])
def test_highlight_peak(roughness: float) -> None:
    """Eye, light and normal in one line: D = 1 / (pi alpha^2), G = 1, so the BRDF is F0 / (4 pi alpha^2)."""
    gold = np.array([0.9, 0.6, 0.2])
    scene = scene_of(
        square(preview(diffuseColor=gold, metallic=1.0, roughness=roughness)), lights=[distant((0, 0, -1), 0.01)]
    )
    np.testing.assert_allclose(radiance(scene, DOWN), 0.01 * gold / (4 * roughness**4), rtol=RTOL)


def test_emission_and_occluded_ambient() -> None:
    material = preview(diffuseColor=(0.5, 0.5, 1.0), emissiveColor=(0.0, 3.0, 0.25), occlusion=0.5, **LAMBERT)
    scene = scene_of(square(material), ambient=(1.0, 0.5, 0.25))
    np.testing.assert_allclose(radiance(scene, DOWN), (0.25, 3.125, 0.375), rtol=RTOL)


def test_metal_mirrors_the_background_in_its_colour() -> None:
    material = preview(diffuseColor=(0.9, 0.6, 0.2), metallic=1.0, roughness=0.0)
    scene = scene_of(square(material), background=(1.0, 0.5, 2.0))
    np.testing.assert_allclose(radiance(scene, DOWN), (0.9, 0.3, 0.4), rtol=RTOL)


def test_dielectric_mirrors_by_fresnel() -> None:
    """Black, smooth, ior 2: R = (1/3)^2 head-on."""
    scene = scene_of(square(preview(diffuseColor=0.0, roughness=0.0, ior=2.0)), background=(1.0, 0.5, 2.0))
    np.testing.assert_allclose(radiance(scene, DOWN), np.array([1.0, 0.5, 2.0]) / 9, rtol=RTOL)


def test_rough_surfaces_mirror_nothing() -> None:
    scene = scene_of(square(preview(diffuseColor=0.0, roughness=0.8)), background=(1.0, 1.0, 1.0))
    film = render(scene, DOWN)
    assert film.color.max() == 0.0
    assert film.rays.reflection == 0


def test_transparent_sheet_shows_what_is_behind() -> None:
    """Opacity scales the diffuse term, the rest of the light comes from behind."""
    material = preview(diffuseColor=0.8, opacity=0.25, **LAMBERT)
    scene = scene_of(square(material), lights=[distant((0, 0, -1))], background=(0.5, 1.0, 2.0))
    expected = 0.25 * 0.8 + 0.75 * np.array([0.5, 1.0, 2.0])
    film = render(scene, DOWN)
    np.testing.assert_allclose(film.color[0, 0], expected, rtol=RTOL)
    assert film.rays.refraction == 1


def test_presence_is_no_bounce() -> None:
    """Three sheets, each one half there, before a wall: alpha blending, at depth 1."""
    sheets = [square(preview(diffuseColor=c, opacity=0.5, presence=True, **LAMBERT), z=3 - i)
              for i, c in enumerate(((0.8, 0, 0), (0, 0.8, 0), (0, 0, 0.8)))]  # fmt: skip
    wall = square(whitted(ambient=0.0, diffuse=1.0), z=-1.0)
    scene = scene_of(*sheets, wall, lights=[distant((0, 0, -1), casts_shadow=False)])
    film = render(scene, DOWN, depth=1)
    np.testing.assert_allclose(film.color[0, 0], np.array([0.4, 0.2, 0.1]) + 0.125, rtol=RTOL)
    assert (film.rays.passed, film.rays.deepest, film.rays.dropped_by_depth) == (3, 1, 0)


@pytest.mark.parametrize(("opacity", "is_there"), [(0.3, False), (0.4, True), (0.5, True)])
def test_cut_out(opacity: float, is_there: bool) -> None:
    material = preview(diffuseColor=1.0, opacity=opacity, opacity_threshold=0.4, **LAMBERT)
    scene = scene_of(square(material), lights=[distant((0, 0, -1))], background=(0.125, 0.25, 0.5))
    film = render(scene, DOWN, depth=1)
    np.testing.assert_allclose(film.color[0, 0], (1, 1, 1) if is_there else (0.125, 0.25, 0.5), rtol=RTOL)


@pytest.mark.parametrize(("opacity", "alpha"), [(1.0, 1.0), (0.25, 0.25), (0.0, 0.0)])
def test_alpha_is_the_presence(opacity: float, alpha: float) -> None:
    scene = scene_of(square(preview(opacity=opacity, presence=True)), background=None)
    assert render(scene, DOWN).alpha[0, 0] == alpha


def test_clearcoat_peak() -> None:
    """Coat of ior 1.5, roughness 0.5: 0.04 / (4 pi 0.25^2) on top of the base."""
    material = preview(diffuseColor=0.5, clearcoat=0.5, clearcoatRoughness=0.5, **(LAMBERT | {"ior": 1.5}))
    scene = scene_of(square(material), lights=[distant((0, 0, -1))])
    np.testing.assert_allclose(radiance(scene, DOWN), 0.5 + 0.5 * 0.04 / (4 * 0.25**2), rtol=RTOL)
