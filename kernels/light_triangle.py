# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a triangle of even radiance sends to a surface, of any size and cut by the horizon or not.

Reference: Lambert (1760), Photometria; Arvo (1995), Applications of Irradiance Tensors, equation 11.
"""

import warp as wp

from .outline import direction_offset, edge_flux
from .structs import LightTriangle


@wp.struct
class VisiblePart:
    """What of a triangle, or of a cluster of them, shines on a surface from above its horizon."""

    irradiance: wp.vec3
    """Vector irradiance from it; of a light of even radiance, for radiance 1."""
    center: wp.vec3
    """About its middle, from the surface."""
    normal: wp.vec3
    """Of the triangle or, in the mean, of the cluster; of either sign and any length."""
    arriving: wp.vec3
    """Of a light whose radiance varies: what the surface gets of it, by colour."""
    free_sides: wp.int32
    """As in ``LightTriangle`` and ``LightCluster``."""
    is_cut: wp.int32
    """1: a cluster of which nothing is known but by its parts."""


@wp.func
def middle_of(triangle: LightTriangle) -> wp.vec3:
    """Return the mean of a triangle's corners."""
    return triangle.origin + (triangle.side_x + triangle.side_y) / 3.0


@wp.func
def triangle_irradiance(triangle: LightTriangle, n: wp.vec3) -> VisiblePart:
    """Return the vector irradiance at a surface from what is above its horizon of a triangle of radiance 1.

    The triangle is clipped at the horizon, then its edges are summed by Lambert's formula. The sign is that of its
    winding: negative where the surface sees its outside.

    Args:
        triangle: Its origin as seen from the surface.
        n: The surface's unit normal.

    Reference: Sutherland and Hodgman (1974), Reentrant Polygon Clipping, CACM 17(1), against one plane.
    """
    part = VisiblePart()
    middle = middle_of(triangle)
    distance = wp.max(wp.length(middle), 1.0e-30)
    c = middle / distance
    height = wp.dot(n, middle)
    r = (triangle.side_x + triangle.side_y) / -3.0
    first = r
    h = height + wp.dot(n, r)
    a = direction_offset(c, distance, r)
    flux = wp.vec3(0.0, 0.0, 0.0)
    corners = wp.vec3(0.0, 0.0, 0.0)
    count = float(0.0)
    leaves = wp.vec3(0.0, 0.0, 0.0)
    enters = wp.vec3(0.0, 0.0, 0.0)
    is_cut = int(0)
    for k in range(3):
        r_next = first
        if k == 0:
            r_next = r_next + triangle.side_x
        elif k == 1:
            r_next = r_next + triangle.side_y
        h_next = height + wp.dot(n, r_next)
        b = direction_offset(c, distance, r_next)
        if h > 0.0:
            corners += r
            count += 1.0
        if h > 0.0 and h_next > 0.0:
            flux += edge_flux(c, a, b)
        elif h > 0.0 or h_next > 0.0:
            is_cut = 1
            on_horizon = r + (r_next - r) * (h / (h - h_next))
            crossing = direction_offset(c, distance, on_horizon)
            corners += on_horizon
            count += 1.0
            if h > 0.0:
                leaves = crossing
                flux += edge_flux(c, a, crossing)
            else:
                enters = crossing
                flux += edge_flux(c, crossing, b)
        r = r_next
        h = h_next
        a = b
    if is_cut != 0:
        flux += edge_flux(c, leaves, enters)
    part.irradiance = 0.5 * flux
    part.center = middle + corners / wp.max(count, 1.0)
    return part
