# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Scenes made by hand are refused where no hierarchy can be built over them."""

from __future__ import annotations

import numpy as np
import pytest

import warp_rt
from warp_rt.errors import SceneError
from warp_rt.scene import Instances, Mesh, Scene, ShapeKind, Shapes

ROW = np.zeros(1, np.int32)


def placed(matrix: np.ndarray) -> Scene:
    mesh = Mesh(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
    return Scene((mesh,), Instances(ROW, matrix[None], ROW, ROW, ROW, ROW - 1), prims=("/m",))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_transforms_are_finite(value: float) -> None:
    with pytest.raises(SceneError, match="finite transforms"):
        placed(np.diag([value, 1, 1, 1]))


def test_transforms_stay_in_the_range_of_float32() -> None:
    with pytest.raises(SceneError, match="range of float32"):
        warp_rt.build_accel(placed(np.diag([1e45, 1, 1, 1])))


@pytest.mark.parametrize(("center", "radius"), [(np.nan, 1), (0, np.nan), (0, -1), (np.inf, 1)])
def test_shapes_have_places_and_sizes(center: float, radius: float) -> None:
    with pytest.raises(SceneError, match="shapes: finite"):
        Shapes(ShapeKind.SPHERE, np.full((1, 1, 3), center, np.float32), np.full((1, 1), radius, np.float32))


def test_a_mesh_without_extent_has_a_cost() -> None:
    scene = Scene.from_arrays(np.zeros((3, 3)), [(0, 1, 2)])
    assert warp_rt.build_accel(scene).statistics.sah_cost == 0
