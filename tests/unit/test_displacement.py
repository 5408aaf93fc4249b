# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Displaced meshes: where their points and normals go, in closed form, and that no seam opens."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt.scene import Image, Input, Mesh, Primvar, Texture, Wrap, is_closed
from warp_rt.scene.displacement import Displacement, displaced
from warp_rt.usd.volumes import encloses_volume

from ..meshes import octasphere

ONE = Displacement(Input((1.0, 0.0, 0.0, 0.0)))


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the points and triangles of the unit square in n x n cells."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    low = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1)
    lower, upper = (low, low + 1, low + n + 2), (low, low + n + 2, low + n + 1)
    return points, np.concatenate([np.stack(lower, 1), np.stack(upper, 1)]).astype(np.int32)


def split_box() -> Mesh:
    """Return a cube of 24 points, 4 a face, each face 4 x 4 cells with normals and texture coordinates of its own."""
    square, cells = grid(4)
    points, triangles, normals, st = [], [], [], []
    for axis in range(3):
        for side in (0, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            face = np.zeros_like(square)
            face[:, u], face[:, v], face[:, axis] = square[:, 0], square[:, 1], side
            triangles.append((cells if side else cells[:, ::-1]) + sum(map(len, points)))
            points.append(face * 2 - 1)
            normals.append(np.tile(np.eye(3)[axis] * (2 * side - 1), (len(square), 1)))
            st.append(square[:, :2] * 0.3 + 0.1 * len(points))
    rows = np.concatenate(triangles)
    return Mesh(
        np.concatenate(points).astype(np.float32),
        rows,
        Primvar(np.concatenate(normals).astype(np.float32), rows),
        {"st": Primvar(np.concatenate(st).astype(np.float32), rows)},
        is_closed=True,
    )


def noise() -> tuple[tuple[Texture, ...], tuple[Image, ...]]:
    pixels = np.random.default_rng(5).integers(0, 256, (9, 11, 4)).astype(np.uint8)
    return (Texture(0, wrap_s=Wrap.REPEAT, wrap_t=Wrap.REPEAT),), (Image("noise", pixels),)


TEXTURED = Displacement(Input(texture=0, channel=0), 0.2)


def test_a_sphere_grows() -> None:
    points, triangles = octasphere(4)
    mesh = Mesh(points.astype(np.float32), triangles, Primvar(points.astype(np.float32), triangles))
    grown = displaced(mesh, [Displacement(Input((0.5, 0, 0, 0)), 0.5)], {}, (), ())
    np.testing.assert_allclose(grown.points, 1.25 * points, atol=1e-6)
    corners = grown.normals.values[grown.normals.indices]
    np.testing.assert_allclose(corners, points[triangles], atol=0.1**2)  # of facets 0.1 wide
    np.testing.assert_allclose(np.linalg.norm(grown.normals.values, axis=1), 1, atol=1e-6)


def test_normals_of_a_height_field_are_those_of_its_gradient() -> None:
    points, triangles = grid(64)
    x, y = points[:, 0], points[:, 1]
    height = np.sin(3 * x) * np.cos(2 * y)
    up = Primvar(np.array([[0, 0, 1]], np.float32), np.zeros_like(triangles))
    mesh = Mesh(
        points.astype(np.float32), triangles, up, {"height": Primvar(height[:, None].astype(np.float32), triangles)}
    )
    field = displaced(mesh, [Displacement(Input(primvar="height", channel=0), 0.25)], {}, (), ())
    np.testing.assert_allclose(field.points, np.column_stack([x, y, 0.25 * height]), atol=1e-6)
    gradient = 0.25 * np.column_stack([3 * np.cos(3 * x) * np.cos(2 * y), -2 * np.sin(3 * x) * np.sin(2 * y)])
    expected = np.column_stack([-gradient, np.ones(len(x))])
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    inside = ((x > 0) & (x < 1) & (y > 0) & (y < 1))[triangles].all(axis=1)
    found = field.normals.values[field.normals.indices]
    # Central differences over cells of 1/64: an error of h^2 / 6 times the third derivative.
    np.testing.assert_allclose(found[inside], expected[triangles][inside], atol=1e-3)


@pytest.mark.parametrize("has_normals", [True, False])
def test_no_seam_opens(has_normals: bool) -> None:
    """Points cut apart by normals and texture coordinates stay together at every edge and corner of a cube."""
    mesh = split_box()
    if not has_normals:
        mesh = Mesh(mesh.points, mesh.triangles, None, mesh.primvars, is_closed=True)
    assert not is_closed(mesh.triangles)
    moved = displaced(mesh, [TEXTURED], {}, *noise())
    assert np.ptp(np.abs(moved.points).max(axis=1)) > 0.05
    assert encloses_volume(moved.points, moved.triangles)
    assert (moved.normals is None) == (not has_normals)


def test_corners_move_along_the_mean_normal_and_creases_stay() -> None:
    moved = displaced(split_box(), [ONE], {}, (), ())
    corner = np.abs(split_box().points).min(axis=1) == 1
    np.testing.assert_allclose(moved.points[corner], split_box().points[corner] * (1 + 1 / np.sqrt(3)), rtol=1e-6)
    (rows,) = np.nonzero(corner)
    normals = moved.normals.values[moved.normals.indices]
    for row in rows:  # each face's own normal still, bent by its own triangles alone
        at = normals[moved.triangles == row]
        assert len(np.unique(at, axis=0)) == 1


def test_sheets_back_to_back_part() -> None:
    points, triangles = grid(2)
    both = np.concatenate([points, points]).astype(np.float32)
    mesh = Mesh(both, np.concatenate([triangles, triangles[:, ::-1] + len(points)]).astype(np.int32))
    moved = displaced(mesh, [ONE], {}, (), ())
    np.testing.assert_allclose(moved.points[:, 2], np.repeat([1.0, -1.0], len(points)))


def test_sheets_of_single_triangles_stay_where_they_cannot_part() -> None:
    """At an inner point of a bent sheet two sides of two faces each cancel: rounding moves nothing."""
    points = np.array([(0, 0, 0), (1, 0, 0.3), (0.7, 1, 0.1), (-1, 1, 0.2), (-1, -1, 0.7), (1, -1, 0.4)])
    fan = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5), (0, 5, 1)])
    corners = points[np.concatenate([fan, fan[:, [0, 2, 1]]])].reshape(-1, 3).astype(np.float32)
    mesh = Mesh(corners, np.arange(len(corners), dtype=np.int32).reshape(-1, 3))
    np.testing.assert_array_equal(displaced(mesh, [ONE], {}, (), ()).points[::3], np.zeros((10, 3)))


@pytest.mark.parametrize("thickness", [1, 0.3, 0.1, 0.01])
def test_no_blade_opens(thickness: float) -> None:
    """Single triangles of a body stay together however sharp its edges are, and wherever most faces of a point look."""
    for seed in range(10):
        points, triangles = octasphere(3)
        jitter = np.random.default_rng(seed).uniform(0.6, 1.4, (len(points), 1))
        body = (points * jitter * (1, 1, thickness)).astype(np.float32)
        mesh = Mesh(body[triangles].reshape(-1, 3), np.arange(triangles.size, dtype=np.int32).reshape(-1, 3))
        moved = displaced(mesh, [Displacement(Input((0.01, 0, 0, 0)))], {}, (), ()).points
        np.testing.assert_array_equal(np.unique(moved, axis=0).shape, points.shape)
        assert encloses_volume(moved, mesh.triangles)


def test_slots_move_apart_or_not_at_all_and_meet_half_way() -> None:
    points, triangles = grid(2)
    slots = (points[triangles].mean(axis=1)[:, 0] > 0.5).astype(np.int32)
    mesh = Mesh(points.astype(np.float32), triangles, material_slots=slots)
    moved = displaced(mesh, [None, ONE], {}, (), ())
    heights = {x: moved.points[moved.points[:, 0] == x, 2] for x in (0, 0.5, 1)}
    np.testing.assert_allclose(heights[0], 0)
    np.testing.assert_allclose(heights[1], 1)
    assert ((heights[0.5] > 0.3) & (heights[0.5] < 0.7)).all()


@pytest.mark.parametrize(
    ("primvars", "constants", "height"),
    [({}, {}, 0.25), ({}, {"h": 0.5}, 0.5), ({"h": 0.75}, {"h": 0.5}, 0.75)],
)
def test_own_primvars_precede_inherited_ones_and_those_the_fallback(
    primvars: dict[str, float], constants: dict[str, float], height: float
) -> None:
    points, triangles = grid(1)
    own = {name: Primvar(np.array([[value]], np.float32)) for name, value in primvars.items()}
    inherited = {name: np.array([value], np.float32) for name, value in constants.items()}
    mesh = Mesh(points.astype(np.float32), triangles, primvars=own)
    port = Input((0.25, 0.0, 0.0, 0.0), primvar="h", channel=0)
    np.testing.assert_allclose(displaced(mesh, [Displacement(port)], inherited, (), ()).points[:, 2], height)


def test_heights_beyond_all_bounds_do_no_harm() -> None:
    points, triangles = grid(1)
    mesh = Mesh(points.astype(np.float32), triangles)
    moved = displaced(mesh, [Displacement(Input((3e38, 0, 0, 0)), 1e30)], {}, (), ())
    assert np.isfinite(moved.points).all()


def test_points_of_no_triangle_stay() -> None:
    """The first and the last; one where another is used goes with it."""
    square, triangles = grid(1)
    points = np.concatenate([[[9, 9, 9]], square, [[8, 8, 8]], square[:1]]).astype(np.float32)
    moved = displaced(Mesh(points, triangles + 1), [ONE], {}, (), ()).points
    np.testing.assert_array_equal(moved[1:5], square + np.array([0, 0, 1]))
    np.testing.assert_array_equal(moved[[0, 5]], points[[0, 5]])


def test_collapsed_faces_keep_a_normal() -> None:
    """A sphere displaced into its centre."""
    points, triangles = octasphere(1)
    mesh = Mesh(points.astype(np.float32), triangles, Primvar(points.astype(np.float32), triangles))
    moved = displaced(mesh, [Displacement(Input((-1.0, 0, 0, 0)))], {}, (), ())
    np.testing.assert_allclose(moved.points, 0, atol=1e-6)
    assert (np.linalg.norm(moved.normals.values, axis=1) > 0.5).all()
