# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Triangles of mesh lights: their irradiance above a horizon, and the pieces that shaped ones are cut into."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.light_structs import LightTriangle
from warp_rt.kernels.light_triangle import VisiblePart, triangle_irradiance
from warp_rt.kernels.triangle_pieces import ball_square, piece_of
from warp_rt.warp_setup import init_warp

init_warp()


@wp.kernel
def cut(triangles: wp.array[LightTriangle], pieces: wp.array[LightTriangle], sizes: wp.array[float]):
    """Cut each triangle into the pieces of a level, whose numbers begin with how many there are."""
    i, k = wp.tid()
    count = pieces.shape[0] / triangles.shape[0]
    row = i * count + k
    pieces[row] = piece_of(triangles[i], count + k)
    sizes[row] = ball_square(pieces[row])


@wp.kernel
def shine(triangles: wp.array[LightTriangle], n: wp.vec3, parts: wp.array[VisiblePart]):
    """Sum up what each triangle sends to the origin."""
    i = wp.tid()
    parts[i] = triangle_irradiance(triangles[i], n)


def upload(corners: np.ndarray) -> wp.array:
    table = np.zeros(len(corners), LightTriangle.numpy_dtype())
    table["origin"], sides = corners[:, 0], corners[:, 1:] - corners[:, :1]
    table["side_x"], table["side_y"] = sides[:, 0], sides[:, 1]
    return wp.array(table, dtype=LightTriangle, device="cpu")


@pytest.mark.parametrize("level", [0, 1, 4, 7])
def test_pieces_of_a_level_make_up_the_triangle(level: int) -> None:
    """Each has its share of the area, wound alike, lies within, and they get smaller however long the triangle is."""
    corners = np.random.default_rng(7).normal(size=(20, 3, 3))
    corners[0, 2] = corners[0, 0] + 0.01  # long and thin
    pieces = wp.zeros(20 << level, dtype=LightTriangle, device="cpu")
    sizes = wp.zeros(20 << level, dtype=float, device="cpu")
    wp.launch(cut, (20, 1 << level), [upload(corners), pieces, sizes], device="cpu")
    rows = pieces.numpy().reshape(20, -1)
    own = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.cross(rows["side_x"], rows["side_y"])
    np.testing.assert_allclose(areas, np.repeat(own[:, None] / 2**level, 2**level, axis=1), atol=1e-5)
    middles = rows["origin"] + (rows["side_x"] + rows["side_y"]) / 3
    np.testing.assert_allclose(middles.mean(axis=1), corners.mean(axis=1), atol=1e-5)
    weights = np.linalg.solve(np.swapaxes(corners, 1, 2)[:, None], middles[..., None])[..., 0]
    assert weights.min() > -1e-3
    longest = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
    reach = np.sqrt(sizes.numpy().reshape(20, -1).max(axis=1))
    assert (reach <= longest * 0.5 ** (level // 2)).all()  # two cuts halve the longest side


@pytest.mark.parametrize("distance", [1.5, 30.0, 3000.0])
def test_irradiance_above_the_horizon(distance: float) -> None:
    """Triangles as large as they are far, and so small that Lambert's sum cancels; the horizon cuts many."""
    rng = np.random.default_rng(5)
    middle = rng.normal(size=(60, 3))
    middle *= distance / np.linalg.norm(middle, axis=1)[:, None]
    corners = middle[:, None] + rng.normal(size=(60, 3, 3)) * 0.5
    corners[30:, :, 2] -= middle[30:, None, 2]  # about the horizon
    parts = wp.zeros(60, dtype=VisiblePart, device="cpu")
    wp.launch(shine, 60, [upload(corners), wp.vec3(0.0, 0.0, 1.0), parts], device="cpu")
    count = 240
    a, b = ((q + 1 / 3).reshape(-1) / count for q in np.meshgrid(np.arange(count), np.arange(count)))
    inside = a + b < 1
    a, b = a[inside], b[inside]
    weights = np.stack([1 - a - b, a, b], axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    for corner, normal, found in zip(corners, normals, parts.numpy()["irradiance"], strict=True):
        p = weights @ corner
        p = p[p[:, 2] > 0]
        d2 = (p**2).sum(axis=1)
        expected = (p * (p @ normal / d2**2)[:, None]).sum(axis=0) / len(weights)
        scale = np.linalg.norm(normal) / distance**2
        np.testing.assert_allclose(found, expected, atol=0.02 * scale)
        if (corner[:, 2] > 0).all():
            np.testing.assert_allclose(found, expected, atol=2e-3 * scale)
