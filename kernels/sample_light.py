# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A light of any kind that has an extent: a direction in which it is seen, and what comes from there."""

import warp as wp

from .codes import UNEVEN, VARIED
from .constants import AIMED_CONE, AIMED_FOCUS, LEAST_DIVISOR
from .light import KIND_CYLINDER, KIND_DISK, KIND_DISTANT, KIND_POINT, KIND_RECT, KIND_SPHERE, cone_factor
from .light_direction import LightDirection, cone_cap
from .light_structs import LightData
from .outline import bounding_square
from .sample_aimed import Aim, aim_at, aimed_direction, aimed_pdf
from .sample_cylinder import meet_cylinder, sample_cylinder
from .sample_disk import meet_disk, sample_disk
from .sample_distant import meet_distant, sample_distant
from .sample_rect import meet_rect, sample_rect
from .sample_sphere import meet_sphere, sample_sphere


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
def aim_of(light: wp.ref[LightData], position: wp.vec3) -> Aim:
    """Return where a light is sampled for its cone and focus, if these leave far less of it than is seen."""
    if (light.varies & VARIED) == 0 or light.kind == KIND_DISTANT:
        return Aim()
    center = light.position - position
    size2 = bounding_square(light)
    if (light.varies & UNEVEN) == 0 and light.kind != KIND_RECT:
        size2 = light.radius * light.radius
        if light.kind == KIND_CYLINDER:
            size2 += wp.length_sq(light.half_x)
    least = AIMED_FOCUS if light.focus > 0.0 else AIMED_CONE
    return aim_at(light, center, size2, seen_solid_angle(light, center), least, 1.0)


@wp.func
def seen_solid_angle(light: wp.ref[LightData], center: wp.vec3) -> float:
    """Return about the solid angle that a light with a shape covers: from afar its own, of a sphere everywhere.

    Args:
        light: A rect, disk, sphere or cylinder.
        center: Its centre, as seen from the point.
    """
    x = light.half_x
    y = light.half_y
    z = light.half_z
    d2 = wp.max(wp.length_sq(center), LEAST_DIVISOR)
    # How large a box about it looks, by its sides; those across a cylinder's axis are open.
    xy = wp.dot(wp.cross(x, y), center)
    zx = wp.dot(wp.cross(z, x), center)
    yz = wp.dot(wp.cross(y, z), center) if light.kind != KIND_CYLINDER else 0.0
    area = wp.sqrt((xy * xy + zx * zx + yz * yz) / d2)
    if light.kind == KIND_RECT or light.kind == KIND_CYLINDER:
        area *= 4.0 / wp.pi
    # That of a disk or of a sphere which looks as large.
    if light.kind == KIND_RECT or light.kind == KIND_DISK:
        return 2.0 * wp.pi * cone_cap(area / (d2 + area))
    return 2.0 * wp.pi * cone_cap(wp.min(area / d2, 1.0))


@wp.func
def sample_shaped(light: wp.ref[LightData], position: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return what :func:`sample_extent` does; of shaped lights, some directions are where that leaves most of them."""
    aim = aim_of(light, position)
    d = LightDirection()
    if u[0] < aim.share:
        d = meet_extent(light, position, aimed_direction(aim, wp.vec2(u[0] / aim.share, u[1])))
    else:
        d = sample_extent(light, position, wp.vec2((u[0] - aim.share) / (1.0 - aim.share), u[1]))
    if aim.share > 0.0 and d.pdf > 0.0:
        d.pdf = (1.0 - aim.share) * d.pdf + aim.share * aimed_pdf(aim, d.wi)
    return d


@wp.func
def meet_shaped(light: wp.ref[LightData], position: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_shaped` makes of a unit direction that comes from elsewhere."""
    d = meet_extent(light, position, wi)
    aim = aim_of(light, position)
    if aim.share > 0.0 and d.pdf > 0.0:
        d.pdf = (1.0 - aim.share) * d.pdf + aim.share * aimed_pdf(aim, wi)
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
