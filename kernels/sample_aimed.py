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

from .constants import AIMED_MOST, SERIES_END
from .light_direction import half_angle
from .structs import LightData
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
def aim_at(light: wp.ref[LightData], to_center: wp.vec3, size2: float, area: float, least: float) -> Aim:
    """Return where a light is sampled for its cone and focus, if these leave far less of it than is seen.

    Args:
        light: One with an extent, not a distant one.
        to_center: From the surface to its centre.
        size2: Squared radius of a ball about that which holds it.
        area: About what is seen of it from afar.
        least: Part of the samples below which none are aimed.
    """
    aim = Aim()
    end = wp.min(light.cone_angle, 0.5 * wp.pi)
    if light.focus <= 0.0 and light.cone_angle >= 0.5 * wp.pi:
        return aim
    d2 = wp.max(wp.length_sq(to_center), 1.0e-30)
    wi = to_center / wp.sqrt(d2)
    aim.axis = light.axis_z
    cosine = wp.dot(wi, light.axis_z)
    if cosine < 0.0 and light.cone_angle > 0.5 * wp.pi:
        aim.axis = -light.axis_z  # a focus is the same behind
        cosine = -cosine
    half = half_angle(size2, d2)
    theta = wp.acos(wp.clamp(cosine, -1.0, 1.0))
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
    bottom = minus_log(height_of(wp.min(end, 1.57)))
    aim.span = minus_exp(aim.power * (bottom - aim.top))
    # As a solid angle, what the sector has of its brightest direction.
    aimed = 2.0 * aim.turn * aim.span * wp.exp(-aim.top) / aim.power
    seen = 2.0 * wp.pi * height_of(half)
    if d2 > size2:
        seen = wp.min(seen, area / d2)
    share = 1.0 - aimed / seen
    if light.focus > 0.0:
        # What a tint leaves is all over the light.
        tint = wp.clamp(max_component(light.focus_tint), 0.0, 1.0)
        focused = (1.0 - tint) * aimed
        share = wp.min(share, focused / (focused + tint * seen))
    if share > least:
        aim.share = wp.min(share, AIMED_MOST)
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
    height = minus_exp(aim.top + minus_log(u[0] * aim.span) / aim.power)
    sine = wp.sqrt(wp.max(height * (2.0 - height), 0.0))
    turn = (2.0 * u[1] - 1.0) * aim.turn
    return aim.x * (sine * wp.cos(turn)) + aim.y * (sine * wp.sin(turn)) + aim.axis * (1.0 - height)


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
