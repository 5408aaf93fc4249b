# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Whether a light's cone, focus and profile tell the points of a part of it apart, as seen from a surface.

A part is all of a light or some of its triangles; what counts of it is the ball that holds it.
"""

import warp as wp

from .constants import FAR_LIGHT, FAR_PROFILE, FOCUS_DARK, LEAST_DIVISOR, STEEPEST
from .light_direction import half_angle
from .light_structs import LightData, ProfileData

DARK = wp.constant(0)
"""From :func:`cone_view`: all of a part is outside of the light's cone."""
EVEN = wp.constant(1)
"""From :func:`cone_view`: the light's cone does not tell a part's points apart."""
CUT = wp.constant(2)
"""From :func:`cone_view`: the rim of the light's cone may go through a part."""


@wp.func
def rim_angle(light: wp.ref[LightData]) -> float:
    """Return the angle to the axis [rad] up to which a light's cone leaves it as it is; pi where it has none."""
    if light.cone_angle >= wp.pi:
        return wp.pi
    return light.cone_angle * (1.0 - light.cone_softness)


@wp.func
def cone_view(light: wp.ref[LightData], to_center: wp.vec3, size2: float) -> int:
    """Return how a cone lies to a point: it leaves it dark, it does not tell a part's points apart, or its rim does.

    Args:
        light: The light.
        to_center: From the point to the part's centre.
        size2: Squared radius of the ball that holds it.
    """
    end = light.cone_angle
    if end >= wp.pi:
        return EVEN
    d2 = wp.length_sq(to_center)
    if d2 <= size2:
        return CUT  # from within the ball its points may be in any direction
    half = half_angle(size2, d2)
    cosine = wp.dot(to_center, light.axis_z) / wp.sqrt(wp.max(d2, LEAST_DIVISOR))
    theta = wp.acos(wp.clamp(cosine, -1.0, 1.0))
    rim = rim_angle(light)
    if theta - half >= end:
        return DARK
    # A soft rim that is much wider than the light looks straight to it, but for where it ends.
    if theta + half <= rim or wp.min(end - rim, end - theta) > FAR_LIGHT * half:
        return EVEN
    return CUT


@wp.func
def angle_to_axis(light: wp.ref[LightData], wi: wp.vec3) -> float:
    """Return the angle to the light's axis of what it sends along -wi, a unit vector."""
    return wp.acos(wp.clamp(wp.dot(wi, light.axis_z), -1.0, 1.0))


@wp.func
def focus_rate(light: wp.ref[LightData], theta: float, half: float) -> float:
    """Return by how many powers of e a focused light changes a radian where a part does so most; 0 where that is dark.

    That is the focus times the tangent of the angle to the axis, near which its square root counts, the width of the
    peak.

    Args:
        light: One with a focus.
        theta: :func:`angle_to_axis` of the part's centre [rad].
        half: The part's :func:`half_angle`.
    """
    off_axis = wp.min(theta, wp.pi - theta)
    if wp.pow(wp.cos(wp.max(off_axis - half, 0.0)), light.focus) <= FOCUS_DARK:
        return 0.0
    root = wp.sqrt(light.focus)
    return root * wp.max(1.0, root * wp.tan(wp.min(off_axis + half, STEEPEST)))


@wp.func
def profile_cell(profile: wp.ref[ProfileData], theta: float, half: float) -> float:
    """Return the width of a cell [rad] within which a profile is nearly a plane; at the axis no finer than a part.

    Args:
        profile: The light's.
        theta: :func:`angle_to_axis` of the part's centre [rad].
        half: The part's :func:`half_angle` [rad].
    """
    # Horizontal angles crowd at the axis: there a share of the light is as fine as it gets.
    return wp.min(profile.vertical_cell, profile.horizontal_cell * wp.max(wp.sin(theta), half))


@wp.func
def is_profile_cut(profile: wp.ref[ProfileData], theta: float, half: float) -> bool:
    """Return whether an end of a profile, beyond which it is dark, goes through a part.

    Args:
        profile: The light's.
        theta: :func:`angle_to_axis` of the part's centre [rad].
        half: The part's :func:`half_angle` [rad].
    """
    return wp.abs(theta - profile.first_end) <= half or wp.abs(theta - profile.last_end) <= half


@wp.func
def is_profile_even(profile: wp.ref[ProfileData], theta: float, half: float) -> bool:
    """Return whether a part looks so small that a profile does not tell its points apart.

    Args:
        profile: The light's.
        theta: :func:`angle_to_axis` of the part's centre [rad].
        half: The part's :func:`half_angle` [rad].
    """
    return not is_profile_cut(profile, theta, half) and half <= FAR_PROFILE * profile_cell(profile, theta, half)
