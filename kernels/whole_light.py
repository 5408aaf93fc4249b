# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A light as a whole: its irradiance in closed form, times its mean radiance, without noise."""

import warp as wp

from .codes import UNEVEN, VARIED
from .constants import (
    CONE_CELLS,
    FAR_FOCUS,
    FAR_LIGHT,
    FOCUS_CELLS,
    LARGE_DISK,
    LIGHT_CELLS,
    LIGHT_CELLS_FINE,
    LIGHT_CELLS_MAX,
    SLIVER_CELLS,
)
from .emission import EmissionCell, light_emission, mean_emission, rect_coordinates
from .light import (
    KIND_DISK,
    KIND_DISTANT,
    KIND_MESH,
    KIND_POINT,
    KIND_SPHERE,
    LightSample,
    sample_light,
)
from .light_direction import LightDirection
from .light_variation import (
    CUT,
    DARK,
    EVEN,
    angle_to_axis,
    cone_view,
    focus_rate,
    half_angle,
    is_profile_even,
    profile_cell,
)
from .outline import SeenPart, cone_flux, outlined_light
from .profile import profile_factor
from .sample_light import light_radiance, sample_extent
from .sampling import concentric_disk
from .structs import LightData, SceneData
from .vector import max_magnitude
from .whole_mesh import mesh_light


@wp.func
def bounding_square(light: wp.ref[LightData]) -> float:
    """Return the squared radius of a ball about a light's centre that holds a rect, or a box about the others."""
    return wp.length_sq(light.half_x) + wp.length_sq(light.half_y) + wp.length_sq(light.half_z)


@wp.func
def has_closed_form(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> bool:
    """Return whether a light's closed form, that of its whole and even shape, shaped as at its centre, is what counts.

    It is not where the horizon cuts through the light, and for one whose radiance or shape varies where that is seen.

    Args:
        scene: Profiles.
        light: The light.
        position: Of the surface.
        n: Its unit normal.
    """
    if light.kind == KIND_POINT:
        return True
    if light.kind == KIND_DISTANT:
        height = wp.dot(n, light.axis_z)
        return light.cap < 1.0 and height * height >= light.cap * (2.0 - light.cap)
    if (light.varies & UNEVEN) != 0:
        return False
    center = light.position - position
    size2 = bounding_square(light)
    height = wp.dot(n, center)
    if height * height < size2:
        return False
    if light.varies == 0:
        return True
    d2 = wp.length_sq(center)
    if d2 < FAR_LIGHT * FAR_LIGHT * size2 or cone_view(light, center, size2) != EVEN:
        return False
    half = half_angle(size2, d2)
    if light.focus > 0.0 and half * focus_rate(light, center, half) > FAR_FOCUS:
        return False
    return light.profile < 0 or is_profile_even(scene, light, center, half)


@wp.func
def even_count(count: float) -> int:
    """Return a number of cells rounded up to an even one, up to ``LIGHT_CELLS_MAX``."""
    return 2 * int(wp.ceil(0.5 * wp.min(count, float(LIGHT_CELLS_MAX))))


@wp.func
def cell_count(scene: wp.ref[SceneData], light: wp.ref[LightData], to_center: wp.vec3, size2: float, view: int) -> int:
    """Return into how many cells each way a light is cut, so that its radiance varies little within one.

    Args:
        scene: Profiles.
        light: The light.
        to_center: From the surface to its centre.
        size2: Its :func:`bounding_square`.
        view: Of its cone.
    """
    half = half_angle(size2, wp.length_sq(to_center))
    count = float(LIGHT_CELLS)
    if view == CUT or light.profile >= 0 or light.texture >= 0:
        count = float(LIGHT_CELLS_FINE)
    if view == CUT:
        count = wp.max(count, CONE_CELLS * 2.0 * half / wp.max(light.cone_angle, 1.0e-3))
    if light.profile >= 0:
        count = wp.max(count, 2.0 * half / profile_cell(scene, light, to_center, half))
    if light.focus > 0.0:
        count = wp.max(count, FOCUS_CELLS * 2.0 * half * focus_rate(light, to_center, half))
    return even_count(count)


@wp.struct
class DiskView:
    """What of a disk, or an ellipse, that looks large is above a surface's horizon: chords along the horizon."""

    along: wp.vec3
    """Unit, in the disk's plane, along the horizon."""
    up: wp.vec3
    """Unit, in the disk's plane, square to it."""
    toward: wp.vec3
    """Unit, square to that plane, from the surface to it."""
    height: wp.float32
    """Of the surface above the disk's plane; 0 for any other light."""
    foot: wp.vec2
    """Where it stands on that, along ``along`` and ``up`` from the centre."""
    top: wp.float32
    """How far the disk reaches along ``up``."""
    lean: wp.float32
    """By how much the chords' middles move along ``along`` a step along ``up``."""
    reach: wp.float32
    """Half the chord through the centre."""
    begin: wp.float32
    """Angle of the lowest chord that is seen, from the foot."""
    angle: wp.float32
    """Angle that the chords cover."""


@wp.func
def disk_view(light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> DiskView:
    """Return what a surface sees of a disk that looks large; of any other light nothing.

    Args:
        light: Any light.
        position: Of the surface.
        n: Its unit normal.
    """
    view = DiskView()
    x = light.half_x
    y = light.half_y
    center = light.position - position
    size2 = wp.length_sq(x) + wp.length_sq(y)
    if light.kind != KIND_DISK or wp.length_sq(center) > LARGE_DISK * LARGE_DISK * size2:
        return view
    along = wp.cross(n, light.normal)
    if wp.length_sq(along) < 1.0e-6:
        along = x
    view.along = wp.normalize(along)
    view.up = wp.cross(light.normal, view.along)
    if wp.dot(view.up, n) < 0.0:
        view.up = -view.up
    # An ellipse of conjugate half axes x and y: points of variances and a covariance.
    ax = wp.dot(x, view.along)
    ay = wp.dot(y, view.along)
    ux = wp.dot(x, view.up)
    uy = wp.dot(y, view.up)
    top2 = ux * ux + uy * uy
    view.top = wp.sqrt(top2)
    view.lean = (ax * ux + ay * uy) / top2
    view.reach = wp.abs(ax * uy - ay * ux) / view.top
    bottom = -view.top
    rise = wp.dot(n, view.up)
    if rise > 1.0e-3:
        bottom = wp.clamp(-wp.dot(n, center) / rise, -view.top, view.top)
    view.toward = light.normal
    view.height = wp.max(wp.dot(center, light.normal), 0.0)
    view.foot = -wp.vec2(wp.dot(center, view.along), wp.dot(center, view.up))
    view.begin = wp.atan2(bottom - view.foot[1], view.height)
    view.angle = wp.atan2(view.top - view.foot[1], view.height) - view.begin
    return view


@wp.func
def sample_disk_view(view: wp.ref[DiskView], u: wp.vec2) -> LightDirection:
    """Return a direction to a disk: all angles to its chords are as likely, and all angles along a chord.

    Reference: Kulla and Fajardo (2012), Importance Sampling Techniques for Path Tracing in Participating Media, CGF
    31(4), section 4.1, for a line.
    """
    s = LightDirection()
    if view.angle <= 0.0:
        return s
    turn = view.begin + u[1] * view.angle
    h = view.height / wp.cos(turn)
    row = wp.clamp(view.foot[1] + view.height * wp.tan(turn), -view.top, view.top)
    relative = row / view.top
    half = view.reach * wp.sqrt(wp.max(1.0 - relative * relative, 0.0))
    middle = view.lean * row - view.foot[0]
    first = wp.atan2(middle - half, h)
    angle = wp.atan2(middle + half, h) - first
    if angle <= 0.0:
        return s
    place = h * wp.tan(first + u[0] * angle)
    s.distance = wp.sqrt(h * h + place * place)
    p = view.along * place + view.up * (row - view.foot[1]) + view.toward * view.height
    s.wi = wp.normalize(p)
    # The cosine at the disk cancels against the rates of either angle.
    s.pdf = s.distance / (h * view.angle * angle)
    return s


@wp.func
def sample_cell(light: wp.ref[LightData], position: wp.vec3, disk: wp.ref[DiskView], u: wp.vec2) -> LightDirection:
    """Return what ``sample_extent`` does, by squares of the unit square that are about as long as wide as seen.

    A sphere's sampler takes polar coordinates, whose cells would be wedges. A large disk's takes areas, which look as
    large as they are near, and many of which the horizon may hide.

    Args:
        light: One with an extent.
        position: Of the surface.
        disk: The light's :func:`disk_view`.
        u: Point of the unit square.
    """
    if disk.height > 0.0:
        return sample_disk_view(disk, u)
    if light.kind == KIND_SPHERE:
        q = concentric_disk(u)
        turn = wp.atan2(q[1], q[0]) / (2.0 * wp.pi)
        return sample_extent(light, position, wp.vec2(wp.length_sq(q), turn if turn >= 0.0 else turn + 1.0))
    return sample_extent(light, position, u)


@wp.struct
class MeanRadiance:
    """Of what a surface sees of a light, by what each part would send there if all were alike."""

    radiance: wp.vec3
    share: wp.float32
    """Of what it would be, were it all as bright: the squared mean by the mean square, of a hard cone what is lit."""


@wp.func(inline=False)
def mean_radiance(
    scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3, count: int, seen: SeenPart
) -> MeanRadiance:
    """Return the mean of a light's radiance over what a surface sees of it.

    The light is cut into cells, squares of the unit square that its samplers map to it. Four cells at a time tell how
    wide each of them is in the cone's angle and in the texture, over which both are averaged: without that, a rim that
    cuts through the light would jump from cell to cell.

    Args:
        scene: Textures and profiles.
        light: A rect, disk, sphere or cylinder.
        position: Of the surface.
        n: Its unit normal.
        count: Cells each way; even.
        seen: What of the light is above the horizon: its middle counts where no cell's is.
    """
    mean = MeanRadiance()
    total = wp.vec3(0.0, 0.0, 0.0)
    whole = float(0.0)
    first = float(0.0)
    second = float(0.0)
    step = 1.0 / float(count)
    disk = disk_view(light, position, n)
    for block in range(count * count / 4):
        row = 2 * (block / (count / 2))
        column = 2 * (block - (row / 2) * (count / 2))
        u = wp.vec2(float(column) + 0.5, float(row) + 0.5) * step
        a = sample_cell(light, position, disk, u)
        b = sample_cell(light, position, disk, u + wp.vec2(step, 0.0))
        c = sample_cell(light, position, disk, u + wp.vec2(0.0, step))
        d = sample_cell(light, position, disk, u + wp.vec2(step, step))
        cell = EmissionCell()
        if light.cone_angle < wp.pi or light.profile >= 0:
            angle_a = angle_to_axis(light, a.wi)
            angle_b = angle_to_axis(light, b.wi)
            angle_c = angle_to_axis(light, c.wi)
            angle_d = angle_to_axis(light, d.wi)
            across = 0.5 * (angle_b - angle_a + angle_d - angle_c)
            down = 0.5 * (angle_c - angle_a + angle_d - angle_b)
            # A side of width w has a variance of w^2 / 12.
            cell.spread = (20.0 / 12.0) * (across * across + down * down)
        if light.texture >= 0:
            st_a = rect_coordinates(light, position + a.wi * a.distance - light.position)
            cell.across = rect_coordinates(light, position + b.wi * b.distance - light.position) - st_a
            cell.down = rect_coordinates(light, position + c.wi * c.distance - light.position) - st_a
        for k in range(wp.int32(4)):
            one = a
            if k == 1:
                one = b
            elif k == 2:
                one = c
            elif k == 3:
                one = d
            cosine = wp.dot(n, one.wi)
            if one.pdf > 0.0 and cosine > 0.0:
                weight = cosine / one.pdf
                emission = mean_emission(scene, light, position, one.wi, one.distance, cell)
                total += emission * weight
                whole += weight
                brightness = max_magnitude(emission)
                first += brightness * weight
                second += brightness * brightness * weight
    if whole > 0.0:
        mean.radiance = total / whole
        mean.share = first * (first / wp.max(second * whole, 1.0e-30))
    else:
        mean.radiance = light_emission(scene, light, position, wp.normalize(seen.middle), wp.length(seen.middle))
        mean.share = 1.0
    return mean


@wp.func(inline=False)
def summed_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return how a light reaches a surface where its plain closed form is not what counts.

    Args:
        scene: Textures and profiles.
        light: One with an extent, no mesh.
        position: Of the surface.
        n: Its unit normal.
    """
    s = LightSample()
    if light.kind == KIND_DISTANT:
        flux = cone_flux(light.axis_z, light.cap, n)
        amount = wp.length(flux)
        if amount == 0.0:
            return s
        s.wi = flux / amount
        s.irradiance = light_radiance(light, s.wi, 0.0) * amount
        s.to_shadow = light.axis_z if wp.dot(n, light.axis_z) > 0.0 else s.wi
        s.distance = wp.inf
        return s
    to_center = light.position - position
    size2 = bounding_square(light)
    view = cone_view(light, to_center, size2)
    if view == DARK:
        return s
    seen = outlined_light(light, position, n)
    amount = wp.length(seen.flux)
    if amount == 0.0:
        return s
    s.wi = seen.flux / amount
    target = to_center if wp.dot(n, to_center) > 0.0 else seen.middle
    s.distance = wp.length(target)
    s.to_shadow = target / s.distance
    radiance = light.emission
    if (light.varies & VARIED) != 0:
        count = cell_count(scene, light, to_center, size2, view)
        mean = mean_radiance(scene, light, position, n, count, seen)
        finer = even_count(SLIVER_CELLS / wp.max(mean.share, 1.0e-3))
        if mean.share > 0.0 and finer > count and (view == CUT or light.profile >= 0):
            mean = mean_radiance(scene, light, position, n, finer, seen)
        radiance = mean.radiance
    s.irradiance = radiance * amount
    return s


@wp.func
def whole_light(scene: wp.ref[SceneData], light: wp.ref[LightData], position: wp.vec3, n: wp.vec3) -> LightSample:
    """Return how a light reaches a surface, shaping and profile included, shadows not.

    The shadow ray goes to the light's centre, or, where that is below the horizon, to the middle of what is above it.

    Args:
        scene: Textures and profiles.
        light: Of any kind.
        position: Of the surface.
        n: Its unit normal.
    """
    if light.kind == KIND_MESH:
        return mesh_light(scene, light, position, n)
    s = LightSample()
    if has_closed_form(scene, light, position, n):
        s = sample_light(light, position)
    else:
        return summed_light(scene, light, position, n)
    if light.profile >= 0:
        s.irradiance = s.irradiance * profile_factor(scene, light.profile, s.wi, 0.0)
    return s
