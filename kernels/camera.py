# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Eye rays."""

import warp as wp

from .frame_structs import CameraData, FrameData
from .sampling import lens_position, sample_position


@wp.struct
class EyeRay:
    """A ray from the eye, whose origin lies where clipping planes first let it see."""

    origin: wp.vec3
    direction: wp.vec3
    """Unit."""
    reach: wp.float32
    """Distance to where they no longer let it see; 0 or less: it sees nothing."""
    near: wp.float32
    """Distance of the origin from the eye, or from the point of the lens that it goes through."""
    cosine: wp.float32
    """Between the ray and the view axis."""


@wp.func
def eye_direction(camera: wp.ref[CameraData], x: float, y: float) -> wp.vec3:
    """Return the unit direction of the eye ray through image point (x, y), in pixels from the top left corner."""
    if camera.is_perspective == 0:
        return camera.view
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
def clip_interval(
    camera: wp.ref[CameraData], origin: wp.vec3, direction: wp.vec3, t_min: float, t_max: float
) -> wp.vec2:
    """Return the part of an interval along a ray on which no clipping plane hides anything; empty: upper end below."""
    low = t_min
    high = t_max
    for k in range(camera.plane_count):
        plane = camera.planes[k]
        normal = wp.vec3(plane[0], plane[1], plane[2])
        height = wp.dot(normal, origin) + plane[3]
        climb = wp.dot(normal, direction)
        if climb > 0.0:
            low = wp.max(low, -height / climb)
        elif climb < 0.0:
            high = wp.min(high, -height / climb)
        elif height < 0.0:
            high = low - 1.0
    return wp.vec2(low, high)


@wp.func
def make_eye_ray(frame: wp.ref[FrameData], x: int, y: int, sample: int) -> EyeRay:
    """Return the eye ray of one sample of a pixel of the whole image.

    A lens is thin: all rays from an image point through it meet in the plane in focus, where the ray through its centre
    does. An orthographic camera has such a lens for each image point. A single sample goes through the centre.

    Reference: Cook, Porter and Carpenter (1984), Distributed Ray Tracing, SIGGRAPH, depth of field.
    """
    p = sample_position(x, y, sample, frame.sample_count, frame.seed)
    image_x = float(x) + p[0]
    image_y = float(y) + p[1]
    ray = EyeRay()
    origin = eye_origin(frame.camera, image_x, image_y)
    ray.direction = eye_direction(frame.camera, image_x, image_y)
    ray.cosine = wp.dot(ray.direction, frame.camera.forward)
    if frame.camera.focus > 0.0 and frame.sample_count > 1:
        q = lens_position(x, y, sample, frame.seed)
        aside = q[0] * frame.camera.lens_x + q[1] * frame.camera.lens_y
        origin += aside
        ray.direction = wp.normalize(frame.camera.focus / ray.cosine * ray.direction - aside)
        ray.cosine = wp.dot(ray.direction, frame.camera.forward)
    near = frame.camera.near / ray.cosine
    far = frame.camera.far / ray.cosine
    if frame.camera.plane_count > 0:
        seen = clip_interval(frame.camera, origin, ray.direction, near, far)
        near = seen[0]
        far = seen[1]
    ray.near = near
    ray.origin = origin + near * ray.direction
    ray.reach = far - near
    return ray
