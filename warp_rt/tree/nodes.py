# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the ray tree of a pixel is made of: nodes with their light terms and children, as they were traced.

Colours are linear Rec. 709 triples. Points and directions are in world space, lengths in scene units.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

Color = tuple[float, float, float]
Vector = tuple[float, float, float]


class RayKind(IntEnum):
    """What sent a ray."""

    EYE = 0
    REFLECTION = 1
    REFRACTION = 2
    PASSAGE = 3
    """Straight on through what is missing of a surface: no bounce."""


class Fate(IntEnum):
    """What became of a child that a node could have had."""

    NOT_ASKED = 0
    """Its coefficient is 0."""
    TRACED = 1
    THRESHOLD = 2
    """Dropped: its weight is below the threshold."""
    DEPTH = 3
    """Dropped: it would be deeper than the tree may be."""
    TOTAL_REFLECTION = 4
    """Of a refraction ray: total internal reflection, its share goes to the reflection ray."""
    PASSES = 5
    """Of a passage: the path has passed through too many surfaces."""


@dataclass(frozen=True)
class Place:
    """Which piece of the scene a ray met."""

    prim: str
    """Path."""
    instance: str
    """Path of the instance, empty where nothing is instanced."""
    face: int
    """Face of the mesh."""
    material: str
    """Path."""


@dataclass(frozen=True)
class Crossing:
    """A surface between a node and a light."""

    place: Place
    distance: float
    """From the node."""
    factor: Color
    """Share of the light that it lets through; 0 for what throws the shadow."""


@dataclass(frozen=True)
class LightTerm:
    """What one light adds to I_local."""

    light: str
    """Path."""
    kind: str
    """``point``, ``distant``, ..., ``dome``."""
    cosine: float | None
    """N.L; up to 0, the light adds nothing and the rest is not known. None for a dome that is not sampled."""
    direction: Vector
    """L, unit: the mean direction of the light that arrives; 0 where it is not known."""
    to_shadow: Vector
    """Unit direction of the shadow ray, to the light's centre or, of samples, the mean; 0 where it is not known."""
    distance: float
    """Length of the shadow ray, infinite for distant lights and domes."""
    color: Color
    """I_l; 0 for a dome that is not sampled, whose terms are its irradiance's."""
    visible: Color
    """S, what the shadow ray brought back; 1 for lights that cast no shadow."""
    samples: int
    """Taken of a light with an extent, or of a dome; 0: it counts as a whole. Of samples, direction, distance and I_l
    are means over what arrives from above the horizon, and S is the share that gets through."""
    shadow_rays: int
    unshadowed_diffuse: Color
    """I_l kd (N.L), or what UsdPreviewSurface has in its place."""
    unshadowed_specular: Color
    """I_l ks max(R_l.V, 0)^n, likewise."""
    total: Color
    """What was added to I_local: S times the two."""
    crossings: tuple[Crossing, ...] = ()
    """The surfaces on the shadow ray's way, nearest first; at an opaque one it ends. Of samples: on the first one's."""
    is_linked: bool = True
    """Whether the light illuminates the prim at all."""

    @property
    def has_shadow_ray(self) -> bool:
        """Whether any shadow ray was cast."""
        return self.shadow_rays > 0

    @property
    def is_facing(self) -> bool:
        """Whether the light is above the surface's horizon, and so has a term at all."""
        return self.cosine is None or self.cosine > 0

    @property
    def diffuse(self) -> Color:
        """S I_l kd (N.L)."""
        return _times(self.visible, self.unshadowed_diffuse)

    @property
    def specular(self) -> Color:
        """S I_l ks max(R_l.V, 0)^n."""
        return _times(self.visible, self.unshadowed_specular)

    @property
    def occluder(self) -> Place | None:
        """What throws the node into this light's shadow; None where some of the light arrives."""
        if any(self.visible) or not self.crossings:
            return None
        return self.crossings[-1].place


@dataclass(frozen=True)
class TreeNode:
    """A ray, what it met, and what it brings back: I = I_local + Kr R + Kt T."""

    index: int
    """Place in the order of tracing, through all samples; 0 is the first sample's eye ray."""
    kind: RayKind
    depth: int
    """Level; the eye ray's is 1."""
    weight: float
    """Product of the coefficients' largest channels from the eye to this ray: what the threshold is compared with."""
    coefficient: Color
    """Product of the coefficients from the eye to this ray: what its value is multiplied by."""
    origin: Vector
    direction: Vector
    distance: float
    """Along the ray; infinite where it left the scene."""
    place: Place | None
    """None where it left the scene."""
    model: str
    """``WhittedSurface``, ``UsdPreviewSurface``, or empty where it left the scene."""
    position: Vector
    """P; where the ray left the scene, not a number."""
    normal: Vector
    """N, unit, on the side that the ray came from."""
    presence: float
    """Share of the surface that is there; the rest lets the ray pass straight on."""
    emission: Color
    ambient: Color
    """The term ka Ia."""
    lights: tuple[LightTerm, ...]
    """All lights and domes, unless no light can add anything here (kd = ks = 0)."""
    local: Color
    """I_local; of a ray that left the scene, the background."""
    kr: Color
    """Kr of the material."""
    kt: Color
    """Kt of the material."""
    fresnel: Color | None
    """What the specular lobes of a UsdPreviewSurface reflect of light from all around, of smooth ones Fresnel's
    reflectance; Kr is the mirror's share of it. None for constants Kr and Kt."""
    eta: float
    """n_incoming / n_outgoing of a refraction: below 1 the ray enters, above it leaves, at 1 it goes straight on."""
    reflection: Fate
    refraction: Fate
    passage: Fate
    children: tuple[TreeNode, ...]
    """The reflection, the refraction and the passage, as far as they were traced."""
    value: Color
    """I, by the nested equation, in float64."""
    size: int
    """Nodes of the tree below, with this one."""
    deepest: int
    """Deepest level below."""

    @property
    def has_left(self) -> bool:
        """Whether the ray left the scene."""
        return self.place is None

    @property
    def is_totally_reflected(self) -> bool:
        """Whether total internal reflection happens here."""
        return self.refraction is Fate.TOTAL_REFLECTION

    @property
    def reflection_coefficient(self) -> Color:
        """What R is multiplied by: Kr, or Kr + Kt under total internal reflection."""
        return _plus(self.kr, self.kt) if self.is_totally_reflected else self.kr

    @property
    def contribution(self) -> Color:
        """What the node's own I_local adds to the pixel."""
        return _scaled(_times(self.coefficient, self.local), self.presence)

    @property
    def subtree_contribution(self) -> Color:
        """What the node with all below it adds to the pixel."""
        return _times(self.coefficient, self.value)

    @property
    def end(self) -> str:
        """Why the branch ended here; empty where it goes on."""
        if self.children:
            return ""
        if self.has_left:
            return "the ray left the scene"
        reasons = []
        for name, fate, coefficient in (
            ("reflection", self.reflection, self.reflection_coefficient),
            ("refraction", self.refraction, self.kt),
            ("passage", self.passage, (1.0 - self.presence,) * 3),
        ):
            if fate is Fate.THRESHOLD:
                weight = self.weight * self.presence * max(coefficient)
                reasons.append(f"{name} below the threshold (weight {weight:.3g})")
            elif fate is Fate.DEPTH:
                reasons.append(f"{name} deeper than the tree may be")
            elif fate is Fate.PASSES:
                reasons.append("passed through too many surfaces")
        return "; ".join(reasons) or "neither reflects nor transmits"

    def walk(self) -> Iterator[TreeNode]:
        """Yield this node and all below it, in the order of tracing."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            waiting.extend(reversed(node.children))

    def __repr__(self) -> str:
        met = self.place.prim if self.place else "nothing"
        return (
            f"<TreeNode {self.index}: {self.kind.name.lower()} at depth {self.depth}, met {met}, {self.size:,} nodes>"
        )


def nested_value(
    local: Color, kr: Color, reflected: Color, kt: Color, refracted: Color, presence: float, behind: Color
) -> Color:
    """Return I = presence (I_local + Kr R + Kt T) + (1 - presence) I_behind."""
    red, green, blue = (
        presence * (own + a * r + b * t) + (1.0 - presence) * far
        for own, a, r, b, t, far in zip(local, kr, reflected, kt, refracted, behind, strict=True)
    )
    return red, green, blue


def _plus(a: Any, b: Any) -> Color:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _times(a: Any, b: Any) -> Color:
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def _scaled(a: Any, factor: float) -> Color:
    return a[0] * factor, a[1] * factor, a[2] * factor
