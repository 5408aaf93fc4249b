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
from typing import Protocol

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdLux

from warp_rt.report import Report
from warp_rt.scene import Dome, Light, LightKind, Shadow
from warp_rt.scene.light_shapes import ellipse_circumference, ellipsoid_area
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.dome_layouts import LAYOUTS, Stretch, rotation_and_stretch
from warp_rt.usd.ies import ProfileCache
from warp_rt.usd.mesh_lights import MeshLightReader, ShiningMesh
from warp_rt.usd.questions import get_type_name
from warp_rt.usd.rendering_space import product

UNSUPPORTED_LIGHT = "W401"
IGNORED_FILTER = "W403"
OLD_ATTRIBUTE = "W407"
INVALID_LIGHT = "W409"
IGNORED_PORTALS = "W410"
DOME_LAYOUT = "W411"
POINT_WITHOUT_AREA = "W412"
INVALID_VALUE = "W413"
OUT_OF_RANGE = "W415"
CONNECTED_INPUT = "W416"
FOREIGN_LIGHT = "W419"
NO_SHAPING = "N919"
NO_FALLOFF = "N926"
MEAN_GLOW = "N918"
INPUTS_WITHOUT_EFFECT = "N934"

_KINDS = {
    "SphereLight": LightKind.SPHERE,
    "RectLight": LightKind.RECT,
    "DiskLight": LightKind.DISK,
    "CylinderLight": LightKind.CYLINDER,
    "DistantLight": LightKind.DISTANT,
}
# What UsdLux.BlackbodyTemperatureAsRgb knows [K]; others count as the nearer end.
_TEMPERATURES = 1000.0, 10000.0
_FALLOFFS = ("inverseSquare", "none")
_SYNC_MODE = "light:materialSyncMode"
_TINTS, _NO_RESPONSE = "materialGlowTintsLight", "noMaterialResponse"
_SYNC_MODES = (_TINTS, _NO_RESPONSE, "independent")
_DOMES = ("DomeLight", "DomeLight_1")
_NAMES_GEOMETRY = "GeometryLight"
_PREFIX = "inputs:"
# What lights of any type had before USD 21, beside the properties of their own type.
_COMMON_APIS = ("LightAPI", "ShapingAPI", "ShadowAPI")
_COMMON_TYPE = "DomeLight"
# Pole +Y to +Z, image centre +Z to -Y: the rotation of a dome whose pole is Z.
_Z_POLE = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


class Images(Protocol):
    """What a textured light needs of the images: ``warp_rt.usd.materials.MaterialReader`` has it."""

    def image(self, asset: Sdf.AssetPath, prim: Usd.Prim) -> int:
        """Return the row of an image, or -1."""

    def decoded(self, row: int, attribute: Usd.Attribute, prim: object) -> tuple[int, bool]:
        """Return the row to read of the image of an attribute, and whether to decode it by the sRGB curve."""

    def latlong(self, row: int, layout: str, *, is_srgb: bool, stretch: Stretch | None = None) -> tuple[int, bool]:
        """Return the row of an environment by latitude and longitude, and whether to decode it; -1 if it cannot be."""


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

    Nothing, with a diagnostic, for one that cannot be drawn; nothing, too, for an invisible one.

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
    if UsdGeom.Imageable(prim).ComputeVisibility(time) == UsdGeom.Tokens.invisible:
        return ()
    kind = get_type_name(prim)
    path = prim.GetPath()
    source = _geometry_of(prim)
    if kind not in _KINDS and kind not in _DOMES and source is None:
        name = "a light without a type" if not kind else f"a {kind} as a light"
        why = "names no geometry" if kind == _NAMES_GEOMETRY else "is not supported"
        report.warn(UNSUPPORTED_LIGHT, path, f"{name} {why}; it gives no light")
        return ()
    matrix = np.array(world_from_local, float)
    if not np.isfinite(matrix).all() or not _is_invertible(matrix):
        report.warn(INVALID_LIGHT, path, "the transform is singular or not finite; the light is left out")
        return ()
    mesh = None
    if source is not None:
        is_shaped = _has_shaping(prim)
        if source == prim:
            mesh = meshes.read(prim, matrix, time, is_shaped=is_shaped)
        else:
            mesh = meshes.read_target(source, matrix, is_shaped=is_shaped)
        if mesh is None:
            why = "is not supported" if len(meshes.rows(source)) else "is not drawn"
            message = f"a {get_type_name(source)} as a light {why}; it gives no light"
            report.warn(UNSUPPORTED_LIGHT, path, message)
            return ()
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    _report_ignored(prim, attributes, report)
    if kind in _DOMES:
        dome = _read_dome(prim, kind, matrix, attributes, report, images, from_rec709)
        return () if dome is None else (dome,)
    emission = _emission(attributes, from_rec709)
    kind_of_light = _KINDS.get(kind, LightKind.MESH)
    light = _read_shape(prim, kind_of_light, matrix, emission, attributes, report, images, profiles, mesh)
    if light is None:
        return ()
    if mesh is None or source is None:
        return (light,)
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
        report.warn(MEAN_GLOW, path, "its material's emission is computed where rays hit: it does not tint the light")
    elif mesh.glow.is_mean:
        report.warn(MEAN_GLOW, path, "its material does not emit the same everywhere; the mean tints the light there")
    lights = []
    for color, rows in mesh.glow.parts():
        red, green, blue = (float(c) for c in product(from_rec709, color, np.array(light.radiance)))
        lights.append(replace(light, triangles=mesh.triangles[rows], radiance=(red, green, blue)))
    return lights


def _geometry_of(prim: Usd.Prim) -> Usd.Prim | None:
    """Return the geometry whose surface a light's is: itself, or what a GeometryLight names; None of other lights."""
    if prim.IsA(UsdGeom.Gprim):
        return prim
    if get_type_name(prim) != _NAMES_GEOMETRY:
        return None
    targets = prim.GetRelationship("geometry").GetForwardedTargets()
    target = prim.GetStage().GetPrimAtPath(targets[0]) if len(targets) == 1 else None
    return target if target and target.IsA(UsdGeom.Gprim) else None


def _mesh_area(matrix: np.ndarray, mesh: ShiningMesh) -> float:
    """Return the area in world space of geometry that shines."""
    corners = mesh.triangles @ matrix[:3, :3].T
    sides = corners[:, 1:] - corners[:, :1]
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2) * mesh.density


def _is_invertible(matrix: np.ndarray) -> bool:
    scales = np.linalg.norm(matrix[:3, :3], axis=0)
    return bool((scales > 0).all() and abs(np.linalg.det(matrix[:3, :3] / scales)) > 1e-9)


def _emission(attributes: AttributeReader, from_rec709: np.ndarray | None) -> np.ndarray:
    """Return intensity * 2^exposure * color * temperature, before normalisation: shape [3]."""
    intensity = attributes.number("inputs:intensity", 1.0)
    exposure = attributes.number("inputs:exposure", 0.0)
    color = np.array(attributes.color("inputs:color", (1.0, 1.0, 1.0)))
    if attributes.truth("inputs:enableColorTemperature", False):
        temperature = attributes.within("inputs:colorTemperature", 6500.0, *_TEMPERATURES, OUT_OF_RANGE)
        color = product(from_rec709, color, np.array(UsdLux.BlackbodyTemperatureAsRgb(temperature)))
    with np.errstate(over="ignore"):
        return intensity * np.exp2(exposure) * color


def _multipliers(attributes: AttributeReader) -> tuple[float, float]:
    return attributes.number("inputs:diffuse", 1.0), attributes.number("inputs:specular", 1.0)


def _read_shape(
    prim: Usd.Prim,
    kind: LightKind,
    matrix: np.ndarray,
    emission: np.ndarray,
    attributes: AttributeReader,
    report: Report,
    images: Images,
    profiles: ProfileCache,
    mesh: ShiningMesh | None,
) -> Light | None:
    path = prim.GetPath()
    is_normalized = attributes.truth("inputs:normalize", False)
    radius = attributes.within("inputs:radius", 0.5, 0.0, math.inf, OUT_OF_RANGE)
    width = attributes.within("inputs:width", 1.0, 0.0, math.inf, OUT_OF_RANGE)
    height = attributes.within("inputs:height", 1.0, 0.0, math.inf, OUT_OF_RANGE)
    length = attributes.within("inputs:length", 1.0, 0.0, math.inf, OUT_OF_RANGE)
    angle = math.radians(attributes.within("inputs:angle", 0.53, 0.0, 360.0, OUT_OF_RANGE))
    has_falloff = attributes.token("warp_rt:falloff", _FALLOFFS[0], _FALLOFFS) != "none"
    if kind != LightKind.SPHERE or not attributes.truth("treatAsPoint", False):
        if not has_falloff:
            report.warn(NO_FALLOFF, path, "warp_rt:falloff has no effect: only a SphereLight with treatAsPoint has one")
        has_falloff = True
    else:
        kind = LightKind.POINT
        if radius == 0 and has_falloff:
            # A normalised point sends out a quarter of its intensity in every direction, whatever its radius is.
            if not is_normalized:
                report.warn(POINT_WITHOUT_AREA, path, "a point of radius 0 sends out nothing; read as if normalised")
            radius, is_normalized = 1.0, True
    if not has_falloff:
        divisor = 1.0
    elif kind == LightKind.DISTANT:
        divisor = _distant_divisor(angle) if is_normalized else 1.0
    else:
        area = _mesh_area(matrix, mesh) if mesh else _world_area(kind, matrix, radius, width, height, length)
        if not 0 < area < math.inf:
            report.warn(INVALID_LIGHT, path, "has no area, so it gives no light; left out")
            return None
        divisor = area if is_normalized else 1.0
    radiance = emission / divisor * (mesh.density if mesh else 1.0)
    if not np.isfinite(radiance).all():
        report.warn(INVALID_LIGHT, path, "the radiance is not finite; the light is left out")
        return None
    diffuse, specular = _multipliers(attributes)
    focus, focus_tint, cone_angle, cone_softness = _shaping(attributes) if kind != LightKind.DISTANT else _NO_SHAPING
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
        shadow=_shadow(attributes),
        image=image,
        is_srgb=is_srgb,
        triangles=mesh.triangles if mesh else None,
        ball_triangles=mesh.ball_triangles if mesh else 0,
        glows=mesh is not None and bool(mesh.glow.colors.any()),
        profile=profile,
        profile_angle_scale=attributes.number("inputs:shaping:ies:angleScale", 0.0) if profile else 0.0,
    )


def _shadow(attributes: AttributeReader) -> Shadow:
    """Return what ShadowAPI says, where it is applied or authored; a distance below 0 and a falloff of 0 are none."""
    red, green, blue = attributes.color("inputs:shadow:color", (0.0, 0.0, 0.0))
    distance = attributes.number("inputs:shadow:distance", -1.0)
    falloff = attributes.number("inputs:shadow:falloff", -1.0)
    gamma = attributes.within("inputs:shadow:falloffGamma", 1.0, 0.0, math.inf, OUT_OF_RANGE)
    if distance < 0:
        return Shadow((red, green, blue))
    return Shadow((red, green, blue), distance, min(max(falloff, 0.0), distance), gamma)


# Seen from far away, a distant light's rays leave along its axis: nothing to shape.
_NO_SHAPING = (0.0, (0.0, 0.0, 0.0), math.pi, 0.0)


def _has_shaping(prim: Usd.Prim) -> bool:
    """Return whether ShapingAPI is applied to a light, or something of it authored."""
    return prim.HasAPI(UsdLux.ShapingAPI) or bool(prim.GetAuthoredPropertiesInNamespace("inputs:shaping"))


def _shaping(attributes: AttributeReader) -> tuple[float, tuple[float, float, float], float, float]:
    """Return focus, tint, half cone angle [rad] and softness; those of ShapingAPI where it is applied or authored."""
    red, green, blue = attributes.vector("inputs:shaping:focusTint", (0.0, 0.0, 0.0))
    return (
        attributes.within("inputs:shaping:focus", 0.0, 0.0, math.inf, OUT_OF_RANGE),
        (red, green, blue),
        math.radians(attributes.within("inputs:shaping:cone:angle", 180.0, 0.0, 180.0, OUT_OF_RANGE)),
        attributes.within("inputs:shaping:cone:softness", 0.0, 0.0, 1.0, OUT_OF_RANGE),
    )


# --- normalisation


def _distant_divisor(angle: float) -> float:
    """Return what a normalised distant light's intensity is divided by: the cone's projected solid angle [sr].

    The schema's rule; beyond a half angle of 90 degrees what comes from below the horizon counts, too.
    """
    if angle <= 0:
        return 1.0
    sine_squared = math.sin(angle / 2) ** 2
    return math.pi * (sine_squared if angle <= math.pi else 2.0 - sine_squared)


def _world_area(
    kind: LightKind, matrix: np.ndarray, radius: float, width: float, height: float, length: float
) -> float:
    """Return the area of a light's surface in world space."""
    x, y, z = matrix[:3, 0], matrix[:3, 1], matrix[:3, 2]
    if kind == LightKind.RECT:
        return float(np.linalg.norm(np.cross(x * width, y * height)))
    if kind == LightKind.DISK:
        return math.pi * radius**2 * float(np.linalg.norm(np.cross(x, y)))
    a, b, c = (float(np.linalg.norm(axis)) * radius for axis in (x, y, z))
    if kind == LightKind.CYLINDER:
        return ellipse_circumference(b, c) * float(np.linalg.norm(x)) * length
    return ellipsoid_area(a, b, c)


# --- domes


def _read_dome(
    prim: Usd.Prim,
    kind: str,
    matrix: np.ndarray,
    attributes: AttributeReader,
    report: Report,
    images: Images,
    from_rec709: np.ndarray | None,
) -> Dome | None:
    path = prim.GetPath()
    if kind == "DomeLight_1":
        pole = attributes.token("poleAxis", "scene", ("scene", "Y", "Z"))
        if pole == "Z" or (pole == "scene" and UsdGeom.GetStageUpAxis(prim.GetStage()) == UsdGeom.Tokens.z):
            matrix = matrix @ _Z_POLE
    radiance = _emission(attributes, from_rec709)
    if not np.isfinite(radiance).all():
        report.warn(INVALID_LIGHT, path, "the radiance is not finite; the light is left out")
        return None
    image, is_srgb = -1, False
    asset = attributes.asset("inputs:texture:file")
    if asset is not None:
        layout = attributes.token("inputs:texture:format", "automatic", ("automatic", *LAYOUTS))
        row, is_srgb = images.decoded(images.image(asset, prim), prim.GetAttribute("inputs:texture:file"), path)
        rotation, stretch = rotation_and_stretch(matrix[:3, :3])
        matrix[:3, :3] = rotation
        image, is_srgb = images.latlong(row, layout, is_srgb=is_srgb, stretch=stretch)
        if image < row:
            message = f"the image @{asset.path}@ has not the proportions of the format {layout}; the dome is uniform"
            report.warn(DOME_LAYOUT, path, message)
    diffuse, specular = _multipliers(attributes)
    red, green, blue = (float(c) for c in radiance)
    return Dome(
        str(path),
        matrix,
        (red, green, blue),
        image=image,
        is_srgb=is_srgb,
        diffuse=diffuse,
        specular=specular,
        casts_shadow=attributes.truth("inputs:shadow:enable", True),
        shadow=_shadow(attributes),
    )


# --- what is not drawn


def _report_ignored(prim: Usd.Prim, attributes: AttributeReader, report: Report) -> None:
    """Report each feature that a light has and the picture lacks."""
    path = prim.GetPath()
    filters = prim.GetRelationship("light:filters")
    if filters and filters.GetTargets():
        report.warn(IGNORED_FILTER, path, "light filters are not supported; ignored")
    shader = attributes.token("light:shaderId", "")
    if shader and shader != prim.GetPrimDefinition().GetAttributeFallbackValue("light:shaderId"):
        report.warn(FOREIGN_LIGHT, path, f"the light shader {shader!r} is not supported; its type decides")
    portals = prim.GetRelationship("portals")
    if portals and portals.GetTargets():
        report.warn(IGNORED_PORTALS, path, "portals are not supported; the dome shines from everywhere")
    shaping = prim.GetAuthoredPropertiesInNamespace("inputs:shaping")
    if get_type_name(prim) in (*_DOMES, "DistantLight") and shaping:
        names = ", ".join(str(attribute.GetName()) for attribute in shaping)
        report.warn(NO_SHAPING, path, f"{names}: light from infinitely far is not shaped")
    known = _input_names(prim)
    unknown = []
    for attribute in prim.GetAuthoredPropertiesInNamespace("inputs"):
        if attribute.GetName() not in known:
            unknown.append(str(attribute.GetName()))
        elif isinstance(attribute, Usd.Attribute) and attribute.HasAuthoredConnections():
            report.warn(
                CONNECTED_INPUT, attribute.GetPath(), "connections of lights are not followed; its value counts"
            )
    if unknown:
        names = ", ".join(sorted(unknown))
        report.warn(INPUTS_WITHOUT_EFFECT, path, f"a {get_type_name(prim)} has no {names}; ignored")
    if get_type_name(prim) in _DOMES and attributes.truth("inputs:normalize", False):
        report.warn(INPUTS_WITHOUT_EFFECT, path, "inputs:normalize: a dome has no area to divide by; ignored")
    for name in sorted(_old_names(prim)):
        attribute = prim.GetAttribute(name)
        if attribute and (attribute.HasAuthoredValue() or attribute.HasAuthoredConnections()):
            report.warn(OLD_ATTRIBUTE, attribute.GetPath(), f"is ignored; today's schema calls it inputs:{name}")


def _input_names(prim: Usd.Prim) -> set[str]:
    """Return the names of the inputs that a light has, or would if the schemas that any light may have were applied."""
    registry = Usd.SchemaRegistry()
    definitions = [prim.GetPrimDefinition()]
    definitions += [registry.FindAppliedAPIPrimDefinition(name) for name in _COMMON_APIS]
    return {name for definition in definitions for name in definition.GetPropertyNames() if name.startswith(_PREFIX)}


def _old_names(prim: Usd.Prim) -> set[str]:
    """Return the names without the prefix ``inputs:``, of files older than USD 21, which the schema now ignores."""
    registry = Usd.SchemaRegistry()
    own = prim.GetPrimDefinition()
    definitions = [own, registry.FindConcretePrimDefinition(_COMMON_TYPE)]
    definitions += [registry.FindAppliedAPIPrimDefinition(name) for name in _COMMON_APIS]
    names = {name for definition in definitions for name in definition.GetPropertyNames()}
    old = {name.removeprefix(_PREFIX) for name in names if name.startswith(_PREFIX)}
    return old - set(own.GetPropertyNames())
