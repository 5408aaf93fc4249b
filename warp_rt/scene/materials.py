# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Surfaces, and the images, textures and primvars that their inputs read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np

from warp_rt.scene.programs import Program

LARGEST_INPUT = 2.0**60
"""Size beyond which no input of a surface counts: kernels multiply it, and float32 ends at 2^128."""


class MaterialModel(IntEnum):
    """Which illumination a material asks for."""

    WHITTED = 0
    """The lecture's terms: spec of ``WhittedSurface``."""
    PREVIEW = 1
    """UsdPreviewSurface."""


class Wrap(IntEnum):
    """What a texture holds outside [0, 1]."""

    BLACK = 0
    CLAMP = 1
    REPEAT = 2
    MIRROR = 3


class MagFilter(IntEnum):
    """What a texture holds between texels, where a sample sees less than one."""

    LINEAR = 0
    NEAREST = 1
    CUBIC = 2
    """A B-spline, which is smooth, and does not pass through the texels."""


class OpacityMode(IntEnum):
    """What opacity below one means: light through the material, or less of the material."""

    TRANSPARENT = 0
    PRESENCE = 1


class NormalFrame(IntEnum):
    """What x, y and z of a normal are along, z being the surface's own normal in the first two."""

    IMAGE = 1
    """x and y as the texture coordinates grow by which the image is read, moved by whatever moves them."""
    PRIMVAR = 2
    """x and y as the primvar's own do."""
    WORLD = 3
    """The axes of world space."""


@dataclass(frozen=True)
class Image:
    """Texels. Row 0 is the bottom one, where v = 0, as USD has it."""

    path: str
    pixels: np.ndarray
    """uint8 or float32, shape [height, width, 4]."""


@dataclass(frozen=True)
class Tiles:
    """UDIM tiles: a grid of images, each over one unit of texture coordinates each way."""

    left: int
    """Texture coordinate of the grid's left edge."""
    bottom: int
    images: tuple[tuple[int, ...], ...]
    """Rows of ``Scene.images``: from the lowest row of tiles up, each from left to right; -1 where there is no tile,
    which is transparent black."""

    def map(self, function: Callable[[int], int]) -> Tiles:
        """Return the same grid of other images; ``function`` takes and gives rows, -1 among them."""
        return replace(self, images=tuple(tuple(map(function, row)) for row in self.images))

    @property
    def present(self) -> tuple[int, ...]:
        """The images there are, in order."""
        return tuple(image for row in self.images for image in row if image >= 0)


@dataclass(frozen=True)
class Texture:
    """An image with all that a UsdUVTexture and what feeds its ``st`` say: out = decode(texel) * scale + bias."""

    image: int
    """Row of ``Scene.images``, or -1 where the file is unreadable: the result is then ``fallback``, unscaled. Of tiles,
    any of them."""
    tiles: Tiles | None = None
    """In place of the one image; wrap modes do not count."""
    primvar: str = "st"
    """Name of the two-component primvar that holds the texture coordinates."""
    uv_fallback: tuple[float, float] = (0.0, 0.0)
    uv_transform: np.ndarray = field(default_factory=lambda: np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], np.float32))
    """float32, shape [2, 3], applied to (u, v, 1)."""
    wrap_s: Wrap = Wrap.BLACK
    wrap_t: Wrap = Wrap.BLACK
    mag_filter: MagFilter = MagFilter.LINEAR
    scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    fallback: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    is_srgb: bool = False
    """Whether red, green and blue are decoded by the sRGB curve before filtering; alpha never is."""


@dataclass(frozen=True)
class Input:
    """One input of a surface: a constant, a texture's channel(s), a primvar, or what a program computes."""

    value: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    """The constant; for a primvar, the fallback where the mesh has none of that name. Scalars sit in element 0."""
    texture: int = -1
    """Row of ``Scene.textures``; -1: not textured."""
    primvar: str = ""
    """Name of the primvar that is read directly; empty: none."""
    channel: int = -1
    """0 to 3 picks red, green, blue or alpha; -1 takes the vector."""
    scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Of a primvar, or its fallback: what is read is value * scale + bias. A texture has its own."""
    bias: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    program: Program | None = None
    """What it is, in place of all else."""
    normal_frame: NormalFrame = NormalFrame.IMAGE
    """Of the input ``normal``."""

    @property
    def varies(self) -> bool:
        """Whether it is no constant."""
        return self.texture >= 0 or bool(self.primvar) or self.program is not None


MATERIAL_DEFAULTS: Mapping[MaterialModel, Mapping[str, tuple[float, ...]]] = {
    MaterialModel.WHITTED: {
        "ambient": (0.1, 0.1, 0.1),
        "diffuse": (0.8, 0.8, 0.8),
        "specular": (0.0, 0.0, 0.0),
        "shininess": (32.0,),
        "reflection": (0.0, 0.0, 0.0),
        "transmission": (0.0, 0.0, 0.0),
        "ior": (1.5,),
    },
    MaterialModel.PREVIEW: {
        "diffuseColor": (0.18, 0.18, 0.18),
        "emissiveColor": (0.0, 0.0, 0.0),
        "specularColor": (0.0, 0.0, 0.0),
        "metallic": (0.0,),
        "roughness": (0.5,),
        "clearcoat": (0.0,),
        "clearcoatRoughness": (0.01,),
        "opacity": (1.0,),
        "ior": (1.5,),
        "normal": (0.0, 0.0, 1.0),
        "occlusion": (1.0,),
    },
}
"""Inputs of each model and what they are where a material says nothing: docs/whitted.md, UsdPreviewSurface 2.6."""


@dataclass(frozen=True)
class Material:
    """A surface. Inputs that are absent have the defaults of their model's specification."""

    path: str
    model: MaterialModel
    inputs: Mapping[str, Input] = field(default_factory=dict)
    """By the specification's names: ``diffuse``, ``reflection``, ... or ``diffuseColor``, ``roughness``, ..."""
    use_specular_workflow: bool = False
    opacity_mode: OpacityMode = OpacityMode.TRANSPARENT
    opacity_threshold: float = 0.0
    is_single_sided: bool = False
    """Whether it is not there for rays that meet it from behind, as the cards of a model's draw mode are."""

    def lets_light_through(self, *, with_whitted: bool) -> bool:
        """Return whether shadow rays may pass through it: a WhittedSurface only where its transmission counts, too."""
        if self.model == MaterialModel.WHITTED:
            source = self.inputs.get("transmission")
            return with_whitted and source is not None and (source.varies or max(source.value[:3]) > 0)
        source = self.inputs.get("opacity")
        return source is not None and (source.varies or source.value[0] < 1)
