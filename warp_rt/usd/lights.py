# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdLux lights to Light and Dome, with the schema's units resolved.

A light's radiance is intensity * 2^exposure * color, times the black body's colour where that is enabled, divided by
the world-space area where the light is normalised.

Reference: UsdLux schema documentation, "Quantities and Units"; OpenUSD's hdEmbree, which serves as its
reference implementation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from warp_rt.report import Report
from warp_rt.scene import Dome, Light, LightKind
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.domes import DOMES, read_dome
from warp_rt.usd.ies import ProfileCache
from warp_rt.usd.light_areas import distant_divisor, mesh_area, world_area
from warp_rt.usd.light_inputs import (
    INVALID_LIGHT,
    OUT_OF_RANGE,
    Images,
    emission,
    has_shaping,
    multipliers,
    read_shadow,
    read_shaping,
    shines,
)
from warp_rt.usd.light_omissions import report_ignored
from warp_rt.usd.mesh_lights import MeshLightReader, ShiningMesh
from warp_rt.usd.polygons import MAX_COORDINATE
from warp_rt.usd.questions import get_type_name
from warp_rt.usd.rendering_space import product

UNSUPPORTED_LIGHT = "W401"
POINT_WITHOUT_AREA = "W412"
INVALID_VALUE = "W413"
NO_FALLOFF = "N926"
MEAN_GLOW = "N918"

_KINDS = {
    "SphereLight": LightKind.SPHERE,
    "RectLight": LightKind.RECT,
    "DiskLight": LightKind.DISK,
    "CylinderLight": LightKind.CYLINDER,
    "DistantLight": LightKind.DISTANT,
}
# Seen from far away, a distant light's rays leave along its axis: nothing to shape.
_NO_SHAPING = (0.0, (0.0, 0.0, 0.0), math.pi, 0.0)
_FALLOFFS = ("inverseSquare", "none")
_SYNC_MODE = "light:materialSyncMode"
_TINTS, _NO_RESPONSE = "materialGlowTintsLight", "noMaterialResponse"
_SYNC_MODES = (_TINTS, _NO_RESPONSE, "independent")
_NAMES_GEOMETRY = "GeometryLight"


def is_light(prim: Usd.Prim) -> bool:
    """Return whether a prim is a light. Meshes and volumes with a light schema applied are lights and geometry both."""
    return prim.HasAPI(UsdLux.LightAPI)


def read_lights(
    prim: Usd.Prim,
    world_from_local: np.ndarray,
    time: Usd.TimeCode,
    report: Report,
    images: Images,
    profiles: ProfileCache,
    meshes: MeshLightReader,
    from_rec709: np.ndarray | None = None,
) -> Sequence[Light | Dome]:
    """Return what a light is: a light or a dome, or a light for each colour that the glow of its geometry has.

    Nothing, with a diagnostic, for one that cannot be drawn.

    Args:
        prim: A prim that :func:`is_light`.
        world_from_local: float64, shape [4, 4], acting on column vectors.
        time: When.
        report: Takes diagnostics about what is ignored.
        images: Reads the texture of a dome or a rect light.
        profiles: Reads IES profiles.
        meshes: Finds what shines of geometry.
        from_rec709: To the primaries that are rendered in, and colours multiplied in, shape [3, 3]; None: Rec. 709's.
    """
    kind = get_type_name(prim)
    path = prim.GetPath()
    source = _geometry_of(prim)
    if kind not in _KINDS and kind not in DOMES and source is None:
        name = "a light without a type" if not kind else f"a {kind} as a light"
        why = "names no geometry" if kind == _NAMES_GEOMETRY else "is not supported"
        report.warn(UNSUPPORTED_LIGHT, path, f"{name} {why}; it gives no light")
        return ()
    matrix = np.array(world_from_local, float)
    if not (np.abs(matrix) <= MAX_COORDINATE).all() or not _is_invertible(matrix):
        report.warn(INVALID_LIGHT, path, f"the transform is singular, or beyond {MAX_COORDINATE:g}; left out")
        return ()
    mesh = None if source is None else _read_mesh(prim, source, matrix, time, report, meshes)
    if source is not None and mesh is None:
        return ()
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    report_ignored(prim, attributes, report)
    if kind in DOMES:
        dome = read_dome(prim, kind, matrix, attributes, report, images, from_rec709)
        return () if dome is None else (dome,)
    emitted = emission(attributes, from_rec709)
    kind_of_light = _KINDS.get(kind, LightKind.MESH)
    light = _read_shape(prim, kind_of_light, matrix, emitted, attributes, report, images, profiles, mesh)
    if light is None:
        return ()
    if mesh is None or source is None:
        return (light,)
    return _mesh_lights(light, mesh, source, attributes, time, report, meshes, from_rec709)


def _geometry_of(prim: Usd.Prim) -> Usd.Prim | None:
    """Return the geometry whose surface a light's is: itself, or what a GeometryLight names; None of other lights."""
    if prim.IsA(UsdGeom.Gprim):
        return prim
    if get_type_name(prim) != _NAMES_GEOMETRY:
        return None
    targets = prim.GetRelationship("geometry").GetForwardedTargets()
    target = prim.GetStage().GetPrimAtPath(targets[0]) if len(targets) == 1 else None
    return target if target and target.IsA(UsdGeom.Gprim) else None


def _read_mesh(
    prim: Usd.Prim,
    source: Usd.Prim,
    matrix: np.ndarray,
    time: Usd.TimeCode,
    report: Report,
    meshes: MeshLightReader,
) -> ShiningMesh | None:
    """Return what shines of the geometry of a light; None, with a diagnostic, where nothing does."""
    is_shaped = has_shaping(prim)
    if source == prim:
        mesh = meshes.read(prim, matrix, time, is_shaped=is_shaped)
    else:
        mesh = meshes.read_target(source, matrix, is_shaped=is_shaped)
    if mesh is None:
        why = "is not supported" if len(meshes.rows(source)) else "is not drawn"
        message = f"a {get_type_name(source)} as a light {why}; it gives no light"
        report.warn(UNSUPPORTED_LIGHT, prim.GetPath(), message)
    return mesh


def _mesh_lights(
    light: Light,
    mesh: ShiningMesh,
    source: Usd.Prim,
    attributes: AttributeReader,
    time: Usd.TimeCode,
    report: Report,
    meshes: MeshLightReader,
    from_rec709: np.ndarray | None,
) -> Sequence[Light]:
    """Return a mesh light as its geometry and the mode that goes with its material have it: one a colour of the glow.

    Args:
        light: With the emission of the light's own attributes.
        mesh: What shines.
        source: Its geometry.
        attributes: Reads the light's.
        time: When.
        report: Takes the diagnostics.
        meshes: Takes what is seen of the geometry.
        from_rec709: See :func:`read_lights`.
    """
    has_two_sides = AttributeReader(source, time, INVALID_VALUE, report).truth("doubleSided", False)
    light = replace(
        light,
        is_double_sided=has_two_sides and not mesh.is_solid,
        is_closed=mesh.is_closed,
        drawn_by=meshes.rows(source),
    )
    mode = attributes.token(_SYNC_MODE, _TINTS, _SYNC_MODES)
    if mode == _NO_RESPONSE:
        # What is seen of it is the light. Materials emit the same in all directions.
        light = replace(light, glows=not light.is_shaped)
        meshes.show_as_light(source, light.radiance if light.glows else (0.0, 0.0, 0.0))
    if mode != _TINTS or not light.glows:
        return (light,)
    if mesh.glow.is_computed:
        report.warn(
            MEAN_GLOW, light.path, "its material's emission is computed where rays hit: it does not tint the light"
        )
    elif mesh.glow.is_mean:
        report.warn(
            MEAN_GLOW, light.path, "its material does not emit the same everywhere; the mean tints the light there"
        )
    lights = []
    for color, rows in mesh.glow.parts():
        red, green, blue = (float(c) for c in product(from_rec709, color, np.array(light.radiance)))
        lights.append(replace(light, triangles=mesh.triangles[rows], radiance=(red, green, blue)))
    return lights


def _is_invertible(matrix: np.ndarray) -> bool:
    scales = np.linalg.norm(matrix[:3, :3], axis=0)
    return bool((scales > 0).all() and abs(np.linalg.det(matrix[:3, :3] / scales)) > 1e-9)


def _read_shape(
    prim: Usd.Prim,
    kind: LightKind,
    matrix: np.ndarray,
    emitted: np.ndarray,
    attributes: AttributeReader,
    report: Report,
    images: Images,
    profiles: ProfileCache,
    mesh: ShiningMesh | None,
) -> Light | None:
    path = prim.GetPath()
    is_normalized = attributes.truth("inputs:normalize", False)
    radius = attributes.within("inputs:radius", 0.5, 0.0, MAX_COORDINATE, OUT_OF_RANGE)
    width = attributes.within("inputs:width", 1.0, 0.0, MAX_COORDINATE, OUT_OF_RANGE)
    height = attributes.within("inputs:height", 1.0, 0.0, MAX_COORDINATE, OUT_OF_RANGE)
    length = attributes.within("inputs:length", 1.0, 0.0, MAX_COORDINATE, OUT_OF_RANGE)
    angle = math.radians(attributes.within("inputs:angle", 0.53, 0.0, 360.0, OUT_OF_RANGE))
    kind, has_falloff = _kind_and_falloff(kind, attributes, report, path)
    if kind == LightKind.POINT and radius == 0 and has_falloff:
        # A normalised point sends out a quarter of its intensity in every direction, whatever its radius is.
        if not is_normalized:
            report.warn(POINT_WITHOUT_AREA, path, "a point of radius 0 sends out nothing; read as if normalised")
        radius, is_normalized = 1.0, True
    if not has_falloff:
        divisor = 1.0
    elif kind == LightKind.DISTANT:
        divisor = distant_divisor(angle) if is_normalized else 1.0
    else:
        area = mesh_area(matrix, mesh) if mesh else world_area(kind, matrix, radius, width, height, length)
        if not 0 < area < math.inf:
            report.warn(INVALID_LIGHT, path, "has no area, so it gives no light; left out")
            return None
        divisor = area if is_normalized else 1.0
    radiance = emitted / divisor * (mesh.density if mesh else 1.0)
    if not shines(radiance, path, report):
        return None
    diffuse, specular = multipliers(attributes)
    focus, focus_tint, cone_angle, cone_softness = (
        read_shaping(attributes) if kind != LightKind.DISTANT else _NO_SHAPING
    )
    file = attributes.asset("inputs:shaping:ies:file") if kind != LightKind.DISTANT else None
    is_normalized = attributes.truth("inputs:shaping:ies:normalize", False)
    profile = profiles.load(file, path, is_normalized=is_normalized) if file else None
    texture = attributes.asset("inputs:texture:file") if kind == LightKind.RECT else None
    image, is_srgb = images.image(texture, prim) if texture else -1, False
    if image >= 0:
        image, is_srgb = images.decoded(image, prim.GetAttribute("inputs:texture:file"), path)
    red, green, blue = (float(c) for c in radiance)
    return Light(
        str(path),
        kind,
        matrix,
        (red, green, blue),
        radius=radius,
        width=width,
        height=height,
        length=length,
        angle=angle if kind == LightKind.DISTANT else 0.0,
        has_falloff=has_falloff,
        casts_shadow=attributes.truth("inputs:shadow:enable", True),
        diffuse=diffuse,
        specular=specular,
        focus=focus,
        focus_tint=focus_tint,
        cone_angle=cone_angle,
        cone_softness=cone_softness,
        shadow=read_shadow(attributes),
        image=image,
        is_srgb=is_srgb,
        triangles=mesh.triangles if mesh else None,
        ball_triangles=mesh.ball_triangles if mesh else 0,
        glows=mesh is not None and bool(mesh.glow.colors.any()),
        profile=profile,
        profile_angle_scale=attributes.number("inputs:shaping:ies:angleScale", 0.0) if profile else 0.0,
    )


def _kind_and_falloff(
    kind: LightKind, attributes: AttributeReader, report: Report, path: Sdf.Path
) -> tuple[LightKind, bool]:
    """Return the kind, POINT of a sphere that is treated as one, and whether its light falls off with the distance."""
    has_falloff = attributes.token("warp_rt:falloff", _FALLOFFS[0], _FALLOFFS) != "none"
    if kind == LightKind.SPHERE and attributes.truth("treatAsPoint", False):
        return LightKind.POINT, has_falloff
    if not has_falloff:
        report.warn(NO_FALLOFF, path, "warp_rt:falloff has no effect: only a SphereLight with treatAsPoint has one")
    return kind, True
