# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray against the shapes of a leaf packet, one after the other; bvh_structs.py describes the packet."""

import warp as wp

from .constants import (
    CUBIC_TUBE,
    FRUSTUM,
    LINEAR_TUBE,
    SHAPE_FLOATS,
    SHAPE_ID,
    SHAPE_LANES,
    SHAPE_WORDS,
    SPHERE,
)
from .intersect_frustum import FIRST_CAP, LAST_CAP, Span, has_part, intersect_frustum
from .intersect_round_cone import intersect_round_cone, round_cone_parameter
from .intersect_sphere import intersect_sphere
from .intersect_tube import intersect_tube


@wp.func
def packet_shape(shapes: wp.array[float], leaf: int, lane: int) -> int:
    """Return the index of a packet's shape in its set; -1 for an empty lane."""
    return wp.cast(shapes[leaf * SHAPE_FLOATS + lane * SHAPE_WORDS + SHAPE_ID], wp.int32)


@wp.func
def packet_shape_count(shapes: wp.array[float], leaf: int) -> int:
    """Return how many lanes of a leaf packet hold a shape."""
    count = int(0)
    for lane in range(wp.int32(SHAPE_LANES)):
        if packet_shape(shapes, leaf, lane) >= 0:
            count += 1
    return count


@wp.func
def stored_point(shapes: wp.array[float], word: int) -> wp.vec4:
    """Return the control point at a word, and its radius."""
    return wp.vec4(shapes[word], shapes[word + 1], shapes[word + 2], shapes[word + 3])


@wp.func
def is_enter_hit(span: Span, caps: int, t_max: float) -> bool:
    """Return whether a ray in [0, t_max) enters a solid through a part that it has."""
    return span.enter <= span.leave and span.enter >= 0.0 and span.enter < t_max and has_part(span.enter_part, caps)


@wp.func
def is_leave_hit(span: Span, caps: int, t_max: float) -> bool:
    """Return whether a ray in [0, t_max) leaves a solid through a part that it has."""
    return span.enter <= span.leave and span.leave >= 0.0 and span.leave < t_max and has_part(span.leave_part, caps)


@wp.func
def lane_caps(shapes: wp.array[float], base: int, kind: int) -> int:
    """Return which caps the shape of a lane has, as bits."""
    if kind == FRUSTUM:
        return wp.cast(shapes[base + 8], wp.int32)
    return 0


@wp.func
def lane_span(shapes: wp.array[float], base: int, kind: int, origin: wp.vec3, direction: wp.vec3) -> Span:
    """Return where a ray's line is inside the convex shape of a lane: any but a cubic tube."""
    start = stored_point(shapes, base)
    p0 = wp.vec3(start[0], start[1], start[2])
    if kind == SPHERE:
        span = Span()
        t = intersect_sphere(origin, direction, p0, start[3])
        span.enter = t[0]
        span.leave = t[1]
        return span
    end = stored_point(shapes, base + 4)
    p1 = wp.vec3(end[0], end[1], end[2])
    if kind == FRUSTUM:
        return intersect_frustum(origin, direction, p0, p1, start[3], end[3])
    return intersect_round_cone(origin, direction, p0, p1, start[3], end[3])


@wp.func
def lane_tube(shapes: wp.array[float], base: int, origin: wp.vec3, direction: wp.vec3, t_max: float) -> wp.vec2:
    """Return (t, u) where a ray first meets the piece of a cubic tube in a lane, u of the whole; t = inf: nowhere."""
    word = wp.cast(shapes[base], wp.int32)
    low = shapes[base + 1]
    high = shapes[base + 2]
    met = intersect_tube(
        origin,
        direction,
        t_max,
        stored_point(shapes, word),
        stored_point(shapes, word + 4),
        stored_point(shapes, word + 8),
        stored_point(shapes, word + 12),
        low == 0.0,
        high == 1.0,
    )
    return wp.vec2(met[0], low + met[1] * (high - low))


@wp.func
def parameter_at(shapes: wp.array[float], base: int, kind: int, part: int, p: wp.vec3) -> float:
    """Return u of a point on the convex shape of a lane; 0 on spheres."""
    if kind == SPHERE or part == FIRST_CAP:
        return 0.0
    if part == LAST_CAP:
        return 1.0
    start = stored_point(shapes, base)
    end = stored_point(shapes, base + 4)
    p0 = wp.vec3(start[0], start[1], start[2])
    p1 = wp.vec3(end[0], end[1], end[2])
    if kind == FRUSTUM:
        return wp.clamp(wp.dot(p - p0, p1 - p0) / wp.dot(p1 - p0, p1 - p0), 0.0, 1.0)
    return round_cone_parameter(p, p0, p1, start[3], end[3])


@wp.func
def intersect_lane(
    shapes: wp.array[float],
    base: int,
    kind: int,
    origin: wp.vec3,
    direction: wp.vec3,
    t_max: float,
    is_own: bool,
    tuv: wp.array[float],
) -> bool:
    """Return whether a ray meets one shape in [0, t_max); write t, u and the part to ``tuv[0:3]`` if so.

    A ray that starts on a convex shape (``is_own``) meets it again only where it leaves the solid: however near to the
    surface the ray runs, rounding makes no other hit of it. Tubes are met from outside only.
    """
    if kind == CUBIC_TUBE:
        met = lane_tube(shapes, base, origin, direction, t_max)
        if met[0] < t_max:
            tuv[0] = met[0]
            tuv[1] = met[1]
            tuv[2] = 0.0
            return True
        return False
    span = lane_span(shapes, base, kind, origin, direction)
    caps = lane_caps(shapes, base, kind)
    t = float(0.0)
    part = int(0)
    if not is_own and is_enter_hit(span, caps, t_max):
        t = span.enter
        part = span.enter_part
    elif kind != LINEAR_TUBE and is_leave_hit(span, caps, t_max):
        t = span.leave
        part = span.leave_part
    else:
        return False
    tuv[0] = t
    tuv[1] = parameter_at(shapes, base, kind, part, origin + t * direction)
    tuv[2] = float(part)
    return True


@wp.func
def count_shapes(
    shapes: wp.array[float], leaf: int, kind: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> int:
    """Return how often a ray crosses the shapes of a leaf packet in [0, t_max): solids going in and coming out, tubes
    going in."""
    count = int(0)
    for lane in range(wp.int32(SHAPE_LANES)):  # a loop, not copies
        base = leaf * SHAPE_FLOATS + lane * SHAPE_WORDS
        if packet_shape(shapes, leaf, lane) < 0:
            break
        if kind == CUBIC_TUBE:
            if lane_tube(shapes, base, origin, direction, t_max)[0] < t_max:
                count += 1
        else:
            span = lane_span(shapes, base, kind, origin, direction)
            caps = lane_caps(shapes, base, kind)
            if is_enter_hit(span, caps, t_max):
                count += 1
            if kind != LINEAR_TUBE and is_leave_hit(span, caps, t_max):
                count += 1
    return count


@wp.func
def intersect_shapes(
    shapes: wp.array[float],
    leaf: int,
    kind: int,
    origin: wp.vec3,
    direction: wp.vec3,
    skip: int,
    t_max: float,
    tuv: wp.array[float],
) -> int:
    """Return the lane of a leaf packet's shape that a ray meets first in [0, t_max), or -1.

    Writes t, u and what is in place of v to ``tuv[0:3]`` on a hit: of a frustum, its part.

    Args:
        shapes: ``AccelData.shapes``.
        leaf: Number of the packet.
        kind: Of its shapes.
        origin: Of the ray.
        direction: Of the ray.
        skip: Shape that the ray starts on, or NO_TRIANGLE.
        t_max: End of the ray.
        tuv: Of the hit.
    """
    nearest = int(-1)
    t_nearest = float(t_max)
    for lane in range(wp.int32(SHAPE_LANES)):  # a loop, not copies
        base = leaf * SHAPE_FLOATS + lane * SHAPE_WORDS
        row = packet_shape(shapes, leaf, lane)
        if row < 0:
            break  # lanes are filled from the first on
        if intersect_lane(shapes, base, kind, origin, direction, t_nearest, row == skip, tuv):
            t_nearest = tuv[0]
            nearest = lane
    return nearest
