# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Mesh lights against the lights whose shape they have, and against quadrature over their triangles in float64."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd

from warp_rt import Scene, load_scene
from warp_rt.scene import Light, LightKind, Material

from ..lights_float64 import shaping as shaped_by
from .scenes import lamp, looking, parallel, preview, radiance, render, scene_of, square, whitted

L = np.array([2.0, 1.0, 0.5])
PLACES = [(0.2, 0.1), (1.5, -0.5), (-2.0, 1.0)]
# The rectangle of a RectLight, seen from -Z counter-clockwise: it shines along -Z.
RECT = np.float32([(-1, -1, 0), (-1, 1, 0), (1, 1, 0), (1, -1, 0)]) / 2
TRIANGLES = np.stack([RECT[[0, 1, 2]], RECT[[0, 2, 3]]])


FLOOR = 'def Plane "F" { double width = 40\ndouble length = 40\ncolor3f[] primvars:displayColor = [(1, 1, 1)]\n}'


def mesh(triangles: np.ndarray, matrix: np.ndarray, **more: object) -> Light:
    return Light("/mesh", LightKind.MESH, matrix, tuple(L.tolist()), triangles=np.float32(triangles), **more)


def floor(light: Light) -> Scene:
    return scene_of(square(whitted(diffuse=1.0), half=20), lights=[light])


def lit(light: Light, place: tuple[float, float], **options: object) -> np.ndarray:
    return radiance(floor(light), parallel((*place, 10.0)), **options)


def refined(triangles: np.ndarray, times: int) -> np.ndarray:
    """Return triangles cut into four, a few times."""
    for _ in range(times):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return triangles


def ball(times: int = 3) -> np.ndarray:
    """Return a ball of radius 1 made of triangles, from an octahedron, wound outwards."""
    x, y, z = np.eye(3)
    faces = [(s * x, t * y, u * z) for s in (1, -1) for t in (1, -1) for u in (1, -1)]
    octahedron = np.array([f if np.linalg.det(np.array(f)) > 0 else f[::-1] for f in faces])
    corners = refined(octahedron, times)
    return corners / np.linalg.norm(corners, axis=2, keepdims=True)


def quadrature(triangles: np.ndarray, matrix: np.ndarray, place: tuple[float, float]) -> float:
    """Return E / pi of radiance 1 on the floor, from what faces the place: each triangle refined to small patches."""
    corners = refined(triangles.astype(float), 3) @ matrix[:3, :3].T + matrix[:3, 3]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    to_light = corners.mean(axis=1) - (*place, 0.0)
    d2 = (to_light**2).sum(axis=1)
    seen = np.maximum(-(to_light * normal).sum(axis=1), 0.0) * np.maximum(to_light[:, 2], 0.0)
    return float((seen / d2**2).sum()) / np.pi


@pytest.mark.parametrize("samples", [0, 1024])
@pytest.mark.parametrize("times", [0, 2])
@pytest.mark.parametrize("place", PLACES)
def test_a_rectangle_of_triangles_is_a_rect_light(place: tuple[float, float], times: int, samples: int) -> None:
    matrix = looking((0.3, 0.2, -1.0), (0, 0, 2)) @ np.diag([1.5, 0.8, 1.0, 1.0])
    light = mesh(refined(TRIANGLES, times), matrix)
    rect = Light("/rect", LightKind.RECT, matrix, light.radiance)
    expected = lit(rect, place)
    np.testing.assert_allclose(lit(light, place, light_samples=samples), expected, rtol=5e-3 if samples else 2e-5)


@pytest.mark.parametrize(
    ("shaping", "expected"),
    [({"cone_angle": np.radians(6)}, np.sin(np.radians(6)) ** 2), ({"focus": 1000.0}, 2 / 1002)],
    ids=["cone", "focus"],
)
@pytest.mark.parametrize("shape", ["sheet", "ball"])
def test_most_samples_go_where_cone_and_focus_leave_something(shape: str, shaping: dict, expected: float) -> None:
    """Under the middle of a light that is far larger: E = pi L sin^2 of the cone, 2 pi L / (focus + 2)."""
    matrix = np.eye(4)
    matrix[2, 3] = 1.5
    triangles = ball() if shape == "ball" else refined(TRIANGLES, 2)[:, ::-1] * np.float32([2, -2, 2])
    light = mesh(triangles, matrix, **shaping)
    for samples, error in ((4096, 5e-3), (64, 0.06)):
        np.testing.assert_allclose(lit(light, (0, 0), light_samples=samples), L * expected, rtol=error)


@pytest.mark.parametrize("mirror", [(1, 1, 1), (-1, 1, 1), (1, 1, -1)])
def test_it_shines_outwards_also_when_mirrored(mirror: tuple) -> None:
    """Mirrored along its normal a rect would shine the other way; a mesh's outside turns with it."""
    matrix = looking((0, 0, -1), (0, 0, 2)) @ np.diag([*mirror, 1.0])
    down, up = mesh(TRIANGLES, matrix), mesh(TRIANGLES[:, ::-1], matrix)
    is_down = mirror[2] > 0
    for samples in (0, 16):
        assert (lit(down, (0.3, 0.1), light_samples=samples)[0] > 0) == is_down
        assert (lit(up, (0.3, 0.1), light_samples=samples)[0] > 0) != is_down
        both = [replace(one, is_double_sided=True) for one in (down, up)]
        assert all(lit(one, (0.3, 0.1), light_samples=samples)[0] > 0 for one in both)


@pytest.mark.parametrize("place", PLACES)
def test_a_ball_of_many_triangles(place: tuple[float, float]) -> None:
    """512 triangles: sampled, and as a whole in clusters, some of which face the place."""
    matrix = np.diag([0.5, 0.5, 0.5, 1.0])
    matrix[:3, 3] = (0, 0, 2)
    light = mesh(ball(), matrix)
    expected = L * quadrature(ball(), matrix, place)
    np.testing.assert_allclose(lit(light, place, light_samples=4096), expected, rtol=0.01)
    np.testing.assert_allclose(lit(light, place), expected, rtol=5e-3)
    sphere = lamp(LightKind.SPHERE, (0, 0, 2), L, radius=0.5)
    np.testing.assert_allclose(expected, lit(sphere, place), rtol=0.02)


@pytest.mark.parametrize("samples", [0, 64])
def test_the_mesh_itself_does_not_shadow_its_light(samples: int) -> None:
    """The ball is drawn where it shines."""
    matrix = np.diag([0.5, 0.5, 0.5, 1.0])
    matrix[:3, 3] = (0, 0, 2)
    triangles = ball(2)
    body = replace(
        square(whitted()),
        points=triangles.reshape(-1, 3),
        faces=np.arange(triangles.size // 3).reshape(-1, 3),
        world_from_local=matrix,
    )
    light = mesh(triangles, matrix)
    alone = floor(light)
    scene = scene_of(square(whitted(diffuse=1.0), half=20), body, lights=[light])
    camera = parallel((3.0, 0.0, 0.5), (-2.0, 0.0, -0.5))
    expected = radiance(alone, camera, light_samples=samples)
    np.testing.assert_allclose(radiance(scene, camera, light_samples=samples), expected, rtol=1e-5)


def turned(profile: np.ndarray, turns: int) -> np.ndarray:
    """Return the triangles of a profile, distances from z and heights, turned about z: outside is to its right."""
    angles = 2 * np.pi * np.arange(turns + 1) / turns
    across, up = profile[:, None, 0], np.repeat(profile[:, 1:], turns + 1, axis=1)
    rings = np.stack([across * np.cos(angles), across * np.sin(angles), up], axis=2)
    a, b, c, d = rings[:-1, :-1], rings[:-1, 1:], rings[1:, 1:], rings[1:, :-1]
    return np.concatenate([np.stack(corners, axis=2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))])


def circle(start: float, end: float, radius: float, center: float, count: int) -> np.ndarray:
    angles = np.linspace(start, end, count + 1)
    return np.stack([center + radius * np.cos(angles), radius * np.sin(angles)], axis=1)


THREE = np.concatenate([0.3 * ball(1) + place for place in ((0, 0, 0), (0.5, 0, 0.4), (-0.4, 0.2, 0.5))])
HOLLOW = {
    "three balls": THREE,
    "a ring on edge": turned(circle(-np.pi, np.pi, 0.2, 0.6, 8), 12)[:, :, [1, 2, 0]],
    "a bowl that shines inwards": turned(circle(-np.pi / 2 + 0.01, 0.0, 0.7, 0.0, 6), 16)[:, ::-1, [1, 2, 0]],
}


def seen_quadrature(triangles: np.ndarray, height: float, place: tuple[float, float]) -> float:
    """Return what ``quadrature`` does of what no other triangle is before, each patch by its middle."""
    blockers = triangles + np.array((0, 0, height))
    patches = refined(blockers, 3)
    start = np.array((*place, 0.0))
    to_light = patches.mean(axis=1) - start
    normal = np.cross(patches[:, 1] - patches[:, 0], patches[:, 2] - patches[:, 0]) / 2
    seen = np.maximum(-(to_light * normal).sum(axis=1), 0.0) * np.maximum(to_light[:, 2], 0.0)
    to_light, seen = to_light[seen > 0], seen[seen > 0]
    # Cramer's rule for start + t d = a + u x + v y.
    a, x, y = blockers[:, 0], blockers[:, 1] - blockers[:, 0], blockers[:, 2] - blockers[:, 0]
    s, d = start - a, to_light[:, None]
    determinant = (np.cross(d, y) * x).sum(axis=-1)
    determinant[determinant == 0] = np.inf  # in the triangle's plane: no hit
    u, v = (np.cross(d, y) * s).sum(axis=-1) / determinant, (np.cross(s, x) * d).sum(axis=-1) / determinant
    t = (np.cross(s, x) * y).sum(axis=-1) / determinant
    is_hidden = ((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-9) & (t < 1 - 1e-6)).any(axis=1)
    return float((seen * ~is_hidden / (to_light**2).sum(axis=1) ** 2).sum()) / np.pi


def drawn(triangles: np.ndarray, matrix: np.ndarray, material: Material) -> Scene:
    """Return a floor under a light, and what draws it."""
    body = replace(
        square(material),
        points=np.float32(triangles.reshape(-1, 3)),
        faces=np.arange(triangles.size // 3).reshape(-1, 3),
        world_from_local=matrix,
    )
    light = mesh(triangles, matrix, drawn_by=np.array([1]))
    return scene_of(square(whitted(diffuse=1.0), half=20), body, lights=[light])


@pytest.mark.parametrize(
    ("shape", "material", "shadows"),
    [*((shape, whitted(), "auto") for shape in HOLLOW), ("three balls", preview(opacity=0.5), "opaque")],
)
def test_parts_hide_each_other_and_nothing_else(shape: str, material: Material, shadows: str) -> None:
    """As a whole nothing of its own is before the light but what is: no place is black, none gets the hidden part.

    Its points are seen or not: pixels are within a fiftieth of what the brightest gets, and the mean is within less.
    """
    triangles, height = HOLLOW[shape], 1.2
    matrix = np.eye(4)
    matrix[2, 3] = height
    scene = drawn(triangles, matrix, material)
    places = [(x, y) for x in (-0.4, 0.7, 1.6, 2.9) for y in (0.1, 0.8)]
    expected = np.array([seen_quadrature(triangles, height, place) for place in places])
    plain = np.array([quadrature(triangles, matrix, place) for place in places])
    assert (expected < 0.97 * plain).sum() > 3  # parts are hidden
    found = np.array([radiance(scene, parallel((*place, 0.1)), shadows=shadows)[0] / L[0] for place in places])
    np.testing.assert_allclose(found, expected, atol=0.02 * expected.max())
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01)


@pytest.mark.parametrize("more", [{"casts_shadow": False}, {"drawn_by": None}])
def test_parts_that_stop_no_light_hide_nothing(more: dict) -> None:
    matrix = np.eye(4)
    matrix[2, 3] = 1.2
    found = lit(mesh(THREE, matrix, **{"drawn_by": np.array([0]), **more}), (1.6, 0.8))
    np.testing.assert_allclose(found, L * quadrature(THREE, matrix, (1.6, 0.8)), rtol=5e-3)


@pytest.mark.parametrize(
    ("material", "shadows"), [(preview(opacity=0.0, ior=1.0), "auto"), (whitted(transmission=1.0), "transmit")]
)
def test_clear_parts_hide_nothing(material: Material, shadows: str) -> None:
    matrix = np.eye(4)
    matrix[2, 3] = 1.2
    found = radiance(drawn(THREE, matrix, material), parallel((1.6, 0.8, 0.1)), shadows=shadows)
    np.testing.assert_allclose(found, L * quadrature(THREE, matrix, (1.6, 0.8)), rtol=5e-3)


def test_cone_and_focus_shape_it() -> None:
    """A cone of 20 degrees about -Z."""
    light = mesh(TRIANGLES * np.float32(0.1), looking((0, 0, -1), (0, 0, 2)), cone_angle=np.radians(20))
    for samples in (0, 16):
        assert lit(light, (0.3, 0.1), light_samples=samples)[0] > 0
        assert lit(light, (1.5, 0.1), light_samples=samples)[0] == 0


def test_where_a_soft_cone_ends_small_parts_are_not_alike() -> None:
    """A sheet of 128 triangles that leans against its axis, level, about where the cone of 89 degrees ends."""
    lean = np.array([[1, 0, 0], [0, 0.6, 0.8], [0, -0.8, 0.6]])
    shape = refined(TRIANGLES, 3) @ lean.T
    matrix = looking((0, 1, 0), (0, 0, 1.5))
    light = mesh(shape, matrix, cone_angle=np.radians(89), cone_softness=1.0)
    corners = refined(shape, 4) @ matrix[:3, :3].T + matrix[:3, 3]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    for place in ((0.1, 0.2), (0.1, 0.3), (1.0, 0.4), (1.0, 0.1)):
        to_light = corners.mean(axis=1) - (*place, 0.0)
        d = np.linalg.norm(to_light, axis=1)
        seen = np.maximum(-(to_light * normal).sum(axis=1), 0.0) * np.maximum(to_light[:, 2], 0.0) / d**4
        factor = shaped_by(light, to_light @ matrix[:3, 2] / d)[:, 0]
        expected = (seen * factor).sum() / np.pi
        assert expected > 0
        assert lit(light, place)[0] / L[0] == pytest.approx(expected, rel=2e-3)


def test_little_that_a_cone_leaves_of_a_ball() -> None:
    """Where it is a ten thousandth as bright as on its axis, which looks up: beside the sum over small patches."""
    matrix = looking((0.547, 0.448, 0.707), (-0.979, -0.984, 1.405))
    light = mesh(ball(), matrix, cone_angle=np.radians(60), cone_softness=0.2, focus=12.0)
    corners = refined(ball().astype(float), 4) @ matrix[:3, :3].T + matrix[:3, 3]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    for place in ((1.05, 5.24), (3.14, 5.24), (5.24, 5.24), (5.24, 1.05)):
        to_light = corners.mean(axis=1) - (*place, 0.0)
        d = np.linalg.norm(to_light, axis=1)
        seen = np.maximum(-(to_light * normal).sum(axis=1), 0.0) * np.maximum(to_light[:, 2], 0.0) / d**4
        factor = shaped_by(light, to_light @ matrix[:3, 2] / d)[:, 0]
        assert lit(light, place)[0] / L[0] == pytest.approx((seen * factor).sum() / np.pi, rel=0.01)


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (0.0, 0.9, 0.436), (0.2, 0.9, -0.387)])
def test_a_near_triangle_at_the_dark_end_of_a_cone(normal: tuple) -> None:
    """The cone's axis meets it behind, and before its surface's horizon or at it; its middle is before the cone."""
    corners = np.array([[(-0.33, 1.641, 0.74), (-0.407, 0.152, -0.593), (1.025, -0.819, 0.41)]])
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.inv(looking(-np.array(normal)))[:3, :3]
    matrix[:3, 3] = (0.3, 0.2, 0.0)
    light = mesh(corners, matrix, cone_angle=np.radians(65), cone_softness=0.1, focus=1.0, focus_tint=(0.0, 0.0, 1.0))
    pieces = refined(corners, 8) @ matrix[:3, :3].T
    to_light = pieces.mean(axis=1)
    across = np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0]) / 2
    d = np.linalg.norm(to_light, axis=1)
    seen = np.maximum(-(to_light * across).sum(axis=1), 0.0) * np.maximum(to_light[:, 2], 0.0) / d**4
    expected = L * (shaped_by(light, to_light @ matrix[:3, 2] / d) * seen[:, None]).sum(axis=0) / np.pi
    np.testing.assert_allclose(lit(light, (0.3, 0.2)), expected, rtol=0.01)


@pytest.mark.parametrize("times", [0, 2, 4])
@pytest.mark.parametrize("tilt", [(1.0, 0.0, 0.0), (1.0, 0.0, 0.3)])
def test_what_is_below_the_horizon_gives_nothing(tilt: tuple, times: int) -> None:
    """A quad through the floor: clipped exactly, in clusters of 512 triangles within what docs say, and sampled."""
    matrix = looking(tilt, (-1.0, 0.1, 0.2)) @ np.diag([1.5, 1.5, 1.0, 1.0])
    light = mesh(refined(TRIANGLES, times), matrix, is_double_sided=True)
    place = (0.3, 0.1)
    quad = refined(TRIANGLES, 5)
    expected = L * quadrature(quad, matrix, place)
    assert expected[0] > 0.05
    np.testing.assert_allclose(lit(light, place), expected, rtol=5e-3)
    np.testing.assert_allclose(lit(light, place, light_samples=1024), expected, rtol=0.01)


@pytest.mark.parametrize("shaping", [{}, {"cone_angle": 1.1, "focus": 1.0}])
@pytest.mark.parametrize("is_double_sided", [False, True])
@pytest.mark.parametrize("samples", [0, 64])
def test_a_flat_light_gives_itself_nothing(shaping: dict, is_double_sided: bool, samples: int) -> None:
    """Its own plane is at the horizon of either of its sides, on whichever side of it rounding puts a point."""
    matrix = looking((1.0, 0.3, 0.7), (5.0, -3.0, 8.0)) @ np.diag([1.5, 1.2, 1.0, 1.0])
    plate = replace(
        square(whitted(diffuse=1.0)), points=RECT, faces=np.array([(0, 1, 2), (0, 2, 3)]), world_from_local=matrix
    )
    scene = scene_of(plate, lights=[mesh(TRIANGLES, matrix, is_double_sided=is_double_sided, **shaping)])
    for side in (1.0, -1.0):
        camera = parallel(matrix[:3, 3] + side * matrix[:3, 2], -side * matrix[:3, 2], half=0.4)
        film = render(scene, camera, width=32, height=32, light_samples=samples)
        assert film.alpha.min() == 1.0
        np.testing.assert_allclose(film.color, 0.0, atol=1e-3)  # samples near by are off the plane by rounding


@pytest.mark.parametrize(("roughness", "samples"), [(0.05, 0), (0.05, 64), (0.25, 0), (0.3, 256)])
def test_a_glowing_mesh_is_mirrored_or_highlighted_not_both(roughness: float, samples: int) -> None:
    """A metal under a glowing quad looks as under the rect that rays see, as the eye sees that in the mirror."""
    metal = preview(use_specular_workflow=True, specularColor=1.0, diffuseColor=0.0, roughness=roughness)
    matrix = looking((0, 0, -1), (0, 0, 2)) @ np.diag([4.0, 4.0, 1.0, 1.0])
    light = mesh(TRIANGLES, matrix, glows=True)
    glow = preview(diffuseColor=0.0, emissiveColor=tuple(L), specularColor=0.0, use_specular_workflow=True)
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    drawn = replace(square(glow), points=RECT, faces=faces, world_from_local=matrix)
    rect = Light("/rect", LightKind.RECT, matrix, light.radiance)
    camera = parallel((0.1, 0.0, 1.0))
    found = radiance(scene_of(square(metal), drawn, lights=[light]), camera, light_samples=samples)
    expected = radiance(scene_of(square(metal), lights=[rect]), camera, light_samples=samples, lights_visible=True)
    np.testing.assert_allclose(found, expected, rtol=0.02)


@pytest.mark.parametrize("samples", [0, 4096])
@pytest.mark.parametrize("height", [2.0, 0.3])
def test_a_closed_mesh_with_two_sides_is_seen_from_one(height: float, samples: int) -> None:
    """Outside, its inside is hidden, which only samples find out by their shadow rays; within, all around shines."""
    matrix = np.diag([1.0, 1.0, 1.0, 1.0])
    matrix[:3, 3] = (0, 0, height)
    triangles = ball(2)
    body = replace(
        square(whitted()),
        points=triangles.reshape(-1, 3),
        faces=np.arange(triangles.size // 3).reshape(-1, 3),
        world_from_local=matrix,
    )
    light = mesh(triangles, matrix, is_double_sided=True, is_closed=True)
    scene = scene_of(square(whitted(diffuse=1.0), half=20), body, lights=[light])
    is_within = height < 1
    camera = parallel((0.1, 0.2, 0.05)) if is_within else parallel((1.5, 0.4, 0.05))
    expected = L if is_within else L * quadrature(triangles, matrix, (1.5, 0.4))
    np.testing.assert_allclose(radiance(scene, camera, light_samples=samples), expected, rtol=0.02 if samples else 5e-3)


@pytest.mark.parametrize("samples", [0, 1024])
@pytest.mark.parametrize("place", PLACES)
def test_a_sphere_that_shines_is_a_sphere_light(place: tuple[float, float], samples: int) -> None:
    """Its triangles lie about the sphere that is drawn, which shadows none of those that face the place."""
    where = 'double3 xformOp:translate = (0, 0, 2)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    found = []
    kinds = ("Sphere", "LightAPI", "double radius"), ("SphereLight", "ShadowAPI", "float inputs:radius")
    for kind, api, radius in kinds:
        stage = Usd.Stage.CreateInMemory()
        lamp = f'def {kind} "L" (prepend apiSchemas = ["{api}"]) {{\n{radius} = 0.5\n{where}\n}}'
        stage.GetRootLayer().ImportFromString(f'#usda 1.0\n(upAxis = "Z")\n{lamp}\n{FLOOR}')
        found.append(radiance(load_scene(stage), parallel((*place, 0.1)), light_samples=samples))
    np.testing.assert_allclose(found[0], found[1], rtol=0.02 if samples else 2e-3)


@pytest.mark.parametrize("shaping", ["", "float inputs:shaping:focus = 2\nfloat inputs:shaping:cone:angle = 180"])
def test_many_points_are_balls(shaping: str) -> None:
    """E = sum of pi L r^2 cos / d^2, of balls above the horizon at any distance; focus is about -Z. One has no size."""
    random = np.random.default_rng(2)
    centers = random.uniform((-3, -3, 1), (3, 3, 2.5), (300, 3)).round(3)
    widths = random.uniform(0.01, 0.06, 300).round(3)
    widths[0] = 0.0
    points = f"point3f[] points = {[tuple(c) for c in centers.tolist()]}\nfloat[] widths = {widths.tolist()}"
    body = f"{points}\nfloat inputs:intensity = 5\nbool inputs:shadow:enable = 0\n{shaping}"
    stage = Usd.Stage.CreateInMemory()
    text = f'def Points "P" (prepend apiSchemas = ["LightAPI", "ShadowAPI"]) {{\n{body}\n}}'
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{FLOOR}\n{text}")
    scene = load_scene(stage)
    for place in PLACES:
        to_center = centers - (*place, 0.0)
        d = np.linalg.norm(to_center, axis=1)
        cosine = to_center[:, 2] / d
        factor = cosine**2 if shaping else 1.0
        expected = 5 * (np.pi * (widths / 2) ** 2 * factor * cosine / d**2).sum() / np.pi
        got = radiance(scene, parallel((*place, 0.5)))[0]
        assert got == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6])
def test_a_mesh_behind_itself_is_two_lights(roughness: float) -> None:
    """Without shadows both layers shine through: samples by the lobe, which meet the nearest alone, leave none out."""
    metal = preview(use_specular_workflow=True, specularColor=1.0, diffuseColor=0.1, roughness=roughness)
    # Both are seen from the mirrored direction's side, one in front of the other.
    high = TRIANGLES * np.float32(2) + np.float32([0, 0, 1])
    matrix = looking((0, 0, -1), (0, 0, 2))
    layers = [mesh(part, matrix, casts_shadow=False) for part in (TRIANGLES, high)]
    both = mesh(np.concatenate([TRIANGLES, high]), matrix, casts_shadow=False)
    camera = parallel((1.0, 0.2, 1.0), (-1.0, 0.0, -1.0))
    expected = sum(radiance(scene_of(square(metal), lights=[one]), camera, light_samples=4096) for one in layers)
    found = radiance(scene_of(square(metal), lights=[both]), camera, light_samples=4096)
    np.testing.assert_allclose(found, expected, rtol=0.02)


@pytest.mark.parametrize("kind", [LightKind.RECT, LightKind.SPHERE])
@pytest.mark.parametrize("height", [0.1, 2.0])
def test_negative_light_is_subtracted_sampled_or_not(kind: LightKind, height: float) -> None:
    """Also where the horizon cuts the light, so that as a whole it is a sum."""
    direction = (1, 0, 0) if kind == LightKind.RECT and height < 1 else (0, 0, -1)
    plus = lamp(kind, (-1.0, 0, height), L, direction=direction)
    minus = replace(plus, radiance=tuple(-L))
    for samples in (0, 16):
        expected = -lit(plus, (0.3, 0.1), light_samples=samples)
        assert (expected < 0).all()
        np.testing.assert_allclose(lit(minus, (0.3, 0.1), light_samples=samples), expected, rtol=1e-5)
