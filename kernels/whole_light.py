# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A light as a whole: by closed form where that is exact, else summed over fixed points of the light, without noise."""

import warp as wp

from .constants import FAR_LIGHT, LIGHT_POINTS
from .emission import light_emission
from .light import KIND_DISTANT, KIND_MESH, KIND_POINT, LightSample, sample_light
from .profile import profile_factor
from .sample_light import sample_extent
from .sample_mesh import mesh_light
from .sampling import radical_inverse, sobol_second, unit_float
from .structs import LightData, SceneData
from .vector import max_magnitude


@wp.func
def is_uneven(light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> bool:
    """Return whether the closed form, that of the light's whole and even shape, is not what a surface gets.

    That is where the horizon cuts through the light, and where one whose radiance or shape varies is near.

    Args:
        light: The light.
        position: Of the surface.
        n: Its unit normal.
    """
    if light.kind == KIND_POINT:
        return False
    if light.kind == KIND_DISTANT:
        height = wp.dot(n, light.axis_z)
        return light.cap >= 1.0 or height * height < light.cap * (2.0 - light.cap)
    center = light.position - position
    size2 = wp.length_sq(light.half_x) + wp.length_sq(light.half_y) + wp.length_sq(light.half_z)
    if light.varies != 0 and wp.length_sq(center) < FAR_LIGHT * FAR_LIGHT * size2:
        return True
    height = wp.dot(n, center)
    return height * height < size2


@wp.func(inline=False)
def sum_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return how a light with an extent reaches a surface, summed over ``LIGHT_POINTS`` of its directions.

    The same ones everywhere, those of the samplers at the points of a (0, 2)-sequence, so that there is no noise. What
    lies below the horizon is left out.

    Args:
        scene: Textures and profiles.
        light: The light.
        position: Of the surface.
        n: Its unit normal.
    """
    s = LightSample()
    flux = wp.vec3(0.0, 0.0, 0.0)
    arriving = wp.vec3(0.0, 0.0, 0.0)
    whole = float(0.0)
    distance = float(0.0)
    for k in range(wp.int32(LIGHT_POINTS)):
        index = wp.uint32(k)
        middle = 0.5 / float(LIGHT_POINTS)
        u = wp.vec2(unit_float(radical_inverse(index)) + middle, unit_float(sobol_second(index)) + middle)
        d = sample_extent(light, position, u)
        cosine = wp.dot(n, d.wi)
        if d.pdf > 0.0 and cosine > 0.0:
            amount = light_emission(scene, light, position, d.wi, d.distance) / (d.pdf * float(LIGHT_POINTS))
            weight = max_magnitude(amount)
            flux += d.wi * weight
            distance += d.distance * weight
            whole += weight
            arriving += amount * cosine
    if whole <= 0.0:
        return s
    s.wi = wp.normalize(flux)
    s.irradiance = arriving / wp.dot(n, s.wi)
    s.to_shadow = s.wi
    s.distance = distance / whole
    center = light.position - position
    if light.kind == KIND_DISTANT:
        center = light.axis_z
    elif wp.dot(n, center) > 0.0:
        s.distance = wp.length(center)
    if wp.dot(n, center) > 0.0:
        s.to_shadow = wp.normalize(center)
    return s


@wp.func
def whole_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return how a light reaches a surface, shaping and profile included, shadows not.

    The shadow ray goes to the light's centre, or, where that is below the horizon, along the mean direction of what is
    above it.

    Args:
        scene: Textures and profiles.
        light: Of any kind.
        position: Of the surface.
        n: Its unit normal.
    """
    s = LightSample()
    if light.kind == KIND_MESH:
        s = mesh_light(scene, light, position, n)
    elif is_uneven(light, position, n):
        return sum_light(scene, light, position, n)
    else:
        s = sample_light(light, position)
    if light.profile >= 0:
        s.irradiance = s.irradiance * profile_factor(scene, light.profile, s.to_shadow)
    return s
