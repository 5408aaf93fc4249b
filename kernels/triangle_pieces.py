# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pieces of a triangle of a mesh light over which its radiance hardly varies.

A triangle is halved through its longest side, and its halves again, until what is left is such a piece: where a cone's
rim, a sharp focus or a fine profile is, or the surface near, pieces are small, elsewhere large. Halves 2 k and 2 k + 1
are those of piece k, so that no stack is needed to go through them.

Reference: Rivara (1984), Algorithms for Refining Triangular Grids Suitable for Adaptive and Multigrid Techniques,
International Journal for Numerical Methods in Engineering 20(4).
"""

import warp as wp

from .codes import VARIED
from .constants import (
    FINEST_PIECE,
    FOCUS_PIECE,
    HORIZON_PIECE,
    PROFILE_PIECE,
    RIM_PIECE,
    SLIVER_PIECE,
    SOFT_PIECE,
    WIDE_PIECE,
)
from .light_direction import half_angle
from .light_structs import LightData, LightMeshData, LightTriangle
from .light_triangle import middle_of
from .light_variation import CUT, DARK, EVEN, angle_to_axis, cone_view, focus_rate, is_profile_cut, profile_cell
from .meridian import MeridianView, meridian_view
from .scene_structs import SceneData

RIM = wp.constant(3)
"""What :func:`piece_view` says besides: a cone's or a profile's end cuts a piece that is as small as such ones get."""


@wp.func
def ball_square(triangle: LightTriangle) -> float:
    """Return the squared radius of the ball about a triangle's middle that holds it."""
    middle = (triangle.side_x + triangle.side_y) / 3.0
    size2 = wp.max(wp.length_sq(middle), wp.length_sq(triangle.side_x - middle))
    return wp.max(size2, wp.length_sq(triangle.side_y - middle))


@wp.func
def ball_of_mesh(scene: wp.ref[SceneData], mesh: LightMeshData) -> wp.vec4:
    """Return the centre of a ball that holds a mesh light, and its squared radius."""
    triangle = scene.light_triangles[mesh.offset]
    center = middle_of(triangle)
    size2 = ball_square(triangle)
    if mesh.leaves > 1:
        whole = scene.light_clusters[mesh.clusters + 1]
        center = whole.center
        size2 = whole.radius * whole.radius
    return wp.vec4(center[0], center[1], center[2], size2)


@wp.func
def half_triangle(triangle: LightTriangle, is_second: bool) -> LightTriangle:
    """Return one of the two triangles that a cut from the middle of the longest side makes, wound as it is."""
    x = triangle.side_x
    y = triangle.side_y
    x2 = wp.length_sq(x)
    y2 = wp.length_sq(y)
    across2 = wp.length_sq(y - x)
    half = triangle
    if x2 >= y2 and x2 >= across2:
        half.side_x = 0.5 * x
        if is_second:
            half.origin = triangle.origin + 0.5 * x
            half.side_y = y - 0.5 * x
    elif y2 >= across2:
        half.side_y = 0.5 * y
        if is_second:
            half.origin = triangle.origin + 0.5 * y
            half.side_x = x - 0.5 * y
    elif is_second:
        half.side_x = 0.5 * (x + y)
    else:
        half.side_y = 0.5 * (x + y)
    return half


@wp.func
def piece_of(triangle: LightTriangle, node: int) -> LightTriangle:
    """Return a piece of a triangle, which itself is piece 1; the halves of piece k are 2 k and 2 k + 1."""
    bit = int(1)
    while 2 * bit <= node:
        bit = 2 * bit
    piece = triangle
    while bit > 1:
        bit = bit / 2
        piece = half_triangle(piece, (node / bit) % 2 == 1)
    return piece


@wp.struct
class Grain:
    """How small pieces of a mesh light's triangles get, as seen from a surface: half angles [rad]."""

    rim: wp.float32
    """Of those that the end of a cone or a profile cuts."""
    finest: wp.float32
    """Of those that are cut for their profile."""
    meridians: MeridianView
    """Of a light that has them: where its radiance varies too much over a triangle, it is summed along the edges."""


@wp.func
def grain_of(scene: wp.ref[SceneData], light: wp.ref[LightData], mesh: LightMeshData, position: wp.vec3) -> Grain:
    """Return how small pieces of a mesh light get: by how large it looks, how wide its cone is, and what that leaves.

    Of a light whose radiance does not vary none are asked for, and all is 0.

    Args:
        scene: Lights' triangles and clusters.
        light: The light.
        mesh: Its triangles.
        position: Of the surface.
    """
    grain = Grain()
    if (light.varies & VARIED) == 0:
        return grain
    ball = ball_of_mesh(scene, mesh)
    center = wp.vec3(ball[0], ball[1], ball[2])
    size2 = ball[3]
    half = half_angle(size2, wp.length_sq(center - position))
    reach = light.cone_angle - angle_to_axis(light, wp.normalize(center - position)) + half
    grain.rim = RIM_PIECE * wp.max(wp.min(wp.min(light.cone_angle, half), reach), SLIVER_PIECE * half)
    grain.finest = FINEST_PIECE * half
    grain.meridians = meridian_view(scene, light, center - position, size2)
    return grain


@wp.func
def piece_view(
    scene: wp.ref[SceneData], light: wp.ref[LightData], piece: LightTriangle, n: wp.vec3, grain: wp.ref[Grain]
) -> int:
    """Return whether a piece of a triangle is DARK, has an EVEN radiance, is at its RIM, or has to be CUT.

    Args:
        scene: Profiles.
        light: The light.
        piece: Its origin as seen from the surface.
        n: The surface's unit normal.
        grain: How small pieces get.
    """
    middle = middle_of(piece)
    size2 = ball_square(piece)
    height = wp.dot(n, middle)
    is_low = height * height < size2
    if height <= 0.0 and not is_low:
        return DARK
    view = cone_view(light, middle, size2)
    if view == DARK:
        return DARK
    half = half_angle(size2, wp.length_sq(middle))
    if half > WIDE_PIECE:
        return CUT
    theta = angle_to_axis(light, wp.normalize(middle))
    if view == CUT:
        # Towards the rim of a soft cone little is left, of which a point more or less makes much.
        soft = wp.min(light.cone_angle * light.cone_softness, wp.max(light.cone_angle - theta, 0.0))
        if half > wp.max(grain.rim, SOFT_PIECE * soft):
            return CUT
        view = RIM if soft < half / SOFT_PIECE else int(EVEN)
    limit = HORIZON_PIECE if is_low else FOCUS_PIECE
    if light.focus > 0.0 and half * focus_rate(light, theta, half) > limit:
        return CUT
    if light.profile >= 0:
        if is_profile_cut(scene.profiles[light.profile], theta, half):
            if half > grain.rim:
                return CUT
            view = int(RIM)
        if half > wp.max(PROFILE_PIECE * profile_cell(scene.profiles[light.profile], theta, half), grain.finest):
            return CUT
    return view
