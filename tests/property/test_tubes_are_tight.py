# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray that comes from outside to a point within a tube meets the tube, wherever it bends, swells or comes back."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import build_accel, closest_hit
from warp_rt.scene import Instances, Material, MaterialModel, Scene, ShapeKind, Shapes

from ..shapes_float64 import bezier

CURVES, RAYS = 40, 4000
DISTANCE = 12.0

# Control points and radii of a curve: a loop that nearly closes, a swelling, one thicker than long, any.
KINDS = {
    "loop": (
        lambda rng: np.array([[0, 0, 0], [2, 1, 0.1], [-1, 1, -0.1], [1, 0, 0]]),
        lambda rng: rng.uniform(0.02, 0.1, 4),
    ),
    "swelling": (lambda rng: rng.normal(size=(4, 3)), lambda rng: np.array([0.02, 1.0, 0.0, 0.2])),
    "thick": (lambda rng: rng.normal(size=(4, 3)), lambda rng: rng.uniform(1, 3, 4)),
    "any": (lambda rng: rng.normal(size=(4, 3)), lambda rng: rng.uniform(0.02, 0.1, 4)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_no_ray_passes_through(kind: str) -> None:
    rng = np.random.default_rng(3)
    missed = 0
    for _ in range(CURVES):
        points, radii = (make(rng).astype(np.float32) for make in KINDS[kind])
        balls = bezier(np.concatenate([points, radii[:, None]], axis=1).astype(float), rng.random(RAYS))
        off = rng.normal(size=(RAYS, 3))
        off *= 0.99 * (rng.random(RAYS) ** 0.1 / np.linalg.norm(off, axis=1))[:, None]
        within = balls[:, :3] + off * balls[:, 3:]
        from_where = rng.normal(size=(RAYS, 3))
        origins = within + DISTANCE * from_where / np.linalg.norm(from_where, axis=1, keepdims=True)
        shapes = Shapes(ShapeKind.CUBIC_TUBE, points[None], radii[None], is_closed=False)
        row = np.zeros(1, np.int32)
        instances = Instances(row, np.eye(4)[None], row, row, row, row - 1)
        scene = Scene((shapes,), instances, prims=("/s",), materials=(Material("/m", MaterialModel.WHITTED),))
        hits = closest_hit(build_accel(scene, device="cpu"), origins, within - origins)
        missed += int((hits.triangle < 0).sum())
    assert missed == 0
