# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What lights send out, point by point, and which of them a ray sees."""

import warp as wp

from .features import Features, PlainScene
from .frame_structs import FrameData
from .light import KIND_DISTANT, KIND_MESH, cone_factor
from .light_structs import LightData
from .per_type import per_type
from .profile import profile_factor
from .ray_structs import RayTask
from .sample_light import has_extent, light_radiance, meet_extent
from .scene_structs import SceneData
from .texture import WRAP_CLAMP, sample_footprint
from .visibility import holds


@wp.struct
class SeenLight:
    """A light that a ray meets."""

    row: wp.int32
    """Of ``SceneData.lights``; -1: none."""
    distance: wp.float32


@wp.func
def rect_coordinates(light: wp.ref[LightData], from_center: wp.vec3) -> wp.vec2:
    """Return the texture coordinates of a point of a rect light, (0, 0) being the image's lower left corner.

    The image's left edge is at local +X, its top at +Y: whom the light shines on sees it upright and unmirrored.

    Reference: UsdLux RectLight: "a texture file's min coordinates should be at (+X, +Y)".
    """
    n = wp.cross(light.half_x, light.half_y)
    n2 = wp.length_sq(n)
    a = wp.dot(wp.cross(from_center, light.half_y), n) / n2
    b = wp.dot(wp.cross(light.half_x, from_center), n) / n2
    return wp.vec2(0.5 - 0.5 * a, 0.5 + 0.5 * b)


@wp.struct
class EmissionCell:
    """Part of a light over which a mean of its radiance is taken; of no size where none is."""

    spread: wp.float32
    """Of the angle to the light's axis, as in ``light.cone_factor``."""
    across: wp.vec2
    """Change of texture coordinates along one side of it; so too ``down``, along the other."""
    down: wp.vec2


@wp.func
def mean_emission(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    position: wp.vec3,
    wi: wp.vec3,
    distance: float,
    cell: wp.ref[EmissionCell],
) -> wp.vec3:
    """Return the mean radiance of a light over a cell of it: of its cone's rim and of its texture.

    Args:
        scene: Textures and profiles.
        light: One with an extent.
        position: Whence it is seen.
        wi: Unit direction to the middle of the cell.
        distance: To that.
        cell: The cell.
    """
    radiance = light_radiance(light, wi, cell.spread)
    if light.texture >= 0:
        st = rect_coordinates(light, position + wi * distance - light.position)
        image = scene.light_textures[light.texture].image
        across = cell.across
        down = cell.down
        texel = sample_footprint(scene, image, st[0], st[1], across, down, WRAP_CLAMP, WRAP_CLAMP)
        plain = wp.cw_mul(scene.light_textures[light.texture].radiance, wp.vec3(texel[0], texel[1], texel[2]))
        radiance = wp.cw_mul(plain, cone_factor(light, wp.dot(wi, light.axis_z), cell.spread))
    if light.profile >= 0:
        radiance = radiance * profile_factor(scene, light.profile, wi, cell.spread)
    return radiance


@wp.func
def light_emission(
    scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, wi: wp.vec3, distance: float
) -> wp.vec3:
    """Return the radiance of a light at one of its points: with its texture, its shaping and its profile.

    Args:
        scene: Textures and profiles.
        light: One with an extent.
        position: Whence the point is seen.
        wi: Unit direction to it.
        distance: To it.
    """
    cell = EmissionCell()
    return mean_emission(scene, light, position, wi, distance, cell)


@wp.func
def is_seen_as_shape(light: wp.ref[LightData]) -> bool:
    """Return whether a light has a shape that rays can meet; of a mesh they meet the mesh."""
    return has_extent(light) and light.kind != KIND_DISTANT and light.kind != KIND_MESH


@wp.func
def is_mirrored(light: wp.ref[LightData], lights_visible: int) -> bool:
    """Return whether mirror rays bring a light back: by its shape, or by the glowing mesh that shines."""
    return light.glows != 0 or (lights_visible != 0 and is_seen_as_shape(light))


@wp.func(inline=False)
def nearest_light(
    scene: wp.ref[SceneData], origin: wp.vec3, direction: wp.vec3, t_max: float, sender: int
) -> SeenLight:
    """Return the nearest light whose shining side a ray meets before ``t_max``.

    Args:
        scene: Lights.
        origin: Of the ray.
        direction: Unit.
        t_max: Where something else is met.
        sender: Instance that reflected or refracted the ray, which has to be linked to the light; -1: the eye.
    """
    seen = SeenLight()
    seen.row = -1
    seen.distance = t_max
    for k in range(scene.light_count):
        if is_seen_as_shape(scene.lights[k]):
            is_met = scene.lights[k].is_visible != 0
            if sender >= 0:
                is_met = holds(scene.links, scene.lights[k].receivers, sender)
            if is_met:
                met = meet_extent(scene.lights[k], origin, direction)
                if met.pdf > 0.0 and met.distance < seen.distance:
                    seen.row = k
                    seen.distance = met.distance
    return seen


@per_type
def light_met(
    scene: wp.ref[SceneData], frame: wp.ref[FrameData], task: wp.ref[RayTask], t: float, features: Features
) -> SeenLight:
    """Return the light that a ray of the tree meets before ``t``, where lights are visible."""
    if frame.lights_visible != 0:
        return nearest_light(scene, task.origin, task.direction, t, task.sender)
    seen = SeenLight()
    seen.row = -1
    seen.distance = t
    return seen


@wp.func
def light_met(
    scene: wp.ref[SceneData], frame: wp.ref[FrameData], task: wp.ref[RayTask], t: float, features: wp.ref[PlainScene]
) -> SeenLight:
    """Return that it meets none: none is visible."""
    seen = SeenLight()
    seen.row = -1
    seen.distance = t
    return seen


@per_type
def radiance_of_seen(
    scene: wp.ref[SceneData], seen: wp.ref[SeenLight], task: wp.ref[RayTask], features: Features
) -> wp.vec3:
    """Return what the light that a ray of the tree meets sends back along it."""
    return light_emission(scene, scene.lights[seen.row], task.origin, task.direction, seen.distance)


@wp.func
def radiance_of_seen(
    scene: wp.ref[SceneData], seen: wp.ref[SeenLight], task: wp.ref[RayTask], features: wp.ref[PlainScene]
) -> wp.vec3:
    """Return nothing: there is none."""
    return wp.vec3(0.0, 0.0, 0.0)
