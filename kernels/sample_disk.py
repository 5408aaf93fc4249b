# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Disk lights, and the ellipses that uneven scales make of them: their solid angle, from afar their area.

A disk is seen as chords, side by side: at an angle about the direction of all of them, from one angle to another along
it. What a chord covers is the difference of two sines. Over the angle about them that is summed in some cells, one of
which is taken by chance; within a cell that hardly varies.

Reference: Gamito (2016), Solid Angle Sampling of Disk and Cylinder Lights, CGF 35(4), for other ways to the same.
"""

import warp as wp

from .constants import DISK_CELLS, DISK_FAR, DISK_LOW, LEAST_SINE
from .light_direction import LightDirection
from .sample_rect import area_pdf, plane_point, safe_asin
from .sampling import concentric_disk


@wp.struct
class DiskView:
    """A disk as a point sees it, cut into chords along one of its half axes."""

    is_near: wp.int32
    """0: its area is to be sampled, and nothing else is set."""
    along: wp.vec3
    """Unit, of the chords; so too ``across``, square to it, in the disk's plane."""
    across: wp.vec3
    center: wp.vec3
    x: wp.vec3
    """Half axis from chord to chord."""
    half: wp.float32
    """Half the longest chord."""
    height: wp.float32
    """Of the point above the disk's plane."""
    start: wp.float32
    """Of the disk's centre, along ``across``."""
    width: wp.float32
    """Of ``x``, likewise."""
    middle: wp.float32
    """Mean of the angles [rad] about the chords' direction at which the first and the last chord are."""
    reach: wp.float32
    """Half their difference."""


@wp.func
def view_disk(center: wp.vec3, x: wp.vec3, y: wp.vec3) -> DiskView:
    """Return how a disk is cut into chords.

    Args:
        center: As seen from the point.
        x: Conjugate half axis; so too ``y``.
        y: Conjugate half axis.
    """
    v = DiskView()
    size2 = wp.length_sq(x) + wp.length_sq(y)
    normal = wp.normalize(wp.cross(x, y))
    v.height = wp.abs(wp.dot(center, normal))
    if wp.length_sq(center) > DISK_FAR * DISK_FAR * size2 or v.height * v.height < DISK_LOW * DISK_LOW * size2:
        return v
    v.is_near = 1
    v.half = wp.length(y)
    v.along = y / v.half
    v.across = wp.cross(v.along, normal)
    v.center = center
    v.x = x
    v.start = wp.dot(center, v.across)
    v.width = wp.dot(x, v.across)
    if v.width < 0.0:
        v.across = -v.across
        v.start = -v.start
        v.width = -v.width
    first = wp.atan2(v.start - v.width, v.height)
    last = wp.atan2(v.start + v.width, v.height)
    v.middle = 0.5 * (first + last)
    v.reach = 0.5 * (last - first)
    return v


@wp.func
def chord_sines(v: wp.ref[DiskView], chord: float) -> wp.vec2:
    """Return the sines of the angles along a chord, from square to it, at which it begins and ends.

    Args:
        v: The disk.
        chord: Where it is along the half axis, in [-1, 1].
    """
    line = v.center + v.x * chord
    middle = wp.dot(line, v.along)
    h2 = wp.length_sq(line - v.along * middle)
    half = v.half * wp.sqrt(wp.max(1.0 - chord * chord, 0.0))
    low = middle - half
    high = middle + half
    return wp.vec2(low / wp.sqrt(h2 + low * low), high / wp.sqrt(h2 + high * high))


@wp.func
def chord_at(v: wp.ref[DiskView], g: float) -> float:
    """Return where the chord is, along the half axis, that a number in [-1, 1] leads to: ends get more of them."""
    angle = v.middle + v.reach * (0.5 * g * (3.0 - g * g))
    return wp.clamp((v.height * wp.tan(angle) - v.start) / v.width, -1.0, 1.0)


@wp.func
def cell_weight(v: wp.ref[DiskView], cell: int) -> float:
    """Return about what of the solid angle a cell of chords has; with a little besides, for cells are not even."""
    g = (2.0 * float(cell) + 1.0) / float(DISK_CELLS) - 1.0
    sines = chord_sines(v, chord_at(v, g))
    return (sines[1] - sines[0]) * (1.0 - g * g) + 1.0e-6


@wp.func
def chord_pdf(v: wp.ref[DiskView], g: float, sines: wp.vec2, share: float) -> float:
    """Return the density in solid angle of a point of a chord.

    Args:
        v: The disk.
        g: Number that leads to the chord.
        sines: Its :func:`chord_sines`.
        share: Of the cell that the number is in, by chance.
    """
    covered = v.reach * 1.5 * (1.0 - g * g) * (sines[1] - sines[0])
    if covered <= 0.0:
        return 0.0
    return share * (0.5 * float(DISK_CELLS)) / covered


@wp.func
def sample_disk(center: wp.vec3, x: wp.vec3, y: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction to a disk, or an ellipse.

    Args:
        center: As seen from the point.
        x: Conjugate half axis; so too ``y``.
        y: Conjugate half axis.
        u: Point of the unit square.
    """
    s = LightDirection()
    v = view_disk(center, x, y)
    if v.is_near == 0:
        q = concentric_disk(u)
        p = center + x * q[0] + y * q[1]
        s.distance = wp.length(p)
        s.wi = p / s.distance
        s.pdf = area_pdf(wp.pi * wp.cross(x, y), s.wi, s.distance)
        return s
    total = float(0.0)
    for k in range(DISK_CELLS):
        total += cell_weight(v, k)
    rest = u[0] * total
    cell = int(0)
    weight = cell_weight(v, 0)
    while rest >= weight and cell < DISK_CELLS - 1:
        rest -= weight
        cell += 1
        weight = cell_weight(v, cell)
    # Short of the two ends, where a chord is a point.
    g = wp.clamp(2.0 * (float(cell) + rest / weight) / float(DISK_CELLS) - 1.0, -0.999, 0.999)
    chord = chord_at(v, g)
    sines = chord_sines(v, chord)
    sine = sines[0] + u[1] * (sines[1] - sines[0])
    line = center + x * chord
    square = line - v.along * wp.dot(line, v.along)
    p = square + v.along * (wp.length(square) * sine / wp.sqrt(wp.max(1.0 - sine * sine, LEAST_SINE)))
    s.distance = wp.length(p)
    s.wi = p / s.distance
    s.pdf = chord_pdf(v, g, sines, weight / total)
    return s


@wp.func
def meet_disk(center: wp.vec3, x: wp.vec3, y: wp.vec3, wi: wp.vec3) -> LightDirection:
    """Return what :func:`sample_disk` makes of a unit direction that comes from elsewhere."""
    s = LightDirection()
    s.wi = wi
    normal = wp.cross(x, y)
    p = plane_point(center, normal, wi)
    n2 = wp.length_sq(normal)
    a = wp.dot(wp.cross(p, y), normal) / n2
    b = wp.dot(wp.cross(x, p), normal) / n2
    distance = wp.dot(p + center, wi)
    if a * a + b * b > 1.0 or distance <= 0.0:
        return s
    s.distance = distance
    v = view_disk(center, x, y)
    if v.is_near == 0:
        s.pdf = area_pdf(wp.pi * normal, wi, distance)
        return s
    angle = wp.atan2(v.start + v.width * a, v.height)
    # The root of g (3 - g^2) / 2 that is in [-1, 1].
    g = 2.0 * wp.sin(safe_asin((angle - v.middle) / v.reach) / 3.0)
    own = wp.clamp(int(0.5 * (g + 1.0) * float(DISK_CELLS)), 0, DISK_CELLS - 1)
    total = float(0.0)
    weight = float(0.0)
    for k in range(DISK_CELLS):
        part = cell_weight(v, k)
        total += part
        if k == own:
            weight = part
    s.pdf = chord_pdf(v, g, chord_sines(v, a), weight / total)
    return s
