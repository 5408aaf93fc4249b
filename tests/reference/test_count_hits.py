# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Numbers of surfaces that rays cross: against float64 without a hierarchy, and by what closed meshes allow."""

from __future__ import annotations

import numpy as np
import pytest

import warp_rt
from warp_rt.errors import OptionError
from warp_rt.options import BUILDERS, INTERSECTORS
from warp_rt.scene import Scene

from ..meshes import Shape, cube, octasphere, soup, torus
from .test_queries import flatten, instanced_scene, rays_at

RAYS = 400


def count_all(shape: Shape, origins: np.ndarray, directions: np.ndarray, t_max: float) -> tuple[np.ndarray, np.ndarray]:
    """Return how many triangles each ray meets, and which rays pass an edge or an end so closely that it is unclear.

    By signed volumes, not by the tests of the kernels.
    """
    p = shape[0][shape[1]].astype(float)
    counts = np.zeros(len(origins), int)
    is_unclear = np.zeros(len(origins), bool)
    for k, (o, d) in enumerate(zip(origins.astype(float), directions.astype(float), strict=True)):
        a, b, c = (p - o).swapaxes(0, 1)
        volumes = np.stack([np.cross(c, b) @ d, np.cross(a, c) @ d, np.cross(b, a) @ d])
        total = volumes.sum(axis=0)
        weights = volumes / np.where(total == 0, np.nan, total)
        t = (np.cross(b - a, c - a) * a).sum(axis=1) / (np.cross(b - a, c - a) @ d)
        counts[k] = ((weights.min(axis=0) >= 0) & (t >= 0) & (t < t_max)).sum()
        is_close = (np.abs(weights.min(axis=0)) < 1e-4) & (t > -1e-3) & (t < t_max * 1.001)
        is_end = (weights.min(axis=0) > -1e-4) & (np.minimum(np.abs(t), np.abs(t - t_max)) < 1e-4 * max(1, t_max))
        is_unclear[k] = (is_close | (is_end if np.isfinite(t_max) else np.abs(t) < 1e-4)).any()
    return counts, is_unclear


@pytest.mark.parametrize("intersector", INTERSECTORS)
@pytest.mark.parametrize("t_max", [np.inf, 1.0])
@pytest.mark.parametrize("shape", [soup(300, 1), octasphere(3), torus()], ids=["soup", "sphere", "torus"])
def test_every_triangle_counts_once(shape: Shape, t_max: float, intersector: str) -> None:
    shape = shape[0].astype(np.float32), shape[1]
    origins, directions = rays_at(shape, RAYS, seed=3)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        expected, is_unclear = count_all(shape, origins, directions, t_max)
    assert is_unclear.mean() < 0.3
    assert len(np.unique(expected)) > 2
    for bvh in BUILDERS:
        accel = warp_rt.build_accel(Scene.from_arrays(*shape), bvh=bvh, intersector=intersector)
        counts = warp_rt.count_hits(accel, origins, directions, t_max)
        assert counts.dtype == np.int32
        np.testing.assert_array_equal(counts[~is_unclear], expected[~is_unclear])


def test_instances_count_too() -> None:
    scene = instanced_scene(4)
    points, triangles, _, _ = flatten(scene)
    origins, directions = rays_at((points, triangles), RAYS, seed=5)
    with np.errstate(divide="ignore", invalid="ignore"):
        expected, is_unclear = count_all((points, triangles), origins, directions, np.inf)
    counts = warp_rt.count_hits(warp_rt.build_accel(scene), origins, directions)
    assert expected.max() > 5
    np.testing.assert_array_equal(counts[~is_unclear], expected[~is_unclear])


@pytest.mark.parametrize("shape", [cube(), octasphere(5), torus(48, 24)], ids=["cube", "sphere", "torus"])
def test_parity_tells_inside_from_outside(shape: Shape) -> None:
    """Out of a closed mesh there is an odd number of surfaces to cross, past it an even one."""
    accel = warp_rt.build_accel(Scene.from_arrays(*shape))
    rng = np.random.default_rng(6)
    origins, directions = rng.uniform(-1.6, 1.6, (20_000, 3)), rng.normal(size=(20_000, 3))
    x, y, z = origins.T
    faces = len(shape[1])
    if faces == 12:
        is_inside, is_outside = np.abs(origins).max(axis=1) < 1, np.abs(origins).max(axis=1) > 1
    else:
        radius = np.hypot(x, y)
        distance = np.sqrt(x * x + y * y + z * z) if faces > 5000 else np.hypot(radius - 1, z) / 0.35
        is_inside, is_outside = distance < 0.97, distance > 1
    counts = warp_rt.count_hits(accel, origins, directions)
    assert is_inside.sum() > 500
    assert (counts[is_inside] % 2 == 1).all()
    assert (counts[is_outside] % 2 == 0).all()


def test_all_triangles_at_an_edge_or_a_vertex_count() -> None:
    sphere, box = (warp_rt.build_accel(Scene.from_arrays(*shape)) for shape in (octasphere(2), cube()))
    assert warp_rt.count_hits(sphere, np.zeros((1, 3)), [[0, 0, 1.0]]).tolist() == [4]  # a vertex of four triangles
    # x = y is the diagonal that splits the upper face, where products of equal numbers are equal after rounding too
    assert warp_rt.count_hits(box, np.zeros((2, 3)), [[0.3, 0.3, 1], [0.3, -0.3, 1]]).tolist() == [2, 1]


def test_rays_that_are_none_count_nothing() -> None:
    accel = warp_rt.build_accel(Scene.from_arrays(*octasphere(2)))
    directions = np.array([[np.nan, 0, 0], [np.inf, 0, 0], [0, 0, 0], [0.3, 0.2, 0.1]])
    assert warp_rt.count_hits(accel, np.zeros((4, 3)), directions).tolist() == [0, 0, 0, 1]
    assert warp_rt.count_hits(accel, np.zeros((4, 3)), directions, t_max=np.nan).tolist() == [0, 0, 0, 0]
    empty = warp_rt.build_accel(Scene.from_arrays(np.zeros((0, 3)), np.zeros((0, 3), int)))
    assert warp_rt.count_hits(empty, np.zeros((4, 3)), directions).tolist() == [0, 0, 0, 0]


def test_it_is_called_like_any_hit() -> None:
    accel = warp_rt.build_accel(Scene.from_arrays(*octasphere(3)))
    origins, directions = rays_at(octasphere(3), 20_000, seed=7)
    expected = warp_rt.count_hits(accel, origins, directions, threads=1)
    out = np.empty(len(origins), np.int32)
    assert warp_rt.count_hits(accel, origins, directions, threads=3, out=out) is out
    np.testing.assert_array_equal(out, expected)
    np.testing.assert_array_equal(expected > 0, warp_rt.any_hit(accel, origins, directions))
    with pytest.raises(OptionError, match="int32"):
        warp_rt.count_hits(accel, origins, directions, out=np.empty(len(origins)))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("builder", BUILDERS)
def test_rays_along_an_axis_meet_a_sheet_up_to_its_rim(builder: str, axis: int) -> None:
    """A flat grid of 4 x 4 squares, whose rim lies in planes of boxes: each vertex counts all triangles around it."""
    steps = np.arange(5)
    u, v = (values.reshape(-1) for values in np.meshgrid(steps, steps, indexing="ij"))
    points = np.zeros((25, 3))
    points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = u / 4, v / 4
    low = (5 * u + v).reshape(5, 5)[:-1, :-1].reshape(-1)
    triangles = np.concatenate([np.stack([low, low + 5, low + 6], 1), np.stack([low, low + 6, low + 1], 1)])
    accel = warp_rt.build_accel(Scene.from_arrays(points, triangles), bvh=builder)
    for sign in (1.0, -1.0):
        directions = np.zeros((25, 3))
        directions[:, axis] = sign
        origins = points - 3 * directions
        around = np.bincount(triangles.reshape(-1), minlength=25)
        np.testing.assert_array_equal(warp_rt.count_hits(accel, origins, directions), around)
        assert warp_rt.any_hit(accel, origins, directions).all()
        assert (warp_rt.closest_hit(accel, origins, directions).t == 3).all()
