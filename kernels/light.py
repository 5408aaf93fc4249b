# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights as a whole, as a surface point sees them: direction, distance, irradiance.

What counts where lights are not sampled (``sample_light``): each gives exactly the irradiance that its whole,
unoccluded shape sends to a small surface, by closed form, along the mean direction that this irradiance comes from;
one shadow ray goes to its centre.
So diffuse surfaces above whose horizon the whole light lies are lit exactly, shadows are sharp, and a highlight has the
size that the surface's roughness gives it.
"""

import warp as wp

from .constants import CYLINDER_FACETS, FAR_LIGHT, GAUSS_POINT, LEAST_DIVISOR, LEAST_SINE
from .light_structs import LightData
from .vector import face_forward

KIND_POINT = wp.constant(0)
KIND_DISTANT = wp.constant(1)
KIND_SPHERE = wp.constant(2)
KIND_RECT = wp.constant(3)
KIND_DISK = wp.constant(4)
KIND_CYLINDER = wp.constant(5)
KIND_MESH = wp.constant(6)


@wp.struct
class LightSample:
    """A light from one point."""

    wi: wp.vec3
    """Unit mean direction of the light that arrives; zero where there is none."""
    irradiance: wp.vec3
    """On a surface that faces ``wi``, nothing in between."""
    to_shadow: wp.vec3
    """Unit direction of the shadow ray."""
    distance: wp.float32
    """Length of the shadow ray."""


@wp.func
def edge_irradiance(a: wp.vec3, b: wp.vec3) -> wp.vec3:
    """Return one polygon edge's share of the vector irradiance at the origin, for radiance 2.

    Args:
        a: Unit direction to the edge's first vertex.
        b: Unit direction to its second.
    """
    c = wp.cross(a, b)
    length = wp.length(c)
    if length < LEAST_SINE:
        return wp.vec3(0.0, 0.0, 0.0)
    return c * (wp.atan2(length, wp.dot(a, b)) / length)


@wp.func
def patch_irradiance(center: wp.vec3, area: wp.vec3) -> wp.vec3:
    """Return a small patch's vector irradiance at the origin, for radiance 1, as if all of it were at its centre.

    Args:
        center: As seen from the origin.
        area: Normal of the patch, either side, its length being the area.
    """
    d2 = wp.length_sq(center)
    return center * (wp.abs(wp.dot(area, center)) / (d2 * d2))


@wp.func
def rect_irradiance(center: wp.vec3, half_x: wp.vec3, half_y: wp.vec3) -> wp.vec3:
    """Return the vector irradiance at the origin from a rectangle of radiance 1; its length: on a facing surface.

    Near, Lambert's sum over the edges, which is exact but cancels the more, the smaller the rectangle looks; from
    ``FAR_LIGHT`` half diagonals on, Gauss-Legendre quadrature with 2 x 2 points, which does not.

    Args:
        center: Of the rectangle, as seen from the origin, which its emitting side faces.
        half_x: From the centre to the middle of one side.
        half_y: From the centre to the middle of the next.

    Reference: Lambert (1760), Photometria; Arvo (1995), Applications of Irradiance Tensors, equation 11.
    """
    size2 = wp.length_sq(half_x) + wp.length_sq(half_y)
    if wp.length_sq(center) > FAR_LIGHT * FAR_LIGHT * size2:
        quarter = wp.cross(half_x, half_y)
        x = half_x * GAUSS_POINT
        y = half_y * GAUSS_POINT
        result = patch_irradiance(center - x - y, quarter) + patch_irradiance(center + x - y, quarter)
        return result + patch_irradiance(center + x + y, quarter) + patch_irradiance(center - x + y, quarter)
    a = wp.normalize(center - half_x - half_y)
    b = wp.normalize(center + half_x - half_y)
    c = wp.normalize(center + half_x + half_y)
    d = wp.normalize(center - half_x + half_y)
    edges = edge_irradiance(a, b) + edge_irradiance(b, c) + edge_irradiance(c, d) + edge_irradiance(d, a)
    # The sign of the sum is that of the corners' order, which mirroring turns round.
    return face_forward(0.5 * edges, center)


@wp.func
def disk_irradiance(to_center: wp.vec3, axis: wp.vec3, radius: float) -> wp.vec3:
    """Return the vector irradiance from a disk of radiance 1, for a point in front of it.

    Args:
        to_center: From the point to the disk's centre.
        axis: Unit normal of the disk on its emitting side.
        radius: Of the disk.

    Reference: Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-11 and C-12 (a differential planar
    element and a disk in parallel and in perpendicular planes).
    """
    z = -wp.dot(to_center, axis)
    if z <= 0.0:
        return wp.vec3(0.0, 0.0, 0.0)
    radial = to_center + axis * z
    rho = wp.length(radial)
    r2 = radius * radius
    d2 = z * z + rho * rho
    root = wp.sqrt(wp.max((d2 + r2) * (d2 + r2) - 4.0 * r2 * rho * rho, LEAST_DIVISOR))
    # Where one difference cancels its conjugate does not: along for d2 > r2, across for a distant or small disk.
    along = 0.5 * wp.pi * (1.0 - (d2 - r2) / root)
    if d2 > r2:
        along = 2.0 * wp.pi * r2 * z * z / (root * (root + d2 - r2))
    across = float(0.0)
    if rho > 0.0:
        across = 2.0 * wp.pi * z * r2 * rho / (root * (d2 + r2 + root))
        radial = radial / rho
    return -axis * along + radial * across


@wp.func
def cone_factor(light: LightData, cos_axis: float, spread: float) -> wp.vec3:
    """Return UsdLux's shaping: the focus and the cone, for light that leaves at ``cos_axis`` to the axis.

    Args:
        light: The light.
        cos_axis: Cosine between its -Z and the direction that light leaves in.
        spread: Squared width that is added to that of the cone's soft rim [rad^2]: what the rim looks like as the mean
            over a cell of directions. Smoothsteps of width w have a variance of w^2 / 20.

    Reference: UsdLux ShapingAPI: focus is |cos|^focus, tinted; the cone is 1 - smoothstep over its soft rim.
    """
    one = wp.vec3(1.0, 1.0, 1.0)
    factor = one
    if light.focus > 0.0:
        f = wp.pow(wp.abs(cos_axis), light.focus)
        factor = one * f + light.focus_tint * (1.0 - f)
    if light.cone_angle < wp.pi:
        theta = wp.acos(wp.clamp(cos_axis, -1.0, 1.0))
        end = light.cone_angle
        rim = end * (1.0 - light.cone_softness)
        if spread > 0.0:
            wider = 0.5 * (wp.sqrt((end - rim) * (end - rim) + spread) - (end - rim))
            end += wider
            rim -= wider
        cone = float(1.0)
        if theta > end:
            cone = 0.0
        elif theta > rim:
            x = (theta - rim) / (end - rim)
            cone = 1.0 - x * x * (3.0 - 2.0 * x)
        factor = factor * cone
    return factor


@wp.func
def sphere_irradiance(distance: float, radius: float) -> float:
    """Return the irradiance of a surface facing a sphere of radiance 1: pi r^2 / d^2; 0 within, where it sends none."""
    if distance <= radius:
        return 0.0
    return wp.pi * radius * radius / (distance * distance)


@wp.func
def cylinder_irradiance(light: LightData, to_center: wp.vec3) -> wp.vec3:
    """Return the vector irradiance from a capless cylinder of radiance 1: the sum over flat facets of its lit side.

    Uniform radiance depends on the silhouette alone. The facets run between the two tangent lines, so the sides of the
    silhouette are exact; only the arcs at its ends are made of ``CYLINDER_FACETS`` straight pieces, whose inner corners
    stand out so far that they enclose the arc's area.
    """
    half_x = light.half_x
    axis = wp.normalize(half_x)
    radial = to_center - axis * wp.dot(to_center, axis)
    d = wp.length(radial)
    zero = wp.vec3(0.0, 0.0, 0.0)
    if d <= light.radius:
        return zero
    toward = radial * (-light.radius / d)
    side = wp.cross(axis, toward)
    arc = wp.acos(light.radius / d)
    result = zero
    # Corners at x radii, the outermost two at 1: (n - 2) x^2 + 2 x = n a / sin a, a being the angle of a facet.
    inner = float(CYLINDER_FACETS) - 2.0
    step = 2.0 * arc / float(CYLINDER_FACETS)
    whole = float(CYLINDER_FACETS) * step / wp.max(wp.sin(step), LEAST_SINE)
    out = (wp.sqrt(1.0 + inner * whole) - 1.0) / inner
    previous = toward * wp.cos(arc) - side * wp.sin(arc)
    for k in range(CYLINDER_FACETS):
        angle = arc * (2.0 * float(k + 1) / float(CYLINDER_FACETS) - 1.0)
        edge = toward * wp.cos(angle) + side * wp.sin(angle)
        if k < CYLINDER_FACETS - 1:
            edge = edge * out
        result += rect_irradiance(to_center + 0.5 * (previous + edge), half_x, 0.5 * (edge - previous))
        previous = edge
    return result


@wp.func
def sample_light(light: LightData, position: wp.vec3) -> LightSample:
    """Return how a light reaches a point, shaping included, shadows not."""
    s = LightSample()
    if light.kind == KIND_DISTANT:
        s.wi = light.axis_z
        s.to_shadow = light.axis_z
        s.distance = wp.inf
        s.irradiance = light.emission
        return s

    to_center = light.position - position
    distance = wp.length(to_center)
    if distance == 0.0:
        return s
    s.distance = distance
    s.to_shadow = to_center / distance
    s.wi = s.to_shadow
    amount = float(0.0)
    if light.kind == KIND_POINT:
        amount = 1.0
        if light.has_falloff != 0:
            amount = wp.pi * light.radius * light.radius / (distance * distance)
    elif light.kind == KIND_SPHERE:
        amount = sphere_irradiance(distance, light.radius)
        if amount == 0.0:
            s.wi = wp.vec3(0.0, 0.0, 0.0)
    else:
        flux = wp.vec3(0.0, 0.0, 0.0)
        if light.kind == KIND_CYLINDER:
            flux = cylinder_irradiance(light, to_center)
        elif wp.dot(to_center, light.normal) > 0.0:
            if light.kind == KIND_DISK:
                flux = disk_irradiance(to_center, -light.normal, light.radius)
            else:
                flux = rect_irradiance(to_center, light.half_x, light.half_y)
        amount = wp.length(flux)
        if amount == 0.0:
            s.wi = flux
            return s
        s.wi = flux / amount
    # Shaped as where it comes from in the mean: of a cylinder that is nearer than its axis.
    s.irradiance = wp.cw_mul(light.emission * amount, cone_factor(light, wp.dot(s.wi, light.axis_z), 0.0))
    return s
