# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Surfaces of other renderers, told in the terms of UsdPreviewSurface as far as those reach.

Each row names the inputs that mean much the same, and those that UsdPreviewSurface has nothing for, which the
diagnostic of such a material names where they are used. Defaults are those of the model's own definition.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

Color = tuple[float, float, float]

CUTOFF = "alpha_cutoff"
"""Input that coverage is held against."""


@dataclass(frozen=True)
class Term:
    """An input of UsdPreviewSurface as an input of another model, times a weight; one of the two may vary."""

    name: str
    default: Color | float
    weight: str = ""
    """Name of an input that multiplies it; empty: none."""
    weight_default: float = 1.0
    is_complement: bool = False
    """Whether one minus the input is meant: transmission as opacity."""


@dataclass(frozen=True)
class Loss:
    """An input that UsdPreviewSurface has nothing for."""

    neutral: float = 0.0
    """The value at which it does nothing."""
    default: float | None = None
    """The value where nothing is said; None: the neutral one."""
    of: str = ""
    """Name of an input that is the weight of what it is a part of: where that is 0 it does nothing; empty: none."""
    same_as: str = ""
    """Name of another input for the both of which UsdPreviewSurface has one: it does nothing where it says the same."""


@dataclass(frozen=True)
class ForeignSurface:
    """Another renderer's surface in the terms of UsdPreviewSurface."""

    terms: Mapping[str, Term]
    """By input of UsdPreviewSurface."""
    normal: str = ""
    """Input that holds a normal map."""
    coverage: str = ""
    """Input that says how much of the surface is there: opacity in the mode presence, where it transmits nothing."""
    coverage_mode: str = ""
    """Input that says what coverage does: 0 nothing, 1 it is held against ``CUTOFF``, 2 it counts; empty: 2."""
    reflectance: str = ""
    """Input that scales the reflectance at normal incidence."""
    coat_ior: str = ""
    """Input that is the index of refraction of the coat; empty: none, it is ``coat_ior_default``."""
    coat_ior_default: float | None = None
    """None: the coat has the surface's."""
    lacks: Mapping[str, Loss] = field(default_factory=dict)
    """Inputs that UsdPreviewSurface has nothing for."""
    details: Collection[str] = ()
    """Inputs that do something only with some of those."""

    @property
    def names(self) -> set[str]:
        """All inputs that are known."""
        of_terms = {name for term in self.terms.values() for name in (term.name, term.weight)}
        cutoff = {CUTOFF} if self.coverage_mode else set()
        others = (self.normal, self.coverage, self.coverage_mode, self.reflectance, self.coat_ior)
        return {*of_terms, *others, *cutoff, *self.lacks, *self.details}

    def default_of(self, name: str, otherwise: float) -> Color | float:
        """Return the default of an input that a term has; ``otherwise`` of any other."""
        return next((term.default for term in self.terms.values() if term.name == name), otherwise)


def _lost(*names: str, of: str = "") -> dict[str, Loss]:
    """Return inputs that are nothing at 0."""
    return dict.fromkeys(names, Loss(of=of))


def _standard_surface(base: float, color: float) -> ForeignSurface:
    """Autodesk Standard Surface (Georgiev et al. 2019); which factor of the base is 0.8 depends on the version."""
    return ForeignSurface(
        {
            "diffuseColor": Term("base_color", (color, color, color), "base", base),
            "emissiveColor": Term("emission_color", (1.0, 1.0, 1.0), "emission", 0.0),
            "metallic": Term("metalness", 0.0),
            "roughness": Term("specular_roughness", 0.2),
            "ior": Term("specular_IOR", 1.5),
            "clearcoat": Term("coat", 0.0),
            "clearcoatRoughness": Term("coat_roughness", 0.1),
            "opacity": Term("transmission", 0.0, is_complement=True),
        },
        normal="normal",
        coverage="opacity",
        reflectance="specular",
        coat_ior="coat_IOR",
        coat_ior_default=1.5,
        lacks={
            **_lost("diffuse_roughness", "specular_anisotropy", "subsurface", "sheen", "thin_film_thickness"),
            **_lost(
                "transmission_scatter", "transmission_dispersion", "transmission_extra_roughness", of="transmission"
            ),
            **_lost("thin_walled", of="transmission"),
            **_lost("coat_anisotropy", "coat_affect_color", "coat_affect_roughness", of="coat"),
            "specular_color": Loss(1.0),
            "transmission_color": Loss(1.0, of="transmission"),
            "coat_color": Loss(1.0, of="coat"),
            "coat_normal": Loss(of="coat", same_as="normal"),
        },
        details=(
            *("specular_rotation", "coat_rotation", "tangent", "transmission_depth", "transmission_scatter_anisotropy"),
            *("subsurface_color", "subsurface_radius", "subsurface_scale", "subsurface_anisotropy", "subsurface_type"),
            *("sheen_color", "sheen_roughness", "thin_film_IOR"),
        ),
    )


def _diffuse(name: str, default: float, weight: str = "", weight_default: float = 1.0) -> ForeignSurface:
    """A matte surface, or what is left of one: no reflection at all."""
    return ForeignSurface(
        {
            "diffuseColor": Term(name, (default, default, default), weight, weight_default),
            "roughness": Term("", 1.0),
            "ior": Term("", 1.0),
        }
    )


def _disney(base: float, roughness: float) -> ForeignSurface:
    """Burley's principled model (Disney 2012)."""
    return ForeignSurface(
        {
            "diffuseColor": Term("baseColor", (base, base, base)),
            "metallic": Term("metallic", 0.0),
            "roughness": Term("roughness", roughness),
            "clearcoat": Term("clearcoat", 0.0),
            "clearcoatRoughness": Term("clearcoatGloss", 1.0, is_complement=True),
            "ior": Term("ior", 1.5),
            "opacity": Term("specTrans", 0.0, is_complement=True),
        },
        lacks=_lost("anisotropic", "sheen", "specularTint", "subsurface", "flatness"),
        details=("sheenTint", "subsurfaceDistance"),
    )


_PREVIEW_SURFACES = frozenset({"UsdPreviewSurface", "ND_UsdPreviewSurface_surfaceshader"})

_FOREIGN: Mapping[str, ForeignSurface] = {
    "ND_standard_surface_surfaceshader": _standard_surface(1.0, 0.8),
    "ND_standard_surface_surfaceshader_100": _standard_surface(0.8, 1.0),
    "standard_surface": _standard_surface(0.8, 1.0),
    "arnold:standard_surface": _standard_surface(0.8, 1.0),
    "ND_open_pbr_surface_surfaceshader": ForeignSurface(
        {
            "diffuseColor": Term("base_color", (0.8, 0.8, 0.8), "base_weight", 1.0),
            "emissiveColor": Term("emission_color", (1.0, 1.0, 1.0), "emission_luminance", 0.0),
            "metallic": Term("base_metalness", 0.0),
            "roughness": Term("specular_roughness", 0.3),
            "ior": Term("specular_ior", 1.5),
            "clearcoat": Term("coat_weight", 0.0),
            "clearcoatRoughness": Term("coat_roughness", 0.0),
            "opacity": Term("transmission_weight", 0.0, is_complement=True),
        },
        normal="geometry_normal",
        coverage="geometry_opacity",
        reflectance="specular_weight",
        coat_ior="coat_ior",
        coat_ior_default=1.6,
        lacks={
            **_lost("base_diffuse_roughness", "specular_roughness_anisotropy", "subsurface_weight", "fuzz_weight"),
            **_lost("thin_film_weight"),
            **_lost("transmission_depth", "transmission_dispersion_scale", of="transmission_weight"),
            **_lost("geometry_thin_walled", of="transmission_weight"),
            **_lost("coat_roughness_anisotropy", of="coat_weight"),
            "specular_color": Loss(1.0),
            "transmission_color": Loss(1.0, of="transmission_weight"),
            "coat_color": Loss(1.0, of="coat_weight"),
            "coat_darkening": Loss(default=1.0, of="coat_weight"),
            "geometry_coat_normal": Loss(of="coat_weight", same_as="geometry_normal"),
        },
        details=(
            *("transmission_scatter", "transmission_scatter_anisotropy", "transmission_dispersion_abbe_number"),
            *("subsurface_color", "subsurface_radius", "subsurface_radius_scale", "subsurface_scatter_anisotropy"),
            *("fuzz_color", "fuzz_roughness", "thin_film_thickness", "thin_film_ior"),
            *("geometry_tangent", "geometry_coat_tangent"),
        ),
    ),
    "ND_gltf_pbr_surfaceshader": ForeignSurface(
        {
            "diffuseColor": Term("base_color", (1.0, 1.0, 1.0)),
            "emissiveColor": Term("emissive", (0.0, 0.0, 0.0), "emissive_strength", 1.0),
            "metallic": Term("metallic", 1.0),
            "roughness": Term("roughness", 1.0),
            "ior": Term("ior", 1.5),
            "clearcoat": Term("clearcoat", 0.0),
            "clearcoatRoughness": Term("clearcoat_roughness", 0.0),
            "occlusion": Term("occlusion", 1.0),
            "opacity": Term("transmission", 0.0, is_complement=True),
        },
        normal="normal",
        coverage="alpha",
        coverage_mode="alpha_mode",
        reflectance="specular",
        coat_ior_default=1.5,
        lacks={
            **_lost("sheen_color", "iridescence", "thickness", "dispersion", "anisotropy_strength"),
            "specular_color": Loss(1.0),
            "clearcoat_normal": Loss(of="clearcoat", same_as="normal"),
        },
        details=(
            *("sheen_roughness", "iridescence_ior", "iridescence_thickness", "attenuation_distance"),
            *("attenuation_color", "anisotropy_rotation", "tangent"),
        ),
    ),
    "ND_surface_unlit": ForeignSurface(
        {
            "diffuseColor": Term("", (0.0, 0.0, 0.0)),
            "emissiveColor": Term("emission_color", (1.0, 1.0, 1.0), "emission", 1.0),
            "roughness": Term("", 1.0),
            "ior": Term("", 1.0),
        },
        coverage="opacity",
        lacks=_lost("transmission"),
        details=("transmission_color",),
    ),
    "arnold:lambert": _diffuse("Kd_color", 1.0, "Kd", 0.8),
    "mitsuba_diffuse": _diffuse("reflectance", 0.5),
    "MayaND_lambert_surfaceshader": _diffuse("color", 0.5, "diffuse", 0.8),
    "MayaND_blinn_surfaceshader": _diffuse("color", 0.5, "diffuse", 0.8),
    "MayaND_phong_surfaceshader": _diffuse("color", 0.5, "diffuse", 0.8),
    "PxrDiffuse": _diffuse("diffuseColor", 0.5),
    "PxrSurface": _diffuse("diffuseColor", 0.18, "diffuseGain", 1.0),
    "PxrDisney": _disney(0.5, 0.25),
    "ND_disney_principled": _disney(0.16, 0.5),
    "mitsuba_principled": ForeignSurface(
        {
            "diffuseColor": Term("base_color", (0.5, 0.5, 0.5)),
            "metallic": Term("metallic", 0.0),
            "roughness": Term("roughness", 0.5),
            "clearcoat": Term("clearcoat", 0.0),
        }
    ),
}


def is_preview_surface(shader: str) -> bool:
    """Return whether a shader identifier is UsdPreviewSurface's, or its twin's in MaterialX."""
    return shader in _PREVIEW_SURFACES


def foreign_surface(shader: str) -> ForeignSurface | None:
    """Return what another model is in the terms of UsdPreviewSurface; None for a model that is not known."""
    return _FOREIGN.get(shader)
