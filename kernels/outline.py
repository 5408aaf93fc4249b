# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a light of even radiance sends to a surface, by its outline: exact for any shape, cut by the horizon or not.

The irradiance of a surface depends on nothing but the outline of what it sees above its horizon: Lambert's sum over the
edges of a polygon. Rects have four; circles, of disks, spheres and the ends of cylinders under any transform, have
``OUTLINE_EDGES`` or ``OUTLINE_EDGES_FINE``, moved outwards so far that the polygon's area is the circle's.

Reference: Lambert (1760), Photometria; Arvo (1995), Applications of Irradiance Tensors, equation 11.
"""

import warp as wp

from .constants import LEAST_DIVISOR, LEAST_SINE, OUTLINE_EDGES, OUTLINE_EDGES_FINE, WIDE_EDGE
from .light import KIND_CYLINDER, KIND_RECT, KIND_SPHERE
from .light_direction import solve_axes
from .light_structs import LightData
from .meridian import MeridianView, ShapedFlux, add_edge, meridian_view
from .scene_structs import SceneData
from .vector import face_forward, perpendicular_frame


@wp.struct
class Outline:
    """A closed curve, point k of it being a turn about one centre, or about that and then its opposite."""

    center: wp.vec3
    """From the light's own; of a cylinder's two ends, the first."""
    x: wp.vec3
    """Conjugate half axis of the curve; so too ``y``."""
    y: wp.vec3
    half_arc: wp.float32
    """Of a cylinder: half the arc of each of its ends that faces the surface; else 0."""
    edges: wp.int32
    """0: the light is not seen."""


@wp.struct
class SeenPart:
    """What of a light is above a surface's horizon."""

    flux: wp.vec3
    """Vector irradiance from it for radiance 1."""
    shaped: ShapedFlux
    """Of one that has meridians, the same with its shaping."""
    middle: wp.vec3
    """From the surface to the mean of its corners; zero where nothing is seen."""


@wp.func
def outline_of(light: wp.ref[LightData], to_center: wp.vec3) -> Outline:
    """Return the outline of a rect, disk, sphere or cylinder of any transform.

    Args:
        light: The light.
        to_center: From the surface to the light's centre.
    """
    o = Outline()
    edges = OUTLINE_EDGES_FINE if light.meridians >= 0 else OUTLINE_EDGES
    x = light.half_x
    y = light.half_y
    z = light.half_z
    if light.kind == KIND_SPHERE:
        # In the space of the unit sphere the outline is the circle in which a cone from the surface touches it.
        local = solve_axes(x, y, z, to_center)
        d2 = wp.length_sq(local)
        if d2 > 1.0:
            w = local / wp.sqrt(d2)
            radius = wp.sqrt(1.0 - 1.0 / d2)
            across, down = perpendicular_frame(w)
            back = -w / wp.sqrt(d2)
            o.center = x * back[0] + y * back[1] + z * back[2]
            o.x = (x * across[0] + y * across[1] + z * across[2]) * radius
            o.y = (x * down[0] + y * down[1] + z * down[2]) * radius
            o.edges = edges
        return o
    if light.kind == KIND_CYLINDER:
        # The arc of its section that faces the surface: acos(1 / d) either way, at d radii.
        local = solve_axes(x, y, z, to_center)
        d2 = local[1] * local[1] + local[2] * local[2]
        if d2 > 1.0:
            toward = -wp.vec2(local[1], local[2]) / wp.sqrt(d2)
            o.center = x
            o.x = y * toward[0] + z * toward[1]
            o.y = z * toward[0] - y * toward[1]
            o.half_arc = wp.asin(wp.sqrt(1.0 - 1.0 / d2))
            o.edges = edges
        return o
    if wp.dot(to_center, light.normal) > 0.0:
        o.x = x
        o.y = y
        o.edges = 4 if light.kind == KIND_RECT else edges
    return o


@wp.func
def outline_point(o: wp.ref[Outline], k: int) -> wp.vec3:
    """Return point k of an outline, from the light's centre."""
    if o.edges == 4:
        side = 1.0 if k == 0 or k == 3 else -1.0
        return o.x * side + o.y * (1.0 if k < 2 else -1.0)
    if o.half_arc == 0.0:
        step = 2.0 * wp.pi / float(o.edges)
        turn = step * float(k)
        out = wp.sqrt(step / wp.sin(step))
        return o.center + o.x * (out * wp.cos(turn)) + o.y * (out * wp.sin(turn))
    # Along one end of the cylinder, and back along the other. The first and the last point of an end lie on the lines
    # that touch the cylinder; the others stand out: (n - 2) r^2 + 2 r = n a / sin a, a being the angle of an edge.
    count = o.edges / 2
    on_end = k if k < count else 2 * count - 1 - k
    edges = float(count - 1)
    step = 2.0 * o.half_arc / edges
    angle = step * float(on_end) - o.half_arc
    out = float(1.0)
    if on_end > 0 and on_end < count - 1:
        out = (wp.sqrt(1.0 + (edges - 2.0) * edges * step / wp.max(wp.sin(step), LEAST_SINE)) - 1.0) / (edges - 2.0)
    rim = o.x * (out * wp.cos(angle)) + o.y * (out * wp.sin(angle))
    return rim + o.center if k < count else rim - o.center


@wp.func
def direction_offset(c: wp.vec3, distance: float, r: wp.vec3) -> wp.vec3:
    """Return by how much the unit direction to a point differs from that to the light's centre; small in full digits.

    Args:
        c: Unit direction to the centre.
        distance: To the centre.
        r: From the centre to the point.
    """
    d = wp.length(c * distance + r)
    # 1 / d - 1 / distance, times the distance, without its cancellation.
    shorter = -(2.0 * distance * wp.dot(c, r) + wp.length_sq(r)) / (distance + d)
    return (r + c * shorter) / wp.max(d, LEAST_DIVISOR)


@wp.func
def edge_flux(c: wp.vec3, a: wp.vec3, b: wp.vec3) -> wp.vec3:
    """Return an edge's part of twice the vector irradiance, but for c x (b - a), which closed outlines sum up to 0.

    Lambert's term is the angle between the edge's ends, along the normal of the plane through them. Written with the
    offsets from one direction it keeps its digits however small the light looks.

    Args:
        c: Unit direction to the light's centre.
        a: What the edge's first unit direction differs from it by; so too ``b``, its second.
        b: See ``a``.
    """
    chord = b - a
    s2 = 0.25 * wp.length_sq(chord)  # squared sine of half the angle
    if s2 < WIDE_EDGE:
        # angle / sin(angle) - 1, as a series of the sine of half of it.
        more = s2 * (2.0 / 3.0 + s2 * (8.0 / 15.0 + s2 * (16.0 / 35.0 + s2 * (128.0 / 315.0))))
        return wp.cross(a, b) * (1.0 + more) + wp.cross(c, chord) * more
    first = c + a
    second = c + b
    normal = wp.cross(first, second)
    sine = wp.length(normal)
    return normal * (wp.atan2(sine, wp.dot(first, second)) / wp.max(sine, LEAST_SINE)) - wp.cross(c, chord)


@wp.func
def bounding_square(light: wp.ref[LightData]) -> float:
    """Return the squared radius of a ball about a light's centre that holds it: a rect, or a box about the others."""
    x = light.half_x
    xy = wp.dot(x, light.half_y)
    xz = wp.dot(x, light.half_z)
    lean = wp.sqrt(xy * xy + xz * xz)  # 0 but under a shear
    return wp.length_sq(x) + wp.length_sq(light.half_y) + wp.length_sq(light.half_z) + 2.0 * lean


@wp.func
def add_seen_edge(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    view: wp.ref[MeridianView],
    c: wp.vec3,
    a: wp.vec3,
    b: wp.vec3,
    seen: wp.ref[SeenPart],
):
    """Add an edge to twice the flux of a light, and to what is shaped of it: see :func:`edge_flux`."""
    seen.flux += edge_flux(c, a, b)
    if light.meridians >= 0:
        add_edge(scene, light, view, c, a, b, seen.shaped)


@wp.func
def outlined_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> SeenPart:
    """Return what a surface sees of a rect, disk, sphere or cylinder above its horizon, for radiance 1.

    Args:
        scene: Meridians.
        light: The light.
        position: Of the surface.
        n: Its unit normal.

    Reference: Sutherland and Hodgman (1974), Reentrant Polygon Clipping, CACM 17(1), against one plane.
    """
    seen = SeenPart()
    to_center = light.position - position
    outline = outline_of(light, to_center)
    if outline.edges == 0:
        return seen
    distance = wp.max(wp.length(to_center), LEAST_DIVISOR)
    c = to_center / distance
    height = wp.dot(n, to_center)
    view = meridian_view(scene, light, to_center, bounding_square(light))
    middle = wp.vec3(0.0, 0.0, 0.0)
    corners = float(0.0)
    left = int(0)  # 1: the outline is below the horizon since ``leaves``
    entered = int(0)  # 1: it was below from the start, and came up at ``enters``
    leaves = wp.vec3(0.0, 0.0, 0.0)
    enters = wp.vec3(0.0, 0.0, 0.0)
    r = outline_point(outline, outline.edges - 1)
    h = height + wp.dot(n, r)
    a = direction_offset(c, distance, r)
    for k in range(outline.edges):
        r_next = outline_point(outline, k)
        h_next = height + wp.dot(n, r_next)
        b = direction_offset(c, distance, r_next)
        if h > 0.0:
            middle += r
            corners += 1.0
        if h > 0.0 and h_next > 0.0:
            add_seen_edge(scene, light, view, c, a, b, seen)
        elif h > 0.0 or h_next > 0.0:
            on_horizon = r + (r_next - r) * (h / (h - h_next))
            crossing = direction_offset(c, distance, on_horizon)
            middle += on_horizon
            corners += 1.0
            if h > 0.0:
                add_seen_edge(scene, light, view, c, a, crossing, seen)
                leaves = crossing
                left = 1
            else:
                add_seen_edge(scene, light, view, c, crossing, b, seen)
                if left != 0:
                    add_seen_edge(scene, light, view, c, leaves, crossing, seen)
                    left = 0
                else:
                    enters = crossing
                    entered = 1
        r = r_next
        h = h_next
        a = b
    if entered != 0:
        add_seen_edge(scene, light, view, c, leaves, enters, seen)
    if corners == 0.0:
        return seen
    # The sign of the sum is that of the outline's sense, which mirroring turns round.
    seen.flux = face_forward(0.5 * seen.flux, n)
    seen.shaped.focused = face_forward(seen.shaped.focused, n)
    seen.shaped.open = face_forward(seen.shaped.open, n)
    seen.middle = to_center + middle / corners
    return seen


@wp.func
def segment(angle: float) -> float:
    """Return an angle of 0 to 90 degrees less half the sine of its double, of a small one in full digits."""
    double = 2.0 * angle
    if double > 0.5:
        return 0.5 * (double - wp.sin(double))
    square = double * double
    return double * square / 12.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0)))


@wp.func
def cap_flux(axis: wp.vec3, sine: float, cosine: float, n: wp.vec3) -> wp.vec3:
    """Return the vector irradiance from what is above the horizon of an even cone of radiance 1, up to 90 degrees wide.

    Its outline is a part of the cone's circle, along which Lambert's integral is elementary, and one of the horizon.

    Args:
        axis: Unit direction to the cone's middle.
        sine: Of its half angle.
        cosine: Of its half angle.
        n: Unit normal of the surface.
    """
    up = wp.dot(n, axis)
    across = wp.length(n - axis * up)
    if across * sine <= cosine * wp.abs(up):
        return axis * (wp.pi * sine * sine) if up > 0.0 else wp.vec3(0.0, 0.0, 0.0)
    # Of the circle's points that at an angle t from the uppermost one has the height cosine up + sine across cos t.
    cos_turn = wp.clamp(-cosine * up / (sine * across), -1.0, 1.0)
    turn = wp.acos(cos_turn)
    # Half of what is seen of the horizon is an angle of this sine and cosine.
    v = sine * wp.sqrt(1.0 - cos_turn * cos_turn)
    w = cosine / across
    return axis * (sine * sine * turn + up * v * w) + n * segment(wp.atan2(v, w))


@wp.func
def cone_flux(axis: wp.vec3, cap: float, n: wp.vec3) -> wp.vec3:
    """Return the vector irradiance from what is above the horizon of an even cone of radiance 1, of any angle.

    Args:
        axis: Unit direction to the cone's middle.
        cap: 1 - cos of its half angle.
        n: Unit normal of the surface.
    """
    sine = wp.sqrt(wp.max(cap * (2.0 - cap), 0.0))
    if cap <= 1.0:
        return cap_flux(axis, sine, 1.0 - cap, n)
    return n * wp.pi - cap_flux(-axis, sine, cap - 1.0, n)
