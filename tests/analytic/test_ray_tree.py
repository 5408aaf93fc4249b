# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray tree: geometric series between mirrors, depth, threshold, Snell's law, total internal reflection."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from .scenes import Body, Scene, box, chart, parallel, radiance, render, scene_of, square, wedge, whitted

RTOL = 4e-6


def place_tolerance(crossings: int, size: float, tangent: float) -> float:
    """Return how far from its exact place a ray may arrive.

    A spawned ray starts off the surface by 2^-19 of the magnitudes that made up its start (``kernels.constants``), at
    most four times ``size``; slanted, it is that much times ``tangent`` aside from then on.
    """
    return crossings * 4 * 2.0**-19 * size * tangent


def corridor(reflection: object, ambient: float = 0.25) -> tuple[Scene, object]:
    """Return two parallel mirrors that a ray between them never leaves, and that ray's camera."""
    mirror = whitted(ambient=ambient, reflection=reflection)
    scene = scene_of(square(mirror, z=-1.0), square(mirror, z=1.0), ambient=(1, 1, 1))
    return scene, parallel((0.3, 0.1, 0.0))


@pytest.mark.parametrize("depth", [1, 2, 3, 7, 20])
def test_mirror_corridor_is_a_geometric_series(depth: int) -> None:
    r = np.array([0.9, 0.5, 0.25])
    scene, camera = corridor(r)
    film = render(scene, camera, depth=depth)
    np.testing.assert_allclose(film.color[0, 0], 0.25 * (1 - r**depth) / (1 - r), rtol=RTOL)
    assert film.rays.reflection == depth - 1
    assert film.rays.deepest == depth
    assert (film.rays.dropped_by_depth, film.rays.dropped_by_threshold) == (1, 0)
    assert [level.nodes for level in film.rays.per_depth] == [1] * depth


@pytest.mark.parametrize(
    ("threshold", "nodes"),
    [(0.125, 4), (np.nextafter(np.float32(0.125), np.float32(1)), 3), (0.1, 4), (1.0, 1), (1.5, 1)],
)
def test_threshold_drops_what_is_strictly_below(threshold: float, nodes: int) -> None:
    """Weights 1, 1/2, 1/4, 1/8 by the largest channel of Kr; 1/8 is not strictly below 1/8."""
    scene, camera = corridor((0.5, 0.1, 0.0))
    film = render(scene, camera, depth=50, threshold=float(threshold))
    assert film.rays.deepest == nodes
    assert (film.rays.dropped_by_threshold, film.rays.dropped_by_depth) == (1, 0)
    np.testing.assert_allclose(film.color[0, 0, 0], 0.25 * (2 - 2.0 ** (1 - nodes)), rtol=RTOL)


def test_threshold_is_tested_before_depth() -> None:
    scene, camera = corridor(0.5)
    rays = render(scene, camera, depth=3, threshold=0.3).rays
    assert (rays.dropped_by_threshold, rays.dropped_by_depth) == (1, 0)


def test_diffuse_surfaces_spawn_nothing() -> None:
    scene = scene_of(square(whitted(ambient=1.0, diffuse=1.0)), ambient=(1, 1, 1))
    rays = render(scene, parallel((0, 0, 5)), depth=7).rays
    assert (rays.reflection, rays.refraction, rays.dropped_by_depth, rays.dropped_by_threshold) == (0, 0, 0, 0)


def test_mirror_shows_the_place_that_the_law_of_reflection_names() -> None:
    """Eye ray along (1, 0, -1) onto a mirror at z = 0 meets the ceiling at z = 3 as far on as it came down."""
    direction = np.array([1.0, 0.0, -1.0]) / np.sqrt(2)
    scene = scene_of(square(whitted(reflection=1.0)), chart(z=3.0), ambient=(1, 1, 1))
    color = radiance(scene, parallel((-2.0, 0.7, 2.0), direction), depth=2)
    np.testing.assert_allclose(color[:2], (3.0, 0.7), rtol=1e-6, atol=place_tolerance(1, 10, 1.0))


@pytest.mark.parametrize("degrees", [0.0, 20.0, 55.0, 80.0])
def test_slab_shifts_a_ray_by_snells_law(degrees: float) -> None:
    ior, thickness = 1.5, 2.0
    inner = np.arcsin(np.sin(np.radians(degrees)) / ior)
    direction = np.array([np.sin(np.radians(degrees)), 0.0, -np.cos(np.radians(degrees))])
    slab = box(whitted(transmission=1.0, ior=ior), (-20, -20, 1), (20, 20, 1 + thickness))
    scene = scene_of(slab, chart(), ambient=(1, 1, 1))
    start = np.array([0.0, 0.25, 4.0])
    x = np.tan(np.radians(degrees)) * (start[2] - thickness) + np.tan(inner) * thickness
    color = radiance(scene, parallel(start, direction), depth=3)
    np.testing.assert_allclose(
        color[:2], (x, 0.25), rtol=1e-6, atol=1e-6 + place_tolerance(2, 20, np.tan(np.radians(degrees)))
    )


@pytest.mark.parametrize("mirrored", [False, True])
def test_prism_bends_a_ray_by_snells_law(mirrored: bool) -> None:
    """A vertical ray enters the flat top of a wedge unbent and leaves its face, 20 degrees aslant, bent."""
    ior, slope = 1.4, np.radians(20)
    body = wedge(whitted(transmission=1.0, ior=ior), [(-2, 2), (4, 2 - 6 * np.tan(slope)), (4, 2)])
    if mirrored:  # the same solid out of its mirror image, by a transform that mirrors it back
        flip = np.diag([-1.0, 1.0, 1.0, 1.0])
        body = dataclasses.replace(
            body, points=body.points * (-1, 1, 1), faces=body.faces[:, ::-1], world_from_local=flip
        )
    scene = scene_of(body, chart(z=-10.0), ambient=(1, 1, 1))
    exit_height = 2 - 2 * np.tan(slope)
    bend = np.arcsin(ior * np.sin(slope)) - slope  # from the vertical; towards the thick end, +x
    expected = np.tan(bend) * (exit_height + 10)
    color = radiance(scene, parallel((0.0, 0.25, 5.0)), depth=3)
    np.testing.assert_allclose(color[:2], (expected, 0.25), rtol=1e-6, atol=place_tolerance(2, 5, 1.0))


def test_open_sheet_bends_nothing() -> None:
    direction = np.array([1.0, 0.0, -1.0]) / np.sqrt(2)
    sheet = square(whitted(transmission=(0.5, 0.25, 1.0), ior=1.5), z=1.0)
    scene = scene_of(sheet, chart(), ambient=(1, 1, 1))
    film = render(scene, parallel((0.0, 2.0, 3.0), direction), depth=2)
    np.testing.assert_allclose(
        film.color[0, 0, :2], (0.5 * 3.0, 0.25 * 2.0), rtol=1e-6, atol=place_tolerance(1, 10, 1.0)
    )
    assert (film.rays.refraction, film.rays.total_internal_reflection) == (1, 0)


def reflecting_prism(kr: float, kt: float) -> Body:
    """Return a right-angled prism, ior 1.5, that turns a ray down -Z by total reflection at 45 degrees into +X."""
    return wedge(whitted(reflection=kr, transmission=kt, ior=1.5), [(-2, 2), (2, -2), (2, 2)])


@pytest.mark.parametrize("depth", [1, 2, 3, 4, 5, 60])
def test_total_internal_reflection_weighs_kr_plus_kt(depth: int) -> None:
    """The ray enters by one leg, is reflected at the long side, and leaves by the other leg; part of it goes on.

    Behind everything is the same background B. The ray inside alternates between the long side (weight Kr + Kt) and
    a leg (Kt B leaves, Kr stays), each bounce a level deeper.
    """
    kr, kt, background = 0.2, 0.7, np.array([0.5, 1.0, 2.0])
    scene = scene_of(reflecting_prism(kr, kt), background=background)
    film = render(scene, parallel((0.5, 0.25, 5.0)), depth=depth)

    total, tir = (kr if depth >= 2 else 0.0), 0
    weight = kt  # of the ray inside, first met at depth 2
    for level in range(2, depth + 1):
        if level % 2 == 0:
            weight *= kr + kt
            tir += 1
        else:
            total += weight * kt * (level < depth)
            weight *= kr
    np.testing.assert_allclose(film.color[0, 0], total * background, rtol=RTOL, atol=1e-9)
    assert film.rays.total_internal_reflection == tir


def test_below_the_critical_angle_nothing_is_totally_reflected() -> None:
    """ior 1.4 has a critical angle of 45.6 degrees: the long side at 45 degrees lets light out."""
    body = wedge(whitted(transmission=1.0, ior=1.4), [(-2, 2), (2, -2), (2, 2)])
    film = render(scene_of(body, background=(1, 1, 1)), parallel((0.5, 0.25, 5.0)), depth=3)
    np.testing.assert_allclose(film.color[0, 0], 1.0, rtol=RTOL)
    assert (film.rays.total_internal_reflection, film.rays.refraction) == (0, 2)


def test_a_body_of_the_outside_index_is_invisible() -> None:
    direction = np.array([0.5, 0.25, -1.0])
    direction /= np.linalg.norm(direction)
    scene = scene_of(box(whitted(transmission=1.0, ior=1.0), (-3, -3, 1), (3, 3, 2)), chart(), ambient=(1, 1, 1))
    color = radiance(scene, parallel((-1.0, -0.5, 4.0), direction), depth=3)
    np.testing.assert_allclose(color[:2], (1.0, 0.5), rtol=1e-6, atol=place_tolerance(2, 3, 0.5))
