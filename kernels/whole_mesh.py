# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A mesh light as a whole: the irradiance from its parts, past the rest of it."""

import warp as wp

from .cluster_walk import next_cluster
from .codes import VARIED
from .constants import LEAST_DIVISOR, LIGHT_CLEARANCE, SEEN_POINTS
from .light import LightSample
from .light_structs import LightData, LightMeshData
from .mesh_parts import part_of_mesh
from .mesh_visibility import SeenPoints, is_free, look_past_rest
from .scene_structs import SceneData
from .triangle_pieces import grain_of
from .vector import face_forward


@wp.struct
class MeshSum:
    """What the parts of a mesh light send to a surface."""

    flux: wp.vec3
    """Vector irradiance from all of them, as in ``VisiblePart``; so too ``arriving``."""
    arriving: wp.vec3
    target: wp.vec3
    """From the surface to where its shadow ray goes: what adds most, or what is seen nearest to ``middle``."""
    normal: wp.vec3
    """There, of either sign and any length."""
    most: wp.float32
    """What that adds."""
    middle: wp.vec3
    """Mean of their places, by what they send, from the surface."""
    amount: wp.float32
    """All that they send."""
    hideable: wp.float32
    """What of it other parts of the light may be before."""


@wp.func(inline=False)
def sum_parts(
    scene: wp.ref[SceneData], light: wp.ref[LightData], mesh: wp.ref[LightMeshData], position: wp.vec3, n: wp.vec3
) -> MeshSum:
    """Return what the parts of a mesh light send to a surface, nothing in between: its triangles, far ones in clusters.

    Args:
        scene: Lights' triangles and clusters, profiles.
        light: The light.
        mesh: Its triangles.
        position: Of the surface.
        n: Its unit normal.
    """
    sum = MeshSum()
    grain = grain_of(scene, light, mesh, position)
    node = int(1)
    while True:
        part = part_of_mesh(scene, light, mesh, node, position, n, grain)
        amount = wp.length(part.irradiance)
        if amount > 0.0:
            sum.flux += part.irradiance
            sum.arriving += part.arriving
            sum.middle += part.center * amount
            sum.amount += amount
            if not is_free(part):
                sum.hideable += amount
            if amount > sum.most:
                sum.most = amount
                sum.target = part.center
                sum.normal = part.normal
        node = next_cluster(node, part.is_cut != 0)
        if node == 1:
            break
    sum.middle = sum.middle / wp.max(sum.amount, LEAST_DIVISOR)
    return sum


@wp.func
def aim_nearest(sum: wp.ref[MeshSum], middle: wp.vec3, center: wp.vec3, normal: wp.vec3, nearest: float) -> float:
    """Let the shadow ray go to a point of a light that is seen if none yet is as near to its middle.

    Args:
        sum: Takes the target.
        middle: Of the light as seen, from the surface.
        center: Of the point, from the surface.
        normal: There.
        nearest: Squared distance of the target, so far, from the middle.

    Returns:
        What is then the nearest.
    """
    off = wp.length_sq(center - middle)
    if off < nearest:
        sum.target = center
        sum.normal = normal
        return off
    return nearest


@wp.func(inline=False)
def sum_seen_parts(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    mesh: wp.ref[LightMeshData],
    position: wp.vec3,
    n: wp.vec3,
    all: wp.ref[MeshSum],
) -> MeshSum:
    """Return what a surface gets of a mesh light past the rest of it.

    ``SEEN_POINTS`` of it are looked for, one after each such share of what other parts may be before, in the order in
    which triangles lie along a curve; whether it is seen tells about the share.

    Args:
        scene: Lights' triangles and clusters, profiles.
        light: The light.
        mesh: Its triangles.
        position: Of the surface.
        n: Its unit normal.
        all: What all parts send, nothing in between.
    """
    sum = MeshSum()
    grain = grain_of(scene, light, mesh, position)
    step = all.hideable / float(SEEN_POINTS)
    waiting = 0.5 * step
    flux = wp.vec3(0.0, 0.0, 0.0)
    arriving = wp.vec3(0.0, 0.0, 0.0)
    nearest = float(wp.inf)
    seen = SeenPoints()
    node = int(1)
    while True:
        part = part_of_mesh(scene, light, mesh, node, position, n, grain)
        amount = wp.length(part.irradiance)
        if amount > 0.0:
            if is_free(part):
                sum.flux += part.irradiance
                sum.arriving += part.arriving
                nearest = aim_nearest(sum, all.middle, part.center, part.normal, nearest)
            else:
                flux += part.irradiance
                arriving += part.arriving
                waiting += amount
                points = int(waiting / step)
                if points > 0:
                    waiting -= float(points) * step
                    seen = look_past_rest(scene, mesh, node, points, position, n)
                    sum.flux += flux * seen.share
                    sum.arriving += arriving * seen.share
                    flux = wp.vec3(0.0, 0.0, 0.0)
                    arriving = wp.vec3(0.0, 0.0, 0.0)
                    if seen.share > 0.0:
                        nearest = aim_nearest(sum, all.middle, seen.center, seen.normal, nearest)
        node = next_cluster(node, part.is_cut != 0)
        if node == 1:
            break
    sum.flux += flux * seen.share
    sum.arriving += arriving * seen.share
    return sum


@wp.func
def whole_mesh(
    scene: wp.ref[SceneData], light: wp.ref[LightData], mesh: wp.ref[LightMeshData], position: wp.vec3, n: wp.vec3
) -> LightSample:
    """Return how a mesh light reaches a surface as a whole: what of it faces the surface, past the rest of it.

    Triangles are summed by Lambert's formula, clipped at the horizon. Of more than ``MESH_LIGHT_EXACT``, clusters that
    face the surface as a whole, above its horizon, and whose radius is below ``CLUSTER_SIZE`` of their distance, count
    as one patch. Where the light is shaped or has a profile, triangles are cut into pieces, and clusters count as one
    patch only where its radiance is even over them.

    Args:
        scene: Lights' triangles and clusters, profiles.
        light: The light.
        mesh: Its triangles.
        position: Of the surface.
        n: Its unit normal.
    """
    s = LightSample()
    sum = sum_parts(scene, light, mesh, position, n)
    if sum.hideable > 0.0:
        sum = sum_seen_parts(scene, light, mesh, position, n, sum)
    total = wp.length(sum.flux)
    if total == 0.0:
        return s
    # Short of the mesh itself, also where the ray, which starts a little off the surface, grazes it.
    target = sum.target
    target -= face_forward(wp.normalize(sum.normal), target) * (wp.length(target) * LIGHT_CLEARANCE)
    s.wi = sum.flux / total
    s.distance = wp.length(target)
    s.to_shadow = target / s.distance
    if (light.varies & VARIED) == 0:
        s.irradiance = light.emission * total
    else:
        s.irradiance = sum.arriving / wp.max(wp.dot(n, s.wi), LEAST_DIVISOR)
    return s


@wp.func
def mesh_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return what :func:`whole_mesh` does; of what shines to both sides and is closed, what is seen from where one is.

    From outside its inside is hidden, although nothing else is in between.

    Args:
        scene: Lights' triangles and clusters, profiles.
        light: The light.
        position: Of the surface.
        n: Its unit normal.
    """
    mesh = scene.light_meshes[light.mesh]
    if mesh.is_double_sided != 0 and mesh.is_closed != 0:
        mesh.is_double_sided = 0
        s = whole_mesh(scene, light, mesh, position, n)
        if s.distance > 0.0:
            return s
        mesh.is_double_sided = 1
    return whole_mesh(scene, light, mesh, position, n)
