# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ray differentials, against neighbouring rays that are traced in float64."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import warp as wp

from warp_rt import Scene
from warp_rt.kernels.bvh_structs import Hit
from warp_rt.kernels.environment import latlong_differential, latlong_from_direction
from warp_rt.kernels.light_structs import DomeData
from warp_rt.kernels.ray_differential import bend_differential, coordinate_differential, reach_on_curve, set_footprint
from warp_rt.kernels.ray_structs import RayDifferential
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.kernels.surface import make_surface
from warp_rt.kernels.vector import face_forward
from warp_rt.scene import Instances, Material, MaterialModel, Mesh, Primvar, ShapeKind, Shapes
from warp_rt.upload.device_scene import upload_scene

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

ROOT = np.array((3.0, -4.0, 2.0))  # where the rays of all these tests start
STEP = 1e-5
SMALL = 1e-4  # size of the differentials that are followed: large ones are held back where surfaces curve
Trace = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""From origin and unit direction to the point that is met, the unit outward normal there, and st."""


@wp.kernel
def follow(
    scene: wp.array[SceneData],
    found: wp.vec3,
    origin: wp.vec3,
    direction: wp.vec3,
    ray: RayDifferential,
    eta: float,
    out: wp.array[wp.vec3],
):
    """Write the footprint of a ray on the only shape or triangle, and how the next direction and st change."""
    hit = Hit()
    hit.t = found[0]
    hit.u = found[1]
    hit.v = found[2]
    surface = make_surface(scene[0], hit, origin, direction)
    set_footprint(surface, ray, direction, hit.t)
    n = face_forward(surface.n_shading, -direction)
    st = coordinate_differential(scene[0], surface, 1, surface.dpdx)
    bend_differential(scene[0], ray, surface, direction, n, eta)
    out[0] = surface.dpdx
    out[1] = ray.direction_x
    out[2] = wp.vec3(st[0], st[1], 0.0)


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


def bent(direction: np.ndarray, normal: np.ndarray, eta: float) -> np.ndarray:
    """Return the mirrored (eta 0) or refracted direction, by the textbook."""
    n = normal if normal @ direction < 0 else -normal
    cosine = -n @ direction
    if eta == 0:
        return direction + 2 * cosine * n
    return eta * direction + (eta * cosine - np.sqrt(1 - eta**2 * (1 - cosine**2))) * n


def check(
    geometry: Mesh | Shapes, matrix: np.ndarray, trace: Trace, hit: tuple, target: np.ndarray, eta: float
) -> None:
    """Compare a ray to ``target`` and its differential with the change to a ray a small step aside."""
    row = np.zeros(1, np.int32)
    material = Material("/m", MaterialModel.WHITTED)
    scene = Scene((geometry,), Instances(row, matrix[None], row, row, row, row - 1), materials=(material,))
    data = upload_scene(scene, device="cpu").data
    aim, side = target - ROOT, np.array((0.3, 0.1, -0.4))  # the ray is ROOT + t (aim + x side), from ROOT + x shift
    shift = np.array((0.2, 0.0, 0.1))

    def ray_at(x: float) -> tuple[np.ndarray, np.ndarray]:
        return ROOT + x * shift, unit(aim + x * side)

    def state(x: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        origin, direction = ray_at(x)
        point, normal, st = trace(origin, direction)
        return point, bent(direction, normal, eta) if eta != 1 else direction, st

    expected = [(after - before) / (2 * STEP) for before, after in zip(state(-STEP), state(STEP), strict=True)]
    origin, direction = ray_at(0)
    ray = RayDifferential()
    ray.origin_x = wp.vec3(*(SMALL * shift))
    ray.direction_x = wp.vec3(*(SMALL * (ray_at(STEP)[1] - ray_at(-STEP)[1]) / (2 * STEP)))
    t = np.linalg.norm(trace(origin, direction)[0] - origin)
    out = wp.zeros(3, dtype=wp.vec3, device="cpu")
    table = wp.array([data], dtype=SceneData, device="cpu")
    inputs = [table, wp.vec3(t, *hit), wp.vec3(*origin), wp.vec3(*direction), ray, eta, out]
    wp.launch(follow, dim=1, inputs=inputs, device="cpu")
    position, bend, st = out.numpy() / SMALL
    np.testing.assert_allclose(position, expected[0], atol=1e-4 * np.linalg.norm(expected[0]))
    np.testing.assert_allclose(bend, expected[1], atol=1e-3 * np.linalg.norm(expected[1]))
    np.testing.assert_allclose(st[:2], expected[2], atol=1e-3 * np.linalg.norm(expected[2]))


PLACES = [
    np.diag((1.0, 1.0, 1.0, 1.0)),
    np.array([[1.2, 0.3, 0, 0.1], [0, -0.7, 0.2, 0], [0.1, 0, 0.9, 0.2], [0, 0, 0, 1]]),
]


def trace_quadric(matrix: np.ndarray, form: np.ndarray, coordinates: Callable[[np.ndarray], np.ndarray]) -> Trace:
    """Return the tracer of x' form x = 1 (a ball or an endless cylinder), placed by a matrix."""
    inverse = np.linalg.inv(matrix)

    def trace(origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        o, d = inverse[:3, :3] @ origin + inverse[:3, 3], inverse[:3, :3] @ direction
        a, b, c = d @ form @ d, o @ form @ d, o @ form @ o - 1
        p = o + d * (-b - np.sqrt(b * b - a * c)) / a
        return matrix[:3, :3] @ p + matrix[:3, 3], unit(inverse[:3, :3].T @ (form @ p)), coordinates(p)

    return trace


def turn(p: np.ndarray) -> float:
    return np.arctan2(p[1], p[0]) / (2 * np.pi) % 1.0


@pytest.mark.parametrize("eta", [0.0, 1.0, 1 / 1.5, 1.3])
@pytest.mark.parametrize("matrix", PLACES, ids=["plain", "placed"])
def test_ball(matrix: np.ndarray, eta: float) -> None:
    ball = Shapes(ShapeKind.SPHERE, np.zeros((1, 1, 3), np.float32), np.full((1, 1), 0.8, np.float32), has_st=True)
    trace = trace_quadric(matrix, np.eye(3) / 0.64, lambda p: np.array([turn(p), 0.5 + np.arcsin(p[2] / 0.8) / np.pi]))
    check(ball, matrix, trace, (0.0, 0.0), np.array((0.2, 0.1, 0.1)), eta)


@pytest.mark.parametrize("eta", [0.0, 1 / 1.5])
@pytest.mark.parametrize("matrix", PLACES, ids=["plain", "placed"])
@pytest.mark.parametrize("kind", [ShapeKind.FRUSTUM, ShapeKind.ROUND_CONE])
def test_cylinder(kind: ShapeKind, matrix: np.ndarray, eta: float) -> None:
    points = np.array([[(0, 0, -2), (0, 0, 3)]], np.float32)
    rod = Shapes(kind, points, np.full((1, 2), 0.6, np.float32), has_st=True)
    low, height = (-2.0, 5.0) if kind == ShapeKind.FRUSTUM else (-2.6, 6.2)
    trace = trace_quadric(matrix, np.diag((1, 1, 0)) / 0.36, lambda p: np.array([turn(p), (p[2] - low) / height]))
    check(rod, matrix, trace, (0.5, 0.0), np.array((0.2, 0.1, 0.3)), eta)


@pytest.mark.parametrize("eta", [0.0, 1 / 1.5])
@pytest.mark.parametrize("matrix", PLACES, ids=["plain", "placed"])
@pytest.mark.parametrize("is_smooth", [False, True])
def test_triangle(matrix: np.ndarray, is_smooth: bool, eta: float) -> None:
    corners = np.array([(-2.0, -1.0, 0.2), (2.5, -1.0, -0.3), (0.0, 2.5, 0.1)])
    normals = np.array([(-0.3, -0.2, 0.9), (0.4, -0.1, 0.9), (0.0, 0.3, 1.0)])
    st = np.array([(0.1, 0.2), (3.0, 0.5), (-1.0, 4.0)])
    faces = np.array([[0, 1, 2]], np.int32)
    mesh = Mesh(
        corners.astype(np.float32),
        faces,
        Primvar(normals.astype(np.float32), faces) if is_smooth else None,
        {"st": Primvar(st.astype(np.float32), faces)},
    )
    inverse = np.linalg.inv(matrix)
    placed = corners @ matrix[:3, :3].T + matrix[:3, 3]
    e1, e2 = placed[1] - placed[0], placed[2] - placed[0]

    def barycentrics(origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        return np.linalg.solve(np.stack([-direction, e1, e2], -1), origin - placed[0])

    def trace(origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        t, u, v = barycentrics(origin, direction)
        share = np.array((1 - u - v, u, v))
        flat = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        return origin + t * direction, unit(inverse[:3, :3].T @ (share @ normals if is_smooth else flat)), share @ st

    target = np.array((0.3, 0.2, 0.0))
    _, u, v = barycentrics(ROOT, unit(target - ROOT))
    check(mesh, matrix, trace, (u, v), target, eta)


def test_near_a_silhouette_a_step_reaches_as_far_as_the_surface_does() -> None:
    """On a circle of radius 1, from a ray that meets it h within its silhouette to one half a step of w further in."""
    w = 0.02
    for h in (0.5, 0.1, 0.01, 1e-4):
        cosine = np.sqrt(1 - (1 - h) ** 2)
        n, tangent = np.array((-cosine, 1 - h, 0.0)), np.array((1 - h, cosine, 0.0))
        share = reach_on_curve(wp.vec3(1.0, 0.0, 0.0), wp.vec3(*n), wp.vec3(*(tangent * w / cosine)))
        arc = np.arccos(1 - h - w / 2) - np.arccos(1 - h)
        assert share * w / cosine / 2 == pytest.approx(abs(arc), rel=0.15)


def test_direction_in_a_dome() -> None:
    """The image coordinates change with a direction as a small step says, near the pole and far from it."""
    dome = DomeData()
    dome.axis_x, dome.axis_y, dome.axis_z = wp.vec3(1.0, 0.0, 0.0), wp.vec3(0.0, 1.0, 0.0), wp.vec3(0.0, 0.0, 1.0)
    for direction in (unit(np.array(d)) for d in ((0.3, 0.2, 0.5), (-0.5, -0.6, 0.1), (0.04, 0.9, 0.05))):
        side = np.cross(direction, (0.4, -0.3, 0.8))
        got = latlong_differential(dome, wp.vec3(*direction), wp.vec3(*side))
        ends = [latlong_from_direction(dome, wp.vec3(*unit(direction + x * side))) for x in (-1e-3, 1e-3)]
        step = (np.array(ends[1]) - np.array(ends[0])) / 2e-3
        np.testing.assert_allclose(np.array(got), step, rtol=5e-3, atol=1e-3)
