# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What lights send whose focus, cone and profile make them brighter in some directions: an integral along the outline.

These three are one factor f of the angle theta to the light's axis a and of the azimuth phi about it. Within an outline
on the sphere of directions the vector irradiance is, by Stokes's theorem,

    integral of f w dw = integral along the outline of (a F1 + e F2) dphi,
    F1 = integral of f cos sin, F2 = integral of f sin^2, over the meridian from the axis to theta,

e being the unit vector square to the axis at phi. F1 and F2 are tabulated, so that a factor may be as fine as it likes:
what is summed along the outline is smooth, and no rim of a cone within the outline is missed.

Reference: Arvo (1995), Applications of Irradiance Tensors to the Simulation of Non-Lambertian Phenomena, sections 3 and
4, whose axial moments are these for f = cos^n.
"""

import warp as wp

from .constants import (
    FAR_END,
    FAR_END_STEP,
    FOCUS_DARK,
    FOCUS_STEP,
    GAUSS_POINT,
    LEAST_DIVISOR,
    MERIDIAN_CELLS,
    MERIDIAN_STEPS,
    OFF_AXIS,
    WIDE_CHORD,
)
from .light_direction import half_angle
from .light_structs import LightData
from .profile import find_angle
from .scene_structs import SceneData


@wp.struct
class MeridianView:
    """Meridians of a light about one end of its axis."""

    axis: wp.vec3
    """Unit, from the surface to that end; zero for a light that has no meridians."""
    first: wp.int32
    """Of its numbers in ``SceneData.meridian_sums``."""
    open: wp.int32
    """First of them without its focus."""
    planes: wp.int32
    begin: wp.float32
    """Angle of the first row."""
    reach: wp.float32
    """To that of the last."""
    step: wp.float32
    """Greatest angle [rad] along the outline between two places of the sum."""


@wp.struct
class ShapedFlux:
    """Vector irradiance from a light of radiance 1, shaped."""

    focused: wp.vec3
    """By focus, cone and profile."""
    open: wp.vec3
    """Without the focus."""
    summed: wp.float32
    """What ``focused`` is the sum of, taken positive: how much of it cancels."""


@wp.func
def meridian_view(scene: wp.ref[SceneData], light: wp.ref[LightData], to_center: wp.vec3, size2: float) -> MeridianView:
    """Return how the meridians of a light, or of a part of it, lie to a surface.

    They are those about the end of its axis that is nearer to where it is seen; or about the other one, if it is dark
    there, and what is seen is off the axis: the sums then begin at the rim and are as small as what is left there,
    where those from the axis on would cancel.

    Args:
        scene: Meridians.
        light: Any light.
        to_center: From the surface to the middle of it, or of its part.
        size2: Squared radius of a ball that holds that.
    """
    view = MeridianView()
    if light.meridians < 0:
        return view
    data = scene.meridians[light.meridians]
    numbers = data.planes * (MERIDIAN_CELLS + 1)
    view.axis = light.axis_z
    view.first = data.offset
    view.begin = data.begin
    view.reach = data.end - data.begin
    d2 = wp.max(wp.length_sq(to_center), LEAST_DIVISOR)
    half = half_angle(size2, d2)
    cosine = wp.dot(to_center, light.axis_z) / wp.sqrt(d2)
    nearest = wp.max(wp.acos(wp.clamp(wp.abs(cosine), 0.0, 1.0)) - half, 0.0)
    if cosine < 0.0 or (data.end < wp.pi and nearest > OFF_AXIS * data.end):
        view.axis = -light.axis_z
        view.first += numbers
        view.begin = wp.pi - data.end
    view.open = view.first + 2 * numbers if data.has_open != 0 else view.first
    view.planes = data.planes
    view.step = wp.min(data.step, half / MERIDIAN_STEPS)
    if light.focus > 0.0 and wp.pow(wp.cos(nearest), light.focus) > FOCUS_DARK:
        # Off the axis it falls the steeper.
        view.step = wp.min(view.step, FOCUS_STEP / wp.max(light.focus * wp.tan(nearest), 1.0e-3))
    return view


@wp.func
def sums_in_plane(scene: wp.ref[SceneData], first: int, row: float, width: float) -> wp.vec2:
    """Return F1 and F2 at a row of one plane's numbers, by the cubic that has their values and rates at its ends.

    Args:
        scene: Meridians.
        first: The plane's first number.
        row: Not whole.
        width: Angle of the last row of all, by its square.
    """
    i = wp.min(int(row), MERIDIAN_CELLS - 1)
    low = float(i * i)
    step = float(2 * i + 1)
    u = (row * row - low) / step
    a = scene.meridian_sums[first + i]
    b = scene.meridian_sums[first + i + 1]
    rise = u * u * (3.0 - 2.0 * u)
    rate_a = u * (1.0 - u) * (1.0 - u) * step * width
    rate_b = u * u * (u - 1.0) * step * width
    f1 = a[0] * (1.0 - rise) + b[0] * rise + a[2] * rate_a + b[2] * rate_b
    f2 = a[1] * (1.0 - rise) + b[1] * rise + a[3] * rate_a + b[3] * rate_b
    return wp.vec2(f1, f2)


@wp.func
def add_place(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    view: wp.ref[MeridianView],
    p: wp.vec3,
    turn: float,
    flux: wp.ref[ShapedFlux],
):
    """Add what one place of the outline contributes.

    Args:
        scene: Meridians.
        light: One that has them.
        view: How they lie.
        p: Direction to the place, of any length.
        turn: Angle about the axis that it stands for, times the squared distance of ``p`` from the axis.
        flux: Takes it.
    """
    along = wp.dot(view.axis, p)
    across = p - view.axis * along
    q2 = wp.max(wp.length_sq(across), 1.0e-20)
    q = wp.sqrt(q2)
    # Before the first row and beyond the last there is nothing: the sums stay what they are.
    place = wp.clamp((wp.atan2(q, along) - view.begin) / view.reach, 0.0, 1.0)
    row = wp.sqrt(place) * float(MERIDIAN_CELLS)
    width = view.reach / float(MERIDIAN_CELLS * MERIDIAN_CELLS)
    first = wp.vec2(0.0, 0.0)
    second = wp.vec2(0.0, 0.0)
    if view.planes == 1:
        first = sums_in_plane(scene, view.first, row, width)
        second = first
        if view.open != view.first:
            second = sums_in_plane(scene, view.open, row, width)
    else:
        profile = scene.profiles[light.profile]
        phi = wp.atan2(wp.dot(profile.row_y, p), wp.dot(profile.row_x, p))
        if phi < 0.0:
            phi += 2.0 * wp.pi
        numbers = scene.profile_numbers
        horizontal = profile.offset + profile.vertical_count
        if phi >= numbers[horizontal] and phi <= numbers[horizontal + view.planes - 1]:
            j = find_angle(numbers, horizontal, view.planes, phi)
            v = (phi - numbers[horizontal + j]) / (numbers[horizontal + j + 1] - numbers[horizontal + j])
            here = j * (MERIDIAN_CELLS + 1)
            there = here + MERIDIAN_CELLS + 1
            first = sums_in_plane(scene, view.first + here, row, width) * (1.0 - v)
            first += sums_in_plane(scene, view.first + there, row, width) * v
            second = first
            if view.open != view.first:
                second = sums_in_plane(scene, view.open + here, row, width) * (1.0 - v)
                second += sums_in_plane(scene, view.open + there, row, width) * v
    turn = turn / q2
    across = across / q
    flux.focused += (view.axis * first[0] + across * first[1]) * turn
    flux.open += (view.axis * second[0] + across * second[1]) * turn
    flux.summed += (first[0] + first[1]) * wp.abs(turn)


@wp.func
def inverse_sinh(x: float) -> float:
    """Return the inverse of the hyperbolic sine."""
    result = wp.log(wp.abs(x) + wp.sqrt(x * x + 1.0))
    return result if x >= 0.0 else -result


@wp.func(inline=False)
def add_edge(
    scene: wp.ref[SceneData],
    light: wp.ref[LightData],
    view: wp.ref[MeridianView],
    c: wp.vec3,
    a: wp.vec3,
    b: wp.vec3,
    flux: wp.ref[ShapedFlux],
):
    """Add an edge's part of a shaped light's vector irradiance: two-point Gauss-Legendre over short pieces of it.

    Args:
        scene: Meridians.
        light: One that has them.
        view: How they lie.
        c: Unit direction to the light's centre.
        a: What the edge's first unit direction differs from it by; so too ``b``, its second.
        b: See ``a``.
        flux: Takes it.
    """
    first = c + a
    second = c + b
    chord = b - a
    half = 0.5 * wp.length(chord)
    angle = 2.0 * wp.asin(wp.min(half, 1.0))
    count = wp.max(int(wp.ceil(angle / view.step)), 1)
    before = 0.5 * (1.0 - GAUSS_POINT)
    along = wp.dot(view.axis, first)
    along_second = wp.dot(view.axis, second)
    if half < WIDE_CHORD and wp.min(along, along_second) > -0.8:
        piece = chord / float(count)
        for k in range(count):
            start = first + piece * float(k)
            turn = 0.5 * wp.dot(view.axis, wp.cross(start, piece))
            add_place(scene, light, view, start + piece * before, turn, flux)
            add_place(scene, light, view, start + piece * (1.0 - before), turn, flux)
        return
    # Pieces of equal angles. At the axis's far end the azimuth changes the faster, the nearer the edge comes to it:
    # there they grow with the distance from it.
    normal = wp.normalize(wp.cross(first, second))
    down = wp.cross(normal, first)
    nearest = wp.atan2(-wp.dot(view.axis, down), -along)
    miss = wp.max(wp.abs(wp.dot(view.axis, normal)), 1.0e-4)
    beside = wp.max(wp.max(-nearest, nearest - angle), 0.0)
    is_near = miss * miss + beside * beside < FAR_END * view.step * FAR_END * view.step
    u_first = float(0.0)
    u_all = angle
    if is_near:
        u_first = inverse_sinh(-nearest / miss)
        u_all = inverse_sinh((angle - nearest) / miss) - u_first
        widest = wp.max(wp.abs(nearest), wp.abs(angle - nearest))
        count = wp.max(int(wp.ceil(u_all / wp.min(FAR_END_STEP, view.step / widest))), 1)
    start = first
    for k in range(count):
        turned = u_first + u_all * float(k + 1) / float(count)
        if is_near:
            turned = nearest + miss * wp.sinh(turned)
        end = first * wp.cos(turned) + down * wp.sin(turned)
        piece = end - start
        turn = 0.5 * wp.dot(view.axis, wp.cross(start, piece))
        add_place(scene, light, view, start + piece * before, turn, flux)
        add_place(scene, light, view, start + piece * (1.0 - before), turn, flux)
        start = end
