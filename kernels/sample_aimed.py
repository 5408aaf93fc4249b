# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where a light's cone and focus leave most of it: directions about its axis, in proportion to the focus.

They are those of a sector: between two angles to the axis and between two azimuths about it, so that it holds the part
of the cone in which the light is seen, and little else. Within it the density is even in the azimuth, and by the angle
theta cos^focus in solid angle, whose integral is elementary: that of Phong's lobe.

Reference: Lafortune and Willems (1994), Using the Modified Phong Reflectance Model for Physically Based Rendering,
report CW 197, section 5, for the lobe.
"""

import warp as wp

from .constants import AIMED_END, AIMED_MOST, LEAST_DIVISOR, SERIES_END
from .light_direction import half_angle
from .light_structs import LightData
from .sampling import concentric_disk
from .vector import max_component, perpendicular_frame


@wp.struct
class Aim:
    """Directions in which a light is sampled for its cone and focus, as seen from a surface."""

    share: wp.float32
    """Part of the samples that has them; 0: none, and nothing else is set."""
    axis: wp.vec3
    """Unit, from the surface; so too ``x`` and ``y``, square to it, the sector's middle being towards ``x``."""
    x: wp.vec3
    y: wp.vec3
    top: wp.float32
    """-log of the cosine of the least angle to the axis."""
    span: wp.float32
    """1 less the ratio of cos^(focus + 1) at the greatest angle to that at the least."""
    turn: wp.float32
    """Half the azimuths."""
    power: wp.float32
    """1 more than the focus."""


@wp.func
def minus_log(height: float) -> float:
    """Return -log(1 - height), of a small height in full digits."""
    if height > SERIES_END:
        return -wp.log(1.0 - height)
    return height * (1.0 + height * (0.5 + height * (1.0 / 3.0 + height * (0.25 + height * 0.2))))


@wp.func
def minus_exp(x: float) -> float:
    """Return 1 - exp(-x) of a number that is not negative, of a small one in full digits."""
    if x > SERIES_END:
        return 1.0 - wp.exp(-x)
    return x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x / 120.0))))


@wp.func
def height_of(angle: float) -> float:
    """Return 1 - cos of an angle, of a small one in full digits."""
    sine = wp.sin(0.5 * angle)
    return 2.0 * sine * sine


@wp.func
def aim_at(light: wp.ref[LightData], to_center: wp.vec3, size2: float, seen: float, least: float, most: float) -> Aim:
    """Return where a light is sampled for its cone and focus, if these leave far less of it than is seen.

    Args:
        light: One with an extent, not a distant one.
        to_center: From the surface to its centre.
        size2: Squared radius of a ball about that which holds it.
        seen: About the solid angle that it covers.
        least: Part of that which must be left out for samples to be aimed.
        most: Part of the samples that are, where there is no focus.
    """
    aim = Aim()
    end = wp.min(light.cone_angle, AIMED_END)
    if light.focus <= 0.0 and light.cone_angle >= AIMED_END:
        return aim
    d2 = wp.max(wp.length_sq(to_center), LEAST_DIVISOR)
    wi = to_center / wp.sqrt(d2)
    aim.axis = light.axis_z
    cosine = wp.dot(wi, light.axis_z)
    if cosine < 0.0 and light.cone_angle > 0.5 * wp.pi:
        aim.axis = -light.axis_z  # a focus is the same behind
        cosine = -cosine
    half = half_angle(size2, d2)
    theta = wp.atan2(wp.length(wp.cross(wi, aim.axis)), cosine)
    first = float(0.0)
    aim.turn = wp.pi
    if d2 > size2:
        first = wp.max(theta - half, 0.0)
        end = wp.min(end, theta + half)
        if half < theta and theta + half < wp.pi:
            aim.turn = wp.asin(wp.min(wp.sin(half) / wp.sin(theta), 1.0))
    if first >= end:
        return aim
    aim.power = light.focus + 1.0
    aim.top = minus_log(height_of(first))
    bottom = minus_log(height_of(end))
    aim.span = minus_exp(aim.power * (bottom - aim.top))
    # As a solid angle, what the sector has of its brightest direction.
    aimed = 2.0 * aim.turn * aim.span * wp.exp(-aim.top) / aim.power
    share = 1.0 - aimed / seen
    if light.focus > 0.0:
        # What a tint leaves is all over the light.
        tint = wp.clamp(max_component(light.focus_tint), 0.0, 1.0)
        focused = (1.0 - tint) * aimed
        share = wp.min(share, focused / (focused + tint * seen))
        most = wp.min(share, AIMED_MOST)
    if share > least:
        aim.share = most
        x, y = perpendicular_frame(aim.axis)
        if aim.turn < wp.pi:
            x = wp.normalize(x * wp.dot(wi, x) + y * wp.dot(wi, y))
            y = wp.cross(aim.axis, x)
        aim.x = x
        aim.y = y
    return aim


@wp.func
def aimed_direction(aim: wp.ref[Aim], u: wp.vec2) -> wp.vec3:
    """Return a unit direction of a sector.

    Args:
        aim: The sector.
        u: Point of the unit square.
    """
    if aim.turn < wp.pi:
        turn = (2.0 * u[1] - 1.0) * aim.turn
        height = aimed_height(aim, u[0])
        sine = wp.sqrt(wp.max(height * (2.0 - height), 0.0))
        return aim.x * (sine * wp.cos(turn)) + aim.y * (sine * wp.sin(turn)) + aim.axis * (1.0 - height)
    # All around: what is near in the square stays near.
    p = concentric_disk(u)
    r2 = wp.length_sq(p)
    height = aimed_height(aim, r2)
    side = wp.sqrt(wp.max(height * (2.0 - height), 0.0) / wp.max(r2, LEAST_DIVISOR))
    return aim.x * (p[0] * side) + aim.y * (p[1] * side) + aim.axis * (1.0 - height)


@wp.func
def aimed_height(aim: wp.ref[Aim], part: float) -> float:
    """Return 1 - cos of the angle to the axis below which a part of a sector's directions are."""
    return minus_exp(aim.top + minus_log(part * aim.span) / aim.power)


@wp.func
def aimed_pdf(aim: wp.ref[Aim], wi: wp.vec3) -> float:
    """Return the density with which :func:`aimed_direction` gives a unit direction [1/sr]."""
    height = 0.5 * wp.length_sq(wi - aim.axis)
    if height >= 1.0:
        return 0.0
    depth = minus_log(height)
    below = aim.power * (depth - aim.top)
    if below < 0.0 or minus_exp(below) > aim.span:
        return 0.0
    if wp.abs(wp.atan2(wp.dot(wi, aim.y), wp.dot(wi, aim.x))) > aim.turn:
        return 0.0
    return aim.power * wp.exp(depth - below) / (2.0 * aim.turn * aim.span)
