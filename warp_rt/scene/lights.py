# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights of a place and of a direction, and what shapes and shadows them; domes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np


class LightKind(IntEnum):
    """Shape of a light in its own space, as UsdLux has it."""

    POINT = 0
    """At the origin. ``radiance`` times the projected area ``pi radius^2`` is its radiant intensity."""
    DISTANT = 1
    """Light travels along -Z: ``radiance`` over a cone of full angle ``angle``; at angle 0, the irradiance itself."""
    SPHERE = 2
    """About the origin, of ``radius``."""
    RECT = 3
    """In the XY plane, ``width`` by ``height``, shining along -Z."""
    DISK = 4
    """In the XY plane, of ``radius``, shining along -Z."""
    CYLINDER = 5
    """Along X, of ``length`` and ``radius``, without caps."""
    MESH = 6
    """``triangles``, shining outwards."""


@dataclass(frozen=True)
class Shadow:
    """What a light's shadows are like: UsdLux ShadowAPI and the collection shadowLink."""

    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """What is left of the light where nothing of it arrives."""
    distance: float = np.inf
    """From a surface, beyond which nothing casts a shadow on it."""
    falloff: float = 0.0
    """Length at the end of ``distance`` over which shadows fade."""
    falloff_gamma: float = 1.0
    """Exponent of the strength that falls linearly over that length."""
    casters: np.ndarray | None = None
    """bool, shape [n], which of ``Scene.instances`` cast shadows; None: all."""

    @property
    def is_plain(self) -> bool:
        """Whether it is no more than the absence of the light: black, of everything, at any distance."""
        return self.casters is None and replace(self, casters=None) == Shadow()


@dataclass(frozen=True)
class Profile:
    """How much a light sends where: an IES profile, read linearly between its angles; beyond them it sends nothing.

    Angles are those of the direction that light leaves in, in the light's own space.
    """

    vertical: np.ndarray
    """float32, shape [n], n >= 2, from -Z, ascending, within [0, pi]."""
    horizontal: np.ndarray
    """float32, shape [m], m >= 2, about the axis from -X towards -Y, ascending, within [0, 2 pi]."""
    values: np.ndarray
    """float32, shape [m, n], factors of the light's radiance."""


@dataclass(frozen=True)
class Light:
    """A light with UsdLux's units resolved: ``radiance`` is what its surface sends out."""

    path: str
    kind: LightKind
    world_from_light: np.ndarray
    """float64, shape [4, 4]; its scale applies to the shape."""
    radiance: tuple[float, float, float]
    """intensity * 2^exposure * color * temperature, over the world-space area where normalised [nit]."""
    radius: float = 0.5
    width: float = 1.0
    height: float = 1.0
    length: float = 1.0
    angle: float = 0.0
    """Full cone angle of a distant light [rad]."""
    has_falloff: bool = True
    """False: a point light of the lecture, I_l = radiance at every distance (``warp_rt:falloff`` = "none")."""
    casts_shadow: bool = True
    diffuse: float = 1.0
    """Multiplier of the diffuse response."""
    specular: float = 1.0
    """Multiplier of the specular response."""
    focus: float = 0.0
    focus_tint: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cone_angle: float = np.pi
    """Half angle outside of which there is no light [rad]; pi: no cone."""
    cone_softness: float = 0.0
    receivers: np.ndarray | None = None
    """bool, shape [n], which of ``Scene.instances`` it illuminates; None: all."""
    shadow: Shadow = Shadow()
    profile: Profile | None = None
    image: int = -1
    """Texture of a rect light, row of ``Scene.images``, a factor of the radiance; -1: none. Its left edge is at local
    +X, its top at +Y: seen from the side that shines it is upright and unmirrored."""
    is_srgb: bool = False
    triangles: np.ndarray | None = None
    """Of a mesh light: float32, shape [n, 3, 3], its own space, wound as seen from outside. Rays meet the mesh that is
    drawn there, and not these."""
    ball_triangles: int = 0
    """So many triangles in a row stand for a ball, and the next ones for the next; 0: they stand for nothing else."""
    is_double_sided: bool = False
    """Whether a mesh light shines inwards, too."""
    is_closed: bool = False
    """Whether the triangles bound a volume: who is outside sees none from inside."""
    drawn_by: np.ndarray | None = None
    """Of a mesh light: int32, shape [n], rows of ``Scene.instances`` that draw its triangles, or what these stand for.
    Where they stop light, parts of it hide each other; None: nothing of it is drawn."""
    glows: bool = False
    """Whether the mesh of a mesh light emits by its material: what mirrors show of that is no highlight, too."""
    is_visible: bool = True
    """Whether eye rays see its shape where lights are visible; reflection and refraction rays always do there."""
    profile_angle_scale: float = 0.0
    """Above 0, vertical angles are divided by it before the profile is read; below 0, their distance from pi is by its
    negative; 0: neither."""

    @property
    def is_shaped(self) -> bool:
        """Whether a focus, a cone or a profile makes it send out more in some directions than in others."""
        return self.focus > 0 or self.cone_angle < np.pi or self.profile is not None

    @property
    def has_extent(self) -> bool:
        """Whether it is more than a point, so that its shadows are soft where it is sampled."""
        return self.kind != LightKind.POINT and (self.kind != LightKind.DISTANT or self.angle > 0)


@dataclass(frozen=True)
class Dome:
    """Light from infinitely far in all directions; the background where visible."""

    path: str
    world_from_light: np.ndarray
    """float64, shape [4, 4], only its rotation, mirrored or not, counts. Latitude-longitude images have their pole at
    local +Y, the image's centre at local +Z and u growing towards local -X, seen from inside."""
    radiance: tuple[float, float, float]
    """Multiplier of the image, or the radiance itself where there is none [nit]."""
    image: int = -1
    """Row of ``Scene.images`` or -1; row 0 of the image is the bottom, direction -Y."""
    is_srgb: bool = False
    is_visible: bool = True
    """Whether eye rays that leave the scene see it. Reflection and refraction rays always do."""
    diffuse: float = 1.0
    specular: float = 1.0
    casts_shadow: bool = True
    """Where it is sampled; as a whole it casts none."""
    receivers: np.ndarray | None = None
    """bool, shape [n], which of ``Scene.instances`` it illuminates; None: all."""
    shadow: Shadow = Shadow()
