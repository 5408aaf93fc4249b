# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A small ball on a ground plane of two great triangles: what lies far off must not spoil what is near.

The picture near the ball does not depend on how far the plane goes, so a small plane, of which the oracle's own bar
holds (test_oracle.py), stands for the exact answer.
"""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import Renderer, RenderOptions
from warp_rt.scene import Camera

from ..analytic.scenes import Body, distant, looking, scene_of, square, whitted
from ..meshes import octasphere


def picture(half: float) -> np.ndarray:
    points, faces = octasphere(4)
    ball = Body(points * 0.5 + (0.0, 0.0, 0.5), faces, whitted(ambient=0.05, diffuse=0.5, specular=0.2))
    floor = square(whitted(ambient=0.05, diffuse=0.7, reflection=0.3), half=half)
    scene = scene_of(floor, ball, lights=[distant((1.0, 0.3, -0.6))], ambient=(1.0, 1.0, 1.0))
    # From above, and the ball is no mirror: no ray meets what a larger floor adds.
    camera = Camera("/camera", looking((0.3, 0.5, -1.0), (-1.2, -2.0, 4.5)), (-0.3, 0.3, -0.3, 0.3))
    options = RenderOptions(width=150, height=150, depth=4, threshold=0.0)
    return Renderer(scene, options, device="cpu").render(camera=camera).color


@pytest.mark.parametrize("half", [100.0, 1e3, 1e4])
def test_the_ball_looks_the_same_on_a_great_plane(half: float) -> None:
    error = np.abs(picture(half) - picture(8.0)).max(axis=-1)
    assert (error <= 1e-4).mean() >= 0.999
