# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Axis-aligned boxes, each given by its two corners, and the slab test of a ray against one."""

import warp as wp

from .constants import BOX_PADDING, MAX_DIRECTION, MIN_DIRECTION, SLAB_SCALE


@wp.func
def box_half_area(low: wp.vec3, high: wp.vec3) -> float:
    """Return half the surface area of a box: what the surface area heuristic weighs boxes by."""
    extent = high - low
    return extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0]


@wp.func
def box_padding(low: wp.vec3, high: wp.vec3) -> float:
    """Return by how much a node's box is wider on each side than what is in it, see BOX_PADDING."""
    size = float(0.0)
    for axis in range(3):
        size = wp.max(size, wp.max(high[axis] - low[axis], wp.max(wp.abs(low[axis]), wp.abs(high[axis]))))
    return BOX_PADDING * size


@wp.func
def widest_axis(extent: wp.vec3) -> int:
    """Return the axis of the largest component; the first of equals."""
    axis = int(0)
    if extent[1] > extent[0]:
        axis = 1
    if extent[2] > extent[axis]:
        axis = 2
    return axis


@wp.func
def safe_inverse(component: float) -> float:
    """Return 1 / component, but neither infinite nor zero, however small or large it is."""
    magnitude = wp.clamp(wp.abs(component), MIN_DIRECTION, MAX_DIRECTION)
    return 1.0 / (-magnitude if component < 0.0 else magnitude)


@wp.func
def inverse_direction(direction: wp.vec3) -> wp.vec3:
    """Return 1 / direction by component, each finite and not zero: no plane times it is NaN."""
    return wp.vec3(safe_inverse(direction[0]), safe_inverse(direction[1]), safe_inverse(direction[2]))


@wp.func
def intersect_box(origin: wp.vec3, inverse: wp.vec3, t_max: float, low: wp.vec3, high: wp.vec3) -> wp.vec2:
    """Return the distances at which a ray enters and leaves a box: it misses where the first exceeds the second.

    Both lie in [0, t_max], and no ray that meets the inside of the box in exact arithmetic is missed; one that runs
    in its upper plane may be, which is what nodes have their ``box_padding`` for.

    Args:
        origin: Of the ray.
        inverse: ``inverse_direction`` of the ray.
        t_max: End of the ray, in units of the direction's length.
        low: Lower corner of the box.
        high: Upper corner of the box.

    Reference: Kay and Kajiya (1986), Ray Tracing Complex Scenes, SIGGRAPH; made conservative after Ize (2013),
    Robust BVH Ray Traversal, JCGT 2(2). The form o * inverse - plane * inverse would save work, but it is not
    conservative: rays leak through it far from the origin.
    """
    t_enter = float(0.0)
    t_leave = float(wp.inf)
    for axis in range(3):
        near = high[axis] if inverse[axis] < 0.0 else low[axis]
        far = low[axis] if inverse[axis] < 0.0 else high[axis]
        t_enter = wp.max((near - origin[axis]) * inverse[axis], t_enter)
        t_leave = wp.min((far - origin[axis]) * (inverse[axis] * SLAB_SCALE), t_leave)
    return wp.vec2(t_enter, wp.min(t_leave, t_max))
