# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How far the rays of neighbouring samples are apart: what a texture is averaged over.

A ray carries the derivatives of its origin and direction by its sample's place in the picture: x across, y down, from
one sample to the next. They are followed to the surface, mirrored and refracted. Only scenes with textures need them.

Reference: Igehy (1999), Tracing Ray Differentials, SIGGRAPH 99, section 3.
"""

import warp as wp

from .constants import CUBIC_TUBE, FRUSTUM, GRAZING, LEAST_DIVISOR, PARAMETRIC, SPHERE, TRIANGLES
from .features import Features, PlainScene
from .frame_structs import FrameData
from .intersect_tube import bezier_blossom, bezier_derivative
from .per_type import per_type
from .primvar import NORMALS_SLOT, primvar_corner, primvar_row
from .ray_structs import RayDifferential, RayTask
from .scene_structs import SceneData
from .shape_surface import first_control, shape_axis, xyz
from .surface import Surface, eval_normals
from .transform import transform_normal, transform_point, transform_vector
from .triangle import triangle_corners
from .vector import max_magnitude


# Out of line, so that scenes without textures do not carry it in their inner loop.
@wp.func(inline=False)
def eye_differential(frame: wp.ref[FrameData], origin: wp.vec3, direction: wp.vec3) -> RayDifferential:
    """Return the differential of an eye ray. Of n samples a pixel each stands for 1 / sqrt(n) of its width and height.

    Args:
        frame: Camera and number of samples.
        origin: Of the ray, on or beyond the lens.
        direction: Unit.
    """
    camera = frame.camera
    spacing = 1.0 / wp.sqrt(float(frame.sample_count))
    across = camera.right * (spacing / float(camera.width))
    down = camera.down * (spacing / float(camera.height))
    result = RayDifferential()
    if camera.is_perspective == 0:
        result.origin_x = across
        result.origin_y = down
        return result
    # The ray meets the window at corner + s right + t down, so far away; its direction is that, made unit.
    cosine = wp.dot(direction, camera.forward)
    distance = wp.dot(camera.corner, camera.forward) / cosine
    result.direction_x = (across - direction * wp.dot(direction, across)) / distance
    result.direction_y = (down - direction * wp.dot(direction, down)) / distance
    travelled = wp.dot(origin - camera.origin, camera.forward) / cosine
    result.origin_x = result.direction_x * travelled
    result.origin_y = result.direction_y * travelled
    return result


@wp.func
def on_plane(moved: wp.vec3, direction: wp.vec3, normal: wp.vec3) -> wp.vec3:
    """Return a displacement of a ray's point, slid along the ray into the plane of ``normal``."""
    cosine = wp.dot(direction, normal)
    if wp.abs(cosine) < GRAZING:
        cosine = GRAZING if cosine >= 0.0 else -GRAZING
    return moved - direction * (wp.dot(moved, normal) / cosine)


# Out of line, so that scenes without textures do not carry it in their inner loop.
@wp.func(inline=False)
def set_footprint(surface: wp.ref[Surface], ray: wp.ref[RayDifferential], direction: wp.vec3, t: float):
    """Write where the neighbouring rays meet the plane of a hit: Igehy's transfer (equation 10).

    Args:
        surface: The hit; ``dpdx`` and ``dpdy`` are written.
        ray: Differential of the ray, at its origin.
        direction: Of the ray, unit.
        t: From its origin to the hit.
    """
    surface.dpdx = on_plane(ray.origin_x + ray.direction_x * t, direction, surface.n_geometric)
    surface.dpdy = on_plane(ray.origin_y + ray.direction_y * t, direction, surface.n_geometric)


@wp.func
def barycentric_differential(scene: wp.ref[SceneData], surface: wp.ref[Surface], dp: wp.vec3) -> wp.vec2:
    """Return how u and v of a triangle change over a displacement in its plane, world space."""
    p0, p1, p2 = triangle_corners(scene, surface.mesh, surface.triangle)
    e1 = p1 - p0
    e2 = p2 - p0
    size = wp.max(wp.max(max_magnitude(e1), max_magnitude(e2)), LEAST_DIVISOR)
    e1 = e1 / size
    e2 = e2 / size
    local = transform_vector(scene.instances[surface.instance].local_from_world, dp) / size
    n = wp.cross(e1, e2)
    scale = 1.0 / wp.max(wp.dot(n, n), LEAST_DIVISOR)
    return wp.vec2(wp.dot(wp.cross(local, e2), n) * scale, wp.dot(wp.cross(e1, local), n) * scale)


@wp.func
def shape_normal_differential(scene: wp.ref[SceneData], surface: wp.ref[Surface], n: wp.vec3, dp: wp.vec3) -> wp.vec3:
    """Return how the unit outward normal ``n`` of a shape changes over a displacement; all in the shape's space.

    A ball's normal turns with every step; what a ball or a circle sweeps is taken as straight along its axis, where the
    normal does not turn, and turns about it.
    """
    mesh = scene.meshes[surface.mesh]
    first = first_control(mesh, surface.triangle)
    start = scene.controls[first]
    u = surface.u
    is_ball = mesh.kind == SPHERE or (mesh.kind != FRUSTUM and (u <= 0.0 or u >= 1.0))
    center = start
    along = wp.vec3(0.0, 0.0, 0.0)
    if mesh.kind == CUBIC_TUBE:
        c1 = scene.controls[first + 1]
        c2 = scene.controls[first + 2]
        c3 = scene.controls[first + 3]
        center = bezier_blossom(start, c1, c2, c3, u, u, u)
        along = xyz(bezier_derivative(start, c1, c2, c3, u))
    elif mesh.kind != SPHERE:
        end = scene.controls[first + 1]
        center = start + (end - start) * u
        along = xyz(end - start)
    if is_ball:
        return dp / wp.max(center[3], LEAST_DIVISOR)
    p = transform_point(scene.instances[surface.instance].local_from_world, surface.position) - xyz(center)
    axis = wp.normalize(along)
    around = wp.cross(axis, n)
    sine = wp.length(around)
    radius = wp.length(wp.cross(axis, p))
    if sine * radius <= 0.0:
        return wp.vec3(0.0, 0.0, 0.0)
    return around * (wp.dot(around, dp) / (sine * radius))


@wp.func
def normal_differential(scene: wp.ref[SceneData], surface: wp.ref[Surface], n: wp.vec3, dp: wp.vec3) -> wp.vec3:
    """Return how the shading normal changes over a displacement, world space: Igehy's section 3.2.

    Args:
        scene: Shading data.
        surface: Where.
        n: Unit normal, on either side; what a normal map bends of it counts as constant.
        dp: Displacement in the plane of the surface.
    """
    placed = scene.instances[surface.instance]
    mesh = scene.meshes[surface.mesh]
    changed = wp.vec3(0.0, 0.0, 0.0)
    scale = float(0.0)
    if mesh.kind != TRIANGLES:
        outward = wp.normalize(transform_normal(placed.world_from_local, surface.n_geometric)) * mesh.outward
        local = shape_normal_differential(scene, surface, outward, transform_vector(placed.local_from_world, dp))
        changed = transform_normal(placed.local_from_world, local) * mesh.outward
        scale = wp.length(transform_normal(placed.local_from_world, outward))
    elif scene.primvars[surface.mesh * scene.primvar_count + NORMALS_SLOT].component_count > 0:
        d = barycentric_differential(scene, surface, dp)
        n0 = xyz(primvar_corner(scene, surface.mesh, NORMALS_SLOT, surface.triangle, 0))
        n1 = xyz(primvar_corner(scene, surface.mesh, NORMALS_SLOT, surface.triangle, 1))
        n2 = xyz(primvar_corner(scene, surface.mesh, NORMALS_SLOT, surface.triangle, 2))
        changed = transform_normal(placed.local_from_world, (n1 - n0) * d[0] + (n2 - n0) * d[1])
        mean = eval_normals(scene, surface.mesh, surface.triangle, surface.u, surface.v)
        scale = wp.length(transform_normal(placed.local_from_world, mean))
    if scale <= 0.0:
        return wp.vec3(0.0, 0.0, 0.0)
    # ``n`` is on the viewer's side, which need not be the side that the surface's own normal is on.
    if wp.dot(n, surface.n_shading) < 0.0:
        scale = -scale
    changed = changed / scale
    return changed - n * wp.dot(n, changed)


@wp.func
def mirrored_differential(direction: wp.vec3, change: wp.vec3, n: wp.vec3, dn: wp.vec3) -> wp.vec3:
    """Return how a mirrored direction changes, where the direction itself and the normal do (Igehy, equation 15)."""
    return change - 2.0 * (dn * wp.dot(direction, n) + n * (wp.dot(change, n) + wp.dot(direction, dn)))


@wp.func
def refracted_differential(direction: wp.vec3, change: wp.vec3, n: wp.vec3, dn: wp.vec3, eta: float) -> wp.vec3:
    """Return how a refracted direction changes (Igehy, equation 17); ``n`` lies on the side that the ray comes from."""
    cos_in = -wp.dot(direction, n)
    cos_out = wp.sqrt(wp.max(1.0 - eta * eta * (1.0 - cos_in * cos_in), GRAZING))
    cos_change = -(wp.dot(change, n) + wp.dot(direction, dn))
    along = eta * cos_in - cos_out
    along_change = (eta - eta * eta * cos_in / cos_out) * cos_change
    return change * eta + dn * along + n * along_change


@wp.func
def reach_on_curve(direction: wp.vec3, n: wp.vec3, dn: wp.vec3) -> float:
    """Return how far along a curved surface a ray's neighbour really is, as a share of what the tangent plane says.

    Towards a silhouette the plane's answer w / cos, for rays w apart, grows beyond all bounds; on a surface of
    curvature k, half of that is s where s cos + s^2 k / 2 = w / 2. Flat surfaces give 1, and so do small steps.

    Args:
        direction: Of the ray, unit.
        n: Unit normal.
        dn: Its change over the step in the tangent plane.
    """
    turning = wp.abs(wp.dot(direction, dn)) / wp.max(wp.abs(wp.dot(direction, n)), GRAZING)
    return 2.0 / (1.0 + wp.sqrt(1.0 + turning))


# Out of line, so that scenes without textures do not carry it in their inner loop.
@wp.func(inline=False)
def bend_differential(
    scene: wp.ref[SceneData],
    ray: wp.ref[RayDifferential],
    surface: wp.ref[Surface],
    direction: wp.vec3,
    n: wp.vec3,
    eta: float,
):
    """Replace the differential of a ray that meets a surface by that of the ray it sends on.

    Args:
        scene: Shading data.
        ray: Changed in place.
        surface: Has its footprint.
        direction: Of the ray that came, unit.
        n: Unit shading normal on its side.
        eta: n_incoming / n_outgoing of a refracted ray, 1 of one that goes straight on; 0: mirrored.
    """
    ray.origin_x = surface.dpdx
    ray.origin_y = surface.dpdy
    if eta == 1.0:
        return
    dn_x = normal_differential(scene, surface, n, surface.dpdx)
    dn_y = normal_differential(scene, surface, n, surface.dpdy)
    reach_x = reach_on_curve(direction, n, dn_x)
    reach_y = reach_on_curve(direction, n, dn_y)
    ray.origin_x = surface.dpdx * reach_x
    ray.origin_y = surface.dpdy * reach_y
    dn_x = dn_x * reach_x
    dn_y = dn_y * reach_y
    if eta == 0.0:
        ray.direction_x = mirrored_differential(direction, ray.direction_x, n, dn_x)
        ray.direction_y = mirrored_differential(direction, ray.direction_y, n, dn_y)
    else:
        ray.direction_x = refracted_differential(direction, ray.direction_x, n, dn_x, eta)
        ray.direction_y = refracted_differential(direction, ray.direction_y, n, dn_y, eta)


@wp.func
def parametric_differential(scene: wp.ref[SceneData], surface: wp.ref[Surface], dp: wp.vec3) -> wp.vec2:
    """Return how the parametrisation of a solid (``shape_st``) changes over a displacement, world space."""
    placed = scene.instances[surface.instance]
    mesh = scene.meshes[surface.mesh]
    first = first_control(mesh, surface.triangle)
    start = scene.controls[first]
    axis = shape_axis(scene.controls, first, mesh.kind)
    p = transform_point(placed.local_from_world, surface.position) - xyz(start)
    local = transform_vector(placed.local_from_world, dp)
    turning = wp.cross(axis, p)
    radius2 = wp.max(wp.dot(turning, turning), LEAST_DIVISOR)
    s = wp.dot(local, turning) / (radius2 * 2.0 * wp.pi)
    rise = wp.dot(local, axis)
    if mesh.kind == SPHERE:
        return wp.vec2(s, rise / (wp.sqrt(radius2) * wp.pi))
    end = scene.controls[first + 1]
    height = wp.length(xyz(end) - xyz(start))
    if mesh.kind != FRUSTUM:
        height += start[3] + end[3]
    return wp.vec2(s, rise / height)


# Out of line, so that scenes without textures do not carry it in their inner loop.
@wp.func(inline=False)
def coordinate_differential(scene: wp.ref[SceneData], surface: wp.ref[Surface], slot: int, dp: wp.vec3) -> wp.vec2:
    """Return how texture coordinates change over a displacement in the plane of the surface, world space; 0 of none."""
    if scene.instance_primvars.shape[1] > 0:
        if not wp.isnan(scene.instance_primvars[slot, surface.instance][0]):
            return wp.vec2(0.0, 0.0)
    primvar = scene.primvars[surface.mesh * scene.primvar_count + slot]
    if primvar.component_count == 0:
        return wp.vec2(0.0, 0.0)
    if primvar.row_count == PARAMETRIC:
        return parametric_differential(scene, surface, dp)
    if primvar.corner_offset >= 0:
        d = barycentric_differential(scene, surface, dp)
        st = primvar_corner(scene, surface.mesh, slot, surface.triangle, 0)
        change = (primvar_corner(scene, surface.mesh, slot, surface.triangle, 1) - st) * d[0]
        change += (primvar_corner(scene, surface.mesh, slot, surface.triangle, 2) - st) * d[1]
        return wp.vec2(change[0], change[1])
    if primvar.row_count < 2:
        return wp.vec2(0.0, 0.0)
    # Along a tube: the coordinates' derivative by u, and u's along the axis.
    mesh = scene.meshes[surface.mesh]
    controls = first_control(mesh, surface.triangle)
    first = surface.triangle * primvar.row_count
    v0 = primvar_row(scene, primvar.value_offset, primvar.component_count, first)
    v1 = primvar_row(scene, primvar.value_offset, primvar.component_count, first + 1)
    slope = v1 - v0
    if primvar.row_count == 4:
        v2 = primvar_row(scene, primvar.value_offset, primvar.component_count, first + 2)
        v3 = primvar_row(scene, primvar.value_offset, primvar.component_count, first + 3)
        slope = bezier_derivative(v0, v1, v2, v3, surface.u)
    along = scene.controls[controls + 1] - scene.controls[controls]
    if mesh.kind == CUBIC_TUBE:
        along = bezier_derivative(
            scene.controls[controls],
            scene.controls[controls + 1],
            scene.controls[controls + 2],
            scene.controls[controls + 3],
            surface.u,
        )
    axis = xyz(along)
    local = transform_vector(scene.instances[surface.instance].local_from_world, dp)
    du = wp.dot(local, axis) / wp.max(wp.dot(axis, axis), LEAST_DIVISOR)
    return wp.vec2(slope[0] * du, slope[1] * du)


@per_type
def track_eye(scene: wp.ref[SceneData], frame: wp.ref[FrameData], eye: wp.ref[RayTask], features: Features):
    """Give an eye ray its differential, where anything reads it."""
    if scene.is_filtered != 0:
        eye.differential = eye_differential(frame, eye.origin, eye.direction)


@wp.func(inline=False)
def coordinate_growth(scene: wp.ref[SceneData], surface: wp.ref[Surface], slot: int, axis: int) -> wp.vec3:
    """Return how a surface point moves in the plane of the surface, world space, as a texture coordinate grows.

    The inverse of ``coordinate_differential``; 0 where the two coordinates are no coordinates of the plane.

    Args:
        scene: Shading data.
        surface: Where.
        slot: Of the primvar.
        axis: 0: of the first, while the second stays; 1: the other way round.
    """
    n = surface.n_geometric
    beside = wp.vec3(1.0, 0.0, 0.0)
    if wp.abs(n[0]) > 0.5:
        beside = wp.vec3(0.0, 1.0, 0.0)
    x = wp.normalize(wp.cross(n, beside))
    y = wp.cross(n, x)
    by_x = coordinate_differential(scene, surface, slot, x)
    by_y = coordinate_differential(scene, surface, slot, y)
    det = by_x[0] * by_y[1] - by_x[1] * by_y[0]
    if det == 0.0:
        return wp.vec3(0.0, 0.0, 0.0)
    if axis == 0:
        return (x * by_y[1] - y * by_x[1]) / det
    return (y * by_x[0] - x * by_y[0]) / det


@wp.func
def track_eye(scene: wp.ref[SceneData], frame: wp.ref[FrameData], eye: wp.ref[RayTask], features: wp.ref[PlainScene]):
    """Do nothing: there is no texture."""
    pass


@per_type
def track_hit(scene: wp.ref[SceneData], surface: wp.ref[Surface], task: wp.ref[RayTask], t: float, features: Features):
    """Give a hit its footprint, where anything reads it."""
    if scene.is_filtered != 0:
        set_footprint(surface, task.differential, task.direction, t)


@wp.func
def track_hit(
    scene: wp.ref[SceneData], surface: wp.ref[Surface], task: wp.ref[RayTask], t: float, features: wp.ref[PlainScene]
):
    """Do nothing."""
    pass


@per_type
def track_bounce(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    parent: wp.ref[RayTask],
    child: wp.ref[RayTask],
    n: wp.vec3,
    eta: float,
    features: Features,
):
    """Give a mirrored or refracted ray its differential, where anything reads it; arguments: ``bend_differential``."""
    if scene.is_filtered != 0:
        child.differential = parent.differential
        bend_differential(scene, child.differential, surface, parent.direction, n, eta)


@wp.func
def track_bounce(
    scene: wp.ref[SceneData],
    surface: wp.ref[Surface],
    parent: wp.ref[RayTask],
    child: wp.ref[RayTask],
    n: wp.vec3,
    eta: float,
    features: wp.ref[PlainScene],
):
    """Do nothing."""
    pass
