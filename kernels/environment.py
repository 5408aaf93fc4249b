# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What lies behind the scene: domes and the background colour."""

import warp as wp

from .codes import IRRADIANCE_HEIGHT, IRRADIANCE_WIDTH
from .constants import LEAST_SINE, MAX_ANISOTROPY
from .features import Features, PlainScene
from .frame_structs import FrameData
from .light_structs import DomeData
from .per_type import per_type
from .ray_structs import RayDifferential
from .scene_structs import SceneData
from .texture import WRAP_CLAMP, WRAP_REPEAT, sample_footprint, sample_image
from .visibility import holds


@wp.func
def latlong_from_direction(dome: DomeData, direction: wp.vec3) -> wp.vec2:
    """Return the image coordinates of a unit world direction, (0, 0) being the image's lower left corner.

    Reference: UsdLux DomeLight, latlong: the image's centre is local +Z, its top +Y, longitude pi / 2 is local +X.
    """
    x = wp.dot(dome.axis_x, direction)
    y = wp.dot(dome.axis_y, direction)
    z = wp.dot(dome.axis_z, direction)
    u = 0.5 - wp.atan2(x, z) / (2.0 * wp.pi)
    v = 1.0 - wp.acos(wp.clamp(y, -1.0, 1.0)) / wp.pi
    return wp.vec2(u, v)


@wp.func
def dome_radiance(scene: wp.ref[SceneData], dome: DomeData, direction: wp.vec3) -> wp.vec3:
    """Return what a dome sends from a unit direction."""
    if dome.image < 0:
        return dome.radiance
    st = latlong_from_direction(dome, direction)
    texel = sample_image(scene, scene.images[dome.image], st[0], st[1], WRAP_REPEAT, WRAP_CLAMP)
    return wp.cw_mul(dome.radiance, wp.vec3(texel[0], texel[1], texel[2]))


@wp.func
def latlong_differential(dome: DomeData, direction: wp.vec3, change: wp.vec3) -> wp.vec2:
    """Return how ``latlong_from_direction`` changes where the unit direction does.

    About the poles, where texels are narrower than 1 / MAX_ANISOTROPY of their height, it turns as if they were not: a
    longer footprint would be averaged over many rows, and what one row shows there differs little.
    """
    x = wp.dot(dome.axis_x, direction)
    z = wp.dot(dome.axis_z, direction)
    off_pole = wp.sqrt(wp.max(x * x + z * z, LEAST_SINE))
    narrow = wp.max(off_pole, 1.0 / float(MAX_ANISOTROPY))
    turn = (wp.dot(dome.axis_x, change) * z - wp.dot(dome.axis_z, change) * x) / (off_pole * narrow)
    rise = wp.dot(dome.axis_y, change) / off_pole
    return wp.vec2(-turn / (2.0 * wp.pi), rise / wp.pi)


@wp.func
def dome_radiance_seen(
    scene: wp.ref[SceneData], dome: DomeData, direction: wp.vec3, ray: wp.ref[RayDifferential]
) -> wp.vec3:
    """Return what a ray brings back from a dome: the mean over the directions that it stands for."""
    if dome.image < 0 or scene.is_filtered == 0:
        return dome_radiance(scene, dome, direction)
    st = latlong_from_direction(dome, direction)
    across = latlong_differential(dome, direction, ray.direction_x)
    down = latlong_differential(dome, direction, ray.direction_y)
    texel = sample_footprint(scene, dome.image, st[0], st[1], across, down, WRAP_REPEAT, WRAP_CLAMP)
    return wp.cw_mul(dome.radiance, wp.vec3(texel[0], texel[1], texel[2]))


@wp.func
def dome_irradiance(scene: wp.ref[SceneData], dome: wp.ref[DomeData], normal: wp.vec3) -> wp.vec3:
    """Return a dome's cosine-weighted, unoccluded irradiance of a surface with unit world ``normal``."""
    if dome.irradiance_offset < 0:
        return dome.radiance * wp.pi
    st = latlong_from_direction(dome, normal)
    x = st[0] * float(IRRADIANCE_WIDTH) - 0.5
    y = st[1] * float(IRRADIANCE_HEIGHT - 1)
    x_floor = wp.floor(x)
    y_floor = wp.floor(y)
    x0 = (int(x_floor) + IRRADIANCE_WIDTH) % IRRADIANCE_WIDTH
    x1 = (x0 + 1) % IRRADIANCE_WIDTH
    row0 = dome.irradiance_offset + int(y_floor) * IRRADIANCE_WIDTH
    row1 = dome.irradiance_offset + wp.min(int(y_floor) + 1, IRRADIANCE_HEIGHT - 1) * IRRADIANCE_WIDTH
    fx = x - x_floor
    fy = y - y_floor
    bottom = scene.irradiance[row0 + x0] * (1.0 - fx) + scene.irradiance[row0 + x1] * fx
    top = scene.irradiance[row1 + x0] * (1.0 - fx) + scene.irradiance[row1 + x1] * fx
    return bottom * (1.0 - fy) + top * fy


@per_type
def environment(
    scene: wp.ref[SceneData],
    frame: wp.ref[FrameData],
    direction: wp.vec3,
    ray: wp.ref[RayDifferential],
    sender: int,
    features: Features,
):
    """Return what a ray that leaves the scene brings back, and the alpha that an eye ray gets with it.

    Eye rays (``sender`` -1) see the visible domes. Reflections and refractions by an instance have the light of the
    domes that illuminate it. Without any dome there is the background colour.
    """
    color = wp.vec3(0.0, 0.0, 0.0)
    is_covered = int(0)
    for k in range(scene.dome_count):
        dome = scene.domes[k]
        if sender >= 0 or dome.is_visible != 0:
            if sender < 0 or holds(scene.links, dome.receivers, sender):
                color += dome_radiance_seen(scene, dome, direction, ray)
            is_covered += 1
    if is_covered > 0:
        return color, 1.0
    return frame.background, frame.background_alpha


@wp.func
def environment(
    scene: wp.ref[SceneData],
    frame: wp.ref[FrameData],
    direction: wp.vec3,
    ray: wp.ref[RayDifferential],
    sender: int,
    features: wp.ref[PlainScene],
):
    """Return the background colour and its alpha."""
    return frame.background, frame.background_alpha
