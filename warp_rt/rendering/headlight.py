# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The light of scenes that have none."""

from __future__ import annotations

import math

import numpy as np

from warp_rt.scene import Camera, Light, LightKind

_PATH = "/__headlight"


def headlight(camera: Camera) -> Light:
    """Return a light without shadows under which white that faces the eye has value 1, near or far.

    It sits in the eye, as usdrecord's does, so that the walls of a room are lit too; an orthographic camera has no eye,
    its light comes along the view.
    """
    if camera.is_perspective:
        matrix = np.eye(4)
        matrix[:3, 3] = camera.world_from_camera[:3, 3]
        # Without fall-off the attribute is the light's colour I_l, which a white surface that faces it shows.
        return Light(_PATH, LightKind.POINT, matrix, (1.0, 1.0, 1.0), has_falloff=False, casts_shadow=False)
    back = camera.world_from_camera[:3, 2] / np.linalg.norm(camera.world_from_camera[:3, 2])
    # Any right-handed frame about the direction will do, for the light is the same all around it.
    helper = np.eye(3)[np.argmin(np.abs(back))]
    right = np.cross(helper, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    # Irradiance pi: a diffuse surface of reflectance 1 sends out E / pi.
    return Light(_PATH, LightKind.DISTANT, matrix, (math.pi, math.pi, math.pi), casts_shadow=False)
