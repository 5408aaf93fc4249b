# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A light as a whole: its irradiance in closed form, times its mean radiance, without noise."""

import warp as wp

from .codes import UNEVEN, VARIED
from .constants import (
    CANCELLED,
    CONE_CELLS,
    FAR_FOCUS,
    FAR_LIGHT,
    FOCUS_CELLS,
    LEAST_DIVISOR,
    LIGHT_CELLS,
    LIGHT_CELLS_FINE,
    LIGHT_CELLS_MAX,
    SLIVER_CELLS,
)
from .emission import EmissionCell, light_emission, mean_emission, rect_coordinates
from .light import (
    KIND_DISTANT,
    KIND_MESH,
    KIND_POINT,
    LightSample,
    sample_light,
)
from .light_direction import half_angle
from .light_structs import LightData
from .light_variation import (
    CUT,
    DARK,
    EVEN,
    angle_to_axis,
    cone_view,
    focus_rate,
    is_profile_even,
    profile_cell,
    rim_angle,
)
from .outline import SeenPart, bounding_square, cone_flux, outlined_light
from .profile import profile_factor
from .sample_light import light_radiance, sample_extent
from .scene_structs import SceneData
from .vector import max_magnitude
from .whole_mesh import mesh_light


@wp.func
def has_closed_form(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> bool:
    """Return whether a light's closed form, that of its whole and even shape, shaped as at its centre, is what counts.

    It is not where the horizon cuts through the light, and for one whose radiance or shape varies where that is seen.

    Args:
        scene: Profiles.
        light: The light.
        position: Of the surface.
        n: Its unit normal.
    """
    if light.kind == KIND_POINT:
        return True
    if light.kind == KIND_DISTANT:
        height = wp.dot(n, light.axis_z)
        return light.cap < 1.0 and height * height >= light.cap * (2.0 - light.cap)
    if (light.varies & UNEVEN) != 0:
        return False
    center = light.position - position
    size2 = bounding_square(light)
    height = wp.dot(n, center)
    if height * height < size2:
        return False
    if light.varies == 0:
        return True
    d2 = wp.length_sq(center)
    if d2 < FAR_LIGHT * FAR_LIGHT * size2 or cone_view(light, center, size2) != EVEN:
        return False
    half = half_angle(size2, d2)
    theta = angle_to_axis(light, wp.normalize(center))
    if light.meridians >= 0 and theta + half > rim_angle(light):
        return False
    if light.focus > 0.0 and half * focus_rate(light, theta, half) > FAR_FOCUS:
        return False
    return light.profile < 0 or is_profile_even(scene.profiles[light.profile], theta, half)


@wp.func
def even_count(count: float) -> int:
    """Return a number of cells rounded up to an even one, up to ``LIGHT_CELLS_MAX``."""
    return 2 * int(wp.ceil(0.5 * wp.min(count, float(LIGHT_CELLS_MAX))))


@wp.func
def cell_count(scene: wp.ref[SceneData], light: wp.ref[LightData], to_center: wp.vec3, size2: float, view: int) -> int:
    """Return into how many cells each way a light is cut, so that its radiance varies little within one.

    Args:
        scene: Profiles.
        light: The light.
        to_center: From the surface to its centre.
        size2: Its :func:`bounding_square`.
        view: Of its cone.
    """
    half = half_angle(size2, wp.length_sq(to_center))
    theta = angle_to_axis(light, wp.normalize(to_center))
    count = float(LIGHT_CELLS)
    if view == CUT or light.profile >= 0 or light.texture >= 0:
        count = float(LIGHT_CELLS_FINE)
    if view == CUT:
        count = wp.max(count, CONE_CELLS * 2.0 * half / wp.max(light.cone_angle, 1.0e-3))
    if light.profile >= 0:
        count = wp.max(count, 2.0 * half / profile_cell(scene.profiles[light.profile], theta, half))
    if light.focus > 0.0:
        count = wp.max(count, FOCUS_CELLS * 2.0 * half * focus_rate(light, theta, half))
    return even_count(count)


@wp.struct
class MeanRadiance:
    """Of what a surface sees of a light, by what each part would send there if all were alike."""

    radiance: wp.vec3
    share: wp.float32
    """Of what it would be, were it all as bright: the squared mean by the mean square, of a hard cone what is lit."""


@wp.func(inline=False)
def mean_radiance(
    scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3, count: int, seen: SeenPart
) -> MeanRadiance:
    """Return the mean of a light's radiance over what a surface sees of it.

    The light is cut into cells, squares of the unit square that its samplers map to it. Four cells at a time tell how
    wide each of them is in the cone's angle and in the texture, over which both are averaged: without that, a rim that
    cuts through the light would jump from cell to cell.

    Args:
        scene: Textures and profiles.
        light: A rect, disk, sphere or cylinder.
        position: Of the surface.
        n: Its unit normal.
        count: Cells each way; even.
        seen: What of the light is above the horizon: its middle counts where no cell's is.
    """
    mean = MeanRadiance()
    total = wp.vec3(0.0, 0.0, 0.0)
    whole = float(0.0)
    first = float(0.0)
    second = float(0.0)
    step = 1.0 / float(count)
    for block in range(count * count / 4):
        row = 2 * (block / (count / 2))
        column = 2 * (block - (row / 2) * (count / 2))
        u = wp.vec2(float(column) + 0.5, float(row) + 0.5) * step
        a = sample_extent(light, position, u)
        b = sample_extent(light, position, u + wp.vec2(step, 0.0))
        c = sample_extent(light, position, u + wp.vec2(0.0, step))
        d = sample_extent(light, position, u + wp.vec2(step, step))
        cell = EmissionCell()
        if light.cone_angle < wp.pi or light.profile >= 0:
            angle_a = angle_to_axis(light, a.wi)
            angle_b = angle_to_axis(light, b.wi)
            angle_c = angle_to_axis(light, c.wi)
            angle_d = angle_to_axis(light, d.wi)
            across = 0.5 * (angle_b - angle_a + angle_d - angle_c)
            down = 0.5 * (angle_c - angle_a + angle_d - angle_b)
            # A side of width w has a variance of w^2 / 12.
            cell.spread = (20.0 / 12.0) * (across * across + down * down)
        if light.texture >= 0:
            st_a = rect_coordinates(light, position + a.wi * a.distance - light.position)
            cell.across = rect_coordinates(light, position + b.wi * b.distance - light.position) - st_a
            cell.down = rect_coordinates(light, position + c.wi * c.distance - light.position) - st_a
        for k in range(wp.int32(4)):
            one = a
            if k == 1:
                one = b
            elif k == 2:
                one = c
            elif k == 3:
                one = d
            cosine = wp.dot(n, one.wi)
            if one.pdf > 0.0 and cosine > 0.0:
                weight = cosine / one.pdf
                emission = mean_emission(scene, light, position, one.wi, one.distance, cell)
                total += emission * weight
                whole += weight
                brightness = max_magnitude(emission)
                first += brightness * weight
                second += brightness * brightness * weight
    if whole > 0.0:
        mean.radiance = total / whole
        mean.share = first * (first / wp.max(second * whole, LEAST_DIVISOR))
    else:
        mean.radiance = light_emission(scene, light, position, wp.normalize(seen.middle), wp.length(seen.middle))
        mean.share = 1.0
    return mean


@wp.func(inline=False)
def summed_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return how a light reaches a surface where its plain closed form is not what counts.

    Args:
        scene: Textures and profiles.
        light: One with an extent, no mesh.
        position: Of the surface.
        n: Its unit normal.
    """
    s = LightSample()
    if light.kind == KIND_DISTANT:
        flux = cone_flux(light.axis_z, light.cap, n)
        amount = wp.length(flux)
        if amount == 0.0:
            return s
        s.wi = flux / amount
        s.irradiance = light_radiance(light, s.wi, 0.0) * amount
        s.to_shadow = light.axis_z if wp.dot(n, light.axis_z) > 0.0 else s.wi
        s.distance = wp.inf
        return s
    to_center = light.position - position
    size2 = bounding_square(light)
    view = cone_view(light, to_center, size2)
    if view == DARK:
        return s
    seen = outlined_light(scene, light, position, n)
    amount = wp.length(seen.flux)
    if amount == 0.0:
        return s
    s.wi = seen.flux / amount
    target = to_center if wp.dot(n, to_center) > 0.0 else seen.middle
    s.distance = wp.length(target)
    s.to_shadow = target / s.distance
    if (light.varies & VARIED) == 0:
        s.irradiance = light.emission * amount
        return s
    tinted = wp.cw_mul(light.emission, light.focus_tint)
    plain = light.emission - tinted
    flux = seen.shaped.focused * max_magnitude(plain) + seen.shaped.open * max_magnitude(tinted)
    facing = wp.dot(n, flux)
    if light.meridians >= 0 and facing > CANCELLED * seen.shaped.summed * max_magnitude(light.emission):
        s.wi = wp.normalize(flux)
        arriving = plain * wp.dot(n, seen.shaped.focused) + tinted * wp.dot(n, seen.shaped.open)
        s.irradiance = arriving / wp.dot(n, s.wi)
        return s
    count = cell_count(scene, light, to_center, size2, view)
    mean = mean_radiance(scene, light, position, n, count, seen)
    finer = even_count(SLIVER_CELLS / wp.max(mean.share, 1.0e-3))
    if mean.share > 0.0 and finer > count and (view == CUT or light.profile >= 0):
        mean = mean_radiance(scene, light, position, n, finer, seen)
    s.irradiance = mean.radiance * amount
    return s


@wp.func
def whole_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return how a light reaches a surface, shaping and profile included, shadows not.

    The shadow ray goes to the light's centre, or, where that is below the horizon, to the middle of what is above it.

    Args:
        scene: Textures and profiles.
        light: Of any kind.
        position: Of the surface.
        n: Its unit normal.
    """
    if light.kind == KIND_MESH:
        return mesh_light(scene, light, position, n)
    s = LightSample()
    if has_closed_form(scene, light, position, n):
        s = sample_light(light, position)
    else:
        return summed_light(scene, light, position, n)
    if light.profile >= 0:
        s.irradiance = s.irradiance * profile_factor(scene, light.profile, s.wi, 0.0)
    return s
