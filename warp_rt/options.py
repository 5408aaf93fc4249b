# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How to render: one frozen dataclass, validated when it is made."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from numbers import Integral, Real
from typing import Any

from warp_rt.errors import OptionError
from warp_rt.near_matches import near_matches

INTEGRATORS = ("whitted",)
SHADOWS = ("auto", "opaque", "transmit")
TEXTURE_FILTERS = ("anisotropic", "bilinear")
BUILDERS = ("sah", "median", "midpoint", "lbvh", "ploc")
INTERSECTORS = ("watertight", "moller-trumbore", "plane-projection")
COSTS = ("nodesVisited", "triangleTests", "treeSize", "deepest", "rays")
"""AOVs that count what a pixel took."""
AOVS = (
    *("color", "depth", "cameraDepth", "distance", "normal", "Neye", "position", "Peye", "uv"),
    *("primId", "instanceId", "elementId"),
    *COSTS,
)
_PRIMVAR_AOV = re.compile(r"primvars:[^\W\d]\w*(?::[^\W\d]\w*)*")
COMPLEXITIES = ("low", "medium", "high", "veryhigh")
"""Names of the refinement levels 0 to 3 of subdivision surfaces, as usdrecord has them."""
ADAPTIVE = "auto"
"""Name of the complexity that refines each surface by the size of its edges in the picture."""
PURPOSES = ("default", "render", "proxy", "guide")
RECORD_PURPOSES = ("default", "proxy")
"""What is drawn where nothing says which purposes: usdrecord's."""
PRODUCT_PURPOSES = ("default", "render")
"""What is drawn in a RenderProduct whose settings do not say: the schema's fallback of includedPurposes."""

DEFAULT_WIDTH = 960  # usdrecord's
DEFAULT_DEPTH = 7
DEFAULT_THRESHOLD = 1.0 / 255.0
MAX_SIZE = 65536  # a side of the image [pixel]
MAX_DEPTH = 1024
MAX_LIGHT_SAMPLES = 65536
MAX_SERIES = 100  # pictures: what fits on a contact sheet


@dataclass(frozen=True, kw_only=True)
class RenderOptions:
    """Options of a render. None means: as the stage's render settings say, else the default given here."""

    width: int | None = None
    """Image width [pixel]; default 960. With only one side given, the other follows from the camera's aspect."""
    height: int | None = None
    """Image height [pixel]; default from the camera's aspect ratio, truncated as usdrecord does."""
    spp: int = 1
    """Samples a pixel; one goes through the pixel's centre."""
    integrator: str = "whitted"
    """One of ``INTEGRATORS``."""
    depth: int | None = None
    """Levels of the ray tree; the eye ray is level 1; default 7."""
    threshold: float | None = None
    """Children of the tree whose weight is strictly below are dropped; 0: never; default 1/255."""
    light_samples: int | None = None
    """Samples of each dome and each light with an extent, at every node of the ray tree; 0: closed forms and sharp
    shadows; default 0."""
    lights_visible: bool = False
    """Whether eye, reflection and refraction rays meet lights of a shape as surfaces that shine, on the side that does.
    The lecture's ray tree has no lights in it."""
    shadows: str = "auto"
    """One of ``SHADOWS``: what a transparent surface does to a shadow ray."""
    texture_filter: str = "anisotropic"
    """One of ``TEXTURE_FILTERS``: the mean of what a sample sees of a texture, or the four texels about its ray."""
    ambient: tuple[float, float, float] | None = None
    """Ambient light Ia, linear Rec. 709; default black."""
    background: tuple[float, float, float] | None = None
    """Colour of rays that leave the scene; default black; a visible dome light takes precedence."""
    aovs: tuple[str, ...] = ("color",)
    """Outputs, from ``AOVS``, and ``primvars:NAME`` for any primvar."""
    seed: int = 0
    """Of the sample positions, in pixels and on lights."""
    crop: tuple[int, int, int, int] | None = None
    """x, y, width, height of the part that is rendered, from the top left corner [pixel]; the film has that size."""
    bvh: str = "sah"
    """One of ``BUILDERS``."""
    intersector: str = "watertight"
    """One of ``INTERSECTORS``."""
    threads: int | None = None
    """CPU threads; default: one a core."""
    tile_size: int | None = None
    """Side of the square tiles that threads work on [pixel]; default: 64, less where that is few tiles for the threads.
    Never changes the image."""
    time_limit: float | None = None
    """Wall-clock seconds after which rendering ends with a LimitError."""

    def __post_init__(self) -> None:
        for name in ("aovs", "ambient", "background", "crop"):
            if getattr(self, name) is not None or name == "aovs":
                object.__setattr__(self, name, _as_tuple(name, getattr(self, name)))
        for name in ("spp", "seed"):
            if getattr(self, name) is None:
                raise OptionError(f"{name}: a whole number expected, got None")
        _whole_number("width", self.width, 1, MAX_SIZE)
        _whole_number("height", self.height, 1, MAX_SIZE)
        _whole_number("spp", self.spp, 1, 1 << 20)
        _whole_number("depth", self.depth, 1, MAX_DEPTH)
        _number("threshold", self.threshold, 0.0, math.inf)
        _whole_number("light_samples", self.light_samples, 0, MAX_LIGHT_SAMPLES)
        _whole_number("seed", self.seed, 0, (1 << 31) - 1)
        check_threads(self.threads)
        _whole_number("tile_size", self.tile_size, 1, MAX_SIZE)
        _number("time_limit", self.time_limit, 0.0, math.inf)
        if self.lights_visible not in (True, False):
            raise OptionError(f"lights_visible: True or False expected, got {self.lights_visible!r}")
        _one_of("integrator", self.integrator, INTEGRATORS)
        _one_of("shadows", self.shadows, SHADOWS)
        _one_of("texture_filter", self.texture_filter, TEXTURE_FILTERS)
        _one_of("bvh", self.bvh, BUILDERS)
        _one_of("intersector", self.intersector, INTERSECTORS)
        for aov in self.aovs:
            if not is_primvar_aov(aov):
                _one_of("aov", aov, AOVS)
        _color("ambient", self.ambient)
        _color("background", self.background)
        _crop(self.crop)


def is_primvar_aov(aov: Any) -> bool:
    """Return whether an AOV is a primvar, ``primvars:NAME`` with a name that USD allows."""
    return isinstance(aov, str) and _PRIMVAR_AOV.fullmatch(aov) is not None


def check_threads(threads: Any) -> None:
    """Check a number of CPU threads; None is one a core.

    Raises:
        OptionError: It is no whole number from 1 to 4096.
    """
    _whole_number("threads", threads, 1, 4096)


def check_depths(depths: Sequence[Any]) -> tuple[int, ...]:
    """Return the depths of a series of pictures.

    Raises:
        OptionError: There are none or too many, one is no depth, or they do not grow.
    """
    if not 1 <= len(depths) <= MAX_SERIES:
        raise OptionError(f"depths: 1 to {MAX_SERIES} pictures expected, got {len(depths)}")
    for depth in depths:
        _whole_number("depths", depth, 1, MAX_DEPTH)
    for before, after in pairwise(depths):
        if after <= before:
            raise OptionError(f"depths: {after} comes after {before}; they have to grow, such as 1, 2, 3")
    return tuple(int(depth) for depth in depths)


def check_mask(mask: Sequence[Any]) -> tuple[str, ...]:
    """Return the paths that a stage is composed of.

    Raises:
        OptionError: They are no sequence of texts.
    """
    paths = _as_tuple("mask", mask)
    for path in paths:
        if not isinstance(path, str):
            raise OptionError(f"mask: paths expected, got {path!r}")
    return paths


def refinement_level(complexity: str) -> int:
    """Return how often a complexity refines subdivision surfaces.

    Raises:
        OptionError: There is no such complexity.
    """
    _one_of("complexity", complexity, COMPLEXITIES)
    return COMPLEXITIES.index(complexity)


def check_purposes(purposes: Sequence[str] | None) -> None:
    """Return if these purposes can be drawn; None leaves them to the stage.

    Raises:
        OptionError: One is unknown, or there is none.
    """
    if purposes is None:
        return
    if not _as_tuple("purposes", purposes):
        raise OptionError(f"purposes: at least one of {', '.join(PURPOSES)} expected")
    for purpose in purposes:
        _one_of("purposes", purpose, PURPOSES)


def _as_tuple(name: str, value: Any) -> tuple[Any, ...]:
    if isinstance(value, str):  # which Python would take for a sequence of letters
        raise OptionError(f"{name}: a sequence expected, such as ({value!r},)")
    try:
        return tuple(value)
    except TypeError:
        raise OptionError(f"{name}: a sequence expected, got {value!r}") from None


def _whole_number(name: str, value: Any, low: int, high: int) -> None:
    if value is not None and (not isinstance(value, Integral) or isinstance(value, bool)):
        raise OptionError(f"{name}: a whole number expected, got {value!r}")
    _number(name, value, low, high)


def _number(name: str, value: Any, low: float, high: float) -> None:
    if value is None:
        return
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not is_number:
        raise OptionError(f"{name}: a number expected, got {value!r}")
    if not low <= value <= high:
        raise OptionError(f"{name}: {value} is outside {low}..{high}")


def _color(name: str, value: tuple[Any, ...] | None) -> None:
    if value is not None and (len(value) != 3 or not all(isinstance(c, Real) and math.isfinite(c) for c in value)):
        raise OptionError(f"{name}: three finite numbers expected, got {value!r}")


def _crop(value: tuple[Any, ...] | None) -> None:
    if value is None:
        return
    is_crop = len(value) == 4 and all(isinstance(part, Integral) for part in value)
    if not is_crop or min(value[:2]) < 0 or min(value[2:]) < 1:
        raise OptionError(f"crop: whole numbers x, y >= 0 and width, height >= 1 expected, got {value!r}")


def _one_of(name: str, value: Any, choices: tuple[str, ...]) -> None:
    if value not in choices:
        hint = near_matches(value, choices) if isinstance(value, str) else ""
        raise OptionError(f"{name}: {value!r} is none of {', '.join(choices)}{hint}")
