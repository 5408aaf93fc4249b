# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The point of a shape that a ray meets: moved onto the exact surface, its normal, its parametrisation."""

import warp as wp

from .constants import CUBIC_TUBE, FRUSTUM, SPHERE
from .intersect_frustum import FIRST_CAP, LAST_CAP, empty_span, has_part, intersect_frustum
from .intersect_round_cone import intersect_round_cone, round_cone_parameter
from .intersect_sphere import intersect_sphere
from .intersect_tube import bezier_blossom, tube_parameter
from .scene_structs import MeshData
from .vector import perpendicular_frame


@wp.struct
class ShapePoint:
    """A point on a shape, in the shape's space."""

    position: wp.vec3
    """On the surface to within a few roundings of ``magnitude``."""
    normal: wp.vec3
    """Unit, outward."""
    u: float
    """From the first control point, 0, to the last, 1."""
    magnitude: float
    """Bound of what was added up for the position, and is added up when a ray is tested against the shape."""


@wp.func
def first_control(mesh: MeshData, shape: int) -> int:
    """Return where the control points of a shape begin in ``SceneData.controls``."""
    count = int(2)
    if mesh.kind == SPHERE:
        count = 1
    if mesh.kind == CUBIC_TUBE:
        count = 4
    return mesh.point_offset + shape * count


@wp.func
def xyz(v: wp.vec4) -> wp.vec3:
    """Return a control point without its radius."""
    return wp.vec3(v[0], v[1], v[2])


@wp.func
def control_magnitude(v: wp.vec4) -> float:
    """Return how far from the origin a control point's ball reaches along an axis, at most."""
    return wp.max(wp.abs(v[0]), wp.max(wp.abs(v[1]), wp.abs(v[2]))) + v[3]


@wp.func
def point_on_ball(center: wp.vec3, radius: float, p: wp.vec3) -> ShapePoint:
    """Return the point of a sphere next to a given one."""
    result = ShapePoint()
    offset = p - center
    size = wp.length(offset)
    result.normal = wp.vec3(0.0, 0.0, 1.0)
    if size > 0.0:
        result.normal = offset / size
    result.position = center + radius * result.normal
    return result


@wp.func
def point_on_frustum(start: wp.vec4, end: wp.vec4, part: int, p: wp.vec3) -> ShapePoint:
    """Return the point of a part of a frustum next to a given one: of its side, in the plane across the axis."""
    result = ShapePoint()
    along = xyz(end) - xyz(start)
    height = wp.length(along)
    axis = along / height
    offset = p - xyz(start)
    z = wp.dot(offset, axis)
    across = offset - z * axis
    if part == FIRST_CAP:
        result.position = xyz(start) + across
        result.normal = -axis
    elif part == LAST_CAP:
        result.position = xyz(end) + across
        result.normal = axis
        result.u = 1.0
    else:
        result.u = wp.clamp(z / height, 0.0, 1.0)
        outward = wp.normalize(across)
        slope = (end[3] - start[3]) / height
        result.position = xyz(start) + result.u * along + (start[3] + result.u * (end[3] - start[3])) * outward
        result.normal = wp.normalize(outward - slope * axis)
    return result


@wp.func
def point_on_shape(controls: wp.array[wp.vec4], first: int, kind: int, part: int, u: float, p: wp.vec3) -> ShapePoint:
    """Return the point of a shape's surface that a hit means.

    Args:
        controls: Control points of all shapes, with their radii.
        first: The shape's first one.
        kind: Of the shape.
        part: Of a frustum: which.
        u: Of the hit.
        p: Point along the ray, in the shape's space, off the surface by the error of the ray's t.
    """
    start = controls[first]
    if kind == SPHERE:
        result = point_on_ball(xyz(start), start[3], p)
        result.magnitude = control_magnitude(start)
        return result
    end = controls[first + 1]
    if kind == FRUSTUM:
        result = point_on_frustum(start, end, part, p)
    elif kind == CUBIC_TUBE:
        c2 = controls[first + 2]
        c3 = controls[first + 3]
        found = tube_parameter(p, u, start, end, c2, c3)
        ball = bezier_blossom(start, end, c2, c3, found, found, found)
        result = point_on_ball(xyz(ball), ball[3], p)
        result.u = found
        result.magnitude = wp.max(control_magnitude(c2), control_magnitude(c3))
    else:
        found = round_cone_parameter(p, xyz(start), xyz(end), start[3], end[3])
        ball = start + (end - start) * found
        result = point_on_ball(xyz(ball), ball[3], p)
        result.u = found
    result.magnitude = wp.max(result.magnitude, wp.max(control_magnitude(start), control_magnitude(end)))
    return result


@wp.func
def way_to_solid(
    controls: wp.array[wp.vec4], first: int, kind: int, caps: int, t: float, p: wp.vec3, direction: wp.vec3
) -> wp.vec2:
    """Return how far along a ray from a point the ray meets a solid there, and which part of a frustum it meets.

    In units of the direction; inf: not known. The point is next to the surface already: of a solid that a transform
    flattens, the ray's own distance is too coarse by far, and its surface turns within less.

    Args:
        controls: Control points of all shapes, with their radii.
        first: The shape's first one.
        kind: Of the shape.
        caps: Which caps a frustum has, as bits.
        t: Distance of the point along the ray.
        p: The point, in the shape's space.
        direction: Of the ray, in the shape's space.
    """
    start = controls[first]
    span = empty_span()
    if kind == SPHERE:
        roots = intersect_sphere(p, direction, xyz(start), start[3])
        span.enter = roots[0]
        span.leave = roots[1]
    elif kind == FRUSTUM:
        end = controls[first + 1]
        span = intersect_frustum(p, direction, xyz(start), xyz(end), start[3], end[3])
    elif kind != CUBIC_TUBE:
        end = controls[first + 1]
        span = intersect_round_cone(p, direction, xyz(start), xyz(end), start[3], end[3])
    if not (span.enter <= span.leave):
        return wp.vec2(wp.inf, 0.0)
    # A ray that does not enter has begun in the solid, or on it, or came through where a cap is not.
    if span.enter > -0.5 * t and has_part(span.enter_part, caps):
        return wp.vec2(span.enter, float(span.enter_part))
    return wp.vec2(span.leave, float(span.leave_part))


@wp.func
def shape_axis(controls: wp.array[wp.vec4], first: int, kind: int) -> wp.vec3:
    """Return the unit vector that the parametrisation of a solid turns about."""
    if kind == SPHERE:
        return wp.vec3(0.0, 0.0, 1.0)
    return wp.normalize(xyz(controls[first + 1]) - xyz(controls[first]))


@wp.func
def shape_st(controls: wp.array[wp.vec4], first: int, kind: int, p: wp.vec3) -> wp.vec2:
    """Return the parametrisation of a solid at a point of its surface, as ``scene.Shapes`` describes it."""
    start = controls[first]
    axis = shape_axis(controls, first, kind)
    x, y = perpendicular_frame(axis)
    offset = p - xyz(start)
    turn = wp.atan2(wp.dot(offset, y), wp.dot(offset, x)) / (2.0 * wp.pi)
    s = turn + 1.0 if turn < 0.0 else turn
    z = wp.dot(offset, axis)
    if kind == SPHERE:
        return wp.vec2(s, 0.5 + wp.asin(wp.clamp(z / start[3], -1.0, 1.0)) / wp.pi)
    end = controls[first + 1]
    low = float(0.0)
    high = wp.length(xyz(end) - xyz(start))
    if kind != FRUSTUM:
        low = -start[3]
        high += end[3]
    return wp.vec2(s, wp.clamp((z - low) / (high - low), 0.0, 1.0))
