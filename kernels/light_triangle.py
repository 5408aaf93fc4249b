# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a triangle of even radiance sends to a surface, of any size and cut by the horizon or not.

Reference: Lambert (1760), Photometria; Arvo (1995), Applications of Irradiance Tensors, equation 11.
"""

import warp as wp

from .constants import LEAST_DIVISOR
from .light_structs import LightMeshData, LightTriangle
from .outline import direction_offset, edge_flux

Offsets = wp.types.matrix(shape=(4, 3), dtype=wp.float32)


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
def faces_away(mesh: wp.ref[LightMeshData], triangle: LightTriangle, wi: wp.vec3) -> bool:
    """Return whether a triangle of a mesh light is dark, or seen edge-on, from where ``wi`` leads to it."""
    outwards = wp.dot(wp.cross(triangle.side_x, triangle.side_y), wi)
    return outwards == 0.0 or (outwards > 0.0 and mesh.is_double_sided == 0)


@wp.struct
class SeenPolygon:
    """What of a triangle is above a surface's horizon: up to four corners, in the order of its winding."""

    to_middle: wp.vec3
    """Unit direction to the triangle's middle."""
    offsets: Offsets
    """Rows: by how much the unit directions to the corners differ from that."""
    count: wp.int32
    center: wp.vec3
    """Mean of the corners, from the surface."""


@wp.func
def polygon_above(triangle: LightTriangle, n: wp.vec3) -> SeenPolygon:
    """Return what of a triangle is above a surface's horizon.

    Args:
        triangle: Its origin as seen from the surface.
        n: The surface's unit normal.

    Reference: Sutherland and Hodgman (1974), Reentrant Polygon Clipping, CACM 17(1), against one plane.
    """
    seen = SeenPolygon()
    middle = middle_of(triangle)
    distance = wp.max(wp.length(middle), LEAST_DIVISOR)
    seen.to_middle = middle / distance
    height = wp.dot(n, middle)
    first = (triangle.side_x + triangle.side_y) / -3.0
    r = first
    h = height + wp.dot(n, r)
    corners = wp.vec3(0.0, 0.0, 0.0)
    for k in range(3):
        r_next = first
        if k == 0:
            r_next = r_next + triangle.side_x
        elif k == 1:
            r_next = r_next + triangle.side_y
        h_next = height + wp.dot(n, r_next)
        if h > 0.0:
            seen.offsets[seen.count] = direction_offset(seen.to_middle, distance, r)
            seen.count += 1
            corners += r
        if (h > 0.0) != (h_next > 0.0):
            on_horizon = r + (r_next - r) * (h / (h - h_next))
            seen.offsets[seen.count] = direction_offset(seen.to_middle, distance, on_horizon)
            seen.count += 1
            corners += on_horizon
        r = r_next
        h = h_next
    seen.center = middle + corners / wp.max(float(seen.count), 1.0)
    return seen


@wp.func
def triangle_irradiance(triangle: LightTriangle, n: wp.vec3) -> VisiblePart:
    """Return the vector irradiance at a surface from what is above its horizon of a triangle of radiance 1.

    The edges of what is left are summed by Lambert's formula. The sign is that of the triangle's winding: negative
    where the surface sees its outside.

    Args:
        triangle: Its origin as seen from the surface.
        n: The surface's unit normal.
    """
    part = VisiblePart()
    seen = polygon_above(triangle, n)
    flux = wp.vec3(0.0, 0.0, 0.0)
    for k in range(seen.count):
        flux += edge_flux(seen.to_middle, seen.offsets[k], seen.offsets[(k + 1) % seen.count])
    part.irradiance = 0.5 * flux
    part.center = seen.center
    return part
