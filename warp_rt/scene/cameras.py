# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Camera:
    """A perspective or an orthographic camera that looks along its local -Z with +Y up."""

    path: str
    world_from_camera: np.ndarray
    """float64, shape [4, 4], with whatever scale and shear the stage gives it."""
    window: tuple[float, float, float, float]
    """left, right, bottom, top: on the plane z = -1 (perspective) or in scene units (orthographic)."""
    is_perspective: bool = True
    clipping_range: tuple[float, float] = (0.0, np.inf)
    """Nearest and farthest distance along -Z that eye rays see."""
    clipping_planes: tuple[tuple[float, float, float, float], ...] = ()
    """(a, b, c, d) in the camera's space: eye rays do not see points where a x + b y + c z + d < 0."""
    lens_radius: float = 0.0
    """Half the aperture's diameter [scene unit]; 0: a pinhole."""
    focus_distance: float = 0.0
    """Distance along -Z of the plane in focus [scene unit]; 0: all is sharp, whatever the lens."""
    exposure_scale: float = 1.0
    """Linear factor on colour from the camera's exposure attributes."""
    shutter: tuple[float, float] = (0.0, 0.0)
    """When it opens and closes, time codes from the frame's; zeros also where nothing moves meanwhile. One that closes
    before it opens exposes nothing: colour is black."""
