# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Eye rays."""

import warp as wp

from .sampling import sample_position
from .structs import CameraData, FrameData


@wp.struct
class EyeRay:
    """A ray from the eye, whose origin lies on the near clipping plane."""

    origin: wp.vec3
    direction: wp.vec3
    """Unit."""
    reach: wp.float32
    """Distance to the far clipping plane."""
    near: wp.float32
    """Distance of the origin from the eye."""
    cosine: wp.float32
    """Between the ray and the view axis."""


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


@wp.func
def make_eye_ray(frame: wp.ref[FrameData], x: int, y: int, sample: int) -> EyeRay:
    """Return the eye ray of one sample of a pixel of the whole image."""
    p = sample_position(x, y, sample, frame.sample_count, frame.seed)
    image_x = float(x) + p[0]
    image_y = float(y) + p[1]
    ray = EyeRay()
    ray.direction = eye_direction(frame.camera, image_x, image_y)
    ray.cosine = wp.dot(ray.direction, frame.camera.forward)
    ray.near = frame.camera.near / ray.cosine
    ray.origin = eye_origin(frame.camera, image_x, image_y) + ray.near * ray.direction
    ray.reach = frame.camera.far / ray.cosine - ray.near
    return ray
