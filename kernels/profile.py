# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""IES profiles: the factor that a light's radiance has in a direction."""

import warp as wp

from .constants import POLE
from .scene_structs import SceneData


@wp.func
def find_angle(angles: wp.array[float], first: int, count: int, angle: float) -> int:
    """Return the row of the last of ascending angles, but the very last one, that is not above an angle within them."""
    low = int(0)
    high = count - 1
    while high - low > 1:
        middle = (low + high) / 2
        if angles[first + middle] <= angle:
            low = middle
        else:
            high = middle
    return low


@wp.func
def scaled_angle(theta: float, scale: float) -> float:
    """Return the vertical angle that a profile is read at, which need not lie within [0, pi].

    Reference: UsdLux ShapingAPI, ``shaping:ies:angleScale``.
    """
    if scale > 0.0:
        return theta / scale
    if scale < 0.0:
        return (theta - wp.pi) / -scale + wp.pi
    return theta


@wp.func
def end_factor(inside: float, width: float) -> float:
    """Return the mean of a step over a smoothstep of a width, at a signed distance inside of where it falls to 0."""
    if width <= 0.0:
        return 1.0 if inside >= 0.0 else 0.0
    x = wp.clamp(inside / width + 0.5, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


@wp.func
def profile_factor(scene: wp.ref[SceneData], row: int, wi: wp.vec3, spread: float) -> float:
    """Return a profile's factor for light that arrives along ``wi``; 0 where the profile has no angles.

    Light leaves along -wi. Its vertical angle is that to the light's -Z. Its horizontal angle is 0 towards local -X and
    grows towards -Y, counter-clockwise for who looks down along -Z, as LM-63 counts.

    Args:
        scene: Profiles.
        row: Of ``SceneData.profiles``.
        wi: Unit direction to the light, world space.
        spread: Squared width over which the ends of its vertical angles are smoothed [rad^2], as in
            ``light.cone_factor``: what a cell of directions has in the mean.

    Reference: OpenUSD's hdEmbree, which reads profiles linearly in both angles.
    """
    profile = scene.profiles[row]
    x = wp.dot(profile.row_x, wi)
    y = wp.dot(profile.row_y, wi)
    z = wp.dot(profile.row_z, wi)
    theta = scaled_angle(wp.atan2(wp.sqrt(x * x + y * y), z), profile.angle_scale)
    phi = wp.atan2(y, x)
    if phi < 0.0:
        phi += 2.0 * wp.pi
    numbers = scene.profile_numbers
    vertical = profile.offset
    horizontal = vertical + profile.vertical_count
    values = horizontal + profile.horizontal_count
    first = numbers[vertical]
    last = numbers[horizontal - 1]
    ends = float(1.0)
    if spread > 0.0:
        # Where an end lies at a pole there is nothing beyond it.
        scale = wp.abs(profile.angle_scale) if profile.angle_scale != 0.0 else 1.0
        width = wp.sqrt(spread) / scale
        if scaled_angle(0.0, profile.angle_scale) < first - POLE:
            ends = end_factor(theta - first, width)
        if scaled_angle(wp.pi, profile.angle_scale) > last + POLE:
            ends = ends * end_factor(last - theta, width)
        theta = wp.clamp(theta, first, last)
    if theta < first or theta > last:
        return 0.0
    if phi < numbers[horizontal] or phi > numbers[values - 1]:
        return 0.0
    i = find_angle(numbers, vertical, profile.vertical_count, theta)
    j = find_angle(numbers, horizontal, profile.horizontal_count, phi)
    v = (theta - numbers[vertical + i]) / (numbers[vertical + i + 1] - numbers[vertical + i])
    h = (phi - numbers[horizontal + j]) / (numbers[horizontal + j + 1] - numbers[horizontal + j])
    here = values + j * profile.vertical_count + i
    there = here + profile.vertical_count
    a = numbers[here] * (1.0 - v) + numbers[here + 1] * v
    b = numbers[there] * (1.0 - v) + numbers[there + 1] * v
    return (a * (1.0 - h) + b * h) * ends
