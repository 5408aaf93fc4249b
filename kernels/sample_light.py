# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A light of any kind that has an extent: a direction in which it is seen, and what comes from there."""

import warp as wp

from .constants import CONE_SHARE, NARROW_CONE
from .light import KIND_CYLINDER, KIND_DISTANT, KIND_POINT, KIND_RECT, KIND_SPHERE, cone_factor
from .light_direction import LightDirection, direction_in_cone
from .sample_cylinder import meet_cylinder, sample_cylinder
from .sample_disk import meet_disk, sample_disk
from .sample_distant import meet_distant, sample_distant
from .sample_rect import meet_rect, sample_rect
from .sample_sphere import meet_sphere, sample_sphere
from .structs import LightData
from .vector import perpendicular_frame


@wp.func
def has_extent(light: wp.ref[LightData]) -> bool:
    """Return whether a light is more than a point: without extent there is nothing to sample."""
    return light.kind != KIND_POINT and (light.kind != KIND_DISTANT or light.cap > 0.0)


@wp.func
def sample_extent(light: wp.ref[LightData], position: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction to a light that has an extent; of density 0 where the light does not shine on the point.

    Args:
        light: The light.
        position: Of the point.
        u: Point of the unit square.
    """
    if light.kind == KIND_DISTANT:
        return sample_distant(light.axis_z, light.cap, u)
    center = light.position - position
    if light.kind == KIND_SPHERE:
        return sample_sphere(center, light.half_x, light.half_y, light.half_z, u)
    if light.kind == KIND_CYLINDER:
        return sample_cylinder(center, light.half_x, light.half_y, light.half_z, u)
    if wp.dot(center, light.normal) <= 0.0:
        return LightDirection()
    if light.kind == KIND_RECT:
        return sample_rect(center, light.half_x, light.half_y, u)
    return sample_disk(center, light.half_x, light.half_y, u)


@wp.func
def meet_extent(light: wp.ref[LightData], position: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_extent` makes of a unit direction that comes from elsewhere."""
    if light.kind == KIND_DISTANT:
        return meet_distant(light.axis_z, light.cap, wi)
    center = light.position - position
    if light.kind == KIND_SPHERE:
        return meet_sphere(center, light.half_x, light.half_y, light.half_z, wi)
    if light.kind == KIND_CYLINDER:
        return meet_cylinder(center, light.half_x, light.half_y, light.half_z, wi)
    if wp.dot(center, light.normal) <= 0.0:
        return LightDirection()
    if light.kind == KIND_RECT:
        return meet_rect(center, light.half_x, light.half_y, wi)
    return meet_disk(center, light.half_x, light.half_y, wi)


@wp.func
def cone_cap_of(light: wp.ref[LightData], position: wp.vec3) -> float:
    """Return 1 - cos of a light's cone where that is much narrower than the light as a point sees it; else 0.

    There most samples of the light's shape would fall where it is dark.
    """
    if light.cone_angle >= 0.5 * wp.pi:
        return 0.0
    sine = wp.sin(0.5 * light.cone_angle)
    cap = 2.0 * sine * sine
    size2 = wp.length_sq(light.half_x) + wp.length_sq(light.half_y) + wp.length_sq(light.half_z)
    # 1 - cos is half the squared sine where that is small, and up to 1.
    seen = wp.min(0.5 * size2 / wp.max(wp.length_sq(light.position - position), 1.0e-30), 1.0)
    return cap if cap < NARROW_CONE * seen else 0.0


@wp.func
def add_cone_pdf(light: wp.ref[LightData], cap: float, d: wp.ref[LightDirection]):
    """Make a direction's density that of :func:`sample_shaped` from that of :func:`sample_extent`.

    Args:
        light: The light.
        cap: Above 0, of its :func:`cone_cap_of`.
        d: Direction and density.
    """
    if d.pdf > 0.0:
        d.pdf = d.pdf * (1.0 - CONE_SHARE)
        if 0.5 * wp.length_sq(d.wi - light.axis_z) <= cap:
            d.pdf += CONE_SHARE / (2.0 * wp.pi * cap)


@wp.func
def sample_shaped(light: wp.ref[LightData], position: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return what :func:`sample_extent` does; of lights with a narrow cone, some directions are the cone's."""
    cap = cone_cap_of(light, position)
    if cap == 0.0:
        return sample_extent(light, position, u)
    d = LightDirection()
    if u[0] < CONE_SHARE:
        local = direction_in_cone(cap, wp.vec2(u[0] / CONE_SHARE, u[1]))
        x, y = perpendicular_frame(light.axis_z)
        d = meet_extent(light, position, x * local[0] + y * local[1] + light.axis_z * local[2])
    else:
        d = sample_extent(light, position, wp.vec2((u[0] - CONE_SHARE) / (1.0 - CONE_SHARE), u[1]))
    add_cone_pdf(light, cap, d)
    return d


@wp.func
def meet_shaped(light: wp.ref[LightData], position: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_shaped` makes of a unit direction that comes from elsewhere."""
    d = meet_extent(light, position, wi)
    cap = cone_cap_of(light, position)
    if cap > 0.0:
        add_cone_pdf(light, cap, d)
    return d


@wp.func
def light_radiance(light: wp.ref[LightData], wi: wp.vec3, spread: float) -> wp.vec3:
    """Return what arrives from a light along a unit direction to a point of it, shaping included.

    Shaping looks at the direction from each point of the light, as UsdLux has it.

    Args:
        light: The light.
        wi: Unit direction to one of its points.
        spread: As in :func:`cone_factor`.
    """
    if light.kind == KIND_DISTANT:
        # Its emission is the irradiance of a surface that faces it: pi sin^2 of the half angle, at most pi.
        sine2 = light.cap * (2.0 - light.cap) if light.cap < 1.0 else 1.0
        return light.emission / (wp.pi * sine2)
    return wp.cw_mul(light.emission, cone_factor(light, wp.dot(wi, light.axis_z), spread))
