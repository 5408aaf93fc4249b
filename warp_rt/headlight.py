# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The light of scenes that have none."""

from __future__ import annotations

import math

import numpy as np

from warp_rt.scene import Camera, Light, LightKind

_PATH = "/__headlight"


def headlight(camera: Camera) -> Light:
    """Return a light along the camera's view, without shadows, under which white that faces the eye has value 1.

    That takes an irradiance of pi, for a diffuse surface of reflectance 1 sends out E / pi.
    """
    back = camera.world_from_camera[:3, 2] / np.linalg.norm(camera.world_from_camera[:3, 2])
    # Any right-handed frame about the direction will do, for the light is the same all around it.
    helper = np.eye(3)[np.argmin(np.abs(back))]
    right = np.cross(helper, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    return Light(_PATH, LightKind.DISTANT, matrix, (math.pi, math.pi, math.pi), casts_shadow=False)
