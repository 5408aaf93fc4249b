# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays through trees of shapes against float64 brute force: near, from inside, tangent, far off, tiny, and sheared."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import any_hit, build_accel, closest_hit, count_hits
from warp_rt.options import BUILDERS
from warp_rt.scene import SHAPE_POINTS, Instances, Material, MaterialModel, Mesh, Scene, ShapeKind, Shapes

from ..shapes_float64 import crossings, first_hits

RAYS = 500
KINDS = pytest.mark.parametrize("kind", list(ShapeKind), ids=lambda kind: kind.name.lower())


def scatter(kind: ShapeKind, count: int, seed: int, **more: object) -> Shapes:
    rng = np.random.default_rng(seed)
    k = SHAPE_POINTS[kind]
    points = rng.uniform(-1, 1, (count, 1, 3)) + 0.3 * rng.normal(size=(count, k, 3))
    radii = rng.uniform(0.01, 0.15, (count, k)) * (3 if kind == ShapeKind.SPHERE else 1)
    return Shapes(kind, points.astype(np.float32), radii.astype(np.float32), **more)


def scene_of(shapes: Shapes, matrices: np.ndarray | None = None) -> Scene:
    matrices = np.eye(4)[None] if matrices is None else matrices
    row = np.zeros(len(matrices), np.int32)
    instances = Instances(row, matrices, row, row[:1], row, row - 1)
    return Scene((shapes,), instances, prims=("/s",), materials=(Material("/m", MaterialModel.WHITTED),))


def rays(seed: int, distance: float, count: int = RAYS) -> tuple[np.ndarray, np.ndarray]:
    """Return rays from a sphere about the shapes towards them; at a distance of 0, from among them."""
    rng = np.random.default_rng(seed)
    targets = rng.uniform(-1, 1, (count, 3))
    origins = rng.normal(size=(count, 3))
    origins *= distance / np.linalg.norm(origins, axis=1, keepdims=True)
    if not distance:
        origins = rng.uniform(-1, 1, (count, 3))
    return origins.astype(np.float32), (targets - origins).astype(np.float32)


def compare(shapes: Shapes, origins: np.ndarray, directions: np.ndarray, error: float, **options: object) -> None:
    """Assert that hits agree where a change of the radii by ``error`` changes nothing, and distances to within it."""
    accel = build_accel(scene_of(shapes), device="cpu", **options)
    hits = closest_hit(accel, origins, directions)
    o, d = origins.astype(float), directions.astype(float)
    t, row = first_hits(shapes, o, d)
    is_sure = np.ones(len(o), bool)
    for growth in (1 - error / shapes.radii.min(), 1 + error / shapes.radii.min()):
        is_sure &= first_hits(shapes, o, d, growth)[1] == row
    assert is_sure.mean() > 0.97
    assert (row >= 0).mean() > 0.05
    np.testing.assert_array_equal(hits.triangle[is_sure], row[is_sure])
    np.testing.assert_array_equal(any_hit(accel, origins, directions)[is_sure], row[is_sure] >= 0)
    is_hit = is_sure & (row >= 0)
    off = np.abs(hits.t - t)[is_hit] * np.linalg.norm(d, axis=1)[is_hit]
    # Where a ray runs flat along a surface, an error across it is many times as great along the ray.
    assert np.percentile(off, 95) < 5 * error
    assert off.max() < 30 * np.sqrt(error * shapes.radii.max())


@KINDS
@pytest.mark.parametrize("distance", [0.0, 3.0])
def test_rays_meet_what_float64_says(kind: ShapeKind, distance: float) -> None:
    is_solid = kind < ShapeKind.LINEAR_TUBE
    if not is_solid and not distance:
        pytest.skip("from inside, a tube is not met, but the next one is: there is nothing to compare with")
    compare(scatter(kind, 12, 1, is_closed=is_solid), *rays(2, distance), error=1e-6)


@KINDS
def test_shapes_far_away_keep_their_digits(kind: ShapeKind) -> None:
    """1e4 times the radius: float32 directions themselves are off by 6e-8 of that."""
    compare(scatter(kind, 12, 3), *rays(4, 1e3), error=2e-4)


@pytest.mark.parametrize("bvh", BUILDERS)
@KINDS
def test_every_builder(kind: ShapeKind, bvh: str) -> None:
    compare(scatter(kind, 12, 5), *rays(6, 3.0, 300), error=1e-6, bvh=bvh)


@KINDS
def test_every_crossing_is_counted(kind: ShapeKind) -> None:
    shapes = scatter(kind, 12, 17)
    origins, directions = rays(18, 3.0)
    found = count_hits(build_accel(scene_of(shapes), device="cpu"), origins, directions, t_max=np.float32(0.9))
    expected = np.zeros((3, RAYS), int)
    for k, growth in enumerate((1 - 1e-4, 1, 1 + 1e-4)):
        for row in range(12):
            t = crossings(shapes, row, origins.astype(float), directions.astype(float), growth)
            expected[k] += ((t >= 0) & (t < 0.9)).sum(axis=1)
    # A tube that bends back is entered more than once, of which float64 looks for the first.
    is_sure = (expected == expected[1]).all(axis=0)
    assert is_sure.mean() > 0.9
    if kind == ShapeKind.CUBIC_TUBE:
        np.testing.assert_array_equal(found[is_sure] > 0, expected[1, is_sure] > 0)
        assert (found[is_sure] >= expected[1, is_sure]).all()
    else:
        np.testing.assert_array_equal(found[is_sure], expected[1, is_sure])


@pytest.mark.parametrize("caps", [(False, False), (True, False), (False, True)])
def test_frusta_are_open_where_they_have_no_cap(caps: tuple[bool, bool]) -> None:
    compare(scatter(ShapeKind.FRUSTUM, 12, 7, caps=caps), *rays(8, 3.0), error=1e-6)
    compare(scatter(ShapeKind.FRUSTUM, 12, 7, caps=caps), *rays(9, 0.0), error=1e-6)


@KINDS
@pytest.mark.parametrize("size", [1e-12, 1e12])
def test_size_does_not_matter(kind: ShapeKind, size: float) -> None:
    """Powers of two apart, rounding is the same: t is then the same to the last bit, or nearly."""
    size = 2.0 ** np.round(np.log2(size))
    shapes = scatter(kind, 12, 10)
    origins, directions = rays(11, 3.0)
    hits = closest_hit(build_accel(scene_of(shapes), device="cpu"), origins, directions)
    scaled = Shapes(kind, np.float32(shapes.points * size), np.float32(shapes.radii * size))
    found = closest_hit(
        build_accel(scene_of(scaled), device="cpu"), np.float32(origins * size), np.float32(directions * size)
    )
    np.testing.assert_array_equal(found.triangle, hits.triangle)
    is_hit = hits.triangle >= 0
    np.testing.assert_allclose(found.t[is_hit], hits.t[is_hit], rtol=1e-5)


@KINDS
def test_instances_of_every_transform(kind: ShapeKind) -> None:
    """Sheared and mirrored: the ray is brought into the shape's space, so that is where float64 looks, too."""
    rng = np.random.default_rng(12)
    shapes = scatter(kind, 6, 13)
    matrices = np.tile(np.eye(4), (5, 1, 1))
    matrices[:, :3, :3] = rng.normal(size=(5, 3, 3)) + np.eye(3)
    matrices[:, :3, 3] = 4 * np.arange(-2, 3)[:, None] * [1, 0.2, 0.1]
    chosen = matrices[rng.integers(0, 5, RAYS)]
    targets = np.einsum("nij,nj->ni", chosen[:, :3, :3], rng.uniform(-1, 1, (RAYS, 3))) + chosen[:, :3, 3]
    origins = (targets + 30 * rng.normal(size=(RAYS, 3))).astype(np.float32)
    directions = (targets - origins).astype(np.float32)
    hits = closest_hit(build_accel(scene_of(shapes, matrices), device="cpu"), origins, directions)
    best, instance = np.full(RAYS, np.inf), np.full(RAYS, -1)
    is_sure = np.ones(RAYS, bool)
    for k, matrix in enumerate(matrices):
        inverse = np.linalg.inv(matrix)
        o, d = origins @ inverse[:3, :3].T + inverse[:3, 3], directions @ inverse[:3, :3].T
        t = first_hits(shapes, o, d)[0]
        for growth in (0.999, 1.001):
            is_sure &= np.isfinite(first_hits(shapes, o, d, growth)[0]) == np.isfinite(t)
        best, instance = np.where(t < best, t, best), np.where(t < best, k, instance)
    assert (instance >= 0).sum() > 20
    np.testing.assert_array_equal(hits.instance[is_sure], instance[is_sure])
    is_hit = is_sure & (instance >= 0)
    np.testing.assert_allclose(hits.t[is_hit], best[is_hit], rtol=1e-3)


@KINDS
def test_rays_past_shapes_keep_the_triangle_that_they_meet(kind: ShapeKind) -> None:
    """P = (1 - u - v) p0 + u p1 + v p2 holds after a shape in front of, or beside, the triangle has been tested."""
    corners = np.random.default_rng(14).uniform(-2, 2, (12, 3, 3)).astype(np.float32)
    soup = Mesh(corners.reshape(-1, 3), np.arange(36, dtype=np.int32).reshape(-1, 3))
    rows = np.zeros(2, np.int32)
    instances = Instances(np.int32([0, 1]), np.tile(np.eye(4), (2, 1, 1)), rows, rows[:1], rows, rows - 1)
    scene = Scene((soup, scatter(kind, 20, 15)), instances, prims=("/s",))
    origins, directions = rays(16, 4.0, 4_000)
    hits = closest_hit(build_accel(scene, device="cpu"), origins, directions)
    is_triangle = hits.instance == 0
    assert is_triangle.sum() > 200
    assert (hits.instance == 1).sum() > 200
    u, v, t = (values[is_triangle][:, None] for values in (hits.u, hits.v, hits.t))
    p0, p1, p2 = (corners[hits.triangle[is_triangle], k] for k in range(3))
    expected = origins[is_triangle] + t * directions[is_triangle]
    np.testing.assert_allclose((1 - u - v) * p0 + u * p1 + v * p2, expected, atol=1e-5)


def test_where_along_a_shape_a_hit_is() -> None:
    """u runs from the first control point to the last; v is a frustum's part: side, first cap, last cap."""
    ends = np.array([[(0, 0, 0), (0, 0, 4)]], np.float32)
    frustum = Shapes(ShapeKind.FRUSTUM, ends, np.ones((1, 2), np.float32))
    origins, directions = [(5, 0, 1), (0, 0, -3), (0, 0, 9)], [(-1, 0, 0), (0, 0, 1), (0, 0, -1)]
    hits = closest_hit(build_accel(scene_of(frustum), device="cpu"), origins, directions)
    np.testing.assert_allclose(hits.u, [0.25, 0, 1], atol=1e-6)
    np.testing.assert_array_equal(hits.v, [0, 1, 2])
    line = np.array([[(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)]], np.float32)
    tube = Shapes(ShapeKind.CUBIC_TUBE, line, np.full((1, 4), 0.1, np.float32), is_closed=False)
    hits = closest_hit(build_accel(scene_of(tube), device="cpu"), [(0.75, 0, 5)], [(0, 0, -1)])
    np.testing.assert_allclose(hits.u, [0.25], atol=1e-3)
    np.testing.assert_array_equal(hits.v, [0])


def test_meshes_and_shapes_stand_in_one_scene() -> None:
    square = Mesh(np.float32([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]), np.int32([[0, 1, 2], [0, 2, 3]]))
    ball = Shapes(ShapeKind.SPHERE, np.float32([[[0, 0, 0]]]), np.float32([[1]]))
    matrices = np.tile(np.eye(4), (3, 1, 1))
    matrices[1, 2, 3] = 5
    matrices[2, :2, 3] = 1.5
    rows = np.zeros(3, np.int32)
    instances = Instances(np.int32([0, 1, 1]), matrices, rows, rows[:1], rows, rows - 1)
    scene = Scene((square, ball), instances, prims=("/s",), materials=(Material("/m", MaterialModel.WHITTED),))
    origins = np.float32([[0, 0, 9], [1.5, 1.5, 9], [-1.5, -1.5, 9], [9, 9, 9]])
    hits = closest_hit(build_accel(scene, device="cpu"), origins, np.tile(np.float32([0, 0, -1]), (4, 1)))
    np.testing.assert_array_equal(hits.instance, [1, 2, 0, -1])
    np.testing.assert_allclose(hits.t[:3], [3, 8, 9])
