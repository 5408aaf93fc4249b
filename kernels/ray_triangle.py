# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Three tests of a ray against one triangle, all with the same convention.

P = (1 - u - v) p0 + u p1 + v p2 = origin + t direction. Both sides count, edges and vertices belong to the triangle,
the direction need not have unit length, and 0 <= t. A miss has t = inf.
"""

import warp as wp

from .bounds import widest_axis


@wp.struct
class TriangleHit:
    """Where a ray meets a triangle."""

    t: float
    """In units of the direction's length; inf: it does not."""
    u: float
    """Weight of p1."""
    v: float
    """Weight of p2."""


@wp.func
def triangle_miss() -> TriangleHit:
    """Return the hit that stands for none."""
    hit = TriangleHit()
    hit.t = wp.inf
    return hit


# --- plane equation and projection on a primary plane


@wp.func
def plane_equation(p0: wp.vec3, p1: wp.vec3, p2: wp.vec3) -> wp.vec4:
    """Return the plane (N, d) through a triangle: N . P + d = 0, with N = (p1 - p0) x (p2 - p0), not normalised.

    Reference: Komura, Computer Graphics, lecture 10, The Plane Equation.
    """
    normal = wp.cross(p1 - p0, p2 - p0)
    return wp.vec4(normal[0], normal[1], normal[2], -wp.dot(p0, normal))


@wp.func
def intersect_plane(plane: wp.vec4, origin: wp.vec3, direction: wp.vec3) -> float:
    """Return t = -(d + N . O) / (N . D), where a ray meets a plane; inf where it is parallel to it.

    Reference: Komura, Computer Graphics, lecture 10, Computing the intersection.
    """
    normal = wp.vec3(plane[0], plane[1], plane[2])
    slope = wp.dot(normal, direction)
    if slope == 0.0:
        return wp.inf
    return -(plane[3] + wp.dot(normal, origin)) / slope


@wp.func
def primary_axis(normal: wp.vec3) -> int:
    """Return the axis along which a triangle of this normal casts its largest shadow: the i0 of the lecture."""
    return widest_axis(wp.vec3(wp.abs(normal[0]), wp.abs(normal[1]), wp.abs(normal[2])))


@wp.func
def project_barycentrics(p: wp.vec3, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3, axis: int) -> wp.vec2:
    """Return (alpha, beta) with p - p0 = alpha (p1 - p0) + beta (p2 - p0), solved in the plane across ``axis``.

    NaN or infinite where the projected triangle has no area.

    Reference: Badouel (1990), An Efficient Ray-Polygon Intersection, Graphics Gems; Komura, Computer Graphics,
    lecture 10, Projection onto Primary Planes.
    """
    i1 = 1 if axis == 0 else 0
    i2 = 1 if axis == 2 else 2
    u0 = p[i1] - p0[i1]
    u1 = p1[i1] - p0[i1]
    u2 = p2[i1] - p0[i1]
    v0 = p[i2] - p0[i2]
    v1 = p1[i2] - p0[i2]
    v2 = p2[i2] - p0[i2]
    inverse = 1.0 / (u1 * v2 - u2 * v1)
    return wp.vec2((u0 * v2 - u2 * v0) * inverse, (u1 * v0 - u0 * v1) * inverse)


@wp.func
def intersect_plane_projection(
    origin: wp.vec3, direction: wp.vec3, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3
) -> TriangleHit:
    """Return the hit found by way of the triangle's plane and its projection on a primary plane.

    Reference: Badouel (1990), An Efficient Ray-Polygon Intersection, Graphics Gems. Differs by taking the plane
    through p0 relative to the origin, which saves digits far from it.
    """
    # Relative to the ray's origin, so that -(d + N . O) loses nothing to O's distance from the world's origin.
    q0 = p0 - origin
    q1 = p1 - origin
    q2 = p2 - origin
    plane = plane_equation(q0, q1, q2)
    t = intersect_plane(plane, wp.vec3(0.0), direction)
    if not (t >= 0.0 and t < wp.inf):
        return triangle_miss()
    axis = primary_axis(wp.vec3(plane[0], plane[1], plane[2]))
    weights = project_barycentrics(t * direction, q0, q1, q2, axis)
    if not (weights[0] >= 0.0 and weights[1] >= 0.0 and weights[0] + weights[1] <= 1.0):
        return triangle_miss()
    hit = TriangleHit()
    hit.t = t
    hit.u = weights[0]
    hit.v = weights[1]
    return hit


# --- Moeller and Trumbore


@wp.func
def intersect_moller_trumbore(
    origin: wp.vec3, direction: wp.vec3, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3
) -> TriangleHit:
    """Return the hit found by Cramer's rule for (t, u, v).

    Reference: Moeller and Trumbore (1997), Fast, Minimum Storage Ray/Triangle Intersection, JGT 2(1).
    """
    edge1 = p1 - p0
    edge2 = p2 - p0
    p = wp.cross(direction, edge2)
    determinant = wp.dot(edge1, p)
    if determinant == 0.0:
        return triangle_miss()
    inverse = 1.0 / determinant
    s = origin - p0
    u = wp.dot(s, p) * inverse
    if not (u >= 0.0 and u <= 1.0):
        return triangle_miss()
    q = wp.cross(s, edge1)
    v = wp.dot(direction, q) * inverse
    if not (v >= 0.0 and u + v <= 1.0):
        return triangle_miss()
    t = wp.dot(edge2, q) * inverse
    if not (t >= 0.0):
        return triangle_miss()
    hit = TriangleHit()
    hit.t = t
    hit.u = u
    hit.v = v
    return hit


# --- Woop, Benthin and Wald


@wp.func
def shear_axes(direction: wp.vec3) -> wp.vec3i:
    """Return the axes (kx, ky, kz) in which the ray runs along kz; the other two follow in cyclic order."""
    kz = widest_axis(wp.vec3(wp.abs(direction[0]), wp.abs(direction[1]), wp.abs(direction[2])))
    kx = 0 if kz == 2 else kz + 1
    ky = 0 if kx == 2 else kx + 1
    return wp.vec3i(kx, ky, kz)


@wp.func
def rotate_axes(v: wp.vec3, axes: wp.vec3i) -> wp.vec3:
    """Return a vector's components in the order of ``shear_axes``.

    Component by component: that becomes moves without branches, which incoherent rays would mispredict.
    """
    return wp.vec3(
        v[0] if axes[2] == 2 else (v[1] if axes[2] == 0 else v[2]),
        v[1] if axes[2] == 2 else (v[2] if axes[2] == 0 else v[0]),
        v[2] if axes[2] == 2 else (v[0] if axes[2] == 0 else v[1]),
    )


@wp.func
def shear_factors(direction: wp.vec3, axes: wp.vec3i) -> wp.vec3:
    """Return (Sx, Sy, Sz): x - Sx z and y - Sy z turn the ray into the z axis, and z Sz measures t."""
    rotated = rotate_axes(direction, axes)
    scale = 1.0 / rotated[2]
    return wp.vec3(rotated[0] * scale, rotated[1] * scale, scale)


@wp.func
def intersect_triangle(origin: wp.vec3, direction: wp.vec3, p0: wp.vec3, p1: wp.vec3, p2: wp.vec3) -> TriangleHit:
    """Return the hit of a watertight test: no ray passes between two triangles that share an edge or a vertex.

    Both neighbours compute the edge function of their common edge from the same rounded products, with opposite
    signs. Rounding is monotone, so a sign comes out right or zero, and zero counts as inside on both sides. This
    needs products that are rounded by themselves: no contraction to fused multiply-add (option ``fuse_fp``).

    Edge functions of one sign sum to zero only if all three are zero: the ray meets all three edges at once, to
    rounding, that is, it sees the triangle edge-on. Such a triangle is passed over, and the neighbours across its
    edges, whose common edge functions are zero and so count as inside, take the ray. All of them vanish for rays
    within 1e-19 of a mesh that is no bigger, where products underflow: there is no surface below that size.

    Reference: Woop, Benthin and Wald (2013), Watertight Ray/Triangle Intersection, JCGT 2(1), section 3 and
    appendix A. Differs by having no double-precision fall-back, which serves only ties that count as hits here.
    """
    axes = shear_axes(direction)
    shear = shear_factors(direction, axes)
    a = rotate_axes(p0 - origin, axes)
    b = rotate_axes(p1 - origin, axes)
    c = rotate_axes(p2 - origin, axes)
    ax = a[0] - shear[0] * a[2]
    ay = a[1] - shear[1] * a[2]
    bx = b[0] - shear[0] * b[2]
    by = b[1] - shear[1] * b[2]
    cx = c[0] - shear[0] * c[2]
    cy = c[1] - shear[1] * c[2]
    edge_u = cx * by - cy * bx
    edge_v = ax * cy - ay * cx
    edge_w = bx * ay - by * ax
    least = wp.min(wp.min(edge_u, edge_v), edge_w)
    greatest = wp.max(wp.max(edge_u, edge_v), edge_w)
    determinant = edge_u + edge_v + edge_w
    if not ((least >= 0.0 or greatest <= 0.0) and determinant != 0.0):
        return triangle_miss()
    t = (edge_u * a[2] + edge_v * b[2] + edge_w * c[2]) * (shear[2] / determinant)
    if not (t >= 0.0):
        return triangle_miss()
    inverse = 1.0 / determinant
    hit = TriangleHit()
    hit.t = t
    hit.u = edge_v * inverse
    hit.v = edge_w * inverse
    return hit
