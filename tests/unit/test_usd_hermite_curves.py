# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""HermiteCurves: points and tangents that the tubes pass through."""

from __future__ import annotations

import numpy as np

from warp_rt.scene import Scene, ShapeKind

from ..curve_stages import codes, load_prim, shapes_of

POINTS = np.array([(0, 0, 0), (2, 1, 0), (4, 0, 1), (0, 5, 0), (3, 5, 0)], float)
TANGENTS = np.array([(1, 2, 0), (3, 0, 0), (1, -2, 1), (3, 0, 3), (3, 0, -3)], float)


def load(body: str) -> Scene:
    points, tangents = ([tuple(map(float, row)) for row in array] for array in (POINTS, TANGENTS))
    controls = f"point3f[] points = {points}\nvector3f[] tangents = {tangents}"
    return load_prim("HermiteCurves", f"{controls}\nint[] curveVertexCounts = [3, 2]\n{body}")


def test_segments_have_the_points_and_tangents() -> None:
    """By the cubic Hermite basis, at parameters within each segment."""
    scene = load('float[] widths = [1, 2, 3, 4, 5] (interpolation = "varying")')
    shapes = shapes_of(scene)
    assert codes(scene) == set()
    assert shapes.kind == ShapeKind.CUBIC_TUBE
    np.testing.assert_array_equal(shapes.face_ids, [0, 0, 1])
    for row, (a, b) in enumerate(((0, 1), (1, 2), (3, 4))):
        for u in (0.0, 0.4, 1.0):
            weights = np.array([2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, -2 * u**3 + 3 * u**2, u**3 - u**2])
            expected = weights @ np.array([POINTS[a], TANGENTS[a], POINTS[b], TANGENTS[b]])
            basis = np.array([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u * u * (1 - u), u**3])
            np.testing.assert_allclose(basis @ shapes.points[row], expected, atol=1e-6)
        np.testing.assert_allclose(shapes.radii[row], np.linspace(a + 1, b + 1, 4) / 2, atol=1e-6)


def test_values_run_straight_from_point_to_point() -> None:
    scene = load(
        """float[] widths = [1]
        float[] primvars:vertex = [0, 1, 2, 3, 4] (interpolation = "vertex")
        float[] primvars:varying = [0, 1, 2, 3, 4] (interpolation = "varying")
        float[] primvars:curve = [7, 8] (interpolation = "uniform")"""
    )
    at = {name: value.values[value.indices][..., 0] for name, value in shapes_of(scene).primvars.items()}
    assert codes(scene) == set()
    for name in ("vertex", "varying"):
        np.testing.assert_array_equal(at[name], [[0, 1], [1, 2], [3, 4]])
    np.testing.assert_array_equal(at["curve"], [[7], [7], [8]])


def test_without_tangents_they_are_straight() -> None:
    scene = load("float[] widths = [1]\nvector3f[] tangents.timeSamples = { 0: [(1, 0, 0)] }")
    assert codes(scene) == {"W117"}
    assert shapes_of(scene).kind == ShapeKind.LINEAR_TUBE
    np.testing.assert_array_equal(shapes_of(scene).points[:, 0], POINTS[[0, 1, 3]])
