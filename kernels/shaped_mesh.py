# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What arrives from a triangle, or a cluster of triangles, of a mesh light that is shaped or has a profile.

Where the light's radiance hardly varies over it, three points tell what a triangle sends. Else it is summed along its
edges, as the outlines of other lights are: see :mod:`.meridian`.

Where a light has no meridians, under a profile in a space that is more than turned, a triangle is cut into pieces over
which the radiance hardly varies: see :mod:`.triangle_pieces`.
"""

import warp as wp

from .cluster_walk import next_cluster
from .constants import CANCELLED, FAR_FOCUS, LEAST_DIVISOR, PIECES_MAX, ROUNDED, SMALL_PIECE
from .emission import EmissionCell, mean_emission
from .light_direction import half_angle
from .light_structs import LightData, LightMeshData, LightTriangle
from .light_triangle import VisiblePart, middle_of, polygon_above, triangle_irradiance
from .light_variation import CUT, DARK, EVEN, angle_to_axis, cone_view, focus_rate, is_profile_cut, is_profile_even
from .meridian import ShapedFlux, add_edge, meridian_view
from .scene_structs import SceneData
from .triangle_pieces import RIM, Grain, ball_square, half_triangle, piece_of, piece_view
from .vector import max_magnitude


@wp.func
def patch_view(scene: wp.ref[SceneData], light: wp.ref[LightData], to_center: wp.vec3, size2: float) -> int:
    """Return whether a light's radiance is the same all over a part of it, DARK or EVEN, or CUT: it is not.

    Args:
        scene: Profiles.
        light: The light.
        to_center: From the surface to the part's centre.
        size2: Squared radius of the ball that holds it.
    """
    view = cone_view(light, to_center, size2)
    if view != EVEN:
        return view
    half = half_angle(size2, wp.length_sq(to_center))
    theta = angle_to_axis(light, wp.normalize(to_center))
    if light.focus > 0.0 and half * focus_rate(light, theta, half) > FAR_FOCUS:
        return CUT
    if light.profile >= 0 and not is_profile_even(scene.profiles[light.profile], theta, half):
        return CUT
    return EVEN


@wp.func
def shade_patch(
    scene: wp.ref[SceneData], light: wp.ref[LightData], n: wp.vec3, to_center: wp.vec3, part: wp.ref[VisiblePart]
):
    """Make of what a patch of radiance 1 sends what one of the light's radiance at its centre does."""
    wi = wp.normalize(to_center)
    cell = EmissionCell()
    radiance = mean_emission(scene, light, wp.vec3(0.0, 0.0, 0.0), wi, 1.0, cell)
    part.arriving = radiance * wp.dot(n, part.irradiance)
    part.irradiance = part.irradiance * max_magnitude(radiance)


@wp.func
def add_piece(
    total: wp.ref[VisiblePart],
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    piece: LightTriangle,
    n: wp.vec3,
    view: int,
) -> float:
    """Add what a piece of a triangle sends to a surface; return by how much, brightest colour.

    That is what it would send with radiance 1, times its mean radiance by three points, the middles of its sides.

    Args:
        total: Its centre is weighed with what is returned.
        scene: Profiles.
        light: The light.
        piece: Its origin as seen from the surface, which its shining side faces.
        n: The surface's unit normal.
        view: Of the piece: EVEN or RIM.

    Reference: Strang and Fix (1973), An Analysis of the Finite Element Method, table 4.1: exact for parabolas.
    """
    x = piece.side_x
    y = piece.side_y
    area = wp.cross(x, y) / 6.0  # a third of it for each point
    a = piece.origin + 0.5 * x
    b = piece.origin + 0.5 * (x + y)
    c = piece.origin + 0.5 * y
    cell = EmissionCell()
    if view == RIM:
        angle_a = angle_to_axis(light, wp.normalize(a))
        angle_b = angle_to_axis(light, wp.normalize(b))
        angle_c = angle_to_axis(light, wp.normalize(c))
        mean = (angle_a + angle_b + angle_c) / 3.0
        # Each stands for a quarter of the triangle about it.
        cell.spread = (20.0 / 12.0) * (
            (angle_a - mean) * (angle_a - mean)
            + (angle_b - mean) * (angle_b - mean)
            + (angle_c - mean) * (angle_c - mean)
        )
    radiance = wp.vec3(0.0, 0.0, 0.0)
    flux = wp.vec3(0.0, 0.0, 0.0)
    whole = float(0.0)
    for k in range(wp.int32(3)):
        p = a
        if k == 1:
            p = b
        elif k == 2:
            p = c
        d2 = wp.max(wp.length_sq(p), LEAST_DIVISOR)
        wi = p / wp.sqrt(d2)
        patch = wi * (wp.abs(wp.dot(area, wi)) / d2)
        flux += patch
        weight = wp.dot(n, patch)
        if weight > 0.0:
            radiance += mean_emission(scene, light, wp.vec3(0.0, 0.0, 0.0), wi, 1.0, cell) * weight
            whole += weight
    middle = middle_of(piece)
    size2 = ball_square(piece)
    height = wp.dot(n, middle)
    center = middle
    if height * height < size2 or size2 > SMALL_PIECE * SMALL_PIECE * wp.length_sq(middle):
        part = triangle_irradiance(piece, n)
        flux = part.irradiance
        if wp.dot(area, middle) < 0.0:
            flux = -flux
        center = part.center
    if whole > 0.0:
        radiance = radiance / whole
    else:
        radiance = mean_emission(scene, light, wp.vec3(0.0, 0.0, 0.0), wp.normalize(center), 1.0, cell)
    brightness = max_magnitude(radiance)
    amount = brightness * wp.length(flux)
    total.irradiance += flux * brightness
    total.arriving += radiance * wp.max(wp.dot(n, flux), 0.0)
    total.center += center * amount
    return amount


@wp.func
def ends_within(scene: wp.ref[SceneData], light: wp.ref[LightData], triangle: LightTriangle) -> bool:
    """Return whether a light's cone or its profile may end within a triangle, its origin as seen from the surface."""
    middle = middle_of(triangle)
    size2 = ball_square(triangle)
    if light.profile >= 0:
        theta = angle_to_axis(light, wp.normalize(middle))
        if is_profile_cut(scene.profiles[light.profile], theta, half_angle(size2, wp.length_sq(middle))):
            return True
    return cone_view(light, middle, size2) == CUT


@wp.func
def holds_direction(triangle: LightTriangle, direction: wp.vec3) -> bool:
    """Return whether a direction from the surface meets a triangle, whose origin is as seen from there."""
    normal = wp.cross(triangle.side_x, triangle.side_y)
    down = wp.dot(normal, direction)
    away = wp.dot(normal, triangle.origin)
    if down * away <= 0.0:
        return False
    p = direction * (away / down) - triangle.origin
    u = wp.dot(normal, wp.cross(p, triangle.side_y))
    v = wp.dot(normal, wp.cross(triangle.side_x, p))
    return u >= 0.0 and v >= 0.0 and u + v <= wp.length_sq(normal)


@wp.func
def add_outline(
    total: wp.ref[VisiblePart],
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    triangle: LightTriangle,
    n: wp.vec3,
    grain: wp.ref[Grain],
) -> float:
    """Add what :func:`add_piece` does, by an integral along the edges: exact however the radiance varies.

    Args:
        total: See there, as for the other arguments.
        scene: Profiles, meridians.
        light: One that has meridians.
        triangle: Its origin as seen from the surface, which its shining side faces.
        n: The surface's unit normal.
        grain: How the meridians lie.
    """
    seen = polygon_above(triangle, n)
    # Of a near triangle that an end of the axis meets, the middle may be nearer to the other end, from which on the
    # sums would count what is outside of the outline.
    middle = middle_of(triangle)
    up = light.axis_z * wp.length(middle)
    if holds_direction(triangle, up):
        middle = up
    elif holds_direction(triangle, -up):
        middle = -up
    view = meridian_view(scene, light, middle, ball_square(triangle))
    view.step = wp.min(view.step, grain.meridians.step)
    shaped = ShapedFlux()
    for k in range(seen.count):
        a = seen.offsets[k]
        b = seen.offsets[(k + 1) % seen.count]
        add_edge(scene, light, view, seen.to_middle, a, b, shaped)
    # As with Lambert's formula the sign is that of the winding.
    sign = 1.0 if wp.dot(wp.cross(triangle.side_x, triangle.side_y), triangle.origin) > 0.0 else -1.0
    tinted = wp.cw_mul(light.emission, light.focus_tint)
    plain = light.emission - tinted
    flux = (shaped.focused * max_magnitude(plain) + shaped.open * max_magnitude(tinted)) * sign
    left = wp.dot(n, flux)
    whole = shaped.summed * max_magnitude(light.emission)
    if left <= CANCELLED * whole:
        # Few digits. Of what a focus leaves its middle tells more; a rim leaves little, or nothing.
        if not ends_within(scene, light, triangle):
            return add_piece(total, scene, light, triangle, n, EVEN)
        if left <= ROUNDED * whole:
            return 0.0
    amount = wp.length(flux)
    total.irradiance += flux
    total.arriving += (plain * wp.dot(n, shaped.focused) + tinted * wp.dot(n, shaped.open)) * sign
    total.center += seen.center * amount
    return amount


@wp.func(inline=False)
def shaped_triangle(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    mesh: LightMeshData,
    triangle: LightTriangle,
    n: wp.vec3,
    grain: wp.ref[Grain],
) -> VisiblePart:
    """Return what a triangle of a mesh light sends to a surface, its radiance varying: the sum over its pieces.

    Of a light that has meridians a triangle is one piece, or is summed along its edges.

    Args:
        scene: Profiles.
        light: The light.
        mesh: Its triangles.
        triangle: One of them, its origin as seen from the surface.
        n: The surface's unit normal.
        grain: How small pieces get.
    """
    total = VisiblePart()
    if mesh.is_double_sided == 0 and wp.dot(wp.cross(triangle.side_x, triangle.side_y), triangle.origin) >= 0.0:
        return total
    sum_of_amounts = float(0.0)
    piece = triangle
    node = int(1)
    while True:
        view = piece_view(scene, light, piece, n, grain)
        is_outlined = light.meridians >= 0 and (view == CUT or view == RIM)
        if is_outlined:
            sum_of_amounts += add_outline(total, scene, light, piece, n, grain)
            break
        if view == CUT and node < PIECES_MAX:
            node = 2 * node
            piece = half_triangle(piece, False)
        else:
            if view != DARK:
                sum_of_amounts += add_piece(total, scene, light, piece, n, view)
            node = next_cluster(node, False)
            if node == 1:
                break
            piece = piece_of(triangle, node)
    total.center = total.center / wp.max(sum_of_amounts, LEAST_DIVISOR)
    return total
