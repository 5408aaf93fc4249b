# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Eye rays."""

import warp as wp

from .structs import CameraData


@wp.func
def eye_direction(camera: wp.ref[CameraData], x: float, y: float) -> wp.vec3:
    """Return the unit direction of the eye ray through image point (x, y), in pixels from the top left corner."""
    if camera.is_perspective == 0:
        return camera.forward
    s = x / float(camera.width)
    t = y / float(camera.height)
    return wp.normalize(camera.corner + s * camera.right + t * camera.down)


@wp.func
def eye_origin(camera: wp.ref[CameraData], x: float, y: float) -> wp.vec3:
    """Return where the eye ray through image point (x, y) begins, before the near clipping plane is looked at."""
    if camera.is_perspective != 0:
        return camera.origin
    s = x / float(camera.width)
    t = y / float(camera.height)
    return camera.origin + camera.corner + s * camera.right + t * camera.down
