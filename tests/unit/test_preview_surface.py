# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdPreviewSurface's reflectance head on, by the specification's formulas."""

import numpy as np
import warp as wp

from warp_rt.kernels.preview_surface import preview_f0
from warp_rt.warp_setup import init_warp

init_warp()


def test_f0_of_both_workflows() -> None:
    color, specular = wp.vec3(0.8, 0.4, 0.2), wp.vec3(0.1, 0.2, 0.3)
    np.testing.assert_allclose(preview_f0(color, specular, 0.0, 1.5, 0), [0.04] * 3, rtol=1e-6)
    np.testing.assert_allclose(preview_f0(color, specular, 1.0, 1.5, 0), [0.8, 0.4, 0.2], rtol=1e-6)
    np.testing.assert_allclose(preview_f0(color, specular, 1.0, 1.5, 1), [0.1, 0.2, 0.3], rtol=1e-6)
    # Half metal: mix(R^2 specColor, specColor, metallic) with specColor = mix(1, diffuse, metallic).
    spec = 0.5 + 0.5 * np.array([0.8, 0.4, 0.2])
    np.testing.assert_allclose(preview_f0(color, specular, 0.5, 1.5, 0), 0.5 * 0.04 * spec + 0.5 * spec, rtol=1e-6)


def test_an_index_that_is_none_reflects_no_more_than_comes() -> None:
    """A texture may hold -1, where ((1 - n) / (1 + n))^2 has its pole."""
    color = wp.vec3(0.8, 0.4, 0.2)
    for ior in (-1.0, -0.5, 0.0):
        np.testing.assert_allclose(preview_f0(color, color, 0.0, ior, 0), [1.0] * 3, atol=0.01)
        assert all(value <= 1.0 for value in preview_f0(color, color, 0.0, ior, 0))
